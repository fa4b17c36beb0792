/* What instances multiply their mesh's values by, or have in their place: as attributes of
 * EXT_mesh_gpu_instancing where that makes the instances, else in the node's extras. */
#include "scene/write.h"

#include "scene/accessor.h"

static const char instancing[] = "EXT_mesh_gpu_instancing";

/* One of the numbers an instance has. */
struct written {
    const char *attribute, *extra;
    int components;
    size_t offset; /* in struct instance_factor, of four floats */
    enum factor_kind kind;
    bool raw; /* only with both distances */
};

static const struct written written[] = {
    {"_AO_LINEAR", "cranny_ao_linear", 4, offsetof(struct instance_factor, visibility),
     FACTOR_LINEAR, false},
    {"_AO_LINEAR", "cranny_ao_linear", 4, offsetof(struct instance_factor, raw_long), FACTOR_LINEAR,
     true},
    {"_AO_LINEAR_SHORT", "cranny_ao_linear_short", 4, offsetof(struct instance_factor, raw_short),
     FACTOR_LINEAR, true},
    {"_AO", "cranny_ao", 1, offsetof(struct instance_factor, visibility), FACTOR_SCALAR, false},
    {"_AO", "cranny_ao", 1, offsetof(struct instance_factor, raw_long), FACTOR_SCALAR, true},
    {"_AO_SHORT", "cranny_ao_short", 1, offsetof(struct instance_factor, raw_short), FACTOR_SCALAR,
     true},
};

static bool is_raw(const struct write *write)
{
    return write->params->to == CRANNY_OUTPUT_ATTRIBUTE && write->params->raw;
}

static const float *numbers(const struct write *write, uint32_t instance,
                            const struct written *what)
{
    return (const float *)(const void *)((const char *)&write->values->factors[instance] +
                                         what->offset);
}

static json_t *json_numbers(const float *values, int count)
{
    if (count == 1)
        return json_real((double)values[0]);
    json_t *list = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(list, json_real((double)values[i]));
    return list;
}

static enum cranny_status write_extra(struct write *write, uint32_t instance,
                                      const struct written *what, struct cranny_error *why)
{
    const int index = write->scene->instances[instance].source_node;
    json_t *node = json_array_get(json_object_get(write->edit.root, "nodes"), (size_t)index);
    json_t *extras = json_object_get(node, "extras");
    if (extras && !json_is_object(extras)) {
        hook_warn(write->params->hooks,
                  "%s: /nodes/%d/extras: is no object, so that %s has no place there",
                  write->document->path, index, what->extra);
        return CRANNY_OK;
    }
    if (!extras && json_object_set_new(node, "extras", json_object()) != 0)
        return fail_memory(why, what->extra);
    extras = json_object_get(node, "extras");
    if (json_object_set_new(extras, what->extra,
                            json_numbers(numbers(write, instance, what), what->components)) != 0)
        return fail_memory(why, what->extra);
    return CRANNY_OK;
}

/* The attributes of a node's instances, and how many there are; NULL: it makes none. */
static json_t *instancing_attributes(const struct write *write, int node, size_t *count)
{
    const json_t *object = json_array_get(json_object_get(write->edit.root, "nodes"), (size_t)node);
    json_t *attributes = json_object_get(
        json_object_get(json_object_get(object, "extensions"), instancing), "attributes");
    json_t *first = json_object_iter_value(json_object_iter(attributes));
    const json_t *accessor = json_array_get(json_object_get(write->edit.root, "accessors"),
                                            (size_t)json_integer_value(first));
    *count = (size_t)json_integer_value(json_object_get(accessor, "count"));
    return attributes;
}

/* Instances first … end−1 are of one node. */
static enum cranny_status write_instances(struct write *write, uint32_t first, uint32_t end,
                                          const struct written *what, struct cranny_error *why)
{
    size_t count, index;
    json_t *attributes =
        instancing_attributes(write, write->scene->instances[first].source_node, &count);
    const size_t components = (size_t)what->components;
    if (!attributes || count < end - first)
        return CRANNY_OK;
    float *floats = alloc_array(count, components * sizeof *floats);
    if (!floats)
        return fail_memory(why, what->attribute);
    for (size_t i = 0; i < count; i++)
        floats[i * components] = 1;
    for (uint32_t i = first; i < end; i++) {
        const size_t place = (size_t)write->scene->instances[i].source_index;
        if (place < count)
            memcpy(floats + place * components, numbers(write, i, what),
                   components * sizeof *floats);
    }
    const struct write_accessor accessor = {.data = floats,
                                            .size = count * components * sizeof *floats,
                                            .component_type = COMPONENT_F32,
                                            .count = count,
                                            .type = components == 4 ? "VEC4" : "SCALAR"};
    enum cranny_status status = write_accessor(write, &accessor, &index, why);
    free(floats);
    if (status == CRANNY_OK &&
        json_object_set_new(attributes, what->attribute, json_integer((json_int_t)index)) != 0)
        status = fail_memory(why, what->attribute);
    return status;
}

/* Numbers that an earlier bake left would be multiplied in again. */
static void remove_old(struct write *write, uint32_t instance)
{
    const int index = write->scene->instances[instance].source_node;
    json_t *extras = json_object_get(
        json_array_get(json_object_get(write->edit.root, "nodes"), (size_t)index), "extras");
    size_t count;
    json_t *attributes = instancing_attributes(write, index, &count);
    for (size_t w = 0; w < COUNT_OF(written); w++) {
        json_object_del(extras, written[w].extra);
        json_object_del(attributes, written[w].attribute);
    }
}

static enum cranny_status write_run(struct write *write, uint32_t first, uint32_t end,
                                    struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    remove_old(write, first);
    if (!write->values->factors)
        return CRANNY_OK;
    for (size_t w = 0; status == CRANNY_OK && w < COUNT_OF(written); w++) {
        const struct written *what = &written[w];
        if (write->values->factors[first].kind != what->kind || what->raw != is_raw(write))
            continue;
        if (write->scene->instances[first].source_index >= 0)
            status = write_instances(write, first, end, what, why);
        else
            status = write_extra(write, first, what, why);
    }
    return status;
}

enum cranny_status write_factors(struct write *write, struct cranny_error *why)
{
    const struct cranny_scene *scene = write->scene;
    enum cranny_status status = CRANNY_OK;
    for (uint32_t first = 0, end; status == CRANNY_OK && first < scene->instance_count;
         first = end) {
        const struct instance *instance = &scene->instances[first];
        for (end = first + 1; end < scene->instance_count && instance->source_index >= 0 &&
                              scene->instances[end].source_index >= 0 &&
                              scene->instances[end].source_node == instance->source_node;)
            end++;
        if (instance->source_node >= 0)
            status = write_run(write, first, end, why);
    }
    return status;
}
