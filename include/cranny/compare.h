/* How far one picture of visibility is from another.
 *
 * Based on: McGuire, Ambient Occlusion Volumes, 2009 (eq. 31 and 32). */
#ifndef CRANNY_COMPARE_H
#define CRANNY_COMPARE_H

#include <cranny/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of a test picture against a reference; all over every pixel. */
struct cranny_difference {
    double error;   /* eq. 31 on 8-bit accessibility: mean square of the log's difference plus half
                       that of the log-gradients in x and y. 0 is equal; Crytek's SSAO had 1.7–4.3 */
    double rmse;    /* of visibility, [0,1] */
    double psnr;    /* dB; INFINITY when equal */
    double max_abs; /* largest difference */
    double mean;    /* of test − reference: below 0 is too dark */
};

/* Compare two pictures of width × height floats in [0,1] (clamped; NaN as 0), rows `…_stride` bytes
 * apart (0: tight). CRANNY_USAGE for sizes that make no sense. */
CRANNY_API enum cranny_status cranny_difference_measure(int width, int height, const float *test,
                                                        size_t test_stride, const float *reference,
                                                        size_t reference_stride,
                                                        struct cranny_difference *difference,
                                                        struct cranny_error *why);

/* Signed error map: white where equal, blue where the test is too dark, red where it is too bright,
 * full colour at `full_scale` (> 0). `rgb`: width × height × 3 bytes. */
CRANNY_API enum cranny_status cranny_difference_map(int width, int height, const float *test,
                                                    size_t test_stride, const float *reference,
                                                    size_t reference_stride, float full_scale,
                                                    uint8_t *rgb, struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
