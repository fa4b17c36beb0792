/* The filters for buffers of one's own: constants, planes at any tilt, silhouettes, noise of known
 * spectrum, the same bits on every instruction set and thread count, small sizes, bad arguments. */
#include "analytic.h"

#include <cranny/filter.h>

enum { SIDE = 97, PIXELS = SIDE * SIDE, SKY_COLUMNS = 9 };

static float depth[PIXELS], normals[PIXELS][3], in[PIXELS], one[PIXELS], two[PIXELS];

typedef enum cranny_status filter_fn(const struct cranny_edges *,
                                     const struct cranny_filter_params *, const float *, size_t,
                                     float *, size_t, struct cranny_error *);

static const struct {
    const char *name;
    filter_fn *run;
} filters[] = {
    {"bilateral", cranny_filter_bilateral},
    {"box4", cranny_filter_box4},
    {"bloom", cranny_filter_bloom},
    {"upsample", cranny_filter_upsample},
};
enum { FILTERS = sizeof filters / sizeof *filters, SAME_SIZE = FILTERS - 1 };

static float noise(int i)
{
    uint32_t x = (uint32_t)i * 0x9e3779b9u + 77;
    x = (x ^ (x >> 16)) * 0x21f0aaadu;
    x = (x ^ (x >> 15)) * 0x735a2d97u;
    return (float)((x ^ (x >> 15)) >> 8) * 0x1p-24f;
}

static struct cranny_gbuffer plane_frame(int width, int height, double nx, double ny, double nz)
{
    struct analytic scene = {0};
    add_plane(&scene, 0, 0, -4, nx, ny, nz);
    return analytic_frame(&scene, width, height,
                          cranny_perspective(1, (float)width / (float)height), depth, normals);
}

/* A wall, and another one 2 m behind it right of column `edge`; sky at the far right. */
static struct cranny_gbuffer two_walls(int width, int height, int edge)
{
    struct cranny_gbuffer frame = plane_frame(width, height, 0, 0, 1);
    for (int i = 0; i < width * height; i++)
        depth[i] = i % width >= width - SKY_COLUMNS ? INFINITY : i % width >= edge ? 6 : 4;
    return frame;
}

static struct cranny_edges *edges_of(const struct cranny_gbuffer *frame)
{
    struct cranny_error why;
    struct cranny_edges *edges;
    CHECK_OK(cranny_edges_create(frame, NULL, &edges, &why), why);
    return edges;
}

static void filter(const struct cranny_gbuffer *frame, int which,
                   const struct cranny_filter_params *params, float *out)
{
    struct cranny_error why;
    struct cranny_edges *edges = edges_of(frame);
    CHECK_OK(filters[which].run(edges, params, in, 0, out, 0, &why), why);
    cranny_edges_destroy(&edges);
    CHECK(edges == NULL);
}

static double mean_of(const float *values, int x0, int x1, int y0, int y1, double *deviation)
{
    double sum = 0, squares = 0;
    const int count = (x1 - x0) * (y1 - y0);
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            const double v = (double)values[y * SIDE + x];
            sum += v;
            squares += v * v;
        }
    *deviation = sqrt(fmax(0, squares / count - sum * sum / count / count));
    return sum / count;
}

static void test_constants(void)
{
    static const float constants[] = {0, 1, 0.25f, -3, 1234.5f};
    struct cranny_gbuffer frame = two_walls(SIDE, SIDE, 40);
    for (int f = 0; f < FILTERS; f++)
        for (int k = 0; k < 5; k++) {
            struct cranny_filter_params params = cranny_filter_params_default();
            for (int i = 0; i < PIXELS; i++)
                in[i] = constants[k];
            filter(&frame, f, &params, one);
            float worst = 0;
            for (int i = 0; i < PIXELS; i++)
                if (isfinite(depth[i]))
                    worst = fmaxf(worst, fabsf(one[i] - constants[k]));
            CHECK_MSG(worst <= 2e-6f * fmaxf(1, fabsf(constants[k])), "%s of %g: off by %g",
                      filters[f].name, (double)constants[k], (double)worst);
        }
}

/* Each side's noise shrinks as that of a single wall; nothing crosses. */
static void test_step(void)
{
    static const double expected[] = {0.30, 0.25, 0.15}; /* √Σw², of w on white noise */
    enum { EDGE = 44 };
    struct cranny_gbuffer frame = two_walls(SIDE, SIDE, EDGE);
    for (int f = 0; f < SAME_SIZE; f++) {
        for (int i = 0; i < PIXELS; i++)
            in[i] = i % SIDE >= EDGE ? 1 : 0;
        filter(&frame, f, NULL, one);
        CHECK_MSG(memcmp(one, in, sizeof in) == 0, "%s: the step changes", filters[f].name);
        for (int i = 0; i < PIXELS; i++)
            in[i] = (i % SIDE >= EDGE ? 100 : 0) + noise(i);
        filter(&frame, f, NULL, one);
        double before, after, right;
        mean_of(in, 0, EDGE, 0, SIDE, &before);
        const double left = mean_of(one, 0, EDGE, 0, SIDE, &after);
        CHECK_MSG(after < expected[f] * before * 1.15, "%s: noise %.3f becomes %.4f",
                  filters[f].name, before, after);
        CHECK_NEAR(left, 0.5, 0.02);
        CHECK_NEAR(mean_of(one, EDGE, SIDE - SKY_COLUMNS, 0, SIDE, &right), 100.5, 0.02);
        CHECK_MSG(right < expected[f] * before * 1.3, "%s: noise %.3f becomes %.4f",
                  filters[f].name, before, right);
    }
}

/* White noise on a plane: what the weights say it becomes. */
static void test_noise_factor(void)
{
    struct cranny_gbuffer frame = plane_frame(SIDE, SIDE, 0, 0, 1);
    double before, after;
    for (int i = 0; i < PIXELS; i++)
        in[i] = noise(i);
    mean_of(in, 8, SIDE - 8, 8, SIDE - 8, &before);
    filter(&frame, 1, NULL, one);
    mean_of(one, 8, SIDE - 8, 8, SIDE - 8, &after);
    CHECK_NEAR(after / before, 0.25, 0.02); /* 16 equal weights */
    struct cranny_filter_params params = cranny_filter_params_default();
    params.reach_px = 12;
    filter(&frame, 0, &params, two);
    mean_of(two, 13, SIDE - 13, 13, SIDE - 13, &after);
    /* A bell of deviation 6.5: 1 / (2 √π 6.5), widened by the box of 4 and cut at 12. */
    CHECK_NEAR(after / before, 0.047, 0.012);
}

/* All pixels of a plane are one surface, however it is tilted: bits as on one that is faced. */
static void test_tilted(void)
{
    static const double tilts[][3] = {{0, 1, 0.4}, {1, 0.3, 0.3}, {-0.6, 0.7, 0.6}};
    for (int i = 0; i < PIXELS; i++)
        in[i] = noise(i);
    for (int f = 0; f < FILTERS; f++)
        for (int t = 0; t < 3; t++)
            for (int given = 0; given < 2; given++) {
                struct cranny_gbuffer frame = plane_frame(SIDE, SIDE, 0, 0, 1);
                filter(&frame, f, NULL, two);
                frame = plane_frame(SIDE, SIDE, tilts[t][0], tilts[t][1], tilts[t][2]);
                frame.normal = given ? frame.normal : NULL;
                filter(&frame, f, NULL, one);
                double worst = 0;
                int rows = 0;
                /* Beyond 50 m, near the horizon, floats no longer hold the plane. */
                for (int y = 30; y < SIDE - 30; y++)
                    for (int x = 30; x < SIDE - 30; x++) {
                        bool near = true;
                        for (int k = 0; k < 9; k++)
                            near = near &&
                                   depth[(y + (k / 3 - 1) * 30) * SIDE + x + (k % 3 - 1) * 30] < 50;
                        if (!near || f == 2)
                            continue;
                        rows++;
                        worst = fmax(worst,
                                     fabs((double)one[y * SIDE + x] - (double)two[y * SIDE + x]));
                    }
                CHECK_MSG(rows > 50 || f == 2, "tilt %d: %d pixels", t, rows);
                CHECK_MSG(worst <= (f == 3 ? 1e-5 : 0), "%s on tilt %d, normals %s: off by %g",
                          filters[f].name, t, given ? "given" : "reconstructed", worst);
            }
}

static void test_periodic(void)
{
    struct cranny_gbuffer frame = plane_frame(SIDE, SIDE, 0.3, 0.4, 1);
    for (int i = 0; i < PIXELS; i++)
        in[i] = noise((i / SIDE % 4) * 4 + i % SIDE % 4);
    double mean = 0, deviation;
    for (int i = 0; i < 16; i++)
        mean += (double)noise(i) / 16;
    filter(&frame, 1, NULL, one);
    CHECK_NEAR(mean_of(one, 2, SIDE - 1, 2, SIDE - 1, &deviation), mean, 1e-6);
    CHECK_NEAR(deviation, 0, 1e-6);
    for (int reach = 3; reach <= 24; reach++) {
        struct cranny_filter_params params = cranny_filter_params_default();
        params.reach_px = reach;
        filter(&frame, 0, &params, one);
        CHECK_NEAR(mean_of(one, reach, SIDE - reach, reach, SIDE - reach, &deviation), mean, 1e-6);
        CHECK_NEAR(deviation, 0, 1e-6);
    }
}

/* What an impulse becomes sums to what it was. */
static void test_energy(void)
{
    struct cranny_gbuffer frame = plane_frame(SIDE, SIDE, 0.2, -0.1, 1);
    struct cranny_filter_params params = cranny_filter_params_default();
    params.wide_px = 6;
    params.near_px = 2;
    for (int within = 0; within < 2; within++)
        for (int f = 0; f < SAME_SIZE; f++) {
            params.edge_bloom = within;
            for (int i = 0; i < PIXELS; i++)
                in[i] = i == PIXELS / 2 ? 1000 : 0;
            filter(&frame, f, &params, one);
            double sum = 0;
            for (int i = 0; i < PIXELS; i++)
                sum += (double)one[i];
            CHECK_MSG(fabs(sum - 1000) < 1, "%s: %.2f of 1000", filters[f].name, sum);
        }
}

/* The blooms are the Gaussians that they say. */
static void test_bloom_deviation(void)
{
    struct cranny_gbuffer frame = plane_frame(SIDE, SIDE, 0, 0, 1);
    struct cranny_filter_params params = cranny_filter_params_default();
    for (int within = 0; within < 2; within++)
        for (int near = 0; near < 2; near++) {
            params.edge_bloom = within;
            params.wide_px = 8;
            params.near_px = 3;
            params.blend = (float)near;
            for (int i = 0; i < PIXELS; i++)
                in[i] = i == PIXELS / 2;
            filter(&frame, 2, &params, one);
            double variance = 0;
            for (int i = 0; i < PIXELS; i++) {
                const double x = i % SIDE - SIDE / 2;
                variance += (double)one[i] * x * x;
            }
            CHECK_NEAR(sqrt(variance), near ? 3 : 8, near ? 0.2 : 0.3);
        }
    params = cranny_filter_params_default();
    params.blend = 0;
    params.wide_gain = 2;
    for (int i = 0; i < PIXELS; i++)
        in[i] = 0.75f;
    filter(&frame, 2, &params, one);
    CHECK_NEAR((double)one[PIXELS / 2], 0.5, 1e-5);
}

/* A ramp along the picture comes back exactly where there are pixels on both sides. */
static void test_upsample_linear(void)
{
    struct cranny_gbuffer frame = plane_frame(SIDE, SIDE, 0.5, 0.3, 1);
    const int half = (SIDE + 1) / 2;
    for (int y = 0; y < half; y++)
        for (int x = 0; x < half; x++)
            in[y * half + x] = 0.02f * (float)(2 * x) - 0.015f * (float)(2 * y) + 3;
    filter(&frame, 3, NULL, one);
    double worst = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            worst = fmax(worst, fabs((double)one[y * SIDE + x] - (0.02 * x - 0.015 * y + 3)));
    CHECK_MSG(worst < 1e-5, "a ramp is off by %g", worst);
}

static void test_upsample_leak(void)
{
    for (int edge = 30; edge < 34; edge++) {
        struct cranny_gbuffer frame = two_walls(SIDE, SIDE, edge);
        const int half = (SIDE + 1) / 2;
        for (int i = 0; i < half * half; i++)
            in[i] = 2 * (i % half) >= edge;
        filter(&frame, 3, NULL, one);
        double worst = 0;
        for (int i = 0; i < PIXELS; i++) {
            const int x = i % SIDE;
            if (x < SIDE - SKY_COLUMNS)
                worst = fmax(worst, fabs((double)one[i] - (x >= edge)));
            else
                CHECK(one[i] == 1);
        }
        CHECK_MSG(worst < 1e-3, "edge at %d: %g leaks", edge, worst);
    }
}

static struct cranny_gbuffer clutter(int width, int height)
{
    struct analytic scene = {0};
    add_plane(&scene, 0, -1, 0, 0, 1, 0.05);
    add_plane(&scene, 0, 0, -6, 0.5, 0, 1);
    add_sphere(&scene, -0.8, -0.6, -3.5, 0.45);
    struct cranny_gbuffer frame = analytic_frame(
        &scene, width, height, cranny_perspective(1, (float)width / (float)height), depth, normals);
    for (int i = 0; i < width * height; i++) {
        if (i % 11 == 0)
            depth[i] = i % 2 ? INFINITY : NAN;
        in[i] = i % 13 ? noise(i) : NAN;
    }
    return frame;
}

/* On every instruction set and thread count, with memory of one's own or not, tight or padded, in
 * place or not; values finite, sky as it came. */
static void check_same(const struct cranny_gbuffer *frame, int f)
{
    static float padded[PIXELS + 5 * SIDE];
    struct cranny_error why;
    struct cranny_workspace *workspace;
    struct cranny_filter_params params = cranny_filter_params_default();
    const int width = frame->width, height = frame->height;
    const size_t row = (size_t)width * sizeof(float), wide = row + 5 * sizeof(float);
    params.wide_px = 7;
    params.isa = CRANNY_ISA_PORTABLE;
    params.threads = 1;
    filter(frame, f, &params, one);
    CHECK_OK(cranny_workspace_create(&workspace, &why), why);
    params.workspace = workspace;
    for (int isa = CRANNY_ISA_AUTO; isa <= (int)cranny_isa_best(); isa++)
        for (int threads = 1; threads <= 5; threads += 2) {
            params.isa = isa;
            params.threads = threads;
            struct cranny_edges *edges;
            CHECK_OK(cranny_edges_create(frame, &params, &edges, &why), why);
            CHECK_OK(filters[f].run(edges, &params, in, 0, padded, wide, &why), why);
            bool same = true;
            for (int y = 0; y < height; y++)
                same = same && memcmp(one + y * width, padded + y * (width + 5), row) == 0;
            CHECK_MSG(same, "%s: %s with %d threads at %d x %d", filters[f].name,
                      cranny_isa_name((enum cranny_isa)isa), threads, width, height);
            memcpy(two, in, sizeof two);
            if (f < SAME_SIZE) {
                CHECK_OK(filters[f].run(edges, &params, two, 0, two, 0, &why), why);
                CHECK(memcmp(one, two, row * (size_t)height) == 0);
            }
            cranny_edges_destroy(&edges);
        }
    cranny_workspace_destroy(&workspace);
    for (int i = 0; i < width * height; i++) {
        const bool surface = depth[i] > 0 && isfinite(depth[i]);
        if (surface)
            CHECK_MSG(isfinite(one[i]), "%s: %d", filters[f].name, i);
        else if (f < SAME_SIZE)
            CHECK(memcmp(one + i, in + i, sizeof *in) == 0);
    }
}

static void test_same_bits(void)
{
    static const int sizes[] = {1, 2, 15, 16, 17, 33};
    for (int f = 0; f < FILTERS; f++) {
        struct cranny_gbuffer frame = clutter(SIDE, SIDE);
        check_same(&frame, f);
        for (int w = 0; w < 6; w++)
            for (int h = 0; h < 6; h++) {
                frame = clutter(sizes[w], sizes[h]);
                check_same(&frame, f);
            }
    }
}

/* A viewport in a larger buffer: its own pixels alone, the same as a buffer of that size. */
static void test_viewport(void)
{
    enum { X = 21, Y = 10, W = 50, H = 40 };
    static float part_depth[W * H], part_normals[W * H][3];
    struct cranny_gbuffer frame = clutter(SIDE, SIDE), part = frame;
    for (int i = 0; i < W * H; i++) {
        const int from = (Y + i / W) * SIDE + X + i % W;
        part_depth[i] = depth[from];
        memcpy(part_normals[i], normals[from], sizeof part_normals[i]);
    }
    frame.viewport = (struct cranny_rect){X, Y, W, H};
    frame.guard_band = 9;
    part.width = W;
    part.height = H;
    part.depth = part_depth;
    part.normal = part_normals;
    for (int f = 0; f < FILTERS; f++) {
        filter(&frame, f, NULL, one);
        filter(&part, f, NULL, two);
        CHECK_MSG(memcmp(one, two, W * H * sizeof *one) == 0, "%s", filters[f].name);
    }
}

static void test_update(void)
{
    struct cranny_error why;
    struct cranny_gbuffer frame = clutter(40, 30);
    struct cranny_edges *edges = edges_of(&frame);
    frame = two_walls(SIDE, SIDE, 30);
    CHECK_OK(cranny_edges_update(edges, &frame, NULL, &why), why);
    CHECK_OK(cranny_filter_box4(edges, NULL, in, 0, one, 0, &why), why);
    filter(&frame, 1, NULL, two);
    CHECK(memcmp(one, two, sizeof one) == 0);
    frame.depth = NULL;
    CHECK_INT(cranny_edges_update(edges, &frame, NULL, &why), CRANNY_USAGE);
    CHECK_INT(cranny_filter_box4(edges, NULL, in, 0, one, 0, &why), CRANNY_USAGE);
    CHECK(strstr(why.message, "no frame"));
    cranny_edges_destroy(&edges);
}

static void test_refusals(void)
{
    struct cranny_error why;
    struct cranny_gbuffer frame = two_walls(SIDE, SIDE, 30);
    struct cranny_filter_params params = cranny_filter_params_default();
    struct cranny_edges *edges;
    params.tolerance_world = 0;
    CHECK_INT(cranny_edges_create(&frame, &params, &edges, &why), CRANNY_USAGE);
    CHECK(edges == NULL && strstr(why.message, "tolerance_world"));
    CHECK_INT(cranny_edges_create(NULL, NULL, &edges, &why), CRANNY_USAGE);
    CHECK_INT(cranny_edges_create(&frame, NULL, NULL, &why), CRANNY_USAGE);
    CHECK_INT(cranny_edges_update(NULL, &frame, NULL, &why), CRANNY_USAGE);
    cranny_edges_destroy(NULL);
    edges = edges_of(&frame);
    for (int f = 0; f < FILTERS; f++) {
        filter_fn *run = filters[f].run;
        CHECK_INT(run(NULL, NULL, in, 0, one, 0, &why), CRANNY_USAGE);
        CHECK_INT(run(edges, NULL, NULL, 0, one, 0, &why), CRANNY_USAGE);
        CHECK_INT(run(edges, NULL, in, 0, NULL, 0, &why), CRANNY_USAGE);
        CHECK_INT(run(edges, NULL, in, 8, one, 0, &why), CRANNY_USAGE);
        CHECK(strstr(why.message, "input_stride"));
        CHECK_INT(run(edges, NULL, in, 0, one, SIDE * sizeof(float) + 2, &why), CRANNY_USAGE);
        params = cranny_filter_params_default();
        params.reach_px = 25;
        CHECK_INT(run(edges, &params, in, 0, one, 0, &why), CRANNY_USAGE);
        CHECK(strstr(why.message, "reach_px"));
        params = cranny_filter_params_default();
        params.wide_px = NAN;
        CHECK_INT(run(edges, &params, in, 0, one, 0, &why), CRANNY_USAGE);
    }
    cranny_edges_destroy(&edges);
}

int main(void)
{
    test_constants();
    test_step();
    test_noise_factor();
    test_tilted();
    test_periodic();
    test_energy();
    test_bloom_deviation();
    test_upsample_linear();
    test_upsample_leak();
    test_same_bits();
    test_viewport();
    test_update();
    test_refusals();
    return check_end("filter");
}
