/* What a ray passes on its way, and what that makes of ρ. */
#ifndef TRACE_PASSAGE_H
#define TRACE_PASSAGE_H

#include "base/base.h"

#include <cranny/trace.h>

/* As many crossings, and boxes, are kept in order; see struct passage. */
#define PASSAGE_MAX 64

struct passage_crossing {
    float distance;
    uint32_t instance;
};

struct passage_fog {
    float enter, leave, rate; /* rate: optical depth per metre */
};

/* Sorted: the nearest. What is beyond them in number is taken together, where the first of it is.
 * That changes nothing but where in a long queue shares are taken. */
struct passage {
    int crossing_count, fog_count;
    struct passage_crossing crossings[PASSAGE_MAX];
    struct passage_fog fog[PASSAGE_MAX];
    int further_crossings;
    float further_crossing; /* metres */
    float further_depth, further_fog;
};

static inline void passage_clear(struct passage *passage)
{
    passage->crossing_count = passage->fog_count = passage->further_crossings = 0;
    passage->further_depth = 0;
    passage->further_crossing = passage->further_fog = INFINITY;
}

static inline bool passage_empty(const struct passage *passage)
{
    return !passage->crossing_count && !passage->fog_count;
}

/* A crossing nearer than `apart` to another one of the instance is the same: Embree may report a
 * triangle twice, two triangles their common edge, and leaves may be modelled with two faces. */
void passage_cross(struct passage *passage, float distance, uint32_t instance, float apart);
void passage_enter(struct passage *passage, float enter, float leave, float rate);

/* How a passage is weighed. */
struct passage_rules {
    enum cranny_dimming dimming;
    enum cranny_kernel kernel;
    float distances[2]; /* r of the kernel */
    float opacity;      /* share that a crossing takes */
};

/* values[k]: ρ of the ray's hit on entry, of all that takes from it on return. */
void passage_apply(const struct passage *passage, const struct passage_rules *rules,
                   float values[2]);

#endif
