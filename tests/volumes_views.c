/* Ambient occlusion volumes: what does not depend on who looks, how many threads make the volumes,
 * or how far a polygon is; and values from elsewhere, sparsely sampled. */
#include "frame_scenes.h"

#include <cranny/compare.h>
#include <cranny/volumes.h>

enum { WIDTH = 125, HEIGHT = 70, PIXELS = WIDTH * HEIGHT };

static float one[PIXELS], two[PIXELS];

static struct cranny_volumes *make(const struct cranny_scene *scene, int threads)
{
    struct cranny_error why;
    struct cranny_volumes *volumes;
    struct cranny_volumes_params params = cranny_volumes_params_preset(NULL);
    params.threads = threads;
    CHECK_OK(cranny_volumes_create(scene, &params, &volumes, &why), why);
    return volumes;
}

static void render(const struct cranny_volumes *volumes, const struct cranny_gbuffer *gbuffer,
                   const struct cranny_volumes_params *params, float *out)
{
    struct cranny_error why;
    CHECK_OK(cranny_volumes_render(volumes, gbuffer, params, out, 0, &why), why);
}

/* Visibility at a point of the world, for a camera at `eye` that looks at it. */
static double seen_from(const struct cranny_volumes *volumes,
                        const struct cranny_volumes_params *params, const double eye[3],
                        const double point[3], const double normal[3])
{
    const struct cranny_camera camera = look(eye, point, 0.8f);
    const double *m = camera.world_from_view;
    float facing[3], depth, out = -1;
    double away2 = 0;
    for (int k = 0; k < 3; k++) {
        facing[k] = (float)(m[k] * normal[0] + m[4 + k] * normal[1] + m[8 + k] * normal[2]);
        away2 += (point[k] - eye[k]) * (point[k] - eye[k]);
    }
    depth = (float)sqrt(away2);
    const struct cranny_gbuffer g = {.width = 1,
                                     .height = 1,
                                     .depth = &depth,
                                     .normal = facing,
                                     .projection = cranny_perspective(0.8f, 1),
                                     .world_from_view = m};
    render(volumes, &g, params, &out);
    return (double)out;
}

/* One value for a point, from near and far, from the side and from above. */
static void test_view_independence(void)
{
    static const double eyes[][3] = {
        {0, 0.05, 0.3}, {-1.9, 2.9, 1.9}, {1.9, 0.1, 1.5}, {0.3, 1.5, 1.9}, {-300, 800, 500}};
    static const double points[][2][3] = {{{0.1, 0, -0.2}, {0, 1, 0}},
                                          {{-0.05, 0, -0.6}, {0, 1, 0}},
                                          {{0.8, 0, -0.1}, {0, 1, 0}},
                                          {{0.5, 0.3, -2}, {0, 0, 1}},
                                          {{-2, 0.2, -1.9}, {1, 0, 0}}};
    struct stage stage = room();
    struct cranny_volumes *volumes = make(stage.scene, 0);
    for (size_t p = 0; p < sizeof points / sizeof *points; p++) {
        struct cranny_volumes_params params = cranny_volumes_params_preset(p & 1 ? "paper" : NULL);
        params.radius_world = 0.9f;
        params.bias = 0;
        double first = 0;
        for (size_t e = 0; e < sizeof eyes / sizeof *eyes; e++) {
            const double seen = seen_from(volumes, &params, eyes[e], points[p][0], points[p][1]);
            first = e ? first : seen;
            CHECK_NEAR(seen, first, e == 4 ? 2e-3 : 1e-5); /* at a kilometre, floats of depth */
        }
        CHECK_MSG(first > 0.2 && first < 0.99, "point %zu: %g", p, first);
    }
    cranny_volumes_destroy(&volumes);
    leave(&stage);
}

/* Thousands of polygons and several meshes: the same tree from every number of threads. */
static void test_threads_make_the_same(void)
{
    struct stage stage = room();
    struct cranny_volumes_params params = cranny_volumes_params_preset(NULL);
    const double shifted[12] = {1, 0, 0, -1.3, 0, 1, 0, 0.2, 0, 0, 1, 0.3};
    cranny_tracer_destroy(&stage.tracer); /* before its scene changes */
    const uint32_t ball = sphere_mesh(stage.scene, (double[3]){0, 0, 0}, 0.4, 90);
    add_instance(stage.scene, ball, shifted);
    stage.tracer = new_tracer(stage.scene);
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    struct cranny_volumes *volumes = make(stage.scene, 1);
    const struct cranny_volumes_info info = cranny_volumes_info(volumes);
    CHECK(info.polygons > 12000 && info.quads > 12000);
    for (int spacing = 1; spacing <= 5; spacing += 4) {
        params.spacing = spacing;
        render(volumes, &g, &params, one);
        for (int threads = 2; threads <= 7; threads += 5) {
            struct cranny_volumes *others = make(stage.scene, threads);
            CHECK(cranny_volumes_info(others).size_bytes == info.size_bytes);
            CHECK(cranny_volumes_info(others).quads == info.quads);
            render(others, &g, &params, two);
            CHECK_MSG(memcmp(one, two, sizeof one) == 0, "%d threads", threads);
            cranny_volumes_destroy(&others);
        }
    }
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* A leaf overhead, a little aside, nearer and farther than arcs are taken: eq. 19 to half a
 * percent. */
static void test_far_polygons(void)
{
    for (int quad = 0; quad < 2; quad++)
        for (int k = 1; k <= 12; k++) {
            const double height = 0.3, size = 2 * height / k;
            const float x = (float)(0.1 * size), h = (float)height, s = (float)size;
            const float corners[4][3] = {
                {x, h, x}, {x + s, h, x}, {x + s, h, x + s}, {x, h, x + s}};
            static const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
            struct cranny_scene *scene = new_scene();
            add_instance(scene, add_mesh(scene, 4, corners, NULL, quad ? 2 : 1, triangles, 0),
                         identity);
            struct cranny_volumes *volumes = make(scene, 1);
            struct cranny_volumes_params params = cranny_volumes_params_preset("paper");
            params.radius_world = 1;
            params.faces = CRANNY_FACES_BOTH;
            params.bias = 0;
            const double up[3] = {0, 1, 0}, origin[3] = {0, 0, 0}, eye[3] = {0.2, 1, 0.3};
            const double seen = seen_from(volumes, &params, eye, origin, up);
            double exact[4][3];
            for (int i = 0; i < 4; i++)
                for (int c = 0; c < 3; c++)
                    exact[i][c] = (double)corners[i][c];
            const double share = cranny_polygon_occlusion((const double(*)[3])exact, quad ? 4 : 3,
                                                          origin, up, CRANNY_FORM_SEGMENTS);
            /* Eq. 24: its plane, and the edges that it lies outside of. */
            const double delta = (double)params.delta_scale, aside = 1 - 0.1 * size / delta;
            const double expected = (1 - height / delta) * aside * (quad ? aside : 1) * share;
            CHECK_INT((int)cranny_volumes_info(volumes).quads, quad);
            CHECK_NEAR(1 - seen, expected, 0.003 * expected + 2e-6);
            cranny_volumes_destroy(&volumes);
            cranny_scene_destroy(&scene);
        }
}

/* Values from elsewhere are filtered as the volumes' own are. */
static void test_reconstruct(void)
{
    struct stage stage = room();
    struct cranny_error why;
    struct cranny_volumes_report report;
    struct cranny_volumes_params params = cranny_volumes_params_preset(NULL);
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_volumes *volumes = make(stage.scene, 0);
    struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    params.report = &report;
    for (int k = 0; k < 6; k++) {
        params.refine = k & 1;
        params.spacing = 1;
        render(volumes, &g, &params, two);
        params.spacing = 1 + k;
        render(volumes, &g, &params, one);
        const uint64_t pixels = report.pixels;
        CHECK_OK(cranny_volumes_reconstruct(&g, &params, two, 0, &why), why);
        int off = 0;
        for (int i = 0; i < PIXELS; i++)
            off += !(fabsf(one[i] - two[i]) < 1e-4f);
        CHECK_INT(off, 0);
        CHECK(report.pixels == pixels && pixels <= PIXELS);
    }
    CHECK_INT(cranny_volumes_reconstruct(NULL, &params, two, 0, &why), CRANNY_USAGE);
    CHECK_INT(cranny_volumes_reconstruct(&g, &params, NULL, 0, &why), CRANNY_USAGE);
    CHECK_INT(cranny_volumes_reconstruct(&g, &params, two, 3, &why), CRANNY_USAGE);
    g.sample_count = 4;
    CHECK(cranny_volumes_reconstruct(&g, &params, two, 0, &why) != CRANNY_OK);
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

int main(void)
{
    test_view_independence();
    test_threads_make_the_same();
    test_far_polygons();
    test_reconstruct();
    return check_end("volumes_views");
}
