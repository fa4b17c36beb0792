/* The kernels, for the LANES and KERNELS that the including file defines.
 *
 * Based on: McGuire, Ambient Occlusion Volumes, 2009. */
#include "screen/lanes.h"
#include "volumes/kernels.h"

#include <stddef.h>

#define INVERSE_TWO_PI 0.15915494f
#define LOG2_E 1.44269504f
#define FIT_LEAST 1e-3f   /* weight from which a sample's value bounds the result */
#define FIT_DAMPING 1e-3f /* squares of cells */
#define QUEUE 80          /* pairs; a multiple of BLOCK */
#define DENSE 12          /* pairs in a block from which it does not wait for others */
#define FAR 2.0f          /* longest edges between a pixel and a polygon that far_share is for */
#define FAR_NOWHERE (4.0f * FAR * FAR * 4.0f) /* of edges of 2 δ: volumes end before */
#define FAR_SCALE (4.0f * 0.31830989f / 3.0f)
#define ROUNDING 4e-7f /* of a corner's height, as a share of its distance */

/* A convex polygon with its planes: a lane each, or one in all lanes. */
struct lane_volume {
    lane_3 corner[4];
    lane_3 edge[4], hull[4], face; /* plane normals: inward, and the polygon's own */
    lane_f edge_w[4], hull_w[4], face_w;
    lane_f alpha, lowest, cut, triangle;
    lane_f far_limit, far_weight[2];
};

/* The same of one volume, in the order of the fields above. */
struct one_volume {
    float corner[4][3];
    float edge[4][3], hull[4][3], face[3];
    float edge_w[4], hull_w[4], face_w;
    float alpha, lowest, cut, triangle;
    float far_limit, far_weight[2];
};

_Static_assert(sizeof(struct lane_volume) == LANES * sizeof(struct one_volume), "fields differ");

static inline lane_3 cross3(lane_3 a, lane_3 b)
{
    return vec3_(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static inline lane_3 splat3(const float v[3])
{
    return vec3_(splat(v[0]), splat(v[1]), splat(v[2]));
}

static inline lane_3 load3(const float (*planes)[TILE], int at)
{
    return vec3_(load(planes[0] + at), load(planes[1] + at), load(planes[2] + at));
}

static inline lane_3 select3(lane_b m, lane_3 a, lane_3 b)
{
    return vec3_(select_(m, a.x, b.x), select_(m, a.y, b.y), select_(m, a.z, b.z));
}

static inline lane_3 abs3(lane_3 a)
{
    return vec3_(abs_(a.x), abs_(a.y), abs_(a.z));
}

static inline lane_f inverse_length(lane_3 a)
{
    return 1.0f / sqrt_(max_(dot3(a, a), splat(1e-37f)));
}

/* To unit length; what has none becomes 0. */
static inline lane_3 unit3(lane_3 a)
{
    const lane_f length2 = dot3(a, a);
    const lane_f inverse = 1.0f / sqrt_(max_(length2, splat(1e-37f)));
    return scale3(a, select_(less_(splat(1e-37f), length2), inverse, splat(0.0f)));
}

/* Lane i in bit i. */
static inline unsigned lane_bits(lane_b m)
{
#if LANES == 16
    return (unsigned)m;
#elif LANES == 8
    return (unsigned)_mm256_movemask_ps(_mm256_castsi256_ps((__m256i)m));
#else
    return (unsigned)m;
#endif
}

/* A plane through `point`, 1 there with `lift` 1; without direction it is 1 everywhere. */
static inline lane_f plane_offset(lane_3 normal, lane_3 point, float lift)
{
    const lane_f none = dot3(normal, normal);
    return select_(less_(none, splat(0.5f)), splat(1.0f), lift - dot3(normal, point));
}

/* The inward planes of eq. 22, so that they are the factors of eq. 24 (with m̂·x̂/δ + 1 in units of
 * δ). A triangle's last edge has no length and counts 1. */
static inline void make_edges(struct lane_volume *v)
{
    for (int i = 0; i < 4; i++) {
        const lane_3 along = unit3(sub3(v->corner[(i + 1) & 3], v->corner[i]));
        v->edge[i] = cross3(v->face, along);
        v->edge_w[i] = plane_offset(v->edge[i], v->corner[i], 1.0f);
    }
}

/* Corners moved by the extension vectors of eq. 28, (m̂₋ + m̂₊) δ / (1 + m̂₋·m̂₊) outward, no longer
 * than 2δ; and the planes through them. `cut` says whether any was shortened: only then do these
 * planes hold anything that eq. 24 does not. */
static inline void make_hull(struct lane_volume *v)
{
    const lane_b triangle = less_(splat(0.5f), v->triangle);
    lane_3 moved[4];
    lane_f least = splat(1.0f);
    for (int i = 0; i < 4; i++) {
        lane_3 before = v->edge[(i + 3) & 3], after = v->edge[i];
        if (i == 0)
            before = select3(triangle, v->edge[2], before);
        if (i == 3)
            after = select3(triangle, v->edge[0], after);
        const lane_f q = max_(1.0f + dot3(before, after), splat(1e-6f));
        const lane_f length = select_(less_(q, splat(0.5f)), sqrt_(2.0f / q), 1.0f / q);
        moved[i] = sub3(v->corner[i], scale3(add3(before, after), length));
        least = min_(q, least);
    }
    v->cut = select_(less_(least, splat(0.5f)), splat(1.0f), splat(0.0f));
    for (int i = 0; i < 4; i++) {
        v->hull[i] = cross3(v->face, unit3(sub3(moved[(i + 1) & 3], moved[i])));
        v->hull_w[i] = plane_offset(v->hull[i], moved[i], 0.0f);
    }
}

/* What far_share needs: the areas of the two triangles of a quad (of a triangle, the first), and
 * from where on it holds. */
static inline void make_far(struct lane_volume *v)
{
    lane_3 side[3];
    lane_f longest2 = splat(0.0f);
    for (int i = 0; i < 4; i++) {
        const lane_3 edge = sub3(v->corner[(i + 1) & 3], v->corner[i]);
        longest2 = max_(dot3(edge, edge), longest2);
    }
    for (int i = 0; i < 3; i++)
        side[i] = sub3(v->corner[i + 1], v->corner[0]);
    const lane_3 across = sub3(v->corner[3], v->corner[1]);
    longest2 = max_(max_(dot3(across, across), dot3(side[1], side[1])), longest2);
    for (int i = 0; i < 2; i++) {
        const lane_3 twice = cross3(side[i], side[i + 1]);
        v->far_weight[i] = sqrt_(dot3(twice, twice)) * FAR_SCALE;
    }
    v->far_limit = longest2 * (4.0f * FAR * FAR);
}

/* Planes from corners (a Newell normal by the diagonals); without an area, nothing hides. */
static inline void make_volume(const struct batch *batch, int at, struct lane_volume *v)
{
    for (int i = 0; i < 4; i++)
        v->corner[i] = vec3_(load(batch->corner[i][0] + at), load(batch->corner[i][1] + at),
                             load(batch->corner[i][2] + at));
    v->lowest = load(batch->lowest + at);
    v->triangle = load(batch->triangle + at);
    v->face = unit3(
        cross3(unit3(sub3(v->corner[2], v->corner[0])), unit3(sub3(v->corner[3], v->corner[1]))));
    v->face_w = -dot3(v->face, v->corner[0]);
    v->alpha =
        select_(less_(dot3(v->face, v->face), splat(0.5f)), splat(0.0f), load(batch->alpha + at));
    make_edges(v);
    make_hull(v);
    make_far(v);
}

static inline struct lane_volume splat_volume(const struct one_volume *one)
{
    struct lane_volume v;
    for (int i = 0; i < 4; i++) {
        v.corner[i] = splat3(one->corner[i]);
        v.edge[i] = splat3(one->edge[i]);
        v.hull[i] = splat3(one->hull[i]);
        v.edge_w[i] = splat(one->edge_w[i]);
        v.hull_w[i] = splat(one->hull_w[i]);
    }
    v.face = splat3(one->face);
    v.face_w = splat(one->face_w);
    v.alpha = splat(one->alpha);
    v.lowest = splat(one->lowest);
    v.cut = splat(one->cut);
    v.triangle = splat(one->triangle);
    v.far_limit = splat(one->far_limit);
    v.far_weight[0] = splat(one->far_weight[0]);
    v.far_weight[1] = splat(one->far_weight[1]);
    return v;
}

struct lane_bounds {
    lane_3 centre, half, normal;
    lane_f spread, lift;
};

/* Whether a volume may hide anything of the pixels in the bounds: the box reaches into the hull,
 * and a corner may lie above a tangent plane. */
static inline lane_b meets(const struct lane_volume *v, const struct lane_bounds *b)
{
    const lane_f middle = dot3(v->face, b->centre) + v->face_w;
    const lane_f reach = dot3(abs3(v->face), b->half);
    lane_b hit = and_(less_(v->lowest, middle + reach), less_(middle - reach, splat(1.0f)));
    for (int i = 0; i < 4; i++) {
        const lane_f far = dot3(v->hull[i], b->centre) + dot3(abs3(v->hull[i]), b->half);
        hit = and_(hit, less_(splat(0.0f), far + v->hull_w[i]));
    }
    const lane_f size = b->half.x + b->half.y + b->half.z;
    lane_f highest = splat(-1e30f);
    for (int i = 0; i < 4; i++) {
        const lane_3 d = sub3(v->corner[i], b->centre), a = abs3(d);
        const lane_f doubt = b->spread * (a.x + a.y + a.z + size);
        highest = max_(dot3(d, b->normal) + doubt, highest);
    }
    return and_(hit, less_(splat(0.0f), highest + b->lift));
}

static inline struct lane_bounds splat_bounds(const float *all)
{
    return (struct lane_bounds){splat3(all + BOUND_CENTRE), splat3(all + BOUND_HALF),
                                splat3(all + BOUND_NORMAL), splat(all[BOUND_SPREAD]),
                                splat(all[BOUND_LIFT])};
}

static inline lane_3 load_bound(const struct tile *tile, enum bound first, int at)
{
    return vec3_(load(tile->bounds[first] + at), load(tile->bounds[first + 1] + at),
                 load(tile->bounds[first + 2] + at));
}

/* Which of the tile's blocks the volume meets. */
static inline unsigned meets_blocks(const struct one_volume *one, const struct tile *tile)
{
    const struct lane_volume v = splat_volume(one);
    unsigned bits = 0;
    for (int at = 0; at < TILE_BLOCKS; at += LANES) {
        const struct lane_bounds b = {
            load_bound(tile, BOUND_CENTRE, at), load_bound(tile, BOUND_HALF, at),
            load_bound(tile, BOUND_NORMAL, at), load(tile->bounds[BOUND_SPREAD] + at),
            load(tile->bounds[BOUND_LIFT] + at)};
        bits |= lane_bits(meets(&v, &b)) << at;
    }
    return bits;
}

/* θ / sin θ for c = cos θ in [0, 1]; error below 3e-7. */
static inline lane_f angle_ratio(lane_f c)
{
    lane_f p = splat(-0.0111628239f);
    p = p * c + 0.0678737279f;
    p = p * c - 0.192103918f;
    p = p * c + 0.348387259f;
    p = p * c - 0.480613399f;
    p = p * c + 0.57641359f;
    p = p * c - 0.664857777f;
    p = p * c + 0.785263024f;
    p = p * c - 0.999996f;
    return p * c + 1.57079631f;
}

/* A summand of eq. 9, θ n̂·(a × b) / |a × b|, as n̂·(a × b) / (|a| |b|) times θ / sin θ: no arc
 * cosine, nothing singular for short edges. The cross product is taken between the nearer end and
 * the edge itself, where rounding is least. `ia`, `ib`: one over the lengths; `edge` = b − a. */
static inline lane_f arc(lane_3 a, lane_3 b, lane_3 edge, lane_f ia, lane_f ib, lane_3 normal)
{
    const lane_b a_nearer = less_(ib, ia);
    const lane_f near_inverse = max_(ia, ib), far_inverse = min_(ia, ib);
    const lane_3 m =
        cross3(scale3(select3(a_nearer, a, b), near_inverse), scale3(edge, far_inverse));
    const lane_f cosine = dot3(scale3(a, ia), scale3(b, ib));
    const lane_f acute = angle_ratio(min_(abs_(cosine), splat(1.0f)));
    const lane_b obtuse = less_(cosine, splat(0.0f));
    lane_f ratio = acute;
    if (any_(obtuse)) {
        const lane_f inverse_sine = 1.0f / sqrt_(max_(dot3(m, m), splat(1e-20f)));
        ratio = select_(obtuse, 3.14159265f * inverse_sine - acute, acute);
    }
    return dot3(m, normal) * ratio;
}

/* Eq. 12 for polygons that lie above the tangent plane in every lane. */
static inline lane_f whole_polygon(const lane_3 *q, const lane_3 *edges, int corners, lane_3 normal)
{
    lane_f inverse[4], sum = splat(0.0f);
    for (int i = 0; i < corners; i++)
        inverse[i] = inverse_length(q[i]);
    for (int i = 0; i < corners; i++) {
        const int j = i + 1 < corners ? i + 1 : 0;
        sum = sum + arc(q[i], q[j], edges[i], inverse[i], inverse[j], normal);
    }
    return sum;
}

/* The same for the part above: each edge is cut on its own, and one more arc in the tangent plane
 * closes the gap from where the outline leaves to where it comes back. */
static inline lane_f clipped_polygon(const lane_3 *q, const lane_3 *edges, const lane_f *heights,
                                     int corners, lane_3 normal)
{
    const lane_f zero = splat(0.0f), one = splat(1.0f);
    lane_3 leave = vec3_(zero, zero, zero), come = leave;
    lane_f sum = zero;
    lane_b gap = less_(one, zero);
    for (int i = 0; i < corners; i++) {
        const int j = i + 1 < corners ? i + 1 : 0;
        const lane_b up_i = less_(zero, heights[i]), up_j = less_(zero, heights[j]);
        const lane_b down = and_(up_i, not_(up_j)), rise = and_(up_j, not_(up_i));
        const lane_b crosses = or_(down, rise);
        const lane_f t = heights[i] / select_(crosses, heights[i] - heights[j], one);
        const lane_3 cut = add3(q[i], scale3(edges[i], t));
        const lane_3 a = select3(rise, cut, q[i]), b = select3(down, cut, q[j]);
        const lane_f share = select_(down, t, one) - select_(rise, t, zero);
        const lane_f term =
            arc(a, b, scale3(edges[i], share), inverse_length(a), inverse_length(b), normal);
        sum = sum + select_(or_(up_i, up_j), term, zero);
        leave = select3(down, cut, leave);
        come = select3(rise, cut, come);
        gap = or_(gap, crosses);
    }
    const lane_f term =
        arc(leave, come, sub3(come, leave), inverse_length(leave), inverse_length(come), normal);
    return sum + select_(gap, term, zero);
}

/* Eq. 24 with all k + 1 planes, cut by the hull where its corners were shortened; `inside` where it
 * is above 0. */
static inline lane_f falloff(const struct one_volume *v, int corners, lane_3 x, lane_f *height_over,
                             lane_b *inside)
{
    const lane_f zero = splat(0.0f);
    const lane_f height = dot3(splat3(v->face), x) + v->face_w;
    const lane_f away = 1.0f - abs_(height);
    *height_over = height;
    lane_b in = and_(less_(splat(v->lowest), height), less_(zero, away));
    lane_f g = away * v->alpha;
    for (int i = 0; i < corners; i++) {
        const lane_f t = dot3(splat3(v->edge[i]), x) + v->edge_w[i];
        in = and_(in, less_(zero, t));
        g = g * min_(t, splat(1.0f));
    }
    for (int i = 0; i < corners && v->cut > 0; i++)
        in = and_(in, less_(zero, dot3(splat3(v->hull[i]), x) + v->hull_w[i]));
    *inside = in;
    return g;
}

/* A polygon as LANES pixels see it: corners and edges about each, heights over its tangent plane.
 */
struct lane_sight {
    lane_3 q[4], edges[4], normal;
    lane_f up[4]; /* along the normal */
    lane_f heights[4], highest, least;
};

static inline __attribute__((always_inline)) void see(const lane_3 *corners, const int count,
                                                      lane_3 x, lane_3 normal, lane_f rise,
                                                      struct lane_sight *s)
{
    s->normal = normal;
    s->highest = splat(-1e30f);
    s->least = splat(1e30f);
    for (int i = 0; i < count; i++) {
        s->q[i] = sub3(corners[i], x);
        s->edges[i] = sub3(corners[i + 1 < count ? i + 1 : 0], corners[i]);
        const lane_3 size = abs3(s->q[i]);
        s->up[i] = dot3(s->q[i], normal);
        s->heights[i] = s->up[i] - rise - ROUNDING * (size.x + size.y + size.z);
        s->highest = max_(s->heights[i], s->highest);
        s->least = min_(s->heights[i], s->least);
    }
}

static inline void splat_corners(const struct one_volume *v, lane_3 corners[4])
{
    for (int i = 0; i < 4; i++)
        corners[i] = splat3(v->corner[i]);
}

/* The pixels of a vector that a volume hides something of, and what eq. 24 takes of it. */
struct lane_test {
    lane_f weight;
    lane_b inside,
        clipped; /* that want arc cosines; clipped: a corner is under the tangent plane */
};

static inline lane_f far_term(const struct lane_sight *s, int i, int j, lane_f *nearest)
{
    const lane_3 p = add3(s->q[i], s->q[j]); /* twice the middle of the edge */
    const lane_f length2 = dot3(p, p);
    *nearest = min_(length2, *nearest);
    return (s->up[i] + s->up[j]) / (length2 * length2);
}

/* The integral of eq. 2 over a polygon above the tangent plane, by the middles of the edges of its
 * triangles (exact for polynomials of degree 2) in place of arcs. From FAR of the longest edge on,
 * it is off by at most 0.4 % of the largest that a polygon of this size can hide there, by 0.09 %
 * on average, and by 0.01 % in sum. `height`: over the polygon. */
static inline __attribute__((always_inline)) lane_f far_share(const struct one_volume *v,
                                                              const int count,
                                                              const struct lane_sight *s,
                                                              lane_f height, lane_b *far)
{
    lane_f nearest = splat(1e30f);
    const lane_f diagonal = far_term(s, 2, 0, &nearest);
    lane_f sum =
        (far_term(s, 0, 1, &nearest) + far_term(s, 1, 2, &nearest) + diagonal) * v->far_weight[0];
    if (count == 4)
        sum = sum + (far_term(s, 2, 3, &nearest) + far_term(s, 3, 0, &nearest) + diagonal) *
                        v->far_weight[1];
    *far = less_(splat(v->far_limit), nearest);
    return min_(sum * abs_(height), splat(1.0f));
}

static inline void add_occlusion(struct tile *tile, int at, lane_f o)
{
    const lane_f before = load(tile->occlusion + at);
    store(tile->occlusion + at, before + (tile->product ? o * (1.0f - before) : o));
}

/* Adds what the far pixels lose; leaves the near ones in `test`. */
static inline __attribute__((always_inline)) void test_pixels(const struct one_volume *v,
                                                              const int count, struct tile *tile,
                                                              int at, struct lane_test *test)
{
    const lane_f zero = splat(0.0f);
    const lane_3 x = load3(tile->position, at);
    lane_f height;
    test->weight = falloff(v, count, x, &height, &test->inside);
    test->clipped = test->inside;
    if (!any_(test->inside))
        return;
    lane_3 corners[4];
    struct lane_sight s;
    splat_corners(v, corners);
    see(corners, count, x, load3(tile->normal, at), load(tile->rise + at), &s);
    test->inside = and_(test->inside, less_(zero, s.highest));
    const lane_b whole = and_(test->inside, less_(zero, s.least));
    test->clipped = and_(test->inside, not_(whole));
    if (v->far_limit < FAR_NOWHERE && any_(whole)) {
        lane_b far;
        const lane_f share = far_share(v, count, &s, height, &far);
        far = and_(far, whole);
        add_occlusion(tile, at, select_(far, test->weight * share, zero));
        test->inside = and_(test->inside, not_(far));
    }
}

static inline __attribute__((always_inline)) lane_f hidden_share(const struct lane_sight *s,
                                                                 const int count, int clipped)
{
    const lane_f sum = clipped ? clipped_polygon(s->q, s->edges, s->heights, count, s->normal)
                               : whole_polygon(s->q, s->edges, count, s->normal);
    return clamp_(abs_(sum) * INVERSE_TWO_PI, 0.0f, 1.0f);
}

/* Step iv.b of the algorithm: accessibility falls by g × AO; saturation comes last (finish). */
static inline __attribute__((always_inline)) void add_pixels(const struct one_volume *v,
                                                             const int count, struct tile *tile,
                                                             int at, const struct lane_test *test)
{
    if (!any_(test->inside))
        return;
    lane_3 corners[4];
    struct lane_sight s;
    splat_corners(v, corners);
    see(corners, count, load3(tile->position, at), load3(tile->normal, at), load(tile->rise + at),
        &s);
    const lane_f share = hidden_share(&s, count, any_(test->clipped));
    const lane_f o = select_(test->inside, test->weight * share, splat(0.0f));
    add_occlusion(tile, at, o);
}

/* Pairs that wait for arc cosines, so that no lane takes one for nothing: leaves and other small
 * polygons hide something of a few pixels in a block. */
struct queue {
    _Alignas(64) float corner[4][3][QUEUE], position[3][QUEUE], normal[3][QUEUE];
    _Alignas(64) float rise[QUEUE], weight[QUEUE], slot[QUEUE];
    int count;
};

enum { QUEUE_FIELDS = offsetof(struct queue, count) / sizeof(float[QUEUE]) };
enum queue_kind { QUEUE_TRIANGLES, QUEUE_QUADS, QUEUE_CLIPPED_TRIANGLES, QUEUE_CLIPPED_QUADS };
enum { QUEUE_KINDS = QUEUE_CLIPPED_QUADS + 1 };

/* Lanes of `bits` side by side, from the first on. */
struct packing {
#if LANES == 16
    __mmask16 bits;
#elif LANES == 8
    __m256i from;
#endif
    int count;
};

static inline struct packing packing_of(lane_b m)
{
    const unsigned bits = lane_bits(m);
    struct packing p = {.count = __builtin_popcount(bits)};
#if LANES == 16
    p.bits = m;
#elif LANES == 8
    int32_t from[LANES] = {0};
    int count = 0;
    for (unsigned rest = bits; rest; rest &= rest - 1)
        from[count++] = __builtin_ctz(rest);
    p.from = _mm256_loadu_si256((const __m256i *)(const void *)from);
#endif
    return p;
}

static inline void pack(const struct packing *p, lane_f x, float *to)
{
#if LANES == 16
    store(to, (lane_f)_mm512_maskz_compress_ps(p->bits, (__m512)x));
#elif LANES == 8
    store(to, (lane_f)_mm256_permutevar8x32_ps((__m256)x, p->from));
#else
    (void)p;
    store(to, x);
#endif
}

static inline void pack3(const struct packing *p, lane_3 x, float (*to)[QUEUE], int at)
{
    pack(p, x.x, to[0] + at);
    pack(p, x.y, to[1] + at);
    pack(p, x.z, to[2] + at);
}

static inline void enqueue(const struct one_volume *v, const int corners, const struct tile *tile,
                           int at, lane_f weight, lane_b who, struct queue *q)
{
    if (!any_(who))
        return;
    const struct packing p = packing_of(who);
    for (int i = 0; i < corners; i++)
        for (int k = 0; k < 3; k++)
            store(q->corner[i][k] + q->count, splat(v->corner[i][k]));
    pack3(&p, load3(tile->position, at), q->position, q->count);
    pack3(&p, load3(tile->normal, at), q->normal, q->count);
    pack(&p, load(tile->rise + at), q->rise + q->count);
    pack(&p, weight, q->weight + q->count);
    pack(&p, first_lanes() + (float)at, q->slot + q->count);
    q->count += p.count;
}

static inline lane_3 load_queue(const float (*from)[QUEUE], int at)
{
    return vec3_(load(from[0] + at), load(from[1] + at), load(from[2] + at));
}

static inline __attribute__((always_inline)) void evaluate(const struct queue *q, const int corners,
                                                           const int clipped, int begin, int end,
                                                           struct tile *tile)
{
    for (int at = begin; at < end; at += LANES) {
        lane_3 corner[4];
        struct lane_sight s;
        float o[LANES];
        for (int i = 0; i < 4; i++)
            corner[i] = load_queue(q->corner[i], at);
        see(corner, corners, load_queue(q->position, at), load_queue(q->normal, at),
            load(q->rise + at), &s);
        store(o, load(q->weight + at) * hidden_share(&s, corners, clipped));
        for (int i = 0; i < LANES && at + i < end; i++) {
            float *sum = tile->occlusion + (int)q->slot[at + i];
            *sum += tile->product ? o[i] * (1.0f - *sum) : o[i];
        }
    }
}

static void evaluate_kind(const struct queue *q, enum queue_kind kind, int end, struct tile *tile)
{
    switch (kind) {
    case QUEUE_TRIANGLES:
        evaluate(q, 3, 0, 0, end, tile);
        break;
    case QUEUE_QUADS:
        evaluate(q, 4, 0, 0, end, tile);
        break;
    case QUEUE_CLIPPED_TRIANGLES:
        evaluate(q, 3, 1, 0, end, tile);
        break;
    case QUEUE_CLIPPED_QUADS:
        evaluate(q, 4, 1, 0, end, tile);
        break;
    }
}

static inline void shift_field(float *field, int from)
{
    for (int at = 0; at < BLOCK; at += LANES)
        store(field + at, load(field + from + at));
}

/* Whole blocks of pairs; the rest, less than a block, goes to the front. */
static void drain(struct queue *q, enum queue_kind kind, struct tile *tile)
{
    const int end = q->count - q->count % BLOCK;
    tile->evaluated += (uint64_t)(end / BLOCK);
    evaluate_kind(q, kind, end, tile);
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 4; i++)
            shift_field(q->corner[i][k], end);
        shift_field(q->position[k], end);
        shift_field(q->normal[k], end);
    }
    shift_field(q->rise, end);
    shift_field(q->weight, end);
    shift_field(q->slot, end);
    q->count -= end;
}

static inline __attribute__((always_inline)) void add_block(const struct one_volume *v,
                                                            const int corners, struct tile *tile,
                                                            int block, struct queue *queues)
{
    struct lane_test tests[BLOCK / LANES];
    int pairs = 0;
    for (int i = 0; i < BLOCK / LANES; i++) {
        test_pixels(v, corners, tile, block * BLOCK + i * LANES, &tests[i]);
        pairs += __builtin_popcount(lane_bits(tests[i].inside));
    }
    tile->tested++;
    tile->pairs += (uint64_t)pairs;
    if (pairs >= DENSE) {
        tile->evaluated++;
        for (int i = 0; i < BLOCK / LANES; i++)
            add_pixels(v, corners, tile, block * BLOCK + i * LANES, &tests[i]);
        return;
    }
    struct queue *whole = queues + (corners == 3 ? QUEUE_TRIANGLES : QUEUE_QUADS);
    struct queue *clipped = queues + (corners == 3 ? QUEUE_CLIPPED_TRIANGLES : QUEUE_CLIPPED_QUADS);
    for (int i = 0; i < BLOCK / LANES && pairs > 0; i++) {
        const int at = block * BLOCK + i * LANES;
        enqueue(v, corners, tile, at, tests[i].weight,
                and_(tests[i].inside, not_(tests[i].clipped)), whole);
        enqueue(v, corners, tile, at, tests[i].weight, tests[i].clipped, clipped);
    }
    if (whole->count > QUEUE - 2 * BLOCK)
        drain(whole, (enum queue_kind)(whole - queues), tile);
    if (clipped->count > QUEUE - 2 * BLOCK)
        drain(clipped, (enum queue_kind)(clipped - queues), tile);
}

enum { VOLUME_FIELDS = sizeof(struct one_volume) / sizeof(float) };

static inline void take_lane(const float (*fields)[LANES], int lane, struct one_volume *one)
{
    float to[VOLUME_FIELDS];
    for (int f = 0; f < VOLUME_FIELDS; f++)
        to[f] = fields[f][lane];
    memcpy(one, to, sizeof to);
}

/* What is left at a batch's end; lanes of no pair repeat the first. */
static void empty_queues(struct queue *queues, struct tile *tile)
{
    for (int k = 0; k < QUEUE_KINDS; k++) {
        struct queue *q = &queues[k];
        float(*fields)[QUEUE] = q->corner[0];
        if (q->count == 0)
            continue;
        for (int f = 0; f < QUEUE_FIELDS; f++)
            for (int i = q->count; i % BLOCK; i++)
                fields[f][i] = fields[f][0];
        tile->evaluated += (uint64_t)(q->count + BLOCK - 1) / BLOCK;
        evaluate_kind(q, (enum queue_kind)k, q->count, tile);
    }
}

static void occlude(const struct batch *batch, struct tile *tile)
{
    struct queue queues[QUEUE_KINDS];
    for (int k = 0; k < QUEUE_KINDS; k++)
        queues[k].count = 0;
    const struct lane_bounds all = splat_bounds(tile->all);
    for (int at = 0; at < batch->count; at += LANES) {
        struct lane_volume volumes;
        make_volume(batch, at, &volumes);
        unsigned bits = lane_bits(and_(less_(splat(0.0f), volumes.alpha), meets(&volumes, &all)));
        float fields[VOLUME_FIELDS][LANES];
        if (bits)
            memcpy(fields, &volumes, sizeof fields);
        for (; bits; bits &= bits - 1) {
            struct one_volume one;
            take_lane((const float(*)[LANES])fields, __builtin_ctz(bits), &one);
            for (unsigned blocks = meets_blocks(&one, tile); blocks; blocks &= blocks - 1)
                if (one.triangle > 0)
                    add_block(&one, 3, tile, __builtin_ctz(blocks), queues);
                else
                    add_block(&one, 4, tile, __builtin_ctz(blocks), queues);
        }
    }
    empty_queues(queues, tile);
}

static void finish(float knee, float intensity, float contrast, float *values)
{
    for (int at = 0; at < TILE; at += LANES) {
        lane_f o = load(values + at);
        if (knee < 1) {
            const lane_f over = max_(o - knee, splat(0.0f)) * (LOG2_E / (1.0f - knee));
            const lane_f bent = 1.0f - (1.0f - knee) * exp2_(-min_(over, splat(100.0f)));
            o = select_(less_(splat(knee), o), bent, o);
        }
        lane_f open = saturate_(1.0f - intensity * o);
        if (contrast != 1)
            open = pow_(open, contrast);
        store(values + at, open);
    }
}

/* How much a sample tells about a pixel beside their distance on the screen: nothing when either
 * lies off the other's tangent plane, or they face different ways. */
static inline lane_f likeness(const struct sparse_cell *cell, int tap, lane_3 x, lane_3 normal)
{
    const lane_3 tap_normal = splat3(cell->tap_normal[tap]);
    const lane_3 d = sub3(splat3(cell->tap_position[tap]), x);
    const lane_f off = max_(abs_(dot3(d, normal)), abs_(dot3(d, tap_normal)));
    const lane_f near = max_(1.0f - off * cell->inverse_distance, splat(0.0f));
    const lane_f turned = dot3(normal, tap_normal) - cell->least_cosine;
    const lane_f alike = clamp_(turned * cell->inverse_cosine, 0.0f, 1.0f);
    return near * near * alike * alike;
}

/* Weighted sums of a plane through the samples: value over the place on the screen. */
struct lane_fit {
    lane_f w, x, y, xx, xy, yy, v, xv, yv;
    lane_f low, high; /* of the samples that count */
};

static inline void fit_add(struct lane_fit *f, lane_f w, lane_f dx, lane_f dy, float value)
{
    const lane_f wx = w * dx, wy = w * dy;
    const lane_b counts = less_(splat(FIT_LEAST), w);
    f->w = f->w + w;
    f->x = f->x + wx;
    f->y = f->y + wy;
    f->xx = f->xx + wx * dx;
    f->xy = f->xy + wx * dy;
    f->yy = f->yy + wy * dy;
    f->v = f->v + w * value;
    f->xv = f->xv + wx * value;
    f->yv = f->yv + wy * value;
    f->low = select_(counts, min_(splat(value), f->low), f->low);
    f->high = select_(counts, max_(splat(value), f->high), f->high);
}

/* The plane's value at the pixel, within those of its samples: a mean alone would make steps of
 * slopes. Slopes are damped, so that samples in a line have some, too. */
static inline lane_f fit_value(const struct lane_fit *f)
{
    const lane_f inverse = 1.0f / max_(f->w, splat(1e-30f));
    const lane_f x = f->x * inverse, y = f->y * inverse, v = f->v * inverse;
    const lane_f xx = f->xx * inverse - x * x + FIT_DAMPING;
    const lane_f yy = f->yy * inverse - y * y + FIT_DAMPING;
    const lane_f xy = f->xy * inverse - x * y;
    const lane_f xv = f->xv * inverse - x * v, yv = f->yv * inverse - y * v;
    const lane_f det = max_(xx * yy - xy * xy, splat(FIT_DAMPING * FIT_DAMPING));
    const lane_f slope_x = (xv * yy - yv * xy) / det, slope_y = (yv * xx - xv * xy) / det;
    const lane_f value = v - slope_x * x - slope_y * y;
    return select_(less_(f->low, f->high), min_(max_(value, f->low), f->high), v);
}

static void reconstruct(const struct sparse_cell *cell, float *values, float *weights)
{
    const lane_f zero = splat(0.0f);
    for (int at = 0; at < cell->pixels; at += LANES) {
        const lane_3 x = load3(cell->position, at), normal = load3(cell->normal, at);
        const lane_f px = load(cell->x + at), py = load(cell->y + at);
        struct lane_fit fit = {zero, zero, zero, zero,        zero,        zero,
                               zero, zero, zero, splat(2.0f), splat(-1.0f)};
        lane_f most = zero;
        for (int tap = 0; tap < cell->taps; tap++) {
            const lane_f dx = cell->tap_x[tap] - px, dy = cell->tap_y[tap] - py;
            const lane_f w = exp2_(max_((dx * dx + dy * dy) * -cell->sharpness, splat(-60.0f)));
            const lane_f alike = likeness(cell, tap, x, normal) + 1e-6f;
            fit_add(&fit, w * alike, dx, dy, cell->tap_value[tap]);
            most = max_(w, most);
        }
        store(values + at, fit_value(&fit));
        store(weights + at, fit.w / max_(most, splat(1e-30f)));
    }
}

const struct volume_kernels KERNELS = {occlude, finish, reconstruct};
