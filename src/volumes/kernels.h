/* What the kernels read and write: the pixels of a tile, volumes near it, and the table of builds.
 *
 * Lengths are in units of δ and places relative to the tile's origin, so that the same numbers
 * stand for every scale of a scene. */
#ifndef VOLUMES_KERNELS_H
#define VOLUMES_KERNELS_H

#include "volumes/sparse.h"

#include <cranny/volumes.h>

#define BLOCK 16                   /* pixels evaluated together: one vector of AVX-512 */
#define TILE_BLOCKS 16             /* tested against a volume together */
#define TILE (BLOCK * TILE_BLOCKS) /* pixels */
#define BATCH 512                  /* volumes handed to a kernel at once; a multiple of 16 */

/* Bounds of some pixels' positions and tangent planes, for tests that must not lose any. A pixel's
 * height under a corner c is at most (c − centre)·normal + lift + spread × |c − pixel|. */
enum bound {
    BOUND_CENTRE,
    BOUND_HALF = BOUND_CENTRE + 3,
    BOUND_NORMAL = BOUND_HALF + 3,
    BOUND_SPREAD = BOUND_NORMAL + 3,
    BOUND_LIFT,
    BOUND_COUNT
};

struct tile {
    _Alignas(64) float position[3][TILE]; /* unused ones repeat a used one */
    _Alignas(64) float normal[3][TILE];
    _Alignas(64) float rise[TILE]; /* height over the tangent plane under which nothing counts */
    _Alignas(64) float occlusion[TILE]; /* sum; with CRANNY_COMBINE_PRODUCT: 1 − the product */
    _Alignas(64) float bounds[BOUND_COUNT][TILE_BLOCKS]; /* of blocks; unused ones meet nothing */
    float all[BOUND_COUNT];                              /* of the tile */
    uint64_t tested, evaluated, pairs;
    bool product;
};

/* Volumes as they come from the tree: polygons. A triangle's fourth corner is its first. */
struct batch {
    _Alignas(64) float corner[4][3][BATCH];
    _Alignas(64) float alpha[BATCH];  /* mean alpha: ᾱ of eq. 24 */
    _Alignas(64) float lowest[BATCH]; /* height over the polygon below which it does not hide: 0, or
                                         −1 where the back does, too */
    _Alignas(64) float triangle[BATCH]; /* 1, or 0 for quads */
    int count;
};

struct volume_kernels {
    /* Add the batch's occlusion to the tile's, in the batch's order. */
    void (*occlude)(const struct batch *batch, struct tile *tile);
    /* Occlusion to visibility, in place: the combination's curve, intensity, contrast. */
    void (*finish)(float knee, float intensity, float contrast, float *values);
    /* Sparse samples to pixels. (sparse.h) */
    void (*reconstruct)(const struct sparse_cell *cell, float *values, float *weights);
};

extern const struct volume_kernels volume_kernels_portable;
#if CRANNY_X86
extern const struct volume_kernels volume_kernels_avx2, volume_kernels_avx512;
#endif

/* The build to run for a wish; falls back to what the machine has. */
const struct volume_kernels *volume_kernels_choose(enum cranny_isa wish, enum cranny_isa *chosen);

#endif
