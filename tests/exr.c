/* OpenEXR: there and back, files as other programs write them, hostile ones. */
#include "image_files.h"

#include <openexr.h>

#define PATH "image-test.exr"

static void test_round_trip(void)
{
    static const float specials[12] = {0,     1,         -1,  0.5f,     1e-40f,  -0.f,
                                       3e38f, -INFINITY, NAN, INFINITY, 1.f / 3, -7.25f};
    struct cranny_error why;
    struct cranny_image image;
    for (int channels = 1; channels <= 3; channels += 2) {
        const enum cranny_image_kind kinds[] = {
            CRANNY_IMAGE_VALUE, channels == 3 ? CRANNY_IMAGE_NORMAL : CRANNY_IMAGE_DEPTH,
            CRANNY_IMAGE_COLOR};
        for (int k = 0; k < 3; k++) {
            const int width = 12 / channels / 2, got = kinds[k] == CRANNY_IMAGE_COLOR   ? 3
                                                       : kinds[k] == CRANNY_IMAGE_VALUE ? 1
                                                                                        : channels;
            CHECK_OK(cranny_image_write(PATH, kinds[k], CRANNY_IMAGE_AUTO, width, 2, channels,
                                        specials, 0, &why),
                     why);
            CHECK_OK(cranny_image_read(PATH, kinds[k], &image, &why), why);
            CHECK(image.width == width && image.height == 2 && image.channels == got &&
                  !image.integers);
            for (int i = 0; i < width * 2 * got && image.pixels; i++) {
                const int pixel = i / got, c = i % got < channels ? i % got : 0;
                CHECK(same_bits(&image.pixels[i], &specials[pixel * channels + c], 1));
            }
            cranny_image_free(&image);
        }
    }
}

static void test_half(void)
{
    enum { WIDTH = 40, HEIGHT = 37 };
    static float rows[HEIGHT][WIDTH + 3];
    struct cranny_error why;
    struct cranny_image image;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH + 3; x++)
            rows[y][x] = (float)(x * 41 + y * 7) * 0.37f - 3;
    rows[0][0] = NAN;
    rows[0][1] = INFINITY;
    rows[0][2] = -INFINITY;
    rows[0][3] = 1e9f;
    rows[0][4] = 6e-8f;
    CHECK_OK(cranny_image_write(PATH, CRANNY_IMAGE_DEPTH, CRANNY_IMAGE_BITS16, WIDTH, HEIGHT, 1,
                                rows[0], sizeof rows[0], &why),
             why);
    CHECK_OK(cranny_image_read(PATH, CRANNY_IMAGE_DEPTH, &image, &why), why);
    CHECK(isnan(image.pixels[0]) && image.pixels[1] == INFINITY && image.pixels[2] == -INFINITY);
    CHECK(image.pixels[3] == INFINITY);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = y ? 0 : 4; x < WIDTH; x++)
            CHECK_NEAR(image.pixels[y * WIDTH + x], rows[y][x],
                       fmax(fabs(rows[y][x]) / 2048, 0x1p-25));
    cranny_image_free(&image);
}

/* A file as another program might write it. */
struct file {
    int width, height, min_x, min_y;
    int tile; /* 0: scanlines */
    exr_compression_t compression;
    exr_pixel_type_t types[3];
    const char *names[3];
    int count, sampling;
    exr_lineorder_t order;
};

static uint32_t sample_of(int x, int y, int c)
{
    return (uint32_t)((x * 3 + y * 5 + c * 11) % 64);
}

static void fill(void *pixel, exr_pixel_type_t type, uint32_t value)
{
    const float real = (float)value;
    if (type == EXR_PIXEL_UINT)
        memcpy(pixel, &value, 4);
    else
        memcpy(pixel, &real, 4);
}

static exr_result_t put_chunk(exr_context_t context, const struct file *file,
                              const exr_chunk_info_t *chunk, int x0, int y0)
{
    exr_encode_pipeline_t encode = EXR_ENCODE_PIPELINE_INITIALIZER;
    exr_result_t result = exr_encoding_initialize(context, 0, chunk, &encode);
    uint8_t *planes[3] = {0};
    for (int i = 0; i < encode.channel_count && result == EXR_ERR_SUCCESS; i++) {
        exr_coding_channel_info_t *channel = &encode.channels[i];
        int c = 0;
        while (c < file->count - 1 && strcmp(file->names[c], channel->channel_name) != 0)
            c++;
        planes[i] = calloc((size_t)channel->width * (size_t)channel->height + 1, 4);
        for (int y = 0; y < channel->height; y++)
            for (int x = 0; x < channel->width; x++)
                fill(planes[i] + 4 * (y * channel->width + x), file->types[c],
                     sample_of(x0 + x, y0 + y, c));
        channel->encode_from_ptr = planes[i];
        channel->user_data_type =
            file->types[c] == EXR_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = 4;
        channel->user_pixel_stride = 4;
        channel->user_line_stride = 4 * channel->width;
    }
    if (result == EXR_ERR_SUCCESS)
        result = exr_encoding_choose_default_routines(context, 0, &encode);
    if (result == EXR_ERR_SUCCESS)
        result = exr_encoding_run(context, 0, &encode);
    exr_encoding_destroy(context, &encode);
    for (int i = 0; i < 3; i++)
        free(planes[i]);
    return result;
}

static exr_result_t put_chunks(exr_context_t context, const struct file *file)
{
    exr_result_t result = EXR_ERR_SUCCESS;
    exr_chunk_info_t chunk;
    int32_t lines = 1;
    if (!file->tile) {
        exr_get_scanlines_per_chunk(context, 0, &lines);
        for (int y = 0; y < file->height && !result; y += lines) {
            result = exr_write_scanline_chunk_info(context, 0, file->min_y + y, &chunk);
            if (!result)
                result = put_chunk(context, file, &chunk, 0, y);
        }
        return result;
    }
    for (int y = 0; y < file->height && !result; y += file->tile)
        for (int x = 0; x < file->width && !result; x += file->tile) {
            result =
                exr_write_tile_chunk_info(context, 0, x / file->tile, y / file->tile, 0, 0, &chunk);
            if (!result)
                result = put_chunk(context, file, &chunk, x, y);
        }
    return result;
}

static void make_exr(const struct file *file, const char *path)
{
    exr_context_t context;
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    int part;
    exr_attr_box2i_t display, data;
    exr_attr_v2f_t center;
    memset(&center, 0, sizeof center);
    display.min.x = display.min.y = 0;
    display.max.x = display.max.y = 99;
    data.min.x = file->min_x;
    data.min.y = file->min_y;
    data.max.x = file->min_x + file->width - 1;
    data.max.y = file->min_y + file->height - 1;
    CHECK_INT(exr_start_write(&context, path, EXR_WRITE_FILE_DIRECTLY, &setup), 0);
    CHECK_INT(
        exr_add_part(context, NULL, file->tile ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part),
        0);
    CHECK_INT(exr_initialize_required_attr(context, part, &display, &data, 1, &center, 1,
                                           file->order, file->compression),
              0);
    for (int c = 0; c < file->count; c++)
        CHECK_INT(exr_add_channel(context, part, file->names[c], file->types[c],
                                  EXR_PERCEPTUALLY_LINEAR, file->sampling, file->sampling),
                  0);
    if (file->tile)
        CHECK_INT(exr_set_tile_descriptor(context, part, (uint32_t)file->tile, (uint32_t)file->tile,
                                          EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN),
                  0);
    CHECK_INT(exr_write_header(context), 0);
    CHECK_INT(put_chunks(context, file), 0);
    CHECK_INT(exr_finish(&context), 0);
}

static void check_content(const struct file *file, enum cranny_image_kind kind, const int *order,
                          int count)
{
    struct cranny_error why;
    struct cranny_image image;
    CHECK_OK(cranny_image_read(PATH, kind, &image, &why), why);
    CHECK_INT(image.width, file->width);
    CHECK_INT(image.height, file->height);
    CHECK_INT(image.channels, count);
    int wrong = 0;
    for (int i = 0; image.pixels && i < file->width * file->height * count; i++) {
        const int pixel = i / count, x = pixel % file->width, y = pixel / file->width;
        wrong += image.pixels[i] != (float)sample_of(x, y, order[i % count]);
    }
    CHECK_MSG(wrong == 0, "%d values are wrong; compression %d, tile %d", wrong, file->compression,
              file->tile);
    cranny_image_free(&image);
}

static void test_files(void)
{
    static const exr_compression_t exact[] = {EXR_COMPRESSION_NONE, EXR_COMPRESSION_RLE,
                                              EXR_COMPRESSION_ZIPS, EXR_COMPRESSION_ZIP,
                                              EXR_COMPRESSION_PIZ,  EXR_COMPRESSION_PXR24};
    struct file file = {
        .width = 37, .height = 41, .names = {"R", "G", "B"}, .count = 3, .sampling = 1};
    for (size_t c = 0; c < COUNT_OF(exact); c++)
        for (int tile = 0; tile <= 16; tile += 16)
            for (int offset = 0; offset <= 1; offset++) {
                file.compression = exact[c];
                file.tile = tile;
                file.min_x = offset * -5;
                file.min_y = offset * 13;
                file.types[0] = EXR_PIXEL_HALF;
                file.types[1] = offset ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
                file.types[2] = EXR_PIXEL_FLOAT;
                make_exr(&file, PATH);
                check_content(&file, CRANNY_IMAGE_COLOR, (const int[]){0, 1, 2}, 3);
                check_content(&file, CRANNY_IMAGE_VALUE, (const int[]){0}, 1);
            }
}

static void test_grey(void)
{
    struct file file = {.width = 3,
                        .height = 2,
                        .names = {"mask"},
                        .types = {EXR_PIXEL_UINT},
                        .count = 1,
                        .sampling = 1};
    make_exr(&file, PATH);
    check_content(&file, CRANNY_IMAGE_VALUE, (const int[]){0}, 1);
    check_content(&file, CRANNY_IMAGE_DEPTH, (const int[]){0}, 1);
    check_content(&file, CRANNY_IMAGE_COLOR, (const int[]){0, 0, 0}, 3);
}

static void test_hostile(void)
{
    struct file file = {.width = 5,
                        .height = 3,
                        .names = {"Y", "Z", "mask"},
                        .types = {EXR_PIXEL_HALF, EXR_PIXEL_FLOAT, EXR_PIXEL_UINT},
                        .count = 3,
                        .sampling = 1};
    size_t size;
    for (int tile = 0; tile <= 2; tile += 2)
        for (int c = EXR_COMPRESSION_NONE; c <= EXR_COMPRESSION_PXR24; c++) {
            file.tile = tile;
            file.compression = (exr_compression_t)c;
            make_exr(&file, PATH);
            uint8_t *data = read_bytes(PATH, &size);
            check_cuts(data, size, CRANNY_IMAGE_VALUE);
            check_flips(data, size, CRANNY_IMAGE_DEPTH);
            check_refused(data, size, CRANNY_IMAGE_NORMAL, CRANNY_INPUT, "N.X");
            free(data);
        }
}

/* The place of a data window's far corner in a file of ours. */
static uint8_t *find_window(uint8_t *data, size_t size)
{
    static const char word[] = "dataWindow\0box2i";
    for (size_t i = 0; i + sizeof word + 20 < size; i++)
        if (memcmp(data + i, word, sizeof word) == 0)
            return data + i + sizeof word + 4 + 8;
    return NULL;
}

static void test_lies(void)
{
    static const int32_t corners[][2] = {{16383, 16383},   {16384, 0},
                                         {INT32_MAX, 2},   {-1, 2},
                                         {INT32_MIN, 0},   {INT32_MAX - 1, INT32_MAX},
                                         {0x00ffffff, 100}};
    struct file file = {.width = 5,
                        .height = 3,
                        .names = {"Y"},
                        .types = {EXR_PIXEL_FLOAT},
                        .count = 1,
                        .sampling = 1};
    for (int tile = 0; tile <= 2; tile += 2) {
        size_t size;
        file.tile = tile;
        make_exr(&file, PATH);
        uint8_t *data = read_bytes(PATH, &size);
        uint8_t *corner = find_window(data, size);
        CHECK(corner != NULL);
        for (size_t i = 0; i < COUNT_OF(corners) && corner; i++) {
            struct cranny_error why;
            struct cranny_image image;
            memcpy(corner, corners[i], 8);
            enum cranny_status status =
                decode_cut(data, size, CRANNY_IMAGE_VALUE, (uint64_t)1 << 28, &image, &why);
            CHECK_MSG(status == CRANNY_INPUT || status == CRANNY_MEMORY, "corner %zu: %s", i,
                      cranny_status_name(status));
            cranny_image_free(&image);
        }
        free(data);
    }
}

static void test_subsampled(void)
{
    struct file file = {.width = 4,
                        .height = 4,
                        .names = {"Y"},
                        .types = {EXR_PIXEL_HALF},
                        .count = 1,
                        .sampling = 2};
    size_t size;
    make_exr(&file, PATH);
    uint8_t *data = read_bytes(PATH, &size);
    check_refused(data, size, CRANNY_IMAGE_VALUE, CRANNY_INPUT, "subsampled");
    free(data);
}

int main(void)
{
    char folder[] = "exr-XXXXXX";
    CHECK(cranny_image_has_exr());
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    test_round_trip();
    test_half();
    test_files();
    test_grey();
    test_hostile();
    test_lies();
    test_subsampled();
    unlink(PATH);
    CHECK(chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("exr");
}
