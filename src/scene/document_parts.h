/* Pieces of the document code: the GLB container, URIs, base64, checked JSON numbers. */
#ifndef SCENE_DOCUMENT_PARTS_H
#define SCENE_DOCUMENT_PARTS_H

#include "scene/document.h"

#define GLB_MAGIC 0x46546c67u /* "glTF" */
#define GLB_JSON 0x4e4f534au
#define GLB_BIN 0x004e4942u

struct glb_chunk {
    uint32_t type;
    const uint8_t *data;
    size_t size;
};

static inline uint32_t read_u32(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
           (uint32_t)bytes[3] << 24;
}

bool glb_is(const uint8_t *file, size_t size);

/* Check the whole container: header, bounds of every chunk, JSON first, at most one BIN. */
enum cranny_status glb_check(const uint8_t *file, size_t size, const char *name,
                             const struct cranny_hooks *hooks, struct cranny_error *why);

/* Walk the chunks of a checked container; *offset starts at 0. False after the last. */
bool glb_next(const uint8_t *file, size_t *offset, struct glb_chunk *chunk);

/* Write JSON, the BIN parts (none: `bin_count` 0 and no chunk), and the chunks of `source` (a
 * checked container or NULL) that are neither. */
enum cranny_status glb_write(const char *path, const char *json, size_t json_size,
                             const struct file_part *bin, size_t bin_count, const uint8_t *source,
                             struct cranny_error *why);

/* A member that must be a whole number in [0, maximum]; absent: `fallback`. False: it is not. */
bool json_whole(const json_t *object, const char *key, uint64_t maximum, uint64_t fallback,
                uint64_t *value);

bool uri_is_data(const char *uri);
/* Decode a data URI; *data is malloced, with a 0 after the end. `where` stands in messages. */
enum cranny_status uri_decode_data(const struct document *document, const char *uri,
                                   const char *where, uint8_t **data, size_t *size,
                                   struct cranny_error *why);
/* "data:TYPE;base64,…", malloced; `parts` are one run of bytes. NULL when it does not fit. */
char *uri_encode_data(const char *type, const struct file_part *parts, size_t part_count);

/* The path of the file that a relative URI names, checked against the document's folder; malloced.
 * *relative (malloced, may be NULL) is the decoded path as written, from the document's folder. */
enum cranny_status uri_resolve(const struct document *document, const char *uri, const char *where,
                               char **path, char **relative, struct cranny_error *why);

/* Folder of a path, with its final slash; "" for none. malloced. */
char *path_folder(const char *path);
/* Whether `path`, with its links followed, lies in `folder` ("" is the current one). */
bool path_within(const char *path, const char *folder);

/* Bytes of a buffer without keeping them in the document: *owned is malloced or NULL. */
enum cranny_status document_fetch_buffer(const struct document *document, size_t index,
                                         const uint8_t **data, size_t *size, uint8_t **owned,
                                         struct cranny_error *why);
/* Bytes that a URI names: a data URI, or a file beside the document. */
enum cranny_status document_fetch_uri(const struct document *document, const char *uri,
                                      const char *where, uint8_t **data, size_t *size,
                                      struct cranny_error *why);

/* `asset`, `extensionsRequired`, and that every root list is a list of objects. */
enum cranny_status document_check(const struct document *document, struct cranny_error *why);

#endif
