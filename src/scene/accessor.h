/* glTF accessors as plain arrays: every component type, strided, normalised, sparse. */
#ifndef SCENE_ACCESSOR_H
#define SCENE_ACCESSOR_H

#include "scene/views.h"

enum component_type {
    COMPONENT_I8 = 5120,
    COMPONENT_U8 = 5121,
    COMPONENT_I16 = 5122,
    COMPONENT_U16 = 5123,
    COMPONENT_U32 = 5125,
    COMPONENT_F32 = 5126,
};

/* An accessor whose bytes have been found and bounds-checked. */
struct accessor {
    size_t index; /* in the document */
    size_t count;
    int components; /* per element: 1 (SCALAR) to 16 (MAT4) */
    int rows; /* of a matrix' columns, which begin on multiples of 4 bytes; else `components` */
    enum component_type type;
    bool normalized;
    const uint8_t *data; /* NULL: zeros */
    size_t stride;
    size_t sparse_count;
    const uint8_t *sparse_indices; /* sparse_count, of sparse_type, closely packed, each < count */
    const uint8_t *sparse_values;
    enum component_type sparse_type;
};

size_t component_size(enum component_type type);

/* Find accessor `index`. Nothing is decoded. CRANNY_INPUT when it is broken or reaches outside its
 * buffer view. */
enum cranny_status accessor_open(struct views *views, size_t index, struct accessor *accessor,
                                 struct cranny_error *why);

/* count × components floats; integers divided by their largest value when normalised. */
void accessor_floats(const struct accessor *accessor, float *out);
/* Overwrite the elements that the accessor's sparse part names. */
void accessor_apply_sparse(const struct accessor *accessor, float *out);
/* count values of a SCALAR accessor of unsigned integers. */
void accessor_indices(const struct accessor *accessor, uint32_t *out);

/* The values of attribute `name` of a primitive, Draco-compressed or not, as floats. *values is
 * malloced, NULL when the primitive has no such attribute. The vertex order is that of the
 * primitive's mesh_part. */
enum cranny_status primitive_attribute(struct document *document, size_t mesh, size_t primitive,
                                       const char *name, float **values, size_t *count,
                                       int *components, struct cranny_error *why);

#endif
