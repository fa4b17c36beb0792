/* The filters of the screen-space methods, for a buffer of one's own: noisy shadows, obscurance or
 * light, one float a pixel, that must be smoothed within surfaces and not across them.
 *
 * Edges are found once a frame from the G-buffer and packed into a byte a pixel; each pass then
 * reads a float and a byte a tap instead of depths and normals.
 *
 *     struct cranny_edges *edges;
 *     if (cranny_edges_create(&gbuffer, NULL, &edges, &why)) return complain(&why);
 *     cranny_filter_bilateral(edges, NULL, noisy, 0, smooth, 0, &why);
 *     cranny_edges_destroy(&edges);
 *
 * What holds for all of them:
 * Shape: width × height floats of the G-buffer's viewport, rows `…_stride` bytes apart (0: tight).
 * Output may be the input itself.
 * Values: of any size; NaN and infinities count as 0. What sky pixels hold is not read (1 stands
 * for it where a filter knows no edges) and is handed through as it came.
 * Result: same bits whatever `isa` and `threads`. Each output pixel is a mean of its inputs, so a
 * constant stays one (but for bloom's gains).
 * Status: CRANNY_USAGE for NULL pointers, strides or fields out of range, saying which;
 * CRANNY_MEMORY. The output is unspecified on failure.
 *
 * Based on: Bavoil, Sainz, Image-Space Horizon-Based Ambient Occlusion, 2009, and McGuire et al.,
 * The Alchemy Screen-Space Ambient Obscurance Algorithm, 2011 (cross-bilateral, made separable);
 * Kajalin, Screen-Space Ambient Occlusion, 2009 (4 × 4); Fox, Compton, Ambient Occlusive Crease
 * Shading, 2008 (blooms). */
#ifndef CRANNY_FILTER_H
#define CRANNY_FILTER_H

#include <cranny/screen.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Ranges, units and defaults: cranny_filter_param_table. NULL instead means the defaults. */
struct cranny_filter_params {
    /* Read by cranny_edges_create and _update; what filters then do follows from the edges. */
    float tolerance_world; /* metres from each other's plane at which surfaces are apart; half a
                              pixel's size is added, so that distance does not make edges */
    float normal_cosine;   /* of the angle between normals at which surfaces are apart */
    /* Read by cranny_filter_bilateral. */
    int reach_px; /* taps on each side */
    /* Read by cranny_filter_bloom. */
    float wide_px, near_px;     /* deviations of the two Gaussians */
    float wide_gain, near_gain; /* factors on what each of them blurs */
    float blend;                /* share of the near one, 0 … 1 */
    bool edge_bloom;            /* within edges; false: across everything */
    /* Read by all. */
    int isa;                            /* enum cranny_isa */
    int threads;                        /* 0: all cores */
    struct cranny_workspace *workspace; /* not in the table; memory that successive calls reuse, one
                                           at a time; NULL: memory for each call only */
};
CRANNY_API struct cranny_filter_params cranny_filter_params_default(void);
CRANNY_API const struct cranny_param_table *cranny_filter_param_table(void);

/* Where surfaces end in one frame. Owns all it needs: the G-buffer may go away. Any number of
 * threads may filter with one at a time, as long as none updates it. 17 bytes a pixel. */
struct cranny_edges;

/* From the viewport of `gbuffer` (the guard band is not read; of several samples the first).
 * Without normals they are reconstructed from depth. *edges is NULL on failure. */
CRANNY_API enum cranny_status cranny_edges_create(const struct cranny_gbuffer *gbuffer,
                                                  const struct cranny_filter_params *params,
                                                  struct cranny_edges **edges,
                                                  struct cranny_error *why);

/* The next frame's, of any size, in the same memory where it fits. On failure the edges hold no
 * frame, and filters refuse them until an update succeeds. */
CRANNY_API enum cranny_status cranny_edges_update(struct cranny_edges *edges,
                                                  const struct cranny_gbuffer *gbuffer,
                                                  const struct cranny_filter_params *params,
                                                  struct cranny_error *why);

/* Sets *edges to NULL; accepts NULL. */
CRANNY_API void cranny_edges_destroy(struct cranny_edges **edges);

/* Cross-bilateral along x, then along y: 2 reach_px + 1 taps each, weighted by a bell and by every
 * connection between a tap and the pixel. From reach_px 3 on, noise that repeats every 4 pixels is
 * taken out wholly, away from edges. */
CRANNY_API enum cranny_status cranny_filter_bilateral(const struct cranny_edges *edges,
                                                      const struct cranny_filter_params *params,
                                                      const float *input, size_t input_stride,
                                                      float *output, size_t output_stride,
                                                      struct cranny_error *why);

/* The mean of 4 × 4 pixels (two before, itself, one after, each way) within edges: takes out noise
 * that repeats every 4 pixels at the least cost. Moves the picture by half a pixel. */
CRANNY_API enum cranny_status cranny_filter_box4(const struct cranny_edges *edges,
                                                 const struct cranny_filter_params *params,
                                                 const float *input, size_t input_stride,
                                                 float *output, size_t output_stride,
                                                 struct cranny_error *why);

/* 1 − (1 − blend) wide_gain W(1 − input) − blend near_gain N(1 − input), where W and N are the wide
 * and the near Gaussian; not clamped. With gains of 1, a blend of the two blurs. With edge_bloom
 * the time grows with the square of the deviations; without, it does not depend on them. */
CRANNY_API enum cranny_status cranny_filter_bloom(const struct cranny_edges *edges,
                                                  const struct cranny_filter_params *params,
                                                  const float *input, size_t input_stride,
                                                  float *output, size_t output_stride,
                                                  struct cranny_error *why);

/* From half the resolution to full: bilinear between those of the four neighbours that lie on the
 * pixel's own surface. `input`: (width + 1) / 2 × (height + 1) / 2 values that belong to every
 * second pixel of every second row, (0, 0) on. Where none of the neighbours is on the pixel's
 * surface it takes their mean all the same. Sky gets 1. Output must not overlap the input. */
CRANNY_API enum cranny_status cranny_filter_upsample(const struct cranny_edges *edges,
                                                     const struct cranny_filter_params *params,
                                                     const float *input, size_t input_stride,
                                                     float *output, size_t output_stride,
                                                     struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
