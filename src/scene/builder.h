/* Putting a new glTF document together in memory: for scenes made of arrays and for imports. */
#ifndef SCENE_BUILDER_H
#define SCENE_BUILDER_H

#include "scene/document.h"
#include "scene/scene.h"

/* After a failed call `failed` is set and later calls do nothing; builder_finish reports it. */
struct builder {
    json_t *root;
    uint8_t *bytes;
    size_t size, capacity;
    bool failed; /* out of memory */
};

void builder_begin(struct builder *builder);
void builder_free(struct builder *builder);

/* Append an object (taken over; NULL fails) to a root list; its index. */
size_t builder_append(struct builder *builder, const char *list, json_t *object);
/* Set a member to a value (taken over; NULL fails). */
void builder_set(struct builder *builder, json_t *object, const char *key, json_t *value);
void builder_name(struct builder *builder, json_t *object, const char *name);

/* Name an extension in extensionsUsed, once. */
void builder_use(struct builder *builder, const char *name);

/* `count` vectors of floats (with their bounds where `bounds`), or triangle indices. */
size_t builder_floats(struct builder *builder, const float *values, size_t count, int components,
                      bool bounds);
size_t builder_indices(struct builder *builder, const uint32_t *values, size_t count);

/* An image with its sampler as a texture; `data` is a whole PNG or JPEG file. */
size_t builder_texture(struct builder *builder, const void *data, size_t size, const char *type,
                       enum cranny_wrap wrap_u, enum cranny_wrap wrap_v);

/* A metal-free material. `texture` SIZE_MAX: none. The transform is left out when it is identity.
 */
size_t builder_material(struct builder *builder, const struct cranny_material *material,
                        size_t texture, int texcoord);

/* A node object with a name and a matrix (3 rows of 4; left out when it is the identity). */
json_t *builder_node(struct builder *builder, const char *name, const double matrix[12]);

/* Hand the document over; the builder is empty afterwards, also on failure. */
enum cranny_status builder_finish(struct builder *builder, const char *name, uint64_t memory_limit,
                                  struct document **document, struct cranny_error *why);

#endif
