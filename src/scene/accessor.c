#include "scene/accessor.h"

#include "scene/fields.h"

size_t component_size(enum component_type type)
{
    switch (type) {
    case COMPONENT_I8:
    case COMPONENT_U8:
        return 1;
    case COMPONENT_I16:
    case COMPONENT_U16:
        return 2;
    case COMPONENT_U32:
    case COMPONENT_F32:
        return 4;
    }
    return 0;
}

/* Bytes from one column of a matrix to the next; a vector is a single column. */
static size_t column_size(const struct accessor *a)
{
    size_t size = component_size(a->type) * (size_t)a->rows;
    return a->rows == a->components ? size : (size + 3) & ~(size_t)3;
}

static size_t element_size(const struct accessor *a)
{
    return column_size(a) * (size_t)(a->components / a->rows);
}

static enum cranny_status read_shape(const struct document *document, const struct place *place,
                                     const json_t *item, struct accessor *a,
                                     struct cranny_error *why)
{
    static const struct {
        const char *name;
        int components, rows;
    } types[] = {{"SCALAR", 1, 1}, {"VEC2", 2, 2}, {"VEC3", 3, 3}, {"VEC4", 4, 4},
                 {"MAT2", 4, 2},   {"MAT3", 9, 3}, {"MAT4", 16, 4}};
    const char *type = json_string_value(json_object_get(item, "type"));
    for (size_t i = 0; type && i < COUNT_OF(types); i++) {
        if (!strcmp(type, types[i].name)) {
            a->components = types[i].components;
            a->rows = types[i].rows;
        }
    }
    if (!a->components)
        return fail_at(document, place, why, CRANNY_INPUT, "type '%s' is not one of glTF's",
                       type ? type : "");
    uint64_t component, count;
    enum cranny_status status =
        field_count(document, place, item, "componentType", 0, &component, why);
    if (status == CRANNY_OK)
        status = field_count(document, place, item, "count", 0, &count, why);
    if (status != CRANNY_OK)
        return status;
    a->type = (enum component_type)component;
    if (component > COMPONENT_F32 || !component_size(a->type))
        return fail_at(document, place, why, CRANNY_INPUT,
                       "componentType %llu is not one of glTF's", (unsigned long long)component);
    if (!json_object_get(item, "count"))
        return fail_at(document, place, why, CRANNY_INPUT, "has no count");
    if (count > UINT32_MAX)
        return fail_at(document, place, why, CRANNY_INPUT, "count %llu is too large",
                       (unsigned long long)count);
    a->count = (size_t)count;
    a->normalized = json_is_true(json_object_get(item, "normalized"));
    return CRANNY_OK;
}

/* `count` elements of `size` bytes, `stride` apart, at member byteOffset of `object`, inside the
 * buffer view that it names. `data` stays NULL when it names none. */
static enum cranny_status find_bytes(struct views *views, const struct place *place,
                                     const json_t *object, size_t count, size_t size,
                                     bool may_stride, const uint8_t **data, size_t *stride,
                                     struct cranny_error *why)
{
    struct document *document = views->document;
    int index;
    uint64_t offset;
    struct view view;
    *data = NULL;
    *stride = size;
    enum cranny_status status =
        field_index(document, place, object, "bufferView", views->count, &index, why);
    if (status == CRANNY_OK)
        status = field_count(document, place, object, "byteOffset", 0, &offset, why);
    if (status != CRANNY_OK || index < 0)
        return status;
    status = views_get(views, (size_t)index, &view, why);
    if (status != CRANNY_OK)
        return status;
    if (may_stride && view.stride)
        *stride = view.stride;
    if (*stride < size)
        return fail_at(document, place, why, CRANNY_INPUT,
                       "its elements of %zu bytes do not fit the byteStride of %zu", size, *stride);
    /* count < 2^32 and stride ≤ 2^16, so that the product cannot wrap */
    uint64_t need = count ? (uint64_t)(count - 1) * *stride + size : 0;
    if (offset > view.size || need > view.size - offset)
        return fail_at(document, place, why, CRANNY_INPUT,
                       "%zu elements need %llu bytes from byte %llu on, but bufferView %d has %zu",
                       count, (unsigned long long)need, (unsigned long long)offset, index,
                       view.size);
    *data = view.data + offset;
    return CRANNY_OK;
}

static uint32_t read_unsigned(const uint8_t *bytes, enum component_type type)
{
    if (type == COMPONENT_U8)
        return *bytes;
    uint16_t two;
    uint32_t four;
    if (type == COMPONENT_U16) {
        memcpy(&two, bytes, sizeof two);
        return two;
    }
    memcpy(&four, bytes, sizeof four);
    return four;
}

static enum cranny_status check_sparse_indices(const struct document *document,
                                               const struct place *place, const struct accessor *a,
                                               struct cranny_error *why)
{
    for (size_t i = 0; i < a->sparse_count; i++) {
        uint32_t index =
            read_unsigned(a->sparse_indices + i * component_size(a->sparse_type), a->sparse_type);
        if (index >= a->count)
            return fail_at(document, place, why, CRANNY_INPUT,
                           "index %u lies outside the accessor's %zu elements", index, a->count);
    }
    return CRANNY_OK;
}

static enum cranny_status open_sparse(struct views *views, const struct place *place,
                                      const json_t *sparse, struct accessor *a,
                                      struct cranny_error *why)
{
    struct document *document = views->document;
    json_t *indices, *values;
    uint64_t count, type = 0;
    size_t stride;
    enum cranny_status status = field_count(document, place, sparse, "count", 0, &count, why);
    if (status == CRANNY_OK)
        status = field_object(document, place, sparse, "indices", &indices, why);
    if (status == CRANNY_OK)
        status = field_object(document, place, sparse, "values", &values, why);
    if (status == CRANNY_OK && (!indices || !values))
        return fail_at(document, place, why, CRANNY_INPUT, "needs both indices and values");
    if (status == CRANNY_OK)
        status = field_count(document, place, indices, "componentType", 0, &type, why);
    if (status != CRANNY_OK)
        return status;
    if (count > a->count)
        return fail_at(document, place, why, CRANNY_INPUT, "count is larger than the accessor's");
    if (type != COMPONENT_U8 && type != COMPONENT_U16 && type != COMPONENT_U32)
        return fail_at(document, PLACE(place, "indices", NO_INDEX), why, CRANNY_INPUT,
                       "componentType must be 5121, 5123 or 5125");
    a->sparse_count = (size_t)count;
    a->sparse_type = (enum component_type)type;
    status = find_bytes(views, PLACE(place, "indices", NO_INDEX), indices, a->sparse_count,
                        component_size(a->sparse_type), false, &a->sparse_indices, &stride, why);
    if (status == CRANNY_OK)
        status = find_bytes(views, PLACE(place, "values", NO_INDEX), values, a->sparse_count,
                            element_size(a), false, &a->sparse_values, &stride, why);
    if (status == CRANNY_OK && a->sparse_count && (!a->sparse_indices || !a->sparse_values))
        return fail_at(document, place, why, CRANNY_INPUT,
                       "its indices and values must name a bufferView");
    if (status != CRANNY_OK)
        return status;
    return check_sparse_indices(document, PLACE(place, "indices", NO_INDEX), a, why);
}

enum cranny_status accessor_open(struct views *views, size_t index, struct accessor *accessor,
                                 struct cranny_error *why)
{
    struct document *document = views->document;
    const struct place place = {NULL, "accessors", index};
    json_t *item, *sparse;
    *accessor = (struct accessor){.index = index};
    enum cranny_status status = document_item(document, "accessors", index, &item, why);
    if (status == CRANNY_OK)
        status = read_shape(document, &place, item, accessor, why);
    if (status == CRANNY_OK)
        status = find_bytes(views, &place, item, accessor->count, element_size(accessor), true,
                            &accessor->data, &accessor->stride, why);
    if (status == CRANNY_OK)
        status = field_object(document, &place, item, "sparse", &sparse, why);
    if (status == CRANNY_OK && sparse)
        status = open_sparse(views, PLACE(&place, "sparse", NO_INDEX), sparse, accessor, why);
    return status;
}

/* One component; glTF 2.0, 3.6.2.2: a normalised signed value is max(c / largest, −1). */
static float read_component(const uint8_t *bytes, enum component_type type, bool normalized)
{
    int8_t i8;
    int16_t i16;
    float f32;
    switch (type) {
    case COMPONENT_I8:
        memcpy(&i8, bytes, sizeof i8);
        return normalized ? fmaxf((float)i8 / 127.0f, -1) : (float)i8;
    case COMPONENT_U8:
        return normalized ? (float)*bytes / 255.0f : (float)*bytes;
    case COMPONENT_I16:
        memcpy(&i16, bytes, sizeof i16);
        return normalized ? fmaxf((float)i16 / 32767.0f, -1) : (float)i16;
    case COMPONENT_U16:
        return (float)read_unsigned(bytes, type) / (normalized ? 65535.0f : 1.0f);
    case COMPONENT_U32:
        return normalized ? (float)((double)read_unsigned(bytes, type) / 4294967295.0)
                          : (float)read_unsigned(bytes, type);
    case COMPONENT_F32:
        memcpy(&f32, bytes, sizeof f32);
        return f32;
    }
    return 0;
}

static void read_element(const struct accessor *a, const uint8_t *bytes, float *out)
{
    const size_t size = component_size(a->type), column = column_size(a);
    for (int c = 0; c < a->components; c++)
        out[c] =
            read_component(bytes + (size_t)(c / a->rows) * column + (size_t)(c % a->rows) * size,
                           a->type, a->normalized);
}

void accessor_apply_sparse(const struct accessor *accessor, float *out)
{
    const size_t size = element_size(accessor);
    for (size_t i = 0; i < accessor->sparse_count; i++) {
        const uint8_t *at = accessor->sparse_indices + i * component_size(accessor->sparse_type);
        size_t element = read_unsigned(at, accessor->sparse_type);
        read_element(accessor, accessor->sparse_values + i * size,
                     out + element * (size_t)accessor->components);
    }
}

void accessor_floats(const struct accessor *accessor, float *out)
{
    const size_t size = element_size(accessor), width = (size_t)accessor->components;
    if (!accessor->data)
        memset(out, 0, accessor->count * width * sizeof *out);
    else if (accessor->type == COMPONENT_F32 && accessor->stride == size)
        memcpy(out, accessor->data, accessor->count * size);
    else if (accessor->type == COMPONENT_F32)
        for (size_t i = 0; i < accessor->count; i++)
            memcpy(out + i * width, accessor->data + i * accessor->stride, size);
    else
        for (size_t i = 0; i < accessor->count; i++)
            read_element(accessor, accessor->data + i * accessor->stride, out + i * width);
    accessor_apply_sparse(accessor, out);
}

void accessor_indices(const struct accessor *accessor, uint32_t *out)
{
    const size_t stride = accessor->stride, count = accessor->count;
    const enum component_type type = accessor->type;
    if (!accessor->data)
        memset(out, 0, count * sizeof *out);
    else if (type == COMPONENT_U32 && stride == sizeof *out)
        memcpy(out, accessor->data, count * sizeof *out);
    else if (type == COMPONENT_U16)
        for (size_t i = 0; i < count; i++)
            out[i] = read_unsigned(accessor->data + i * stride, COMPONENT_U16);
    else
        for (size_t i = 0; i < count; i++)
            out[i] = read_unsigned(accessor->data + i * stride, type);
    for (size_t i = 0; i < accessor->sparse_count; i++) {
        const size_t index_size = component_size(accessor->sparse_type);
        uint32_t at =
            read_unsigned(accessor->sparse_indices + i * index_size, accessor->sparse_type);
        out[at] = read_unsigned(accessor->sparse_values + i * component_size(type), type);
    }
}
