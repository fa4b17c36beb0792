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

/* A save in progress: the tree as it is written, and what goes into the BIN chunk. */
struct saving {
    const struct document *document;
    struct document_edit *edit;
    const char *path;
    char *folder; /* of the output */
    struct file_part bin[4];
    size_t bin_count;
    bool has_bin;
    uint8_t *owned; /* bytes of the BIN chunk that had to be fetched */
};

static const uint8_t zeros[16];

static void add_bin(struct saving *saving, const void *data, size_t size)
{
    saving->has_bin = true;
    saving->bin[saving->bin_count++] = (struct file_part){data, size};
}

static enum cranny_status set_uri(json_t *object, const char *uri, struct cranny_error *why)
{
    json_t *text = uri ? json_string_nocheck(uri) : NULL;
    if (!text || json_object_set_new(object, "uri", text) != 0)
        return fail_memory(why, "data URI");
    return CRANNY_OK;
}

static enum cranny_status set_data_uri(json_t *object, const char *type,
                                       const struct file_part *parts, size_t part_count,
                                       struct cranny_error *why)
{
    char *uri = uri_encode_data(type, parts, part_count);
    enum cranny_status status = set_uri(object, uri, why);
    free(uri);
    return status;
}

#define BUFFER_TYPE "application/octet-stream"

/* Appended bytes follow the BIN chunk (else they get a buffer of their own). */
static bool extends_chunk(const struct saving *saving)
{
    return saving->edit->buffer < saving->document->buffer_count;
}

/* Make room for the appended bytes: grow buffer 0 or add a buffer. */
static enum cranny_status declare_appended(struct document_edit *edit, struct cranny_error *why)
{
    if (!edit->size)
        return CRANNY_OK;
    json_t *buffers = root_list(edit->root, "buffers");
    if (buffers && edit->buffer == json_array_size(buffers))
        json_array_append_new(buffers, json_object());
    json_t *buffer = json_array_get(buffers, edit->buffer);
    json_t *length = json_integer((json_int_t)(edit->base + edit->size));
    if (!buffer || json_object_set_new(buffer, "byteLength", length) != 0)
        return fail_memory(why, "appended data");
    return CRANNY_OK;
}

/* The BIN chunk of a .glb that stays one, with what was appended. */
static void keep_chunk(struct saving *saving)
{
    const struct document *document = saving->document;
    const struct document_edit *edit = saving->edit;
    if (document->chunk)
        add_bin(saving, document->chunk, document->chunk_size);
    if (!edit->size || !extends_chunk(saving))
        return;
    add_bin(saving, zeros, (size_t)edit->base - document->chunk_size);
    add_bin(saving, edit->bytes, edit->size);
}

/* Appended bytes in a buffer of their own: the BIN chunk when that is free, else a data URI. */
static enum cranny_status place_new_buffer(struct saving *saving, bool to_glb,
                                           struct cranny_error *why)
{
    struct document_edit *edit = saving->edit;
    enum cranny_status status = declare_appended(edit, why);
    if (status != CRANNY_OK || !edit->size || extends_chunk(saving))
        return status;
    if (to_glb && edit->buffer == 0 && !saving->has_bin) {
        add_bin(saving, edit->bytes, edit->size);
        return CRANNY_OK;
    }
    json_t *buffer = json_array_get(json_object_get(edit->root, "buffers"), edit->buffer);
    struct file_part part = {edit->bytes, edit->size};
    return set_data_uri(buffer, BUFFER_TYPE, &part, 1, why);
}

static bool is_outside_file(const json_t *object)
{
    const char *uri = json_string_value(json_object_get(object, "uri"));
    return uri && !uri_is_data(uri);
}

/* By content: extensions and the file's own claim can be wrong. */
static const char *data_type(const uint8_t *data, size_t size)
{
    static const struct {
        size_t at, size;
        const char *mark, *type;
    } kinds[] = {{0, 8, "\x89PNG\r\n\x1a\n", "image/png"},
                 {0, 3, "\xff\xd8\xff", "image/jpeg"},
                 {8, 4, "WEBP", "image/webp"},
                 {4, 8, "ftypavif", "image/avif"},
                 {0, 6, "\xabKTX 2", "image/ktx2"}};
    for (size_t i = 0; i < COUNT_OF(kinds); i++)
        if (size >= kinds[i].at + kinds[i].size &&
            memcmp(data + kinds[i].at, kinds[i].mark, kinds[i].size) == 0)
            return kinds[i].type;
    return BUFFER_TYPE;
}

/* Replace the URI of an outside file by its bytes. */
static enum cranny_status embed_file(struct saving *saving, json_t *object, const char *where,
                                     struct cranny_error *why)
{
    const char *uri = json_string_value(json_object_get(object, "uri"));
    uint8_t *data;
    size_t size;
    enum cranny_status status = document_fetch_uri(saving->document, uri, where, &data, &size, why);
    if (status != CRANNY_OK)
        return status;
    struct file_part part = {data, size};
    status = set_data_uri(object, data_type(data, size), &part, 1, why);
    free(data);
    return status;
}

/* Let the appended bytes follow the first `size` ones of buffer 0. */
static enum cranny_status move_appended(struct saving *saving, uint64_t size,
                                        struct cranny_error *why)
{
    struct document_edit *edit = saving->edit;
    if (!edit->size)
        return CRANNY_OK;
    edit->buffer = 0;
    edit->base = (size + 15) & ~(uint64_t)15;
    const json_t *views = json_object_get(edit->root, "bufferViews");
    for (size_t i = edit->views; i < json_array_size(views); i++) {
        json_t *view = json_array_get(views, i);
        const json_int_t offset = json_integer_value(json_object_get(view, "byteOffset"));
        json_t *moved = json_integer(offset + (json_int_t)edit->base);
        if (json_object_set_new(view, "buffer", json_integer(0)) != 0 ||
            json_object_set_new(view, "byteOffset", moved) != 0)
            return fail_memory(why, "appended data");
    }
    add_bin(saving, zeros, (size_t)(edit->base - size));
    add_bin(saving, edit->bytes, edit->size);
    return CRANNY_OK;
}

/* A .glb stands alone: buffer 0 becomes its BIN chunk, other files become data URIs. */
static enum cranny_status move_first_buffer(struct saving *saving, struct cranny_error *why)
{
    json_t *first = json_array_get(json_object_get(saving->edit->root, "buffers"), 0);
    const uint8_t *data;
    size_t size;
    struct cranny_error problem = {0};
    if (saving->document->buffer_count == 0 || !json_object_get(first, "uri"))
        return CRANNY_OK;
    enum cranny_status status =
        document_fetch_buffer(saving->document, 0, &data, &size, &saving->owned, &problem);
    if (status == CRANNY_INPUT) {
        hook_warn(saving->edit->hooks, "%s; the output names it still", problem.message);
        return CRANNY_OK;
    }
    if (status != CRANNY_OK)
        return fail(why, status, "%s", problem.message);
    uint64_t declared;
    json_whole(first, "byteLength", SIZE_MAX, size, &declared);
    add_bin(saving, data, (size_t)declared);
    json_object_del(first, "uri");
    return move_appended(saving, declared, why);
}

static enum cranny_status same_bytes(const char *path, const uint8_t *data, size_t size, bool *same,
                                     struct cranny_error *why)
{
    uint8_t *there;
    size_t there_size;
    enum cranny_status status = file_read(path, UINT64_MAX, &there, &there_size, why);
    if (status == CRANNY_OK)
        *same = there_size == size && memcmp(there, data, size) == 0;
    free(there);
    return status;
}

static enum cranny_status make_folders(const char *path, size_t base, struct cranny_error *why)
{
    char *folder = copy_text(path);
    if (!folder)
        return fail_memory(why, path);
    for (char *c = folder + base; *c; c++) {
        if (*c != '/' || c == folder)
            continue;
        *c = 0;
        if (mkdir(folder, 0777) != 0 && errno != EEXIST) {
            enum cranny_status status =
                fail(why, CRANNY_FAILED, "%s: cannot be made: %s", folder, strerror(errno));
            free(folder);
            return status;
        }
        *c = '/';
    }
    free(folder);
    return CRANNY_OK;
}

/* Write `from`'s bytes to `to`, unless that is the same file or holds the same. */
static enum cranny_status copy_file(const char *from, const char *to, size_t base,
                                    struct cranny_error *why)
{
    struct stat source, target;
    const bool exists = stat(to, &target) == 0;
    if (exists && stat(from, &source) == 0 && source.st_dev == target.st_dev &&
        source.st_ino == target.st_ino)
        return CRANNY_OK;
    uint8_t *data;
    size_t size;
    enum cranny_status status = file_read(from, UINT64_MAX, &data, &size, why);
    if (status != CRANNY_OK)
        return status;
    bool same = false;
    if (exists) {
        if (same_bytes(to, data, size, &same, NULL) == CRANNY_MEMORY)
            status = fail_memory(why, to);
        else if (!same)
            status = fail(why, CRANNY_FAILED,
                          "%s: another file is there, and the scene needs %s beside it; write to "
                          "another folder or to a .glb",
                          to, from);
    } else {
        struct file_part part = {data, size};
        status = make_folders(to, base, why);
        if (status == CRANNY_OK)
            status = file_write(to, &part, 1, why);
    }
    free(data);
    return status;
}

static bool has_parent_step(const char *path)
{
    for (const char *c = path; (c = strstr(c, "..")); c++)
        if ((c == path || c[-1] == '/') && (c[2] == '/' || !c[2]))
            return true;
    return false;
}

/* Bring the file that `uri` names to the same place beside the output. */
static enum cranny_status carry_file(struct saving *saving, json_t *object, const char *where,
                                     struct cranny_error *why)
{
    const char *uri = json_string_value(json_object_get(object, "uri"));
    char *from, *relative;
    enum cranny_status status = uri_resolve(saving->document, uri, where, &from, &relative, why);
    if (status != CRANNY_OK || relative[0] == '/') {
        if (status == CRANNY_OK) {
            free(from);
            free(relative);
        }
        return status;
    }
    const size_t base = strlen(saving->folder), length = base + strlen(relative) + 1;
    char *to = malloc(length);
    struct stat source, target;
    if (to)
        snprintf(to, length, "%s%s", saving->folder, relative);
    const bool there = to && stat(to, &target) == 0 && stat(from, &source) == 0 &&
                       source.st_dev == target.st_dev && source.st_ino == target.st_ino;
    if (!to)
        status = fail_memory(why, where);
    else if (!there && has_parent_step(relative))
        status = fail(why, CRANNY_FAILED,
                      "%s: %s: '%s' cannot be copied along, it lies outside; write a .glb",
                      saving->path, where, relative);
    else if (!there)
        status = copy_file(from, to, base, why);
    free(to);
    free(from);
    free(relative);
    return status;
}

/* What to do with a file that a member of `buffers` or `images` names. */
typedef enum cranny_status bring_fn(struct saving *saving, json_t *object, const char *where,
                                    struct cranny_error *why);

static enum cranny_status bring_list(struct saving *saving, const char *list, bring_fn *bring,
                                     struct cranny_error *why)
{
    size_t i;
    json_t *item;
    char where[64];
    json_array_foreach(json_object_get(saving->edit->root, list), i, item)
    {
        if (!is_outside_file(item))
            continue;
        struct cranny_error problem = {0};
        snprintf(where, sizeof where, "/%s/%zu/uri", list, i);
        const enum cranny_status status = bring(saving, item, where, &problem);
        if (status == CRANNY_INPUT)
            hook_warn(saving->edit->hooks, "%s; the output names it still", problem.message);
        else if (status != CRANNY_OK)
            return fail(why, status, "%s", problem.message);
    }
    return CRANNY_OK;
}

static enum cranny_status bring_files(struct saving *saving, bring_fn *bring,
                                      struct cranny_error *why)
{
    const enum cranny_status status = bring_list(saving, "buffers", bring, why);
    return status == CRANNY_OK ? bring_list(saving, "images", bring, why) : status;
}

static char *dump_tree(const json_t *root, int indent, size_t *size, struct cranny_error *why)
{
    const size_t flags =
        JSON_REAL_PRECISION(17) | (indent ? JSON_INDENT((size_t)indent) : JSON_COMPACT);
    char *text = json_dumps(root, flags);
    if (!text)
        fail_memory(why, "JSON");
    *size = text ? strlen(text) : 0;
    return text;
}

static enum cranny_status save_glb(struct saving *saving, struct cranny_error *why)
{
    const struct document *document = saving->document;
    enum cranny_status status = CRANNY_OK;
    if (document->is_glb)
        keep_chunk(saving);
    else
        status = move_first_buffer(saving, why);
    if (status == CRANNY_OK)
        status = bring_files(saving, document->is_glb ? carry_file : embed_file, why);
    if (status == CRANNY_OK)
        status = place_new_buffer(saving, true, why);
    if (status != CRANNY_OK)
        return status;
    size_t size;
    char *text = dump_tree(saving->edit->root, 0, &size, why);
    if (!text)
        return CRANNY_MEMORY;
    const uint8_t *source = document->is_glb && !document->imported ? document->file : NULL;
    status = glb_write(saving->path, text, size, saving->bin,
                       saving->has_bin ? saving->bin_count : 0, source, why);
    free(text);
    return status;
}

/* The BIN chunk has no place in a .gltf: it becomes a data URI. */
static enum cranny_status unpack_chunk(struct saving *saving, struct cranny_error *why)
{
    const struct document *document = saving->document;
    if (!document->buffer_count || !document->buffers[0].from_chunk)
        return CRANNY_OK;
    uint64_t declared;
    json_t *first = json_array_get(json_object_get(saving->edit->root, "buffers"), 0);
    keep_chunk(saving);
    json_whole(json_array_get(json_object_get(document->root, "buffers"), 0), "byteLength",
               document->chunk_size, document->chunk_size, &declared);
    if (saving->bin_count == 1 && declared < saving->bin[0].size)
        saving->bin[0].size = (size_t)declared;
    return set_data_uri(first, BUFFER_TYPE, saving->bin, saving->bin_count, why);
}

static enum cranny_status save_text(struct saving *saving, struct cranny_error *why)
{
    enum cranny_status status = unpack_chunk(saving, why);
    if (status == CRANNY_OK)
        status = place_new_buffer(saving, false, why);
    if (status == CRANNY_OK)
        status = bring_files(saving, carry_file, why);
    if (status != CRANNY_OK)
        return status;
    size_t size;
    char *text = dump_tree(saving->edit->root, saving->document->indent, &size, why);
    if (!text)
        return CRANNY_MEMORY;
    struct file_part parts[] = {{text, size}, {"\n", saving->document->indent ? 1 : 0}};
    status = file_write(saving->path, parts, 2, why);
    free(text);
    return status;
}

static bool has_extension(const char *path, const char *extension)
{
    const size_t length = strlen(path), tail = strlen(extension);
    return length > tail && strcasecmp(path + length - tail, extension) == 0;
}

enum cranny_status document_edit_save(const struct document *document, struct document_edit *edit,
                                      const char *path, struct cranny_error *why)
{
    const bool to_glb = has_extension(path, ".glb");
    if (!to_glb && !has_extension(path, ".gltf"))
        return fail(why, CRANNY_USAGE, "%s: the output must end in .glb or .gltf", path);
    struct saving saving = {
        .document = document, .edit = edit, .path = path, .folder = path_folder(path)};
    enum cranny_status status = !saving.folder ? fail_memory(why, path)
                                : to_glb       ? save_glb(&saving, why)
                                               : save_text(&saving, why);
    free(saving.folder);
    free(saving.owned);
    return status;
}
