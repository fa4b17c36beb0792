#include "trace/directions.h"

#include "base/sequence.h"
#include "trace/portable.h"

struct spiral_ray {
    uint64_t key; /* part of the set, then the place on a Z-order curve: neighbours stay together */
    int ring;
};

static uint64_t spread_bits(uint32_t x)
{
    uint64_t spread = 0;
    for (int bit = 0; bit < 16; bit++)
        spread |= (uint64_t)(x >> bit & 1) << (2 * bit);
    return spread;
}

static int compare_rays(const void *a, const void *b)
{
    const struct spiral_ray *x = a, *y = b;
    return x->key != y->key ? (x->key < y->key ? -1 : 1) : x->ring - y->ring;
}

static double spiral_turns(int ring)
{
    return fraction(ring * GOLDEN_RATIO_FRACTION);
}

/* Which rings the spread subset takes: one of every `stride`, moving along within them, since equal
 * steps of the golden angle by 2, 3 or 5 would leave spokes. */
static bool in_subset(int ring, int stride)
{
    return ring % stride == ring / stride * 2 % stride;
}

static bool spiral_create(struct directions *d)
{
    struct spiral_ray *rays = alloc_array((size_t)d->count, sizeof *rays);
    if (!rays)
        return false;
    const int stride = d->first < d->count ? d->count / d->first : 1;
    int taken = 0;
    for (int i = 0; i < d->count; i++) {
        float x, y;
        turn_vector(spiral_turns(i), &x, &y);
        const float radius = sqrtf(((float)i + 0.5f) / (float)d->count);
        const bool early = d->first == d->count || (taken < d->first && in_subset(i, stride));
        taken += early;
        rays[i].ring = i;
        rays[i].key = (uint64_t)!early << 32 | spread_bits((uint32_t)((x * radius + 1) * 32767)) |
                      spread_bits((uint32_t)((y * radius + 1) * 32767)) << 1;
    }
    d->first = taken;
    qsort(rays, (size_t)d->count, sizeof *rays, compare_rays);
    for (int i = 0; i < d->count; i++) {
        turn_vector(spiral_turns(rays[i].ring), &d->cosines[i], &d->sines[i]);
        d->rings[i] = (float)rays[i].ring;
    }
    free(rays);
    return true;
}

bool directions_create(struct directions *directions, enum cranny_sampler sampler, int count,
                       int first, uint32_t seed)
{
    *directions = (struct directions){
        .sampler = sampler, .count = count, .first = first, .seed = hash_u32(seed + 0x51ed270bu)};
    struct directions *d = directions;
    d->shift[0] = unit_from_u32(hash_combine(d->seed, 1));
    d->shift[1] = unit_from_u32(hash_combine(d->seed, 2));
    if (sampler == CRANNY_SAMPLER_SPIRAL) {
        d->cosines = alloc_aligned((size_t)count, sizeof(float));
        d->sines = alloc_aligned((size_t)count, sizeof(float));
        d->rings = alloc_aligned((size_t)count, sizeof(float));
        if (d->cosines && d->sines && d->rings && spiral_create(d))
            return true;
    } else {
        d->sobol[0] = alloc_aligned((size_t)count, sizeof(uint32_t));
        d->sobol[1] = alloc_aligned((size_t)count, sizeof(uint32_t));
        for (int i = 0; d->sobol[0] && d->sobol[1] && i < count; i++)
            for (int k = 0; k < 2; k++)
                d->sobol[k][i] = sobol_u32((uint32_t)i, k);
        if (d->sobol[0] && d->sobol[1])
            return true;
    }
    directions_destroy(directions);
    return false;
}

void directions_destroy(struct directions *directions)
{
    free(directions->cosines);
    free(directions->sines);
    free(directions->rings);
    free(directions->sobol[0]);
    free(directions->sobol[1]);
    *directions = (struct directions){0};
}

/* Based on: Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin, Building an Orthonormal
 * Basis, Revisited, 2017: no branch, no singular direction. */
static void tangents(const float n[3], float t[3], float b[3])
{
    const float sign = copysignf(1, n[2]);
    const float a = -1 / (sign + n[2]);
    const float c = n[0] * n[1] * a;
    t[0] = 1 + sign * n[0] * n[0] * a;
    t[1] = sign * c;
    t[2] = -sign * n[0];
    b[0] = c;
    b[1] = sign + n[1] * n[1] * a;
    b[2] = -n[1];
}

struct direction_frame direction_frame(const struct directions *directions,
                                       const struct gather_point *point)
{
    struct direction_frame frame = {.id = point->id};
    memcpy(frame.normal, point->normal, sizeof frame.normal);
    memcpy(frame.face_normal, point->face_normal, sizeof frame.face_normal);
    tangents(point->normal, frame.tangent, frame.bitangent);
    if (directions->sampler != CRANNY_SAMPLER_SPIRAL)
        return frame;
    /* Turn and phase of successive points are themselves a low-discrepancy set. */
    double place[2];
    r2_point(point->id, directions->shift, place);
    float c, s;
    turn_vector(place[0], &c, &s);
    frame.phase = (float)place[1];
    for (int k = 0; k < 3; k++) {
        const float t = frame.tangent[k], b = frame.bitangent[k];
        frame.tangent[k] = c * t + s * b;
        frame.bitangent[k] = c * b - s * t;
    }
    return frame;
}

/* The disc below the hemisphere: x and y; z follows (Malley). */
static void fill_spiral(const struct directions *d, const struct direction_frame *frame, int from,
                        int count, float *x, float *y, float *z)
{
    const float scale = 1 / (float)d->count, phase = frame->phase;
    const float *cosines = d->cosines + from, *sines = d->sines + from, *rings = d->rings + from;
    for (int i = 0; i < count; i++) {
        const float area = fminf((rings[i] + phase) * scale, 1);
        const float radius = sqrtf(area);
        x[i] = radius * cosines[i];
        y[i] = radius * sines[i];
        z[i] = sqrtf(1 - area);
    }
}

static void fill_polar(const struct directions *d, const struct direction_frame *frame, int from,
                       int count, float *x, float *y, float *z)
{
    const uint32_t base = hash_combine(d->seed, frame->id);
    const uint32_t seeds[2] = {hash_combine(base, 3), hash_combine(base, 4)};
    for (int i = 0; i < count; i++) {
        float u[2];
        for (int k = 0; k < 2; k++)
            u[k] = unit_from_u32(d->sampler == CRANNY_SAMPLER_SOBOL
                                     ? owen_scramble(d->sobol[k][from + i], seeds[k])
                                     : hash_combine(seeds[k], (uint32_t)(from + i)));
        float c, s;
        turn_vector(u[1], &c, &s);
        const float radius = sqrtf(u[0]);
        x[i] = radius * c;
        y[i] = radius * s;
        z[i] = sqrtf(1 - u[0]);
    }
}

void directions_fill(const struct directions *directions, const struct direction_frame *frame,
                     int from, int count, struct ray_block *block)
{
    float *x = block->x, *y = block->y, *z = block->z;
    if (directions->sampler == CRANNY_SAMPLER_SPIRAL)
        fill_spiral(directions, frame, from, count, x, y, z);
    else
        fill_polar(directions, frame, from, count, x, y, z);
    const float *t = frame->tangent, *b = frame->bitangent, *n = frame->normal;
    const float *f = frame->face_normal;
    for (int i = 0; i < count; i++) {
        const float dx = x[i] * t[0] + y[i] * b[0] + z[i] * n[0];
        const float dy = x[i] * t[1] + y[i] * b[1] + z[i] * n[1];
        const float dz = x[i] * t[2] + y[i] * b[2] + z[i] * n[2];
        const float below = fminf(dx * f[0] + dy * f[1] + dz * f[2], 0);
        x[i] = dx - 2 * below * f[0];
        y[i] = dy - 2 * below * f[1];
        z[i] = dz - 2 * below * f[2];
    }
    block->ids = hash_combine(directions->seed, frame->id) + (uint32_t)from;
}
