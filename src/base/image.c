#include "base/image.h"

#include <jpeglib.h>
#include <png.h>
#include <setjmp.h>

static const uint8_t png_magic[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

static enum cranny_status decode_png(const void *data, size_t size, const char *name,
                                     uint64_t pixel_limit, struct image *image,
                                     struct cranny_error *why)
{
    png_image reader = {.version = PNG_IMAGE_VERSION};
    if (!png_image_begin_read_from_memory(&reader, data, size))
        return fail(why, CRANNY_INPUT, "%s: broken PNG: %s", name, reader.message);
    if ((uint64_t)reader.width * reader.height > pixel_limit) {
        unsigned width = reader.width, height = reader.height;
        png_image_free(&reader);
        return fail(why, CRANNY_MEMORY, "%s: %u x %u pixels are over the limit", name, width,
                    height);
    }
    reader.format = PNG_FORMAT_RGBA;
    image->width = reader.width;
    image->height = reader.height;
    image->rgba = malloc(PNG_IMAGE_SIZE(reader));
    if (!image->rgba) {
        png_image_free(&reader);
        return fail_memory(why, name);
    }
    if (!png_image_finish_read(&reader, NULL, image->rgba, 0, NULL)) {
        image_free(image);
        return fail(why, CRANNY_INPUT, "%s: broken PNG: %s", name, reader.message);
    }
    return CRANNY_OK;
}

struct jpeg_guard {
    struct jpeg_error_mgr base;
    jmp_buf escape;
    char text[JMSG_LENGTH_MAX];
};

static void jpeg_fail(j_common_ptr info)
{
    struct jpeg_guard *guard = (struct jpeg_guard *)info->err;
    guard->base.format_message(info, guard->text);
    longjmp(guard->escape, 1);
}

static void jpeg_quiet(j_common_ptr info, int level)
{
    (void)info;
    (void)level;
}

static enum cranny_status decode_jpeg(const void *data, size_t size, const char *name,
                                      uint64_t pixel_limit, struct image *image,
                                      struct cranny_error *why)
{
    struct jpeg_decompress_struct info;
    struct jpeg_guard guard;
    uint8_t *volatile row = NULL;
    info.err = jpeg_std_error(&guard.base);
    guard.base.error_exit = jpeg_fail;
    guard.base.emit_message = jpeg_quiet;
    if (setjmp(guard.escape)) {
        jpeg_destroy_decompress(&info);
        free(row);
        image_free(image);
        return fail(why, CRANNY_INPUT, "%s: broken JPEG: %s", name, guard.text);
    }
    jpeg_create_decompress(&info);
    jpeg_mem_src(&info, (unsigned char *)data, size);
    jpeg_read_header(&info, TRUE);
    uint64_t pixels = (uint64_t)info.image_width * info.image_height;
    info.out_color_space = JCS_RGB;
    if (pixels <= pixel_limit) {
        jpeg_start_decompress(&info);
        image->width = info.output_width;
        image->height = info.output_height;
        image->rgba = malloc((size_t)pixels * 4);
        row = malloc((size_t)info.output_width * 3);
    }
    if (!image->rgba || !row) {
        jpeg_destroy_decompress(&info);
        free(row);
        image_free(image);
        return fail(why, CRANNY_MEMORY, "%s: too many pixels for the memory there is", name);
    }
    while (info.output_scanline < info.output_height) {
        uint8_t *target = image->rgba + (size_t)info.output_scanline * info.output_width * 4;
        JSAMPROW rows[1] = {row};
        jpeg_read_scanlines(&info, rows, 1);
        for (uint32_t x = 0; x < info.output_width; x++) {
            memcpy(target + x * 4, row + x * 3, 3);
            target[x * 4 + 3] = 255;
        }
    }
    jpeg_finish_decompress(&info);
    jpeg_destroy_decompress(&info);
    free(row);
    return CRANNY_OK;
}

enum cranny_status image_decode(const void *data, size_t size, const char *name,
                                uint64_t pixel_limit, struct image *image, struct cranny_error *why)
{
    *image = (struct image){0};
    const uint8_t *bytes = data;
    if (size >= 8 && memcmp(bytes, png_magic, 8) == 0)
        return decode_png(data, size, name, pixel_limit, image, why);
    if (size >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff)
        return decode_jpeg(data, size, name, pixel_limit, image, why);
    return fail(why, CRANNY_INPUT, "%s: neither PNG nor JPEG", name);
}

void image_free(struct image *image)
{
    free(image->rgba);
    *image = (struct image){0};
}

enum cranny_status png_encode(int width, int height, int channels, const uint8_t *pixels,
                              size_t stride, uint8_t **png, size_t *png_size,
                              struct cranny_error *why)
{
    *png = NULL;
    *png_size = 0;
    if (width <= 0 || height <= 0 || (channels != 1 && channels != 3 && channels != 4))
        return fail(why, CRANNY_USAGE, "PNG: %d x %d pixels of %d channels cannot be written",
                    width, height, channels);
    png_image writer = {.version = PNG_IMAGE_VERSION,
                        .width = (png_uint_32)width,
                        .height = (png_uint_32)height,
                        .format = channels == 1   ? PNG_FORMAT_GRAY
                                  : channels == 3 ? PNG_FORMAT_RGB
                                                  : PNG_FORMAT_RGBA};
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(writer);
    *png = malloc(size);
    if (!*png)
        return fail_memory(why, "PNG");
    if (!png_image_write_to_memory(&writer, *png, &size, 0, pixels, (png_int_32)stride, NULL)) {
        free(*png);
        *png = NULL;
        return fail(why, CRANNY_FAILED, "PNG: %s", writer.message);
    }
    *png_size = size;
    return CRANNY_OK;
}

enum cranny_status cranny_png_write(const char *path, int width, int height, int channels,
                                    const uint8_t *pixels, size_t stride, struct cranny_error *why)
{
    uint8_t *png;
    size_t size;
    enum cranny_status status =
        png_encode(width, height, channels, pixels, stride, &png, &size, why);
    if (status != CRANNY_OK)
        return status;
    struct file_part part = {png, size};
    status = file_write(path, &part, 1, why);
    free(png);
    return status;
}
