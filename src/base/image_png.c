/* PNG of 8 and 16 bits as numbers: whatever gamma a file states, its integers are not touched. */
#include "base/image_float.h"

#include <png.h>
#include <setjmp.h>

/* No deflate stream grows by more than this when it is unpacked. */
enum { DEFLATE_RATIO = 1032 };

struct png_job {
    png_structp png;
    png_infop info;
    char text[128]; /* libpng's word for what is wrong */
    jmp_buf escape;
    uint8_t *rows; /* one, or all of an interlaced file */
    bool memory;   /* an allocation failed */
    /* reading */
    const struct image_source *source;
    size_t at;
    struct cranny_image *image;
    struct cranny_error *why;
    enum cranny_status status;
    /* writing */
    const struct image_view *view;
    struct image_sink *sink;
};

static void on_error(png_structp png, png_const_charp text)
{
    struct png_job *job = png_get_error_ptr(png);
    snprintf(job->text, sizeof job->text, "%s", text);
    longjmp(job->escape, 1);
}

static void on_warning(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

static void on_read(png_structp png, png_bytep data, size_t size)
{
    struct png_job *job = png_get_io_ptr(png);
    if (size > job->source->size - job->at)
        png_error(png, "the file ends too soon");
    memcpy(data, job->source->data + job->at, size);
    job->at += size;
}

static void on_write(png_structp png, png_bytep data, size_t size)
{
    struct png_job *job = png_get_io_ptr(png);
    if (image_sink_put(job->sink, job->sink->size, data, size))
        return;
    job->memory = true;
    png_error(png, "out of memory");
}

static void on_flush(png_structp png)
{
    (void)png;
}

/* Plain samples of 8 or 16 bits, without alpha. */
static void plain_samples(struct png_job *job)
{
    const int type = png_get_color_type(job->png, job->info);
    if (type == PNG_COLOR_TYPE_PALETTE)
        png_set_palette_to_rgb(job->png);
    else if (type == PNG_COLOR_TYPE_GRAY)
        png_set_expand_gray_1_2_4_to_8(job->png);
    if (type & PNG_COLOR_MASK_ALPHA)
        png_set_strip_alpha(job->png);
}

static void to_floats(const uint8_t *row, int width, int file_channels, int bits, int channels,
                      float *to)
{
    for (int x = 0; x < width; x++)
        for (int c = 0; c < channels; c++) {
            const size_t i = (size_t)(x * file_channels + (file_channels == 3 ? c : 0));
            const unsigned value = bits == 16 ? (unsigned)row[i * 2] << 8 | row[i * 2 + 1] : row[i];
            *to++ = (float)value / (bits == 16 ? 65535.f : 255.f);
        }
}

/* Before libpng makes its rows, which would be as wide as the header says. */
static bool begin_image(struct png_job *job)
{
    const struct image_source *source = job->source;
    const int64_t width = png_get_image_width(job->png, job->info);
    const int64_t height = png_get_image_height(job->png, job->info);
    const int type = png_get_color_type(job->png, job->info);
    const int file_channels = type & PNG_COLOR_MASK_COLOR ? 3 : 1;
    if ((uint64_t)width * (uint64_t)height / 8 / DEFLATE_RATIO > source->size)
        job->status = fail(job->why, CRANNY_INPUT,
                           "%s: broken PNG: %lld x %lld pixels cannot lie in %zu bytes; write it "
                           "again",
                           source->name, (long long)width, (long long)height, source->size);
    else
        job->status =
            image_alloc(source, width, height, image_channels_of(source->kind, file_channels),
                        job->image, job->why);
    return job->status == CRANNY_OK;
}

static void read_rows(struct png_job *job, int passes)
{
    struct cranny_image *image = job->image;
    const int file_channels = png_get_channels(job->png, job->info);
    const int bits = png_get_bit_depth(job->png, job->info);
    const size_t row_bytes = png_get_rowbytes(job->png, job->info);
    const size_t row_step = passes > 1 ? row_bytes : 0;
    job->rows = alloc_array(row_step ? (size_t)image->height : 1, row_bytes);
    if (!job->rows) {
        job->status = fail_memory(job->why, job->source->name);
        return;
    }
    for (int pass = 0; pass < passes; pass++)
        for (int y = 0; y < image->height; y++) {
            uint8_t *row = job->rows + (size_t)y * row_step;
            png_read_row(job->png, row, NULL);
            if (pass == passes - 1)
                to_floats(row, image->width, file_channels, bits, image->channels,
                          image->pixels +
                              (size_t)y * (size_t)image->width * (size_t)image->channels);
        }
    image->integers = true;
}

static void decode(struct png_job *job)
{
    png_set_read_fn(job->png, job, on_read);
    /* Larger ones are refused by image_alloc, in words. */
    png_set_user_limits(job->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_read_info(job->png, job->info);
    if (!begin_image(job))
        return;
    plain_samples(job);
    const int passes = png_set_interlace_handling(job->png);
    png_read_update_info(job->png, job->info);
    read_rows(job, passes);
    if (job->status == CRANNY_OK)
        png_read_end(job->png, NULL);
}

enum cranny_status image_decode_png(const struct image_source *source, struct cranny_image *image,
                                    struct cranny_error *why)
{
    struct png_job job = {.source = source, .image = image, .why = why, .status = CRANNY_OK};
    struct png_job *const at = &job;
    job.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, at, on_error, on_warning);
    job.info = job.png ? png_create_info_struct(job.png) : NULL;
    if (!job.info)
        job.status = fail_memory(why, source->name);
    else if (setjmp(job.escape) == 0)
        decode(at);
    else
        at->status = fail(why, CRANNY_INPUT, "%s: broken PNG: byte %zu: %s; write it again",
                          source->name, at->at, at->text);
    png_destroy_read_struct(&job.png, &job.info, NULL);
    free(job.rows);
    return job.status;
}

/* To nearest, NaN as 0. */
static unsigned to_integer(float value, unsigned most)
{
    if (!(value > 0))
        return 0;
    return value >= 1 ? most : (unsigned)((double)value * most + 0.5);
}

static void encode(struct png_job *job, int bits)
{
    const struct image_view *view = job->view;
    const size_t samples = (size_t)view->width * (size_t)view->channels;
    png_set_write_fn(job->png, job, on_write, on_flush);
    png_set_IHDR(job->png, job->info, (png_uint_32)view->width, (png_uint_32)view->height, bits,
                 view->channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
    png_write_info(job->png, job->info);
    for (int y = 0; y < view->height; y++) {
        const float *from = image_row(view, y);
        for (size_t i = 0; i < samples; i++)
            if (bits == 16) {
                const unsigned value = to_integer(from[i], 65535);
                job->rows[i * 2] = (uint8_t)(value >> 8);
                job->rows[i * 2 + 1] = (uint8_t)value;
            } else {
                job->rows[i] = (uint8_t)to_integer(from[i], 255);
            }
        png_write_row(job->png, job->rows);
    }
    png_write_end(job->png, NULL);
}

enum cranny_status image_encode_png(const struct image_view *view, int bits, const char *name,
                                    struct image_sink *sink, struct cranny_error *why)
{
    struct png_job job = {.view = view, .sink = sink, .status = CRANNY_OK};
    struct png_job *const at = &job;
    job.rows = alloc_array((size_t)view->width * (size_t)view->channels, (size_t)bits / 8);
    job.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, at, on_error, on_warning);
    job.info = job.png ? png_create_info_struct(job.png) : NULL;
    if (!job.info || !job.rows)
        job.status = fail_memory(why, name);
    else if (setjmp(job.escape) == 0)
        encode(at, bits);
    else
        at->status = at->memory ? fail_memory(why, name)
                                : fail(why, CRANNY_FAILED, "%s: PNG: %s", name, at->text);
    png_destroy_write_struct(&job.png, &job.info);
    free(job.rows);
    return job.status;
}
