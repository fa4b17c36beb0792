/* From sparse samples to every pixel: what one cell of the sample grid reads.
 *
 * Based on: McGuire, Ambient Occlusion Volumes, 2009, §3.2: a 5×5 cross-bilateral filter. */
#ifndef VOLUMES_SPARSE_H
#define VOLUMES_SPARSE_H

#define TAPS 25
#define CELL_PIXELS 256 /* of the largest spacing, 16 × 16 */

/* Pixels of one cell and the samples around it. Places are relative to the cell's own sample, in
 * units of δ; x and y are on the screen, in cells. */
struct sparse_cell {
    float tap_position[TAPS][3], tap_normal[TAPS][3];
    float tap_x[TAPS], tap_y[TAPS], tap_value[TAPS];
    int taps; /* that are not sky */
    _Alignas(64) float position[3][CELL_PIXELS];
    _Alignas(64) float normal[3][CELL_PIXELS];
    _Alignas(64) float x[CELL_PIXELS], y[CELL_PIXELS];
    int pixels;
    float sharpness;                    /* one over twice the deviation's square, in cells */
    float inverse_distance;             /* one over the distance at which surfaces are apart */
    float least_cosine, inverse_cosine; /* of the angle at which they are; one over 1 − that */
};

#endif
