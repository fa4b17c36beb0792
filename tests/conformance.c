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
    FORM(PLANE_GIVEN, "plane at 12 tilts: darkening", 1, 1, 1, 1, 1),
    FORM(PLANE_FACE, "the same, normals reconstructed", 1, 1, 1, 1, 1),
    FORM(WALL_RMS, "wall: rms", 1, 1, 1, 1, 1),
    FORM(WALL_MAX, "wall: largest", 1, 1, 1, 1, 1),
    FORM(ROOM_RMS, "room: rms", 1, 1, 1, 1, 1),
    FORM(ROOM_MAX, "room: largest", 1, 1, 1, 1, 1),
    FORM(GULLY_RMS, "gully: rms", 1, 1, 1, 1, 1),
    FORM(GULLY_MAX, "gully: largest", 1, 1, 1, 1, 1),
    FORM(BALL_RMS, "ball: rms", 1, 1, 1, 1, 1),
    FORM(BALL_MAX, "ball: largest", 1, 1, 1, 1, 1),
    FORM(STEP_RMS, "step: rms", 1, 1, 1, 1, 1),
    FORM(STEP_MAX, "step: largest", 1, 1, 1, 1, 1),
    FORM(COURT_RMS, "court: rms", 1, 1, 1, 1, 1),
    FORM(COURT_MAX, "court: largest", 1, 1, 1, 1, 1),
    FORM(EDGE_MEAN, "step, where the truth is open: mean darkening", 1, 1, 1, 1, 1),
    FORM(EDGE_MAX, "the same, outer edges included: largest", 1, 1, 1, 1, 1),
    FORM(HALO_MEAN, "halo on the far wall: mean darkening", 1, 1, 1, 1, 1),
    FORM(HALO_MAX, "halo on the far wall: largest", 1, 1, 1, 1, 1),
    FORM(SKY_TOUCHED, "sky pixels that are not exactly 1", 0, 0, 0, 0, 0),
    FORM(SKY_BALL, "a ball, and a floor, before the sky: darkening", 1, 1, 1, 1, 1),
#undef FORM
#define SAME(ID, WHAT, LIMIT, ...) [ROW_##ID] = {SECTION_SAME, WHAT, LIMIT, BOUNDS(__VA_ARGS__)}
    SAME(RESOLUTION, "twice the resolution, then means of 2×2", NULL, 1, 1, 1, 1, 1),
    SAME(LENS, "a lens of 34° instead of 52°", NULL, 1, 1, 1, 1, 1),
    SAME(SCALE_SMALL, "scene and radius ×0.001", NULL, 1, 1, 1, 1, 1),
    SAME(SCALE_LARGE, "scene and radius ×1000", NULL, 1, 1, 1, 1, 1),
    SAME(SCALE_EXACT, "scene and radius ×1024: the same bits", NULL, 0, 0, 0, 0, 0),
    SAME(MOVE_ALONG, "camera a fifth nearer", NULL, 1, 1, 1, 1, 1),
    SAME(MOVE_ACROSS, "camera 0.25 m to the side", NULL, 1, 1, 1, 1, 1),
    SAME(DEPTH_GL, "depth buffer: GL, float", NULL, 1, 1, 1, 1, 1),
    SAME(DEPTH_D3D, "depth buffer: D3D and Vulkan, float", NULL, 1, 1, 1, 1, 1),
    SAME(DEPTH_REVERSED, "depth buffer: reversed, float", NULL, 1, 1, 1, 1, 1),
    SAME(DEPTH_INFINITE, "depth buffer: reversed, infinite far plane, float", NULL, 1, 1, 1, 1, 1),
    SAME(DEPTH_LOGARITHMIC, "depth buffer: logarithmic, float", NULL, 1, 1, 1, 1, 1),
    SAME(DEPTH_24, "depth buffer: D3D, 24 bits, near plane 0.1 m", NULL, 1, 1, 1, 1, 1),
    SAME(DEPTH_16, "depth buffer: D3D, 16 bits, near plane 0.1 m", NULL, 1, 1, 1, 1, 1),
    SAME(PARALLEL_FAR, "parallel rays: camera at 2048 m instead of 4 m", NULL, 1, 1, 1, 1, 1),
    SAME(PARALLEL_SCALE, "parallel rays: scene and radius ÷1024: the same bits", NULL, 1, 1, 1, 1,
         1),
    SAME(LONG_LENS, "parallel rays from 4 m against a lens of 0.07° at 2048 m", NULL, 1, 1, 1, 1,
         1),
    SAME(VIEWPORT, "a viewport with guard band against the whole frame", NULL, 1, 1, 1, 1, 1),
    SAME(FACE_NORMALS, "normals reconstructed instead of given", NULL, 1, 1, 1, 1, 1),
    SAME(SNORM8, "normals as snorm8 instead of float", NULL, 1, 1, 1, 1, 1),
    SAME(UNORM8, "normals as unorm8", NULL, 1, 1, 1, 1, 1),
    SAME(OCT16, "normals as oct16", NULL, 1, 1, 1, 1, 1),
    SAME(OCT8, "normals as oct8", NULL, 1, 1, 1, 1, 1),
    SAME(BORDER_BARE, "rms error at the border without a guard band", NULL, 1, 1, 1, 1, 1),
    SAME(BORDER_GUARDED, "the same with one of 24 pixels", NULL, 1, 1, 1, 1, 1),
    SAME(MIRROR, "mirrored left to right", NULL, 1, 1, 1, 1, 1),
#undef SAME
#define SAMPLES(ID, WHAT, ...) [ROW_##ID] = {SECTION_SAMPLES, WHAT, NULL, BOUNDS(__VA_ARGS__)}
    SAMPLES(FIRST_4, "apart, 4 samples, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_4, "apart, 4 samples, `cross`", 1, 1, 1, 1, 1),
    SAMPLES(BLUR_4, "apart, 4 samples, `blur`", 1, 1, 1, 1, 1),
    SAMPLES(FIRST_8, "apart, 8 samples, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_8, "apart, 8 samples, `cross`", 1, 1, 1, 1, 1),
    SAMPLES(BLUR_8, "apart, 8 samples, `blur`", 1, 1, 1, 1, 1),
    SAMPLES(FIRST_TRUTH, "truth, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_TRUTH, "truth, `cross`", 1, 1, 1, 1, 1),
    SAMPLES(BLUR_TRUTH, "truth, `blur`", 1, 1, 1, 1, 1),
#undef SAMPLES
#define NOISE(ID, WHAT, ...) [ROW_##ID] = {SECTION_NOISE, WHAT, NULL, BOUNDS(__VA_ARGS__)}
    NOISE(BLEED_MEAN, "smear: mean of the worse side", 1, 1, 1, 1, 1),
    NOISE(BLEED_RMS, "smear: rms", 1, 1, 1, 1, 1),
    NOISE(SEED_MEAN, "another seed: difference of the means", 1, 1, 1, 1, 1),
    NOISE(SEED_NOISE, "another seed: mean absolute difference", 1, 1, 1, 1, 1),
    NOISE(PATTERN_RAW, "pattern without a filter", 1, 1, 1, 1, 1),
    NOISE(PATTERN, "pattern, filtered", 1, 1, 1, 1, 1),
    NOISE(BANDS, "bands", 1, 1, 1, 1, 1),
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
        CHECK_MSG(guarded < bare, "%s at the border: %.4f with a guard band, %.4f without",
                  cranny_method_name((enum cranny_method)m), guarded, bare);
        const double raw = rows[ROW_PATTERN_RAW].measured[m];
        const double filtered = rows[ROW_PATTERN].measured[m];
        CHECK_MSG(filtered < 0.2 * raw,
                  "%s: the tile's pattern is %.5f after the filter, %.5f "
                  "before",
                  cranny_method_name((enum cranny_method)m), filtered, raw);
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
