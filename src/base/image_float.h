/* Float images: the formats behind cranny_image_read and cranny_image_write, in memory. */
#ifndef BASE_IMAGE_FLOAT_H
#define BASE_IMAGE_FLOAT_H

#include "base/base.h"

#include <cranny/image.h>

enum { IMAGE_SIDE_LIMIT = 16384 };

/* A file's bytes and what is wanted of them. */
struct image_source {
    const uint8_t *data;
    size_t size;
    const char *name; /* stands for the file in messages */
    enum cranny_image_kind kind;
    uint64_t pixel_limit;
};

/* cranny_image_read of bytes at hand. CRANNY_MEMORY above `pixel_limit` pixels. */
enum cranny_status image_decode_float(const struct image_source *source, struct cranny_image *image,
                                      struct cranny_error *why);

/* One format each; on failure the caller frees what *image holds. */
enum cranny_status image_decode_png(const struct image_source *source, struct cranny_image *image,
                                    struct cranny_error *why);
enum cranny_status image_decode_pfm(const struct image_source *source, struct cranny_image *image,
                                    struct cranny_error *why);
enum cranny_status image_decode_exr(const struct image_source *source, struct cranny_image *image,
                                    struct cranny_error *why);

/* How many channels a file that has `file_channels` gives for this kind; 0: it lacks some. */
int image_channels_of(enum cranny_image_kind kind, int file_channels);

/* Zeroed pixels for *image, or a message that says which limit they are over. */
enum cranny_status image_alloc(const struct image_source *source, int64_t width, int64_t height,
                               int channels, struct cranny_image *image, struct cranny_error *why);

/* Floats to write: rows of `channels` interleaved, `stride` bytes apart. */
struct image_view {
    int width, height, channels;
    const float *pixels;
    size_t stride;
};

static inline const float *image_row(const struct image_view *view, int y)
{
    return (const float *)((const char *)view->pixels + (size_t)y * view->stride);
}

/* A file that grows in memory; `data` is freed by the owner. */
struct image_sink {
    uint8_t *data;
    size_t size, capacity;
};

/* Put bytes at `offset`, which may lie before the end. False: out of memory. */
bool image_sink_put(struct image_sink *sink, uint64_t offset, const void *data, size_t size);

/* Append the file to an empty sink. `name` stands for it in messages. `bits` 8 or 16 of PNG;
 * `half`: 16-bit floats in EXR, whose channels are called `names`. */
enum cranny_status image_encode_png(const struct image_view *view, int bits, const char *name,
                                    struct image_sink *sink, struct cranny_error *why);
enum cranny_status image_encode_pfm(const struct image_view *view, const char *name,
                                    struct image_sink *sink, struct cranny_error *why);
enum cranny_status image_encode_exr(const struct image_view *view, const char *const names[3],
                                    bool half, const char *name, struct image_sink *sink,
                                    struct cranny_error *why);

#endif
