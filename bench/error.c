/* How far each method is from the truth: eq. 31 of McGuire, Ambient Occlusion Volumes, 2009, on
 * views of real scenes, at each preset, raw and filtered.
 *
 * Usage: bench-error [--size WxH] [--rays N] [--method M] [--preset P] [--set NAME=VALUE]...
 *                    [--scene NAME] [--view NAME] [--cache FOLDER] [--images FOLDER] [--brief]
 * [--markdown]
 * --cache keeps truths between runs; --images writes pictures and signed error maps; --brief prints
 * one line: the mean errors of the filtered pictures. */
#include "../cli/method.h"
#include "views.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SET_MAX = 32, PRESETS = 2 };

/* All but the truth's own method, which comes last. */
enum { ROWS = METHOD_COUNT - 1 };

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

static bool has_row(const struct cranny_param_table *table, const char *name)
{
    char text[64];
    return cranny_params_get(table, &(union method_params){0}, name, text, sizeof text) > 0;
}

/* One picture into a cell's filtered (0) or raw (1) half. */
static enum cranny_status measure_once(const struct method *method,
                                       const struct method_input *input,
                                       const union method_params *params,
                                       struct method_state *state, const struct options *o,
                                       const float *truth, float *picture, struct cell *cell,
                                       int raw, struct cranny_error *why)
{
    struct method_report report;
    struct cranny_difference d;
    enum cranny_status status = method_run(method, input, params, state, picture, &report, why);
    if (status == CRANNY_OK)
        status = cranny_difference_measure(o->width, o->height, picture, 0, truth, 0, &d, why);
    if (status != CRANNY_OK)
        return status;
    cell->sum[raw] += d.error;
    cell->rmse[raw] += d.rmse;
    cell->mean[raw] += d.mean;
    if (!raw)
        cell->ms += report.total_ms;
    return CRANNY_OK;
}

/* Methods without a filter have one picture for both halves. */
static enum cranny_status measure(const struct method_input *input, struct method_state *state,
                                  const struct view *view, const struct options *o,
                                  const struct method *method, const char *preset,
                                  const float *truth, float *picture, struct cell *cell,
                                  struct cranny_error *why)
{
    const struct cranny_param_table *table = method_table(method);
    union method_params params;
    enum cranny_status status = CRANNY_OK;
    method_params_preset(method, preset, &params);
    *method_fields(method, &params).radius_world = view->radius_world;
    for (int i = 0; i < o->set_count && status == CRANNY_OK; i++)
        status = cranny_params_set(table, &params, o->names[i], o->values[i], why);
    for (int raw = 0; raw < 2 && status == CRANNY_OK; raw++) {
        char label[64];
        if (raw && has_row(table, "filter"))
            status = cranny_params_set(table, &params, "filter", "none", why);
        if (status == CRANNY_OK)
            status = measure_once(method, input, &params, state, o, truth, picture, cell, raw, why);
        snprintf(label, sizeof label, "%s-%s%s", method->name, preset, raw ? "-raw" : "");
        if (status == CRANNY_OK && o->images)
            status = save_images(view, o, label, picture, truth, why);
    }
    cell->count++;
    return status;
}

static enum cranny_status run_view(const struct view *view, struct view_stage *stage,
                                   const struct options *o, struct cell cells[ROWS][PRESETS],
                                   struct cranny_error *why)
{
    struct view_sight sight;
    struct method_state state = {0};
    float *picture = malloc((size_t)o->width * (size_t)o->height * sizeof *picture);
    enum cranny_status status =
        view_see(stage, view, o->width, o->height, o->rays, o->cache, &sight, why);
    if (status == CRANNY_OK && o->images)
        status = save_images(view, o, "truth", sight.truth, sight.truth, why);
    const struct method_input input = {stage->scene, sight.frame, sight.gbuffer};
    for (int m = 0; m < ROWS && status == CRANNY_OK && picture; m++) {
        if (o->method && strcmp(o->method, methods[m].name) != 0)
            continue;
        for (int k = 0; k < PRESETS && status == CRANNY_OK; k++)
            if (!o->preset || strcmp(o->preset, presets[k]) == 0)
                status = measure(&input, &state, view, o, &methods[m], presets[k], sight.truth,
                                 picture, &cells[m][k], why);
    }
    method_state_free(&state);
    view_sight_free(&sight);
    free(picture);
    return status;
}

static void print_lines(const char *title, struct cell cells[ROWS][PRESETS])
{
    for (int m = 0; m < ROWS; m++)
        for (int k = 0; k < PRESETS; k++) {
            const struct cell *c = &cells[m][k];
            const double n = c->count;
            if (c->count)
                printf("%-16s %-9s %-10s %7.3f %7.3f  rmse %.4f %.4f  bias %+.4f  %6.1f ms\n",
                       title, methods[m].name, presets[k], c->sum[1] / n, c->sum[0] / n,
                       c->rmse[1] / n, c->rmse[0] / n, c->mean[0] / n, c->ms / n);
        }
}

/* A row a preset: each method's error raw and filtered, and in brackets the filtered rmse. */
static void print_rows(const char *title, struct cell cells[ROWS][PRESETS])
{
    for (int k = 0; k < PRESETS; k++) {
        printf("| %s | %s |", title, presets[k]);
        for (int m = 0; m < ROWS; m++) {
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

static void print_cells(const char *title, struct cell cells[ROWS][PRESETS],
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
    for (int m = 0; m < ROWS; m++)
        printf(" %s |", methods[m].name);
    printf("\n|---|---|");
    for (int m = 0; m < ROWS; m++)
        printf("---|");
    printf("\n");
}

static void add_cells(struct cell to[ROWS][PRESETS], struct cell from[ROWS][PRESETS])
{
    for (int m = 0; m < ROWS; m++)
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
    struct cell all[ROWS][PRESETS] = {0};
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
        struct cell cells[ROWS][PRESETS] = {0};
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
