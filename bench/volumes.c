/* Ambient occlusion volumes on views of real scenes: error against the truth (eq. 31 of McGuire,
 * Ambient Occlusion Volumes, 2009) and time, over radii and sampling rates.
 *
 * Usage: bench-volumes [--size WxH] [--rays N] [--radius M]... [--spacing N]... [--preset P]
 *                      [--set NAME=VALUE]... [--scene NAME] [--view NAME] [--cache FOLDER]
 *                      [--images FOLDER] [--runs N] [--versus] [--brief] [--markdown]
 * --radius in metres, instead of the views' own; --versus is another bench: rays on the same cores
 * that reach the same error, over five views and three radii (volumes_versus.c); --cache keeps
 * truths between runs; --images writes pictures and signed error maps; --brief prints means alone.
 */
#include "volumes_versus.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { SET_MAX = 32, LIST_MAX = 8, RUNS_MAX = 99 };

struct options {
    int width, height, rays, runs;
    float radii[LIST_MAX];
    int radius_count, spacings[LIST_MAX], spacing_count;
    const char *preset, *scene, *view, *cache, *images;
    const char *names[SET_MAX], *values[SET_MAX];
    int set_count;
    bool versus, brief, markdown;
};

struct row {
    double error, rmse, bias, ms;
    int count;
};

struct work {
    const struct options *o;
    struct view_stage stage;
    const char *made_for; /* the scene of the volumes */
    struct cranny_volumes *volumes;
    float *picture;
    struct row means[LIST_MAX];
};

static int complain(const struct cranny_error *why)
{
    fprintf(stderr, "bench-volumes: %s\n", why->message);
    return cranny_exit_status(why->status);
}

static enum cranny_status save_images(const struct view *view, const struct work *w,
                                      const char *label, const float *truth,
                                      struct cranny_error *why)
{
    char path[1024];
    const int width = w->o->width, height = w->o->height;
    uint8_t *map = malloc((size_t)width * (size_t)height * 3);
    if (!map)
        return CRANNY_MEMORY;
    snprintf(path, sizeof path, "%s/%s-%s-%s.png", w->o->images, view->scene, view->name, label);
    enum cranny_status status = cranny_image_write(path, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_AUTO,
                                                   width, height, 1, w->picture, 0, why);
    snprintf(path, sizeof path, "%s/%s-%s-%s-map.png", w->o->images, view->scene, view->name,
             label);
    if (status == CRANNY_OK)
        status = cranny_difference_map(width, height, w->picture, 0, truth, 0, 0.5f, map, why);
    if (status == CRANNY_OK)
        status = cranny_png_write(path, width, height, 3, map, (size_t)width * 3, why);
    free(map);
    return status;
}

static enum cranny_status make_volumes(struct work *w, const struct cranny_volumes_params *params,
                                       const struct view *view, struct cranny_error *why)
{
    if (w->made_for && strcmp(w->made_for, view->scene) == 0)
        return CRANNY_OK;
    cranny_volumes_destroy(&w->volumes);
    enum cranny_status status = cranny_volumes_create(w->stage.scene, params, &w->volumes, why);
    if (status != CRANNY_OK)
        return status;
    const struct cranny_volumes_info info = cranny_volumes_info(w->volumes);
    w->made_for = view->scene;
    if (!w->o->brief)
        printf("%s%s: %llu triangles, %llu polygons (%llu quads, %llu triangles dropped), %.1f MB, "
               "%.2f s%s\n",
               w->o->markdown ? "\n" : "", view->scene, (unsigned long long)info.triangles,
               (unsigned long long)info.polygons, (unsigned long long)info.quads,
               (unsigned long long)info.dropped, (double)info.size_bytes * 1e-6, info.seconds,
               w->o->markdown ? "\n" : "");
    return CRANNY_OK;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static enum cranny_status time_volumes(struct work *w, const struct cranny_gbuffer *gbuffer,
                                       struct cranny_volumes_params *params, double *ms,
                                       struct cranny_error *why)
{
    double times[RUNS_MAX];
    struct cranny_volumes_report report;
    params->report = &report;
    for (int i = 0; i < w->o->runs; i++) {
        const enum cranny_status status =
            cranny_volumes_render(w->volumes, gbuffer, params, w->picture, 0, why);
        if (status != CRANNY_OK)
            return status;
        times[i] = report.total_ms;
    }
    qsort(times, (size_t)w->o->runs, sizeof *times, compare_doubles);
    *ms = times[w->o->runs / 2];
    if (!w->o->brief && !w->o->markdown)
        printf("    %.1f M candidates, %.2f M blocks tested, %.2f M evaluated, %.1f M pairs, "
               "%.2f M arcs, %.0f k pixels "
               "(%.0f k refined), filter %.1f ms\n",
               (double)report.candidates * 1e-6, (double)report.tested * 1e-6,
               (double)report.evaluated * 1e-6, (double)report.pairs * 1e-6,
               (double)report.arcs * 1e-6, (double)report.pixels * 1e-3,
               (double)report.refined * 1e-3, report.filter_ms);
    return CRANNY_OK;
}

static void print_row(const struct options *o, const char *title, float radius, int spacing,
                      const struct row *r)
{
    const double n = r->count;
    printf(o->markdown ? "| %s | %.3g | 1/%d | %.2f | %.4f | %+.4f | %.1f |"
                       : "%-18s radius %-5.3g 1/%-3d error %6.3f  rmse %.4f  bias %+.4f  %7.1f ms",
           title, (double)radius, spacing * spacing, r->error / n, r->rmse / n, r->bias / n,
           r->ms / n);
    printf("\n");
    fflush(stdout);
}

static enum cranny_status run_rate(struct work *w, const struct view *view,
                                   const struct view_sight *sight,
                                   struct cranny_volumes_params *params, int k,
                                   struct cranny_error *why)
{
    struct cranny_difference d;
    struct row row = {.count = 1}, *mean = &w->means[k];
    params->spacing = w->o->spacings[k];
    enum cranny_status status = time_volumes(w, &sight->gbuffer, params, &row.ms, why);
    if (status == CRANNY_OK)
        status = cranny_difference_measure(w->o->width, w->o->height, w->picture, 0, sight->truth,
                                           0, &d, why);
    if (status != CRANNY_OK)
        return status;
    row.error = d.error;
    row.rmse = d.rmse;
    row.bias = d.mean;
    char title[64];
    snprintf(title, sizeof title, "%s %s", view->scene, view->name);
    if (!w->o->brief)
        print_row(w->o, title, view->radius_world, params->spacing, &row);
    mean->error += row.error;
    mean->rmse += row.rmse;
    mean->bias += row.bias;
    mean->ms += row.ms;
    mean->count++;
    snprintf(title, sizeof title, "%g-%d", (double)view->radius_world,
             params->spacing * params->spacing);
    if (w->o->images && status == CRANNY_OK)
        status = save_images(view, w, title, sight->truth, why);
    return status;
}

static enum cranny_status run_view(struct work *w, const struct view *view,
                                   struct cranny_error *why)
{
    const struct options *o = w->o;
    struct view_sight sight;
    struct cranny_volumes_params params = cranny_volumes_params_preset(o->preset);
    params.radius_world = view->radius_world;
    enum cranny_status status = CRANNY_OK;
    for (int i = 0; i < o->set_count && status == CRANNY_OK; i++)
        status = cranny_params_set(cranny_volumes_param_table(), &params, o->names[i], o->values[i],
                                   why);
    if (status != CRANNY_OK)
        return status;
    status = view_see(&w->stage, view, o->width, o->height, o->rays, o->cache, &sight, why);
    if (status != CRANNY_OK)
        return status;
    status = make_volumes(w, &params, view, why);
    for (int k = 0; k < o->spacing_count && status == CRANNY_OK; k++)
        status = run_rate(w, view, &sight, &params, k, why);
    if (o->images && status == CRANNY_OK) {
        memcpy(w->picture, sight.truth, (size_t)o->width * (size_t)o->height * sizeof(float));
        status = save_images(view, w, "truth", sight.truth, why);
    }
    view_sight_free(&sight);
    return status;
}

static bool add_value(struct options *o, const char *name, char *value)
{
    char *equals = strchr(value, '=');
    if (strcmp(name, "--size") == 0)
        return sscanf(value, "%dx%d", &o->width, &o->height) == 2;
    if (strcmp(name, "--radius") == 0 && o->radius_count < LIST_MAX)
        return (o->radii[o->radius_count++] = (float)atof(value)) > 0;
    if (strcmp(name, "--spacing") == 0 && o->spacing_count < LIST_MAX)
        return (o->spacings[o->spacing_count++] = atoi(value)) > 0;
    if (strcmp(name, "--set") == 0 && equals && o->set_count < SET_MAX) {
        *equals = 0;
        o->names[o->set_count] = value;
        o->values[o->set_count++] = equals + 1;
        return true;
    }
    const struct {
        const char *name;
        const char **text;
        int *number;
    } table[] = {{"--rays", NULL, &o->rays},     {"--runs", NULL, &o->runs},
                 {"--preset", &o->preset, NULL}, {"--scene", &o->scene, NULL},
                 {"--view", &o->view, NULL},     {"--cache", &o->cache, NULL},
                 {"--images", &o->images, NULL}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        if (strcmp(name, table[i].name) == 0) {
            if (table[i].text)
                *table[i].text = value;
            else
                *table[i].number = atoi(value);
            return true;
        }
    return false;
}

static bool parse(int argc, char **argv, struct options *o)
{
    *o = (struct options){.width = 640, .height = 360, .rays = 1024, .runs = 1};
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--versus") == 0)
            o->versus = true;
        else if (strcmp(argv[i], "--brief") == 0)
            o->brief = true;
        else if (strcmp(argv[i], "--markdown") == 0)
            o->markdown = true;
        else if (i + 1 == argc || !add_value(o, argv[i], argv[i + 1]))
            return false;
        else
            i++;
    }
    if (!o->spacing_count)
        o->spacings[o->spacing_count++] = 1;
    return o->width > 0 && o->height > 0 && o->rays > 0 && o->runs > 0 && o->runs <= RUNS_MAX;
}

static enum cranny_status run_all(struct work *w, struct cranny_error *why)
{
    const struct options *o = w->o;
    for (int v = 0; v < view_count; v++) {
        if ((o->scene && strcmp(o->scene, views[v].scene) != 0) ||
            (o->view && strcmp(o->view, views[v].name) != 0))
            continue;
        char *path = view_path(&views[v]);
        if (!path) {
            printf("%s %s: SKIPPED: not in CRANNY_SCENES\n", views[v].scene, views[v].name);
            continue;
        }
        free(path);
        for (int r = 0; r < (o->radius_count ? o->radius_count : 1); r++) {
            struct view view = views[v];
            if (o->radius_count)
                view.radius_world = o->radii[r];
            const enum cranny_status status = run_view(w, &view, why);
            if (status != CRANNY_OK)
                return status;
        }
    }
    return CRANNY_OK;
}

int main(int argc, char **argv)
{
    struct options o;
    if (!parse(argc, argv, &o)) {
        fprintf(stderr, "bench-volumes: wrong usage; see the head of bench/volumes.c\n");
        return 2;
    }
    struct work w = {.o = &o,
                     .picture = malloc((size_t)o.width * (size_t)o.height * sizeof(float))};
    struct cranny_error why = {0};
    if (!w.picture)
        return 1;
    if (o.versus) {
        const struct versus_options versus = {o.width,  o.height, o.rays, o.runs,
                                              o.preset, o.scene,  o.cache};
        free(w.picture);
        return volumes_versus(&versus, &why) == CRANNY_OK ? 0 : complain(&why);
    }
    if (o.markdown)
        printf("| view | radius, m | rate | error | rmse | bias | ms |\n|---|---|---|---|---|---|"
               "---|\n");
    const enum cranny_status status = run_all(&w, &why);
    for (int k = 0; k < o.spacing_count && status == CRANNY_OK; k++)
        if (w.means[k].count)
            print_row(&o, "mean", 0, o.spacings[k], &w.means[k]);
    view_leave(&w.stage);
    cranny_volumes_destroy(&w.volumes);
    free(w.picture);
    return status == CRANNY_OK ? 0 : complain(&why);
}
