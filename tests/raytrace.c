/* The ray-traced truth against closed forms, its stated error against its real one, and its
 * invariances. */
#include "frame_scenes.h"

#include <cranny/cranny.h>

static struct cranny_raytrace_params rays_of(int rays, enum cranny_kernel kernel, float radius)
{
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    params.rays = rays;
    params.kernel = kernel;
    params.radius_world = radius;
    return params;
}

static struct cranny_raytrace_report trace(const struct cranny_frame *frame,
                                           const struct cranny_raytrace_params *params,
                                           float *visibility, float *error)
{
    struct cranny_error why;
    struct cranny_raytrace_report report = {0};
    CHECK_OK(cranny_frame_raytrace(frame, params, visibility, 0, error, &report, &why), why);
    return report;
}

/* Nothing above it: exactly 1, whatever the tilt, with every kernel, and where there is sky. */
static void test_open(void)
{
    struct stage stage = {.scene = new_scene()};
    add_quad(stage.scene, (double[3]){-40, 3, -30}, (double[3]){60, 7, -10},
             (double[3]){20, -11, -50}, 0);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look((double[3]){3, 60, 5}, (double[3]){3, 0, -60}, 0.7f);
    struct cranny_frame_params size = frame_size(40, 30);
    static float visibility[40 * 30], error[40 * 30];
    for (int k = 0; k < 3; k++) {
        size.samples = 1 << k;
        struct cranny_frame *frame = draw(&stage, &size);
        const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
        const struct cranny_raytrace_params params = rays_of(64, (enum cranny_kernel)k, 50);
        const struct cranny_raytrace_report report = trace(frame, &params, visibility, error);
        uint64_t surfaces = 0;
        for (int i = 0; i < 40 * 30 * size.samples; i++)
            surfaces += isfinite(g.depth[i]) != 0;
        CHECK_MSG(surfaces > 100 && surfaces < (uint64_t)(40 * 30 * size.samples), "%llu",
                  (unsigned long long)surfaces);
        for (int i = 0; i < 40 * 30; i++)
            CHECK_MSG(visibility[i] == 1 && error[i] == 0, "%d: %.9g, error %g", i,
                      (double)visibility[i], (double)error[i]);
        CHECK_INT(report.rays, surfaces * 64 / (uint64_t)size.samples);
        CHECK_INT(report.rays_per_pixel, 64);
        CHECK_NEAR(report.standard_error_max, 0, 0);
        cranny_frame_destroy(&frame);
    }
    leave(&stage);
}

/* At distance a from an infinite wall, a ray meets it at a / x, x the part of its direction towards
 * the wall. Cosine-distributed rays lie evenly on the unit disc: density (2/π) √(1 − x²). */
static double by_the_wall(enum cranny_kernel kernel, double ratio)
{
    enum { STEPS = 200000 };
    const double pi = acos(-1);
    if (kernel == CRANNY_KERNEL_HARD)
        return ratio >= 1 ? 1 : 1 - (acos(ratio) - ratio * sqrt(1 - ratio * ratio)) / pi;
    double occluded = 0;
    for (int i = 0; i < STEPS; i++) {
        const double x = (i + 0.5) / STEPS, d = ratio / x;
        const double rho = kernel == CRANNY_KERNEL_LINEAR ? fmin(d, 1) : 1 - exp2(-d);
        occluded += (1 - rho) * 2 / pi * sqrt(1 - x * x) / STEPS;
    }
    return 1 - occluded;
}

static void test_wall(void)
{
    enum { COLUMNS = 16 };
    struct stage stage = {.scene = new_scene()};
    add_quad(stage.scene, (double[3]){-3000, 0, 3000}, (double[3]){6000, 0, 0},
             (double[3]){0, 0, -6000}, 0);
    add_quad(stage.scene, (double[3]){0, 0, -3000}, (double[3]){0, 6000, 0},
             (double[3]){0, 0, 6000}, 0);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look_down(-1, 4, 0.3, 1);
    const struct cranny_frame_params size = frame_size(COLUMNS, COLUMNS);
    struct cranny_frame *frame = draw(&stage, &size);
    static float visibility[COLUMNS * COLUMNS];
    for (int k = 0; k < 3; k++) {
        const struct cranny_raytrace_params params = rays_of(4096, (enum cranny_kernel)k, 1.25f);
        trace(frame, &params, visibility, NULL);
        for (int column = 0; column < COLUMNS; column++) {
            const double distance = 2 - 2 * (column + 0.5) / COLUMNS;
            const double expected = by_the_wall((enum cranny_kernel)k, distance / 1.25);
            double mean = 0;
            for (int row = 0; row < COLUMNS; row++) {
                const double value = (double)visibility[row * COLUMNS + column];
                CHECK_NEAR(value, expected, 0.004);
                mean += value / COLUMNS;
            }
            CHECK_NEAR(mean, expected, 0.0008);
        }
    }
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* On the floor of a closed box of half widths 1 and 2, height 3, under its middle. */
static double in_the_box(double radius)
{
    enum { GRID = 1000 };
    double sum = 0;
    for (int i = 0; i < GRID; i++)
        for (int j = 0; j < GRID; j++) {
            const double area = (i + 0.5) / GRID, phi = 2 * acos(-1) * (j + 0.5) / GRID;
            const double x = sqrt(area) * fabs(cos(phi)), z = sqrt(area) * fabs(sin(phi));
            const double d = fmin(fmin(1 / x, 2 / z), 3 / sqrt(1 - area));
            sum += fmin(d / radius, 1);
        }
    return sum / GRID / GRID;
}

static void test_box(void)
{
    struct stage stage = {.scene = new_scene()};
    add_instance(stage.scene,
                 box_mesh(stage.scene, (float[3]){-1, 0, -2}, (float[3]){1, 3, 2}, true), identity);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look_down(0, 2, 0, 0.01f);
    const struct cranny_frame_params size = frame_size(3, 3);
    struct cranny_frame *frame = draw(&stage, &size);
    float visibility[9];
    struct cranny_raytrace_params params = rays_of(4096, CRANNY_KERNEL_HARD, 100);
    trace(frame, &params, visibility, NULL);
    for (int i = 0; i < 9; i++)
        CHECK_NEAR(visibility[i], 0, 0);
    params = rays_of(4096, CRANNY_KERNEL_LINEAR, 1.8f);
    trace(frame, &params, visibility, NULL);
    CHECK_NEAR(visibility[4], in_the_box(1.8), 0.002);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

enum { WIDTH = 48, HEIGHT = 32, PIXELS = WIDTH * HEIGHT };

static double rms(const float *a, const float *b)
{
    double sum = 0;
    for (int i = 0; i < PIXELS; i++) {
        const double d = (double)a[i] - (b ? (double)b[i] : 0);
        sum += d * d;
    }
    return sqrt(sum / PIXELS);
}

/* What is said of the error is true within a factor of 2, as a whole and where it is largest. */
static void check_honest(const struct cranny_frame *frame, const float *truth, int rays, int passes)
{
    static float visibility[PIXELS], error[PIXELS];
    const struct cranny_raytrace_params params = rays_of(rays, CRANNY_KERNEL_LINEAR, 1);
    const struct cranny_raytrace_report report = trace(frame, &params, visibility, error);
    double mean = 0, largest = 0;
    for (int i = 0; i < PIXELS; i++) {
        mean += (double)error[i] / PIXELS;
        largest = fmax(largest, (double)error[i]);
    }
    CHECK_INT(report.passes, passes);
    CHECK_INT(report.rays_per_pixel, rays);
    CHECK_NEAR(report.standard_error_mean, mean, 1e-6);
    CHECK_NEAR(report.standard_error_max, largest, 1e-6);
    const double real = rms(visibility, truth), stated = rms(error, NULL);
    CHECK_MSG(stated > real / 2 && stated < real * 2, "%d rays: error %g, stated %g", rays, real,
              stated);
    CHECK_MSG(real < 0.15 / pow(rays, 0.6), "%d rays: error %g", rays, real);
}

static void test_errors(void)
{
    struct stage stage = room();
    struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    static float truth[PIXELS], visibility[PIXELS], error[PIXELS];
    struct cranny_raytrace_params params = rays_of(8192, CRANNY_KERNEL_LINEAR, 1);
    params.seed = 5;
    trace(frame, &params, truth, NULL);
    check_honest(frame, truth, 16, 4);
    check_honest(frame, truth, 64, 8);
    check_honest(frame, truth, 70, 7);
    check_honest(frame, truth, 67, 8); /* passes of unequal length */
    check_honest(frame, truth, 256, 8);
    /* As many passes as the target takes. */
    params = rays_of(1024, CRANNY_KERNEL_LINEAR, 1);
    params.error_target = 0.004f;
    struct cranny_raytrace_report report = trace(frame, &params, visibility, error);
    CHECK_MSG(report.passes >= 2 && report.passes < 8, "%d passes", report.passes);
    CHECK_MSG(report.standard_error_mean < 0.004, "%g", report.standard_error_mean);
    CHECK_INT(report.rays_per_pixel, report.passes * 128);
    CHECK_INT(report.rays, (uint64_t)report.rays_per_pixel * PIXELS);
    const double real = rms(visibility, truth), stated = rms(error, NULL);
    CHECK_MSG(stated > real / 2 && stated < real * 2, "error %g, stated %g", real, stated);
    params.error_target = 1e-9f;
    CHECK_INT(trace(frame, &params, visibility, NULL).passes, 8);
    /* One pass says nothing of its error. */
    params = rays_of(3, CRANNY_KERNEL_LINEAR, 1);
    report = trace(frame, &params, visibility, error);
    CHECK_INT(report.passes, 1);
    CHECK_NEAR(report.standard_error_max, 0, 0);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* Several samples a pixel: their mean, near that of a larger picture's pixels. */
static void test_samples(void)
{
    struct stage stage = room();
    struct cranny_frame_params size = frame_size(WIDTH, HEIGHT),
                               fine = frame_size(4 * WIDTH, 4 * HEIGHT);
    size.samples = 8;
    struct cranny_frame *frame = draw(&stage, &size), *large = draw(&stage, &fine);
    static float visibility[PIXELS], detail[16 * PIXELS], mean[PIXELS];
    struct cranny_raytrace_params params = rays_of(1024, CRANNY_KERNEL_LINEAR, 1);
    const struct cranny_raytrace_report report = trace(frame, &params, visibility, NULL);
    CHECK_INT(report.rays_per_pixel, 1024);
    params.rays = 64;
    trace(large, &params, detail, NULL);
    for (int i = 0; i < 16 * PIXELS; i++)
        mean[i / 4 % WIDTH + i / (16 * WIDTH) * WIDTH] += detail[i] / 16;
    CHECK_MSG(rms(visibility, mean) < 0.006, "%g apart", rms(visibility, mean));
    cranny_frame_destroy(&large);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* The same bits for every number of threads, guard band and stride; others for another seed. */
static void test_invariance(void)
{
    struct cranny_error why;
    struct stage stage = room();
    struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    static float base[PIXELS], error[PIXELS], other[2 * PIXELS], others[2 * PIXELS];
    struct cranny_raytrace_params params = rays_of(48, CRANNY_KERNEL_EXPONENTIAL, 1);
    struct cranny_frame *frame = draw(&stage, &size);
    params.threads = 1;
    trace(frame, &params, base, error);
    for (int threads = 2; threads <= 7; threads += 5) {
        params.threads = threads;
        trace(frame, &params, other, others);
        CHECK(memcmp(base, other, sizeof base) == 0 && memcmp(error, others, sizeof error) == 0);
    }
    CHECK_OK(
        cranny_frame_raytrace(frame, &params, other, 2 * WIDTH * sizeof(float), others, NULL, &why),
        why);
    for (int row = 0; row < HEIGHT; row++) {
        CHECK(memcmp(base + row * WIDTH, other + 2 * row * WIDTH, WIDTH * sizeof(float)) == 0);
        CHECK(memcmp(error + row * WIDTH, others + 2 * row * WIDTH, WIDTH * sizeof(float)) == 0);
    }
    params.seed = 9;
    trace(frame, &params, other, NULL);
    CHECK(memcmp(base, other, sizeof base) != 0);
    CHECK_MSG(rms(base, other) < 0.05, "another seed, another picture: %g", rms(base, other));
    params.seed = 0;
    cranny_frame_destroy(&frame);
    size.guard_band = 7;
    frame = draw(&stage, &size);
    trace(frame, &params, other, NULL);
    CHECK(memcmp(base, other, sizeof base) == 0);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* A floor around `at` does not shade itself, however far the viewer. */
static void check_floor(const double at[3])
{
    struct stage stage = {.scene = new_scene()};
    const double place[12] = {0.8, 0.6, 0, at[0], -0.6, 0.8, 0, at[1], 0, 0, 1, at[2]};
    const uint32_t floor = quad_mesh(stage.scene, (double[3]){-1, 0, 1}, (double[3]){2, 0, 0},
                                     (double[3]){0, 0, -2}, 0, 1);
    add_instance(stage.scene, floor, place);
    stage.tracer = new_tracer(stage.scene);
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    static float visibility[PIXELS];
    for (double away = 1; away < 1e5; away *= 100) {
        const double eye[3] = {at[0] + 3 * away, at[1] + 2 * away, at[2] + away};
        stage.camera = look(eye, at, (float)(0.2 / away));
        struct cranny_frame *frame = draw(&stage, &size);
        const struct cranny_raytrace_params params = rays_of(64, CRANNY_KERNEL_LINEAR, 1);
        const struct cranny_raytrace_report report = trace(frame, &params, visibility, NULL);
        CHECK_MSG(report.rays >= 64 * PIXELS / 2, "%g m away: the floor is not seen", away);
        for (int i = 0; i < PIXELS; i++)
            CHECK_MSG(visibility[i] == 1, "%g m away: %g", away, (double)visibility[i]);
        cranny_frame_destroy(&frame);
    }
    leave(&stage);
}

static void test_far(void)
{
    check_floor((double[3]){1e4, -2e3, 5e3});
    check_floor((double[3]){0.3, -0.2, 0.1});
}

/* Nor does a tilted one of kilometres, whose corners' roundings lift it above its points. */
static void test_large(void)
{
    struct stage stage = {.scene = new_scene()};
    add_quad(stage.scene, (double[3]){-3e4, -12054, 4e4}, (double[3]){6.1e4, 2.3e4, 0},
             (double[3]){0, 1.3e3, -7e4}, 0);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look((double[3]){1, 20, 5}, (double[3]){0, 0, 0}, 1.2f);
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    static float visibility[PIXELS];
    const struct cranny_raytrace_params params = rays_of(256, CRANNY_KERNEL_LINEAR, 1);
    CHECK_INT(trace(frame, &params, visibility, NULL).rays, 256 * PIXELS);
    for (int i = 0; i < PIXELS; i++)
        CHECK_MSG(visibility[i] == 1, "%d: %g", i, (double)visibility[i]);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

static void test_refusals(void)
{
    struct cranny_error why;
    struct stage stage = room();
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    static float visibility[PIXELS];
    const struct cranny_hooks hooks = {.user = "trace", .progress = stop_at_once};
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    params.hooks = &hooks;
    CHECK_INT(cranny_frame_raytrace(frame, &params, visibility, 0, NULL, NULL, &why),
              CRANNY_CANCELLED);
    const struct cranny_raytrace_params wrong[] = {
        {.radius_world = 0, .rays = 1},
        {.radius_world = INFINITY, .rays = 1},
        {.radius_world = 1, .rays = 0},
        {.radius_world = 1, .rays = 65537},
        {.radius_world = 1, .rays = 1, .error_target = NAN},
        {.radius_world = 1, .rays = 1, .threads = -1},
        {.radius_world = 1, .rays = 1, .kernel = (enum cranny_kernel)3},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        CHECK_INT(cranny_frame_raytrace(frame, &wrong[i], visibility, 0, NULL, NULL, &why),
                  CRANNY_USAGE);
    CHECK_INT(cranny_frame_raytrace(frame, NULL, visibility, 4 * WIDTH - 4, NULL, NULL, &why),
              CRANNY_USAGE);
    CHECK_INT(cranny_frame_raytrace(frame, NULL, NULL, 0, NULL, NULL, &why), CRANNY_USAGE);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

/* A real scene, with masked leaves and instances of nothing: what comes out is plausible. */
static void test_sponza(const char *folder)
{
    struct cranny_error why;
    struct stage stage;
    char path[4096];
    snprintf(path, sizeof path, "%s/crytek_sponza/crytek_sponza.glb", folder);
    CHECK_OK(cranny_scene_load(path, NULL, &stage.scene, &why), why);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look((double[3]){10, 2, 0}, (double[3]){0, 3, 0}, 1.0f);
    const struct cranny_frame_params size = frame_size(WIDTH, HEIGHT);
    struct cranny_frame *frame = draw(&stage, &size);
    static float visibility[PIXELS];
    static uint8_t rgb[PIXELS * 3];
    const struct cranny_raytrace_params params = rays_of(64, CRANNY_KERNEL_LINEAR, 1);
    const struct cranny_raytrace_report report = trace(frame, &params, visibility, NULL);
    double mean = 0;
    for (int i = 0; i < PIXELS; i++) {
        CHECK(visibility[i] >= 0 && visibility[i] <= 1);
        mean += (double)visibility[i] / PIXELS;
    }
    CHECK_MSG(mean > 0.7 && mean < 0.98, "mean visibility %g", mean);
    CHECK_MSG(report.rays > 64 * PIXELS * 9 / 10, "%llu rays", (unsigned long long)report.rays);
    CHECK_OK(cranny_frame_shade(frame, visibility, 0, NULL, 0, rgb, &why), why);
    double level = 0;
    for (int i = 0; i < 3 * PIXELS; i++)
        level += rgb[i] / (255.0 * 3 * PIXELS);
    CHECK_MSG(level > 0.3 && level < 0.9, "mean level %g", level);
    cranny_frame_destroy(&frame);
    leave(&stage);
}

int main(void)
{
    test_open();
    test_wall();
    test_box();
    test_errors();
    test_samples();
    test_invariance();
    test_far();
    test_large();
    test_refusals();
    if (check_scenes())
        test_sponza(check_scenes());
    else
        check_skip("sponza", "CRANNY_SCENES is not set");
    return check_end("raytrace");
}
