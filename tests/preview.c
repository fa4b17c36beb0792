/* Previews: what is seen where, grey by visibility, and a view from within for rooms. */
#include "check.h"

#include <cranny/cranny.h>
#include <stdint.h>

enum { WIDTH = 64, HEIGHT = 48 };

static struct cranny_scene *new_scene(void)
{
    struct cranny_scene *scene = NULL;
    struct cranny_error why;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    return scene;
}

static void add(struct cranny_scene *scene, const float (*positions)[3], uint32_t vertices,
                const uint32_t (*triangles)[3], uint32_t count)
{
    struct cranny_error why;
    struct cranny_instance instance = {.name = "",
                                       .world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    const struct cranny_mesh mesh = {.name = "",
                                     .vertex_count = vertices,
                                     .triangle_count = count,
                                     .positions = positions,
                                     .triangles = triangles};
    CHECK_OK(cranny_scene_add_mesh(scene, &mesh, &instance.mesh, &why), why);
    CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
}

/* A box that is seen from within (or from outside). */
static void add_box(struct cranny_scene *scene, float half, bool inward)
{
    static const uint32_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                          {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                          {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    float positions[8][3];
    uint32_t triangles[12][3];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            positions[i][k] = i >> k & 1 ? half : -half;
    for (int i = 0; i < 12; i++) {
        triangles[i][0] = faces[i][0];
        triangles[i][1] = faces[i][inward ? 2 : 1];
        triangles[i][2] = faces[i][inward ? 1 : 2];
    }
    add(scene, (const float(*)[3])positions, 8, (const uint32_t(*)[3])triangles, 12);
}

static const uint8_t *at(const uint8_t *rgb, int x, int y)
{
    return rgb + 3 * (y * WIDTH + x);
}

/* Looking straight down on a floor with a wall across: the floor gets darker towards the wall. */
static void check_grey_order(void)
{
    enum { CELLS = 40 };
    static float positions[CELLS + 1][CELLS + 1][3];
    static uint32_t triangles[CELLS * CELLS * 2][3];
    uint32_t count = 0;
    for (uint32_t j = 0; j <= CELLS; j++)
        for (uint32_t i = 0; i <= CELLS; i++) {
            positions[j][i][0] = 0.25f * (float)i - 5;
            positions[j][i][2] = 0.25f * (float)j - 5;
        }
    for (uint32_t j = 0; j < CELLS; j++)
        for (uint32_t i = 0; i < CELLS; i++) {
            uint32_t a = j * (CELLS + 1) + i, b = a + CELLS + 1;
            memcpy(triangles[count++], (uint32_t[3]){a, b, a + 1}, 12);
            memcpy(triangles[count++], (uint32_t[3]){a + 1, b, b + 1}, 12);
        }
    struct cranny_scene *scene = new_scene();
    add(scene, positions[0], (CELLS + 1) * (CELLS + 1), (const uint32_t(*)[3])triangles, count);
    const float wall[4][3] = {{-5, 0, -5}, {-5, 0, 5}, {-5, 6, -5}, {-5, 6, 5}};
    const uint32_t wall_triangles[2][3] = {{0, 2, 1}, {1, 2, 3}};
    add(scene, wall, 4, wall_triangles, 2);
    struct cranny_bake *bake = NULL;
    struct cranny_error why;
    struct cranny_bake_params params = cranny_bake_params_default();
    params.rays = 256;
    CHECK_OK(cranny_bake_create(scene, &params, &bake, &why), why);
    const struct cranny_camera down = {.name = "",
                                       .orthographic = true,
                                       .half_height = 5.5f,
                                       .near_plane = 0.1f,
                                       .world_from_view = {1, 0, 0, 0, 0, 0, 1, 20, 0, -1, 0, 0}};
    static uint8_t before[HEIGHT * WIDTH * 3], after[HEIGHT * WIDTH * 3], again[HEIGHT * WIDTH * 3];
    CHECK_OK(cranny_preview_render_view(scene, NULL, &down, WIDTH, HEIGHT, NULL, before, &why),
             why);
    CHECK_OK(cranny_preview_render_view(scene, bake, &down, WIDTH, HEIGHT, NULL, after, &why), why);
    CHECK_OK(cranny_preview_render_view(scene, bake, &down, WIDTH, HEIGHT, NULL, again, &why), why);
    CHECK(memcmp(after, again, sizeof after) == 0);
    CHECK(memcmp(before, after, sizeof before) != 0);
    for (int x = 14; x + 6 < 50; x += 6) {
        CHECK_MSG(at(after, x + 6, 24)[1] >= at(after, x, 24)[1], "at %d: %d, then %d", x,
                  at(after, x, 24)[1], at(after, x + 6, 24)[1]);
        CHECK_INT(at(before, x + 6, 24)[1], at(before, x, 24)[1]);
    }
    CHECK_MSG(at(after, 14, 24)[1] + 25 < at(after, 50, 24)[1], "%d near the wall, %d far from it",
              at(after, 14, 24)[1], at(after, 50, 24)[1]);
    const uint8_t *floor = at(before, 32, 24), *corner = at(before, 1, 1);
    CHECK_MSG(abs(floor[0] - floor[2]) < 6, "clay is %d %d %d", floor[0], floor[1], floor[2]);
    CHECK_MSG(corner[2] > corner[0] + 10, "background is %d %d %d", corner[0], corner[1],
              corner[2]);
    CHECK(memcmp(corner, at(after, 1, 1), 3) == 0);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
}

/* 0 to 1: how much of the picture shows the scene; the sky is blue, clay is not. */
static double covered(const uint8_t *rgb)
{
    int count = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        count += rgb[3 * i + 2] < rgb[3 * i] + 8;
    return count / (double)(WIDTH * HEIGHT);
}

static void check_views(void)
{
    static uint8_t rgb[HEIGHT * WIDTH * 3];
    struct cranny_error why;
    struct cranny_camera view;
    for (int inward = 0; inward < 2; inward++) {
        struct cranny_scene *scene = new_scene();
        add_box(scene, 3, inward);
        CHECK_OK(cranny_preview_default_view(scene, (float)WIDTH / HEIGHT, NULL, &view, &why), why);
        double far = 0;
        for (int i = 0; i < 3; i++)
            far = fmax(far, fabs(view.world_from_view[4 * i + 3]));
        CHECK_MSG(inward ? far < 3 : far > 3, "eye %g from the middle", far);
        CHECK_OK(cranny_preview_render(scene, NULL, -1, WIDTH, HEIGHT, NULL, rgb, &why), why);
        double share = covered(rgb);
        CHECK_MSG(inward ? share == 1 : share > 0.3 && share < 0.9, "%g covered", share);
        cranny_scene_destroy(&scene);
    }
}

/* Whatever the shape of the bounds, all of it lies within the picture and near its edges. */
static void check_framing(void)
{
    static uint8_t rgb[HEIGHT * WIDTH * 3];
    struct cranny_error why;
    const float flat[4][3] = {{-50, 0, -3}, {-50, 0, 3}, {50, 0, -3}, {50, 0, 3}};
    const uint32_t triangles[2][3] = {{0, 1, 2}, {1, 3, 2}};
    struct cranny_scene *scene = new_scene();
    add(scene, flat, 4, triangles, 2);
    CHECK_OK(cranny_preview_render(scene, NULL, -1, WIDTH, HEIGHT, NULL, rgb, &why), why);
    int left = WIDTH, right = -1;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            if (at(rgb, x, y)[2] < at(rgb, x, y)[0] + 8) {
                left = x < left ? x : left;
                right = x > right ? x : right;
            }
    CHECK_MSG(left >= 0 && left < 6 && right >= WIDTH - 6, "from %d to %d of %d", left, right,
              WIDTH);
    cranny_scene_destroy(&scene);
}

static void check_usage(void)
{
    uint8_t rgb[3];
    struct cranny_error why;
    struct cranny_camera bad = {.name = "", .fov_y = 1};
    struct cranny_scene *scene = new_scene();
    add_box(scene, 1, false);
    CHECK_INT(cranny_preview_render(scene, NULL, 0, 1, 1, NULL, rgb, &why), CRANNY_USAGE);
    CHECK_INT(cranny_preview_render(scene, NULL, -2, 1, 1, NULL, rgb, &why), CRANNY_USAGE);
    CHECK_INT(cranny_preview_render(scene, NULL, -1, 0, 1, NULL, rgb, &why), CRANNY_USAGE);
    CHECK_INT(cranny_preview_render_view(scene, NULL, &bad, 1, 1, NULL, rgb, &why), CRANNY_USAGE);
    CHECK_INT(cranny_preview_default_view(scene, NAN, NULL, &bad, &why), CRANNY_USAGE);
    CHECK_OK(cranny_preview_render(scene, NULL, -1, 1, 1, NULL, rgb, &why), why);
    cranny_scene_destroy(&scene);
}

struct stop {
    const char *stage; /* where to say no */
    bool seen_preview;
};

static bool stop_at(void *user, const char *stage, double done, double total)
{
    struct stop *stop = user;
    CHECK(done >= 0 && done <= total);
    stop->seen_preview |= strcmp(stage, "preview") == 0;
    return strcmp(stage, stop->stage) != 0;
}

/* The hooks are asked on the way, may stop it, and neither they nor the threads change a pixel. */
static void check_params(void)
{
    static uint8_t plain[HEIGHT * WIDTH * 3], watched[HEIGHT * WIDTH * 3];
    struct cranny_error why;
    struct stop stop = {.stage = "preview"};
    const struct cranny_hooks hooks = {.user = &stop, .progress = stop_at};
    const struct cranny_preview_params params = {.threads = 3, .hooks = &hooks};
    struct cranny_scene *scene = new_scene();
    add_box(scene, 3, false);
    CHECK_INT(cranny_preview_render(scene, NULL, -1, WIDTH, HEIGHT, &params, watched, &why),
              CRANNY_CANCELLED);
    stop = (struct stop){.stage = "never"};
    CHECK_OK(cranny_preview_render(scene, NULL, -1, WIDTH, HEIGHT, &params, watched, &why), why);
    CHECK(stop.seen_preview);
    CHECK_OK(cranny_preview_render(scene, NULL, -1, WIDTH, HEIGHT, NULL, plain, &why), why);
    CHECK(memcmp(plain, watched, sizeof plain) == 0);
    cranny_scene_destroy(&scene);
}

int main(void)
{
    check_params();
    check_grey_order();
    check_views();
    check_framing();
    check_usage();
    return check_end("preview");
}
