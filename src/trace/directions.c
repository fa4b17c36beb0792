#include "trace/directions.h"

#include "base/portable.h"
#include "base/sequence.h"

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

/* The two steps, in rings and turns, that span the spiral's cell: Fibonacci numbers of rings, since
 * these come back nearest to the same angle. Which two are the shortest depends on the radius; 1.4
 * √count fits its middle. */
static void spiral_cell(struct directions *d)
{
    int steps[2] = {1, 1};
    while (steps[1] < 1.4 * sqrt((double)d->count)) {
        const int next = steps[0] + steps[1];
        steps[0] = steps[1];
        steps[1] = next;
    }
    for (int k = 0; k < 2; k++) {
        const double turn = steps[k] * GOLDEN_RATIO_FRACTION;
        d->cell[k][0] = steps[k];
        d->cell[k][1] = turn - floor(turn + 0.5);
    }
}

static void disc_point(double ring, double count, double turns, float point[2])
{
    turn_vector(fraction(turns), &point[0], &point[1]);
    const float radius = sqrtf((float)((ring + 0.5) / count));
    point[0] *= radius;
    point[1] *= radius;
}

/* Mark `first` rings that cover the disc by themselves: one from every run of rings, so that no
 * radius is left out, and of each run the one farthest from those taken. Equal steps through the
 * spiral would leave spokes. */
static void mark_subset(const struct directions *d, bool *early)
{
    enum { MEMORY = 48 }; /* taken before these: rings too far inside to matter */
    float taken[MEMORY][2];
    for (int j = 0; j < d->first; j++) {
        const int run = (int)((int64_t)j * d->count / d->first);
        const int end = (int)((int64_t)(j + 1) * d->count / d->first);
        float farthest = -1, point[2] = {0, 0};
        int best = run;
        for (int i = run; i < end; i++) {
            float p[2], nearest = 4;
            disc_point(i, d->count, spiral_turns(i), p);
            for (int k = 0; k < min_int(j, MEMORY); k++) {
                const float x = p[0] - taken[k][0], y = p[1] - taken[k][1];
                nearest = fminf(nearest, x * x + y * y);
            }
            if (nearest > farthest) {
                farthest = nearest;
                best = i;
                memcpy(point, p, sizeof point);
            }
        }
        early[best] = true;
        memcpy(taken[j % MEMORY], point, sizeof point);
    }
}

static bool spiral_create(struct directions *d)
{
    struct spiral_ray *rays = alloc_array((size_t)d->count, sizeof *rays);
    bool *early = alloc_array((size_t)d->count, sizeof *early);
    if (!rays || !early) {
        free(rays);
        free(early);
        return false;
    }
    spiral_cell(d);
    if (d->first < d->count)
        mark_subset(d, early);
    d->first = 0;
    for (int i = 0; i < d->count; i++) {
        float p[2];
        disc_point(i, d->count, spiral_turns(i), p);
        rays[i].ring = i;
        rays[i].key = (uint64_t)!early[i] << 32 | spread_bits((uint32_t)((p[0] + 1) * 32767)) |
                      spread_bits((uint32_t)((p[1] + 1) * 32767)) << 1;
        d->first += early[i];
    }
    d->first = d->first ? d->first : d->count;
    qsort(rays, (size_t)d->count, sizeof *rays, compare_rays);
    for (int i = 0; i < d->count; i++) {
        turn_vector(spiral_turns(rays[i].ring), &d->cosines[i], &d->sines[i]);
        d->rings[i] = (float)rays[i].ring;
    }
    free(rays);
    free(early);
    return true;
}

bool directions_create(struct directions *directions, enum cranny_sampler sampler, bool sphere,
                       int count, int first, uint32_t seed)
{
    *directions = (struct directions){.sampler = sampler,
                                      .sphere = sphere,
                                      .count = count,
                                      .first = first,
                                      .seed = hash_u32(seed + 0x51ed270bu)};
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
    /* The spiral is a lattice in (ring, turn); successive points' shifts spread evenly over its
     * cell, so that the rays of neighbours interleave. */
    double place[2];
    r2_point(point->id, directions->shift, place);
    const double ring = place[0] * directions->cell[0][0] + place[1] * directions->cell[1][0];
    const double turn = place[0] * directions->cell[0][1] + place[1] * directions->cell[1][1];
    float c, s;
    turn_vector(fraction(turn - floor(ring) * GOLDEN_RATIO_FRACTION + (double)(1 << 20)), &c, &s);
    frame.phase = (float)fraction(ring);
    for (int k = 0; k < 3; k++) {
        const float t = frame.tangent[k], b = frame.bitangent[k];
        frame.tangent[k] = c * t + s * b;
        frame.bitangent[k] = c * b - s * t;
    }
    return frame;
}

/* A share of the area to the distance from the axis and the height along it: of the disc below the
 * hemisphere, which makes it cosine-distributed (Malley), or of the sphere (Archimedes). */
static inline void lift(bool sphere, float area, float *radius, float *height)
{
    *radius = sphere ? 2 * sqrtf(area * (1 - area)) : sqrtf(area);
    *height = sphere ? 1 - 2 * area : sqrtf(1 - area);
}

static void fill_spiral(const struct directions *d, const struct direction_frame *frame, int from,
                        int count, float *x, float *y, float *z)
{
    const bool sphere = d->sphere;
    const float scale = 1 / (float)d->count, phase = frame->phase;
    const float *cosines = d->cosines + from, *sines = d->sines + from, *rings = d->rings + from;
    for (int i = 0; i < count; i++) {
        float radius;
        lift(sphere, fminf((rings[i] + phase) * scale, 1), &radius, &z[i]);
        x[i] = radius * cosines[i];
        y[i] = radius * sines[i];
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
        float c, s, radius;
        turn_vector(u[1], &c, &s);
        lift(d->sphere, u[0], &radius, &z[i]);
        x[i] = radius * c;
        y[i] = radius * s;
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
