/* Float images in files: OpenEXR (where the build has it), PFM, and PNG of 8 or 16 bits. */
#ifndef CRANNY_IMAGE_H
#define CRANNY_IMAGE_H

#include <cranny/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Pixels interleaved, rows top to bottom without padding; `pixels` is freed by cranny_image_free.
 */
struct cranny_image {
    int width, height, channels; /* channels 1 to 4 */
    float *pixels;               /* width × height × channels */
    bool integers;               /* the file held 8- or 16-bit integers, here mapped to [0,1] */
};

/* What a file's channels are wanted for; decides which of an EXR's layers are taken. */
enum cranny_image_kind {
    CRANNY_IMAGE_VALUE,  /* one channel: Y, else V, R, or the file's only one */
    CRANNY_IMAGE_DEPTH,  /* one channel: Z, depth.Z or the like, else as CRANNY_IMAGE_VALUE */
    CRANNY_IMAGE_NORMAL, /* three: N.X N.Y N.Z, normal.X …, X Y Z, or R G B */
    CRANNY_IMAGE_COLOR,  /* three: R G B, or one grey channel three times */
};

/* Read .exr, .pfm or .png, told apart by content. PNG integers are scaled to [0,1] without any
 * gamma and without alpha; EXR and PFM values come as they are, NaN and infinities included, and
 * of PFM's scale only the sign counts. Of an EXR: the first part with the channels, flat, at full
 * resolution; its data window is the image. Channel names may have a layer (Depth.Z), upper and
 * lower case are the same. At most 16384 × 16384 pixels. CRANNY_INPUT: missing, broken, without
 * such channels, or an EXR in a build without OpenEXR; CRANNY_MEMORY when it does not fit. *image
 * is zeroed on failure. */
CRANNY_API enum cranny_status cranny_image_read(const char *path, enum cranny_image_kind kind,
                                                struct cranny_image *image,
                                                struct cranny_error *why);

/* Frees the pixels and zeroes *image; accepts one that is zeroed. */
CRANNY_API void cranny_image_free(struct cranny_image *image);

/* How numbers are stored. */
enum cranny_image_bits {
    CRANNY_IMAGE_AUTO,  /* .png 8 bits, .exr and .pfm 32-bit floats */
    CRANNY_IMAGE_BITS8, /* .png */
    CRANNY_IMAGE_BITS16 /* .png: integers; .exr: half floats */
};

/* Write to .png, .exr or .pfm by the extension of `path`; the file appears whole or not at all.
 * `channels` 1 or 3; `stride` bytes from row to row, 0: tight. In a PNG, [0,1] is mapped to the
 * integers' whole range, rounded to nearest and clamped, NaN as 0. Channel names in EXR: Y or
 * R G B; Z when `kind` is CRANNY_IMAGE_DEPTH, N.X N.Y N.Z when it is CRANNY_IMAGE_NORMAL.
 * CRANNY_USAGE for another extension or sizes out of range, CRANNY_FAILED when it cannot be
 * written. */
CRANNY_API enum cranny_status cranny_image_write(const char *path, enum cranny_image_kind kind,
                                                 enum cranny_image_bits bits, int width, int height,
                                                 int channels, const float *pixels, size_t stride,
                                                 struct cranny_error *why);

/* Whether this build reads and writes OpenEXR. */
CRANNY_API bool cranny_image_has_exr(void);

#ifdef __cplusplus
}
#endif
#endif
