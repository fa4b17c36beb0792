/* How far each method is from the truth: eq. 31 of McGuire, Ambient Occlusion Volumes, 2009, on
 * views of real scenes, at each preset, raw and filtered.
 *
 * Usage: bench-error [--size WxH] [--rays N] [--method M] [--preset P] [--set NAME=VALUE]...
 *                    [--scene NAME] [--view NAME] [--cache FOLDER] [--images FOLDER] [--brief]
 * [--markdown]
 * --cache keeps truths between runs; --images writes pictures and signed error maps; --brief prints
 * one line: the mean errors of the filtered pictures. */
#include "views.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SET_MAX = 32, PRESETS = 2 };

struct options {
    int width, height, rays;
    const char *method, *preset, *scene, *view, *cache, *images;
    const char *names[SET_MAX], *values[SET_MAX];
    int set_count;
    bool brief, markdown;
};

struct cell {
    double sum[2], rmse[2], mean[2], ms;
    int count;
};

static const char *const presets[PRESETS] = {"calibrated", "paper"};

static int complain(const struct cranny_error *why)
{
    fprintf(stderr, "bench-error: %s\n", why->message);
    return cranny_exit_status(why->status);
}

static enum cranny_status save_images(const struct view *view, const struct options *o,
                                      const char *label, const float *picture, const float *truth,
                                      struct cranny_error *why)
{
    char path[1024];
    uint8_t *map = malloc((size_t)o->width * (size_t)o->height * 3);
    if (!map)
        return CRANNY_MEMORY;
    snprintf(path, sizeof path, "%s/%s-%s-%s.png", o->images, view->scene, view->name, label);
    enum cranny_status status = cranny_image_write(path, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_AUTO,
                                                   o->width, o->height, 1, picture, 0, why);
    snprintf(path, sizeof path, "%s/%s-%s-%s-map.png", o->images, view->scene, view->name, label);
    if (status == CRANNY_OK && picture != truth)
        status = cranny_difference_map(o->width, o->height, picture, 0, truth, 0, 0.5f, map, why);
    if (status == CRANNY_OK && picture != truth)
        status = cranny_png_write(path, o->width, o->height, 3, map, (size_t)o->width * 3, why);
    free(map);
    return status;
}

static enum cranny_status measure(const struct cranny_gbuffer *gbuffer, const struct view *view,
                                  const struct options *o, enum cranny_method method,
                                  const char *preset, const float *truth, float *picture,
                                  struct cell *cell, struct cranny_error *why)
{
    struct cranny_screen_params params = cranny_screen_params_preset(method, preset);
    struct cranny_screen_report report;
    params.radius_world = view->radius_world;
    params.report = &report;
    enum cranny_status status = CRANNY_OK;
    for (int i = 0; i < o->set_count && status == CRANNY_OK; i++)
        status = cranny_params_set(cranny_screen_param_table(method), &params, o->names[i],
                                   o->values[i], why);
    const int filter = params.filter;
    for (int raw = 0; raw < 2 && status == CRANNY_OK; raw++) {
        struct cranny_difference d;
        params.filter = raw ? CRANNY_FILTER_NONE : filter;
        status = cranny_screen_render(gbuffer, &params, picture, 0, why);
        if (status == CRANNY_OK)
            status = cranny_difference_measure(o->width, o->height, picture, 0, truth, 0, &d, why);
        if (status != CRANNY_OK)
            break;
        cell->sum[raw] += d.error;
        cell->rmse[raw] += d.rmse;
        cell->mean[raw] += d.mean;
        if (!raw)
            cell->ms += report.total_ms;
        char label[64];
        snprintf(label, sizeof label, "%s-%s%s", cranny_method_name(method), preset,
                 raw ? "-raw" : "");
        if (o->images)
            status = save_images(view, o, label, picture, truth, why);
    }
    cell->count++;
    return status;
}

static enum cranny_status run_view(const struct view *view, struct view_stage *stage,
                                   const struct options *o,
                                   struct cell cells[CRANNY_METHOD_COUNT][PRESETS],
                                   struct cranny_error *why)
{
    struct view_sight sight;
    float *picture = malloc((size_t)o->width * (size_t)o->height * sizeof *picture);
    enum cranny_status status =
        view_see(stage, view, o->width, o->height, o->rays, o->cache, &sight, why);
    if (status == CRANNY_OK && o->images)
        status = save_images(view, o, "truth", sight.truth, sight.truth, why);
    for (int m = 0; m < CRANNY_METHOD_COUNT && status == CRANNY_OK && picture; m++) {
        if (o->method && strcmp(o->method, cranny_method_name((enum cranny_method)m)) != 0)
            continue;
        for (int k = 0; k < PRESETS && status == CRANNY_OK; k++)
            if (!o->preset || strcmp(o->preset, presets[k]) == 0)
                status = measure(&sight.gbuffer, view, o, (enum cranny_method)m, presets[k],
                                 sight.truth, picture, &cells[m][k], why);
    }
    view_sight_free(&sight);
    free(picture);
    return status;
}

static void print_lines(const char *title, struct cell cells[CRANNY_METHOD_COUNT][PRESETS])
{
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        for (int k = 0; k < PRESETS; k++) {
            const struct cell *c = &cells[m][k];
            const double n = c->count;
            if (c->count)
                printf("%-16s %-9s %-10s %7.3f %7.3f  rmse %.4f %.4f  bias %+.4f  %6.1f ms\n",
                       title, cranny_method_name((enum cranny_method)m), presets[k], c->sum[1] / n,
                       c->sum[0] / n, c->rmse[1] / n, c->rmse[0] / n, c->mean[0] / n, c->ms / n);
        }
}

/* A row a preset: each method's error raw and filtered, and in brackets the filtered rmse. */
static void print_rows(const char *title, struct cell cells[CRANNY_METHOD_COUNT][PRESETS])
{
    for (int k = 0; k < PRESETS; k++) {
        printf("| %s | %s |", title, presets[k]);
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
            const struct cell *c = &cells[m][k];
            if (c->count)
                printf(" %.2f → %.2f (%.3f) |", c->sum[1] / c->count, c->sum[0] / c->count,
                       c->rmse[0] / c->count);
            else
                printf(" |");
        }
        printf("\n");
    }
}

static void print_cells(const char *title, struct cell cells[CRANNY_METHOD_COUNT][PRESETS],
                        const struct options *o)
{
    if (o->markdown)
        print_rows(title, cells);
    else
        print_lines(title, cells);
}

static void print_head(void)
{
    printf("| view | preset |");
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        printf(" %s |", cranny_method_name((enum cranny_method)m));
    printf("\n|---|---|");
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        printf("---|");
    printf("\n");
}

static void add_cells(struct cell to[CRANNY_METHOD_COUNT][PRESETS],
                      struct cell from[CRANNY_METHOD_COUNT][PRESETS])
{
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        for (int k = 0; k < PRESETS; k++) {
            struct cell *t = &to[m][k];
            const struct cell *f = &from[m][k];
            for (int i = 0; i < 2; i++) {
                t->sum[i] += f->sum[i];
                t->rmse[i] += f->rmse[i];
                t->mean[i] += f->mean[i];
            }
            t->ms += f->ms;
            t->count += f->count;
        }
}

static bool parse(int argc, char **argv, struct options *o)
{
    *o = (struct options){.width = 640, .height = 360, .rays = 1024};
    for (int i = 1; i < argc; i++) {
        const char *name = argv[i];
        const bool flag = strcmp(name, "--brief") == 0 || strcmp(name, "--markdown") == 0;
        if (flag) {
            o->brief |= name[2] == 'b';
            o->markdown |= name[2] == 'm';
            continue;
        }
        if (++i == argc)
            return false;
        char *equals;
        if (strcmp(name, "--size") == 0) {
            if (sscanf(argv[i], "%dx%d", &o->width, &o->height) != 2)
                return false;
        } else if (strcmp(name, "--rays") == 0)
            o->rays = atoi(argv[i]);
        else if (strcmp(name, "--method") == 0)
            o->method = argv[i];
        else if (strcmp(name, "--preset") == 0)
            o->preset = argv[i];
        else if (strcmp(name, "--scene") == 0)
            o->scene = argv[i];
        else if (strcmp(name, "--view") == 0)
            o->view = argv[i];
        else if (strcmp(name, "--cache") == 0)
            o->cache = argv[i];
        else if (strcmp(name, "--images") == 0)
            o->images = argv[i];
        else if (strcmp(name, "--set") == 0 && (equals = strchr(argv[i], '=')) &&
                 o->set_count < SET_MAX) {
            *equals = 0;
            o->names[o->set_count] = argv[i];
            o->values[o->set_count++] = equals + 1;
        } else
            return false;
    }
    return o->width > 0 && o->height > 0 && o->rays > 0;
}

int main(int argc, char **argv)
{
    struct options o;
    if (!parse(argc, argv, &o)) {
        fprintf(stderr, "bench-error: wrong usage; see the head of bench/error.c\n");
        return 2;
    }
    struct view_stage stage = {0};
    struct cell all[CRANNY_METHOD_COUNT][PRESETS] = {0};
    struct cranny_error why = {0};
    enum cranny_status status = CRANNY_OK;
    int seen = 0;
    if (o.markdown)
        print_head();
    for (int v = 0; v < view_count && status == CRANNY_OK; v++) {
        if ((o.scene && strcmp(o.scene, views[v].scene) != 0) ||
            (o.view && strcmp(o.view, views[v].name) != 0))
            continue;
        char *path = view_path(&views[v]);
        if (!path) {
            printf("%s %s: SKIPPED: not in CRANNY_SCENES\n", views[v].scene, views[v].name);
            continue;
        }
        free(path);
        struct cell cells[CRANNY_METHOD_COUNT][PRESETS] = {0};
        status = run_view(&views[v], &stage, &o, cells, &why);
        char title[64];
        snprintf(title, sizeof title, "%s %s", views[v].scene, views[v].name);
        if (!o.brief)
            print_cells(title, cells, &o);
        fflush(stdout);
        add_cells(all, cells);
        seen++;
    }
    view_leave(&stage);
    if (status != CRANNY_OK)
        return complain(&why);
    if (seen)
        print_cells("mean", all, &o);
    return 0;
}
