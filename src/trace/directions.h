/* Directions, cosine-distributed or all round: what is the same for all points, and its turn for
 * one point. */
#ifndef TRACE_DIRECTIONS_H
#define TRACE_DIRECTIONS_H

#include "trace/gather.h"
#include "trace/tracer.h"

struct directions {
    enum cranny_sampler sampler;
    bool sphere;
    int count, first; /* rays in all; the first of them cover the hemisphere by themselves */
    uint32_t seed;
    double shift[2];                /* from the seed, of the spiral's place in its cell */
    double cell[2][2];              /* spiral: rings and turns of its two shortest steps */
    float *cosines, *sines, *rings; /* spiral: of ray i's angle, and its number along the radius */
    uint32_t *sobol[2];             /* unscrambled */
};

/* `sphere`: even over all directions, else cosine-distributed over the hemisphere of the normal.
 * `first` below `count`: rays 0 … first−1 are a spread subset. False: out of memory. */
bool directions_create(struct directions *directions, enum cranny_sampler sampler, bool sphere,
                       int count, int first, uint32_t seed);
void directions_destroy(struct directions *directions);

/* What turns the set for one point. */
struct direction_frame {
    float tangent[3], bitangent[3], normal[3], face_normal[3];
    float phase;
    uint32_t id;
};

struct direction_frame direction_frame(const struct directions *directions,
                                       const struct gather_point *point);

/* Rays `from` … `from + count − 1` of a point into a block; none is below the face;
 * a face normal of 0 has no below. */
void directions_fill(const struct directions *directions, const struct direction_frame *frame,
                     int from, int count, struct ray_block *block);

#endif
