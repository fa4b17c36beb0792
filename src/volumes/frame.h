/* Inside the volumes layer: a frame being rendered, its points, and its tiles. */
#ifndef VOLUMES_FRAME_H
#define VOLUMES_FRAME_H

#include "base/watch.h"
#include "screen/prepare.h"
#include "volumes/kernels.h"
#include "volumes/volumes.h"

struct volume_frame {
    const struct cranny_volumes *volumes;
    const struct cranny_volumes_params *params;
    const struct volume_kernels *kernels;
    struct canvas canvas;                      /* depth and normals */
    struct cranny_rect viewport;               /* within the canvas */
    double scale_x, shift_x, scale_y, shift_y; /* pixel (x, y) of the viewport to view space */
    const double *world_from_view;
    float delta;      /* metres */
    float bias;       /* metres for each one of view-space w: of depth, or 1 (orthographic) */
    float rise_least; /* metres: what floats lose in a scene of this size */
    int threads;
    struct watch *watch;
    struct cranny_volumes_report *counts;
};

struct volume_point {
    double position[3]; /* world, relative to the volumes' centre */
    float normal[3];    /* world, unit */
    float w;            /* what projects it: its depth; 1 under an orthographic camera */
};

/* The point that a pixel of the viewport shows; false: sky. (frame.c) */
bool frame_point(const struct volume_frame *frame, int x, int y, struct volume_point *point);

/* Memory of one thread. */
struct tile_work {
    struct tile tile;
    struct batch batch;
    struct sparse_cell cell;
    struct volume_point points[TILE];
    uint64_t pixels, candidates;
};

struct pixel {
    int x, y; /* of the viewport; x −1: none */
};

/* Visibility of TILE pixels, in blocks of BLOCK neighbours; the more they share, the fewer volumes
 * are looked at. 1 for sky and for what is no pixel. (tile.c) */
void tile_render(const struct volume_frame *frame, struct tile_work *work,
                 const struct pixel *pixels, float *values);

/* Every pixel, or sparse samples and what lies between them; `values`: the viewport, tight.
 * `work`: one for each thread. (render.c, sparse.c) */
void render_dense(const struct volume_frame *frame, struct tile_work *work, float *values);
enum cranny_status render_sparse(const struct volume_frame *frame, struct tile_work *work,
                                 float *values, struct cranny_error *why);

/* Pixel `slot` of a tile in blocks of 4 × 4: its place in 16 × 16. */
static inline struct pixel tile_place(int slot)
{
    const int block = slot / BLOCK, inside = slot % BLOCK;
    return (struct pixel){block % 4 * 4 + inside % 4, block / 4 * 4 + inside / 4};
}

#endif
