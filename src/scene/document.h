/* A glTF document as it was read: JSON tree, buffers, and the way back to a file.
 *
 * The tree is never changed after loading; writing edits a copy. Everything that was in the input
 * is in the output: every JSON member in order with an equal value, every buffer byte for byte. */
#ifndef SCENE_DOCUMENT_H
#define SCENE_DOCUMENT_H

#include "base/base.h"

#include <jansson.h>

/* A buffer of the document. Loaded lazily: call document_buffer. */
struct document_buffer {
    uint8_t *data;   /* NULL until loaded */
    size_t size;     /* bytes there are, at least the declared byteLength once loaded */
    bool from_chunk; /* the GLB's BIN chunk; `data` then points into the document's file */
    bool failed;
};

struct document {
    json_t *root;
    char *path; /* for messages and for resolving URIs; a plain name for memory documents */
    bool is_glb;
    bool in_memory; /* never read outside files */
    bool allow_outside;
    bool imported; /* made from another format: is written as a new .glb */
    int indent;    /* of the input's JSON text, 0: compact; .gltf output keeps it */
    uint8_t *file; /* the whole input file (GLB); owned */
    size_t file_size;
    const uint8_t *chunk; /* BIN chunk within `file`, NULL when there is none */
    size_t chunk_size;
    struct document_buffer *buffers; /* buffer_count */
    size_t buffer_count;
    uint64_t memory_limit, memory_used; /* bytes; checked before every large allocation */
    const struct cranny_hooks *hooks;   /* valid during loading only */
};

/* Parse a .glb or .gltf (told apart by content). Checks the container, the JSON, `asset.version`
 * (2.x only; 1.0 is refused by name) and `extensionsRequired` against what is supported. */
enum cranny_status document_load(const char *path, bool allow_outside, uint64_t memory_limit,
                                 const struct cranny_hooks *hooks, struct document **document,
                                 struct cranny_error *why);
enum cranny_status document_parse(uint8_t *file /* malloced; taken over, also on failure */,
                                  size_t size, const char *name, bool in_memory, bool allow_outside,
                                  uint64_t memory_limit, const struct cranny_hooks *hooks,
                                  struct document **document, struct cranny_error *why);
void document_destroy(struct document **document);

/* The bytes of buffer `index`, loading its URI (relative file or data URI) on first use. At least
 * `byteLength` bytes or CRANNY_INPUT. Refuses URIs that are absolute, carry a scheme other than
 * data:, or leave the document's folder (symlinks included) unless allow_outside. */
enum cranny_status document_buffer(struct document *document, size_t index, const uint8_t **data,
                                   size_t *size, struct cranny_error *why);

/* The bytes of image `index` (bufferView or URI); *owned is malloced and must be freed, or NULL
 * when *data points into a buffer. */
enum cranny_status document_image(struct document *document, size_t index, const uint8_t **data,
                                  size_t *size, uint8_t **owned, struct cranny_error *why);

/* Count `bytes` against the memory limit; CRANNY_MEMORY naming `what` when it is exceeded. */
enum cranny_status document_reserve(struct document *document, uint64_t bytes, const char *what,
                                    struct cranny_error *why);

/* Serialise `root` (an edited copy) with `appended` bytes to `path` (.glb or .gltf by extension).
 * For .glb the bytes go to the end of the BIN chunk, for .gltf into a data URI; the caller has
 * already written the buffer they belong to (document_appended_buffer). */
struct document_edit {
    json_t *root;   /* deep copy of document->root, owned */
    size_t buffer;  /* index of the buffer that receives appended bytes */
    uint64_t base;  /* byte offset in that buffer where appended bytes begin, multiple of 16 */
    uint8_t *bytes; /* appended so far */
    size_t size, capacity;
    size_t views; /* bufferViews of the document itself; later ones are appended */
    const struct cranny_hooks *hooks; /* for warnings while saving; may be NULL */
};
enum cranny_status document_edit_begin(const struct document *document, struct document_edit *edit,
                                       struct cranny_error *why);
/* Append bytes and a bufferView for them (`target` 34962, or 0 for none; `stride` 0: none);
 * returns the bufferView's index in *view. */
enum cranny_status document_edit_append(struct document_edit *edit, const void *data, size_t size,
                                        int target, int stride, size_t *view,
                                        struct cranny_error *why);
enum cranny_status document_edit_save(const struct document *document, struct document_edit *edit,
                                      const char *path, struct cranny_error *why);
void document_edit_free(struct document_edit *edit);

/* Read any other format through assimp and turn it into a glTF document in memory (imported), which
 * the one reader then decodes. Images that masked materials need are embedded. */
enum cranny_status document_import(const char *path, bool allow_outside, uint64_t memory_limit,
                                   const struct cranny_hooks *hooks, struct document **document,
                                   struct cranny_error *why);

/* Decode a document's geometry, materials, cameras and nodes into `scene`. (gltf.c) */
struct cranny_scene;
struct cranny_scene_load_params;
enum cranny_status gltf_read(struct document *document,
                             const struct cranny_scene_load_params *params,
                             struct cranny_scene *scene, struct cranny_error *why);

#endif
