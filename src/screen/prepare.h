/* From a G-buffer to canvases, and the memory that they live in. */
#ifndef SCREEN_PREPARE_H
#define SCREEN_PREPARE_H

#include "base/base.h"
#include "screen/kernels.h"

/* What a workspace keeps, by purpose. */
enum slot {
    SLOT_DEPTH,
    SLOT_NORMALS,
    SLOT_EDGES,
    SLOT_HALF_DEPTH,
    SLOT_HALF_NORMALS,
    SLOT_HALF_RAW,
    SLOT_RAW,
    SLOT_FIRST,
    SLOT_SECOND,
    SLOT_COUNT
};

struct cranny_workspace {
    void *memory[SLOT_COUNT];
    size_t bytes[SLOT_COUNT];
};

/* At least `count` times `size` bytes, 64-byte aligned, of any content; NULL when they do not fit.
 */
void *workspace_get(struct cranny_workspace *workspace, enum slot slot, size_t count, size_t size);
void workspace_clear(struct cranny_workspace *workspace);

/* What may be read of a G-buffer, and where the viewport lies in that. */
struct frame_window {
    struct cranny_rect readable; /* of the buffers */
    struct cranny_rect viewport; /* within `readable` */
};
struct frame_window frame_window(const struct cranny_gbuffer *gbuffer);

/* A G-buffer's sample plane 0 as a canvas of its readable part; depths that are none become sky and
 * are counted. Normals are decoded, or reconstructed where there are none (everywhere with
 * `face_normals`). */
enum cranny_status canvas_prepare(struct canvas *canvas, const struct cranny_gbuffer *gbuffer,
                                  bool face_normals, const struct kernels *kernels, int threads,
                                  struct cranny_workspace *workspace, uint64_t *invalid,
                                  uint64_t *valid, struct cranny_error *why);

/* Every second pixel of every second row. */
enum cranny_status canvas_halve(const struct canvas *full, struct canvas *half, int threads,
                                struct cranny_workspace *workspace, struct cranny_error *why);

/* A plane of values for a canvas; its halo holds 1. */
float *canvas_plane(const struct canvas *canvas, struct cranny_workspace *workspace,
                    enum slot slot);

/* The pixels of a plane begin here. */
static inline size_t canvas_cells(const struct canvas *canvas)
{
    return (size_t)canvas->stride * (size_t)(canvas->height + 2 * HALO_ROWS);
}

/* Row of one sample plane of the G-buffer's depth. */
static inline const float *gbuffer_depth_row(const struct cranny_gbuffer *gbuffer, int sample,
                                             int y)
{
    const size_t stride =
        gbuffer->depth_stride ? gbuffer->depth_stride : (size_t)gbuffer->width * sizeof(float);
    const size_t plane = gbuffer->depth_sample_stride ? gbuffer->depth_sample_stride
                                                      : stride * (size_t)gbuffer->height;
    return (const float *)(const void *)((const char *)gbuffer->depth + (size_t)sample * plane +
                                         (size_t)y * stride);
}

static inline const char *gbuffer_normal_row(const struct cranny_gbuffer *gbuffer, int sample,
                                             int y)
{
    const size_t stride = gbuffer->normal_stride ? gbuffer->normal_stride
                                                 : (size_t)gbuffer->width *
                                                       cranny_normal_bytes(gbuffer->normal_format);
    const size_t plane = gbuffer->normal_sample_stride ? gbuffer->normal_sample_stride
                                                       : stride * (size_t)gbuffer->height;
    return (const char *)gbuffer->normal + (size_t)sample * plane + (size_t)y * stride;
}

static inline bool depth_is_surface(float depth)
{
    return depth > 0 && depth < SKY_LIMIT;
}

#endif
