#include "view.h"

#include "files.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define PROBE_WIDTH 160
#define PROBE_HEIGHT 90
#define PROBE_COUNT ((size_t)PROBE_WIDTH * PROBE_HEIGHT)
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

/* Standard deviation over the whole picture, sky left out: neither an even wall nor an empty
 * horizon has any. */
static double spread(const struct cranny_gbuffer *g, const float *visibility)
{
    double sum = 0, squares = 0, count = 0;
    for (size_t i = 0; i < PROBE_COUNT; i++) {
        if (!isfinite(g->depth[i]))
            continue;
        sum += (double)visibility[i];
        squares += (double)visibility[i] * (double)visibility[i];
        count += 1;
    }
    const double variance = count > 0 ? squares / count - sum / count * (sum / count) : 0;
    return sqrt(fmax(variance, 0)) * count / (double)PROBE_COUNT;
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
