#include "scene/write.h"

#include "scene/accessor.h"

#define TARGET_VERTICES 34962

json_t *write_list(struct write *write, const char *name)
{
    json_t *list = json_object_get(write->edit.root, name);
    if (!list && json_object_set_new(write->edit.root, name, json_array()) == 0)
        list = json_object_get(write->edit.root, name);
    return list;
}

enum cranny_status write_append(struct write *write, const char *list, json_t *object,
                                size_t *index, struct cranny_error *why)
{
    json_t *items = write_list(write, list);
    if (!items || !object) {
        json_decref(object);
        return fail_memory(why, list);
    }
    if (json_array_append_new(items, object) != 0)
        return fail_memory(why, list);
    *index = json_array_size(items) - 1;
    return CRANNY_OK;
}

enum cranny_status write_accessor(struct write *write, const struct write_accessor *what,
                                  size_t *index, struct cranny_error *why)
{
    json_t *accessor = json_object();
    bool good = accessor;
    if (what->data) {
        size_t view;
        enum cranny_status status = document_edit_append(&write->edit, what->data, what->size,
                                                         TARGET_VERTICES, what->stride, &view, why);
        if (status != CRANNY_OK) {
            json_decref(accessor);
            return status;
        }
        good = good &&
               json_object_set_new(accessor, "bufferView", json_integer((json_int_t)view)) == 0;
    }
    good = good &&
           json_object_set_new(accessor, "componentType", json_integer(what->component_type)) == 0;
    if (what->normalized)
        good = good && json_object_set_new(accessor, "normalized", json_true()) == 0;
    good = good &&
           json_object_set_new(accessor, "count", json_integer((json_int_t)what->count)) == 0 &&
           json_object_set_new(accessor, "type", json_string(what->type)) == 0;
    if (!good) {
        json_decref(accessor);
        return fail_memory(why, "accessor");
    }
    return write_append(write, "accessors", accessor, index, why);
}

/* An attribute stands either in the Draco stream or beside it. */
static void leave_draco(struct write *write, json_t *primitive, const char *name)
{
    json_t *extension =
        json_object_get(json_object_get(primitive, "extensions"), "KHR_draco_mesh_compression");
    json_t *attributes = json_object_get(extension, "attributes");
    if (!json_object_get(attributes, name))
        return;
    json_object_del(attributes, name);
    if (!write->said_draco)
        hook_warn(write->params->hooks,
                  "%s: %s is Draco-compressed; the new one is written beside the stream and the "
                  "old one is no longer read from it",
                  write->document->path, name);
    write->said_draco = true;
}

enum cranny_status write_attribute(struct write *write, json_t *primitive, const char *name,
                                   size_t accessor, struct cranny_error *why)
{
    leave_draco(write, primitive, name);
    json_t *attributes = json_object_get(primitive, "attributes");
    if (json_object_set_new(attributes, name, json_integer((json_int_t)accessor)) != 0)
        return fail_memory(why, name);
    return CRANNY_OK;
}

size_t write_count(const struct write *write, const json_t *primitive, const struct mesh_part *part)
{
    const json_t *position = json_object_get(json_object_get(primitive, "attributes"), "POSITION");
    const json_t *accessors = json_object_get(write->document->root, "accessors");
    const json_t *accessor = json_is_integer(position) && json_integer_value(position) >= 0
                                 ? json_array_get(accessors, (size_t)json_integer_value(position))
                                 : NULL;
    const json_int_t declared = json_integer_value(json_object_get(accessor, "count"));
    const size_t count = part->vertex_count;
    /* A count far above the points there are is a lie that would cost memory. */
    return declared > (json_int_t)count && (uint64_t)declared / 16 < count ? (size_t)declared
                                                                           : count;
}

/* One or two floats a vertex, made once for each run of vertices. */
static enum cranny_status scalar_accessor(struct write *write, size_t g, size_t primitive,
                                          size_t *accessor, struct cranny_error *why)
{
    const struct write_group *group = &write->groups[g];
    const struct mesh_part *part =
        &write->scene->meshes[group->mesh].parts[group->part_of[primitive] - 1];
    const bool two = write->params->raw;
    const size_t count = write_count(write, json_array_get(group->primitives, primitive), part);
    struct pair_entry *known = pair_map_at(&write->accessors, g, part->vertex_first);
    if (!known)
        return fail_memory(why, "_AO");
    *accessor = known->value;
    if (known->value != SIZE_MAX)
        return CRANNY_OK;
    float *floats = alloc_array(count, (two ? 2 : 1) * sizeof *floats);
    if (!floats)
        return fail_memory(why, "_AO");
    for (size_t i = 0; i < count; i++) {
        floats[two ? 2 * i : i] = part_value(two ? group->raw_long : group->visibility, part, i);
        if (two)
            floats[2 * i + 1] = part_value(group->raw_short, part, i);
    }
    struct write_accessor what = {.data = floats,
                                  .size = count * (two ? 8 : 4),
                                  .component_type = COMPONENT_F32,
                                  .count = count,
                                  .type = two ? "VEC2" : "SCALAR"};
    enum cranny_status status = write_accessor(write, &what, accessor, why);
    free(floats);
    known->value = *accessor;
    return status;
}

enum cranny_status write_scalar(struct write *write, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (size_t g = 0; g < write->group_count; g++) {
        const struct write_group *group = &write->groups[g];
        if (write->params->raw && (!group->raw_long || !group->raw_short))
            return fail(why, CRANNY_USAGE, "both distances are to be written, but not given");
        for (size_t p = 0; status == CRANNY_OK && p < group->primitive_count; p++) {
            size_t accessor;
            if (!group->part_of[p])
                continue;
            status = scalar_accessor(write, g, p, &accessor, why);
            if (status == CRANNY_OK)
                status = write_attribute(write, json_array_get(group->primitives, p), "_AO",
                                         accessor, why);
        }
    }
    return status;
}

/* Old colours times visibility, as 4 normalised 16-bit numbers a vertex; the fourth is unused
 * padding when `components` is 3. */
static void multiply_colors(const struct write_group *group, const struct mesh_part *part,
                            const float *old, size_t old_count, int components, size_t count,
                            uint16_t (*out)[4])
{
    for (size_t i = 0; i < count; i++) {
        const float visibility =
            (float)visibility_u16(part_value(group->visibility, part, i)) / 65535;
        const float *color = i < old_count ? old + i * (size_t)components : NULL;
        for (int c = 0; c < 3; c++)
            out[i][c] = visibility_u16(color ? fminf(color[c], 1) * visibility : visibility);
        out[i][3] = components == 3 ? 0 : visibility_u16(color ? color[3] : 1);
    }
}

static enum cranny_status color_accessor(struct write *write, size_t g, size_t primitive,
                                         size_t *accessor, struct cranny_error *why)
{
    const struct write_group *group = &write->groups[g];
    const struct mesh *mesh = &write->scene->meshes[group->mesh];
    const struct mesh_part *part = &mesh->parts[group->part_of[primitive] - 1];
    float *old = NULL;
    size_t old_count = 0;
    int components = 4;
    enum cranny_status status =
        primitive_attribute(write->document, (size_t)mesh->source_mesh, primitive, "COLOR_0", &old,
                            &old_count, &components, why);
    if (status != CRANNY_OK)
        return status;
    if (!old || components < 3 || components > 4) {
        components = 4;
        old_count = 0;
    }
    const size_t count = write_count(write, json_array_get(group->primitives, primitive), part);
    uint16_t(*colors)[4] = alloc_array(count, sizeof *colors);
    if (colors) {
        multiply_colors(group, part, old, old_count, components, count, colors);
        struct write_accessor what = {.data = colors,
                                      .size = count * sizeof *colors,
                                      .stride = components == 3 ? 8 : 0,
                                      .component_type = COMPONENT_U16,
                                      .normalized = true,
                                      .count = count,
                                      .type = components == 3 ? "VEC3" : "VEC4"};
        status = write_accessor(write, &what, accessor, why);
    } else {
        status = fail_memory(why, "COLOR_0");
    }
    free(colors);
    free(old);
    return status;
}

/* Primitives share an accessor when they share both their vertices and their old colours. */
static enum cranny_status color_primitive(struct write *write, size_t g, size_t primitive,
                                          struct cranny_error *why)
{
    const struct write_group *group = &write->groups[g];
    const struct mesh *mesh = &write->scene->meshes[group->mesh];
    const struct mesh_part *part = &mesh->parts[group->part_of[primitive] - 1];
    json_t *object = json_array_get(group->primitives, primitive);
    const json_t *old = json_object_get(json_object_get(object, "attributes"), "COLOR_0");
    const uint64_t old_index =
        json_is_integer(old) ? (uint64_t)json_integer_value(old) : UINT32_MAX;
    struct pair_entry *known =
        pair_map_at(&write->accessors, (uint64_t)g << 32 | part->vertex_first, old_index);
    if (!known)
        return fail_memory(why, "COLOR_0");
    enum cranny_status status = CRANNY_OK;
    if (known->value == SIZE_MAX) {
        size_t accessor;
        status = color_accessor(write, g, primitive, &accessor, why);
        if (status == CRANNY_OK)
            known->value = accessor;
    }
    if (status == CRANNY_OK)
        status = write_attribute(write, object, "COLOR_0", known->value, why);
    return status;
}

enum cranny_status write_color(struct write *write, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (size_t g = 0; g < write->group_count; g++)
        for (size_t p = 0; status == CRANNY_OK && p < write->groups[g].primitive_count; p++)
            if (write->groups[g].part_of[p])
                status = color_primitive(write, g, p, why);
    return status;
}

static enum cranny_status write_values(struct write *write, struct cranny_error *why)
{
    enum cranny_status status = write_plan(write, why);
    if (status == CRANNY_OK)
        status = write_factors(write, why);
    if (status != CRANNY_OK)
        return status;
    switch (write->params->to) {
    case CRANNY_OUTPUT_OCCLUSION:
        return write_occlusion(write, why);
    case CRANNY_OUTPUT_COLOR:
        return write_color(write, why);
    case CRANNY_OUTPUT_ATTRIBUTE:
        return write_scalar(write, why);
    }
    return fail(why, CRANNY_USAGE, "output %d: there is no such output", (int)write->params->to);
}

static enum cranny_status write_document(const struct cranny_scene *scene,
                                         const struct scene_values *values, const char *path,
                                         const struct cranny_save_params *params,
                                         struct cranny_error *why)
{
    struct write write = {
        .scene = scene, .values = values, .params = params, .document = scene->document};
    enum cranny_status status = document_edit_begin(scene->document, &write.edit, why);
    if (status != CRANNY_OK)
        return status;
    write.edit.hooks = params->hooks;
    if (values)
        status = write_values(&write, why);
    if (status == CRANNY_OK)
        status = document_edit_save(scene->document, &write.edit, path, why);
    for (size_t i = 0; i < write.group_count; i++)
        free(write.groups[i].part_of);
    free(write.groups);
    pair_map_free(&write.accessors);
    document_edit_free(&write.edit);
    return status;
}

enum cranny_status scene_write(const struct cranny_scene *scene, const struct scene_values *values,
                               const char *path, const struct cranny_save_params *params,
                               struct cranny_error *why)
{
    const struct cranny_save_params fallback = cranny_save_params_default();
    params = params ? params : &fallback;
    if (scene->document)
        return write_document(scene, values, path, params, why);
    struct cranny_scene stand_in;
    enum cranny_status status = export_begin(scene, &stand_in, why);
    if (status == CRANNY_OK)
        status = write_document(&stand_in, values, path, params, why);
    export_end(&stand_in);
    return status;
}
