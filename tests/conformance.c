/* What each screen-space method makes of scenes whose truth is known, and what must not change its
 * picture. `--write docs` writes docs/conformance.md and its pictures.
 *
 * Bounds are what was measured and half as much again; the table is the place to adjust them when
 * a method's constants change. */
#include "conformance/conformance.h"

#define BOUNDS(...) .bound = {__VA_ARGS__}

/* ssao, hbao, crease, alchemy, raymarch. */
struct row rows[ROW_COUNT] = {
#define FORM(ID, WHAT, ...) [ROW_##ID] = {SECTION_FORMS, WHAT, NULL, BOUNDS(__VA_ARGS__)}
    FORM(PLANE_GIVEN, "plane at 12 tilts: darkening", 0.01, 0.01, 0.01, 0.01, 0.01),
    FORM(PLANE_FACE, "the same, normals reconstructed", 0.01, 0.01, 0.01, 0.01, 0.01),
    FORM(WALL_RMS, "wall: rms", 0.0226, 0.0178, 0.0278, 0.0391, 0.0229),
    FORM(WALL_MAX, "wall: largest", 0.1898, 0.1806, 0.2204, 0.3228, 0.2576),
    FORM(ROOM_RMS, "room: rms", 0.0373, 0.0274, 0.0398, 0.039, 0.023),
    FORM(ROOM_MAX, "room: largest", 0.1949, 0.1458, 0.3577, 0.2876, 0.236),
    FORM(GULLY_RMS, "gully: rms", 0.0319, 0.0311, 0.0767, 0.0976, 0.0266),
    FORM(GULLY_MAX, "gully: largest", 0.4385, 0.4382, 0.6558, 0.7989, 0.3137),
    FORM(BALL_RMS, "ball: rms", 0.0533, 0.0583, 0.0824, 0.095, 0.0381),
    FORM(BALL_MAX, "ball: largest", 0.7041, 0.7548, 0.7709, 0.9134, 0.605),
    FORM(STEP_RMS, "step: rms", 0.0269, 0.0237, 0.0356, 0.0418, 0.0188),
    FORM(STEP_MAX, "step: largest", 0.4109, 0.4238, 0.5511, 0.6126, 0.2685),
    FORM(COURT_RMS, "court: rms", 0.043, 0.0498, 0.0784, 0.1031, 0.0422),
    FORM(COURT_MAX, "court: largest", 0.5999, 0.6307, 0.7664, 0.9093, 0.4604),
    FORM(EDGE_MEAN, "step, where the truth is open: mean darkening", 0.0007, 0.0005, 0.0005, 0.0022,
         0.0005),
    FORM(EDGE_MAX, "the same, outer edges included: largest", 0.0159, 0.0209, 0.0116, 0.0469,
         0.0118),
    FORM(HALO_MEAN, "halo on the far wall: mean darkening", 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    FORM(HALO_MAX, "halo on the far wall: largest", 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    FORM(SKY_TOUCHED, "sky pixels that are not exactly 1", 0, 0, 0, 0, 0),
    FORM(SKY_BALL, "a ball, and a floor, before the sky: darkening", 0.01, 0.01, 0.01, 0.01, 0.01),
#undef FORM
#define SAME(ID, WHAT, LIMIT, ...) [ROW_##ID] = {SECTION_SAME, WHAT, LIMIT, BOUNDS(__VA_ARGS__)}
    SAME(RESOLUTION, "twice the resolution, then means of 2×2", NULL, 0.0094, 0.0079, 0.008, 0.007,
         0.0064),
    SAME(LENS, "a lens of 34° instead of 52°", NULL, 0.0196, 0.0151, 0.0148, 0.0196, 0.0114),
    SAME(SCALE_SMALL, "scene and radius ×0.001", NULL, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    SAME(SCALE_LARGE, "scene and radius ×1000", NULL, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    SAME(SCALE_EXACT, "scene and radius ×1024: the same bits", NULL, 0, 0, 0, 0, 0),
    SAME(MOVE_ALONG, "camera a fifth nearer", NULL, 0.0121, 0.0094, 0.0088, 0.008, 0.0067),
    SAME(MOVE_ACROSS, "camera 0.25 m to the side", NULL, 0.0098, 0.007, 0.0071, 0.0063, 0.0051),
    SAME(DEPTH_GL, "depth buffer: GL, float", NULL, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    SAME(DEPTH_D3D, "depth buffer: D3D and Vulkan, float", NULL, 0.0005, 0.0005, 0.0005, 0.0005,
         0.0005),
    SAME(DEPTH_REVERSED, "depth buffer: reversed, float", NULL, 0.0005, 0.0005, 0.0005, 0.0005,
         0.0005),
    SAME(DEPTH_INFINITE, "depth buffer: reversed, infinite far plane, float", NULL, 0.0005, 0.0005,
         0.0005, 0.0005, 0.0005),
    SAME(DEPTH_LOGARITHMIC, "depth buffer: logarithmic, float", NULL, 0.0005, 0.0005, 0.0005,
         0.0005, 0.0005),
    SAME(DEPTH_24, "depth buffer: D3D, 24 bits, near plane 0.1 m", NULL, 0.0005, 0.0005, 0.0005,
         0.0005, 0.0005),
    SAME(DEPTH_16, "depth buffer: D3D, 16 bits, near plane 0.1 m", NULL, 0.0019, 0.0007, 0.0007,
         0.0028, 0.0068),
    SAME(PARALLEL_FAR, "parallel rays: camera at 2048 m instead of 4 m", NULL, 0.0005, 0.0005,
         0.0005, 0.0005, 0.0005),
    SAME(PARALLEL_SCALE, "parallel rays: scene and radius ÷1024: the same bits", NULL, 0, 0, 0, 0,
         0),
    SAME(LONG_LENS, "parallel rays from 4 m against a lens of 0.07° at 2048 m", NULL, 0.0008,
         0.0007, 0.0007, 0.0007, 0.0007),
    SAME(VIEWPORT, "a viewport with guard band against the whole frame", NULL, 0.0005, 0.0005,
         0.0007, 0.0007, 0.0005),
    SAME(FACE_NORMALS, "normals reconstructed instead of given", NULL, 0.001, 0.0008, 0.0008,
         0.0007, 0.0008),
    SAME(SNORM8, "normals as snorm8 instead of float", NULL, 0.0008, 0.0007, 0.0005, 0.0005,
         0.0007),
    SAME(UNORM8, "normals as unorm8", NULL, 0.0014, 0.0007, 0.0007, 0.001, 0.0008),
    SAME(OCT16, "normals as oct16", NULL, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    SAME(OCT8, "normals as oct8", NULL, 0.0011, 0.0008, 0.0007, 0.001, 0.0008),
    SAME(BORDER_BARE, "rms error at the border without a guard band", NULL, 0.0167, 0.0166, 0.0244,
         0.0339, 0.0214),
    SAME(BORDER_GUARDED, "the same with one of 24 pixels", NULL, 0.0152, 0.0131, 0.0238, 0.0334,
         0.0181),
    SAME(MIRROR, "mirrored left to right", NULL, 0.0082, 0.0028, 0.0025, 0.0026, 0.001),
#undef SAME
#define SAMPLES(ID, WHAT, ...) [ROW_##ID] = {SECTION_SAMPLES, WHAT, NULL, BOUNDS(__VA_ARGS__)}
    SAMPLES(FIRST_4, "apart, 4 samples, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_4, "apart, 4 samples, `cross`", 0.0085, 0.0074, 0.0046, 0.0061, 0.0063),
    SAMPLES(BLUR_4, "apart, 4 samples, `blur`", 0.0067, 0.0055, 0.006, 0.0046, 0.004),
    SAMPLES(FIRST_8, "apart, 8 samples, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_8, "apart, 8 samples, `cross`", 0.0055, 0.0051, 0.0073, 0.0047, 0.0043),
    SAMPLES(BLUR_8, "apart, 8 samples, `blur`", 0.0055, 0.0041, 0.0083, 0.0038, 0.0047),
    SAMPLES(FIRST_TRUTH, "truth, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_TRUTH, "truth, `cross`", 0.0523, 0.0524, 0.0808, 0.0872, 0.0472),
    SAMPLES(BLUR_TRUTH, "truth, `blur`", 0.0532, 0.0533, 0.0827, 0.0872, 0.0481),
#undef SAMPLES
#define NOISE(ID, WHAT, ...) [ROW_##ID] = {SECTION_NOISE, WHAT, NULL, BOUNDS(__VA_ARGS__)}
    NOISE(BLEED_MEAN, "smear: mean of the worse side", 0.0014, 0.0013, 0.0011, 0.0023, 0.0008),
    NOISE(BLEED_RMS, "smear: rms", 0.0245, 0.0223, 0.0254, 0.0151, 0.0239),
    NOISE(SEED_MEAN, "another seed: difference of the means", 0.0013, 0.0008, 0.0007, 0.001,
          0.0005),
    NOISE(SEED_NOISE, "another seed: mean absolute difference", 0.0067, 0.003, 0.003, 0.0041,
          0.001),
    NOISE(PATTERN_RAW, "pattern without a filter", 0.0104, 0.0034, 0.0199, 0.0022, 0.001),
    NOISE(PATTERN, "pattern, filtered", 0.0011, 0.0011, 0.0014, 0.0011, 0.0008),
#undef NOISE
};

void record(enum row_id id, int method, bool paper, double value)
{
    double *kept = paper ? &rows[id].paper[method] : &rows[id].measured[method];
    /* NaN is how unmeasured rows begin. */
    value = isnan(value) ? INFINITY : value;
    if (!(value <= *kept))
        *kept = value;
}

static void forget(void)
{
    for (int i = 0; i < ROW_COUNT; i++)
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
            rows[i].measured[m] = rows[i].paper[m] = NAN;
}

static void check_rows(void)
{
    for (int i = 0; i < ROW_COUNT; i++)
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
            CHECK_MSG(rows[i].measured[m] <= rows[i].bound[m], "%s: %s: %.5f, at most %.5f",
                      cranny_method_name((enum cranny_method)m), rows[i].what, rows[i].measured[m],
                      rows[i].bound[m]);
}

static void check_orders(void)
{
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        const double bare = rows[ROW_BORDER_BARE].measured[m];
        const double guarded = rows[ROW_BORDER_GUARDED].measured[m];
        CHECK_MSG(guarded < 1.02 * bare, "%s at the border: %.4f with a guard band, %.4f without",
                  cranny_method_name((enum cranny_method)m), guarded, bare);
        /* A quarter of an 8-bit step cannot be seen. */
        const double filtered = rows[ROW_PATTERN].measured[m];
        CHECK_MSG(filtered < 0.25 / 255, "%s: the tile's pattern is %.5f after the filter",
                  cranny_method_name((enum cranny_method)m), filtered);
    }
}

int main(int argc, char **argv)
{
    const char *folder = argc == 3 && strcmp(argv[1], "--write") == 0 ? argv[2] : NULL;
    if (argc > 1 && !folder) {
        fprintf(stderr, "usage: test_conformance [--write FOLDER]\n");
        return 2;
    }
    forget();
    measure_forms(folder);
    measure_same();
    measure_depths();
    measure_samples(folder);
    measure_noise();
    check_rows();
    check_orders();
    if (folder)
        page_write(folder);
    return check_end("conformance");
}
