/* The stages of a frame, and what they hand on. */
#ifndef SCREEN_PIPELINE_H
#define SCREEN_PIPELINE_H

#include "screen/constants.h"
#include "screen/prepare.h"

struct pipeline {
    const struct cranny_gbuffer *gbuffer;
    const struct cranny_screen_params *params;
    const struct kernels *kernels;
    struct cranny_workspace *workspace;
    int threads;
    struct frame_window window;
    struct canvas canvas;
    struct screen_constants constants;
    struct cranny_rect region; /* of the canvas: the viewport and what the filters read beyond it */
    float *raw;                /* estimated, unfiltered */
    float *filtered;
    bool any_range; /* values are not visibility: beyond [0, 1], too */
};

/* Pixels beyond the viewport that the filters of `params` may read. */
int filter_reach(const struct cranny_screen_params *params, int viewport_height);

/* Connections between the canvas' pixels, over the region: for all filters of the frame. (filter.c)
 */
enum cranny_status pipeline_edges(struct pipeline *pipeline, struct cranny_error *why);

/* raw → filtered, over the region. (filter.c) */
enum cranny_status filter_apply(struct pipeline *pipeline, struct cranny_error *why);

/* Values of the viewport: each sample's, or their mean; rows `stride` bytes apart. (resolve.c) */
void resolve_mean(const struct pipeline *pipeline, float *visibility, size_t stride);
void resolve_samples(const struct pipeline *pipeline, float *visibility, size_t stride);

/* How a rectangle is cut for the threads. */
struct tile_size {
    int width, height;
};
/* Passes along rows take whole ones; estimators squarer tiles, so that the surroundings that they
 * sample stay in the second-level cache. */
static const struct tile_size row_tiles = {CRANNY_SIDE_MAX * 2, 16};
static const struct tile_size square_tiles = {128, 64};

static inline int tile_columns(const struct cranny_rect *rect, struct tile_size size)
{
    return (rect->width + size.width - 1) / size.width;
}

static inline int tile_count(const struct cranny_rect *rect, struct tile_size size)
{
    return tile_columns(rect, size) * ((rect->height + size.height - 1) / size.height);
}

static inline struct span tile_span(const struct cranny_rect *rect, struct tile_size size, int tile)
{
    const int columns = tile_columns(rect, size);
    const int x = rect->x + tile % columns * size.width;
    const int y = rect->y + tile / columns * size.height;
    return (struct span){x, min_int(x + size.width, rect->x + rect->width), y,
                         min_int(y + size.height, rect->y + rect->height)};
}

/* Run BODY for each tile of RECT, side by side. */
#define FOR_TILES(RECT, SIZE, THREADS, SPAN, BODY)                                                 \
    do {                                                                                           \
        const int tile_threads = (THREADS), tile_end = tile_count(&(RECT), SIZE);                  \
        _Pragma("omp parallel for schedule(dynamic) num_threads(tile_threads)") for (int tile = 0; \
                                                                                     tile <        \
                                                                                     tile_end;     \
                                                                                     tile++)       \
        {                                                                                          \
            const struct span SPAN = tile_span(&(RECT), SIZE, tile);                               \
            BODY;                                                                                  \
        }                                                                                          \
    } while (0)

#endif
