/* Converters of the G-buffer: depth layouts, projection matrices, normals, and what is refused. */
#include "check.h"

#include <cranny/gbuffer.h>
#include <stdint.h>

static uint16_t to_half(float v)
{
    /* round to nearest by search: slow and plainly right */
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    const uint16_t sign = (uint16_t)(bits >> 16 & 0x8000);
    const double a = fabs((double)v);
    int e = a > 0 ? (int)floor(log2(a)) : -15;
    if (a >= 65520)
        return sign | 0x7c00;
    if (e < -14)
        return sign | (uint16_t)lrint(a * 0x1p24);
    return sign | (uint16_t)(((e + 15) << 10) + (int)lrint((a / exp2(e) - 1) * 1024));
}

/* Quantise `v` as `format` would and read it back through the library. */
static float round_trip(const struct cranny_depth_layout *layout, float v)
{
    uint32_t u32 = 0;
    uint16_t u16 = 0;
    const void *input = &u32;
    float depth = -1;
    switch (layout->format) {
    case CRANNY_DEPTH_FLOAT32:
        memcpy(&u32, &v, sizeof v);
        break;
    case CRANNY_DEPTH_FLOAT16:
        u16 = to_half(v);
        input = &u16;
        break;
    case CRANNY_DEPTH_UNORM16:
        u16 = (uint16_t)lrint((double)v * 65535);
        input = &u16;
        break;
    case CRANNY_DEPTH_UNORM24:
        u32 = (uint32_t)lrint((double)v * 16777215) | 0xab000000;
        break;
    case CRANNY_DEPTH_UNORM24_HIGH:
        u32 = (uint32_t)lrint((double)v * 16777215) << 8 | 0xcd;
        break;
    case CRANNY_DEPTH_UNORM32:
        u32 = (uint32_t)llrint((double)v * 4294967295.0);
        break;
    }
    struct cranny_error why = {0};
    CHECK_OK(cranny_depth_linearize(layout, 1, 1, input, 0, &depth, 0, &why), why);
    return depth;
}

/* Half a step of the stored value at v, rounding to float included. */
static double half_step(const struct cranny_depth_layout *layout, double v)
{
    const double rounding = fabs(v) * 0x1p-24 + 0x1p-60;
    switch (layout->format) {
    case CRANNY_DEPTH_FLOAT32:
        return rounding;
    case CRANNY_DEPTH_FLOAT16:
        return fmax(fabs(v) * 0x1p-11, 0x1p-25) + rounding;
    case CRANNY_DEPTH_UNORM16:
        return 0.5 / 65535 + rounding;
    case CRANNY_DEPTH_UNORM24:
    case CRANNY_DEPTH_UNORM24_HIGH:
        return 0.5 / 16777215 + rounding;
    case CRANNY_DEPTH_UNORM32:
        return 0.5 / 4294967295.0 + rounding;
    }
    return 0;
}

/* How far depth moves per unit of the stored value: the textbook derivatives. */
static double slope(const struct cranny_depth_layout *l, double d)
{
    const double n = l->near_plane, f = l->far_plane, c = l->log_constant;
    const double range = l->gl_range && l->format <= CRANNY_DEPTH_FLOAT16 ? 0.5 : 1;
    switch (l->kind) {
    case CRANNY_DEPTH_DEVICE:
        return range * d * d * (isinf(f) ? 1 / n : (f - n) / (n * f));
    case CRANNY_DEPTH_NORMALIZED:
        return range * (f - n);
    case CRANNY_DEPTH_LOGARITHMIC:
        return range * (d + 1 / c) * log(c * f + 1);
    case CRANNY_DEPTH_LINEAR:
    case CRANNY_DEPTH_VIEW_Z:
        break;
    }
    return 1;
}

static void check_layout(const struct cranny_depth_layout *l)
{
    const bool metric = l->kind == CRANNY_DEPTH_LINEAR || l->kind == CRANNY_DEPTH_VIEW_Z;
    const bool small = metric && l->format >= CRANNY_DEPTH_UNORM16; /* such hold 0 … 1 m */
    for (double d = 0.11; d < (small ? 0.99 : 90); d *= 1.37) {
        const float v = cranny_depth_encode(l, (float)d);
        const double error = half_step(l, v) * slope(l, d);
        const double actual = round_trip(l, v);
        /* the slope grows with depth by up to its own step; beyond it is sky */
        if (error < 0.05 * d)
            CHECK_MSG(fabs(actual - d) <= 1.2 * error + 2e-7 * d,
                      "kind %d format %d gl %d reversed %d far %g: depth %g came back as %g, off "
                      "by more than %g",
                      l->kind, l->format, l->gl_range, l->reversed, (double)l->far_plane, d, actual,
                      error);
    }
    CHECK_MSG(isinf(round_trip(l, metric && small ? 0 : cranny_depth_encode(l, INFINITY))),
              "kind %d format %d gl %d reversed %d: sky is lost", l->kind, l->format, l->gl_range,
              l->reversed);
}

static void test_layouts(void)
{
    for (int kind = CRANNY_DEPTH_LINEAR; kind <= CRANNY_DEPTH_LOGARITHMIC; kind++)
        for (int format = CRANNY_DEPTH_FLOAT32; format <= CRANNY_DEPTH_UNORM32; format++)
            for (int flags = 0; flags < 8; flags++) {
                const struct cranny_depth_layout layout = {
                    .kind = (enum cranny_depth_kind)kind,
                    .format = (enum cranny_depth_format)format,
                    .gl_range = flags & 1,
                    .reversed = flags & 2,
                    .near_plane = 0.1f,
                    .far_plane = flags & 4 && kind == CRANNY_DEPTH_DEVICE ? INFINITY : 100,
                    .log_constant = 1,
                };
                if (kind == CRANNY_DEPTH_VIEW_Z && format >= CRANNY_DEPTH_UNORM16)
                    continue; /* holds no negative values */
                check_layout(&layout);
            }
}

static void expect_value(const struct cranny_depth_layout *layout, float depth, double value)
{
    CHECK_NEAR((double)cranny_depth_encode(layout, depth), value, 1e-6);
}

/* The ends of every range, from the definitions. */
static void test_ends(void)
{
    struct cranny_depth_layout l = {
        .kind = CRANNY_DEPTH_DEVICE, .near_plane = 0.5f, .far_plane = 50};
    expect_value(&l, 0.5f, 0);
    expect_value(&l, 50, 1);
    expect_value(&l, 1, 50 * 0.5 / 49.5);
    l.reversed = true;
    expect_value(&l, 0.5f, 1);
    expect_value(&l, INFINITY, 0);
    l.gl_range = true;
    expect_value(&l, 0.5f, 1);
    expect_value(&l, 50, -1);
    l.reversed = false;
    expect_value(&l, 0.5f, -1);
    expect_value(&l, NAN, 1);
    l = (struct cranny_depth_layout){
        .kind = CRANNY_DEPTH_LOGARITHMIC, .far_plane = 99, .log_constant = 1};
    expect_value(&l, 9, 0.5);
    l = (struct cranny_depth_layout){
        .kind = CRANNY_DEPTH_NORMALIZED, .near_plane = 2, .far_plane = 12};
    expect_value(&l, 7, 0.5);
    l = (struct cranny_depth_layout){.kind = CRANNY_DEPTH_VIEW_Z};
    expect_value(&l, 7, -7);
    CHECK(isinf(round_trip(&l, 3)) && isinf(round_trip(&l, NAN)));
    l = (struct cranny_depth_layout){.kind = CRANNY_DEPTH_LINEAR};
    CHECK(isinf(round_trip(&l, -3)) && isinf(round_trip(&l, 0)) && isinf(round_trip(&l, INFINITY)));
    CHECK_NEAR((double)round_trip(&l, 1e6f), 1e6, 0);
}

/* All 65536 half floats against their definition. */
static void test_halves(void)
{
    const struct cranny_depth_layout l = {.kind = CRANNY_DEPTH_LINEAR,
                                          .format = CRANNY_DEPTH_FLOAT16};
    static uint16_t input[256][256];
    static float depth[256][256];
    struct cranny_error why = {0};
    for (int i = 0; i < 65536; i++)
        input[i / 256][i % 256] = (uint16_t)i;
    CHECK_OK(cranny_depth_linearize(&l, 256, 256, input, 0, depth[0], 0, &why), why);
    int wrong = 0;
    for (int i = 0; i < 65536; i++) {
        const int e = i >> 10 & 31, m = i & 1023;
        const double value = e ? ldexp(1024 + m, e - 25) : ldexp(m, -24);
        const float got = depth[i / 256][i % 256];
        const bool sky = i >= 0x7c00 || i == 0;
        wrong += sky ? !isinf(got) : (double)got != value;
    }
    CHECK_INT(wrong, 0);
}

/* Padded rows, several chunks a row, in place; padding stays as it was. */
static void test_strides(void)
{
    enum { WIDTH = 600, HEIGHT = 70, ROW = 610 };
    struct cranny_depth_layout l = {
        .kind = CRANNY_DEPTH_DEVICE, .near_plane = 0.1f, .far_plane = INFINITY, .reversed = true};
    float *buffer = malloc(sizeof(float) * ROW * HEIGHT);
    struct cranny_error why = {0};
    for (int i = 0; i < ROW * HEIGHT; i++)
        buffer[i] = i % ROW < WIDTH ? cranny_depth_encode(&l, 1 + (float)i * 0.01f) : -7;
    CHECK_OK(cranny_depth_linearize(&l, WIDTH, HEIGHT, buffer, ROW * sizeof(float), buffer,
                                    ROW * sizeof(float), &why),
             why);
    int wrong = 0;
    for (int i = 0; i < ROW * HEIGHT; i++) {
        const float expected = i % ROW < WIDTH ? 1 + (float)i * 0.01f : -7;
        wrong += !(fabsf(buffer[i] - expected) <= 1e-6f * fabsf(expected));
    }
    CHECK_INT(wrong, 0);
    CHECK_INT(
        cranny_depth_linearize(&l, WIDTH, HEIGHT, buffer, ROW * sizeof(float), buffer, 0, &why),
        CRANNY_USAGE);
    CHECK_INT(cranny_depth_linearize(&l, WIDTH, HEIGHT, buffer, 4 * WIDTH - 4, buffer + 1, 0, &why),
              CRANNY_USAGE);
    CHECK_INT(cranny_depth_linearize(&l, 0, HEIGHT, buffer, 0, buffer, 0, &why), CRANNY_USAGE);
    CHECK_INT(cranny_depth_linearize(&l, 1, 1, NULL, 0, buffer, 0, &why), CRANNY_USAGE);
    free(buffer);
}

static void test_planes_refused(void)
{
    const struct cranny_depth_layout bad[] = {
        {.kind = CRANNY_DEPTH_DEVICE, .near_plane = 0, .far_plane = 10},
        {.kind = CRANNY_DEPTH_DEVICE, .near_plane = 10, .far_plane = 1},
        {.kind = CRANNY_DEPTH_DEVICE, .near_plane = NAN, .far_plane = 1},
        {.kind = CRANNY_DEPTH_DEVICE, .near_plane = 1, .far_plane = NAN},
        {.kind = CRANNY_DEPTH_NORMALIZED, .near_plane = 1, .far_plane = INFINITY},
        {.kind = CRANNY_DEPTH_NORMALIZED, .near_plane = 1, .far_plane = 1},
        {.kind = CRANNY_DEPTH_LOGARITHMIC, .log_constant = 0, .far_plane = 10},
        {.kind = CRANNY_DEPTH_LOGARITHMIC, .log_constant = 1, .far_plane = INFINITY},
        {.kind = (enum cranny_depth_kind)9},
        {.format = (enum cranny_depth_format)9},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct cranny_error why = {0};
        float v = 0.5f, d;
        CHECK_INT(cranny_depth_linearize(&bad[i], 1, 1, &v, 0, &d, 0, &why), CRANNY_USAGE);
        CHECK(why.message[0]);
    }
}

/* A matrix as the APIs' handbooks write it, from its own terms. */
struct lens {
    double l, r, b, t; /* at depth 1, or metres */
    double n, f;
    bool parallel, gl, reversed, flip_y, left_handed;
};

static void matrix_of(const struct lens *c, float m[16])
{
    double a, b; /* clip z = a z + b */
    const double low = c->gl ? -1 : 0, n = c->reversed ? c->f : c->n, f = c->reversed ? c->n : c->f;
    memset(m, 0, 16 * sizeof *m);
    if (c->parallel) {
        a = -(1 - low) / (f - n);
        b = low - a * -n;
        m[12] = (float)(-(c->r + c->l) / (c->r - c->l));
        m[13] = (float)(-(c->t + c->b) / (c->t - c->b));
        m[15] = 1;
    } else {
        /* (a z + b) / −z is `low` at z = −n and 1 at z = −f */
        if (isinf(f))
            a = -1, b = -n * (1 - low);
        else if (isinf(n))
            a = -low, b = f * (1 - low);
        else
            b = (low - 1) / (1 / n - 1 / f), a = b / n - low;
        m[8] = (float)((c->r + c->l) / (c->r - c->l));
        m[9] = (float)((c->t + c->b) / (c->t - c->b));
        m[11] = -1;
    }
    m[0] = (float)(2 / (c->r - c->l));
    m[5] = (float)(2 / (c->t - c->b));
    m[10] = (float)a;
    m[14] = (float)b;
    for (int k = 0; k < 4; k++) {
        m[4 * k + 1] *= c->flip_y ? -1 : 1;
        m[8 + k] *= c->left_handed ? -1 : 1;
    }
}

static void check_matrix(const struct lens *c)
{
    float m[16];
    struct cranny_projection p;
    struct cranny_depth_layout l;
    struct cranny_error why = {0};
    matrix_of(c, m);
    CHECK_OK(cranny_projection_from_matrix(m, c->gl, &p, &l, &why), why);
    CHECK_INT(p.kind, c->parallel ? CRANNY_ORTHOGRAPHIC : CRANNY_PERSPECTIVE);
    CHECK_NEAR((double)p.left, c->l, 1e-5);
    CHECK_NEAR((double)p.right, c->r, 1e-5);
    CHECK_NEAR((double)p.bottom, c->b, 1e-5);
    CHECK_NEAR((double)p.top, c->t, 1e-5);
    CHECK_INT(l.kind, c->parallel ? CRANNY_DEPTH_NORMALIZED : CRANNY_DEPTH_DEVICE);
    CHECK_INT(l.reversed, c->reversed);
    CHECK_INT(l.gl_range, c->gl);
    CHECK_NEAR((double)l.near_plane, c->n,
               2e-5 * fabs(c->n) + 1e-5 + (c->parallel ? 2e-7 * c->f : 0));
    if (isinf(c->f))
        CHECK(isinf(l.far_plane));
    else
        CHECK_NEAR((double)l.far_plane, c->f, 5e-3 * c->f);
    /* what the matrix makes of a point is what the layout reads back */
    for (double d = 1; d < 50; d *= 1.7) {
        const double z = c->left_handed ? d : -d;
        const double v = (m[10] * z + m[14]) / (m[11] * z + m[15]);
        /* a float's last digit of `v`, and of the matrix's entries */
        const double tolerance = 3e-7 * slope(&l, d) + 1e-5 * d;
        CHECK_NEAR((double)round_trip(&l, (float)v), d, tolerance);
    }
}

static void test_matrices(void)
{
    const double extents[2][4] = {{-0.8, 0.8, -0.5, 0.5}, {-0.2, 1.1, -0.7, 0.15}};
    const double ranges[3][2] = {{0.1, 100}, {0.25, 2000}, {0.1, INFINITY}};
    for (int bits = 0; bits < 32; bits++)
        for (int e = 0; e < 2; e++)
            for (int r = 0; r < 3; r++) {
                struct lens c = {.l = extents[e][0],
                                 .r = extents[e][1],
                                 .b = extents[e][2],
                                 .t = extents[e][3],
                                 .n = ranges[r][0],
                                 .f = ranges[r][1],
                                 .gl = bits & 1,
                                 .reversed = bits & 2,
                                 .flip_y = bits & 4,
                                 .left_handed = bits & 8,
                                 .parallel = bits & 16};
                if (c.parallel && (c.left_handed || isinf(c.f)))
                    continue; /* a parallel projection has no handedness to tell */
                check_matrix(&c);
            }
    check_matrix(&(struct lens){-3, 5, -2, 9, -40, 60, .parallel = true, .gl = true});
}

static void refuse_matrix(const float m[16], bool gl)
{
    struct cranny_projection p;
    struct cranny_error why = {0};
    CHECK_INT(cranny_projection_from_matrix(m, gl, &p, NULL, &why), CRANNY_USAGE);
    CHECK(why.message[0]);
}

static void test_matrices_refused(void)
{
    float m[16] = {0}, good[16], transposed[16];
    matrix_of(&(struct lens){-1, 1, -1, 1, 0.1, 100, .gl = true}, good);
    for (int i = 0; i < 16; i++)
        transposed[i] = good[4 * (i % 4) + i / 4];
    refuse_matrix(m, false);         /* nothing */
    refuse_matrix(transposed, true); /* row by row */
    m[0] = m[5] = m[10] = m[15] = NAN;
    refuse_matrix(m, false);
    const struct {
        int entry;
        float value;
    } spoilt[] = {{0, 0},    {0, -1}, {5, 0},  {1, 0.5f}, {2, 0.3f},
                  {7, 0.1f}, {12, 1}, {14, 0}, {15, 1}};
    for (size_t i = 0; i < sizeof spoilt / sizeof *spoilt; i++) {
        memcpy(m, good, sizeof m);
        m[spoilt[i].entry] = spoilt[i].value;
        refuse_matrix(m, true);
    }
    /* TAA's jitter is no shear */
    struct cranny_projection p;
    struct cranny_error why = {0};
    good[8] = 0.01f;
    CHECK_OK(cranny_projection_from_matrix(good, true, &p, NULL, &why), why);
}

static void test_projections(void)
{
    const struct cranny_projection p = cranny_perspective(1.57079633f, 1.5f);
    CHECK_NEAR((double)p.top, 1, 1e-6);
    CHECK_NEAR((double)p.left, -1.5, 1e-6);
    const struct cranny_projection o = cranny_orthographic(4, 0.5f);
    CHECK_INT(o.kind, CRANNY_ORTHOGRAPHIC);
    CHECK_NEAR((double)o.right, 2, 1e-6);
    CHECK_NEAR((double)o.bottom, -4, 1e-6);
}

/* Degrees by which a format may turn a normal. */
static const double normal_errors[] = {2e-5, 2e-5, 0.4, 0.4, 0.006, 1.0};
static const size_t normal_sizes[] = {12, 16, 4, 4, 4, 2};

static double degrees_between(const float a[3], const float b[3])
{
    double cross[3], sine = 0, cosine = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        cross[k] = (double)a[i] * b[j] - (double)a[j] * b[i];
        sine += cross[k] * cross[k];
        cosine += (double)a[k] * b[k];
    }
    return atan2(sqrt(sine), cosine) * 57.29577951308232;
}

static void check_normal(enum cranny_normal_format format, const float n[3], double most)
{
    unsigned char stored[17];
    float back[3];
    memset(stored, 0x5a, sizeof stored);
    cranny_normal_encode(format, n, stored);
    CHECK_INT(stored[cranny_normal_bytes(format)], 0x5a);
    cranny_normal_decode(format, stored, back);
    const double off = degrees_between(n, back);
    CHECK_MSG(off <= most, "format %d: (%g %g %g) came back as (%g %g %g), %g degrees off", format,
              (double)n[0], (double)n[1], (double)n[2], (double)back[0], (double)back[1],
              (double)back[2], off);
    CHECK_NEAR(
        sqrt((double)back[0] * back[0] + (double)back[1] * back[1] + (double)back[2] * back[2]), 1,
        0.008);
}

static void test_normals(void)
{
    for (int f = CRANNY_NORMAL_FLOAT3; f <= CRANNY_NORMAL_OCT8; f++) {
        const enum cranny_normal_format format = (enum cranny_normal_format)f;
        CHECK_INT(cranny_normal_bytes(format), normal_sizes[f]);
        for (int i = 0; i < 2000; i++) {
            /* a spiral from pole to pole */
            const double z = 1 - (2 * i + 1) / 2000.0, r = sqrt(1 - z * z), a = i * 2.399963;
            const float n[3] = {(float)(r * cos(a)), (float)(r * sin(a)), (float)z};
            check_normal(format, n, normal_errors[f]);
        }
        for (int k = 0; k < 6; k++) {
            float n[3] = {0};
            n[k / 2] = k % 2 ? -1 : 1;
            check_normal(format, n, f == CRANNY_NORMAL_UNORM8 ? 0.4 : 0);
        }
    }
    CHECK_INT(cranny_normal_bytes((enum cranny_normal_format)17), 0);
    /* −128 and −127 are both −1; 0 and 255 are the ends of unsigned bytes */
    const int8_t low[4] = {-128, -127, 127, 0};
    const uint8_t ends[4] = {0, 255, 51, 0};
    float n[3];
    cranny_normal_decode(CRANNY_NORMAL_SNORM8, low, n);
    CHECK(n[0] == -1 && n[1] == -1 && n[2] == 1);
    cranny_normal_decode(CRANNY_NORMAL_UNORM8, ends, n);
    CHECK(n[0] == -1 && n[1] == 1);
    CHECK_NEAR((double)n[2], -0.6, 1e-6);
}

static struct cranny_gbuffer good_frame(const float *depth, const void *normal)
{
    return (struct cranny_gbuffer){.width = 8,
                                   .height = 4,
                                   .depth = depth,
                                   .normal = normal,
                                   .projection = cranny_perspective(1, 2)};
}

#define REFUSE(change)                                                                             \
    do {                                                                                           \
        struct cranny_gbuffer g = good_frame(depth, normal);                                       \
        struct cranny_error why = {0};                                                             \
        CHECK_OK(cranny_gbuffer_validate(&g, &why), why);                                          \
        change;                                                                                    \
        CHECK_INT(cranny_gbuffer_validate(&g, &why), CRANNY_USAGE);                                \
        CHECK_MSG(why.message[0], "%s", #change);                                                  \
    } while (0)

#define ACCEPT(change)                                                                             \
    do {                                                                                           \
        struct cranny_gbuffer g = good_frame(depth, normal);                                       \
        struct cranny_error why = {0};                                                             \
        change;                                                                                    \
        CHECK_OK(cranny_gbuffer_validate(&g, &why), why);                                          \
    } while (0)

static void test_validate_buffers(const float *depth, const float *normal)
{
    REFUSE(g.width = 0);
    REFUSE(g.height = -1);
    REFUSE(g.width = CRANNY_SIDE_MAX + 1);
    REFUSE(g.depth = NULL);
    REFUSE(g.depth = (const float *)(const void *)((const char *)depth + 1));
    REFUSE(g.depth_stride = 28);
    REFUSE(g.depth_stride = 33);
    REFUSE(g.normal = (const char *)normal + 2);
    REFUSE(g.normal_stride = 8 * 12 - 4);
    REFUSE(g.normal_stride = 8 * 12 + 2);
    REFUSE(g.normal_format = (enum cranny_normal_format)6);
    REFUSE((g.normal_format = CRANNY_NORMAL_OCT16, g.normal_stride = 8 * 4 + 1));
    REFUSE(g.sample_count = -1);
    REFUSE(g.sample_count = CRANNY_SAMPLES_MAX + 1);
    REFUSE((g.sample_count = 4, g.depth_sample_stride = 4 * 32 - 4));
    REFUSE((g.sample_count = 4, g.normal_sample_stride = 4 * 96 - 4));
    static const float outside[2][2] = {{0.5f, 0.5f}, {0.5f, 1}};
    REFUSE((g.sample_count = 2, g.sample_positions = outside));
    ACCEPT(g.depth_stride = 64);
    ACCEPT((g.normal_format = CRANNY_NORMAL_OCT8, g.normal = (const char *)normal + 1));
    ACCEPT((g.sample_count = 8, g.depth_sample_stride = 4 * 32));
    ACCEPT((g.normal = NULL, g.normal_format = (enum cranny_normal_format)6));
}

static void test_validate_view(const float *depth, const float *normal)
{
    static const double nan_camera[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, NAN};
    REFUSE(g.projection = (struct cranny_projection){0});
    REFUSE(g.projection.kind = (enum cranny_projection_kind)2);
    REFUSE(g.projection.left = NAN);
    REFUSE(g.projection.right = INFINITY);
    REFUSE(g.projection.right = g.projection.left);
    REFUSE(g.projection.top = -2);
    REFUSE(g.projection.bottom = NAN);
    REFUSE(g.viewport = ((struct cranny_rect){0, 0, 9, 4}));
    REFUSE(g.viewport = ((struct cranny_rect){1, 0, 8, 4}));
    REFUSE(g.viewport = ((struct cranny_rect){-1, 0, 4, 4}));
    REFUSE(g.viewport = ((struct cranny_rect){0, 0, 0, 4}));
    REFUSE(g.viewport = ((struct cranny_rect){2, 2, 0, 0}));
    REFUSE(g.viewport = ((struct cranny_rect){INT32_MAX, 0, 2, 2}));
    REFUSE(g.guard_band = -1);
    REFUSE(g.world_from_view = nan_camera);
    ACCEPT(g.viewport = ((struct cranny_rect){2, 1, 6, 3}));
    ACCEPT(g.guard_band = 100000);
    ACCEPT(g.projection = cranny_orthographic(3, 2));
}

int main(void)
{
    static const float depth[2 * 32], normal[2 * 96];
    test_layouts();
    test_ends();
    test_halves();
    test_strides();
    test_planes_refused();
    test_matrices();
    test_matrices_refused();
    test_projections();
    test_normals();
    test_validate_buffers(depth, normal);
    test_validate_view(depth, normal);
    return check_end("gbuffer");
}
