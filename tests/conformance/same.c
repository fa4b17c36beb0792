/* What must not change the picture: resolution, lens, scale, place, frame, mirror. */
#include "conformance/conformance.h"

/* Visibility of a view's pixel from another view's picture; false where its four pixels there are
 * not all on the same surface, or near the border. */
static bool see_again(const struct view *from, int x, int y, const struct view *to,
                      const float *picture, double *value)
{
    double p[3], world[3], tx, ty, depth;
    view_point(from, x, y, p);
    view_world(from, p, world);
    view_project(to, world, &tx, &ty, &depth);
    if (!(tx >= MARGIN && ty >= MARGIN && tx < to->width - MARGIN && ty < to->height - MARGIN))
        return false;
    const int x0 = (int)floor(tx), y0 = (int)floor(ty);
    *value = 0;
    for (int k = 0; k < 4; k++) {
        const int sx = x0 + (k & 1), sy = y0 + k / 2;
        const double weight = (k & 1 ? tx - x0 : 1 - tx + x0) * (k / 2 ? ty - y0 : 1 - ty + y0);
        double q[3], there[3], away = 0;
        if (!view_counts(to, sx, sy, 1e6))
            return false;
        view_point(to, sx, sy, q);
        view_world(to, q, there);
        for (int i = 0; i < 3; i++)
            away += (there[i] - world[i]) * (there[i] - world[i]);
        if (away > 0.1 * 0.1)
            return false;
        *value += weight * (double)picture[sy * to->width + sx];
    }
    return true;
}

/* Mean difference of the points that both views see. */
static double point_difference(const struct view *a, const float *va, const struct view *b,
                               const float *vb)
{
    double sum = 0, other;
    int count = 0;
    for (int y = 0; y < a->height; y++)
        for (int x = 0; x < a->width; x++) {
            if (!view_counts(a, x, y, 1e6) || !see_again(a, x, y, b, vb, &other))
                continue;
            sum += fabs((double)va[y * a->width + x] - other);
            count++;
        }
    CHECK_MSG(count > TILE_PIXELS / 4, "only %d points are in both views", count);
    return sum / count;
}

static double mean_difference(const float *a, const float *b, int count)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        sum += fabs((double)a[i] - (double)b[i]);
    return sum / count;
}

static struct analytic court(void)
{
    struct analytic world = {0};
    scenes[SCENE_COURT].build(&world);
    return world;
}

static double against(const struct view *a, const struct view *b, int method, double radius)
{
    float *va = render_view(a, method, radius), *vb = render_view(b, method, radius);
    const double difference = point_difference(a, va, b, vb);
    free(va);
    free(vb);
    return difference;
}

static void measure_cameras(void)
{
    const struct analytic world = court();
    const struct camera usual = scenes[SCENE_COURT].camera;
    struct camera near = usual, aside = usual;
    for (int i = 0; i < 3; i++)
        near.eye[i] += 0.2 * (usual.target[i] - usual.eye[i]);
    aside.eye[0] -= 0.25;
    aside.target[0] -= 0.25;
    struct view here = scene_view(SCENE_COURT);
    struct view views[] = {
        view_make(&world, &near, usual_lens(), TILE_WIDTH, TILE_HEIGHT),
        view_make(&world, &aside, usual_lens(), TILE_WIDTH, TILE_HEIGHT),
        view_make(&world, &usual, cranny_perspective(0.6f, (float)TILE_WIDTH / TILE_HEIGHT),
                  TILE_WIDTH, TILE_HEIGHT),
    };
    static const enum row_id ids[] = {ROW_MOVE_ALONG, ROW_MOVE_ACROSS, ROW_LENS};
    for (int k = 0; k < 3; k++) {
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
            record(ids[k], m, false, against(&views[k], &here, m, 0.5));
        view_free(&views[k]);
    }
    view_free(&here);
}

/* Twice as many pixels each way, then means of four. */
static void measure_resolution(void)
{
    const struct analytic world = court();
    struct view low = scene_view(SCENE_COURT);
    struct view high = view_make(&world, &scenes[SCENE_COURT].camera, usual_lens(), 2 * TILE_WIDTH,
                                 2 * TILE_HEIGHT);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        float *a = render_view(&low, m, 0.5), *b = render_view(&high, m, 0.5);
        double sum = 0;
        for (int y = 0; y < TILE_HEIGHT; y++)
            for (int x = 0; x < TILE_WIDTH; x++) {
                const float *four = b + 2 * (y * 2 * TILE_WIDTH + x);
                const float mean =
                    (four[0] + four[1] + four[2 * TILE_WIDTH] + four[2 * TILE_WIDTH + 1]) / 4;
                sum += fabs((double)mean - (double)a[y * TILE_WIDTH + x]);
            }
        record(ROW_RESOLUTION, m, false, sum / TILE_PIXELS);
        free(a);
        free(b);
    }
    view_free(&low);
    view_free(&high);
}

static struct analytic scaled(const struct analytic *world, double scale)
{
    struct analytic out = *world;
    for (int i = 0; i < out.count; i++) {
        out.shapes[i].radius *= scale;
        for (int k = 0; k < 3; k++) {
            out.shapes[i].point[k] *= scale;
            out.shapes[i].half[k] *= scale;
        }
    }
    return out;
}

static void measure_scale(double scale, enum row_id id)
{
    struct analytic world = court();
    struct camera camera = scenes[SCENE_COURT].camera;
    struct view here = scene_view(SCENE_COURT);
    world = scaled(&world, scale);
    for (int i = 0; i < 3; i++) {
        camera.eye[i] *= scale;
        camera.target[i] *= scale;
    }
    struct view there = view_make(&world, &camera, usual_lens(), TILE_WIDTH, TILE_HEIGHT);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        float *a = render_view(&here, m, 0.5), *b = render_view(&there, m, 0.5 * scale);
        record(id, m, false, mean_difference(a, b, TILE_PIXELS));
        free(a);
        free(b);
    }
    view_free(&here);
    view_free(&there);
}

/* A camera that stands `away` metres from the middle of the court. */
static struct camera camera_away(double away)
{
    struct camera camera = scenes[SCENE_COURT].camera;
    double length = 0;
    for (int i = 0; i < 3; i++)
        length += (camera.eye[i] - camera.target[i]) * (camera.eye[i] - camera.target[i]);
    for (int i = 0; i < 3; i++)
        camera.eye[i] = camera.target[i] + (camera.eye[i] - camera.target[i]) * away / sqrt(length);
    return camera;
}

/* Parallel rays from near and from far away, of another scale, and a lens so long that its rays
 * are nearly parallel. */
static void measure_parallel(void)
{
    enum { FAR = 2048 };
    const struct analytic world = court(), small = scaled(&world, 1.0 / 1024);
    const float aspect = (float)TILE_WIDTH / TILE_HEIGHT, half = 1.2f;
    const struct camera near = camera_away(4), far = camera_away(FAR);
    struct camera shrunk = near;
    for (int i = 0; i < 3; i++) {
        shrunk.eye[i] /= 1024;
        shrunk.target[i] /= 1024;
    }
    struct view here =
        view_make(&world, &near, cranny_orthographic(half, aspect), TILE_WIDTH, TILE_HEIGHT);
    struct view away =
        view_make(&world, &far, cranny_orthographic(half, aspect), TILE_WIDTH, TILE_HEIGHT);
    struct view lens = view_make(&world, &far, cranny_perspective(2 * atanf(half / FAR), aspect),
                                 TILE_WIDTH, TILE_HEIGHT);
    struct view tiny = view_make(&small, &shrunk, cranny_orthographic(half / 1024, aspect),
                                 TILE_WIDTH, TILE_HEIGHT);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        record(ROW_PARALLEL_FAR, m, false, against(&here, &away, m, 0.5));
        record(ROW_LONG_LENS, m, false, against(&here, &lens, m, 0.5));
        float *a = render_view(&here, m, 0.5), *b = render_view(&tiny, m, 0.5 / 1024);
        record(ROW_PARALLEL_SCALE, m, false, mean_difference(a, b, TILE_PIXELS));
        free(a);
        free(b);
    }
    view_free(&here);
    view_free(&away);
    view_free(&lens);
    view_free(&tiny);
}

static void measure_mirror(void)
{
    struct view here = scene_view(SCENE_COURT), there = scene_view(SCENE_COURT);
    for (int y = 0; y < TILE_HEIGHT; y++)
        for (int x = 0; x < TILE_WIDTH; x++) {
            const int to = y * TILE_WIDTH + x, from = y * TILE_WIDTH + TILE_WIDTH - 1 - x;
            there.depth[to] = here.depth[from];
            for (int k = 0; k < 3; k++)
                there.normals[to][k] = here.normals[from][k] * (k ? 1.0f : -1.0f);
        }
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        float *a = render_view(&here, m, 0.5), *b = render_view(&there, m, 0.5);
        double sum = 0;
        for (int i = 0; i < TILE_PIXELS; i++) {
            const int back = i - i % TILE_WIDTH + TILE_WIDTH - 1 - i % TILE_WIDTH;
            sum += fabs((double)a[i] - (double)b[back]);
        }
        record(ROW_MIRROR, m, false, sum / TILE_PIXELS);
        free(a);
        free(b);
    }
    view_free(&here);
    view_free(&there);
}

enum { GUARD = 24, BIG_WIDTH = TILE_WIDTH + 2 * GUARD, BIG_HEIGHT = TILE_HEIGHT + 2 * GUARD };

/* Error within GUARD pixels of the border. */
static double border_error(const float *visibility, const float *truth)
{
    double sum = 0;
    int count = 0;
    for (int y = 0; y < TILE_HEIGHT; y++)
        for (int x = 0; x < TILE_WIDTH; x++) {
            if (x >= GUARD && y >= GUARD && x < TILE_WIDTH - GUARD && y < TILE_HEIGHT - GUARD)
                continue;
            const double error = (double)visibility[y * TILE_WIDTH + x] -
                                 (double)truth[(y + GUARD) * BIG_WIDTH + x + GUARD];
            sum += error * error;
            count++;
        }
    return sqrt(sum / count);
}

/* A part of a larger frame, with and without its surroundings. */
static void measure_viewport(void)
{
    const struct analytic world = court();
    struct cranny_projection wide = usual_lens();
    wide.right *= (float)BIG_WIDTH / TILE_WIDTH;
    wide.left = -wide.right;
    wide.top *= (float)BIG_HEIGHT / TILE_HEIGHT;
    wide.bottom = -wide.top;
    struct view big = view_make(&world, &scenes[SCENE_COURT].camera, wide, BIG_WIDTH, BIG_HEIGHT);
    float *truth = view_truth(&big, 0.5, 16);
    struct cranny_gbuffer part = big.frame;
    part.projection = usual_lens();
    part.viewport = (struct cranny_rect){GUARD, GUARD, TILE_WIDTH, TILE_HEIGHT};
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        const struct cranny_screen_params params = method_params(m, NULL, 0.5);
        part.guard_band = 0;
        float *bare = render(&part, &params), *whole = render(&big.frame, &params);
        part.guard_band = GUARD;
        float *guarded = render(&part, &params);
        double sum = 0;
        for (int y = 0; y < TILE_HEIGHT; y++)
            sum += mean_difference(guarded + y * TILE_WIDTH,
                                   whole + (y + GUARD) * BIG_WIDTH + GUARD, TILE_WIDTH);
        record(ROW_VIEWPORT, m, false, sum / TILE_HEIGHT);
        record(ROW_BORDER_BARE, m, false, border_error(bare, truth));
        record(ROW_BORDER_GUARDED, m, false, border_error(guarded, truth));
        free(bare);
        free(guarded);
        free(whole);
    }
    free(truth);
    view_free(&big);
}

void measure_same(void)
{
    measure_resolution();
    measure_cameras();
    measure_scale(0.001, ROW_SCALE_SMALL);
    measure_scale(1000, ROW_SCALE_LARGE);
    measure_scale(1024, ROW_SCALE_EXACT);
    measure_parallel();
    measure_viewport();
    measure_mirror();
}
