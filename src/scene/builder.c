#include "scene/builder.h"

void builder_begin(struct builder *builder)
{
    *builder = (struct builder){0};
    builder->root = json_pack("{s:{s:s, s:s}}", "asset", "version", "2.0", "generator",
                              "cranny " CRANNY_VERSION_TEXT);
    builder->failed = !builder->root;
}

void builder_free(struct builder *builder)
{
    json_decref(builder->root);
    free(builder->bytes);
    *builder = (struct builder){0};
}

size_t builder_append(struct builder *builder, const char *list, json_t *object)
{
    json_t *items = json_object_get(builder->root, list);
    if (!items && json_object_set_new(builder->root, list, json_array()) == 0)
        items = json_object_get(builder->root, list);
    if (!object || !items) {
        json_decref(object);
        builder->failed = true;
        return 0;
    }
    builder->failed = json_array_append_new(items, object) != 0 || builder->failed;
    return json_array_size(items) ? json_array_size(items) - 1 : 0;
}

void builder_set(struct builder *builder, json_t *object, const char *key, json_t *value)
{
    builder->failed = json_object_set_new(object, key, value) != 0 || builder->failed;
}

void builder_name(struct builder *builder, json_t *object, const char *name)
{
    json_t *text = name && *name ? json_string(name) : NULL;
    if (text)
        builder_set(builder, object, "name", text);
}

static size_t append_view(struct builder *builder, const void *data, size_t size, int target)
{
    const size_t start = (builder->size + 15) & ~(size_t)15;
    if (builder->failed || size > SIZE_MAX / 4 - start ||
        !grow_array((void **)&builder->bytes, &builder->capacity, start + size, 1)) {
        builder->failed = true;
        return 0;
    }
    memset(builder->bytes + builder->size, 0, start - builder->size);
    if (size)
        memcpy(builder->bytes + start, data, size);
    builder->size = start + size;
    json_t *view = json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", (json_int_t)start,
                             "byteLength", (json_int_t)size);
    if (target)
        builder_set(builder, view, "target", json_integer(target));
    return builder_append(builder, "bufferViews", view);
}

static json_t *bounds_of(const float *values, size_t count, int components, bool upper)
{
    json_t *list = json_array();
    for (int c = 0; list && c < components; c++) {
        float bound = values[c];
        for (size_t i = 1; i < count; i++) {
            const float value = values[i * (size_t)components + (size_t)c];
            bound = upper ? fmaxf(bound, value) : fminf(bound, value);
        }
        json_array_append_new(list, json_real(isfinite(bound) ? (double)bound : 0));
    }
    return list;
}

size_t builder_floats(struct builder *builder, const float *values, size_t count, int components,
                      bool bounds)
{
    static const char *const types[] = {"SCALAR", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const size_t view =
        append_view(builder, values, count * (size_t)components * sizeof *values, 34962);
    json_t *accessor =
        json_pack("{s:I, s:i, s:I, s:s}", "bufferView", (json_int_t)view, "componentType", 5126,
                  "count", (json_int_t)count, "type", types[components]);
    if (bounds) {
        builder_set(builder, accessor, "min", bounds_of(values, count, components, false));
        builder_set(builder, accessor, "max", bounds_of(values, count, components, true));
    }
    return builder_append(builder, "accessors", accessor);
}

size_t builder_indices(struct builder *builder, const uint32_t *values, size_t count)
{
    const size_t view = append_view(builder, values, count * sizeof *values, 34963);
    return builder_append(builder, "accessors",
                          json_pack("{s:I, s:i, s:I, s:s}", "bufferView", (json_int_t)view,
                                    "componentType", 5125, "count", (json_int_t)count, "type",
                                    "SCALAR"));
}

static int wrap_code(enum cranny_wrap wrap)
{
    switch (wrap) {
    case CRANNY_WRAP_REPEAT:
        return 10497;
    case CRANNY_WRAP_CLAMP:
        return 33071;
    case CRANNY_WRAP_MIRROR:
        return 33648;
    }
    return 10497;
}

size_t builder_texture(struct builder *builder, const void *data, size_t size, const char *type,
                       enum cranny_wrap wrap_u, enum cranny_wrap wrap_v)
{
    const size_t view = append_view(builder, data, size, 0);
    const size_t image =
        builder_append(builder, "images",
                       json_pack("{s:s, s:I}", "mimeType", type, "bufferView", (json_int_t)view));
    const size_t sampler = builder_append(
        builder, "samplers",
        json_pack("{s:i, s:i}", "wrapS", wrap_code(wrap_u), "wrapT", wrap_code(wrap_v)));
    return builder_append(
        builder, "textures",
        json_pack("{s:I, s:I}", "sampler", (json_int_t)sampler, "source", (json_int_t)image));
}

void builder_use(struct builder *builder, const char *name)
{
    json_t *used = json_object_get(builder->root, "extensionsUsed");
    for (size_t i = 0; i < json_array_size(used); i++)
        if (strcmp(json_string_value(json_array_get(used, i)), name) == 0)
            return;
    builder_append(builder, "extensionsUsed", json_string(name));
}

/* KHR_texture_transform is offset, rotation, scale: u' = T R S u. A shear has no place in it. */
static void set_transform(struct builder *builder, json_t *reference, const float t[6])
{
    const struct cranny_material plain = cranny_material_default();
    if (memcmp(t, plain.uv_transform, sizeof plain.uv_transform) == 0)
        return;
    const double turn = atan2(-t[3], t[0]), scale_u = hypot(t[0], t[3]);
    const double scale_v = t[1] * sin(turn) + t[4] * cos(turn);
    builder_use(builder, "KHR_texture_transform");
    builder_set(builder, reference, "extensions",
                json_pack("{s:{s:[f,f], s:f, s:[f,f]}}", "KHR_texture_transform", "offset",
                          (double)t[2], (double)t[5], "rotation", turn, "scale", scale_u, scale_v));
}

size_t builder_material(struct builder *builder, const struct cranny_material *material,
                        size_t texture, int texcoord)
{
    const float *color = material->base_color;
    json_t *look =
        json_pack("{s:[f,f,f,f], s:f}", "baseColorFactor", (double)color[0], (double)color[1],
                  (double)color[2], (double)material->opacity, "metallicFactor", 0.0);
    json_t *object = json_object();
    builder_name(builder, object, material->name);
    if (texture != SIZE_MAX) {
        json_t *reference = json_pack("{s:I}", "index", (json_int_t)texture);
        if (texcoord)
            builder_set(builder, reference, "texCoord", json_integer(texcoord));
        set_transform(builder, reference, material->uv_transform);
        builder_set(builder, look, "baseColorTexture", reference);
    }
    builder_set(builder, object, "pbrMetallicRoughness", look);
    if (material->alpha_mode != CRANNY_ALPHA_OPAQUE)
        builder_set(builder, object, "alphaMode",
                    json_string(material->alpha_mode == CRANNY_ALPHA_MASK ? "MASK" : "BLEND"));
    if (material->alpha_mode == CRANNY_ALPHA_MASK)
        builder_set(builder, object, "alphaCutoff", json_real((double)material->alpha_cutoff));
    if (material->double_sided)
        builder_set(builder, object, "doubleSided", json_true());
    return builder_append(builder, "materials", object);
}

json_t *builder_node(struct builder *builder, const char *name, const double matrix[12])
{
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    json_t *node = json_object();
    builder_name(builder, node, name);
    if (memcmp(matrix, identity, sizeof identity) == 0)
        return node;
    json_t *columns = json_array();
    for (int c = 0; c < 4; c++)
        for (int r = 0; r < 4; r++)
            json_array_append_new(columns, json_real(r < 3 ? matrix[4 * r + c] : c == 3));
    builder_set(builder, node, "matrix", columns);
    return node;
}

enum cranny_status builder_finish(struct builder *builder, const char *name, uint64_t memory_limit,
                                  struct document **document, struct cranny_error *why)
{
    *document = NULL;
    if (builder->size)
        builder_append(builder, "buffers",
                       json_pack("{s:I}", "byteLength", (json_int_t)builder->size));
    struct document *d = alloc_array(1, sizeof *d);
    if (d) {
        *d = (struct document){.path = copy_text(name),
                               .buffers = alloc_array(1, sizeof *d->buffers)};
        builder->failed = builder->failed || !d->path || !d->buffers;
    }
    if (!d || builder->failed) {
        document_destroy(&d);
        builder_free(builder);
        return fail_memory(why, name);
    }
    d->root = builder->root;
    d->is_glb = d->imported = d->in_memory = true;
    d->memory_limit = memory_limit;
    d->memory_used = builder->size;
    if (builder->size) {
        d->file = builder->bytes;
        d->file_size = d->chunk_size = builder->size;
        d->chunk = d->file;
        d->buffer_count = 1;
        d->buffers[0].from_chunk = true;
    } else {
        free(builder->bytes);
    }
    *builder = (struct builder){0};
    *document = d;
    return CRANNY_OK;
}
