/* The parameters of the methods: each row stands once; a method's table picks its rows and gives
 * their defaults, and a preset is a list of the rows that it changes. */
#include "base/rows.h"
#include "screen/kernels.h"

static const char *const falloff_names[] = {"none", "quadratic", "linear", "smooth", NULL};
static const char *const kernel_names[] = {"screen", "world", NULL};
static const char *const rotation_names[] = {"matrix", "mirror", NULL};
static const char *const resolution_names[] = {"full", "half", NULL};
static const char *const noise_names[] = {"tile", "hash", "none", NULL};
static const char *const anchor_names[] = {"screen", "surface", NULL};
static const char *const border_names[] = {"clamp", "ignore", NULL};
static const char *const normals_names[] = {"given", "face", NULL};
static const char *const filter_names[] = {"none", "box", "bilateral", "bloom", NULL};
static const char *const resolve_names[] = {"first", "cross", "blur", NULL};
static const char *const isa_names[] = {"auto", "portable", "avx2", "avx512", NULL};

#define ROW_STRUCT struct cranny_screen_params

/* Rows of several methods, with the default of the one that lists them. */
#define RADIUS REAL(radius_world, "m", 1e-9, 1e9, 0.5, "where an occluder stops counting")
#define SCALE(V)                                                                                   \
    FITTED(radius_scale, "", 0.01, 10, V, 0.1, "the method's own reach as a share of radius_world")
#define INTENSITY(V) FITTED(intensity, "", 0, 100, V, 0.2, "factor on the occlusion")
#define CONTRAST(V) FITTED(contrast, "", 0.05, 20, V, 0.2, "exponent on the visibility")
#define BIAS(V)                                                                                    \
    FITTED(bias, "heights", 0, 1, V, 0.0002,                                                       \
           "height over the tangent plane under which nothing occludes, as a share of what the "   \
           "picture's height spans at that depth")
#define SAMPLES(HIGH, V) WHOLE(samples, "samples", 1, HIGH, V, "samples a pixel")
#define DIRECTIONS(HIGH, V) WHOLE(directions, "directions", 1, HIGH, V, "directions around a pixel")
#define STEPS(V) WHOLE(steps, "steps", 1, 256, V, "samples along a direction or ray")
#define FALLOFF(V)                                                                                 \
    CHOICE(falloff, falloff_names, V,                                                              \
           "how occlusion falls with distance: none up to the radius, 1-(d/r)^2, 1-d/r, or "       \
           "(1-(d/r)^2)^2")
#define COSINE(V) SWITCH(cosine, V, "weigh directions by the cosine, as ambient light does")
#define SPREAD(V) SWITCH(spread, V, "put more samples near the pixel than far from it")
#define THICKNESS(V)                                                                               \
    FITTED(thickness, "radii", 1e-3, 1e6, V, 0.1,                                                  \
           "how thick what a depth buffer shows is taken to be")
#define KERNEL(V)                                                                                  \
    CHOICE(kernel, kernel_names, V, "the kernel's size is a share of the screen, or metres")
#define LIMIT(V)                                                                                   \
    REAL(kernel_limit, "heights", 1e-3, 10, V,                                                     \
         "largest projected radius, as a share of the picture's height")
#define COMMON_NOISE(V)                                                                            \
    CHOICE(noise, noise_names, V,                                                                  \
           "how pixels differ: a 4x4 tile that the filter takes out, a hash, or not"),             \
        CHOICE(anchor, anchor_names, CRANNY_ANCHOR_SCREEN,                                         \
               "whether noise stays on the screen or on surfaces as the camera moves (needs "      \
               "world_from_view)"),                                                                \
        WHOLE(seed, "", 0, 2147483647, 0, "another seed gives other noise")
#define COMMON_INPUT(BORDER, NORMALS)                                                              \
    CHOICE(border, border_names, BORDER,                                                           \
           "samples beyond the frame read its edge, or do not count"),                             \
        CHOICE(normals, normals_names, NORMALS,                                                    \
               "use the normals given, or face normals from depth")
#define COMMON_OUTPUT(RESOLUTION, FILTER, REACH)                                                   \
    CHOICE(resolution, resolution_names, RESOLUTION,                                               \
           "estimate every pixel, or every other one each way and upsample within surfaces"),      \
        CHOICE(filter, filter_names, FILTER, "what takes the noise out"),                          \
        WHOLE(filter_radius, "pixels", 1, FILTER_RADIUS_MAX, REACH,                                \
              "reach of the bilateral filter: 6 makes 13 taps each way"),                          \
        REAL(filter_depth, "radii", 1e-6, 1e3, 0.05,                                               \
             "distance from each other's plane at which surfaces are apart for the filters"),      \
        REAL(filter_normal, "", -1, 0.999, 0.6,                                                    \
             "cosine of the angle at which surfaces are apart for the filters"),                   \
        CHOICE(resolve, resolve_names, CRANNY_RESOLVE_CROSS,                                       \
               "multisampled pixels at edges: the first sample's value, five pixels in a cross, "  \
               "or the filter's window, for each sample"),                                         \
        REAL(fade_begin, "m", 0, 1e12, 1e12, "depth from which occlusion fades"),                  \
        REAL(fade_end, "m", 0, 1e12, 1e12, "depth at which it is gone"),                           \
        CHOICE(isa, isa_names, CRANNY_ISA_AUTO,                                                    \
               "instruction set of the kernels; same result, bit for bit"),                        \
        WHOLE(threads, "threads", 0, 1024, 0, "threads to use, 0 for all cores; same result")

static const struct cranny_param ssao_rows[] = {
    RADIUS,
    SCALE(0.77),
    INTENSITY(0.69),
    CONTRAST(3.35),
    BIAS(0.0002),
    SAMPLES(64, 16),
    KERNEL(CRANNY_KERNEL_WORLD),
    REAL(kernel_scale, "", 1e-4, 1, 0.01,
         "screen kernel: length of the first offset, as a share of the screen"),
    REAL(kernel_growth, "", 0, 10, 2.4,
         "screen kernel: each offset is 1 + growth / samples times as long as the last"),
    LIMIT(1),
    CHOICE(rotation, rotation_names, CRANNY_ROTATION_MATRIX,
           "turn the kernel by a matrix, or mirror it"),
    COSINE(1),
    SPREAD(1),
    REAL(range_default, "", 0, 1, 0.5,
         "screen kernel: what a sample counts whose surface is far in front"),
    THICKNESS(0.4),
    SWITCH(curve, 0, "screen kernel: the published amplification a^2 + a"),
    COMMON_NOISE(CRANNY_NOISE_TILE),
    COMMON_INPUT(CRANNY_BORDER_IGNORE, CRANNY_NORMALS_GIVEN),
    COMMON_OUTPUT(CRANNY_RESOLUTION_FULL, CRANNY_FILTER_BILATERAL, 3),
};

static const struct cranny_param hbao_rows[] = {
    RADIUS,
    SCALE(1.15),
    INTENSITY(0.9),
    CONTRAST(1.67),
    DIRECTIONS(64, 4),
    STEPS(4),
    FITTED(angle_bias, "degrees", 0, 89, 2, 2, "angle over the tangent plane that does not count"),
    FALLOFF(CRANNY_FALLOFF_LINEAR),
    COSINE(1),
    SPREAD(1),
    LIMIT(1),
    COMMON_NOISE(CRANNY_NOISE_TILE),
    COMMON_INPUT(CRANNY_BORDER_IGNORE, CRANNY_NORMALS_GIVEN),
    COMMON_OUTPUT(CRANNY_RESOLUTION_FULL, CRANNY_FILTER_BILATERAL, 3),
};

static const struct cranny_param crease_rows[] = {
    RADIUS,
    SCALE(1.2),
    INTENSITY(0.5),
    CONTRAST(1.96),
    BIAS(0.0002),
    KERNEL(CRANNY_KERNEL_WORLD),
    LIMIT(1),
    FITTED(minimum_crease, "", 0, 0.99, 0.2, 0.1,
           "cosine towards a neighbour that does not count yet"),
    REAL(crease_scale, "", 0, 100, 1, "factor on the cosine (the article's Bias)"),
    REAL(averager, "", 0.01, 1000, 4.5, "what the sum of all 24 neighbours is divided by"),
    SWITCH(facing, 0, "count only neighbours that face the pixel, too"),
    FALLOFF(CRANNY_FALLOFF_LINEAR),
    REAL(bloom_wide, "heights", 0.001, 0.2, 0.03, "deviation of the wide bloom"),
    REAL(bloom_near, "heights", 0.001, 0.2, 0.008, "deviation of the near bloom"),
    REAL(bloom_wide_gain, "", 0, 100, 0.7, "factor on the wide bloom's occlusion"),
    REAL(bloom_near_gain, "", 0, 100, 8, "factor on the near bloom's occlusion"),
    REAL(bloom_blend, "", 0, 1, 0.5, "share of the near bloom"),
    SWITCH(edge_bloom, 1, "bloom within edges only"),
    COMMON_NOISE(CRANNY_NOISE_TILE),
    COMMON_INPUT(CRANNY_BORDER_IGNORE, CRANNY_NORMALS_GIVEN),
    COMMON_OUTPUT(CRANNY_RESOLUTION_FULL, CRANNY_FILTER_BILATERAL, 3),
};

static const struct cranny_param alchemy_rows[] = {
    RADIUS,
    SCALE(1.8),
    INTENSITY(0.5),
    CONTRAST(1.55),
    BIAS(0.0002),
    SAMPLES(256, 12),
    WHOLE(bands, "bands", 1, 8, 3, "steps in which far surfaces get fewer samples"),
    REAL(band_begin, "pixels", 1, 1e4, 8,
         "projected radius under which the second band begins; each next at half of it"),
    FALLOFF(CRANNY_FALLOFF_LINEAR),
    SPREAD(1),
    REAL(epsilon, "", 1e-8, 1, 0.0004,
         "softening of the distance, as a share of the radius' square"),
    LIMIT(1),
    COMMON_NOISE(CRANNY_NOISE_TILE),
    COMMON_INPUT(CRANNY_BORDER_IGNORE, CRANNY_NORMALS_GIVEN),
    COMMON_OUTPUT(CRANNY_RESOLUTION_FULL, CRANNY_FILTER_BILATERAL, 3),
};

static const struct cranny_param raymarch_rows[] = {
    RADIUS,
    SCALE(1),
    INTENSITY(1),
    CONTRAST(1),
    BIAS(0.0002),
    DIRECTIONS(64, 16),
    WHOLE(elevations, "rays", 1, 64, 4,
          "rays of each direction; directions times elevations is at most 256"),
    STEPS(24),
    FALLOFF(CRANNY_FALLOFF_LINEAR),
    COSINE(1),
    SPREAD(1),
    THICKNESS(1),
    LIMIT(1),
    COMMON_NOISE(CRANNY_NOISE_TILE),
    COMMON_INPUT(CRANNY_BORDER_IGNORE, CRANNY_NORMALS_GIVEN),
    COMMON_OUTPUT(CRANNY_RESOLUTION_FULL, CRANNY_FILTER_BILATERAL, 3),
};

static const struct cranny_param_table tables[CRANNY_METHOD_COUNT] = {
    [CRANNY_SSAO] = {"ssao", ssao_rows, COUNT_OF(ssao_rows)},
    [CRANNY_HBAO] = {"hbao", hbao_rows, COUNT_OF(hbao_rows)},
    [CRANNY_CREASE] = {"crease", crease_rows, COUNT_OF(crease_rows)},
    [CRANNY_ALCHEMY] = {"alchemy", alchemy_rows, COUNT_OF(alchemy_rows)},
    [CRANNY_RAYMARCH] = {"raymarch", raymarch_rows, COUNT_OF(raymarch_rows)},
};

/* What the papers publish, as differences from `calibrated`. */
struct setting {
    const char *name, *value;
};

static const struct setting ssao_paper[] = {
    {"kernel", "screen"}, {"curve", "true"}, {"cosine", "false"},    {"border", "clamp"},
    {"samples", "16"},    {"filter", "box"}, {"rotation", "matrix"}, {"intensity", "1"},
    {"contrast", "1"},    {"bias", "0"},     {"radius_scale", "1"},  {"thickness", "0.35"},
    {NULL, NULL},
};

static const struct setting hbao_paper[] = {
    {"cosine", "false"},    {"falloff", "quadratic"},
    {"border", "clamp"},    {"normals", "face"},
    {"directions", "4"},    {"steps", "4"},
    {"intensity", "1"},     {"contrast", "1"},
    {"angle_bias", "10"},   {"resolution", "half"},
    {"filter_radius", "4"}, {"spread", "false"},
    {"radius_scale", "1"},  {NULL, NULL},
};

static const struct setting crease_paper[] = {
    {"kernel", "screen"},     {"minimum_crease", "0.3"},
    {"crease_scale", "0.25"}, {"averager", "10"},
    {"falloff", "linear"},    {"border", "clamp"},
    {"noise", "none"},        {"filter", "bloom"},
    {"edge_bloom", "false"},  {"intensity", "1"},
    {"contrast", "1"},        {"bias", "0"},
    {"radius_scale", "1"},    {NULL, NULL},
};

static const struct setting alchemy_paper[] = {
    {"falloff", "none"},    {"spread", "false"},   {"noise", "hash"},     {"border", "clamp"},
    {"bias", "8.7e-5"},     {"intensity", "1"},    {"contrast", "1"},     {"samples", "12"},
    {"filter_radius", "6"}, {"epsilon", "0.0004"}, {"radius_scale", "1"}, {NULL, NULL},
};

static const struct setting raymarch_paper[] = {
    {"cosine", "false"},   {"falloff", "quadratic"}, {"border", "clamp"}, {"normals", "face"},
    {"intensity", "1"},    {"contrast", "1"},        {"spread", "false"}, {"bias", "0.0002"},
    {"radius_scale", "1"}, {"thickness", "1"},       {NULL, NULL},
};

static const struct setting *const papers[CRANNY_METHOD_COUNT] = {
    [CRANNY_SSAO] = ssao_paper,         [CRANNY_HBAO] = hbao_paper,
    [CRANNY_CREASE] = crease_paper,     [CRANNY_ALCHEMY] = alchemy_paper,
    [CRANNY_RAYMARCH] = raymarch_paper,
};

const char *cranny_method_name(enum cranny_method method)
{
    return (unsigned)method < CRANNY_METHOD_COUNT ? tables[method].name : "unknown";
}

bool cranny_method_find(const char *name, enum cranny_method *method)
{
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        if (strcmp(tables[m].name, name) == 0) {
            *method = (enum cranny_method)m;
            return true;
        }
    }
    return false;
}

const struct cranny_param_table *cranny_screen_param_table(enum cranny_method method)
{
    return (unsigned)method < CRANNY_METHOD_COUNT ? &tables[method] : NULL;
}

const char *const *cranny_screen_preset_names(enum cranny_method method)
{
    static const char *const names[] = {"calibrated", "paper", NULL};
    (void)method;
    return names;
}

/* Not a matter of looks: presets leave these alone. */
static bool is_environment(const char *name)
{
    return strcmp(name, "radius_world") == 0 || strcmp(name, "isa") == 0 ||
           strcmp(name, "threads") == 0 || strcmp(name, "seed") == 0;
}

enum cranny_status cranny_screen_params_apply(struct cranny_screen_params *params,
                                              const char *preset, struct cranny_error *why)
{
    const bool paper = strcmp(preset, "paper") == 0;
    if (!paper && strcmp(preset, "calibrated") != 0)
        return fail(why, CRANNY_USAGE, "preset '%s': there is calibrated and paper", preset);
    if ((unsigned)params->method >= CRANNY_METHOD_COUNT)
        return fail(why, CRANNY_USAGE, "method %d: there are 0 to %d", params->method,
                    CRANNY_METHOD_COUNT - 1);
    const struct cranny_param_table *table = &tables[params->method];
    const struct cranny_screen_params kept = *params;
    cranny_params_defaults(table, params);
    for (const struct setting *s = papers[params->method]; paper && s->name; s++) {
        enum cranny_status status = cranny_params_set(table, params, s->name, s->value, why);
        if (status != CRANNY_OK)
            return status;
    }
    for (size_t i = 0; i < table->row_count; i++) {
        const struct cranny_param *row = &table->rows[i];
        if (is_environment(row->name))
            memcpy((char *)params + row->offset, (const char *)&kept + row->offset, sizeof(int));
    }
    return CRANNY_OK;
}

struct cranny_screen_params cranny_screen_params_preset(enum cranny_method method,
                                                        const char *preset)
{
    struct cranny_screen_params params = {.method = (int)method};
    if ((unsigned)method >= CRANNY_METHOD_COUNT)
        return params;
    cranny_params_defaults(&tables[method], &params);
    if (preset)
        cranny_screen_params_apply(&params, preset, NULL);
    return params;
}
