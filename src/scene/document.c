#include "scene/document_parts.h"

#include <inttypes.h>

enum cranny_status document_reserve(struct document *document, uint64_t bytes, const char *what,
                                    struct cranny_error *why)
{
    if (document->memory_used > document->memory_limit ||
        bytes > document->memory_limit - document->memory_used)
        return fail(why, CRANNY_MEMORY,
                    "%s: %s: %" PRIu64 " bytes more than the memory limit of %" PRIu64
                    " leaves; raise the limit or use a smaller scene",
                    document->path, what, bytes, document->memory_limit);
    document->memory_used += bytes;
    return CRANNY_OK;
}

void document_destroy(struct document **document)
{
    if (!document || !*document)
        return;
    struct document *d = *document;
    for (size_t i = 0; i < d->buffer_count; i++)
        if (!d->buffers[i].from_chunk)
            free(d->buffers[i].data);
    free(d->buffers);
    json_decref(d->root);
    free(d->file);
    free(d->path);
    free(d);
    *document = NULL;
}

/* What the JSON tree may take, from its marks: an upper bound on jansson's nodes, kept before they
 * are made because two bytes of text can become a hundred of tree. */
static uint64_t tree_bytes(const char *text, size_t size)
{
    uint64_t bytes = size;
    bool quoted = false;
    for (size_t i = 0; i < size; i++) {
        if (quoted && text[i] == '\\')
            i++;
        else if (text[i] == '"')
            quoted = !quoted;
        else if (!quoted)
            bytes += text[i] == '{'   ? 352
                     : text[i] == '[' ? 192
                     : text[i] == ',' ? 48
                                      : 0,
                bytes += text[i] == ':' ? 112 : 0;
    }
    return bytes;
}

/* Spaces at the start of the first indented line; 0 for text in one line. */
static int find_indent(const char *text, size_t size)
{
    for (size_t i = 0; i + 1 < size; i++) {
        if (text[i] != '\n')
            continue;
        size_t spaces = 0;
        while (i + 1 + spaces < size && text[i + 1 + spaces] == ' ')
            spaces++;
        if (i + 1 + spaces < size && text[i + 1 + spaces] == '\t')
            return 4;
        if (i + 1 + spaces < size && !strchr("\r\n", text[i + 1 + spaces]))
            return spaces < 1 ? 1 : spaces > 8 ? 8 : (int)spaces;
    }
    return 0;
}

static enum cranny_status parse_json(struct document *document, const char *text, size_t size,
                                     struct cranny_error *why)
{
    static const char mark[] = "\xef\xbb\xbf";
    if (size >= 3 && memcmp(text, mark, 3) == 0) {
        text += 3;
        size -= 3;
    }
    while (size && (text[size - 1] == 0 || text[size - 1] == ' '))
        size--;
    document->indent = document->is_glb ? 0 : find_indent(text, size);
    enum cranny_status status =
        document_reserve(document, tree_bytes(text, size), "the JSON tree", why);
    if (status != CRANNY_OK)
        return status;
    json_error_t problem;
    document->root = json_loadb(text, size, JSON_REJECT_DUPLICATES | JSON_ALLOW_NUL, &problem);
    if (!document->root)
        return fail(why, CRANNY_INPUT, "%s: JSON at line %d, column %d, byte %d: %s",
                    document->path, problem.line, problem.column, problem.position, problem.text);
    return CRANNY_OK;
}

static enum cranny_status parse_container(struct document *document, struct cranny_error *why)
{
    enum cranny_status status =
        glb_check(document->file, document->file_size, document->path, document->hooks, why);
    if (status != CRANNY_OK)
        return status;
    struct glb_chunk chunk, json = {0};
    for (size_t offset = 0; glb_next(document->file, &offset, &chunk);) {
        if (chunk.type == GLB_JSON) {
            json = chunk;
        } else if (chunk.type == GLB_BIN) {
            document->chunk = chunk.data;
            document->chunk_size = chunk.size;
        }
    }
    return parse_json(document, (const char *)json.data, json.size, why);
}

static enum cranny_status parse_text(struct document *document, struct cranny_error *why)
{
    const char *text = (const char *)document->file;
    size_t size = document->file_size,
           skip = size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    while (skip < size && memchr(" \t\r\n", text[skip], 4))
        skip++;
    if (skip == size)
        return fail(why, CRANNY_INPUT, "%s: the file is empty", document->path);
    if (text[skip] != '{')
        return fail(why, CRANNY_INPUT,
                    "%s: neither a GLB (\"glTF\" at byte 0) nor JSON ('{' at byte %zu)",
                    document->path, skip);
    enum cranny_status status = parse_json(document, text, size, why);
    free(document->file);
    document->file = NULL;
    document->file_size = 0;
    return status;
}

static enum cranny_status list_buffers(struct document *document, struct cranny_error *why)
{
    const json_t *list = json_object_get(document->root, "buffers");
    document->buffers = alloc_array(json_array_size(list), sizeof *document->buffers);
    if (!document->buffers)
        return fail_memory(why, "buffers");
    document->buffer_count = json_array_size(list);
    if (document->buffer_count && document->chunk &&
        !json_object_get(json_array_get(list, 0), "uri"))
        document->buffers[0].from_chunk = true;
    return CRANNY_OK;
}

static enum cranny_status parse_document(struct document *document, struct cranny_error *why)
{
    enum cranny_status status = document_reserve(document, document->file_size, "the file", why);
    if (status == CRANNY_OK)
        status = document->is_glb ? parse_container(document, why) : parse_text(document, why);
    if (status == CRANNY_OK)
        status = document_check(document, why);
    return status == CRANNY_OK ? list_buffers(document, why) : status;
}

enum cranny_status document_parse(uint8_t *file, size_t size, const char *name, bool in_memory,
                                  bool allow_outside, uint64_t memory_limit,
                                  const struct cranny_hooks *hooks, struct document **document,
                                  struct cranny_error *why)
{
    *document = NULL;
    struct document *d = alloc_array(1, sizeof *d);
    if (!d) {
        free(file);
        return fail_memory(why, "document");
    }
    *d = (struct document){.path = copy_text(name),
                           .is_glb = glb_is(file, size),
                           .in_memory = in_memory,
                           .allow_outside = allow_outside,
                           .file = file,
                           .file_size = size,
                           .memory_limit = memory_limit,
                           .hooks = hooks};
    enum cranny_status status = d->path ? parse_document(d, why) : fail_memory(why, "document");
    if (status == CRANNY_OK)
        *document = d;
    else
        document_destroy(&d);
    return status;
}

enum cranny_status document_load(const char *path, bool allow_outside, uint64_t memory_limit,
                                 const struct cranny_hooks *hooks, struct document **document,
                                 struct cranny_error *why)
{
    uint8_t *file;
    size_t size;
    *document = NULL;
    enum cranny_status status = file_read(path, memory_limit, &file, &size, why);
    if (status != CRANNY_OK)
        return status;
    return document_parse(file, size, path, false, allow_outside, memory_limit, hooks, document,
                          why);
}

enum cranny_status document_fetch_uri(const struct document *document, const char *uri,
                                      const char *where, uint8_t **data, size_t *size,
                                      struct cranny_error *why)
{
    *data = NULL;
    *size = 0;
    if (uri_is_data(uri))
        return uri_decode_data(document, uri, where, data, size, why);
    char *path;
    enum cranny_status status = uri_resolve(document, uri, where, &path, NULL, why);
    if (status != CRANNY_OK)
        return status;
    const uint64_t used = document->memory_used, limit = document->memory_limit;
    status = file_read(path, limit > used ? limit - used : 0, data, size, why);
    free(path);
    return status;
}

static enum cranny_status check_length(const struct document *document, size_t index,
                                       uint64_t declared, size_t size, struct cranny_error *why)
{
    if (declared <= size)
        return CRANNY_OK;
    return fail(why, CRANNY_INPUT,
                "%s: /buffers/%zu: byteLength is %" PRIu64 ", but there are only %zu bytes",
                document->path, index, declared, size);
}

enum cranny_status document_fetch_buffer(const struct document *document, size_t index,
                                         const uint8_t **data, size_t *size, uint8_t **owned,
                                         struct cranny_error *why)
{
    *data = NULL;
    *size = 0;
    *owned = NULL;
    const json_t *buffer = json_array_get(json_object_get(document->root, "buffers"), index);
    const char *uri = json_string_value(json_object_get(buffer, "uri"));
    char where[48];
    snprintf(where, sizeof where, "/buffers/%zu/uri", index);
    uint64_t declared;
    if (!buffer)
        return fail(why, CRANNY_INPUT, "%s: there is no buffer %zu", document->path, index);
    if (!json_whole(buffer, "byteLength", SIZE_MAX, 0, &declared))
        return fail(why, CRANNY_INPUT, "%s: /buffers/%zu/byteLength: not a whole number >= 0",
                    document->path, index);
    enum cranny_status status = CRANNY_OK;
    if (document->buffers[index].from_chunk || document->buffers[index].data) {
        const bool loaded = document->buffers[index].data;
        *data = loaded ? document->buffers[index].data : document->chunk;
        *size = loaded ? document->buffers[index].size : document->chunk_size;
    } else if (uri) {
        status = document_fetch_uri(document, uri, where, owned, size, why);
        *data = *owned;
    } else {
        return fail(why, CRANNY_INPUT,
                    "%s: /buffers/%zu has neither a uri nor a BIN chunk; its data is missing",
                    document->path, index);
    }
    if (status == CRANNY_OK)
        status = check_length(document, index, declared, *size, why);
    if (status != CRANNY_OK) {
        free(*owned);
        *owned = NULL;
        *data = NULL;
    }
    return status;
}

enum cranny_status document_buffer(struct document *document, size_t index, const uint8_t **data,
                                   size_t *size, struct cranny_error *why)
{
    *data = NULL;
    *size = 0;
    if (index < document->buffer_count && document->buffers[index].data) {
        *data = document->buffers[index].data;
        *size = document->buffers[index].size;
        return CRANNY_OK;
    }
    uint8_t *owned;
    enum cranny_status status = document_fetch_buffer(document, index, data, size, &owned, why);
    if (status == CRANNY_OK && owned)
        status = document_reserve(document, *size, "a buffer", why);
    if (status != CRANNY_OK) {
        free(owned);
        *data = NULL;
        *size = 0;
        return status;
    }
    struct document_buffer *buffer = &document->buffers[index];
    buffer->data = owned ? owned : (uint8_t *)(uintptr_t)*data;
    buffer->size = *size;
    return CRANNY_OK;
}

static enum cranny_status image_in_view(struct document *document, const json_t *image,
                                        size_t index, const uint8_t **data, size_t *size,
                                        struct cranny_error *why)
{
    uint64_t view_index, buffer, offset, length;
    const json_t *views = json_object_get(document->root, "bufferViews");
    if (!json_whole(image, "bufferView", UINT32_MAX, UINT32_MAX, &view_index) ||
        view_index >= json_array_size(views))
        return fail(why, CRANNY_INPUT, "%s: /images/%zu/bufferView: there is no such buffer view",
                    document->path, index);
    const json_t *view = json_array_get(views, (size_t)view_index);
    if (!json_whole(view, "buffer", UINT32_MAX, UINT32_MAX, &buffer) ||
        !json_whole(view, "byteOffset", SIZE_MAX, 0, &offset) ||
        !json_whole(view, "byteLength", SIZE_MAX, 0, &length))
        return fail(why, CRANNY_INPUT,
                    "%s: /bufferViews/%" PRIu64 ": buffer, byteOffset and byteLength must be whole "
                    "numbers >= 0",
                    document->path, view_index);
    const uint8_t *bytes;
    size_t there;
    enum cranny_status status = document_buffer(document, (size_t)buffer, &bytes, &there, why);
    if (status != CRANNY_OK)
        return status;
    if (offset > there || length > there - offset)
        return fail(why, CRANNY_INPUT,
                    "%s: /bufferViews/%" PRIu64 " ends %" PRIu64 " bytes into buffer %" PRIu64
                    ", which has %zu",
                    document->path, view_index, offset + length, buffer, there);
    *data = bytes + offset;
    *size = (size_t)length;
    return CRANNY_OK;
}

enum cranny_status document_image(struct document *document, size_t index, const uint8_t **data,
                                  size_t *size, uint8_t **owned, struct cranny_error *why)
{
    *data = NULL;
    *size = 0;
    *owned = NULL;
    const json_t *image = json_array_get(json_object_get(document->root, "images"), index);
    const char *uri = json_string_value(json_object_get(image, "uri"));
    char where[48];
    snprintf(where, sizeof where, "/images/%zu/uri", index);
    if (!image)
        return fail(why, CRANNY_INPUT, "%s: there is no image %zu", document->path, index);
    if (!uri)
        return image_in_view(document, image, index, data, size, why);
    enum cranny_status status = document_fetch_uri(document, uri, where, owned, size, why);
    *data = *owned;
    return status;
}
