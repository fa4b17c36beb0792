/* OpenEXR through its C core, from and to memory: flat parts, scanline or tiled, one level. */
#include "base/image_channels.h"
#include "base/image_float.h"

#if CRANNY_HAVE_EXR

#    include <inttypes.h>
#    include <openexr.h>

/* Of one chunk unpacked; a tile may span the image and hold channels that nobody wants. */
#    define CHUNK_LIMIT_BYTES ((uint64_t)1 << 32)
enum { CHANNEL_LIMIT = 1024, CHANNEL_TEXT_SIZE = 320 };

struct exr_job {
    exr_context_t context;
    char text[256]; /* OpenEXR's word for what is wrong */
    struct cranny_error *why;
    const char *name;
    int part;
    /* reading */
    const struct image_source *source;
    struct cranny_image *image;
    struct channel_choice choice;
    exr_decode_pipeline_t decode;
    bool decode_begun;
    int x, y; /* of the chunk in the image */
    /* writing */
    const struct image_view *view;
    const char *const *names;
    struct image_sink *sink;
    exr_encode_pipeline_t encode;
    bool encode_begun;
};

static void on_error(exr_const_context_t context, exr_result_t code, const char *text)
{
    void *user = NULL;
    (void)code;
    if (exr_get_user_data(context, &user) == EXR_ERR_SUCCESS && user) {
        struct exr_job *job = user;
        snprintf(job->text, sizeof job->text, "%s", text);
    }
}

static int64_t on_size(exr_const_context_t context, void *user)
{
    (void)context;
    return (int64_t)((struct exr_job *)user)->source->size;
}

static int64_t on_read(exr_const_context_t context, void *user, void *buffer, uint64_t size,
                       uint64_t offset, exr_stream_error_func_ptr_t error)
{
    const struct image_source *source = ((struct exr_job *)user)->source;
    (void)context;
    (void)error;
    if (offset >= source->size)
        return 0;
    if (size > source->size - offset)
        size = source->size - offset;
    memcpy(buffer, source->data + offset, (size_t)size);
    return (int64_t)size;
}

static int64_t on_write(exr_const_context_t context, void *user, const void *buffer, uint64_t size,
                        uint64_t offset, exr_stream_error_func_ptr_t error)
{
    if (image_sink_put(((struct exr_job *)user)->sink, offset, buffer, (size_t)size))
        return (int64_t)size;
    error(context, EXR_ERR_OUT_OF_MEMORY, "out of memory");
    return -1;
}

/* What OpenEXR says carries our name for the file already. */
static enum cranny_status fail_exr(const struct exr_job *job, exr_result_t code, bool reading)
{
    if (code == EXR_ERR_OUT_OF_MEMORY)
        return fail_memory(job->why, job->name);
    const char *text = *job->text ? job->text : exr_get_default_error_message(code);
    const size_t prefix = strlen(job->name);
    if (strncmp(text, job->name, prefix) == 0)
        text += prefix + strspn(text + prefix, "': ");
    if (code == EXR_ERR_FEATURE_NOT_IMPLEMENTED)
        return fail(job->why, CRANNY_INPUT, "%s: EXR: %s; write it with ZIP compression", job->name,
                    text);
    return reading
               ? fail(job->why, CRANNY_INPUT, "%s: broken EXR: %s; write it again", job->name, text)
               : fail(job->why, CRANNY_FAILED, "%s: EXR: %s", job->name, text);
}

static enum cranny_status read_failure(const struct exr_job *job, exr_result_t code)
{
    return fail_exr(job, code, true);
}

static void list_channels(const exr_attr_chlist_t *channels, char text[CHANNEL_TEXT_SIZE])
{
    size_t used = 0;
    text[0] = 0;
    for (int i = 0; i < channels->num_channels && used < CHANNEL_TEXT_SIZE; i++)
        used += (size_t)snprintf(text + used, CHANNEL_TEXT_SIZE - used, "%s%s", i ? ", " : "",
                                 channels->entries[i].name.str);
}

static enum cranny_status fail_channels(const struct exr_job *job,
                                        const exr_attr_chlist_t *channels)
{
    char text[CHANNEL_TEXT_SIZE];
    list_channels(channels, text);
    return fail(job->why, CRANNY_INPUT, "%s: needs channels %s, but has: %s; rename or export them",
                job->name, channels_wanted(job->source->kind), text);
}

static struct channel_choice choose(enum cranny_image_kind kind, const exr_attr_chlist_t *channels)
{
    const char *names[CHANNEL_LIMIT];
    const int count = min_int(channels->num_channels, CHANNEL_LIMIT);
    for (int i = 0; i < count; i++)
        names[i] = channels->entries[i].name.str;
    return channels_choose(kind, names, count);
}

/* The first flat part that has the channels. */
static enum cranny_status choose_part(struct exr_job *job)
{
    int part_count = 0;
    const exr_attr_chlist_t *first = NULL;
    exr_result_t result = exr_get_count(job->context, &part_count);
    if (result != EXR_ERR_SUCCESS)
        return read_failure(job, result);
    for (int part = 0; part < part_count; part++) {
        exr_storage_t storage;
        const exr_attr_chlist_t *channels;
        if (exr_get_storage(job->context, part, &storage) != EXR_ERR_SUCCESS ||
            (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) ||
            exr_get_channels(job->context, part, &channels) != EXR_ERR_SUCCESS)
            continue;
        first = first ? first : channels;
        job->choice = choose(job->source->kind, channels);
        job->part = part;
        if (job->choice.count)
            return CRANNY_OK;
    }
    return first ? fail_channels(job, first)
                 : fail(job->why, CRANNY_INPUT,
                        "%s: holds deep data only; flatten it and write it again", job->name);
}

static enum cranny_status check_part(const struct exr_job *job)
{
    uint64_t chunk_bytes = 0;
    const exr_attr_chlist_t *channels;
    exr_result_t result = exr_get_channels(job->context, job->part, &channels);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_chunk_unpacked_size(job->context, job->part, &chunk_bytes);
    if (result != EXR_ERR_SUCCESS)
        return read_failure(job, result);
    for (int i = 0; i < channels->num_channels; i++)
        if (channels->entries[i].x_sampling != 1 || channels->entries[i].y_sampling != 1)
            return fail(job->why, CRANNY_INPUT,
                        "%s: channel %s is subsampled, which is not supported; write it at full "
                        "resolution",
                        job->name, channels->entries[i].name.str);
    if (chunk_bytes > CHUNK_LIMIT_BYTES)
        return fail(job->why, CRANNY_MEMORY,
                    "%s: a tile or block of %" PRIu64 " bytes is over the limit; write it with "
                    "smaller ones",
                    job->name, chunk_bytes);
    return CRANNY_OK;
}

static uint32_t load_u32(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

static float float_of_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The exponent's bias is put right by the product, for subnormal halves too. */
static float float_of_half(uint32_t half)
{
    const uint32_t sign = (half & 0x8000) << 16, rest = (half & 0x7fff) << 13;
    if ((half & 0x7c00) == 0x7c00)
        return float_of_bits(sign | 0x7f800000 | rest);
    const float magnitude = float_of_bits(rest) * 0x1p112f;
    return sign ? -magnitude : magnitude;
}

static float load_sample(const uint8_t *bytes, exr_pixel_type_t type)
{
    switch (type) {
    case EXR_PIXEL_UINT:
        return (float)load_u32(bytes);
    case EXR_PIXEL_HALF:
        return float_of_half((uint32_t)bytes[0] | (uint32_t)bytes[1] << 8);
    case EXR_PIXEL_FLOAT:
    case EXR_PIXEL_LAST_TYPE:
        break;
    }
    return float_of_bits(load_u32(bytes));
}

/* -1: a channel that nobody asked for. */
static int slot_of(const struct channel_choice *choice, int channel)
{
    for (int k = 0; k < choice->count; k++)
        if (choice->index[k] == channel)
            return k;
    return -1;
}

/* OpenEXR 3.1's own routines write through the NULL of channels that are not wanted. In a chunk
 * each line holds its samples channel by channel, little-endian. */
static exr_result_t unpack_chunk(exr_decode_pipeline_t *decode)
{
    const struct exr_job *job = decode->decoding_user_data;
    const struct cranny_image *image = job->image;
    const uint8_t *from = decode->unpacked_buffer;
    uint64_t line_bytes = 0;
    for (int c = 0; c < decode->channel_count; c++) {
        const exr_coding_channel_info_t *channel = &decode->channels[c];
        if (channel->width != decode->chunk.width || channel->height != decode->chunk.height)
            return EXR_ERR_BAD_CHUNK_LEADER;
        line_bytes += (uint64_t)channel->width * (uint64_t)channel->bytes_per_element;
    }
    if (!from || decode->chunk.width > image->width - job->x ||
        decode->chunk.height > image->height - job->y ||
        line_bytes * (uint64_t)decode->chunk.height != decode->chunk.unpacked_size)
        return EXR_ERR_BAD_CHUNK_LEADER;
    for (int y = job->y; y < job->y + decode->chunk.height; y++)
        for (int c = 0; c < decode->channel_count; c++) {
            const exr_coding_channel_info_t *channel = &decode->channels[c];
            const size_t bytes = (size_t)channel->bytes_per_element;
            const int slot = slot_of(&job->choice, c);
            float *to = image->pixels + ((size_t)y * (size_t)image->width + (size_t)job->x) *
                                            (size_t)image->channels;
            for (int x = 0; x < channel->width && slot >= 0; x++)
                to[x * image->channels + slot] =
                    load_sample(from + (size_t)x * bytes, (exr_pixel_type_t)channel->data_type);
            from += (size_t)channel->width * bytes;
        }
    return EXR_ERR_SUCCESS;
}

static exr_result_t read_chunk(struct exr_job *job, const exr_chunk_info_t *chunk, int x, int y)
{
    exr_result_t result;
    job->x = x;
    job->y = y;
    if (job->decode_begun) {
        result = exr_decoding_update(job->context, job->part, chunk, &job->decode);
    } else {
        result = exr_decoding_initialize(job->context, job->part, chunk, &job->decode);
        job->decode_begun = result == EXR_ERR_SUCCESS;
        if (result == EXR_ERR_SUCCESS)
            result = exr_decoding_choose_default_routines(job->context, job->part, &job->decode);
        job->decode.decoding_user_data = job;
        job->decode.unpack_and_convert_fn = unpack_chunk;
    }
    return result == EXR_ERR_SUCCESS ? exr_decoding_run(job->context, job->part, &job->decode)
                                     : result;
}

static exr_result_t read_scanlines(struct exr_job *job, const exr_attr_box2i_t *window)
{
    int32_t lines = 0;
    exr_result_t result = exr_get_scanlines_per_chunk(job->context, job->part, &lines);
    if (result == EXR_ERR_SUCCESS && lines < 1)
        return EXR_ERR_INVALID_ATTR;
    for (int y = 0; y < job->image->height && result == EXR_ERR_SUCCESS; y += lines) {
        exr_chunk_info_t chunk;
        const int line = (int)(window->min.y + (int64_t)y);
        result = exr_read_scanline_chunk_info(job->context, job->part, line, &chunk);
        if (result == EXR_ERR_SUCCESS && chunk.start_y != line)
            result = EXR_ERR_BAD_CHUNK_LEADER;
        if (result == EXR_ERR_SUCCESS)
            result = read_chunk(job, &chunk, 0, y);
    }
    return result;
}

static exr_result_t read_tiles(struct exr_job *job)
{
    int32_t width = 0, height = 0;
    exr_result_t result = exr_get_tile_sizes(job->context, job->part, 0, 0, &width, &height);
    if (result == EXR_ERR_SUCCESS && (width < 1 || height < 1))
        return EXR_ERR_INVALID_ATTR;
    for (int64_t y = 0; y < job->image->height && result == EXR_ERR_SUCCESS; y += height)
        for (int64_t x = 0; x < job->image->width && result == EXR_ERR_SUCCESS; x += width) {
            exr_chunk_info_t chunk;
            result = exr_read_tile_chunk_info(job->context, job->part, (int)(x / width),
                                              (int)(y / height), 0, 0, &chunk);
            if (result == EXR_ERR_SUCCESS)
                result = read_chunk(job, &chunk, (int)x, (int)y);
        }
    return result;
}

/* Grey as a colour. */
static void repeat_first(const struct cranny_image *image)
{
    const size_t count = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < count; i++)
        image->pixels[i * 3 + 1] = image->pixels[i * 3 + 2] = image->pixels[i * 3];
}

static enum cranny_status read_part(struct exr_job *job)
{
    exr_attr_box2i_t window;
    exr_storage_t storage;
    exr_result_t result = exr_get_data_window(job->context, job->part, &window);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_storage(job->context, job->part, &storage);
    if (result != EXR_ERR_SUCCESS)
        return read_failure(job, result);
    enum cranny_status status =
        image_alloc(job->source, (int64_t)window.max.x - window.min.x + 1,
                    (int64_t)window.max.y - window.min.y + 1,
                    image_channels_of(job->source->kind, job->choice.count), job->image, job->why);
    if (status != CRANNY_OK)
        return status;
    result = storage == EXR_STORAGE_TILED ? read_tiles(job) : read_scanlines(job, &window);
    if (job->decode_begun)
        exr_decoding_destroy(job->context, &job->decode);
    if (result != EXR_ERR_SUCCESS)
        return read_failure(job, result);
    if (job->choice.count < job->image->channels)
        repeat_first(job->image);
    return CRANNY_OK;
}

enum cranny_status image_decode_exr(const struct image_source *source, struct cranny_image *image,
                                    struct cranny_error *why)
{
    struct exr_job job = {.why = why, .name = source->name, .source = source, .image = image};
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = on_error;
    setup.user_data = &job;
    setup.read_fn = on_read;
    setup.size_fn = on_size;
    setup.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    exr_result_t result = exr_start_read(&job.context, source->name, &setup);
    if (result != EXR_ERR_SUCCESS)
        return read_failure(&job, result);
    enum cranny_status status = choose_part(&job);
    if (status == CRANNY_OK)
        status = check_part(&job);
    if (status == CRANNY_OK)
        status = read_part(&job);
    exr_finish(&job.context);
    return status;
}

static exr_result_t begin_file(struct exr_job *job, bool half)
{
    const struct image_view *view = job->view;
    const exr_pixel_type_t type = half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    exr_result_t result = exr_add_part(job->context, NULL, EXR_STORAGE_SCANLINE, &job->part);
    if (result == EXR_ERR_SUCCESS)
        result = exr_initialize_required_attr_simple(job->context, job->part, view->width,
                                                     view->height, EXR_COMPRESSION_ZIP);
    for (int c = 0; c < view->channels && result == EXR_ERR_SUCCESS; c++)
        result = exr_add_channel(job->context, job->part, job->names[c], type,
                                 EXR_PERCEPTUALLY_LINEAR, 1, 1);
    return result == EXR_ERR_SUCCESS ? exr_write_header(job->context) : result;
}

/* The file's channels are in the order of their names. */
static void aim_encoder(struct exr_job *job, int y)
{
    const struct image_view *view = job->view;
    for (int i = 0; i < job->encode.channel_count; i++) {
        exr_coding_channel_info_t *channel = &job->encode.channels[i];
        int c = 0;
        while (c < view->channels - 1 && strcmp(job->names[c], channel->channel_name) != 0)
            c++;
        channel->encode_from_ptr = (const uint8_t *)(image_row(view, y) + c);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = 4;
        channel->user_pixel_stride = 4 * view->channels;
        channel->user_line_stride = (int32_t)view->stride;
    }
}

static exr_result_t write_chunk(struct exr_job *job, int y)
{
    exr_chunk_info_t chunk;
    exr_result_t result = exr_write_scanline_chunk_info(job->context, job->part, y, &chunk);
    if (result != EXR_ERR_SUCCESS)
        return result;
    const bool first = !job->encode_begun;
    result = first ? exr_encoding_initialize(job->context, job->part, &chunk, &job->encode)
                   : exr_encoding_update(job->context, job->part, &chunk, &job->encode);
    job->encode_begun = job->encode_begun || result == EXR_ERR_SUCCESS;
    if (result != EXR_ERR_SUCCESS)
        return result;
    aim_encoder(job, y);
    if (first)
        result = exr_encoding_choose_default_routines(job->context, job->part, &job->encode);
    return result == EXR_ERR_SUCCESS ? exr_encoding_run(job->context, job->part, &job->encode)
                                     : result;
}

enum cranny_status image_encode_exr(const struct image_view *view, const char *const names[3],
                                    bool half, const char *name, struct image_sink *sink,
                                    struct cranny_error *why)
{
    struct exr_job job = {.why = why, .name = name, .view = view, .names = names, .sink = sink};
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = on_error;
    setup.user_data = &job;
    setup.write_fn = on_write;
    exr_result_t result = exr_start_write(&job.context, name, EXR_WRITE_FILE_DIRECTLY, &setup);
    if (result != EXR_ERR_SUCCESS)
        return fail_exr(&job, result, false);
    int32_t lines = 1;
    result = begin_file(&job, half);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_scanlines_per_chunk(job.context, job.part, &lines);
    for (int y = 0; y < view->height && result == EXR_ERR_SUCCESS; y += lines)
        result = write_chunk(&job, y);
    if (job.encode_begun)
        exr_encoding_destroy(job.context, &job.encode);
    exr_result_t closed = exr_finish(&job.context);
    if (result == EXR_ERR_SUCCESS)
        result = closed;
    return result == EXR_ERR_SUCCESS ? CRANNY_OK : fail_exr(&job, result, false);
}

#else

enum cranny_status image_decode_exr(const struct image_source *source, struct cranny_image *image,
                                    struct cranny_error *why)
{
    (void)image;
    return fail(why, CRANNY_INPUT,
                "%s: this build is without OpenEXR; convert it to .pfm, or build Cranny with "
                "OpenEXR",
                source->name);
}

enum cranny_status image_encode_exr(const struct image_view *view, const char *const names[3],
                                    bool half, const char *name, struct image_sink *sink,
                                    struct cranny_error *why)
{
    (void)view;
    (void)names;
    (void)half;
    (void)sink;
    return fail(why, CRANNY_USAGE, "%s: this build is without OpenEXR", name);
}

#endif
