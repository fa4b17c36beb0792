/* What the filter leaves of the noise, and whether it smears across silhouettes. */
#include "conformance/conformance.h"

enum { SEEDS = 16, REACH = 4 };

/* Whether a surface that is much nearer (−1) or farther (1) lies within REACH pixels; 0: none. */
static int edge_side(const struct view *view, int x, int y)
{
    const double here = (double)view->depth[y * view->width + x];
    for (int j = y - REACH; j <= y + REACH; j++)
        for (int i = x - REACH; i <= x + REACH; i++) {
            const double there = (double)view->depth[j * view->width + i];
            if (there > here + 0.5)
                return 1;
            if (there < here - 0.5)
                return -1;
        }
    return 0;
}

/* Filtered against what many seeds have as their mean, near silhouettes; a filter that smears
 * brightens one side and darkens the other. */
static void record_bleeding(const struct view *view, int method)
{
    const struct cranny_screen_params params = method_params(method, NULL, 0.5);
    float *filtered = render(&view->frame, &params), *mean = render_mean(view, params, SEEDS);
    double sums[2] = {0}, squares = 0;
    int counts[2] = {0};
    for (int y = 0; y < view->height; y++)
        for (int x = 0; x < view->width; x++) {
            const int i = y * view->width + x;
            const int side = view_counts(view, x, y, 1e6) ? edge_side(view, x, y) : 0;
            if (!side)
                continue;
            const double error = (double)filtered[i] - (double)mean[i];
            sums[side > 0] += error;
            counts[side > 0]++;
            squares += error * error;
        }
    CHECK(counts[0] > 100 && counts[1] > 100);
    record(ROW_BLEED_MEAN, method, false, fabs(sums[0] / counts[0]));
    record(ROW_BLEED_MEAN, method, false, fabs(sums[1] / counts[1]));
    record(ROW_BLEED_RMS, method, false, sqrt(squares / (counts[0] + counts[1])));
    free(filtered);
    free(mean);
}

static void measure_bleeding(void)
{
    struct analytic world = {0};
    scenes[SCENE_GULLY].build(&world);
    add_sphere(&world, 0.05, 1.6, 0.7, 0.25);
    struct view view =
        view_make(&world, &scenes[SCENE_GULLY].camera, usual_lens(), TILE_WIDTH, TILE_HEIGHT);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        record_bleeding(&view, m);
    view_free(&view);
}

static void measure_seed(void)
{
    struct view view = scene_view(SCENE_COURT);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        struct cranny_screen_params params = method_params(m, NULL, 0.5);
        float *a = render(&view.frame, &params);
        params.seed = 5;
        float *b = render(&view.frame, &params);
        double sum = 0, size = 0;
        for (int i = 0; i < TILE_PIXELS; i++) {
            sum += (double)b[i] - (double)a[i];
            size += fabs((double)b[i] - (double)a[i]);
        }
        record(ROW_SEED_MEAN, m, false, fabs(sum) / TILE_PIXELS);
        record(ROW_SEED_NOISE, m, false, size / TILE_PIXELS);
        free(a);
        free(b);
    }
    view_free(&view);
}

/* Amplitude of a wave of `fx`, `fy` quarters of the sampling rate. */
static double wave(const double *noise, int fx, int fy)
{
    double re = 0, im = 0;
    int count = 0;
    for (int y = MARGIN; y < TILE_HEIGHT - MARGIN; y++)
        for (int x = MARGIN; x < TILE_WIDTH - MARGIN; x++) {
            static const double cosines[4] = {1, 0, -1, 0};
            const int phase = (fx * x + fy * y) & 3;
            re += noise[y * TILE_WIDTH + x] * cosines[phase];
            im += noise[y * TILE_WIDTH + x] * cosines[(phase + 3) & 3];
            count++;
        }
    return 2 * sqrt(re * re + im * im) / count;
}

/* The strongest wave of a 4×4 tile. */
static double tile_amplitude(const double *noise)
{
    double most = 0;
    for (int f = 1; f < 16; f++)
        most = fmax(most, wave(noise, f % 4, f / 4));
    return most;
}

static void record_pattern(const struct view *view, int method)
{
    struct cranny_screen_params params = method_params(method, NULL, 0.5);
    double noise[2][TILE_PIXELS];
    float *mean = render_mean(view, params, SEEDS);
    float *filtered = render(&view->frame, &params);
    params.filter = CRANNY_FILTER_NONE;
    float *raw = render(&view->frame, &params);
    for (int i = 0; i < TILE_PIXELS; i++) {
        noise[0][i] = (double)raw[i] - (double)mean[i];
        noise[1][i] = (double)filtered[i] - (double)mean[i];
    }
    record(ROW_PATTERN_RAW, method, false, tile_amplitude(noise[0]));
    record(ROW_PATTERN, method, false, tile_amplitude(noise[1]));
    free(mean);
    free(filtered);
    free(raw);
}

static void measure_pattern(void)
{
    static const int which[] = {SCENE_WALL, SCENE_GULLY};
    for (int k = 0; k < 2; k++) {
        struct view view = scene_view(which[k]);
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
            record_pattern(&view, m);
        view_free(&view);
    }
}

void measure_noise(void)
{
    measure_bleeding();
    measure_seed();
    measure_pattern();
}
