#include "scene/document_parts.h"

#include <errno.h>
#include <strings.h>
#include <sys/stat.h>

static json_t *root_list(json_t *root, const char *key)
{
    json_t *list = json_object_get(root, key);
    if (!list && json_object_set_new(root, key, json_array()) == 0)
        list = json_object_get(root, key);
    return list;
}

/* Whether appended bytes can follow the BIN chunk: it holds all that buffer 0 declares. */
static bool can_extend_chunk(const struct document *document)
{
    uint64_t declared;
    const json_t *first = json_array_get(json_object_get(document->root, "buffers"), 0);
    return document->buffer_count && document->buffers[0].from_chunk &&
           json_whole(first, "byteLength", SIZE_MAX, 0, &declared) &&
           declared <= document->chunk_size;
}

enum cranny_status document_edit_begin(const struct document *document, struct document_edit *edit,
                                       struct cranny_error *why)
{
    *edit = (struct document_edit){.root = json_deep_copy(document->root)};
    if (!edit->root)
        return fail_memory(why, document->path);
    edit->views = json_array_size(json_object_get(edit->root, "bufferViews"));
    edit->buffer = document->buffer_count;
    if (can_extend_chunk(document)) {
        edit->buffer = 0;
        edit->base = ((uint64_t)document->chunk_size + 15) & ~(uint64_t)15;
    }
    return CRANNY_OK;
}

static bool append_bytes(struct document_edit *edit, const void *data, size_t size)
{
    const size_t start = (edit->size + 15) & ~(size_t)15;
    if (size > SIZE_MAX / 4 - start)
        return false;
    const size_t old = edit->size;
    if (!grow_array((void **)&edit->bytes, &edit->capacity, start + size, 1))
        return false;
    memset(edit->bytes + old, 0, start - old);
    if (size)
        memcpy(edit->bytes + start, data, size);
    edit->size = start + size;
    return true;
}

enum cranny_status document_edit_append(struct document_edit *edit, const void *data, size_t size,
                                        int target, int stride, size_t *view,
                                        struct cranny_error *why)
{
    *view = 0;
    if (!append_bytes(edit, data, size))
        return fail_memory(why, "appended data");
    json_t *views = root_list(edit->root, "bufferViews");
    const uint64_t offset = edit->base + edit->size - size;
    json_t *entry = json_pack("{s:I, s:I, s:I}", "buffer", (json_int_t)edit->buffer, "byteOffset",
                              (json_int_t)offset, "byteLength", (json_int_t)size);
    bool good = entry && views;
    if (good && stride)
        good = json_object_set_new(entry, "byteStride", json_integer(stride)) == 0;
    if (good && target)
        good = json_object_set_new(entry, "target", json_integer(target)) == 0;
    if (!good || json_array_append(views, entry) != 0) {
        json_decref(entry);
        return fail_memory(why, "appended data");
    }
    json_decref(entry);
    *view = json_array_size(views) - 1;
    return CRANNY_OK;
}

void document_edit_free(struct document_edit *edit)
{
    json_decref(edit->root);
    free(edit->bytes);
    *edit = (struct document_edit){0};
}
