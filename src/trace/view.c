/* A view for scenes without a camera: from outside where that shows fronts, else from within. */
#include "trace/view.h"

#include "scene/scene.h"

#define PROBE_GRID 24 /* rays each way of the look from outside */
#define PLACE_GRID 7  /* candidate eyes along each axis of the bounds */
#define PLACE_RAYS 96 /* around a candidate */
#define GOLDEN_ANGLE 2.39996322972865332
#define FOV_OUTSIDE 0.70f /* radians */
#define FOV_INSIDE 1.15f

static void aim(struct cranny_camera *view, const double eye[3], const double back[3])
{
    double flat = hypot(back[0], back[2]);
    double right[3] = {flat > 0 ? back[2] / flat : 1, 0, flat > 0 ? -back[0] / flat : 0};
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        view->world_from_view[4 * i] = right[i];
        view->world_from_view[4 * i + 1] = back[j] * right[k] - back[k] * right[j];
        view->world_from_view[4 * i + 2] = back[i];
        view->world_from_view[4 * i + 3] = eye[i];
    }
}

static double extent(const double bounds[6])
{
    return hypot(hypot(bounds[3] - bounds[0], bounds[4] - bounds[1]), bounds[5] - bounds[2]);
}

/* As near as all corners of the bounds allow, aimed so that they lie in the picture's middle. Along
 * an axis of the picture a corner p is inside when |p - shift| <= slope (distance - p.z). */
static void look_from_outside(const double bounds[6], double aspect, struct cranny_camera *view)
{
    const double back[3] = {0.5, 0.5, 0.70710678118654752}, high = tan(0.5 * FOV_OUTSIDE);
    const double slope[2] = {high * aspect, high};
    double center[3], eye[3], low[2] = {INFINITY, INFINITY}, top[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++)
        center[i] = 0.5 * (bounds[i] + bounds[3 + i]);
    *view = (struct cranny_camera){.name = "", .fov_y = FOV_OUTSIDE};
    aim(view, center, back);
    const double *m = view->world_from_view;
    for (int corner = 0; corner < 8; corner++) {
        double p[3] = {0};
        for (int axis = 0; axis < 3; axis++)
            for (int i = 0; i < 3; i++)
                p[axis] += m[4 * i + axis] * (bounds[corner >> i & 1 ? 3 + i : i] - center[i]);
        for (int axis = 0; axis < 2; axis++) {
            low[axis] = fmin(low[axis], p[axis] - slope[axis] * p[2]);
            top[axis] = fmax(top[axis], p[axis] + slope[axis] * p[2]);
        }
    }
    double distance = fmax((top[0] - low[0]) / slope[0], (top[1] - low[1]) / slope[1]) / 2;
    distance = fmax(distance * 1.04, 1e-6);
    for (int i = 0; i < 3; i++)
        eye[i] = center[i] + distance * back[i] + 0.5 * (low[0] + top[0]) * m[4 * i] +
                 0.5 * (low[1] + top[1]) * m[4 * i + 1];
    aim(view, eye, back);
    view->near_plane = (float)(distance * 1e-4);
}

/* Share of the hits that are back faces of single-sided materials; 0 without a hit. */
static double back_share(const struct cranny_scene *scene, const struct cranny_hit *hits,
                         size_t count)
{
    size_t seen = 0, back = 0;
    for (size_t i = 0; i < count; i++) {
        if (hits[i].instance == UINT32_MAX)
            continue;
        const struct cranny_instance *instance = cranny_scene_instance(scene, hits[i].instance);
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, instance->mesh);
        uint32_t material = mesh->triangle_materials[hits[i].triangle];
        seen++;
        back += hits[i].back_face && !cranny_scene_material(scene, material)->double_sided;
    }
    return seen ? (double)back / (double)seen : 0;
}

static enum cranny_status outside_share(const struct cranny_scene *scene,
                                        const struct cranny_tracer *tracer,
                                        const struct cranny_camera *view, double aspect,
                                        double *share, struct cranny_error *why)
{
    float origins[PROBE_GRID * PROBE_GRID][3], directions[PROBE_GRID * PROBE_GRID][3];
    float distances[PROBE_GRID * PROBE_GRID];
    struct cranny_hit hits[PROBE_GRID * PROBE_GRID];
    const double *m = view->world_from_view, high = tan(0.5 * view->fov_y);
    for (int ray = 0; ray < PROBE_GRID * PROBE_GRID; ray++) {
        double x = high * aspect * ((ray % PROBE_GRID + 0.5) * 2 / PROBE_GRID - 1);
        double y = high * ((ray / PROBE_GRID + 0.5) * 2 / PROBE_GRID - 1);
        for (int i = 0; i < 3; i++) {
            double d = x * m[4 * i] + y * m[4 * i + 1] - m[4 * i + 2];
            origins[ray][i] = (float)m[4 * i + 3];
            directions[ray][i] = (float)(d / sqrt(x * x + y * y + 1));
        }
    }
    enum cranny_status status =
        cranny_trace(tracer, PROBE_GRID * PROBE_GRID, (const float(*)[3])origins,
                     (const float(*)[3])directions, distances, hits, 0, why);
    *share = status == CRANNY_OK ? back_share(scene, hits, PROBE_GRID * PROBE_GRID) : 0;
    return status;
}

/* What can be seen from one place: rays all around on a spherical spiral. */
struct place {
    double eye[3], back[3]; /* back: away from the longest look */
    double score;           /* mean logarithm of the free distance; below 0: not inside */
};

static double sight(const double forward[3], const float (*directions)[3], const float *distances,
                    double size)
{
    double sum = 0, weight = 0;
    for (int r = 0; r < PLACE_RAYS; r++) {
        double c = forward[0] * directions[r][0] + forward[1] * directions[r][1] +
                   forward[2] * directions[r][2];
        double w = c > 0.6 ? c - 0.6 : 0;
        sum += w * log1p(fmin(distances[r], size) / size * 50);
        weight += w;
    }
    return weight > 0 ? sum / weight : 0;
}

static enum cranny_status look_around(const struct cranny_scene *scene,
                                      const struct cranny_tracer *tracer, double size,
                                      struct place *place, struct cranny_error *why)
{
    float origins[PLACE_RAYS][3], directions[PLACE_RAYS][3], distances[PLACE_RAYS];
    struct cranny_hit hits[PLACE_RAYS];
    for (int r = 0; r < PLACE_RAYS; r++) {
        double y = 1 - (2 * r + 1.0) / PLACE_RAYS, ring = sqrt(1 - y * y), turn = GOLDEN_ANGLE * r;
        const double d[3] = {ring * cos(turn), y, ring * sin(turn)};
        for (int i = 0; i < 3; i++) {
            origins[r][i] = (float)place->eye[i];
            directions[r][i] = (float)d[i];
        }
    }
    enum cranny_status status =
        cranny_trace(tracer, PLACE_RAYS, (const float(*)[3])origins, (const float(*)[3])directions,
                     distances, hits, 0, why);
    if (status != CRANNY_OK)
        return status;
    int closed = 0;
    for (int r = 0; r < PLACE_RAYS; r++)
        closed += hits[r].instance != UINT32_MAX;
    place->score = -1;
    if (closed < PLACE_RAYS / 2 || back_share(scene, hits, PLACE_RAYS) > 0.05)
        return CRANNY_OK;
    for (int yaw = 0; yaw < 16; yaw++) {
        double turn = 6.283185307179586 * yaw / 16;
        const double forward[3] = {0.98 * cos(turn), -0.199, 0.98 * sin(turn)}; /* a little down */
        double s = sight(forward, (const float(*)[3])directions, distances, size);
        if (s > place->score) {
            place->score = s;
            for (int i = 0; i < 3; i++)
                place->back[i] = -forward[i];
        }
    }
    return CRANNY_OK;
}

static enum cranny_status look_from_within(const struct cranny_scene *scene,
                                           const struct cranny_tracer *tracer,
                                           const double bounds[6], struct cranny_camera *view,
                                           struct cranny_error *why)
{
    struct place best = {.score = -1};
    double size = extent(bounds);
    for (int k = 0; k < PLACE_GRID * PLACE_GRID * PLACE_GRID; k++) {
        const int cell[3] = {k % PLACE_GRID, k / PLACE_GRID % PLACE_GRID,
                             k / PLACE_GRID / PLACE_GRID};
        struct place place;
        for (int i = 0; i < 3; i++)
            place.eye[i] = bounds[i] + (bounds[3 + i] - bounds[i]) * (cell[i] + 0.5) / PLACE_GRID;
        enum cranny_status status = look_around(scene, tracer, size, &place, why);
        if (status != CRANNY_OK)
            return status;
        if (place.score > best.score)
            best = place;
    }
    if (best.score < 0)
        return CRANNY_OK;
    *view =
        (struct cranny_camera){.name = "", .fov_y = FOV_INSIDE, .near_plane = (float)(size * 1e-4)};
    aim(view, best.eye, best.back);
    return CRANNY_OK;
}

enum cranny_status view_choose(const struct cranny_scene *scene, const struct cranny_tracer *tracer,
                               double aspect, struct cranny_camera *view, struct cranny_error *why)
{
    double bounds[6], share;
    cranny_scene_bounds(scene, bounds);
    look_from_outside(bounds, aspect, view);
    enum cranny_status status = outside_share(scene, tracer, view, aspect, &share, why);
    if (status == CRANNY_OK && share > 0.5)
        status = look_from_within(scene, tracer, bounds, view, why);
    return status;
}
