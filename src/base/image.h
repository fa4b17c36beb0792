/* Images: 8-bit decoding of PNG and JPEG with bounds, PNG encoding. */
#ifndef BASE_IMAGE_H
#define BASE_IMAGE_H

#include "base/base.h"

/* 8-bit RGBA, rows top to bottom, without padding. */
struct image {
    uint32_t width, height;
    uint8_t *rgba;
};

/* Decode PNG or JPEG, told apart by content. CRANNY_INPUT for anything else or broken data,
 * CRANNY_MEMORY above `pixel_limit` pixels. `name` stands for the image in messages. */
enum cranny_status image_decode(const void *data, size_t size, const char *name,
                                uint64_t pixel_limit, struct image *image,
                                struct cranny_error *why);
void image_free(struct image *image);

/* Encode as PNG into memory; *png is malloced. */
enum cranny_status png_encode(int width, int height, int channels, const uint8_t *pixels,
                              size_t stride, uint8_t **png, size_t *png_size,
                              struct cranny_error *why);

#endif
