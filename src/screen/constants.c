/* Parameters into the numbers that the kernels use. */
#include "screen/constants.h"

#include "base/portable.h"
#include "base/sequence.h"

/* The picture height that the crease article's kernel of pixels is taken to be meant for. */
#define CREASE_HEIGHT 720.0f
/* Alchemy: the spiral's turns for a number of samples; coprime, about its golden part. */
#define SPIRAL_TURNS 0.381966
/* Alchemy with samples weighted by solid angle: what makes intensity and contrast 1 nearly true. */
#define ALCHEMY_SOLID_ANGLE 1.04f

static void set_row(struct screen_constants *c, int i, double x, double y, double z, double w)
{
    c->table[i][0] = (float)x;
    c->table[i][1] = (float)y;
    c->table[i][2] = (float)z;
    c->table[i][3] = (float)w;
}

/* A place at `turns` around a circle. */
static void set_turn(struct screen_constants *c, int i, double turns, double ring, double z,
                     double w)
{
    float cosine, sine;
    turn_vector(turns, &cosine, &sine);
    set_row(c, i, ring * (double)cosine, ring * (double)sine, z, w);
}

static int greatest_divisor(int a, int b)
{
    return b ? greatest_divisor(b, a % b) : a;
}

static void alchemy_table(struct screen_constants *c)
{
    int turns = max_int(1, (int)(c->samples * SPIRAL_TURNS + 0.5));
    while (greatest_divisor(turns, c->samples) != 1)
        turns++;
    for (int i = 0; i < c->samples; i++) {
        set_turn(c, i, fraction((double)i * turns / c->samples), 1, 0, 0);
    }
}

static void hbao_table(struct screen_constants *c)
{
    for (int i = 0; i < c->directions; i++)
        set_turn(c, i, (double)i / c->directions, 1, 0, 0);
}

/* Corners of cubes, each longer than the last (Kajalin's loop). */
static void ssao_screen_table(struct screen_constants *c, const struct cranny_screen_params *p)
{
    const double step = 1 + p->kernel_growth / p->samples;
    double length = 1;
    for (int i = 0; i < p->samples; i++) {
        length *= step;
        const double side = length / sqrt(3.0);
        set_row(c, i, i & 4 ? side : -side, i & 2 ? side : -side, i & 1 ? side : -side, 0);
    }
}

/* Unit vectors on a spherical spiral; lengths in an order that is not theirs, so that no region of
 * the sphere has only long ones. */
static void ssao_world_table(struct screen_constants *c, const struct cranny_screen_params *p)
{
    const int n = p->samples;
    int stride = max_int(1, (int)(n * GOLDEN_RATIO_FRACTION));
    while (greatest_divisor(stride, n) != 1)
        stride++;
    for (int i = 0; i < n; i++) {
        const double z = 1 - (2 * i + 1.0) / n, ring = sqrt(1 - z * z);
        set_turn(c, i, fraction(i * GOLDEN_RATIO_FRACTION), ring, z, (double)(i * stride % n) / n);
    }
}

/* Every other pixel of a diamond in 11×11: both offsets odd, 24 in all. Units of the kernel: pixels
 * of the article, or such that the farthest is at the radius. */
static void crease_table(struct screen_constants *c)
{
    const double unit = c->world ? 1 / sqrt(26.0) : 1;
    int count = 0;
    for (int y = -5; y <= 5; y += 2)
        for (int x = -5; x <= 5; x += 2)
            if (abs(x) + abs(y) <= 6)
                set_row(c, count++, x * unit, y * unit, 0, 0);
    c->samples = count;
}

static void raymarch_table(struct screen_constants *c, const struct cranny_screen_params *p)
{
    c->samples = p->directions * p->elevations;
    for (int i = 0; i < c->samples; i++) {
        const int d = i / p->elevations, e = i % p->elevations;
        const double u = (e + fraction(0.5 + d * GOLDEN_RATIO_FRACTION)) / p->elevations;
        const double turns = (d + (e + 0.5) / p->elevations) / p->directions;
        const double z = p->cosine ? sqrt(1 - u) : 1 - u; /* u in [0, 1) */
        const double ring = sqrt(fmax(0, 1 - z * z));
        set_turn(c, i, turns, ring, z, 0);
    }
}

/* Sixteen evenly spread turns and jitters: neighbours, rows, columns and 2×2 blocks all differ by
 * far. The seed permutes the tile. */
static void noise_tile(struct screen_constants *c)
{
    static const uint8_t turns[16] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
    static const uint8_t jitters[16] = {0, 4, 8, 12, 9, 13, 1, 5, 6, 2, 14, 10, 15, 11, 7, 3};
    const bool still = c->noise == CRANNY_NOISE_NONE;
    for (int row = 0; row < 4; row++)
        for (int i = 0; i < NOISE_ROW; i++) {
            const int cell = (4 * row + (i & 3)) ^ (int)(c->seed & 15);
            float *const cosine = &c->noise_rows[row][0][i], *const sine =
                                                                 &c->noise_rows[row][1][i];
            turn_vector(still ? 0.5 : turns[cell] / 16.0, cosine, sine);
            c->noise_rows[row][2][i] = still ? 0.5f : ((float)jitters[cell] + 0.5f) / 16;
        }
}

/* How far the method looks; what is measured in radii follows radius_world. */
static float reach(const struct cranny_screen_params *p)
{
    return p->radius_scale * p->radius_world;
}

/* Factor on the mean of a method's terms. */
static float amount(const struct cranny_screen_params *p)
{
    switch ((enum cranny_method)p->method) {
    case CRANNY_ALCHEMY:
        /* 2 σ u, see equations/alchemy.h; by solid angle, the factor that fits the truth. */
        return (p->spread ? ALCHEMY_SOLID_ANGLE : 4) * p->intensity * reach(p);
    case CRANNY_HBAO:
        /* 1/(2π) · 2π/N_d (eq. 6.2.9); the cosine's half-slices fill 2/π · π/N_d. */
        return p->cosine ? 2 * p->intensity : p->intensity;
    case CRANNY_CREASE:
        return p->intensity / p->averager;
    case CRANNY_SSAO:
    case CRANNY_RAYMARCH:
    case CRANNY_METHOD_COUNT:
        break;
    }
    return p->intensity;
}

static void screen_kernel(struct screen_constants *c, const struct cranny_screen_params *p,
                          const struct cranny_rect *viewport, float pixels)
{
    if (p->method == CRANNY_SSAO) {
        c->kernel_x = p->kernel_scale * (float)viewport->width * pixels;
        c->kernel_y = p->kernel_scale * (float)viewport->height * pixels;
        c->kernel_z = 2 * p->kernel_scale;
    } else {
        c->kernel_x = c->kernel_y = (float)viewport->height / CREASE_HEIGHT * pixels;
    }
}

static void surface_noise(struct screen_constants *c, const struct cranny_gbuffer *gbuffer)
{
    for (int i = 0; i < 12; i++)
        c->world_from_view[i] = gbuffer->world_from_view ? (float)gbuffer->world_from_view[i] : 0;
}

void constants_make(struct screen_constants *c, const struct cranny_screen_params *p,
                    const struct cranny_gbuffer *gbuffer, const struct cranny_rect *viewport,
                    bool half)
{
    const float pixels = half ? 0.5f : 1;
    *c = (struct screen_constants){
        .radius = reach(p),
        .radius2 = reach(p) * reach(p),
        .inverse_radius = 1 / reach(p),
        .amount = amount(p),
        .contrast = p->contrast,
        .bias = p->bias * (gbuffer->projection.top - gbuffer->projection.bottom),
        .epsilon = p->epsilon * reach(p) * reach(p),
        .limit_px = fmaxf(1, p->kernel_limit * (float)viewport->height * pixels),
        .range_default = p->range_default,
        .thickness = p->thickness * p->radius_world,
        .minimum_crease = p->minimum_crease,
        .crease_scale = p->crease_scale,
        .band_begin = p->band_begin * pixels,
        .fade_begin = p->fade_begin,
        .fade_scale = p->fade_begin < p->fade_end ? 1 / (p->fade_end - p->fade_begin) : 0,
        .filter_tolerance = p->filter_depth * p->radius_world,
        .filter_cosine = p->filter_normal,
        .footprint = FILTER_FOOTPRINT,
        .samples = p->samples,
        .directions = p->directions,
        .steps = p->steps,
        .bands = max_int(1, p->bands),
        .falloff = p->falloff,
        .cosine = p->cosine,
        .spread = p->spread,
        .curve = p->curve,
        .facing = p->facing,
        .world = p->kernel == CRANNY_KERNEL_WORLD,
        .mirror = p->rotation == CRANNY_ROTATION_MIRROR,
        .clamp = p->border == CRANNY_BORDER_CLAMP,
        .noise = p->noise,
        .anchor = gbuffer->world_from_view ? p->anchor : CRANNY_ANCHOR_SCREEN,
        .seed = (uint32_t)p->seed,
    };
    if (p->fade_end <= p->fade_begin && p->fade_end < 1e11f)
        c->fade_scale = 1e30f;
    turn_vector(p->angle_bias / 360.0, &c->cosine_bias, &c->sine_bias);
    surface_noise(c, gbuffer);
    noise_tile(c);
    screen_kernel(c, p, viewport, pixels);
    switch ((enum cranny_method)p->method) {
    case CRANNY_SSAO:
        if (c->world)
            ssao_world_table(c, p);
        else
            ssao_screen_table(c, p);
        return;
    case CRANNY_HBAO:
        c->world = 1;
        hbao_table(c);
        return;
    case CRANNY_CREASE:
        crease_table(c);
        return;
    case CRANNY_ALCHEMY:
        c->world = 1;
        alchemy_table(c);
        return;
    case CRANNY_RAYMARCH:
        c->world = 1;
        raymarch_table(c, p);
        return;
    case CRANNY_METHOD_COUNT:
        return;
    }
}
