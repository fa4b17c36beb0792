/* The screen-space methods as one: same bits on every instruction set and thread count, open
 * planes, corners as the truth has them, and hostile frames. Pictures and invariances:
 * tests/conformance.c. */
#include "analytic.h"

#include <cranny/screen.h>

enum { WIDTH = 203, HEIGHT = 117, PIXELS = WIDTH * HEIGHT };

static float depth[PIXELS], normals[PIXELS][3], one[PIXELS], two[PIXELS];

/* A room corner with two balls and a window to the sky. */
static struct analytic clutter(void)
{
    struct analytic scene = {0};
    add_plane(&scene, 0, -1, 0, 0, 1, 0.05);
    add_plane(&scene, 0, 0, -6, 0.5, 0, 1);
    add_sphere(&scene, -0.8, -0.6, -3.5, 0.45);
    add_sphere(&scene, 0.7, -0.2, -4.2, 0.8);
    return scene;
}

static struct cranny_projection lens(void)
{
    return cranny_perspective(1, (float)WIDTH / HEIGHT);
}

static void render(const struct cranny_gbuffer *frame, const struct cranny_screen_params *params,
                   float *out)
{
    struct cranny_error why;
    CHECK_OK(cranny_screen_render(frame, params, out, 0, &why), why);
}

static struct cranny_screen_params params_of(int method, const char *preset)
{
    struct cranny_screen_params params =
        cranny_screen_params_preset((enum cranny_method)method, preset);
    params.radius_world = 0.5f;
    return params;
}

static void test_same_bits(void)
{
    static const char *const presets[] = {"calibrated", "paper"};
    struct analytic scene = clutter();
    struct cranny_gbuffer frame = analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
    for (int i = 0; i < PIXELS; i += 7)
        depth[i] = INFINITY;
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        for (int k = 0; k < 4; k++) {
            struct cranny_screen_params params = params_of(m, presets[k & 1]);
            params.normals = k & 2 ? CRANNY_NORMALS_FACE : CRANNY_NORMALS_GIVEN;
            params.resolution = k & 2 ? !params.resolution : params.resolution;
            params.contrast = k & 2 ? 1.5f : params.contrast;
            params.isa = CRANNY_ISA_PORTABLE;
            params.threads = 1;
            render(&frame, &params, one);
            for (int isa = CRANNY_ISA_PORTABLE; isa <= (int)cranny_isa_best(); isa++)
                for (int threads = 1; threads <= 7; threads += 3) {
                    params.isa = isa;
                    params.threads = threads;
                    memset(two, 0x7f, sizeof two);
                    render(&frame, &params, two);
                    CHECK_MSG(memcmp(one, two, sizeof one) == 0, "%s %s: %s with %d threads",
                              cranny_method_name((enum cranny_method)m), presets[k & 1],
                              cranny_isa_name((enum cranny_isa)isa), threads);
                }
        }
    if (cranny_isa_best() != CRANNY_ISA_AVX512)
        printf("SKIPPED: kernels above %s: not on this machine\n",
               cranny_isa_name(cranny_isa_best()));
}

/* Every width around a vector's, tight and padded rows. */
static void test_sizes(void)
{
    static const int sizes[] = {1, 2, 7, 8, 9, 15, 16, 17, 31, 33};
    struct analytic scene = clutter();
    for (size_t w = 0; w < sizeof sizes / sizeof *sizes; w++)
        for (size_t h = 0; h < sizeof sizes / sizeof *sizes; h += 3) {
            const int width = sizes[w], height = sizes[h];
            struct cranny_gbuffer frame =
                analytic_frame(&scene, width, height,
                               cranny_perspective(1, (float)width / (float)height), depth, normals);
            for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
                struct cranny_screen_params params = params_of(m, NULL);
                render(&frame, &params, one);
                params.isa = CRANNY_ISA_PORTABLE;
                struct cranny_error why;
                const size_t stride = (size_t)(width + 5) * sizeof(float);
                CHECK_OK(cranny_screen_render(&frame, &params, two, stride, &why), why);
                bool same = true;
                for (int y = 0; y < height; y++)
                    same = same && memcmp(one + y * width, two + y * (width + 5),
                                          (size_t)width * sizeof(float)) == 0;
                CHECK_MSG(same, "%s at %d x %d", cranny_method_name((enum cranny_method)m), width,
                          height);
            }
        }
}

/* A plane at any tilt hides nothing of itself. */
static void test_open_planes(void)
{
    static const double tilts[][3] = {{0, 0, 1}, {0, 1, 0.3}, {1, 0.2, 0.1}, {-0.5, 0.5, 0.2}};
    for (size_t t = 0; t < sizeof tilts / sizeof *tilts; t++)
        for (int given = 0; given < 2; given++) {
            struct analytic scene = {0};
            add_plane(&scene, 0, -0.3, -3, tilts[t][0], tilts[t][1], tilts[t][2]);
            struct cranny_gbuffer frame =
                analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
            frame.normal = given ? frame.normal : NULL;
            for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
                struct cranny_screen_params params = params_of(m, NULL);
                render(&frame, &params, one);
                float least = 1;
                int at = 0;
                for (int i = 0; i < PIXELS; i++) {
                    /* Near the horizon a pixel covers metres; reconstruction needs neighbours. */
                    const bool border = i % WIDTH < 3 || i % WIDTH >= WIDTH - 3 || i / WIDTH < 3 ||
                                        i / WIDTH >= HEIGHT - 3;
                    if (depth[i] < 30 && !border && one[i] < least) {
                        least = one[i];
                        at = i;
                    }
                }
                CHECK_MSG(least >= 0.99f, "%s on tilt %zu, normals %s: %.4f at %d,%d (depth %.2f)",
                          cranny_method_name((enum cranny_method)m), t,
                          given ? "given" : "reconstructed", (double)least, at % WIDTH, at / WIDTH,
                          (double)depth[at]);
            }
        }
}

/* Floor meets wall, seen by a camera that sees both: near the closed form. */
static void test_corner(void)
{
    struct analytic scene = {0};
    add_plane(&scene, 0, -1, 0, 0, 1, 0);
    add_plane(&scene, 0, 0, -4, 0, 0, 1);
    struct cranny_gbuffer frame = analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        struct cranny_screen_params params = params_of(m, NULL);
        render(&frame, &params, one);
        double worst = 0;
        for (int y = 0; y < HEIGHT; y++) {
            const int i = y * WIDTH + WIDTH / 2;
            const double v = lens().top + (y + 0.5) / HEIGHT * ((double)lens().bottom - lens().top);
            const double p[3] = {0, v * (double)depth[i], -(double)depth[i]};
            const double n[3] = {(double)normals[i][0], (double)normals[i][1],
                                 (double)normals[i][2]};
            worst = fmax(worst, fabs((double)one[i] - analytic_visibility(&scene, p, n, 0.5, 64)));
        }
        CHECK_MSG(worst < 0.3, "%s in a corner: off by %.3f",
                  cranny_method_name((enum cranny_method)m), worst);
        printf("%s in a corner: largest error %.3f\n", cranny_method_name((enum cranny_method)m),
               worst);
    }
}

static void test_sky(void)
{
    struct analytic scene = clutter();
    struct cranny_gbuffer frame = analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
    for (int i = 0; i < PIXELS; i++)
        if (i % WIDTH > WIDTH / 2)
            depth[i] = INFINITY;
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        for (int k = 0; k < 2; k++) {
            struct cranny_screen_params params = params_of(m, k ? "paper" : "calibrated");
            render(&frame, &params, one);
            int dimmed = 0;
            for (int i = 0; i < PIXELS; i++)
                dimmed += isinf(depth[i]) && one[i] != 1;
            CHECK_MSG(dimmed == 0, "%s: %d sky pixels are dimmed",
                      cranny_method_name((enum cranny_method)m), dimmed);
        }
}

static void test_hostile(void)
{
    static const float bad[] = {NAN, 0, -1, INFINITY, -INFINITY, 1e-38f, 1e-45f, 3e38f, 1e11f};
    struct analytic scene = clutter();
    struct cranny_gbuffer frame = analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
    for (int i = 0; i < PIXELS; i++) {
        if (i % 3 == 0)
            depth[i] = bad[i / 3 % 9];
        if (i % 5 == 0)
            normals[i][i % 3] = bad[i / 5 % 9];
    }
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        for (int k = 0; k < 6; k++) {
            struct cranny_screen_params params = params_of(m, k & 1 ? "paper" : "calibrated");
            params.radius_world = k < 2 ? 0.5f : k < 4 ? 1000 : 1e-6f;
            struct cranny_screen_report report;
            params.report = &report;
            render(&frame, &params, one);
            CHECK(report.invalid_depths > 0);
            int outside = 0;
            for (int i = 0; i < PIXELS; i++)
                outside += !(one[i] >= 0 && one[i] <= 1);
            CHECK_MSG(outside == 0, "%s: %d pixels outside [0, 1]",
                      cranny_method_name((enum cranny_method)m), outside);
        }
}

static void test_refusals(void)
{
    struct cranny_error why;
    struct analytic scene = clutter();
    struct cranny_gbuffer frame = analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        struct cranny_screen_params params = params_of(m, NULL);
        params.radius_world = 0;
        CHECK_INT(cranny_screen_render(&frame, &params, one, 0, &why), CRANNY_USAGE);
        params.radius_world = NAN;
        CHECK_INT(cranny_screen_render(&frame, &params, one, 0, &why), CRANNY_USAGE);
        params.radius_world = 1;
        CHECK_INT(cranny_screen_render(&frame, &params, NULL, 0, &why), CRANNY_USAGE);
    }
    struct cranny_screen_params params = params_of(CRANNY_ALCHEMY, NULL);
    params.samples = 0;
    CHECK_INT(cranny_screen_render(&frame, &params, one, 0, &why), CRANNY_USAGE);
    CHECK(strstr(why.message, "samples"));
    params = params_of(CRANNY_ALCHEMY, NULL);
    for (int i = 0; i < PIXELS; i++)
        depth[i] = -1;
    CHECK_INT(cranny_screen_render(&frame, &params, one, 0, &why), CRANNY_INPUT);
    CHECK(strstr(why.message, "positive"));
    frame.depth = NULL;
    CHECK_INT(cranny_screen_render(&frame, &params, one, 0, &why), CRANNY_USAGE);
}

static bool stop_at(void *user, const char *stage, double done, double total)
{
    (void)done;
    (void)total;
    return strcmp(stage, user) != 0;
}

static void test_cancel(void)
{
    static const char *const stages[] = {"prepare", "estimate", "filter"};
    struct analytic scene = clutter();
    struct cranny_gbuffer frame = analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
    for (int i = 0; i < 3; i++) {
        struct cranny_error why;
        struct cranny_hooks hooks = {.user = (void *)stages[i], .progress = stop_at};
        struct cranny_screen_params params = params_of(CRANNY_HBAO, NULL);
        params.hooks = &hooks;
        CHECK_INT(cranny_screen_render(&frame, &params, one, 0, &why), CRANNY_CANCELLED);
    }
}

/* A workspace changes nothing, whatever it held before. */
static void test_workspace(void)
{
    struct cranny_error why;
    struct cranny_workspace *workspace;
    CHECK_OK(cranny_workspace_create(&workspace, &why), why);
    struct analytic scene = clutter();
    for (int pass = 0; pass < 3; pass++) {
        const int width = pass == 1 ? 90 : WIDTH, height = pass == 1 ? 50 : HEIGHT;
        struct cranny_gbuffer frame =
            analytic_frame(&scene, width, height,
                           cranny_perspective(1, (float)width / (float)height), depth, normals);
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
            struct cranny_screen_params params = params_of(m, m & 1 ? "paper" : NULL);
            render(&frame, &params, one);
            params.workspace = workspace;
            render(&frame, &params, two);
            CHECK(memcmp(one, two, (size_t)(width * height) * sizeof(float)) == 0);
        }
    }
    cranny_workspace_destroy(&workspace);
    CHECK(workspace == NULL);
}

/* A viewport in a larger buffer, with and without its surroundings. */
static void test_viewport(void)
{
    struct analytic scene = clutter();
    struct cranny_gbuffer frame = analytic_frame(&scene, WIDTH, HEIGHT, lens(), depth, normals);
    enum { W = 100, H = 60, X = 40, Y = 30 };
    static float big_depth[PIXELS * 2], big_normals[PIXELS * 2][3];
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        struct cranny_screen_params params = params_of(m, NULL);
        frame.width = WIDTH;
        render(&frame, &params, one);
        /* The same frame as a part of an atlas: whatever lies around is never read. */
        const int wide = WIDTH + 40;
        for (int i = 0; i < PIXELS * 2; i++)
            big_depth[i] = i % 2 ? NAN : 0.1f;
        for (int y = 0; y < HEIGHT; y++) {
            memcpy(big_depth + (y + 9) * wide + 23, depth + y * WIDTH, WIDTH * sizeof(float));
            memcpy(big_normals + (y + 9) * wide + 23, normals + y * WIDTH,
                   WIDTH * 3 * sizeof(float));
        }
        struct cranny_gbuffer atlas = frame;
        atlas.width = wide;
        atlas.height = HEIGHT + 20;
        atlas.depth = big_depth;
        atlas.normal = big_normals;
        atlas.viewport = (struct cranny_rect){23, 9, WIDTH, HEIGHT};
        render(&atlas, &params, two);
        CHECK_MSG(memcmp(one, two, sizeof one) == 0, "%s in an atlas",
                  cranny_method_name((enum cranny_method)m));
        /* The middle of the frame, its surroundings readable as a guard band. */
        struct cranny_gbuffer part = frame;
        const struct cranny_projection p = lens();
        part.viewport = (struct cranny_rect){X, Y, W, H};
        part.guard_band = 200;
        part.projection.left = p.left + (p.right - p.left) * X / WIDTH;
        part.projection.right = p.left + (p.right - p.left) * (X + W) / WIDTH;
        part.projection.top = p.top + (p.bottom - p.top) * Y / HEIGHT;
        part.projection.bottom = p.top + (p.bottom - p.top) * (Y + H) / HEIGHT;
        render(&part, &params, two);
        double sum = 0;
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++)
                sum += fabs((double)two[y * W + x] - (double)one[(y + Y) * WIDTH + x + X]);
        CHECK_MSG(sum / (W * H) < 0.01, "%s: a part differs from the whole by %.4f",
                  cranny_method_name((enum cranny_method)m), sum / (W * H));
    }
}

/* Noise anchored to surfaces goes with them: a camera that moves by some pixels along a wall in the
 * plane z = 0 sees the same values there, although its depths are rounded otherwise. */
static void test_surface_noise(void)
{
    enum { W = 96, H = 64, SHIFT = 7, MARGIN = 14 };
    const double step = 1.0 / 16;
    double pose[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4};
    struct cranny_gbuffer frame = {.width = W,
                                   .height = H,
                                   .depth = depth,
                                   .projection = cranny_orthographic(2, (float)W / H),
                                   .world_from_view = pose};
    for (int isa = CRANNY_ISA_PORTABLE; isa <= (int)cranny_isa_best(); isa++)
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
            struct cranny_screen_params params = params_of(m, NULL);
            params.anchor = CRANNY_ANCHOR_SURFACE;
            params.filter = CRANNY_FILTER_NONE;
            params.isa = isa;
            for (int moved = 0; moved < 2; moved++) {
                pose[3] = moved * SHIFT * step;
                for (int i = 0; i < W * H; i++)
                    depth[i] = i / W > H / 2 ? 3.8f : nextafterf(4, i % 2 ? 3 : 5);
                render(&frame, &params, moved ? two : one);
            }
            double worst = 0, spread = 0;
            for (int y = MARGIN; y <= H / 2; y++)
                for (int x = MARGIN; x < W - SHIFT - MARGIN; x++) {
                    const double here = (double)one[y * W + x + SHIFT];
                    worst = fmax(worst, fabs(here - (double)two[y * W + x]));
                    spread = fmax(spread, fabs(here - (double)two[y * W + MARGIN]));
                }
            CHECK_MSG(worst < 1e-3, "%s: a value on the wall changes by %.4f",
                      cranny_method_name((enum cranny_method)m), worst);
            CHECK_MSG(spread > 0.01, "%s: there is no noise",
                      cranny_method_name((enum cranny_method)m));
        }
}

int main(void)
{
    test_same_bits();
    test_sizes();
    test_open_planes();
    test_corner();
    test_sky();
    test_hostile();
    test_refusals();
    test_cancel();
    test_workspace();
    test_viewport();
    test_surface_noise();
    return check_end("screen");
}
