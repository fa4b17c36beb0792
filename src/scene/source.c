/* Vertex attributes of a primitive, from accessors or out of Draco. */
#include "scene/draco.h"
#include "scene/mesh.h"

static const char draco_name[] = "KHR_draco_mesh_compression";

enum cranny_status counted_accessor(struct views *views, const struct place *place, int index,
                                    size_t count, int components, struct accessor *accessor,
                                    struct cranny_error *why)
{
    enum cranny_status status = accessor_open(views, (size_t)index, accessor, why);
    if (status != CRANNY_OK)
        return status;
    if (accessor->components != components || accessor->rows != components)
        return fail_at(views->document, place, why, CRANNY_INPUT,
                       "accessor %d must have the type %s", index,
                       components == 1   ? "SCALAR"
                       : components == 2 ? "VEC2"
                       : components == 3 ? "VEC3"
                                         : "VEC4");
    if (accessor->count != count)
        return fail_at(views->document, place, why, CRANNY_INPUT,
                       "accessor %d has %zu elements, but the primitive has %zu vertices", index,
                       accessor->count, count);
    return CRANNY_OK;
}

#if CRANNY_HAVE_DRACO
/* libdraco holds some 100 bytes a vertex and a triangle while it decodes. */
static enum cranny_status reserve_draco(struct views *views, const struct place *place,
                                        const struct view *view, struct cranny_error *why)
{
    uint64_t triangles, points;
    if (!draco_claims(view->data, view->size, &triangles, &points))
        return fail_at(views->document, place, why, CRANNY_INPUT,
                       "the compressed bytes are broken: their header cannot be read");
    return document_reserve(views->document, 100 * (triangles + points), "Draco geometry", why);
}

static enum cranny_status open_draco(struct views *views, const struct place *place,
                                     const json_t *extension, struct vertex_source *source,
                                     struct cranny_error *why)
{
    struct document *document = views->document;
    int index;
    struct view view;
    char message[256] = "";
    enum cranny_status status =
        field_index(document, place, extension, "bufferView", views->count, &index, why);
    if (status == CRANNY_OK && index < 0)
        return fail_at(document, place, why, CRANNY_INPUT, "has no bufferView");
    if (status == CRANNY_OK)
        status = views_get(views, (size_t)index, &view, why);
    if (status == CRANNY_OK)
        status = reserve_draco(views, place, &view, why);
    if (status != CRANNY_OK)
        return status;
    source->draco = draco_decode(view.data, view.size, message, sizeof message);
    if (!source->draco)
        return fail_at(document, place, why, CRANNY_INPUT, "the compressed bytes are broken: %s",
                       message);
    if (draco_points(source->draco) != source->count)
        warn_at(document, place, "holds %zu vertices, but the POSITION accessor says %zu",
                draco_points(source->draco), source->count);
    /* encoders have written such files; the compressed data is what viewers show */
    source->count = draco_points(source->draco);
    return CRANNY_OK;
}

enum cranny_status source_open(struct views *views, const json_t *primitive,
                               struct vertex_source *source, struct cranny_error *why)
{
    const struct place mesh = {NULL, "meshes", source->mesh};
    const struct place at = {&mesh, "primitives", source->primitive};
    const struct place extensions = {&at, "extensions", NO_INDEX};
    const struct place place = {&extensions, draco_name, NO_INDEX};
    const json_t *extension = extension_of(primitive, draco_name);
    json_t *ids;
    source->draco = NULL;
    source->draco_ids = NULL;
    if (!extension)
        return CRANNY_OK;
    enum cranny_status status =
        field_object(views->document, &place, extension, "attributes", &ids, why);
    if (status != CRANNY_OK)
        return status;
    if (!json_object_get(ids, "POSITION"))
        return fail_at(views->document, &place, why, CRANNY_INPUT, "has no attributes.POSITION");
    source->draco_ids = ids;
    return open_draco(views, &place, extension, source, why);
}

void source_close(struct vertex_source *source)
{
    if (source->draco)
        draco_free(source->draco);
    source->draco = NULL;
}

static float largest(enum component_type type)
{
    switch (type) {
    case COMPONENT_I8:
        return 127;
    case COMPONENT_U8:
        return 255;
    case COMPONENT_I16:
        return 32767;
    case COMPONENT_U16:
        return 65535;
    case COMPONENT_U32:
        return 4294967296.0f;
    case COMPONENT_F32:
        return 1;
    }
    return 1;
}

static bool draco_attribute(const struct vertex_source *source, const json_t *id,
                            const struct accessor *accessor, float *out)
{
    bool integers;
    if (!json_is_integer(id) || !draco_floats(source->draco, (uint32_t)json_integer_value(id),
                                              accessor->components, out, &integers))
        return false;
    const size_t values = source->count * (size_t)accessor->components;
    const float scale = 1 / largest(accessor->type);
    for (size_t i = 0; integers && accessor->normalized && i < values; i++)
        out[i] = fmaxf(out[i] * scale, -1);
    if (accessor->count <= source->count)
        accessor_apply_sparse(accessor, out);
    return true;
}
#else
enum cranny_status source_open(struct views *views, const json_t *primitive,
                               struct vertex_source *source, struct cranny_error *why)
{
    const struct place mesh = {NULL, "meshes", source->mesh};
    struct accessor position;
    const json_t *index = json_object_get(source->attributes, "POSITION");
    source->draco = NULL;
    source->draco_ids = NULL;
    if (!extension_of(primitive, draco_name))
        return CRANNY_OK;
    enum cranny_status status =
        accessor_open(views, (size_t)json_integer_value(index), &position, why);
    if (status == CRANNY_OK && !position.data && !position.sparse_count)
        return fail_at(views->document, PLACE(&mesh, "primitives", source->primitive), why,
                       CRANNY_INPUT,
                       "this build cannot decompress Draco; build Cranny with libdraco, or "
                       "decompress the file first");
    return status;
}

void source_close(struct vertex_source *source)
{
    source->draco = NULL;
}

static bool draco_attribute(const struct vertex_source *source, const json_t *id,
                            const struct accessor *accessor, float *out)
{
    (void)source, (void)id, (void)accessor, (void)out;
    return false;
}
#endif

enum cranny_status source_floats(struct views *views, const struct vertex_source *source,
                                 const char *name, int components, float *out,
                                 struct cranny_error *why)
{
    struct document *document = views->document;
    const struct place mesh = {NULL, "meshes", source->mesh};
    const struct place primitive = {&mesh, "primitives", source->primitive};
    const struct place attributes = {&primitive, "attributes", NO_INDEX};
    const struct place place = {&attributes, name, NO_INDEX};
    int index;
    struct accessor accessor;
    enum cranny_status status = field_index(document, &attributes, source->attributes, name,
                                            document_count(document, "accessors"), &index, why);
    if (status == CRANNY_OK && index < 0)
        return fail_at(document, &place, why, CRANNY_INPUT, "is missing");
    if (status != CRANNY_OK)
        return status;
    const json_t *id = source->draco ? json_object_get(source->draco_ids, name) : NULL;
    status = id ? accessor_open(views, (size_t)index, &accessor, why)
                : counted_accessor(views, &place, index, source->count, components, &accessor, why);
    if (status != CRANNY_OK)
        return status;
    if (accessor.components != components)
        return fail_at(document, &place, why, CRANNY_INPUT, "accessor %d has the wrong type",
                       index);
    if (!id)
        accessor_floats(&accessor, out);
    else if (!draco_attribute(source, id, &accessor, out))
        return fail_at(document, &place, why, CRANNY_INPUT,
                       "is not in the compressed data, though the extension says so");
    return CRANNY_OK;
}

static enum cranny_status attribute_values(struct views *views, struct vertex_source *source,
                                           const json_t *object, const char *name, int index,
                                           float **values, int *components,
                                           struct cranny_error *why)
{
    struct accessor accessor;
    enum cranny_status status = accessor_open(views, (size_t)index, &accessor, why);
    if (status != CRANNY_OK)
        return status;
    source->count = accessor.count;
    *components = accessor.components;
    status = source_open(views, object, source, why);
    const uint64_t bytes = (uint64_t)source->count * (uint64_t)accessor.components * sizeof(float);
    if (status == CRANNY_OK)
        status = document_reserve(views->document, bytes, name, why);
    if (status != CRANNY_OK)
        return status;
    *values = alloc_array((size_t)bytes, 1);
    return *values ? source_floats(views, source, name, accessor.components, *values, why)
                   : fail_memory(why, name);
}

enum cranny_status primitive_attribute(struct document *document, size_t mesh, size_t primitive,
                                       const char *name, float **values, size_t *count,
                                       int *components, struct cranny_error *why)
{
    const struct place place = {NULL, "meshes", mesh};
    struct vertex_source source = {.mesh = mesh, .primitive = primitive};
    struct views views;
    json_t *object;
    int index;
    *values = NULL;
    *count = 0;
    *components = 0;
    enum cranny_status status = document_item(document, "meshes", mesh, &object, why);
    if (status != CRANNY_OK)
        return status;
    object = json_array_get(json_object_get(object, "primitives"), primitive);
    source.attributes = json_object_get(object, "attributes");
    status = field_index(document, PLACE(&place, "primitives", primitive), source.attributes, name,
                         document_count(document, "accessors"), &index, why);
    if (status != CRANNY_OK || index < 0)
        return status;
    status = views_open(document, &views, why);
    if (status != CRANNY_OK)
        return status;
    status = attribute_values(&views, &source, object, name, index, values, components, why);
    source_close(&source);
    views_close(&views);
    if (status == CRANNY_OK)
        *count = source.count;
    else
        free(*values);
    if (status != CRANNY_OK)
        *values = NULL;
    return status;
}
