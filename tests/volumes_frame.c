/* Ambient occlusion volumes on frames: the kernels against sums in double over every polygon, the
 * same bits whatever runs them, closed forms, invariances, hostile scenes, sparse sampling, and the
 * truth. */
#include "frame_scenes.h"

#include <cranny/compare.h>
#include <cranny/volumes.h>

enum { WIDTH = 122, HEIGHT = 70, PIXELS = WIDTH * HEIGHT };

static float one[PIXELS], two[PIXELS];
static uint32_t seed = 7;

static double draw_unit(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (seed >> 8) * 0x1p-24;
}

static struct cranny_volumes_params params_of(float radius)
{
    struct cranny_volumes_params params = cranny_volumes_params_preset("paper");
    params.radius_world = radius;
    return params;
}

static struct cranny_volumes *volumes_of(const struct cranny_scene *scene, bool quads)
{
    struct cranny_error why;
    struct cranny_volumes *volumes;
    struct cranny_volumes_params params = params_of(1);
    params.quads = quads;
    CHECK_OK(cranny_volumes_create(scene, &params, &volumes, &why), why);
    return volumes;
}

static void render(const struct cranny_volumes *volumes, const struct cranny_frame *frame,
                   const struct cranny_volumes_params *params, float *out)
{
    struct cranny_error why;
    const struct cranny_gbuffer gbuffer = cranny_frame_gbuffer(frame);
    CHECK_OK(cranny_volumes_render(volumes, &gbuffer, params, out, 0, &why), why);
    int bad = 0;
    for (int i = 0; i < PIXELS; i++)
        bad += !(out[i] >= 0 && out[i] <= 1);
    CHECK_INT(bad, 0);
}

static void move(const double m[12], double x, double y, double z, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = m[4 * k] * x + m[4 * k + 1] * y + m[4 * k + 2] * z + m[4 * k + 3];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; k++)
        c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void unit(double v[3])
{
    const double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

/* Eq. 24 with all planes, over the hull of eq. 28 (δ in metres); −1: too near to a boundary for
 * floats to agree. */
static double falloff_of(const double p[3][3], const double x[3], double delta)
{
    double face[3], u[3], v[3], m[3][3], moved[3][3], g = 1, nearest = 1;
    for (int k = 0; k < 3; k++) {
        u[k] = p[1][k] - p[0][k];
        v[k] = p[2][k] - p[0][k];
    }
    cross(u, v, face);
    unit(face);
    for (int i = 0; i < 3; i++) {
        double d[3];
        for (int k = 0; k < 3; k++)
            d[k] = p[(i + 1) % 3][k] - p[i][k];
        unit(d);
        cross(face, d, m[i]);
    }
    double height = 0;
    for (int k = 0; k < 3; k++)
        height += face[k] * (x[k] - p[0][k]) / delta;
    g = height > 0 ? fmax(0, 1 - height) : 0;
    nearest = fabs(height);
    for (int i = 0; i < 3; i++) {
        double t = 1;
        for (int k = 0; k < 3; k++)
            t += m[i][k] * (x[k] - p[i][k]) / delta;
        g *= fmax(0, fmin(1, t));
        const double *a = m[(i + 2) % 3], *b = m[i], q = 1 + dot(a, b);
        for (int k = 0; k < 3; k++)
            moved[i][k] = p[i][k] - delta * (a[k] + b[k]) * (q < 0.5 ? sqrt(2 / q) : 1 / q);
    }
    for (int i = 0; i < 3; i++) {
        double d[3], inward[3], s = 0;
        for (int k = 0; k < 3; k++)
            d[k] = moved[(i + 1) % 3][k] - moved[i][k];
        unit(d);
        cross(face, d, inward);
        for (int k = 0; k < 3; k++)
            s += inward[k] * (x[k] - moved[i][k]) / delta;
        nearest = fmin(nearest, fabs(s));
        g = s > 0 ? g : 0;
    }
    return nearest < 1e-4 ? -1 : g;
}

struct soup {
    double corners[512][3][3];
    int count;
};

/* Triangles of all shapes above and in a floor of 6 × 6 m. */
static struct cranny_scene *soup_scene(struct soup *soup)
{
    enum { COUNT = 220 };
    static float positions[3 * COUNT + 6][3];
    static uint32_t corners[COUNT + 2][3];
    struct cranny_scene *scene = new_scene();
    for (int t = 0; t < COUNT; t++) {
        const double size = t % 10 == 0 ? 2 : 0.3, thin = t % 4 ? 1 : 0.03;
        const double middle[3] = {4 * draw_unit() - 2, 1.5 * draw_unit(), 4 * draw_unit() - 2};
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                positions[3 * t + c][k] =
                    (float)(middle[k] + size * (draw_unit() - 0.5) * (k == t % 3 ? thin : 1));
    }
    static const float floor[6][3] = {{-3, 0, -3}, {-3, 0, 3}, {3, 0, 3},
                                      {-3, 0, -3}, {3, 0, 3},  {3, 0, -3}};
    memcpy(positions[3 * COUNT], floor, sizeof floor);
    soup->count = COUNT + 2;
    for (int t = 0; t < soup->count; t++)
        for (int c = 0; c < 3; c++) {
            corners[t][c] = (uint32_t)(3 * t + c);
            for (int k = 0; k < 3; k++)
                soup->corners[t][c][k] = (double)positions[3 * t + c][k];
        }
    add_instance(scene,
                 add_mesh(scene, 3 * COUNT + 6, (const float(*)[3])positions, NULL, COUNT + 2,
                          (const uint32_t(*)[3])corners, 0),
                 identity);
    return scene;
}

/* 1 − Σ g AO over all triangles; −1 where floats need not agree. */
static double reference_at(const struct soup *soup, const struct cranny_gbuffer *g, int i,
                           double delta)
{
    const size_t band = (size_t)g->viewport.y * (size_t)g->width + (size_t)g->viewport.x;
    const size_t at = band + (size_t)(i / WIDTH) * (size_t)g->width + (size_t)(i % WIDTH);
    const double depth = (double)g->depth[at];
    const float *n = (const float *)g->normal + 3 * at;
    const struct cranny_projection *p = &g->projection;
    if (!isfinite(depth))
        return 1;
    double x[3], tip[3], origin[3], normal[3], sum = 0;
    move(g->world_from_view,
         depth * (p->left + (i % WIDTH + 0.5) / WIDTH * ((double)p->right - (double)p->left)),
         depth * (p->top + (i / WIDTH + 0.5) / HEIGHT * ((double)p->bottom - (double)p->top)),
         -depth, x);
    move(g->world_from_view, (double)n[0], (double)n[1], (double)n[2], tip);
    move(g->world_from_view, 0, 0, 0, origin);
    for (int k = 0; k < 3; k++)
        normal[k] = tip[k] - origin[k];
    for (int t = 0; t < soup->count; t++) {
        const double(*c)[3] = soup->corners[t];
        double low = 0, high = 0;
        for (int v = 0; v < 3; v++) {
            double h = 0;
            for (int k = 0; k < 3; k++)
                h += (c[v][k] - x[k]) * normal[k];
            low = fmin(low, h);
            high = fmax(high, h);
        }
        const double fall = high < 1e-5 ? 0 : falloff_of(c, x, delta);
        if (fall < 0)
            return -1;
        if (fall > 0)
            sum += fall * cranny_polygon_occlusion(c, 3, x, normal, CRANNY_FORM_SEGMENTS);
    }
    return fmax(0, 1 - sum);
}

static void test_every_polygon(void)
{
    static struct soup soup;
    struct stage stage = {.scene = soup_scene(&soup)};
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look((double[3]){0.3, 2.5, 3.5}, (double[3]){0, 0.4, 0}, 0.9f);
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_volumes *volumes = volumes_of(stage.scene, false);
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    for (int k = 0; k < 3; k++) {
        static const float radii[3] = {0.2f, 0.7f, 3};
        struct cranny_volumes_params params = params_of(radii[k]);
        params.bias = 0;
        render(volumes, frame, &params, one);
        int off = 0, compared = 0;
        double worst = 0, mean = 0;
        for (int i = 0; i < PIXELS; i++) {
            const double exact =
                reference_at(&soup, &g, i, (double)(params.delta_scale * params.radius_world));
            if (exact < 0)
                continue;
            const double error = fabs((double)one[i] - exact);
            compared++;
            off += error > 1e-4;
            worst = fmax(worst, error);
            mean += exact / PIXELS;
        }
        CHECK_MSG(off <= PIXELS / 500, "%d of %d pixels, worst %g", off, compared, worst);
        CHECK(compared > PIXELS * 9 / 10);
        CHECK_MSG(mean > 0.3 && mean < 0.999, "mean %g", mean);
    }
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void check_same(const struct cranny_volumes *volumes, const struct cranny_frame *frame,
                       struct cranny_volumes_params params)
{
    params.isa = CRANNY_ISA_PORTABLE;
    params.threads = 1;
    render(volumes, frame, &params, one);
    for (int isa = CRANNY_ISA_PORTABLE; isa <= (int)cranny_isa_best(); isa++)
        for (int threads = 1; threads <= 7; threads += 3) {
            params.isa = isa;
            params.threads = threads;
            render(volumes, frame, &params, two);
            CHECK_MSG(memcmp(one, two, sizeof one) == 0, "%s, %d threads, spacing %d",
                      cranny_isa_name((enum cranny_isa)isa), threads, params.spacing);
        }
}

static void test_same_bits(void)
{
    static struct soup soup;
    struct stage stage = {.scene = soup_scene(&soup)};
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look((double[3]){0.3, 0.6, 2.5}, (double[3]){0, 0.6, 0}, 1.2f);
    struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    size.normals = CRANNY_FRAME_SMOOTH;
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_volumes *volumes = volumes_of(stage.scene, true);
    for (int k = 0; k < 6; k++) {
        struct cranny_volumes_params params = params_of(k & 1 ? 0.4f : 2);
        params.faces = k % 3;
        params.combine = k % 3;
        params.contrast = k & 2 ? 1.3f : 1;
        params.spacing = k < 3 ? 1 : k;
        params.refine = k != 4;
        check_same(volumes, frame, params);
    }
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* A floor of many triangles seen at a slant, from near to far, whole and sparse: open to the bit.
 */
static void test_plane_is_open(void)
{
    enum { SIDE = 40 };
    static float positions[(SIDE + 1) * (SIDE + 1)][3];
    static uint32_t corners[2 * SIDE * SIDE][3];
    int count = 0;
    for (int i = 0; i <= SIDE; i++)
        for (int j = 0; j <= SIDE; j++) {
            const float jitter = (float)(0.3 * draw_unit());
            float *p = positions[i * (SIDE + 1) + j];
            p[0] = (float)i - SIDE / 2 + jitter;
            p[2] = (float)j - SIDE / 2;
        }
    for (int i = 0; i < SIDE; i++)
        for (int j = 0; j < SIDE; j++) {
            const uint32_t a = (uint32_t)(i * (SIDE + 1) + j), b = a + SIDE + 1;
            memcpy(corners[count++], (uint32_t[3]){a, a + 1, b}, sizeof corners[0]);
            memcpy(corners[count++], (uint32_t[3]){a + 1, b + 1, b}, sizeof corners[0]);
        }
    struct stage stage = {.scene = new_scene()};
    const double turned[12] = {0.8, -0.6, 0, 103.7, 0.6, 0.8, 0, -20.1, 0, 0, 1, 55.5};
    add_instance(stage.scene,
                 add_mesh(stage.scene, (SIDE + 1) * (SIDE + 1), (const float(*)[3])positions, NULL,
                          2 * SIDE * SIDE, (const uint32_t(*)[3])corners, 0),
                 turned);
    stage.tracer = new_tracer(stage.scene);
    double eye[3], target[3];
    move(turned, 0, 1.5, 18, eye);
    move(turned, 0, 0, 5, target);
    stage.camera = look(eye, target, 1);
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    for (int quads = 0; quads < 2; quads++) {
        struct cranny_volumes *volumes = volumes_of(stage.scene, quads);
        for (int k = 0; k < 6; k++) {
            static const float radii[2] = {0.5f, 30};
            struct cranny_volumes_params params = params_of(radii[k & 1]);
            params.spacing = k / 2 * 2 + 1;
            params.faces = CRANNY_FACES_BOTH;
            params.refine = true;
            render(volumes, frame, &params, one);
            int dark = 0;
            for (int i = 0; i < PIXELS; i++)
                dark += one[i] < (params.spacing == 1 ? 1 : 0.999999f);
            CHECK_INT(dark, 0);
        }
        cranny_volumes_destroy(&volumes);
    }
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* One pixel's worth of a frame made by hand: a point at `depth` under a camera that looks down. */
static double visibility_at(const struct cranny_volumes *volumes,
                            const struct cranny_volumes_params *params, double height, double depth)
{
    struct cranny_error why;
    const float d = (float)depth, normal[3] = {0, 0, 1};
    const double down[12] = {1, 0, 0, 0, 0, 0, 1, height, 0, -1, 0, 0};
    const struct cranny_gbuffer g = {.width = 1,
                                     .height = 1,
                                     .depth = &d,
                                     .normal = normal,
                                     .projection = cranny_orthographic(0.001f, 1),
                                     .world_from_view = down};
    float out = -1;
    CHECK_OK(cranny_volumes_render(volumes, &g, params, &out, 0, &why), why);
    return (double)out;
}

/* A wall beside the point, faced, at distance d: (1 − d/δ) ½ (1 − d / √(d² + h²)); 0 from behind,
 * unless both sides or the material say so; and with half an alpha, half of it. */
static void test_wall(void)
{
    for (int k = 0; k < 5; k++) {
        struct cranny_scene *scene = new_scene();
        struct cranny_error why;
        struct cranny_material other = cranny_material_default();
        uint32_t material = 0;
        other.double_sided = k == 3;
        other.alpha_mode = k == 4 ? CRANNY_ALPHA_BLEND : CRANNY_ALPHA_OPAQUE;
        other.opacity = k == 4 ? 0.5f : 1;
        CHECK_OK(cranny_scene_add_material(scene, &other, &material, &why), why);
        const double d = 0.13, h = 0.7, width = 500;
        const bool away = k >= 1 && k <= 3;
        add_quad(scene, (double[3]){d, 0, away ? -width : width},
                 (double[3]){0, 0, (away ? 2 : -2) * width}, (double[3]){0, -h, 0}, material);
        /* Lifted so that it stands on the floor's height. */
        struct cranny_volumes *volumes = volumes_of(scene, true);
        struct cranny_volumes_params params = params_of(1);
        params.faces = k == 2 ? CRANNY_FACES_BOTH : CRANNY_FACES_MATERIAL;
        params.bias = 0;
        CHECK_INT(cranny_volumes_info(volumes).quads, 1);
        const double share = 0.5 * (1 - d / sqrt(d * d + h * h)), g = 1 - d / 0.6;
        const double hidden = k == 1 ? 0 : k == 4 ? 0.5 * g * share : g * share;
        CHECK_NEAR(visibility_at(volumes, &params, 1, 1 + h), 1 - hidden, 2e-5);
        cranny_volumes_destroy(&volumes);
        cranny_scene_destroy(&scene);
    }
}

/* The bias is a share of the picture's height: under a parallel camera the same from every height,
 * and at 1 more than all of the wall. */
static void test_bias(void)
{
    struct cranny_scene *scene = new_scene();
    add_quad(scene, (double[3]){0.13, 0, 500}, (double[3]){0, 0, -1000}, (double[3]){0, -0.001, 0},
             0);
    struct cranny_volumes *volumes = volumes_of(scene, true);
    struct cranny_volumes_params params = params_of(1);
    double seen[3];
    for (int k = 0; k < 3; k++) {
        static const double depths[3] = {0.1, 1, 100};
        params.bias = 0.25f; /* of 2 mm */
        seen[k] = visibility_at(volumes, &params, depths[k] - 0.001, depths[k]);
        CHECK_NEAR(seen[k], seen[0], 1e-7);
        params.bias = 1;
        CHECK_NEAR(visibility_at(volumes, &params, depths[k] - 0.001, depths[k]), 1, 0);
    }
    CHECK(seen[0] < 1);
    cranny_volumes_destroy(&volumes);
    cranny_scene_destroy(&scene);
}

/* A ceiling of 1 × 1 m: mirrored instances keep their fronts, and half-covered masks count half. */
static void test_ceiling(void)
{
    static const uint8_t stripes[8] = {255, 0, 255, 0, 0, 255, 0, 255};
    const double mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    double plain = 0;
    for (int k = 0; k < 3; k++) {
        struct cranny_scene *scene = new_scene();
        struct cranny_error why;
        struct cranny_material mask = cranny_material_default();
        const struct cranny_alpha_texture texture = {.width = 4, .height = 2, .alpha = stripes};
        uint32_t material = 0;
        CHECK_OK(cranny_scene_add_texture(scene, &texture, NULL, &why), why);
        mask.alpha_mode = CRANNY_ALPHA_MASK;
        mask.alpha_texture = 0;
        CHECK_OK(cranny_scene_add_material(scene, &mask, &material, &why), why);
        const uint32_t mesh = quad_mesh(scene, (double[3]){-0.5, 0.1, -0.5}, (double[3]){1, 0, 0},
                                        (double[3]){0, 0, 1}, k == 2 ? material : 0, 3);
        add_instance(scene, mesh, k == 1 ? mirror : identity);
        struct cranny_volumes *volumes = volumes_of(scene, true);
        struct cranny_volumes_params params = params_of(1);
        const double seen = visibility_at(volumes, &params, 0.05, 0.05);
        plain = k == 0 ? 1 - seen : plain;
        CHECK_MSG(plain > 0.7 && plain < 0.9, "%g", plain);
        CHECK_NEAR(1 - seen, k == 2 ? 0.5 * plain : plain, k == 2 ? 0.04 : 1e-6);
        cranny_volumes_destroy(&volumes);
        cranny_scene_destroy(&scene);
    }
}

/* The same room at any scale, anywhere. */
static void test_scales(void)
{
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    for (int k = 0; k < 4; k++) {
        static const double scales[4] = {1, 1e-3, 1e4, 1}, shifts[4] = {0, 0, 0, 700};
        const double s = scales[k], t = shifts[k];
        const double m[12] = {s, 0, 0, t, 0, s, 0, -t, 0, 0, s, 2 * t};
        struct stage stage = {.scene = new_scene()};
        add_instance(stage.scene,
                     box_mesh(stage.scene, (float[3]){-2, 0, -2}, (float[3]){2, 3, 2}, true), m);
        add_instance(stage.scene, sphere_mesh(stage.scene, (double[3]){0.5, 0.6, -0.5}, 0.6, 12),
                     m);
        stage.tracer = new_tracer(stage.scene);
        double eye[3], target[3];
        move(m, -1.5, 1.6, 1.8, eye);
        move(m, 0.5, 0.5, -0.5, target);
        stage.camera = look(eye, target, 1.2f);
        struct cranny_frame *frame = draw(&stage, &size);
        struct cranny_volumes *volumes = volumes_of(stage.scene, true);
        const struct cranny_volumes_params params = params_of((float)(1.5 * s));
        render(volumes, frame, &params, k ? two : one);
        int off = 0;
        double mean = 0;
        for (int i = 0; i < PIXELS; i++) {
            mean += (double)one[i] / PIXELS;
            off += k && fabs((double)one[i] - (double)two[i]) > (k == 3 ? 5e-3 : 2e-4);
        }
        CHECK_MSG(off < PIXELS / 100, "%d pixels differ at scale %g, shift %g", off, s, t);
        CHECK_MSG(mean > 0.7 && mean < 0.97, "mean %g", mean);
        cranny_volumes_destroy(&volumes);
        cranny_frame_destroy(&frame);
        leave(&stage);
    }
}

/* Points, lines, repeated corners; kilometres, light years, and beyond what squares can hold. */
static void add_hostile(struct cranny_scene *scene)
{
    static const float far[] = {1e3f, 1e6f, 1e9f, 1e15f, 1e18f, 1e24f, 3e37f};
    static const uint32_t corners[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 0, 1}, {1, 1, 1}};
    for (size_t i = 0; i < sizeof far / sizeof *far; i++)
        for (int k = 0; k < 3; k++) {
            const float f = far[i], y = 0.01f * (float)k;
            const float flat[4][3] = {{-f, y, -f}, {-f, y, f}, {f, y, f}, {f, y, -f}};
            const float line[4][3] = {{0, 0, 0}, {f, f, f}, {1, 1, 1}, {-f, -f, -f}};
            const float tiny[4][3] = {
                {0.5f, y, 0}, {0.5f + 1 / f, y, 0}, {0.5f, y + 1 / f, 1 / f}, {0.5f, y, 1 / f}};
            add_instance(scene, add_mesh(scene, 4, flat, NULL, 4, corners, 0), identity);
            add_instance(scene, add_mesh(scene, 4, line, NULL, 4, corners, 0), identity);
            add_instance(scene, add_mesh(scene, 4, tiny, NULL, 4, corners, 0), identity);
        }
}

static void test_hostile(void)
{
    struct stage stage = room();
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_scene *scene = new_scene();
    add_instance(scene, box_mesh(scene, (float[3]){-2, 0, -2}, (float[3]){2, 3, 2}, true),
                 identity);
    add_hostile(scene);
    /* A polygon through the eye. */
    add_quad(scene, (double[3]){-1.6, 1.5, 1.7}, (double[3]){0.2, 0.2, 0}, (double[3]){0, 0, 0.2},
             0);
    struct cranny_volumes *volumes = volumes_of(scene, true);
    const struct cranny_volumes_info info = cranny_volumes_info(volumes);
    CHECK(info.dropped > 40 && info.polygons > 20);
    for (int k = 0; k < 8; k++) {
        static const float radii[] = {1e-9f, 1e-4f, 0.3f, 5, 100, 1e6f, 1e9f, 2};
        struct cranny_volumes_params params = params_of(radii[k]);
        params.faces = k % 3;
        params.combine = (k + 1) % 3;
        params.spacing = k % 4 + 1;
        params.bias = k & 1 ? 0 : 1e-5f;
        render(volumes, frame, &params, one);
    }
    cranny_volumes_destroy(&volumes);
    cranny_scene_destroy(&scene);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void test_hostile_frames(void)
{
    static float depth[PIXELS], normals[PIXELS][3];
    static const float odd[] = {NAN, -1, 0, INFINITY, 1e-30f, 1e30f, 3e38f, 1, 2, 5};
    struct stage stage = room();
    struct cranny_error why;
    struct cranny_volumes *volumes = volumes_of(stage.scene, true);
    for (int i = 0; i < PIXELS; i++) {
        depth[i] = odd[(i * 7 + i / WIDTH) % 10];
        normals[i][i % 3] = i % 5 == 0 ? NAN : i % 5 == 1 ? 0 : i % 5 == 2 ? 1e30f : 1;
    }
    struct cranny_gbuffer g = {.width = WIDTH,
                               .height = HEIGHT,
                               .depth = depth,
                               .normal = normals,
                               .projection = cranny_perspective(1, 1.7f),
                               .world_from_view = stage.camera.world_from_view};
    for (int spacing = 1; spacing <= 16; spacing += 5) {
        struct cranny_volumes_params params = params_of(1);
        params.spacing = spacing;
        CHECK_OK(cranny_volumes_render(volumes, &g, &params, one, 0, &why), why);
        int bad = 0;
        for (int i = 0; i < PIXELS; i++)
            bad += !(one[i] >= 0 && one[i] <= 1);
        CHECK_INT(bad, 0);
    }
    for (int i = 0; i < PIXELS; i++)
        depth[i] = -1;
    CHECK_INT(cranny_volumes_render(volumes, &g, NULL, one, 0, &why), CRANNY_INPUT);
    g.world_from_view = NULL;
    CHECK_INT(cranny_volumes_render(volumes, &g, NULL, one, 0, &why), CRANNY_USAGE);
    CHECK_INT(cranny_volumes_render(NULL, &g, NULL, one, 0, &why), CRANNY_USAGE);
    CHECK_INT(cranny_volumes_render(volumes, &g, NULL, NULL, 0, &why), CRANNY_USAGE);
    struct cranny_volumes_params params = params_of(-1);
    CHECK_INT(cranny_volumes_render(volumes, &g, &params, one, 0, &why), CRANNY_USAGE);
    cranny_volumes_destroy(&volumes);
    cranny_volumes_destroy(&volumes);
    leave(&stage);
}

static void test_empty(void)
{
    struct stage stage = room();
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_scene *nothing = new_scene();
    struct cranny_volumes *volumes = volumes_of(nothing, true);
    const struct cranny_volumes_params params = params_of(1);
    render(volumes, frame, &params, one);
    for (int i = 0; i < PIXELS; i += 97)
        CHECK_NEAR((double)one[i], 1, 0);
    cranny_volumes_destroy(&volumes);
    cranny_scene_destroy(&nothing);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* Bytes a polygon, and quads of a tessellated sphere; a million triangles with an argument. */
static void test_memory(uint32_t rings)
{
    struct cranny_scene *scene = new_scene();
    add_instance(scene, sphere_mesh(scene, (double[3]){0, 0, 0}, 1, rings), identity);
    struct cranny_volumes *volumes = volumes_of(scene, true);
    const struct cranny_volumes_info info = cranny_volumes_info(volumes);
    printf("%llu triangles: %llu polygons, %.1f bytes each, %.2f s\n",
           (unsigned long long)info.triangles, (unsigned long long)info.polygons,
           (double)info.size_bytes / (double)info.polygons, info.seconds);
    CHECK(info.size_bytes <= 96 * info.polygons + 1024);
    CHECK(info.triangles == (uint64_t)rings * rings * 4);
    CHECK(2 * info.quads + (info.polygons - info.quads) + info.dropped == info.triangles);
    cranny_volumes_destroy(&volumes);
    cranny_scene_destroy(&scene);
}

/* A box is six quads, whatever its triangles' order; a bent pair stays two triangles. */
static void test_quads(void)
{
    struct cranny_scene *scene = new_scene();
    add_instance(scene, box_mesh(scene, (float[3]){0, 0, 0}, (float[3]){1, 2, 3}, false), identity);
    struct cranny_volumes *volumes = volumes_of(scene, true);
    CHECK_INT(cranny_volumes_info(volumes).quads, 6);
    CHECK_INT(cranny_volumes_info(volumes).polygons, 6);
    cranny_volumes_destroy(&volumes);
    volumes = volumes_of(scene, false);
    CHECK_INT(cranny_volumes_info(volumes).polygons, 12);
    cranny_volumes_destroy(&volumes);
    cranny_scene_destroy(&scene);
    static const float bent[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 0.1f, 1}, {0, 0, 1}};
    static const float dart[4][3] = {{0, 0, 0}, {1, 0, 0}, {0.1f, 0, 0.1f}, {0, 0, 1}};
    static const uint32_t corners[2][3] = {{0, 1, 2}, {0, 2, 3}};
    scene = new_scene();
    add_instance(scene, add_mesh(scene, 4, bent, NULL, 2, corners, 0), identity);
    add_instance(scene, add_mesh(scene, 4, dart, NULL, 2, corners, 0), identity);
    volumes = volumes_of(scene, true);
    CHECK_INT(cranny_volumes_info(volumes).polygons, 4);
    cranny_volumes_destroy(&volumes);
    cranny_scene_destroy(&scene);
}

static double error_between(const float *test, const float *reference)
{
    struct cranny_error why;
    struct cranny_difference d = {0};
    CHECK_OK(cranny_difference_measure(WIDTH, HEIGHT, test, 0, reference, 0, &d, &why), why);
    return d.error;
}

/* A room with a ball, near to the truth; and sparse samples near to all of them. */
static void test_truth(void)
{
    static const int spacings[] = {2, 3, 5, 15};
    static const double limits[] = {0.3, 0.45, 0.9, 2.1};
    struct stage stage = room();
    struct cranny_error why;
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_raytrace_params rays = cranny_raytrace_params_default();
    struct cranny_volumes *volumes = volumes_of(stage.scene, true);
    struct cranny_volumes_params params = params_of(1);
    rays.radius_world = 1;
    rays.rays = 1024;
    CHECK_OK(cranny_frame_raytrace(frame, &rays, two, 0, NULL, NULL, &why), why);
    render(volumes, frame, &params, one);
    const double error = error_between(one, two);
    CHECK_MSG(error < 0.35, "error %g", error);
    params.refine = true;
    for (int k = 0; k < 4; k++) {
        params.spacing = spacings[k];
        render(volumes, frame, &params, two);
        const double sparse = error_between(two, one);
        CHECK_MSG(sparse < limits[k], "spacing %d: %g", spacings[k], sparse);
        printf("spacing %d: %.3f from every pixel's\n", spacings[k], sparse);
    }
    printf("room: error %.3f\n", error);
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* Several samples: the mean of theirs, which is that of one at four times the size, nearly. */
static void test_samples(void)
{
    static float large[4 * PIXELS];
    struct stage stage = room();
    struct cranny_error why;
    struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    size.samples = 4;
    size.guard_band = 5;
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_volumes *volumes = volumes_of(stage.scene, true);
    const struct cranny_volumes_params params = params_of(1);
    render(volumes, frame, &params, one);
    cranny_frame_destroy(&frame);
    size = frame_size(2 * WIDTH, 2 * HEIGHT);
    frame = draw(&stage, &size);
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    CHECK_OK(cranny_volumes_render(volumes, &g, &params, large, 0, &why), why);
    double sum = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const float *at = large + 4 * y * WIDTH + 2 * x;
            const float mean = (at[0] + at[1] + at[2 * WIDTH] + at[2 * WIDTH + 1]) / 4;
            sum += fabs((double)(mean - one[y * WIDTH + x])) / PIXELS;
        }
    CHECK_MSG(sum < 0.003, "%g", sum);
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void test_cancel(void)
{
    struct stage stage = room();
    struct cranny_error why;
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    struct cranny_volumes *volumes;
    struct cranny_volumes_params params = params_of(1);
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    const struct cranny_hooks making = {.user = "volumes", .progress = stop_at_once};
    const struct cranny_hooks drawing = {.user = "occlusion", .progress = stop_at_once};
    params.hooks = &making;
    CHECK_INT(cranny_volumes_create(stage.scene, &params, &volumes, &why), CRANNY_CANCELLED);
    CHECK(volumes == NULL);
    volumes = volumes_of(stage.scene, true);
    params.hooks = &drawing;
    for (params.spacing = 1; params.spacing < 4; params.spacing++)
        CHECK_INT(cranny_volumes_render(volumes, &g, &params, one, 0, &why), CRANNY_CANCELLED);
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void test_presets(void)
{
    struct cranny_error why;
    struct cranny_volumes_params params = cranny_volumes_params_preset(NULL);
    params.radius_world = 3;
    params.threads = 2;
    params.spacing = 5;
    CHECK_OK(cranny_volumes_params_apply(&params, "paper", &why), why);
    CHECK_NEAR((double)params.radius_world, 3, 0);
    CHECK_INT(params.threads, 2);
    CHECK_INT(params.combine, CRANNY_COMBINE_SUM);
    CHECK_NEAR((double)params.delta_scale, 0.6, 1e-6);
    CHECK_INT(cranny_volumes_params_apply(&params, "none", &why), CRANNY_USAGE);
}

int main(int argc, char **argv)
{
    test_every_polygon();
    test_same_bits();
    test_plane_is_open();
    test_wall();
    test_bias();
    test_ceiling();
    test_scales();
    test_hostile();
    test_hostile_frames();
    test_empty();
    test_quads();
    test_memory(argc > 1 ? (uint32_t)atoi(argv[1]) : 100);
    test_truth();
    test_samples();
    test_cancel();
    test_presets();
    return check_end("volumes_frame");
}
