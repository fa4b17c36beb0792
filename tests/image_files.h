/* For the tests of images: files that others write, whole and cut, and what must follow. */
#ifndef TESTS_IMAGE_FILES_H
#define TESTS_IMAGE_FILES_H

#include "base/image_float.h"
#include "check.h"

#include <stdbool.h>
#include <unistd.h>

#define PIXELS_ENOUGH ((uint64_t)1 << 20)

static inline void write_bytes(const char *path, const void *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    CHECK(file && fwrite(data, 1, size, file) == size);
    if (file)
        fclose(file);
}

/* An exact malloc, so that a sanitizer sees the first byte beyond the end. */
static inline enum cranny_status decode_cut(const uint8_t *data, size_t size,
                                            enum cranny_image_kind kind, uint64_t limit,
                                            struct cranny_image *image, struct cranny_error *why)
{
    uint8_t *copy = malloc(size ? size : 1);
    if (size)
        memcpy(copy, data, size);
    struct image_source source = {
        .data = copy, .size = size, .name = "test", .kind = kind, .pixel_limit = limit};
    *why = (struct cranny_error){0};
    enum cranny_status status = image_decode_float(&source, image, why);
    free(copy);
    return status;
}

/* Refused with this status and one line that names the file and `part`. */
static inline void check_refused(const void *data, size_t size, enum cranny_image_kind kind,
                                 enum cranny_status expected, const char *part)
{
    struct cranny_error why;
    struct cranny_image image;
    enum cranny_status status = decode_cut(data, size, kind, PIXELS_ENOUGH, &image, &why);
    CHECK_MSG(status == expected, "status %s, expected %s: %s", cranny_status_name(status),
              cranny_status_name(expected), why.message);
    CHECK_MSG(strncmp(why.message, "test: ", 6) == 0 && strstr(why.message, part) &&
                  !strchr(why.message, '\n'),
              "no '%s' in: %s", part, why.message);
    CHECK(!image.pixels && !image.width);
    cranny_image_free(&image);
}

/* Every shorter file is refused; `size` itself is not. */
static inline void check_cuts(const uint8_t *data, size_t size, enum cranny_image_kind kind)
{
    struct cranny_error why;
    struct cranny_image image;
    for (size_t cut = 0; cut < size; cut++) {
        enum cranny_status status = decode_cut(data, cut, kind, PIXELS_ENOUGH, &image, &why);
        CHECK_MSG(status == CRANNY_INPUT && *why.message && !image.pixels,
                  "cut to %zu of %zu bytes: %s: %s", cut, size, cranny_status_name(status),
                  why.message);
        cranny_image_free(&image);
    }
    CHECK_OK(decode_cut(data, size, kind, PIXELS_ENOUGH, &image, &why), why);
    cranny_image_free(&image);
}

/* Whatever single bytes are, reading ends with a status. */
static inline void check_flips(const uint8_t *data, size_t size, enum cranny_image_kind kind)
{
    static const uint8_t masks[] = {0x01, 0x80, 0xff};
    struct cranny_error why;
    struct cranny_image image;
    uint8_t *copy = malloc(size);
    for (size_t i = 0; i < size * 3; i++) {
        memcpy(copy, data, size);
        copy[i / 3] ^= masks[i % 3];
        enum cranny_status status = decode_cut(copy, size, kind, PIXELS_ENOUGH, &image, &why);
        CHECK_MSG((status == CRANNY_OK) == (image.pixels != NULL) &&
                      (status == CRANNY_OK || *why.message),
                  "byte %zu: %s", i / 3, cranny_status_name(status));
        cranny_image_free(&image);
    }
    free(copy);
}

static inline uint8_t *read_bytes(const char *path, size_t *size)
{
    uint8_t *data;
    struct cranny_error why;
    CHECK_OK(file_read(path, 1 << 24, &data, size, &why), why);
    return data;
}

/* The same bits, NaN included. */
static inline bool same_bits(const float *a, const float *b, size_t count)
{
    return memcmp(a, b, count * sizeof *a) == 0;
}

#endif
