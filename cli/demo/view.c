#include "view.h"

#include "files.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define PROBE_WIDTH 160
#define PROBE_HEIGHT 90
#define PROBE_COUNT (PROBE_WIDTH * PROBE_HEIGHT)
#define BLOCK 5 /* pixels of the probe each way; divides both sides */
#define PROBE_RAYS 16
#define RADIUS_SHARE 0.1 /* of the picture's height at the median depth */

/* Three numbers with commas between them, and what a reader of the words gets. */
static void round_vector(const double v[3], int places, char words[64], double rounded[3])
{
    snprintf(words, 64, "%.*f,%.*f,%.*f", places, v[0], places, v[1], places, v[2]);
    char *at = words;
    for (int i = 0; i < 3; i++, at++)
        rounded[i] = strtod(at, &at);
}

/* A view that is none of the file's, by eye and target, rounded so that the command is short. */
static enum cranny_status spell(const struct cranny_scene *scene, struct view *view,
                                struct cranny_error *why)
{
    static const double up[3] = {0, 1, 0};
    const double *m = view->camera.world_from_view;
    double bounds[6], eye[3], target[3];
    char eye_words[64], target_words[64], fov_words[16];
    cranny_scene_bounds(scene, bounds);
    const double reach =
        0.5 * hypot(hypot(bounds[3] - bounds[0], bounds[4] - bounds[1]), bounds[5] - bounds[2]);
    const int places = (int)fmin(fmax(3 - floor(log10(fmax(reach, 1e-9))), 0), 9);
    for (int i = 0; i < 3; i++) {
        eye[i] = m[4 * i + 3];
        target[i] = m[4 * i + 3] - reach * m[4 * i + 2];
    }
    round_vector(eye, places, eye_words, eye);
    round_vector(target, places, target_words, target);
    snprintf(fov_words, sizeof fov_words, "%.0f", (double)view->camera.fov_y * 180 / PI);
    snprintf(view->words, sizeof view->words, "--eye %s --target %s --fov %s", eye_words,
             target_words, fov_words);
    return cranny_camera_look_at(eye, target, up, (float)(strtod(fov_words, NULL) * PI / 180),
                                 &view->camera, why);
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Of what is not sky; 0: all is. `depths` is left in disorder. */
static double median(float *depths, size_t count)
{
    size_t used = 0;
    for (size_t i = 0; i < count; i++)
        if (isfinite(depths[i]) && depths[i] > 0)
            depths[used++] = depths[i];
    qsort(depths, used, sizeof *depths, compare_floats);
    return used ? (double)depths[used / 2] : 0;
}

struct moments {
    double sum, squares, weight;
};

static void add(struct moments *moments, double value, double weight)
{
    moments->sum += weight * value;
    moments->squares += weight * value * value;
    moments->weight += weight;
}

static double variance(const struct moments *moments)
{
    const double mean = moments->sum / fmax(moments->weight, 1);
    return fmax(moments->squares / fmax(moments->weight, 1) - mean * mean, 0);
}

/* Adds a block's pixels to `pixels` and their mean to `blocks`; sky does not count. */
static void add_block(const struct cranny_gbuffer *g, const float *visibility, int left, int top,
                      struct moments *pixels, struct moments *blocks)
{
    struct moments own = {0};
    for (int y = top; y < top + BLOCK; y++)
        for (int x = left; x < left + BLOCK; x++) {
            const size_t at = (size_t)y * PROBE_WIDTH + (size_t)x;
            if (!isfinite(g->depth[at]))
                continue;
            add(&own, (double)visibility[at], 1);
            add(pixels, (double)visibility[at], 1);
        }
    if (own.weight > 0)
        add(blocks, own.sum / own.weight, own.weight);
}

/* Standard deviation over the surfaces, times their share of the picture, times the share of the
 * variance that is coarser than a block: even walls have none, empty horizons little, and in far
 * leaves it is all fine grain. */
static double spread(const struct cranny_gbuffer *g, const float *visibility)
{
    struct moments pixels = {0}, blocks = {0};
    for (int y = 0; y < PROBE_HEIGHT; y += BLOCK)
        for (int x = 0; x < PROBE_WIDTH; x += BLOCK)
            add_block(g, visibility, x, y, &pixels, &blocks);
    const double all = variance(&pixels), coarse = variance(&blocks);
    return all > 0 ? coarse / sqrt(all) * pixels.weight / PROBE_COUNT : 0;
}

static enum cranny_status measure(const struct cranny_frame *frame, float *values,
                                  struct view *view, struct cranny_error *why)
{
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    const double extent = (double)g.projection.top - (double)g.projection.bottom;
    memcpy(values, g.depth, PROBE_COUNT * sizeof *values);
    view->depth_median = median(values, PROBE_COUNT);
    view->radius_world =
        RADIUS_SHARE * extent * (g.projection.kind == CRANNY_ORTHOGRAPHIC ? 1 : view->depth_median);
    view->score = 0;
    if (!(view->depth_median > 0))
        return CRANNY_OK;
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    params.rays = PROBE_RAYS;
    params.radius_world = (float)view->radius_world;
    enum cranny_status status = cranny_frame_raytrace(frame, &params, values, 0, NULL, NULL, why);
    if (status == CRANNY_OK)
        view->score = spread(&g, values);
    return status;
}

static enum cranny_status probe(const struct cranny_scene *scene,
                                const struct cranny_tracer *tracer, struct view *view,
                                struct cranny_error *why)
{
    struct cranny_frame_params params = cranny_frame_params_default();
    params.width = PROBE_WIDTH;
    params.height = PROBE_HEIGHT;
    struct cranny_frame *frame = NULL;
    float *values = malloc(PROBE_COUNT * sizeof *values);
    enum cranny_status status = CRANNY_OK;
    if (!values)
        status = no_memory(why);
    if (status == CRANNY_OK)
        status = cranny_frame_create(scene, tracer, &view->camera, &params, &frame, why);
    if (status == CRANNY_OK)
        status = measure(frame, values, view, why);
    cranny_frame_destroy(&frame);
    free(values);
    return status;
}

enum cranny_status view_pick(const struct cranny_scene *scene, const struct cranny_tracer *tracer,
                             const struct cranny_camera *views, int count, struct view *best,
                             struct cranny_error *why)
{
    const int cameras = (int)cranny_scene_camera_count(scene);
    enum cranny_status status = CRANNY_OK;
    *best = (struct view){.score = 0};
    for (int i = 0; i < count && status == CRANNY_OK; i++) {
        struct view view = {.index = i, .camera = views[i]};
        if (i < cameras)
            snprintf(view.words, sizeof view.words, "--camera %d", i);
        else
            status = spell(scene, &view, why);
        if (status == CRANNY_OK)
            status = probe(scene, tracer, &view, why);
        if (status == CRANNY_OK && view.score > best->score)
            *best = view;
    }
    return status;
}
