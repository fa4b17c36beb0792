/* Spherical obscurance on a sparse grid around given boxes, for tools: values anywhere inside.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2. */
#ifndef BAKE_VOLUME_H
#define BAKE_VOLUME_H

#include "base/base.h"

#include <cranny/bake.h>

#define BRICK_SIDE 4
#define BRICK_POINTS (BRICK_SIDE * BRICK_SIDE * BRICK_SIDE)
#define VOLUME_NONE UINT32_MAX

/* The lower of the two levels: a block of grid points, of which some are there. */
struct brick {
    int32_t at[3];                 /* of its first point, in bricks */
    uint32_t points[BRICK_POINTS]; /* numbers of points; VOLUME_NONE */
};

struct volume {
    double spacing; /* metres */
    struct brick *bricks;
    size_t brick_count, brick_capacity;
    uint32_t *slots;   /* hash of bricks: number + 1; 0: free */
    size_t slot_count; /* a power of two */
    float (*positions)[3];
    size_t point_count, point_capacity;
    float (*harmonics)[2][9]; /* convolved: visibility by normal */
    uint8_t *valid;           /* not buried */
    uint64_t buried;
};

/* Lay out the points: every place inside one of the boxes (min xyz, max xyz) has its eight
 * neighbours. `spacing` 0: such that a box has about 256 points. CRANNY_USAGE when that makes more
 * than 2^26 points, CRANNY_MEMORY. */
enum cranny_status volume_create(const double (*boxes)[6], size_t box_count, double spacing,
                                 struct volume *volume, struct cranny_error *why);

/* Fill it with rays from the points. Progress stage "volume". */
enum cranny_status volume_trace(struct volume *volume, const struct cranny_tracer *tracer,
                                const struct cranny_bake_params *params, struct cranny_error *why);

/* Trilinear; visibility for a unit normal at both distances. False: no valid point is around. */
bool volume_sample(const struct volume *volume, const double position[3], const double normal[3],
                   float visibility[2]);

uint64_t volume_bytes(const struct volume *volume);
void volume_free(struct volume *volume);

#endif
