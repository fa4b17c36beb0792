/* G-buffers of scenes against closed forms: depths, normals, sample places, guard bands; and
 * pictures of them. */
#include "frame_scenes.h"

#include <cranny/cranny.h>

/* Where a sample lies at depth 1 (or anywhere: parallel), from what the G-buffer says of itself. */
static void place_of(const struct cranny_gbuffer *g, int column, int row, int sample, double xy[2])
{
    const float(*places)[2] = g->sample_positions;
    const double x = column - g->viewport.x + (places ? (double)places[sample][0] : 0.5);
    const double y = row - g->viewport.y + (places ? (double)places[sample][1] : 0.5);
    const struct cranny_projection *p = &g->projection;
    xy[0] = p->left + ((double)p->right - p->left) * x / g->viewport.width;
    xy[1] = p->top - ((double)p->top - p->bottom) * y / g->viewport.height;
}

static size_t sample_at(const struct cranny_gbuffer *g, int column, int row, int sample)
{
    return ((size_t)sample * (size_t)g->height + (size_t)row) * (size_t)g->width + (size_t)column;
}

static int samples_of(const struct cranny_gbuffer *g)
{
    return g->sample_count ? g->sample_count : 1;
}

/* Into view space. */
static void to_view(const double m[12], const double world[3], bool point, double view[3])
{
    for (int i = 0; i < 3; i++) {
        view[i] = 0;
        for (int k = 0; k < 3; k++)
            view[i] += m[4 * k + i] * (world[k] - (point ? m[4 * k + 3] : 0));
    }
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The largest relative error of all depths, and absolute one of all normals, of the plane through
 * `point` with normal `n` (world); every sample must show it. */
static void plane_errors(const struct cranny_gbuffer *g, const double point[3], const double n[3],
                         double errors[2])
{
    double p[3], m[3];
    const float(*normals)[3] = g->normal;
    to_view(g->world_from_view, point, true, p);
    to_view(g->world_from_view, n, false, m);
    errors[0] = errors[1] = 0;
    for (int s = 0; s < samples_of(g); s++)
        for (int row = 0; row < g->height; row++)
            for (int column = 0; column < g->width; column++) {
                double xy[2];
                place_of(g, column, row, s, xy);
                const bool parallel = g->projection.kind == CRANNY_ORTHOGRAPHIC;
                const double d[3] = {parallel ? 0 : xy[0], parallel ? 0 : xy[1], -1};
                const double o[3] = {parallel ? xy[0] : 0, parallel ? xy[1] : 0, 0};
                const double depth = (dot(m, p) - dot(m, o)) / dot(m, d);
                const size_t k = sample_at(g, column, row, s);
                errors[0] = fmax(errors[0], fabs((double)g->depth[k] / depth - 1));
                for (int i = 0; i < 3; i++)
                    errors[1] = fmax(errors[1], fabs((double)normals[k][i] - m[i]));
            }
}

static void test_plane(void)
{
    const double n[3] = {0.6, 0.48, 0.64}, u[3] = {0.8, -0.36, -0.48}, v[3] = {0, 0.8, -0.6};
    const double point[3] = {3, -2, 7};
    struct stage stage = {.scene = new_scene()};
    double corner[3], edges[2][3];
    for (int i = 0; i < 3; i++) {
        corner[i] = point[i] - 2000 * (u[i] + v[i]);
        edges[0][i] = 4000 * u[i];
        edges[1][i] = 4000 * v[i];
    }
    add_quad(stage.scene, corner, edges[0], edges[1], 0);
    stage.tracer = new_tracer(stage.scene);
    for (int k = 0; k < 12; k++) {
        struct cranny_frame_params params = frame_size(37, 23);
        params.samples = 1 << k % 4;
        params.guard_band = k % 3;
        const double side = k < 8 ? 1 : -1; /* from behind, too */
        const double target[3] = {3.5, -1, 7}, facing[3] = {side * n[0], side * n[1], side * n[2]};
        const double eye[3] = {point[0] + side * 9 * n[0], point[1] + side * 9 * n[1] + 2,
                               point[2] + side * 9 * n[2]};
        stage.camera = look(eye, target, 0.9f);
        stage.camera.orthographic = k & 1;
        stage.camera.half_height = 3;
        struct cranny_frame *frame = draw(&stage, &params);
        const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
        double errors[2];
        plane_errors(&g, point, facing, errors);
        CHECK_MSG(errors[0] < 1e-6, "camera %d: depth is off by %g", k, errors[0]);
        CHECK_MSG(errors[1] < 1e-6, "camera %d: normals are off by %g", k, errors[1]);
        cranny_frame_destroy(&frame);
        CHECK(!frame);
    }
    leave(&stage);
}

static void test_sample_positions(void)
{
    static const float four[4][2] = {
        {0.375f, 0.125f}, {0.875f, 0.375f}, {0.125f, 0.625f}, {0.625f, 0.875f}};
    CHECK(memcmp(cranny_sample_positions(4), four, sizeof four) == 0);
    CHECK(cranny_sample_positions(3) == cranny_sample_positions(4));
    CHECK(cranny_sample_positions(5) == cranny_sample_positions(8));
    CHECK(cranny_sample_positions(0) == cranny_sample_positions(1));
    for (int count = 1; count <= 8; count *= 2) {
        const float(*at)[2] = cranny_sample_positions(count);
        for (int axis = 0; axis < 2; axis++) {
            unsigned strips = 0;
            double sum = 0;
            for (int s = 0; s < count; s++) {
                strips |= 1u << (int)(at[s][axis] * (float)count);
                sum += (double)at[s][axis];
            }
            CHECK_INT(strips, (1 << count) - 1); /* one in every strip */
            CHECK_NEAR(sum / count, 0.5, 0);
        }
    }
}

static void test_fields(void)
{
    struct stage stage = room();
    struct cranny_frame_params params = frame_size(20, 10);
    params.guard_band = 3;
    params.samples = 2;
    struct cranny_frame *frame = draw(&stage, &params);
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    CHECK_INT(g.width, 26);
    CHECK_INT(g.height, 16);
    CHECK_INT(g.viewport.x, 3);
    CHECK_INT(g.viewport.y, 3);
    CHECK_INT(g.viewport.width, 20);
    CHECK_INT(g.viewport.height, 10);
    CHECK_INT(g.guard_band, 3);
    CHECK_INT(g.sample_count, 2);
    CHECK_INT(g.normal_format, CRANNY_NORMAL_FLOAT3);
    CHECK_NEAR(g.projection.top, tan(0.6), 1e-6);
    CHECK_NEAR(g.projection.right, 2 * tan(0.6), 1e-6);
    CHECK_NEAR(g.projection.left + g.projection.right, 0, 0);
    CHECK_NEAR(g.projection.bottom + g.projection.top, 0, 0);
    for (int i = 0; i < 12; i++)
        CHECK_NEAR(g.world_from_view[i], stage.camera.world_from_view[i], 1e-12);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* Whether `inner` lies in `outer` with `border` more pixels around it, bit for bit. */
static bool same_inside(const struct cranny_gbuffer *inner, const struct cranny_gbuffer *outer,
                        int border)
{
    const float(*a)[3] = inner->normal, (*b)[3] = outer->normal;
    for (int s = 0; s < samples_of(inner); s++)
        for (int row = 0; row < inner->height; row++)
            for (int column = 0; column < inner->width; column++) {
                const size_t i = sample_at(inner, column, row, s);
                const size_t o = sample_at(outer, column + border, row + border, s);
                if (memcmp(&inner->depth[i], &outer->depth[o], sizeof(float)) != 0 ||
                    memcmp(a[i], b[o], sizeof a[i]) != 0)
                    return false;
            }
    return true;
}

static void test_guard_band(void)
{
    struct stage stage = room();
    struct cranny_error why;
    cranny_tracer_destroy(&stage.tracer);
    struct cranny_material glass = cranny_material_default();
    glass.alpha_mode = CRANNY_ALPHA_BLEND;
    glass.opacity = 0.5f;
    uint32_t material;
    CHECK_OK(cranny_scene_add_material(stage.scene, &glass, &material, &why), why);
    add_quad(stage.scene, (double[3]){-2, 1, -2}, (double[3]){0, 0, 4}, (double[3]){4, 0, 0},
             material);
    stage.tracer = new_tracer(stage.scene);
    struct cranny_frame_params params = frame_size(33, 21), wide = params;
    params.samples = wide.samples = 4;
    wide.guard_band = 9;
    struct cranny_frame *a = draw(&stage, &params), *b = draw(&stage, &wide);
    struct cranny_gbuffer inner = cranny_frame_gbuffer(a), outer = cranny_frame_gbuffer(b);
    CHECK(same_inside(&inner, &outer, 9));
    cranny_frame_destroy(&a);
    cranny_frame_destroy(&b);
    leave(&stage);
    /* A larger frame, whose picture spans as much more: powers of two, so that bits agree. */
    stage = room();
    stage.camera = look_down(0, 2.5, 0, 0.5f);
    params = frame_size(32, 32);
    params.guard_band = 16;
    a = draw(&stage, &params);
    stage.camera.half_height = 1;
    wide = frame_size(64, 64);
    b = draw(&stage, &wide);
    inner = cranny_frame_gbuffer(a);
    outer = cranny_frame_gbuffer(b);
    CHECK(same_inside(&inner, &outer, 0));
    cranny_frame_destroy(&a);
    cranny_frame_destroy(&b);
    leave(&stage);
}

/* A mask with holes in its left half, and a solid floor that lies behind a part of it. */
static void test_alpha(void)
{
    struct cranny_error why;
    struct stage stage = {.scene = new_scene()};
    const uint8_t texels[2] = {0, 255};
    const struct cranny_alpha_texture texture = {.width = 2,
                                                 .height = 1,
                                                 .wrap_u = CRANNY_WRAP_CLAMP,
                                                 .wrap_v = CRANNY_WRAP_CLAMP,
                                                 .alpha = texels};
    struct cranny_material fence = cranny_material_default();
    uint32_t index, material;
    CHECK_OK(cranny_scene_add_texture(stage.scene, &texture, &index, &why), why);
    fence.alpha_mode = CRANNY_ALPHA_MASK;
    fence.alpha_texture = (int)index;
    CHECK_OK(cranny_scene_add_material(stage.scene, &fence, &material, &why), why);
    add_quad(stage.scene, (double[3]){-1, 0, 1}, (double[3]){2, 0, 0}, (double[3]){0, 0, -2},
             material);
    add_quad(stage.scene, (double[3]){-1, -1, 0}, (double[3]){2, 0, 0}, (double[3]){0, 0, -1}, 0);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look_down(0, 3, 0, 1);
    const struct cranny_frame_params params = frame_size(8, 8);
    struct cranny_frame *frame = draw(&stage, &params);
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    const float(*normals)[3] = g.normal;
    for (int row = 0; row < 8; row++)
        for (int column = 0; column < 8; column++) {
            const size_t i = sample_at(&g, column, row, 0);
            const double expected = column >= 4 ? 3 : row < 4 ? 4 : INFINITY;
            CHECK_MSG((double)g.depth[i] == expected, "%d %d: %g, not %g", column, row,
                      (double)g.depth[i], expected);
            CHECK_NEAR(normals[i][2], 1, 1e-6);
        }
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void test_near_and_ground(void)
{
    struct cranny_error why;
    struct stage stage = {.scene = new_scene()};
    add_quad(stage.scene, (double[3]){-1, 2, 1}, (double[3]){2, 0, 0}, (double[3]){0, 0, -2}, 0);
    add_quad(stage.scene, (double[3]){-1, 1, 1}, (double[3]){2, 0, 0}, (double[3]){0, 0, -2}, 0);
    struct cranny_tracer_params with = cranny_tracer_params_default();
    with.ground = true;
    with.ground_height = -0.5f;
    CHECK_OK(cranny_tracer_create(stage.scene, &with, &stage.tracer, &why), why);
    const struct cranny_frame_params params = frame_size(4, 4);
    for (int k = 0; k < 6; k++) {
        stage.camera = look((double[3]){0, 4, 0}, (double[3]){0, 0, -1e-9}, 0.2f);
        stage.camera.orthographic = k & 1;
        stage.camera.half_height = 0.4f;
        stage.camera.near_plane = k < 2 ? 1.9f : k < 4 ? 2.1f : 3.5f;
        struct cranny_frame *frame = draw(&stage, &params);
        const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
        const float(*normals)[3] = g.normal;
        for (size_t i = 0; i < 16; i++) {
            CHECK_NEAR(g.depth[i], k < 2 ? 2 : k < 4 ? 3 : 4.5, 1e-6);
            CHECK_NEAR(normals[i][2], 1, 1e-6);
        }
        cranny_frame_destroy(&frame);
    }
    leave(&stage);
}

/* A coarse ball with the normals of a fine one: at its rim they point away from the viewer. */
static uint32_t smooth_ball(struct cranny_scene *scene)
{
    enum { RINGS = 5, COLUMNS = 7, COUNT = (RINGS + 1) * (COLUMNS + 1) };
    float positions[COUNT][3];
    uint32_t triangles[RINGS * COLUMNS * 2][3], count = 0, index = 0;
    struct cranny_error why;
    for (uint32_t i = 0; i <= RINGS; i++)
        for (uint32_t j = 0; j <= COLUMNS; j++) {
            const double theta = acos(-1) * i / RINGS, phi = 2 * acos(-1) * j / COLUMNS;
            float *p = positions[i * (COLUMNS + 1) + j];
            p[0] = (float)(sin(theta) * cos(phi));
            p[1] = (float)cos(theta);
            p[2] = (float)(sin(theta) * sin(phi));
        }
    for (uint32_t i = 0; i < RINGS; i++)
        for (uint32_t j = 0; j < COLUMNS; j++) {
            const uint32_t a = i * (COLUMNS + 1) + j, b = a + COLUMNS + 1;
            memcpy(triangles[count++], (uint32_t[3]){a, a + 1, b}, 12);
            memcpy(triangles[count++], (uint32_t[3]){a + 1, b + 1, b}, 12);
        }
    const struct cranny_mesh mesh = {.name = "",
                                     .vertex_count = COUNT,
                                     .triangle_count = count,
                                     .positions = (const float(*)[3])positions,
                                     .normals = (const float(*)[3])positions,
                                     .triangles = (const uint32_t(*)[3])triangles};
    CHECK_OK(cranny_scene_add_mesh(scene, &mesh, &index, &why), why);
    return index;
}

/* All normals unit and towards the viewer. Returns the samples that saw the ball; counts those
 * that lean no more than they must. */
static int check_facing(const struct cranny_gbuffer *g, int *leaning, double *bent)
{
    int seen = 0;
    const float(*normals)[3] = g->normal;
    *leaning = 0;
    *bent = 0;
    for (int row = 0; row < g->height; row++)
        for (int column = 0; column < g->width; column++) {
            const size_t i = sample_at(g, column, row, 0);
            if (!isfinite(g->depth[i]))
                continue;
            double xy[2];
            place_of(g, column, row, 0, xy);
            const bool parallel = g->projection.kind == CRANNY_ORTHOGRAPHIC;
            const double n[3] = {(double)normals[i][0], (double)normals[i][1],
                                 (double)normals[i][2]};
            const double v[3] = {parallel ? 0 : xy[0], parallel ? 0 : xy[1], -1};
            CHECK_MSG(dot(n, v) < 0, "%d %d: %g", column, row, dot(n, v));
            CHECK_NEAR(dot(n, n), 1, 1e-6);
            *leaning += dot(n, v) > -2e-4;
            /* On a ball around the origin, the smooth normal points along the position. */
            double p[3], center[3];
            const double depth = (double)g->depth[i];
            to_view(g->world_from_view, (double[3]){0, 0, 0}, true, center);
            for (int k = 0; k < 3; k++)
                p[k] = (parallel && k < 2 ? xy[k] : depth * v[k]) - center[k];
            *bent = fmax(*bent, acos(dot(p, n) / sqrt(dot(p, p))));
            seen++;
        }
    return seen;
}

static void test_smooth(void)
{
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        struct stage stage = {.scene = new_scene()};
        const double place[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, mirrored ? -1 : 1, 0};
        add_instance(stage.scene, smooth_ball(stage.scene), place);
        stage.tracer = new_tracer(stage.scene);
        stage.camera = look((double[3]){1, 2, 3}, (double[3]){0, 0, 0}, 0.6f);
        struct cranny_frame_params params = frame_size(60, 60);
        int leaning, seen;
        double bent;
        for (int k = 0; k < 2; k++) {
            stage.camera.orthographic = k;
            stage.camera.half_height = 1.1f;
            params.normals = CRANNY_FRAME_SMOOTH;
            struct cranny_frame *frame = draw(&stage, &params);
            struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
            seen = check_facing(&g, &leaning, &bent);
            CHECK_MSG(seen > 1500, "%d seen", seen);
            CHECK_MSG(leaning > 5 && leaning < seen / 10, "%d leaning", leaning);
            CHECK_MSG(bent < 0.4, "a normal is bent by %g", bent);
            cranny_frame_destroy(&frame);
            params.normals = CRANNY_FRAME_FACE;
            frame = draw(&stage, &params);
            g = cranny_frame_gbuffer(frame);
            check_facing(&g, &leaning, &bent);
            CHECK_INT(leaning, 0);
            CHECK_MSG(bent > 0.4, "flat faces look smooth: %g", bent);
            cranny_frame_destroy(&frame);
        }
        leave(&stage);
    }
}

static void test_threads(void)
{
    struct stage stage = room();
    struct cranny_frame_params params = frame_size(50, 30);
    params.samples = 2;
    struct cranny_frame *frames[3];
    for (int k = 0; k < 3; k++) {
        params.threads = (const int[3]){1, 2, 7}[k];
        frames[k] = draw(&stage, &params);
        const struct cranny_gbuffer a = cranny_frame_gbuffer(frames[0]);
        const struct cranny_gbuffer b = cranny_frame_gbuffer(frames[k]);
        CHECK(same_inside(&a, &b, 0));
    }
    for (int k = 0; k < 3; k++)
        cranny_frame_destroy(&frames[k]);
    leave(&stage);
}

static void test_cameras(void)
{
    struct cranny_error why;
    struct stage stage = {.scene = new_scene()};
    const double target[3] = {7, 3, -4}, eye[3] = {2, 9, 5}, tilted[3] = {0.3, 1, -0.2};
    add_instance(stage.scene, sphere_mesh(stage.scene, target, 0.02, 8), identity);
    stage.tracer = new_tracer(stage.scene);
    CHECK_OK(cranny_camera_look_at(eye, target, tilted, 0.8f, &stage.camera, &why), why);
    const double *m = stage.camera.world_from_view;
    double view[3];
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            CHECK_NEAR(m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b], a == b, 1e-12);
    to_view(m, tilted, false, view);
    CHECK(fabs(view[0]) < 1e-12 && view[1] > 0);
    const struct cranny_frame_params params = frame_size(31, 31);
    struct cranny_frame *frame = draw(&stage, &params);
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    for (size_t i = 0; i < 31 * 31; i++)
        CHECK_MSG(i == 15 * 31 + 15 || isinf(g.depth[i]), "pixel %zu is at %g", i,
                  (double)g.depth[i]);
    CHECK_NEAR(g.depth[15 * 31 + 15], sqrt(25 + 36 + 81), 0.021);
    cranny_frame_destroy(&frame);
    struct cranny_camera other;
    CHECK_INT(cranny_camera_look_at(eye, eye, tilted, 1, &other, &why), CRANNY_USAGE);
    CHECK_INT(
        cranny_camera_look_at(eye, (double[3]){2, 0, 5}, (double[3]){0, 1, 0}, 1, &other, &why),
        CRANNY_USAGE);
    CHECK_INT(cranny_camera_look_at(eye, target, tilted, 4, &other, &why), CRANNY_USAGE);
    CHECK_INT(cranny_camera_look_at((double[3]){NAN, 0, 0}, target, tilted, 1, &other, &why),
              CRANNY_USAGE);
    CHECK_OK(cranny_camera_default(stage.scene, stage.tracer, 1.5f, &stage.camera, &why), why);
    CHECK_INT(cranny_camera_default(stage.scene, stage.tracer, 0, &other, &why), CRANNY_USAGE);
    frame = draw(&stage, &params);
    const struct cranny_gbuffer all = cranny_frame_gbuffer(frame);
    CHECK(isfinite(all.depth[15 * 31 + 15]) && isinf(all.depth[0]));
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void test_refusals(void)
{
    struct stage stage = room();
    struct cranny_error why;
    struct cranny_frame *frame = (struct cranny_frame *)&stage;
    const struct cranny_hooks hooks = {.user = "frame", .progress = stop_at_once};
    struct cranny_frame_params params = frame_size(64, 64);
    params.hooks = &hooks;
    CHECK_INT(cranny_frame_create(stage.scene, stage.tracer, &stage.camera, &params, &frame, &why),
              CRANNY_CANCELLED);
    CHECK(!frame);
    const struct cranny_frame_params wrong[] = {
        {.width = 0, .height = 1, .samples = 1},
        {.width = 1, .height = CRANNY_SIDE_MAX, .samples = 1, .guard_band = 1},
        {.width = 1, .height = 1, .samples = 3},
        {.width = 1, .height = 1, .samples = 1, .guard_band = -1},
        {.width = 1, .height = 1, .samples = 1, .normals = 2},
        {.width = 1, .height = 1, .samples = 1, .threads = -1},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        CHECK_INT(
            cranny_frame_create(stage.scene, stage.tracer, &stage.camera, &wrong[i], &frame, &why),
            CRANNY_USAGE);
    stage.camera.fov_y = 0;
    CHECK_INT(cranny_frame_create(stage.scene, stage.tracer, &stage.camera, NULL, &frame, &why),
              CRANNY_USAGE);
    cranny_frame_destroy(&frame);
    cranny_frame_destroy(NULL);
    leave(&stage);
}

/* A floor with a red half, a roof over a part of it, and sky beside it. */
static struct stage court(void)
{
    struct cranny_error why;
    struct stage stage = {.scene = new_scene()};
    struct cranny_material red = cranny_material_default();
    memcpy(red.base_color, (float[4]){0.8f, 0.05f, 0.05f, 1}, sizeof red.base_color);
    uint32_t material;
    CHECK_OK(cranny_scene_add_material(stage.scene, &red, &material, &why), why);
    const double u[3] = {0, 0, -2}, v[3] = {1, 0, 0};
    add_quad(stage.scene, (double[3]){-1, 0, 1}, v, u, 0);
    add_quad(stage.scene, (double[3]){0, 0, 1}, v, u, material);
    add_quad(stage.scene, (double[3]){-1, 5, 1}, (double[3]){2, 0, 0}, (double[3]){0, 0, -1}, 0);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look_down(0, 3, 0, 1.5f);
    return stage;
}

enum { SIDE = 24 };

static void shade(const struct cranny_frame *frame, const float *visibility,
                  const struct cranny_light *light, int threads, uint8_t rgb[SIDE * SIDE][3])
{
    struct cranny_error why;
    CHECK_OK(cranny_frame_shade(frame, visibility, 0, light, threads, rgb[0], &why), why);
}

static void test_shade(void)
{
    struct stage stage = court();
    const struct cranny_frame_params params = frame_size(SIDE, SIDE);
    struct cranny_frame *frame = draw(&stage, &params);
    static uint8_t open[SIDE * SIDE][3], half[SIDE * SIDE][3], other[SIDE * SIDE][3];
    static float visibility[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++)
        visibility[i] = 0.5f;
    struct cranny_light light = cranny_light_default();
    light.exposure = 1;
    const size_t white = 12 * SIDE + 7, reddish = 12 * SIDE + 16, sky = 0;
    shade(frame, NULL, &light, 1, open);
    shade(frame, visibility, &light, 2, half);
    for (int i = 0; i < 3; i++) {
        const double level = pow(open[white][i] / 255.0, 2.2),
                     dim = pow(half[white][i] / 255.0, 2.2);
        CHECK_NEAR(level, light.sky[i], 0.02);
        CHECK_NEAR(dim / level, 0.5, 0.02);
    }
    CHECK(open[reddish][0] > 3 * open[reddish][1]);
    CHECK(open[sky][2] > open[sky][0]);
    CHECK(memcmp(open[sky], half[sky], 3) == 0);
    light.weights[0] = 0;
    shade(frame, visibility, &light, 7, other);
    CHECK(memcmp(open, other, sizeof open) == 0);
    /* The sun stands over the court; the roof's shadow lies on the picture's lower half. */
    memcpy(light.sun, (float[3]){1, 1, 1}, sizeof light.sun);
    memcpy(light.sun_direction, (float[3]){0, 7, 0}, sizeof light.sun_direction);
    memcpy(light.sky, (float[3]){0.1f, 0.1f, 0.1f}, sizeof light.sky);
    light.exposure = 0.5f;
    shade(frame, NULL, &light, 0, other);
    CHECK_MSG(other[7 * SIDE + 7][1] > 2 * other[16 * SIDE + 7][1], "lit %d, shadow %d",
              other[7 * SIDE + 7][1], other[16 * SIDE + 7][1]);
    light.weights[1] = 1;
    shade(frame, visibility, &light, 0, half);
    CHECK(half[7 * SIDE + 7][1] < other[7 * SIDE + 7][1]);
    CHECK_INT(half[16 * SIDE + 7][1], other[16 * SIDE + 7][1]);
    /* An unset exposure brings dark and bright pictures together. */
    light = cranny_light_default();
    shade(frame, NULL, &light, 0, open);
    for (int i = 0; i < 3; i++) {
        light.sky[i] *= 0.6f;
        light.ground[i] *= 0.6f;
    }
    shade(frame, NULL, &light, 0, other);
    CHECK(open[white][1] > 100 && abs(open[white][1] - other[white][1]) <= 1);
    /* What it chose can be asked for, and gives the same picture. */
    struct cranny_error why;
    CHECK_OK(cranny_frame_exposure(frame, NULL, 0, &light, &light.exposure, &why), why);
    shade(frame, NULL, &light, 0, half);
    CHECK(memcmp(half, other, sizeof half) == 0);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void test_shade_refusals(void)
{
    struct stage stage = court();
    struct cranny_error why;
    const struct cranny_frame_params params = frame_size(1, 1);
    struct cranny_frame *frame = draw(&stage, &params);
    uint8_t rgb[3];
    struct cranny_light light = cranny_light_default();
    light.exposure = -1;
    CHECK_INT(cranny_frame_shade(frame, NULL, 0, &light, 0, rgb, &why), CRANNY_USAGE);
    light = cranny_light_default();
    light.weights[2] = 2;
    CHECK_INT(cranny_frame_shade(frame, NULL, 0, &light, 0, rgb, &why), CRANNY_USAGE);
    light = cranny_light_default();
    light.sun[0] = 1;
    memset(light.sun_direction, 0, sizeof light.sun_direction);
    CHECK_INT(cranny_frame_shade(frame, NULL, 0, &light, 0, rgb, &why), CRANNY_USAGE);
    CHECK_INT(cranny_frame_shade(frame, NULL, 0, NULL, -1, rgb, &why), CRANNY_USAGE);
    float exposure = 7;
    CHECK_INT(cranny_frame_exposure(frame, NULL, 0, &light, &exposure, &why), CRANNY_USAGE);
    CHECK(exposure == 0);
    CHECK_INT(cranny_frame_exposure(frame, NULL, 0, NULL, NULL, &why), CRANNY_USAGE);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

int main(void)
{
    test_sample_positions();
    test_plane();
    test_fields();
    test_guard_band();
    test_alpha();
    test_near_and_ground();
    test_smooth();
    test_threads();
    test_cameras();
    test_refusals();
    test_shade();
    test_shade_refusals();
    return check_end("frame");
}
