/* A look from within, for scenes that are closed boxes from outside. */
#include "view.h"

#include <math.h>

#define RAYS 256 /* around a place */
#define YAWS 16
#define PLACES 9
#define CONE 0.8   /* cosine of half the field looked at */
#define ROOMY 0.12 /* of the bounds' diagonal must be in sight: no gap between a statue's legs */
#define FOV 1.15f
#define GOLDEN_ANGLE 2.39996322972865332
#define TURN 6.283185307179586

struct around {
    double eye[3], reach;
    float directions[RAYS][3], distances[RAYS];
    struct cranny_hit hits[RAYS];
};

static enum cranny_status look(const struct cranny_tracer *tracer, struct around *around,
                               struct cranny_error *why)
{
    float origins[RAYS][3];
    for (int r = 0; r < RAYS; r++) {
        const double y = 1 - (2 * r + 1.0) / RAYS, ring = sqrt(1 - y * y);
        const double d[3] = {ring * cos(GOLDEN_ANGLE * r), y, ring * sin(GOLDEN_ANGLE * r)};
        for (int i = 0; i < 3; i++) {
            origins[r][i] = (float)around->eye[i];
            around->directions[r][i] = (float)d[i];
        }
    }
    return cranny_trace(tracer, RAYS, (const float(*)[3])origins,
                        (const float(*)[3])around->directions, around->distances, around->hits, 0,
                        why);
}

/* Surfaces most of the way around, and their fronts: not in the open, and not inside a wall. */
static bool is_room(const struct cranny_scene *scene, const struct around *around)
{
    int seen = 0, back = 0;
    for (int r = 0; r < RAYS; r++) {
        const struct cranny_hit *hit = &around->hits[r];
        if (hit->instance == UINT32_MAX)
            continue;
        const uint32_t mesh = cranny_scene_instance(scene, hit->instance)->mesh;
        const uint32_t material = cranny_scene_mesh(scene, mesh)->triangle_materials[hit->triangle];
        seen++;
        back += hit->back_face && !cranny_scene_material(scene, material)->double_sided;
    }
    return 4 * seen > 3 * RAYS && back * 20 < seen;
}

/* Mean of the free distance about `forward`; looking at nothing is worth nothing. */
static double openness(const struct around *around, const double forward[3])
{
    double sum = 0, count = 0;
    for (int r = 0; r < RAYS; r++) {
        const float *d = around->directions[r];
        if (forward[0] * d[0] + forward[1] * d[1] + forward[2] * d[2] < CONE)
            continue;
        if (isfinite(around->distances[r]))
            sum += fmin((double)around->distances[r], around->reach);
        count += 1;
    }
    return count > 0 ? sum / count : 0;
}

/* Places in the middle and along the longer side, at three heights below half. */
static void place(const double bounds[6], int number, double eye[3])
{
    static const double along[3] = {0.5, 0.3, 0.7}, high[3] = {0.2, 0.35, 0.5};
    const int longer = bounds[5] - bounds[2] > bounds[3] - bounds[0] ? 2 : 0;
    for (int i = 0; i < 3; i++) {
        const double share = i == 1 ? high[number / 3] : i == longer ? along[number % 3] : 0.5;
        eye[i] = bounds[i] + share * (bounds[3 + i] - bounds[i]);
    }
}

/* The longest look from a place, if that is longer than `best`. */
static enum cranny_status aim(const struct around *around, double *best,
                              struct cranny_camera *camera, struct cranny_error *why)
{
    static const double up[3] = {0, 1, 0};
    enum cranny_status status = CRANNY_OK;
    for (int yaw = 0; yaw < YAWS && status == CRANNY_OK; yaw++) {
        const double turn = TURN * yaw / YAWS;
        const double forward[3] = {0.995 * cos(turn), -0.0999, 0.995 * sin(turn)};
        const double open = openness(around, forward);
        double target[3];
        if (open <= *best)
            continue;
        *best = open;
        for (int i = 0; i < 3; i++)
            target[i] = around->eye[i] + around->reach * forward[i];
        status = cranny_camera_look_at(around->eye, target, up, FOV, camera, why);
    }
    return status;
}

enum cranny_status view_within(const struct cranny_scene *scene, const struct cranny_hooks *hooks,
                               struct cranny_camera *camera, bool *found, struct cranny_error *why)
{
    struct cranny_tracer_params params = cranny_tracer_params_default();
    struct cranny_tracer *tracer = NULL;
    struct around around;
    double bounds[6];
    params.hooks = hooks;
    cranny_scene_bounds(scene, bounds);
    around.reach =
        hypot(hypot(bounds[3] - bounds[0], bounds[4] - bounds[1]), bounds[5] - bounds[2]);
    const double narrow = ROOMY * around.reach;
    double best = narrow;
    enum cranny_status status = cranny_tracer_create(scene, &params, &tracer, why);
    for (int i = 0; i < PLACES && status == CRANNY_OK; i++) {
        place(bounds, i, around.eye);
        status = look(tracer, &around, why);
        if (status == CRANNY_OK && is_room(scene, &around))
            status = aim(&around, &best, camera, why);
    }
    cranny_tracer_destroy(&tracer);
    *found = status == CRANNY_OK && best > narrow;
    return status;
}
