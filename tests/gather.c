/* Gathered obscurance against closed forms, and its invariances. */
#include "trace_scenes.h"

#include "base/sequence.h"
#include "trace/gather.h"
#include "trace/tracer.h"

#define POINTS_MAX 512
typedef float vec3[3];
static const vec3 up = {0, 1, 0};

static struct cranny_gather_params hard(int rays)
{
    struct cranny_gather_params params = cranny_gather_params_default();
    params.rays = rays;
    params.kernel = CRANNY_KERNEL_HARD;
    params.distances[0] = params.distances[1] = 1e12f;
    return params;
}

/* Visibility at one point. */
static double at(const struct cranny_tracer *tracer, const vec3 position, const vec3 normal,
                 const struct cranny_gather_params *params, float *back)
{
    struct cranny_error why;
    float visibility[1][2];
    CHECK_OK(cranny_gather(tracer, 1, (const vec3 *)position, (const vec3 *)normal, NULL, params,
                           visibility, back, &why),
             why);
    return visibility[0][0];
}

static void finish(struct cranny_tracer **tracer, struct cranny_scene **scene)
{
    cranny_tracer_destroy(tracer);
    cranny_scene_destroy(scene);
}

static void test_wall(void)
{
    struct cranny_scene *scene = new_scene();
    add_quad(scene, (double[3]){1, 0, -2000}, (double[3]){0, 0, 4000}, (double[3]){0, 2, 0}, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    const struct cranny_gather_params params = hard(4096);
    for (int i = 0; i < 5; i++) {
        const double distance = 0.25 * (1 << i), ratio = 2 / distance;
        const double occluded = 0.5 * (1 - 1 / sqrt(1 + ratio * ratio));
        const vec3 p = {(float)(1 - distance), 0, 0};
        CHECK_NEAR(at(tracer, p, up, &params, NULL), 1 - occluded, 0.005);
    }
    finish(&tracer, &scene);
}

/* A fan of many sides at height h over the point; also fills `scene` for other tests. */
static void add_disc(struct cranny_scene *scene, float radius, float height, uint32_t material)
{
    enum { SIDES = 720 };
    static vec3 positions[SIDES + 1];
    static uint32_t corners[SIDES][3];
    memcpy(positions[SIDES], (vec3){0, height, 0}, sizeof(vec3));
    for (uint32_t i = 0; i < SIDES; i++) {
        const double angle = 2 * acos(-1) * i / SIDES;
        positions[i][0] = (float)(radius * cos(angle));
        positions[i][1] = height;
        positions[i][2] = (float)(radius * sin(angle));
        memcpy(corners[i], (uint32_t[3]){SIDES, i, (i + 1) % SIDES}, sizeof corners[i]);
    }
    const uint32_t mesh = add_mesh(scene, SIDES + 1, positions, NULL, SIDES, corners, material);
    add_instance(scene, mesh, identity);
}

static void test_disc(void)
{
    struct cranny_scene *scene = new_scene();
    add_disc(scene, 1.5f, 2, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(4096);
    const double occluded = 1.5 * 1.5 / (1.5 * 1.5 + 2 * 2);
    for (int sampler = 0; sampler < 2; sampler++) {
        params.sampler = (enum cranny_sampler)sampler;
        CHECK_NEAR(at(tracer, (vec3){0, 0, 0}, up, &params, NULL), 1 - occluded, 0.005);
    }
    params.distances[0] = 1.9f; /* nearer than the disc: nothing counts */
    CHECK_NEAR(at(tracer, (vec3){0, 0, 0}, up, &params, NULL), 1, 0);
    finish(&tracer, &scene);
}

static void test_sphere_on_plane(void)
{
    struct cranny_scene *scene = new_scene();
    add_instance(scene, sphere_mesh(scene, (double[3]){0, 1, 0}, 1, 128), identity);
    add_quad(scene, (double[3]){-9, 0, -9}, (double[3]){0, 0, 18}, (double[3]){18, 0, 0}, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    const struct cranny_gather_params params = hard(4096);
    for (float x = 0.5f; x < 5; x *= 1.5f) {
        const double d2 = 1 + (double)x * x, occluded = 1 / sqrt(d2) / d2; /* cos θ (R/D)² */
        CHECK_NEAR(at(tracer, (vec3){x, 0, 0}, up, &params, NULL), 1 - occluded, 0.005);
    }
    finish(&tracer, &scene);
}

/* Mean of ρ over the cosine hemisphere in a box, from a point in the middle of its floor. */
static double box_integral(const double half[2], double height, enum cranny_kernel kernel, double r)
{
    const int side = 700;
    const double pi = acos(-1);
    double sum = 0;
    for (int i = 0; i < side; i++)
        for (int j = 0; j < side; j++) {
            const double area = (i + 0.5) / side, phi = 2 * pi * (j + 0.5) / side;
            const double x = sqrt(area) * cos(phi), z = sqrt(area) * sin(phi);
            const double y = sqrt(1 - area);
            double d = fmin(half[0] / fabs(x), half[1] / fabs(z));
            d = fmin(d, height / y);
            sum += kernel == CRANNY_KERNEL_LINEAR ? fmin(d / r, 1) : 1 - exp(log(0.5) * d / r);
        }
    return sum / side / side;
}

static void test_box(void)
{
    struct cranny_scene *scene = new_scene();
    add_instance(scene, box_mesh(scene, (vec3){-1, 0, -2}, (vec3){1, 3, 2}, true), identity);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(4096);
    float back = 1;
    CHECK_NEAR(at(tracer, (vec3){0, 0, 0}, up, &params, &back), 0, 0);
    CHECK_NEAR(back, 0, 0);
    const double half[2] = {1, 2};
    params.distances[0] = 1.7f;
    for (int kernel = 0; kernel < 2; kernel++) {
        params.kernel = (enum cranny_kernel)kernel;
        CHECK_NEAR(at(tracer, (vec3){0, 0, 0}, up, &params, NULL),
                   box_integral(half, 3, params.kernel, (double)params.distances[0]), 0.005);
    }
    /* From within, seen as an ordinary box: every ray meets a back. */
    finish(&tracer, &scene);
    scene = new_scene();
    add_instance(scene, box_mesh(scene, (vec3){-1, 0, -2}, (vec3){1, 3, 2}, false), identity);
    tracer = new_tracer(scene);
    at(tracer, (vec3){0, 1, 0}, up, &params, &back);
    CHECK_NEAR(back, 1, 0);
    finish(&tracer, &scene);
}

/* Many points around a closed sphere's inside: no ray may slip through between triangles. */
static void test_no_leaks(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    const double scale = 3.7;
    add_instance(scene, sphere_mesh(scene, (double[3]){0.3, 11, -5}, scale, 64), identity);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(4096);
    static vec3 positions[256], normals[256];
    static float visibility[256][2], back[256];
    for (int i = 0; i < 256; i++) {
        float c, s;
        c = cosf((float)i);
        s = sinf((float)i);
        memcpy(positions[i], (vec3){0.3f + c, 11 + s, -5 + 0.01f * (float)i}, sizeof(vec3));
        memcpy(normals[i], (vec3){c, s, 0}, sizeof(vec3));
    }
    for (int packet = 0; packet < 3; packet++) {
        params.packet = (enum cranny_packet)packet;
        CHECK_OK(
            cranny_gather(tracer, 256, positions, normals, NULL, &params, visibility, back, &why),
            why);
        double leaks = 0;
        for (int i = 0; i < 256; i++)
            leaks += (double)visibility[i][0] * 4096;
        CHECK_MSG(leaks == 0, "packet %d: %g of a million rays leak", packet, leaks);
    }
    finish(&tracer, &scene);
}

/* Rms over many points' rotations, against the closed form. */
static double disc_rms(enum cranny_sampler sampler, int rays)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    add_disc(scene, 1.5f, 2, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(rays);
    params.sampler = sampler;
    static vec3 positions[POINTS_MAX], normals[POINTS_MAX];
    static float visibility[POINTS_MAX][2];
    for (int i = 0; i < POINTS_MAX; i++)
        memcpy(normals[i], up, sizeof up);
    CHECK_OK(cranny_gather(tracer, POINTS_MAX, positions, normals, NULL, &params, visibility, NULL,
                           &why),
             why);
    double sum = 0;
    for (int i = 0; i < POINTS_MAX; i++)
        sum += pow((double)visibility[i][0] - 4 / 6.25, 2);
    finish(&tracer, &scene);
    return sqrt(sum / POINTS_MAX);
}

static void test_samplers(void)
{
    const double random = disc_rms(CRANNY_SAMPLER_RANDOM, 64);
    const double spiral = disc_rms(CRANNY_SAMPLER_SPIRAL, 64);
    const double sobol = disc_rms(CRANNY_SAMPLER_SOBOL, 64);
    CHECK_NEAR(random, sqrt(0.36 * 0.64 / 64), 0.006); /* binomial */
    CHECK_MSG(spiral < random / 3, "spiral %g, random %g", spiral, random);
    CHECK_MSG(sobol < random / 2, "sobol %g, random %g", sobol, random);
}

/* The smallest factor of ray_offset that keeps a tilted plane from shading itself is what it is
 * chosen by: no hit at the factor used, at any magnitude; hits at a sixteenth of it. */
static uint64_t self_hits(float magnitude, float size, float factor)
{
    struct cranny_scene *scene = new_scene();
    const double tilt[3] = {0.6, 0.48, 0.64};
    double u[3] = {0.8, -0.36, -0.48}, v[3] = {0, 0.8, -0.6};
    double corner[3];
    for (int k = 0; k < 3; k++) {
        corner[k] = (double)magnitude * (k == 1 ? 0.7 : 1) - size * 0.5 * (u[k] + v[k]);
        u[k] *= size;
        v[k] *= size;
    }
    add_quad(scene, corner, u, v, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    uint64_t hits = 0;
    for (uint32_t i = 0; i < 2000; i++) {
        const double a = unit_from_u32(hash_u32(2 * i)), b = unit_from_u32(hash_u32(2 * i + 1));
        vec3 p;
        struct ray_block block = {.reach = INFINITY};
        for (int k = 0; k < 3; k++)
            p[k] = (float)(corner[k] + a * u[k] + b * v[k]);
        const float offset = factor * ray_offset(p, size * 1.5f);
        for (int k = 0; k < 3; k++)
            p[k] += offset * (float)tilt[k];
        for (int r = 0; r < 16; r++) { /* grazing: a thousandth above the plane */
            const double angle = 0.4 * r + 0.1 * i;
            float d[3];
            for (int k = 0; k < 3; k++)
                d[k] =
                    (float)(cos(angle) * u[k] / size + sin(angle) * v[k] / size + 1e-3 * tilt[k]);
            block.x[r] = d[0];
            block.y[r] = d[1];
            block.z[r] = d[2];
        }
        ray_block_trace(tracer, CRANNY_PACKET_8, p, &block, 16);
        for (int r = 0; r < 16; r++)
            hits += isfinite(block.distance[r]);
    }
    finish(&tracer, &scene);
    return hits;
}

static void test_offset(void)
{
    const float magnitudes[] = {0, 1, 1e3f, 1e5f}, sizes[] = {1e-2f, 1, 1e3f};
    uint64_t below = 0;
    for (int m = 0; m < 4; m++)
        for (int s = 0; s < 3; s++) {
            if (sizes[s] < magnitudes[m] * 1e-5f)
                continue; /* the face is not a plane in floats any more */
            const uint64_t hits = self_hits(magnitudes[m], sizes[s], 1);
            CHECK_MSG(hits == 0, "%llu of 32000 rays at %g, size %g", (unsigned long long)hits,
                      (double)magnitudes[m], (double)sizes[s]);
            below += self_hits(magnitudes[m], sizes[s], 1.0f / 64);
            if (getenv("CRANNY_SCAN"))
                for (float f = 2; f > 0.01f; f /= 2)
                    printf("at %g size %g factor %g: %llu\n", (double)magnitudes[m],
                           (double)sizes[s], (double)f,
                           (unsigned long long)self_hits(magnitudes[m], sizes[s], f));
        }
    CHECK_MSG(below > 0, "a 64 times smaller offset would do: the constant is too large");
}

/* A room with a ball in it, under a transform of everything. */
static void room_values(double scale, double shift, bool mirrored, bool shared, int threads,
                        enum cranny_packet packet, float out[POINTS_MAX][2])
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    const float m = mirrored ? -1 : 1;
    const uint32_t ball = sphere_mesh(scene, (double[3]){mirrored ? -1 : 1, 0.5, 0}, 0.5, 32);
    const uint32_t box = box_mesh(scene, (vec3){-2, 0, -2}, (vec3){2, 3, 2}, true);
    const double place[12] = {m * scale, 0, 0, shift, 0, scale, 0, shift, 0, 0, scale, 0};
    add_instance(scene, box, place);
    add_instance(scene, ball, place);
    if (shared) { /* a second user far away turns the ball into an Embree instance */
        double away[12];
        memcpy(away, place, sizeof away);
        away[3] += 1000 * scale;
        add_instance(scene, ball, away);
    }
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = cranny_gather_params_default();
    params.distances[0] = (float)(2 * scale);
    params.distances[1] = (float)(0.3 * scale);
    params.threads = threads;
    params.packet = packet;
    static vec3 positions[POINTS_MAX], normals[POINTS_MAX];
    static float back[POINTS_MAX];
    for (int i = 0; i < POINTS_MAX; i++) {
        const double x = -1.9 + 3.8 * fraction(i * 0.754877),
                     z = -1.9 + 3.8 * fraction(i * 0.56984);
        positions[i][0] = (float)(x * scale + shift);
        positions[i][1] = (float)shift;
        positions[i][2] = (float)(z * scale);
        memcpy(normals[i], up, sizeof up);
    }
    CHECK_OK(cranny_gather(tracer, POINTS_MAX, positions, normals, NULL, &params, out, back, &why),
             why);
    double backs = 0;
    for (int i = 0; i < POINTS_MAX; i++)
        if (hypot((double)positions[i][0] - shift - scale, (double)positions[i][2]) > 0.01 * scale)
            backs += (double)back[i];
    CHECK_MSG(backs == 0, "back faces where there are none: scale %g mirrored %d shared %d", scale,
              mirrored, shared);
    finish(&tracer, &scene);
}

static double mean_difference(float a[POINTS_MAX][2], float b[POINTS_MAX][2])
{
    double sum = 0;
    for (int i = 0; i < POINTS_MAX; i++)
        sum += fabs((double)a[i][0] - (double)b[i][0]) + fabs((double)a[i][1] - (double)b[i][1]);
    return sum / POINTS_MAX / 2;
}

static void test_invariance(void)
{
    static float base[POINTS_MAX][2], other[POINTS_MAX][2];
    const enum cranny_packet packet = cranny_gather_params_default().packet;
    room_values(1, 0, false, false, 1, packet, base);
    const int threads[] = {1, 2, 7};
    for (int i = 0; i < 3; i++) {
        room_values(1, 0, false, false, threads[i], packet, other);
        CHECK(memcmp(base, other, sizeof base) == 0);
    }
    room_values(1000, 0, false, false, 2, packet, other);
    CHECK_NEAR(mean_difference(base, other), 0, 1e-4);
    room_values(1, 1e4, false, false, 2, packet, other);
    CHECK_NEAR(mean_difference(base, other), 0, 1e-3);
    room_values(1, 0, true, false, 2, packet, other);
    CHECK_NEAR(mean_difference(base, other), 0, 1e-4);
    room_values(1, 0, false, true, 2, packet, other);
    CHECK_NEAR(mean_difference(base, other), 0, 1e-4);
    room_values(1, 0, true, true, 2, packet, other);
    CHECK_NEAR(mean_difference(base, other), 0, 1e-4);
    room_values(1, 0, false, false, 2, CRANNY_PACKET_1, other);
    CHECK_NEAR(mean_difference(base, other), 0, 1e-4);
}

static void test_alpha_and_sides(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    struct cranny_material material = cranny_material_default();
    material.alpha_mode = CRANNY_ALPHA_BLEND;
    material.opacity = 0.3f;
    uint32_t blend;
    CHECK_OK(cranny_scene_add_material(scene, &material, &blend, &why), why);
    add_disc(scene, 1.5f, 2, blend);
    struct cranny_tracer *tracer = new_tracer(scene);
    const struct cranny_gather_params params = hard(4096);
    float back;
    double mean = 0;
    for (uint32_t i = 0; i < 16; i++) { /* other seeds: other dice */
        struct cranny_gather_params p = params;
        p.seed = i;
        mean += at(tracer, (vec3){0, 0, 0}, up, &p, &back) / 16;
    }
    CHECK_NEAR(mean, 1 - 0.3 * 0.36, 0.003);
    /* The fan winds so that it is seen from above or below; one of both is its back. */
    const double below = at(tracer, (vec3){0, 0, 0}, up, &params, &back);
    float above_back;
    at(tracer, (vec3){0, 4, 0}, (vec3){0, -1, 0}, &params, &above_back);
    CHECK(below > 0.8 && (back > 0.05f) != (above_back > 0.05f));
    finish(&tracer, &scene);
    scene = new_scene();
    material = cranny_material_default();
    material.double_sided = true;
    CHECK_OK(cranny_scene_add_material(scene, &material, &blend, &why), why);
    add_disc(scene, 1.5f, 2, blend);
    tracer = new_tracer(scene);
    at(tracer, (vec3){0, 0, 0}, up, &params, &back);
    at(tracer, (vec3){0, 4, 0}, (vec3){0, -1, 0}, &params, &above_back);
    CHECK(back == 0 && above_back == 0);
    finish(&tracer, &scene);
}

static void test_planes(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    add_quad(scene, (double[3]){-1, 0, -1}, (double[3]){0, 0, 2}, (double[3]){2, 0, 0}, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(1000);
    CHECK_NEAR(at(tracer, (vec3){0.1f, 0, 0.2f}, up, &params, NULL), 1, 0);
    cranny_tracer_destroy(&tracer);
    struct cranny_tracer_params with_ground = cranny_tracer_params_default();
    with_ground.ground = true;
    CHECK_OK(cranny_tracer_create(scene, &with_ground, &tracer, &why), why);
    float back;
    CHECK_NEAR(at(tracer, (vec3){0.1f, 0, 0.2f}, up, &params, &back), 1, 0);
    CHECK_NEAR(at(tracer, (vec3){5, 2, 0}, (vec3){1, 0, 0}, &params, &back), 0.5, 0.005);
    CHECK(back == 0);
    CHECK_NEAR(at(tracer, (vec3){5, 2, 0}, (vec3){0, -1, 0}, &params, &back), 0, 0);
    cranny_tracer_destroy(&tracer);
    /* A ground above a face hides it: else its back would be seen from above. */
    add_quad(scene, (double[3]){-9, 1, -9}, (double[3]){18, 0, 0}, (double[3]){0, 0, 18}, 0);
    with_ground.ground_height = 2;
    CHECK_OK(cranny_tracer_create(scene, &with_ground, &tracer, &why), why);
    CHECK_NEAR(at(tracer, (vec3){0, 3, 0}, (vec3){0, -1, 0}, &params, &back), 0, 0);
    CHECK(back == 0);
    cranny_tracer_destroy(&tracer);
    tracer = new_tracer(scene);
    at(tracer, (vec3){0, 3, 0}, (vec3){0, -1, 0}, &params, &back);
    CHECK(back > 0.5f);
    finish(&tracer, &scene);
    scene = new_scene();
    add_quad(scene, (double[3]){-1, 0, -1}, (double[3]){0, 0, 2}, (double[3]){2, 0, 0}, 0);
    tracer = new_tracer(scene);
    /* Rays of a shading normal that leans over its face are kept above the face. */
    float visibility[1][2];
    CHECK_OK(cranny_gather(tracer, 1, (const vec3[1]){{0, 0, 0}}, (const vec3[1]){{0.8f, 0.6f, 0}},
                           (const vec3[1]){{0, 1, 0}}, &params, visibility, NULL, &why),
             why);
    CHECK_NEAR(visibility[0][0], 1, 0);
    finish(&tracer, &scene);
}

/* Grouping of points does not matter, and the adaptive first rays are a fair sample. */
static void test_plan(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    add_disc(scene, 1.5f, 2, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(70); /* not a multiple of any width */
    for (int packet = 0; packet < 3; packet++) {
        params.packet = (enum cranny_packet)packet;
        struct gather_plan *plan;
        CHECK_OK(gather_plan_create(&params, false, &plan, &why), why);
        struct gather_point points[32];
        struct gather_result all[32], one;
        for (uint32_t i = 0; i < 32; i++)
            points[i] = (struct gather_point){.position = {0.2f * (float)i, 0, 0},
                                              .normal = {0, 1, 0},
                                              .face_normal = {0, 1, 0},
                                              .id = i};
        gather_points(tracer, plan, points, 32, all);
        for (int i = 31; i >= 0; i--) {
            gather_points(tracer, plan, &points[i], 1, &one);
            CHECK(memcmp(&one, &all[i], sizeof one) == 0);
            CHECK_INT(one.rays, 70);
        }
        gather_plan_destroy(&plan);
        CHECK(plan == NULL);
        gather_plan_destroy(&plan);
    }
    for (int rays = 1; rays <= 300; rays = rays * 3 / 2 + 1) {
        params.rays = rays;
        struct gather_plan *plan;
        CHECK_OK(gather_plan_create(&params, true, &plan, &why), why);
        struct gather_point far = {
            .position = {500, 0, 0}, .normal = {0, -1, 0}, .face_normal = {0, -1, 0}};
        struct gather_point under = {.normal = {0, 1, 0}, .face_normal = {0, 1, 0}};
        struct gather_result result;
        gather_points(tracer, plan, &far, 1, &result);
        CHECK(result.rays == (uint32_t)(rays >= 8 ? rays / 4 : rays) && result.visibility[0] == 1);
        gather_points(tracer, plan, &under, 1, &result);
        CHECK(rays < 16 || result.rays == (uint32_t)rays);
        gather_plan_destroy(&plan);
    }
    finish(&tracer, &scene);
}

/* Rays that end at the kernel's length, which are traced where nobody asks for back faces, see the
 * same. */
static void test_reach(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    add_instance(scene, box_mesh(scene, (vec3){-2, 0, -2}, (vec3){2, 3, 2}, true), identity);
    add_instance(scene, sphere_mesh(scene, (double[3]){1, 0.5, 0}, 0.5, 32), identity);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = cranny_gather_params_default();
    params.distances[0] = 0.7f;
    params.distances[1] = 1.1f;
    static vec3 positions[POINTS_MAX], normals[POINTS_MAX];
    static float full[POINTS_MAX][2], back[POINTS_MAX], brief[POINTS_MAX][2];
    for (int i = 0; i < POINTS_MAX; i++) {
        positions[i][0] = (float)(-1.9 + 3.8 * fraction(i * 0.754877));
        positions[i][2] = (float)(-1.9 + 3.8 * fraction(i * 0.56984));
        memcpy(normals[i], up, sizeof up);
    }
    for (int k = 0; k < 3; k++)
        for (int packet = 0; packet < 3; packet++) {
            params.kernel = (enum cranny_kernel)k;
            params.packet = (enum cranny_packet)packet;
            CHECK_OK(cranny_gather(tracer, POINTS_MAX, positions, normals, NULL, &params, full,
                                   back, &why),
                     why);
            CHECK_OK(cranny_gather(tracer, POINTS_MAX, positions, normals, NULL, &params, brief,
                                   NULL, &why),
                     why);
            CHECK(memcmp(full, brief, sizeof full) == 0);
        }
    finish(&tracer, &scene);
}

static bool stop(void *user, const char *stage, double done, double total)
{
    ++*(int *)user;
    return done <= 0 && total > 0 && strcmp(stage, "trace") == 0;
}

static void test_refusals(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    struct cranny_tracer *tracer = new_tracer(scene);
    vec3 position = {0, 0, 0}, normal = {0, 1, 0};
    float visibility[1][2] = {{7, 7}};
    struct cranny_gather_params bad[6];
    for (int i = 0; i < 6; i++)
        bad[i] = cranny_gather_params_default();
    bad[0].rays = 0;
    bad[1].rays = 65537;
    bad[2].distances[1] = 0;
    bad[3].distances[0] = NAN;
    bad[4].sampler = (enum cranny_sampler)9;
    bad[5].threads = -1;
    for (int i = 0; i < 6; i++)
        CHECK_INT(
            cranny_gather(tracer, 1, &position, &normal, NULL, &bad[i], visibility, NULL, &why),
            CRANNY_USAGE);
    position[1] = NAN;
    CHECK_INT(cranny_gather(tracer, 1, &position, &normal, NULL, NULL, visibility, NULL, &why),
              CRANNY_USAGE);
    CHECK_NEAR(visibility[0][0], 7, 0);
    position[1] = 0;
    CHECK_OK(cranny_gather(tracer, 0, NULL, NULL, NULL, NULL, NULL, NULL, &why), why);
    CHECK_NEAR(at(tracer, position, normal, NULL, NULL), 1, 0);
    int calls = 0;
    const struct cranny_hooks hooks = {.user = &calls, .progress = stop};
    struct cranny_gather_params params = cranny_gather_params_default();
    params.hooks = &hooks;
    CHECK_INT(cranny_gather(tracer, 1, &position, &normal, NULL, &params, visibility, NULL, &why),
              CRANNY_CANCELLED);
    CHECK(calls == 2);
    finish(&tracer, &scene);
}

int main(void)
{
    test_wall();
    test_disc();
    test_sphere_on_plane();
    test_box();
    test_no_leaks();
    test_samplers();
    test_offset();
    test_invariance();
    test_alpha_and_sides();
    test_planes();
    test_plan();
    test_reach();
    test_refusals();
    return check_end("gather");
}
