/* Spherical obscurance, and what cranny/runtime.h makes of it. */
#include "trace_scenes.h"

#include "base/sequence.h"
#include "trace/tracer.h"

#include <cranny/runtime.h>

#define PI 3.14159265358979323846
typedef float vec3[3];

/* Mean of f over the sphere times 4π, on a grid of equal areas. */
typedef double sphere_fn(const float direction[3], const void *user);

static double over_sphere(sphere_fn *f, const void *user)
{
    enum { ROWS = 400, COLUMNS = 800 };
    double sum = 0;
    for (int i = 0; i < ROWS; i++)
        for (int j = 0; j < COLUMNS; j++) {
            const double z = 2 * (i + 0.5) / ROWS - 1, a = 2 * PI * (j + 0.5) / COLUMNS;
            const double r = sqrt(1 - z * z);
            sum += f((vec3){(float)(r * cos(a)), (float)(r * sin(a)), (float)z}, user);
        }
    return sum * 4 * PI / ROWS / COLUMNS;
}

static double product(const float d[3], const void *user)
{
    const int *pair = user;
    float basis[9];
    cranny_sh_basis(d, basis);
    return (double)basis[pair[0]] * (double)basis[pair[1]];
}

static void test_orthonormal(void)
{
    for (int a = 0; a < 9; a++)
        for (int b = a; b < 9; b++)
            CHECK_NEAR(over_sphere(product, (int[2]){a, b}), a == b, 5e-5);
    float basis[9];
    cranny_sh_basis((vec3){1, 0, 0}, basis);
    CHECK(basis[3] > 0 && basis[1] == 0 && basis[2] == 0); /* y, z, x */
    cranny_sh_basis((vec3){0, 1, 0}, basis);
    CHECK(basis[1] > 0 && basis[8] < 0);
}

/* Nine numbers as a function of directions, seen from a turned frame. */
struct turned {
    double rotation[3][3];
    float harmonics[9];
    int index; /* of the harmonic to project on */
};

static double evaluate(const float harmonics[9], const float d[3])
{
    float basis[9];
    double sum = 0;
    cranny_sh_basis(d, basis);
    for (int i = 0; i < 9; i++)
        sum += (double)harmonics[i] * (double)basis[i];
    return sum;
}

static void turn(const double m[3][3], const float d[3], float out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = (float)(m[i][0] * d[0] + m[i][1] * d[1] + m[i][2] * d[2]);
}

static double turned_product(const float d[3], const void *user)
{
    const struct turned *t = user;
    vec3 other;
    float basis[9];
    turn(t->rotation, d, other);
    cranny_sh_basis(d, basis);
    return evaluate(t->harmonics, other) * (double)basis[t->index];
}

static void make_rotation(double angle, double m[3][3])
{
    const double c = cos(angle), s = sin(angle), c2 = cos(1.3 * angle), s2 = sin(1.3 * angle);
    const double a[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
    const double b[3][3] = {{1, 0, 0}, {0, c2, -s2}, {0, s2, c2}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
}

/* A turned function projects to harmonics that give it back: nothing leaves a band. */
static void test_rotation(void)
{
    struct turned t;
    make_rotation(0.8, t.rotation);
    for (uint32_t i = 0; i < 9; i++)
        t.harmonics[i] = 2 * unit_from_u32(hash_u32(i)) - 1;
    float projected[9];
    for (t.index = 0; t.index < 9; t.index++)
        projected[t.index] = (float)over_sphere(turned_product, &t);
    double energy[2][3] = {{0}};
    for (int i = 0; i < 9; i++) {
        const int band = i == 0 ? 0 : i < 4 ? 1 : 2;
        energy[0][band] += pow((double)t.harmonics[i], 2);
        energy[1][band] += pow((double)projected[i], 2);
    }
    for (int band = 0; band < 3; band++)
        CHECK_NEAR(energy[1][band], energy[0][band], 1e-4);
    for (uint32_t i = 0; i < 50; i++) {
        const double z = 2 * (double)unit_from_u32(hash_u32(2 * i)) - 1, a = i;
        const vec3 d = {(float)(sqrt(1 - z * z) * cos(a)), (float)(sqrt(1 - z * z) * sin(a)),
                        (float)z};
        vec3 other;
        turn(t.rotation, d, other);
        CHECK_NEAR(evaluate(projected, d), evaluate(t.harmonics, other), 1e-4);
    }
}

struct lit {
    float harmonics[9], normal[3];
};

static double lit_cosine(const float d[3], const void *user)
{
    const struct lit *l = user;
    const double cosine = (double)(d[0] * l->normal[0] + d[1] * l->normal[1] + d[2] * l->normal[2]);
    return cosine > 0 ? evaluate(l->harmonics, d) * cosine / PI : 0;
}

/* The convolution's factors against the integral that they stand for. */
static void test_convolution(void)
{
    struct lit l;
    for (uint32_t i = 0; i < 9; i++)
        l.harmonics[i] = i == 0 ? 1.8f : 0.4f * unit_from_u32(hash_u32(50 + i)) - 0.2f;
    float convolved[9];
    cranny_sh_convolve(l.harmonics, convolved);
    for (uint32_t i = 0; i < 20; i++) {
        const double z = 2 * (double)unit_from_u32(hash_u32(i)) - 1, a = 2.0 * i;
        l.normal[0] = (float)(sqrt(1 - z * z) * cos(a));
        l.normal[1] = (float)(sqrt(1 - z * z) * sin(a));
        l.normal[2] = (float)z;
        const double want = over_sphere(lit_cosine, &l);
        CHECK(want > 0.1 && want < 1); /* else the clamp would hide an error */
        CHECK_NEAR(cranny_sh9_visibility(convolved, l.normal), want, 1e-4);
        double four = 0;
        for (int k = 4; k < 9; k++) {
            float basis[9];
            cranny_sh_basis(l.normal, basis);
            four += (double)convolved[k] * (double)basis[k];
        }
        CHECK_NEAR(cranny_sh4_visibility(convolved, l.normal), want - four, 1e-4);
    }
}

static struct cranny_gather_params hard(int rays)
{
    struct cranny_gather_params params = cranny_gather_params_default();
    params.rays = rays;
    params.kernel = CRANNY_KERNEL_HARD;
    params.distances[0] = 1e9f;
    params.distances[1] = 1;
    return params;
}

static void gather_at(const struct cranny_tracer *tracer, const vec3 position,
                      const struct cranny_gather_params *params, float harmonics[2][9], float *back)
{
    struct cranny_error why;
    CHECK_OK(cranny_gather_sphere(tracer, 1, (const vec3 *)position, params,
                                  (float(*)[2][9])harmonics, back, &why),
             why);
}

/* One plane: linear in the normal, exactly; with all samplers. Out of reach, and in the open: 1. */
static void test_plane(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    struct cranny_tracer_params with = cranny_tracer_params_default();
    with.ground = true;
    with.ground_height = -2;
    struct cranny_tracer *tracer;
    CHECK_OK(cranny_tracer_create(scene, &with, &tracer, &why), why);
    for (int sampler = 0; sampler < 3; sampler++) {
        struct cranny_gather_params params = hard(65536);
        params.sampler = (enum cranny_sampler)sampler;
        const double tolerance = sampler == CRANNY_SAMPLER_RANDOM ? 0.02 : 2e-3;
        float harmonics[2][9], convolved[9];
        gather_at(tracer, (vec3){0, 0, 0}, &params, harmonics, NULL);
        const double linear[4] = {sqrt(PI), sqrt(3 * PI) / 2, 0, 0};
        for (int i = 0; i < 9; i++) {
            CHECK_NEAR(harmonics[0][i], i < 4 ? linear[i] : 0, 2 * tolerance);
            CHECK_NEAR(harmonics[1][i], i ? 0 : 2 * sqrt(PI), 1e-6);
        }
        cranny_sh_convolve(harmonics[0], convolved);
        for (int i = 0; i < 32; i++) {
            const double y = 2 * (i + 0.5) / 32 - 1, a = i;
            const vec3 n = {(float)(sqrt(1 - y * y) * cos(a)), (float)y,
                            (float)(sqrt(1 - y * y) * sin(a))};
            CHECK_NEAR(cranny_sh4_visibility(convolved, n), (1 + y) / 2, tolerance);
            CHECK_NEAR(cranny_sh9_visibility(convolved, n), (1 + y) / 2, tolerance);
        }
    }
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
}

/* Some walls about a point, turned by a rotation. */
static struct cranny_tracer *corner(struct cranny_scene **scene, const double m[3][3])
{
    *scene = new_scene();
    const uint32_t box = box_mesh(*scene, (vec3){1, -1, -3}, (vec3){2, 2, 4}, false);
    const uint32_t ball = sphere_mesh(*scene, (double[3]){-1, -2, 0.5}, 1.2, 32);
    double place[12] = {0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            place[4 * i + j] = m[i][j];
    add_instance(*scene, box, place);
    add_instance(*scene, ball, place);
    return new_tracer(*scene);
}

/* The sphere's harmonics, convolved, are near to what hemispheres gather; turning the scene turns
 * them. */
static void test_against_hemispheres(void)
{
    struct cranny_error why;
    const double none[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double rotation[3][3];
    make_rotation(0.8, rotation);
    struct cranny_scene *scenes[2];
    struct cranny_tracer *tracers[2] = {corner(&scenes[0], none), corner(&scenes[1], rotation)};
    struct cranny_gather_params params = cranny_gather_params_default();
    params.rays = 16384;
    params.distances[0] = 3;
    params.distances[1] = 1;
    float harmonics[2][2][9], convolved[2][9];
    for (int t = 0; t < 2; t++)
        gather_at(tracers[t], (vec3){0, 0, 0}, &params, harmonics[t], NULL);
    double worst = 0, worst_turned = 0;
    for (int k = 0; k < 2; k++) {
        cranny_sh_convolve(harmonics[0][k], convolved[0]);
        cranny_sh_convolve(harmonics[1][k], convolved[1]);
        for (uint32_t i = 0; i < 60; i++) {
            const double z = 2 * (double)unit_from_u32(hash_u32(i)) - 1, a = i;
            const vec3 n = {(float)(sqrt(1 - z * z) * cos(a)), (float)(sqrt(1 - z * z) * sin(a)),
                            (float)z};
            vec3 turned;
            turn(rotation, n, turned);
            float values[1][2];
            CHECK_OK(cranny_gather(tracers[0], 1, (const vec3[]){{0, 0, 0}}, (const vec3 *)n, NULL,
                                   &params, values, NULL, &why),
                     why);
            const double got = (double)cranny_sh9_visibility(convolved[0], n);
            worst = fmax(worst, fabs(got - (double)values[0][k]));
            worst_turned =
                fmax(worst_turned, fabs(got - (double)cranny_sh9_visibility(convolved[1], turned)));
        }
    }
    CHECK_MSG(worst < 0.02, "quadratic harmonics are off by %g", worst); /* what l > 2 would add */
    CHECK_MSG(worst_turned < 2e-3, "turning the scene changes %g", worst_turned);
    for (int t = 0; t < 2; t++) {
        cranny_tracer_destroy(&tracers[t]);
        cranny_scene_destroy(&scenes[t]);
    }
}

/* In a closed room nothing is open, out of one all is; few rays do for both. */
static void test_extremes(void)
{
    struct cranny_scene *scene = new_scene();
    add_instance(scene, box_mesh(scene, (vec3){-1, -1, -2}, (vec3){1, 3, 2}, false), identity);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(64);
    float harmonics[2][9], back;
    gather_at(tracer, (vec3){0, 0.5f, 0}, &params, harmonics, &back);
    CHECK_NEAR(back, 1, 0); /* seen from within */
    for (int i = 0; i < 9; i++)
        CHECK_NEAR(harmonics[0][i], 0, 0.12);
    gather_at(tracer, (vec3){50, 0.5f, 0}, &params, harmonics, &back);
    CHECK_NEAR(back, 0, 0);
    for (int i = 0; i < 9; i++)
        CHECK_NEAR(harmonics[0][i], i ? 0 : 2 * sqrt(PI), 0.02);
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
}

/* Directions all round: even in every cap, for all samplers. */
static double plane_rms(enum cranny_sampler sampler)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    const double slanted[12] = {0.6, -0.8, 0, 0, 0.8, 0.6, 0, 0, 0, 0, 1, 0};
    add_instance(scene,
                 quad_mesh(scene, (double[3]){-1e4, -0.5, -1e4}, (double[3]){0, 0, 2e4},
                           (double[3]){2e4, 0, 0}, 0, 1),
                 slanted);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_gather_params params = hard(64);
    params.sampler = sampler;
    enum { COUNT = 256 };
    static vec3 positions[COUNT];
    static float harmonics[COUNT][2][9];
    CHECK_OK(cranny_gather_sphere(tracer, COUNT, positions, &params, harmonics, NULL, &why), why);
    double sum = 0;
    for (int i = 0; i < COUNT; i++)
        sum += pow((double)harmonics[i][0][0] / (2 * sqrt(PI)) - 0.5, 2);
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
    return sqrt(sum / COUNT);
}

static void test_samplers(void)
{
    const double random = plane_rms(CRANNY_SAMPLER_RANDOM);
    const double spiral = plane_rms(CRANNY_SAMPLER_SPIRAL);
    const double sobol = plane_rms(CRANNY_SAMPLER_SOBOL);
    CHECK_NEAR(random, 0.5 / 8, 0.008); /* binomial */
    CHECK_MSG(spiral < random / 3, "spiral %g, random %g", spiral, random);
    CHECK_MSG(sobol < random / 2, "sobol %g, random %g", sobol, random);
}

/* Five bits: every level comes back; over a dither's pixels the mean is the value. */
static void test_bits(void)
{
    for (int bits = 0; bits < 32; bits++) {
        CHECK_INT(cranny_pack5(cranny_unpack5(bits), 0.5f), bits);
        for (int i = 0; i < 16; i++)
            CHECK_INT(cranny_pack5(cranny_unpack5(bits), cranny_dither(i % 4, i / 4)), bits);
    }
    unsigned ranks = 0;
    double worst = 0;
    for (int i = 0; i < 16; i++)
        ranks |= 1u << (int)(cranny_dither(i % 4, i / 4) * 16);
    CHECK_INT(ranks, 0xffff);
    CHECK(cranny_dither(5, 2) == cranny_dither(1, 6));
    for (int v = 0; v <= 1000; v++) {
        double sum = 0;
        for (int i = 0; i < 16; i++)
            sum +=
                (double)cranny_unpack5(cranny_pack5((float)v * 1e-3f, cranny_dither(i % 4, i / 4)));
        worst = fmax(worst, fabs(sum / 16 - v * 1e-3));
    }
    CHECK_MSG(worst < 0.51 / 16 / 31, "the dithered mean is off by %g", worst);
    const float hostile[] = {NAN, -1, 7, INFINITY, -INFINITY};
    const int wanted[] = {0, 0, 31, 31, 0};
    for (int i = 0; i < 5; i++) {
        CHECK_INT(cranny_pack5(hostile[i], 0.5f), wanted[i]);
        CHECK(cranny_pack5(0.5f, hostile[i]) >= 15 && cranny_pack5(0.5f, hostile[i]) <= 16);
    }
    CHECK_NEAR(
        cranny_linear_visibility((float[4]){0.5f, 0.1f, -0.2f, 0.3f}, (vec3){1, 2, 0.5f}, 0.8f),
        0.8 * (0.5 + 0.1 - 0.4 + 0.15), 1e-6);
    CHECK_NEAR(cranny_linear_visibility((float[4]){9, 0, 0, 0}, (vec3){0, 0, 0}, 1), 1, 0);
}

int main(void)
{
    test_orthonormal();
    test_rotation();
    test_convolution();
    test_plane();
    test_against_hemispheres();
    test_extremes();
    test_samplers();
    test_bits();
    return check_end("sphere");
}
