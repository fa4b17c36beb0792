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
    FORM(WALL_RMS, "wall: rms", 0.0433, 0.0355, 0.0617, 0.0589, 0.0239),
    FORM(WALL_MAX, "wall: largest", 0.311, 0.2884, 0.4693, 0.4595, 0.2635),
    FORM(ROOM_RMS, "room: rms", 0.0481, 0.0359, 0.079, 0.0602, 0.025),
    FORM(ROOM_MAX, "room: largest", 0.4247, 0.2896, 0.5399, 0.4871, 0.2273),
    FORM(GULLY_RMS, "gully: rms", 0.0733, 0.0604, 0.1187, 0.1175, 0.0275),
    FORM(GULLY_MAX, "gully: largest", 0.6695, 0.5821, 0.8353, 0.8944, 0.3209),
    FORM(BALL_RMS, "ball: rms", 0.0676, 0.0677, 0.0919, 0.0976, 0.0381),
    FORM(BALL_MAX, "ball: largest", 0.8486, 0.8474, 0.86, 0.93, 0.6055),
    FORM(STEP_RMS, "step: rms", 0.0388, 0.0339, 0.0601, 0.0548, 0.0196),
    FORM(STEP_MAX, "step: largest", 0.5105, 0.4927, 0.6275, 0.6427, 0.2935),
    FORM(COURT_RMS, "court: rms", 0.0726, 0.0697, 0.1108, 0.1165, 0.0427),
    FORM(COURT_MAX, "court: largest", 0.7894, 0.7636, 0.8, 0.94, 0.4609),
    FORM(EDGE_MEAN, "step, where the truth is open: mean darkening", 0.0005, 0.0005, 0.0005, 0.0005,
         0.0005),
    FORM(EDGE_MAX, "the same, outer edges included: largest", 0.0112, 0.0077, 0.0031, 0.0044,
         0.0118),
    FORM(HALO_MEAN, "halo on the far wall: mean darkening", 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    FORM(HALO_MAX, "halo on the far wall: largest", 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    FORM(SKY_TOUCHED, "sky pixels that are not exactly 1", 0, 0, 0, 0, 0),
    FORM(SKY_BALL, "a ball, and a floor, before the sky: darkening", 0.01, 0.01, 0.01, 0.01, 0.01),
#undef FORM
#define SAME(ID, WHAT, LIMIT, ...) [ROW_##ID] = {SECTION_SAME, WHAT, LIMIT, BOUNDS(__VA_ARGS__)}
    SAME(RESOLUTION, "twice the resolution, then means of 2×2", NULL, 0.0068, 0.0064, 0.0052,
         0.0055, 0.0064),
    SAME(LENS, "a lens of 34° instead of 52°", NULL, 0.0142, 0.012, 0.0096, 0.0103, 0.0114),
    SAME(SCALE_SMALL, "scene and radius ×0.001", NULL, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    SAME(SCALE_LARGE, "scene and radius ×1000", NULL, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    SAME(SCALE_EXACT, "scene and radius ×1024: the same bits", NULL, 0, 0, 0, 0, 0),
    SAME(MOVE_ALONG, "camera a fifth nearer", NULL, 0.0088, 0.0074, 0.0058, 0.0065, 0.0068),
    SAME(MOVE_ACROSS, "camera 0.25 m to the side", NULL, 0.0073, 0.0056, 0.0049, 0.0051, 0.0051),
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
    SAME(DEPTH_16, "depth buffer: D3D, 16 bits, near plane 0.1 m", NULL, 0.0014, 0.0005, 0.0005,
         0.0022, 0.0068),
    SAME(PARALLEL_FAR, "parallel rays: camera at 2048 m instead of 4 m", NULL, 0.0005, 0.0005,
         0.0005, 0.0005, 0.0005),
    SAME(PARALLEL_SCALE, "parallel rays: scene and radius ÷1024: the same bits", NULL, 0, 0, 0, 0,
         0),
    SAME(LONG_LENS, "parallel rays from 4 m against a lens of 0.07° at 2048 m", NULL, 0.0007,
         0.0007, 0.0007, 0.0005, 0.0007),
    SAME(VIEWPORT, "a viewport with guard band against the whole frame", NULL, 0.0005, 0.0005,
         0.0007, 0.0007, 0.0005),
    SAME(FACE_NORMALS, "normals reconstructed instead of given", NULL, 0.0008, 0.0008, 0.0007,
         0.0007, 0.0008),
    SAME(SNORM8, "normals as snorm8 instead of float", NULL, 0.0007, 0.0007, 0.0005, 0.0005,
         0.0007),
    SAME(UNORM8, "normals as unorm8", NULL, 0.0011, 0.0007, 0.0005, 0.0008, 0.0008),
    SAME(OCT16, "normals as oct16", NULL, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005),
    SAME(OCT8, "normals as oct8", NULL, 0.001, 0.0007, 0.0007, 0.001, 0.0008),
    SAME(BORDER_BARE, "rms error at the border without a guard band", NULL, 0.0301, 0.0262, 0.0439,
         0.043, 0.0217),
    SAME(BORDER_GUARDED, "the same with one of 24 pixels", NULL, 0.0299, 0.0229, 0.0437, 0.0431,
         0.0184),
    SAME(MIRROR, "mirrored left to right", NULL, 0.006, 0.0025, 0.0019, 0.0023, 0.001),
#undef SAME
#define SAMPLES(ID, WHAT, ...) [ROW_##ID] = {SECTION_SAMPLES, WHAT, NULL, BOUNDS(__VA_ARGS__)}
    SAMPLES(FIRST_4, "apart, 4 samples, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_4, "apart, 4 samples, `cross`", 0.0061, 0.0065, 0.0032, 0.0054, 0.0067),
    SAMPLES(BLUR_4, "apart, 4 samples, `blur`", 0.0049, 0.0046, 0.0034, 0.0046, 0.004),
    SAMPLES(FIRST_8, "apart, 8 samples, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_8, "apart, 8 samples, `cross`", 0.0037, 0.0041, 0.0047, 0.0037, 0.0041),
    SAMPLES(BLUR_8, "apart, 8 samples, `blur`", 0.0038, 0.0034, 0.0054, 0.0035, 0.0044),
    SAMPLES(FIRST_TRUTH, "truth, `first`", 1, 1, 1, 1, 1),
    SAMPLES(CROSS_TRUTH, "truth, `cross`", 0.0734, 0.0676, 0.0988, 0.0965, 0.048),
    SAMPLES(BLUR_TRUTH, "truth, `blur`", 0.0741, 0.0683, 0.0998, 0.0964, 0.0485),
#undef SAMPLES
#define NOISE(ID, WHAT, ...) [ROW_##ID] = {SECTION_NOISE, WHAT, NULL, BOUNDS(__VA_ARGS__)}
    NOISE(BLEED_MEAN, "smear: mean of the worse side", 0.001, 0.0008, 0.0011, 0.0017, 0.0011),
    NOISE(BLEED_RMS, "smear: rms", 0.0175, 0.0178, 0.0155, 0.0118, 0.0244),
    NOISE(SEED_MEAN, "another seed: difference of the means", 0.0011, 0.0008, 0.0005, 0.0008,
          0.0005),
    NOISE(SEED_NOISE, "another seed: mean absolute difference", 0.0051, 0.0023, 0.0022, 0.0034,
          0.001),
    NOISE(PATTERN_RAW, "pattern without a filter", 0.0074, 0.0028, 0.012, 0.0019, 0.001),
    NOISE(PATTERN, "pattern, filtered", 0.001, 0.0011, 0.0011, 0.001, 0.0008),
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
