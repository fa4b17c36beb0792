#include "scene/views.h"

#include "scene/fields.h"

#if CRANNY_HAVE_MESHOPT
#    include <meshoptimizer.h>
#endif

enum cranny_status views_open(struct document *document, struct views *views,
                              struct cranny_error *why)
{
    size_t count = document_count(document, "bufferViews");
    *views = (struct views){.document = document, .count = count};
    views->decoded = alloc_array(count, sizeof *views->decoded);
    views->decoded_size = alloc_array(count, sizeof *views->decoded_size);
    if (views->decoded && views->decoded_size)
        return CRANNY_OK;
    views_close(views);
    return fail_memory(why, "buffer views");
}

void views_close(struct views *views)
{
    for (size_t i = 0; views->decoded && i < views->count; i++)
        free(views->decoded[i]);
    free(views->decoded);
    free(views->decoded_size);
    *views = (struct views){0};
}

/* byteOffset, byteLength and byteStride of a view or of its compressed form. */
struct range {
    int buffer;
    uint64_t offset, length, stride;
};

static enum cranny_status read_range(struct document *document, const struct place *place,
                                     const json_t *object, struct range *range,
                                     struct cranny_error *why)
{
    enum cranny_status status =
        field_index(document, place, object, "buffer", document_count(document, "buffers"),
                    &range->buffer, why);
    if (status == CRANNY_OK && range->buffer < 0)
        return fail_at(document, place, why, CRANNY_INPUT, "has no buffer");
    if (status == CRANNY_OK)
        status = field_count(document, place, object, "byteOffset", 0, &range->offset, why);
    if (status == CRANNY_OK && !json_object_get(object, "byteLength"))
        return fail_at(document, place, why, CRANNY_INPUT, "has no byteLength");
    if (status == CRANNY_OK)
        status = field_count(document, place, object, "byteLength", 0, &range->length, why);
    if (status == CRANNY_OK)
        status = field_count(document, place, object, "byteStride", 0, &range->stride, why);
    if (status == CRANNY_OK && range->stride > 65536)
        return fail_at(document, place, why, CRANNY_INPUT, "byteStride %llu is absurd",
                       (unsigned long long)range->stride);
    return status;
}

static enum cranny_status range_bytes(struct document *document, const struct place *place,
                                      const struct range *range, const uint8_t **data,
                                      struct cranny_error *why)
{
    size_t size;
    enum cranny_status status = document_buffer(document, (size_t)range->buffer, data, &size, why);
    if (status != CRANNY_OK)
        return status;
    if (range->offset > size || range->length > size - range->offset)
        return fail_at(document, place, why, CRANNY_INPUT,
                       "bytes %llu to %llu lie outside buffer %d of %zu bytes",
                       (unsigned long long)range->offset,
                       (unsigned long long)(range->offset + range->length), range->buffer, size);
    *data += range->offset;
    return CRANNY_OK;
}

enum mode { MODE_ATTRIBUTES, MODE_TRIANGLES, MODE_INDICES };
enum filter { FILTER_NONE, FILTER_OCTAHEDRAL, FILTER_QUATERNION, FILTER_EXPONENTIAL };

static int find_word(const json_t *value, const char *const *words, int count)
{
    const char *text = json_string_value(value);
    for (int i = 0; text && i < count; i++)
        if (!strcmp(text, words[i]))
            return i;
    return -1;
}

struct compressed {
    struct range range;
    uint64_t count;
    enum mode mode;
    enum filter filter;
};

/* What the codec demands before it may be called (EXT_meshopt_compression, "JSON schema"), and that
 * the result is not far larger than any stream of that length could hold. */
static const char *compressed_fault(const struct compressed *c)
{
    const uint64_t stride = c->range.stride, size = c->range.length;
    if (c->mode == MODE_ATTRIBUTES && (stride == 0 || stride % 4 || stride > 256))
        return "byteStride must be a multiple of 4 up to 256";
    if (c->mode != MODE_ATTRIBUTES && stride != 2 && stride != 4)
        return "byteStride must be 2 or 4";
    if (c->mode == MODE_TRIANGLES && c->count % 3)
        return "count must be a multiple of 3";
    if (c->mode != MODE_ATTRIBUTES && c->filter != FILTER_NONE)
        return "a filter needs the mode ATTRIBUTES";
    if (c->filter == FILTER_OCTAHEDRAL && stride != 4 && stride != 8)
        return "the filter OCTAHEDRAL needs a byteStride of 4 or 8";
    if (c->filter == FILTER_QUATERNION && stride != 8)
        return "the filter QUATERNION needs a byteStride of 8";
    const uint64_t per_byte = c->mode == MODE_TRIANGLES ? 3 : c->mode == MODE_INDICES ? 1 : 2048;
    if (c->count / per_byte > size)
        return "count is larger than its bytes can hold";
    return NULL;
}

static enum cranny_status read_compressed(struct document *document, const struct place *place,
                                          const json_t *object, struct compressed *c,
                                          struct cranny_error *why)
{
    static const char *const modes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
    static const char *const filters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"};
    enum cranny_status status = read_range(document, place, object, &c->range, why);
    if (status == CRANNY_OK)
        status = field_count(document, place, object, "count", 0, &c->count, why);
    if (status != CRANNY_OK)
        return status;
    int mode = find_word(json_object_get(object, "mode"), modes, COUNT_OF(modes));
    const json_t *filter_name = json_object_get(object, "filter");
    int filter = filter_name ? find_word(filter_name, filters, COUNT_OF(filters)) : FILTER_NONE;
    if (mode < 0 || filter < 0)
        return fail_at(document, place, why, CRANNY_INPUT, "unknown %s",
                       mode < 0 ? "mode" : "filter");
    c->mode = (enum mode)mode;
    c->filter = (enum filter)filter;
    const char *fault = compressed_fault(c);
    if (fault)
        return fail_at(document, place, why, CRANNY_INPUT, "%s", fault);
    return CRANNY_OK;
}

#if CRANNY_HAVE_MESHOPT
static bool decompress(const struct compressed *c, const uint8_t *source, uint8_t *out)
{
    const size_t count = (size_t)c->count, stride = (size_t)c->range.stride;
    const size_t size = (size_t)c->range.length;
    if (c->mode == MODE_TRIANGLES)
        return meshopt_decodeIndexBuffer(out, count, stride, source, size) == 0;
    if (c->mode == MODE_INDICES)
        return meshopt_decodeIndexSequence(out, count, stride, source, size) == 0;
    if (meshopt_decodeVertexBuffer(out, count, stride, source, size) != 0)
        return false;
    switch (c->filter) {
    case FILTER_NONE:
        break;
    case FILTER_OCTAHEDRAL:
        meshopt_decodeFilterOct(out, count, stride);
        break;
    case FILTER_QUATERNION:
        meshopt_decodeFilterQuat(out, count, stride);
        break;
    case FILTER_EXPONENTIAL:
        meshopt_decodeFilterExp(out, count, stride);
        break;
    }
    return true;
}
#else
static bool decompress(const struct compressed *c, const uint8_t *source, uint8_t *out)
{
    (void)c, (void)source, (void)out;
    return false;
}
#endif

static enum cranny_status load_compressed(struct views *views, size_t index,
                                          const struct place *place, const json_t *object,
                                          struct cranny_error *why)
{
    struct document *document = views->document;
    struct compressed c = {0};
    const uint8_t *source;
    enum cranny_status status = read_compressed(document, place, object, &c, why);
    if (status == CRANNY_OK)
        status = range_bytes(document, place, &c.range, &source, why);
    uint64_t size = c.count * c.range.stride; /* below 2^64: count is bounded by the bytes */
    if (status == CRANNY_OK)
        status = document_reserve(document, size, "compressed geometry", why);
    if (status != CRANNY_OK)
        return status;
    uint8_t *decoded = alloc_aligned((size_t)c.count, (size_t)c.range.stride);
    if (!decoded)
        return fail_memory(why, "compressed geometry");
    if (c.count && !decompress(&c, source, decoded)) {
        free(decoded);
        return fail_at(document, place, why, CRANNY_INPUT,
                       CRANNY_HAVE_MESHOPT ? "the compressed bytes are broken"
                                           : "this build cannot decompress it; build Cranny with "
                                             "meshoptimizer, or decompress the file first");
    }
    views->decoded[index] = decoded;
    views->decoded_size[index] = (size_t)size;
    return CRANNY_OK;
}

static const char *compression_of(const json_t *item)
{
    static const char *const names[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};
    for (size_t i = 0; i < COUNT_OF(names); i++)
        if (extension_of(item, names[i]))
            return names[i];
    return NULL;
}

enum cranny_status views_get(struct views *views, size_t index, struct view *view,
                             struct cranny_error *why)
{
    struct document *document = views->document;
    const struct place place = {NULL, "bufferViews", index};
    json_t *item;
    struct range range;
    *view = (struct view){0};
    enum cranny_status status = document_item(document, "bufferViews", index, &item, why);
    if (status == CRANNY_OK)
        status = read_range(document, &place, item, &range, why);
    if (status != CRANNY_OK)
        return status;
    const char *compression = compression_of(item);
    if (compression && !views->decoded[index])
        status = load_compressed(
            views, index, PLACE(PLACE(&place, "extensions", NO_INDEX), compression, NO_INDEX),
            extension_of(item, compression), why);
    if (compression) {
        view->data = views->decoded[index];
        view->size = views->decoded_size[index];
    } else {
        status = range_bytes(document, &place, &range, &view->data, why);
        view->size = (size_t)range.length;
    }
    view->stride = (size_t)range.stride;
    return status;
}
