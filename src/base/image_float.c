#include "base/image_float.h"

#include <inttypes.h>
#include <strings.h>

#define PIXEL_LIMIT ((uint64_t)IMAGE_SIDE_LIMIT * IMAGE_SIDE_LIMIT)
/* The largest image in 32-bit floats, with room for channels that are not wanted. */
#define FILE_LIMIT_BYTES (PIXEL_LIMIT * 32)

bool cranny_image_has_exr(void)
{
    return CRANNY_HAVE_EXR;
}

void cranny_image_free(struct cranny_image *image)
{
    free(image->pixels);
    *image = (struct cranny_image){0};
}

int image_channels_of(enum cranny_image_kind kind, int file_channels)
{
    switch (kind) {
    case CRANNY_IMAGE_VALUE:
    case CRANNY_IMAGE_DEPTH:
        return 1;
    case CRANNY_IMAGE_NORMAL:
        return file_channels >= 3 ? 3 : 0;
    case CRANNY_IMAGE_COLOR:
        return 3;
    }
    return 0;
}

enum cranny_status image_alloc(const struct image_source *source, int64_t width, int64_t height,
                               int channels, struct cranny_image *image, struct cranny_error *why)
{
    if (!channels)
        return fail(why, CRANNY_INPUT,
                    "%s: one channel cannot be normals; give an image of three (x, y, z)",
                    source->name);
    if (width < 1 || height < 1)
        return fail(why, CRANNY_INPUT,
                    "%s: %" PRId64 " x %" PRId64 " pixels make no image; write it again",
                    source->name, width, height);
    if (width > IMAGE_SIDE_LIMIT || height > IMAGE_SIDE_LIMIT)
        return fail(why, CRANNY_INPUT,
                    "%s: %" PRId64 " x %" PRId64 " pixels; at most %d x %d can be read, scale it "
                    "down",
                    source->name, width, height, IMAGE_SIDE_LIMIT, IMAGE_SIDE_LIMIT);
    uint64_t pixels = (uint64_t)width * (uint64_t)height;
    if (pixels > source->pixel_limit)
        return fail(why, CRANNY_MEMORY, "%s: %" PRId64 " x %" PRId64 " pixels are over the limit",
                    source->name, width, height);
    image->pixels = alloc_array((size_t)pixels * (size_t)channels, sizeof(float));
    if (!image->pixels)
        return fail_memory(why, source->name);
    image->width = (int)width;
    image->height = (int)height;
    image->channels = channels;
    return CRANNY_OK;
}

static enum cranny_status decode(const struct image_source *source, struct cranny_image *image,
                                 struct cranny_error *why)
{
    static const uint8_t png[4] = {0x89, 'P', 'N', 'G'}, exr[4] = {0x76, 0x2f, 0x31, 0x01};
    const uint8_t *bytes = source->data;
    if (!source->size)
        return fail(why, CRANNY_INPUT, "%s: is empty; write it again", source->name);
    if (source->size >= 4 && memcmp(bytes, png, 4) == 0)
        return image_decode_png(source, image, why);
    if (source->size >= 4 && memcmp(bytes, exr, 4) == 0)
        return image_decode_exr(source, image, why);
    if (source->size >= 3 && bytes[0] == 'P' && (bytes[1] == 'f' || bytes[1] == 'F'))
        return image_decode_pfm(source, image, why);
    return fail(why, CRANNY_INPUT, "%s: neither %sPFM nor PNG; save it as one of them",
                source->name, CRANNY_HAVE_EXR ? "OpenEXR, " : "");
}

enum cranny_status image_decode_float(const struct image_source *source, struct cranny_image *image,
                                      struct cranny_error *why)
{
    *image = (struct cranny_image){0};
    enum cranny_status status = decode(source, image, why);
    if (status != CRANNY_OK)
        cranny_image_free(image);
    return status;
}

enum cranny_status cranny_image_read(const char *path, enum cranny_image_kind kind,
                                     struct cranny_image *image, struct cranny_error *why)
{
    *image = (struct cranny_image){0};
    uint8_t *data;
    struct image_source source = {.name = path, .kind = kind, .pixel_limit = PIXEL_LIMIT};
    enum cranny_status status = file_read(path, FILE_LIMIT_BYTES, &data, &source.size, why);
    if (status != CRANNY_OK)
        return status;
    source.data = data;
    status = image_decode_float(&source, image, why);
    free(data);
    return status;
}

bool image_sink_put(struct image_sink *sink, uint64_t offset, const void *data, size_t size)
{
    if (offset > SIZE_MAX - size ||
        !grow_array((void **)&sink->data, &sink->capacity, (size_t)offset + size, 1))
        return false;
    if (size)
        memcpy(sink->data + offset, data, size);
    if (sink->size < (size_t)offset + size)
        sink->size = (size_t)offset + size;
    return true;
}

enum format { FORMAT_NONE, FORMAT_PNG, FORMAT_PFM, FORMAT_EXR };

static enum format format_of(const char *path)
{
    const char *dot = strrchr(path, '.');
    if (!dot || strchr(dot, '/'))
        return FORMAT_NONE;
    if (strcasecmp(dot, ".png") == 0)
        return FORMAT_PNG;
    if (strcasecmp(dot, ".pfm") == 0)
        return FORMAT_PFM;
    return strcasecmp(dot, ".exr") == 0 ? FORMAT_EXR : FORMAT_NONE;
}

static enum cranny_status check_format(const char *path, enum format format,
                                       enum cranny_image_bits bits, struct cranny_error *why)
{
    if (format == FORMAT_NONE)
        return fail(why, CRANNY_USAGE, "%s: an image's name must end in .png, .pfm or .exr", path);
    if (format == FORMAT_EXR && !CRANNY_HAVE_EXR)
        return fail(why, CRANNY_USAGE,
                    "%s: this build is without OpenEXR; write .pfm, or build Cranny with OpenEXR",
                    path);
    if (format == FORMAT_EXR && bits == CRANNY_IMAGE_BITS8)
        return fail(why, CRANNY_USAGE, "%s: OpenEXR has no 8-bit channels; ask for 16 or 32", path);
    if (format == FORMAT_PFM && bits != CRANNY_IMAGE_AUTO)
        return fail(why, CRANNY_USAGE, "%s: PFM holds 32-bit floats only", path);
    return CRANNY_OK;
}

static enum cranny_status check_view(const char *path, const struct image_view *view,
                                     enum cranny_image_kind kind, struct cranny_error *why)
{
    if (view->width < 1 || view->height < 1 || view->width > IMAGE_SIDE_LIMIT ||
        view->height > IMAGE_SIDE_LIMIT)
        return fail(why, CRANNY_USAGE, "%s: %d x %d pixels; sides must lie in [1, %d]", path,
                    view->width, view->height, IMAGE_SIDE_LIMIT);
    if ((view->channels != 1 && view->channels != 3) ||
        (kind == CRANNY_IMAGE_DEPTH && view->channels != 1) ||
        (kind == CRANNY_IMAGE_NORMAL && view->channels != 3))
        return fail(why, CRANNY_USAGE,
                    "%s: %d channels; values and colours take 1 or 3, depth 1, normals 3", path,
                    view->channels);
    if (!view->pixels)
        return fail(why, CRANNY_USAGE, "%s: the pixels are NULL", path);
    size_t tight = (size_t)view->width * (size_t)view->channels * sizeof(float);
    if (view->stride < tight || view->stride % sizeof(float) || view->stride > INT32_MAX)
        return fail(why, CRANNY_USAGE,
                    "%s: a stride of %zu bytes; it must be a multiple of 4, %zu or more", path,
                    view->stride, tight);
    return CRANNY_OK;
}

static enum cranny_status encode(const struct image_view *view, enum format format,
                                 enum cranny_image_kind kind, enum cranny_image_bits bits,
                                 const char *path, struct image_sink *sink,
                                 struct cranny_error *why)
{
    static const char *const grey[3] = {"Y"}, *const depth[3] = {"Z"};
    static const char *const color[3] = {"R", "G", "B"}, *const normal[3] = {"N.X", "N.Y", "N.Z"};
    const bool wide = bits == CRANNY_IMAGE_BITS16;
    switch (format) {
    case FORMAT_NONE:
        break;
    case FORMAT_PNG:
        return image_encode_png(view, wide ? 16 : 8, path, sink, why);
    case FORMAT_PFM:
        return image_encode_pfm(view, path, sink, why);
    case FORMAT_EXR:
        return image_encode_exr(view,
                                kind == CRANNY_IMAGE_DEPTH    ? depth
                                : kind == CRANNY_IMAGE_NORMAL ? normal
                                : view->channels == 3         ? color
                                                              : grey,
                                wide, path, sink, why);
    }
    return CRANNY_USAGE;
}

enum cranny_status cranny_image_write(const char *path, enum cranny_image_kind kind,
                                      enum cranny_image_bits bits, int width, int height,
                                      int channels, const float *pixels, size_t stride,
                                      struct cranny_error *why)
{
    const enum format format = format_of(path);
    struct image_view view = {width, height, channels, pixels, stride};
    if (!stride && width > 0 && channels > 0)
        view.stride = (size_t)width * (size_t)channels * sizeof(float);
    enum cranny_status status = check_format(path, format, bits, why);
    if (status == CRANNY_OK)
        status = check_view(path, &view, kind, why);
    if (status != CRANNY_OK)
        return status;
    struct image_sink sink = {0};
    status = encode(&view, format, kind, bits, path, &sink, why);
    if (status == CRANNY_OK)
        status = file_write(path, &(struct file_part){sink.data, sink.size}, 1, why);
    free(sink.data);
    return status;
}
