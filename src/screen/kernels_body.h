/* The kernels, for the LANES, KERNELS and KERNELS_NAME that the including file defines. */
#include "screen/kernels.h"
#include "screen/lanes.h"

/* What the equations leave to the language; glsl.h has the other half. */
#define FUNCTION static inline
#define RECORD(NAME) typedef struct NAME NAME;
#define float_(X) ((float)(X))
#define int_(X) ((int32_t)(X))
#define ON(field) (constants->field != 0)
#define VIEW_ARG const struct canvas *canvas,
#define VIEW_PASS canvas,
#define VIEW(field) (canvas->field)
#define CONSTANTS_ARG const struct screen_constants *constants,
#define CONSTANTS_PASS constants,
#define K(field) (constants->field)
#define READ_DEPTH(index) gather(canvas->depth, index)
#define READ_NORMAL(index)                                                                         \
    vec3_(gather(canvas->normal[0], index), gather(canvas->normal[1], index),                      \
          gather(canvas->normal[2], index))

#include "screen/equations/view.h"

#include "screen/equations/alchemy.h"
#include "screen/equations/crease.h"
#include "screen/equations/hbao.h"
#include "screen/equations/raymarch.h"
#include "screen/equations/ssao.h"

static inline lane_3 load_normal(const struct canvas *canvas, ptrdiff_t at)
{
    return vec3_(load(canvas->normal[0] + at), load(canvas->normal[1] + at),
                 load(canvas->normal[2] + at));
}

/* 2^k not above x > 0. */
static inline lane_f power_below(lane_f x)
{
    return bits_float(shift_left(shift_right(float_bits(x), 23), 23));
}

/* Width of the cells of surface noise in pixels, before it is rounded down to a power of two of
 * metres. In cells below a pixel each frame's pixels find other ones: at 1, a point's raw value
 * changed by only 2 to 19 % less than with a hash on the screen; at 2 by 19 to 35 %; at 4 by 31 to
 * 46 %, but then the filter leaves blotches: eq. 31 rises by 9 to 15 %, at 2 by 3 to 5
 * (docs/measurements/temporal.md). */
#define SURFACE_CELL_PX 2.0f

/* A hash of the cell that the pixel's surface lies in: squares along the two world axes that follow
 * the surface best, so that they stay while the camera moves. The third one would tell a surface
 * that lies between two cells, as floors at 0 do, by its rounding. The weights keep the choice of
 * axes away from surfaces at 45°. */
static inline lane_i surface_hash(const struct canvas *canvas,
                                  const struct screen_constants *constants, const struct pixel *p)
{
    static const float weights[3] = {1, 1.03f, 1.07f};
    const float *m = constants->world_from_view;
    const lane_f footprint = SURFACE_CELL_PX * view_w(canvas, p->depth) * fabsf(canvas->scale_x);
    const lane_f inverse = 1.0f / power_below(max_(footprint, splat(1e-20f)));
    lane_f facing[3], most = splat(0.0f);
    for (int row = 0; row < 3; row++, m += 4) {
        facing[row] =
            weights[row] * abs_(m[0] * p->normal.x + m[1] * p->normal.y + m[2] * p->normal.z);
        most = max_(most, facing[row]);
    }
    lane_i hash = splat_int((int32_t)constants->seed);
    m = constants->world_from_view;
    for (int row = 0; row < 3; row++, m += 4) {
        const lane_f world =
            m[0] * p->position.x + m[1] * p->position.y + m[2] * p->position.z + m[3];
        const lane_f cell = clamp_(world * inverse, -2e9f, 2e9f);
        const lane_f along = select_(less_(facing[row], most), floor_(cell), splat(0.0f));
        hash = hash_(xor_(hash, to_int(along)));
    }
    return hash;
}

static inline void pixel_noise(const struct canvas *canvas,
                               const struct screen_constants *constants, int x, int y,
                               struct pixel *p)
{
    const int ix = x - canvas->origin_x, iy = y - canvas->origin_y;
    if (constants->anchor == CRANNY_ANCHOR_SURFACE || constants->noise == CRANNY_NOISE_HASH) {
        lane_i hash;
        const lane_i row = splat_int((int32_t)((uint32_t)iy + constants->seed));
        if (constants->anchor == CRANNY_ANCHOR_SURFACE)
            hash = surface_hash(canvas, constants, p);
        else
            hash = hash_(add_u32(add_u32(to_int(first_lanes()), splat_int(ix)), hash_(row)));
        turn_(unit_(hash), &p->cosine, &p->sine);
        p->jitter = unit_(hash_(add_u32(hash, splat_int(0x51ed270b))));
        return;
    }
    const float(*tile)[NOISE_ROW] = constants->noise_rows[iy & 3];
    p->cosine = load(tile[0] + (ix & 3));
    p->sine = load(tile[1] + (ix & 3));
    p->jitter = load(tile[2] + (ix & 3));
}

/* Everything that an estimator asks of its pixel. Returns where there is nothing to estimate: sky,
 * and surfaces on which the radius is below a pixel. */
static inline __attribute__((always_inline)) lane_b
pixel_setup(const struct canvas *canvas, const struct screen_constants *constants, int x, int y,
            struct pixel *p)
{
    const ptrdiff_t at = canvas_index(canvas, x, y);
    p->x = first_lanes() + (float)x;
    p->y = splat((float)y);
    p->depth = load(canvas->depth + at);
    const lane_f radius_px =
        constants->radius / (fabsf(canvas->scale_x) * view_w(canvas, p->depth));
    p->radius_x = min_(radius_px, splat(constants->limit_px));
    p->radius_y = p->radius_x * fabsf(canvas->scale_x / canvas->scale_y);
    const lane_b sky = less_(splat(SKY_LIMIT), p->depth);
    const lane_b open = constants->world ? or_(sky, less_(radius_px, splat(1.0f))) : sky;
    if (!any_(not_(open)))
        return open;
    p->position = view_position(canvas, p->x, p->y, p->depth);
    p->normal = load_normal(canvas, at);
    pixel_noise(canvas, constants, x, y, p);
    return open;
}

/* Distance fade: occlusion is gone at fade_end. */
static inline lane_f fade(const struct screen_constants *constants, lane_f depth, lane_f visibility)
{
    if (constants->fade_scale == 0)
        return visibility;
    const lane_f gone = saturate_((depth - constants->fade_begin) * constants->fade_scale);
    return visibility + (1.0f - visibility) * gone;
}

#define DEFINE_ESTIMATE(METHOD)                                                                    \
    static void estimate_##METHOD(const struct canvas *canvas,                                     \
                                  const struct screen_constants *constants,                        \
                                  const struct span *span, float *visibility)                      \
    {                                                                                              \
        for (int y = span->y_begin; y < span->y_end; y++)                                          \
            for (int x = span->x_begin; x < span->x_end; x += LANES) {                             \
                struct pixel p;                                                                    \
                const lane_b open = pixel_setup(canvas, constants, x, y, &p);                      \
                lane_f v = splat(1.0f);                                                            \
                if (any_(not_(open)))                                                              \
                    v = fade(constants, p.depth, METHOD##_estimate(canvas, constants, p));         \
                v = select_(open, splat(1.0f), v);                                                 \
                store(visibility + canvas_index(canvas, x, y), v);                                 \
            }                                                                                      \
    }

DEFINE_ESTIMATE(ssao)
DEFINE_ESTIMATE(hbao)
DEFINE_ESTIMATE(crease)
DEFINE_ESTIMATE(alchemy)
DEFINE_ESTIMATE(raymarch)

/* The step from a pixel to its neighbour on the side where depth bends least. `step` elements away;
 * (cx, cy) pixels. Along a plane, 1 / depth is linear in the picture (the depth where parallel). */
static inline lane_3 bend_step(const struct canvas *canvas, const struct pixel *p, ptrdiff_t at,
                               ptrdiff_t step, float cx, float cy)
{
    const float *depth = canvas->depth + at;
    lane_f z[5], w[5];
    for (int k = 0; k < 5; k++) {
        z[k] = load(depth + (k - 2) * step);
        w[k] = canvas->orthographic ? z[k] : 1.0f / z[k];
    }
    const lane_f before = abs_(2.0f * w[1] - w[0] - w[2]);
    const lane_f after = abs_(2.0f * w[3] - w[4] - w[2]);
    const lane_b left = less_(before, after);
    const lane_f sign = select_(left, splat(-1.0f), splat(1.0f));
    const lane_f near = select_(left, z[1], z[3]);
    const lane_3 there = view_position(canvas, p->x + sign * cx, p->y + sign * cy,
                                       select_(less_(splat(SKY_LIMIT), near), z[2], near));
    return scale3(sub3(there, p->position), sign);
}

static inline void store_normal(const struct canvas *canvas, ptrdiff_t at, lane_3 n)
{
    store(canvas->normal[0] + at, n.x);
    store(canvas->normal[1] + at, n.y);
    store(canvas->normal[2] + at, n.z);
}

/* The normal of the plane through a pixel and the neighbours that continue its surface. */
static inline lane_3 bend_normal(const struct canvas *canvas, int x, int y)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f), tiny = splat(1e-30f);
    const ptrdiff_t at = canvas_index(canvas, x, y);
    struct pixel p;
    p.x = first_lanes() + (float)x;
    p.y = splat((float)y);
    p.depth = load(canvas->depth + at);
    p.position = view_position(canvas, p.x, p.y, p.depth);
    const lane_3 u = bend_step(canvas, &p, at, 1, 1, 0);
    const lane_3 v = bend_step(canvas, &p, at, canvas->stride, 0, 1);
    /* Right × up; v points down. Scaled first: squares of tiny steps underflow. */
    const lane_f su = 1.0f / max_(max_(abs_(u.x), max_(abs_(u.y), abs_(u.z))), tiny);
    const lane_f sv = -1.0f / max_(max_(abs_(v.x), max_(abs_(v.y), abs_(v.z))), tiny);
    const lane_3 a = scale3(u, su), b = scale3(v, sv);
    lane_3 n = vec3_(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
    const lane_f length = sqrt_(dot3(n, n));
    const lane_f away = canvas->orthographic ? -n.z : dot3(n, p.position);
    n = scale3(n, select_(less_(zero, away), -one, one) / max_(length, splat(1e-20f)));
    const lane_b flat = or_(less_(length, splat(1e-12f)), less_(splat(SKY_LIMIT), p.depth));
    return vec3_(select_(flat, zero, n.x), select_(flat, zero, n.y), select_(flat, one, n.z));
}

static void finish_normals(const struct canvas *canvas, bool given, const struct span *span)
{
    for (int y = span->y_begin; y < span->y_end; y++)
        for (int x = span->x_begin; x < span->x_end; x += LANES) {
            const ptrdiff_t at = canvas_index(canvas, x, y);
            if (!given) {
                store_normal(canvas, at, bend_normal(canvas, x, y));
                continue;
            }
            lane_3 n = load_normal(canvas, at);
            const lane_f square = dot3(n, n);
            const lane_b good = and_(less_(splat(1e-12f), square), less_(square, splat(1e12f)));
            n = scale3(n, 1.0f / sqrt_(square));
            if (any_(not_(good))) {
                const lane_3 bent = bend_normal(canvas, x, y);
                n = vec3_(select_(good, n.x, bent.x), select_(good, n.y, bent.y),
                          select_(good, n.z, bent.z));
            }
            store_normal(canvas, at, n);
        }
}

/* How far two surfaces belong together, 0 … 15: by their distances from each other's plane, and the
 * angle between their normals. */
static inline lane_i connection(const struct canvas *canvas,
                                const struct screen_constants *constants, const struct pixel *p,
                                ptrdiff_t there, float dx, float dy)
{
    const lane_3 position =
        view_position(canvas, p->x + dx, p->y + dy, load(canvas->depth + there));
    const lane_3 normal = load_normal(canvas, there);
    const lane_3 v = sub3(position, p->position);
    const lane_f apart = max_(abs_(dot3(v, p->normal)), abs_(dot3(v, normal)));
    const lane_f tolerance =
        constants->filter_tolerance +
        view_w(canvas, p->depth) * (constants->footprint * fabsf(canvas->scale_x));
    const lane_f near = saturate_(2.0f - 2.0f * apart / tolerance);
    const float wide = 2.0f / (1.0f - constants->filter_cosine);
    const lane_f alike = saturate_((dot3(p->normal, normal) - constants->filter_cosine) * wide);
    return to_int(near * alike * 15.0f + 0.5f);
}

static void edges(const struct canvas *canvas, const struct screen_constants *constants,
                  const struct span *span)
{
    for (int y = span->y_begin; y < span->y_end; y++)
        for (int x = span->x_begin; x < span->x_end; x += LANES) {
            const ptrdiff_t at = canvas_index(canvas, x, y);
            struct pixel p;
            p.x = first_lanes() + (float)x;
            p.y = splat((float)y);
            p.depth = load(canvas->depth + at);
            p.position = view_position(canvas, p.x, p.y, p.depth);
            p.normal = load_normal(canvas, at);
            const lane_i right = connection(canvas, constants, &p, at + 1, 1, 0);
            const lane_i below = connection(canvas, constants, &p, at + canvas->stride, 0, 1);
            store_bytes(canvas->edges + at, right | shift_left(below, 4));
        }
}

/* One side of a blur: taps 1 … count, each weighted by the connections on the way to it. */
static inline void blur_side(const float *in, const uint8_t *edge, ptrdiff_t step, bool vertical,
                             int count, const float *weights, lane_f *sum, lane_f *weight)
{
    lane_f path = splat(1.0f);
    for (int k = 1; k <= count; k++) {
        const lane_i packed = load_bytes(edge + (step > 0 ? k - 1 : k) * step);
        const lane_i connected = vertical ? shift_right(packed, 4) : packed & 15;
        path = path * to_float(connected) * (1.0f / 15);
        const lane_f w = path * weights[k];
        *sum = *sum + w * load(in + k * step);
        *weight = *weight + w;
    }
}

static void blur(const struct canvas *canvas, bool vertical, int before, int after,
                 const float *weights, const struct span *span, const float *in, float *out)
{
    const ptrdiff_t step = vertical ? canvas->stride : 1;
    for (int y = span->y_begin; y < span->y_end; y++) {
        const int up = vertical && before > y ? y : before;
        const int down =
            vertical && after > canvas->height - 1 - y ? canvas->height - 1 - y : after;
        for (int x = span->x_begin; x < span->x_end; x += LANES) {
            const ptrdiff_t at = canvas_index(canvas, x, y);
            lane_f sum = weights[0] * load(in + at), weight = splat(weights[0]);
            blur_side(in + at, canvas->edges + at, step, vertical, down, weights, &sum, &weight);
            blur_side(in + at, canvas->edges + at, -step, vertical, up, weights, &sum, &weight);
            store(out + at, sum / weight);
        }
    }
}

static void upsample(const struct canvas *full, const struct canvas *half,
                     const struct screen_constants *constants, const struct span *span,
                     const float *in, float *out)
{
    const lane_f zero = splat(0.0f);
    for (int y = span->y_begin; y < span->y_end; y++)
        for (int x = span->x_begin; x < span->x_end; x += LANES) {
            const ptrdiff_t at = canvas_index(full, x, y);
            const lane_f depth = load(full->depth + at);
            const lane_3 normal = load_normal(full, at);
            const lane_f px = first_lanes() + (float)x, hx = 0.5f * px;
            const lane_3 position = view_position(full, px, splat((float)y), depth);
            const lane_f tolerance =
                constants->filter_tolerance +
                view_w(full, depth) * (2 * constants->footprint * fabsf(full->scale_x));
            const lane_i x0 = to_int(hx);
            const lane_f fx = hx - to_float(x0);
            lane_f sum = zero, weight = zero;
            for (int k = 0; k < 4; k++) {
                const int row = y / 2 + k / 2;
                const lane_i column = x0 + splat_int(k & 1);
                const float fy = (y & 1) ? 0.5f : (k < 2 ? 1.0f : 0.0f);
                lane_f w = (k & 1 ? fx : 1.0f - fx) * fy;
                if (row >= half->height || fy == 0)
                    continue;
                const lane_i index = column + splat_int((int32_t)(row * half->stride));
                const lane_f there = gather(half->depth, index);
                const lane_3 v =
                    sub3(view_position(half, to_float(column), splat((float)row), there), position);
                const lane_f apart = abs_(dot3(v, normal));
                w = w * (saturate_(2.0f - 2.0f * apart / tolerance) + 1e-4f);
                w = select_(less_(splat(SKY_LIMIT), there), w * 1e-3f, w);
                sum = sum + w * gather(in, index);
                weight = weight + w;
            }
            const lane_f v = sum / max_(weight, splat(1e-20f));
            store(out + at, select_(less_(splat(SKY_LIMIT), depth), splat(1.0f), v));
        }
}

const struct kernels KERNELS = {
    .name = KERNELS_NAME,
    .estimate = {[CRANNY_SSAO] = estimate_ssao,
                 [CRANNY_HBAO] = estimate_hbao,
                 [CRANNY_CREASE] = estimate_crease,
                 [CRANNY_ALCHEMY] = estimate_alchemy,
                 [CRANNY_RAYMARCH] = estimate_raymarch},
    .finish_normals = finish_normals,
    .edges = edges,
    .blur = blur,
    .upsample = upsample,
};
