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

/* Run `body` for spans of a few rows each, side by side: y_begin, y_end of `rect`. */
#define PIPELINE_ROWS 8
#define FOR_SPANS(RECT, THREADS, SPAN, BODY)                                                       \
    do {                                                                                           \
        const int span_threads = (THREADS), span_end = (RECT).y + (RECT).height;                   \
        _Pragma(                                                                                   \
            "omp parallel for schedule(dynamic) num_threads(span_threads)") for (int span_y =      \
                                                                                     (RECT).y;     \
                                                                                 span_y <          \
                                                                                 span_end;         \
                                                                                 span_y +=         \
                                                                                 PIPELINE_ROWS)    \
        {                                                                                          \
            const struct span SPAN = {(RECT).x, (RECT).x + (RECT).width, span_y,                   \
                                      min_int(span_y + PIPELINE_ROWS, span_end)};                  \
            BODY;                                                                                  \
        }                                                                                          \
    } while (0)

#endif
