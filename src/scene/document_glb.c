#include "scene/document_parts.h"

bool glb_is(const uint8_t *file, size_t size)
{
    return size >= 4 && read_u32(file) == GLB_MAGIC;
}

static enum cranny_status check_header(const uint8_t *file, size_t size, const char *name,
                                       const struct cranny_hooks *hooks, struct cranny_error *why)
{
    if (size < 12)
        return fail(why, CRANNY_INPUT, "%s: the file ends within the GLB header, at byte %zu", name,
                    size);
    const uint32_t version = read_u32(file + 4), length = read_u32(file + 8);
    if (version == 1)
        return fail(why, CRANNY_INPUT,
                    "%s: a binary glTF 1.0 file, which is not supported; convert it to glTF 2.0",
                    name);
    if (version != 2)
        return fail(why, CRANNY_INPUT, "%s: GLB version %u at byte 4; only 2 is known", name,
                    version);
    if (length > size)
        return fail(why, CRANNY_INPUT,
                    "%s: truncated: its header says %u bytes, the file has %zu; fetch it again",
                    name, length, size);
    if (length < 20)
        return fail(why, CRANNY_INPUT, "%s: GLB length %u at byte 8 leaves no room for JSON", name,
                    length);
    if (length < size)
        hook_warn(hooks, "%s: %zu bytes after the end of the GLB are ignored", name, size - length);
    return CRANNY_OK;
}

enum cranny_status glb_check(const uint8_t *file, size_t size, const char *name,
                             const struct cranny_hooks *hooks, struct cranny_error *why)
{
    enum cranny_status status = check_header(file, size, name, hooks, why);
    if (status != CRANNY_OK)
        return status;
    const size_t end = read_u32(file + 8);
    bool has_bin = false;
    for (size_t at = 12; at < end;) {
        if (end - at < 8)
            return fail(why, CRANNY_INPUT, "%s: a GLB chunk header is cut off at byte %zu", name,
                        at);
        const uint32_t length = read_u32(file + at), type = read_u32(file + at + 4);
        if (length > end - at - 8)
            return fail(why, CRANNY_INPUT,
                        "%s: the GLB chunk at byte %zu says %u bytes, but %zu are left", name, at,
                        length, end - at - 8);
        if ((at == 12) != (type == GLB_JSON))
            return fail(why, CRANNY_INPUT, "%s: GLB chunk at byte %zu: %s", name, at,
                        at == 12 ? "the first chunk must be JSON" : "a second JSON chunk");
        if (type == GLB_BIN && has_bin)
            return fail(why, CRANNY_INPUT, "%s: GLB chunk at byte %zu: a second BIN chunk", name,
                        at);
        has_bin = has_bin || type == GLB_BIN;
        at += 8 + (size_t)length;
    }
    return CRANNY_OK;
}

bool glb_next(const uint8_t *file, size_t *offset, struct glb_chunk *chunk)
{
    const size_t at = *offset ? *offset : 12, end = read_u32(file + 8);
    if (at >= end)
        return false;
    *chunk = (struct glb_chunk){read_u32(file + at + 4), file + at + 8, read_u32(file + at)};
    *offset = at + 8 + chunk->size;
    return true;
}

static void write_u32(uint8_t *bytes, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(value >> (8 * i));
}

/* The container being put together: parts that point to headers, padding and the callers' data. */
struct glb_writer {
    struct file_part *parts;
    size_t part_count, part_capacity;
    uint8_t (*headers)[8]; /* allocated once for all chunks, so that parts can point into it */
    size_t header_count;
    uint64_t total;
};

static bool add_part(struct glb_writer *writer, const void *data, size_t size)
{
    if (!size)
        return true;
    if (!grow_array((void **)&writer->parts, &writer->part_capacity, writer->part_count + 1,
                    sizeof *writer->parts))
        return false;
    writer->parts[writer->part_count++] = (struct file_part){data, size};
    writer->total += size;
    return true;
}

static bool add_chunk(struct glb_writer *writer, uint32_t type, const struct file_part *parts,
                      size_t part_count)
{
    static const char spaces[3] = {' ', ' ', ' '}, zeros[3];
    uint64_t size = 0;
    for (size_t i = 0; i < part_count; i++)
        size += parts[i].size;
    const size_t padding = (size_t)(-size & 3);
    uint8_t *header = writer->headers[writer->header_count++];
    write_u32(header, (uint32_t)(size + padding));
    write_u32(header + 4, type);
    bool good = add_part(writer, header, 8);
    for (size_t i = 0; good && i < part_count; i++)
        good = add_part(writer, parts[i].data, parts[i].size);
    return good && add_part(writer, type == GLB_JSON ? spaces : zeros, padding);
}

static size_t count_chunks(const uint8_t *source)
{
    struct glb_chunk chunk;
    size_t count = 0;
    for (size_t offset = 0; source && glb_next(source, &offset, &chunk);)
        count++;
    return count;
}

static bool assemble(struct glb_writer *writer, uint8_t head[12], const struct file_part *json,
                     const struct file_part *bin, size_t bin_count, const uint8_t *source)
{
    bool good = add_part(writer, head, 12) && add_chunk(writer, GLB_JSON, json, 1) &&
                (!bin_count || add_chunk(writer, GLB_BIN, bin, bin_count));
    struct glb_chunk chunk;
    for (size_t offset = 0; good && source && glb_next(source, &offset, &chunk);) {
        struct file_part part = {chunk.data, chunk.size};
        if (chunk.type != GLB_JSON && chunk.type != GLB_BIN)
            good = add_chunk(writer, chunk.type, &part, 1);
    }
    return good;
}

enum cranny_status glb_write(const char *path, const char *json, size_t json_size,
                             const struct file_part *bin, size_t bin_count, const uint8_t *source,
                             struct cranny_error *why)
{
    struct glb_writer writer = {.headers = alloc_array(count_chunks(source) + 2, 8)};
    uint8_t head[12];
    struct file_part text = {json, json_size};
    enum cranny_status status = CRANNY_OK;
    if (!writer.headers || !assemble(&writer, head, &text, bin, bin_count, source))
        status = fail_memory(why, path);
    else if (writer.total > UINT32_MAX)
        status = fail(why, CRANNY_FAILED,
                      "%s: a .glb cannot be larger than 4 GiB (%llu bytes needed); write a .gltf",
                      path, (unsigned long long)writer.total);
    if (status == CRANNY_OK) {
        write_u32(head, GLB_MAGIC);
        write_u32(head + 4, 2);
        write_u32(head + 8, (uint32_t)writer.total);
        status = file_write(path, writer.parts, writer.part_count, why);
    }
    free(writer.headers);
    free(writer.parts);
    return status;
}
