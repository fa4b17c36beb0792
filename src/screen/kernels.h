/* What the estimators and filters read and write, and the table of their builds.
 *
 * All planes of a canvas have one layout: `stride` elements a row, HALO_COLUMNS readable ones on
 * both sides of a row, HALO_ROWS above and below, so that vectors and neighbours need no tests. */
#ifndef SCREEN_KERNELS_H
#define SCREEN_KERNELS_H

#include <cranny/screen.h>

#define HALO_COLUMNS 32
#define HALO_ROWS 2
#define FILTER_RADIUS_MAX 24
/* Pixels that surfaces may be apart by without an edge, whatever the tolerance. */
#define FILTER_FOOTPRINT 0.5f
#define TABLE_MAX 256
/* A row of the noise tile, repeated so that a vector can begin at any of its cells. */
#define NOISE_ROW 20
/* Depth that stands for sky inside: its square still fits a float. */
#define SKY_DEPTH 1e12f
#define SKY_LIMIT 1e11f

/* One resolution of a frame. */
struct canvas {
    int width, height;
    ptrdiff_t stride;
    float *depth;     /* metres; sky SKY_DEPTH */
    float *normal[3]; /* unit, view space */
    uint8_t *edges;   /* connection to the right neighbour (low 4 bits) and the one below */
    /* View x of pixel column i: (scale_x i + shift_x) × depth, or without the depth where
     * orthographic; likewise y. */
    float scale_x, shift_x, scale_y, shift_y;
    int orthographic;
    int origin_x, origin_y; /* of the viewport: where the noise begins */
};

/* The numbers of a method, made ready: what a GPU would hold in a uniform block. */
struct screen_constants {
    float radius, radius2, inverse_radius;
    float amount;                 /* factor on the mean of the terms */
    float contrast;               /* exponent, 1: none */
    float bias;                   /* per metre of depth */
    float epsilon;                /* m² */
    float limit_px;               /* largest projected radius */
    float sine_bias, cosine_bias; /* of the angle bias */
    float range_default, thickness;
    float minimum_crease, crease_scale;
    float kernel_x, kernel_y,
        kernel_z;     /* screen-space kernels: their size in pixels, and in depths */
    float band_begin; /* pixels */
    float fade_begin, fade_scale;
    float filter_tolerance, filter_cosine, footprint;
    int samples, directions, steps, bands;
    int falloff, cosine, spread, curve, facing, world, mirror, clamp;
    int noise, anchor;
    uint32_t seed;
    float world_from_view[12];
    float table[TABLE_MAX][4];
    float noise_rows[4][3][NOISE_ROW]; /* cosine and sine of the turn, jitter */
};

/* A pass over rows [y_begin, y_end) and columns [x_begin, x_end) of a canvas; x_begin is a multiple
 * of 16 and the columns up to the next multiple of 16 may be written, too. */
struct span {
    int x_begin, x_end, y_begin, y_end;
};

typedef void estimate_fn(const struct canvas *canvas, const struct screen_constants *constants,
                         const struct span *span, float *visibility);

struct kernels {
    const char *name;
    estimate_fn *estimate[CRANNY_METHOD_COUNT];
    /* Unit normals: those given, scaled; or, where they have no length or none are given, from the
     * neighbours across which depth bends least. */
    void (*finish_normals)(const struct canvas *canvas, bool given, const struct span *span);
    void (*edges)(const struct canvas *canvas, const struct screen_constants *constants,
                  const struct span *span);
    /* Weighted means along x or y within edges; `before` and `after` taps on the two sides,
     * weights[0] is the centre's. */
    void (*blur)(const struct canvas *canvas, bool vertical, int before, int after,
                 const float *weights, const struct span *span, const float *in, float *out);
    /* From a canvas of half the resolution: bilinear, within the full one's surfaces. */
    void (*upsample)(const struct canvas *full, const struct canvas *half,
                     const struct screen_constants *constants, const struct span *span,
                     const float *in, float *out);
};

extern const struct kernels kernels_portable;
#if CRANNY_X86
extern const struct kernels kernels_avx2, kernels_avx512;
#endif

/* The build to run for a wish; falls back to what the machine has. */
const struct kernels *kernels_choose(enum cranny_isa wish, enum cranny_isa *chosen);

static inline ptrdiff_t canvas_index(const struct canvas *canvas, int x, int y)
{
    return y * canvas->stride + x;
}

#endif
