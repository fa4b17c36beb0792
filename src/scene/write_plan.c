#include "scene/write.h"

#include <inttypes.h>

#include "base/sequence.h"

static size_t find_slot(const struct pair_map *map, uint64_t a, uint64_t b)
{
    uint32_t hash = hash_combine((uint32_t)a, (uint32_t)(a >> 32));
    hash = hash_combine(hash, hash_combine((uint32_t)b, (uint32_t)(b >> 32)));
    size_t slot = hash & (map->capacity - 1);
    while (map->entries[slot].used && (map->entries[slot].a != a || map->entries[slot].b != b))
        slot = (slot + 1) & (map->capacity - 1);
    return slot;
}

static bool grow_map(struct pair_map *map)
{
    struct pair_map bigger = {.capacity = map->capacity ? 2 * map->capacity : 64,
                              .count = map->count};
    bigger.entries = alloc_array(bigger.capacity, sizeof *bigger.entries);
    if (!bigger.entries)
        return false;
    for (size_t i = 0; i < map->capacity; i++)
        if (map->entries[i].used)
            bigger.entries[find_slot(&bigger, map->entries[i].a, map->entries[i].b)] =
                map->entries[i];
    free(map->entries);
    *map = bigger;
    return true;
}

struct pair_entry *pair_map_at(struct pair_map *map, uint64_t a, uint64_t b)
{
    if (2 * (map->count + 1) > map->capacity && !grow_map(map))
        return NULL;
    struct pair_entry *entry = &map->entries[find_slot(map, a, b)];
    if (!entry->used) {
        *entry = (struct pair_entry){a, b, SIZE_MAX, true};
        map->count++;
    }
    return entry;
}

void pair_map_free(struct pair_map *map)
{
    free(map->entries);
    *map = (struct pair_map){0};
}

/* The group of an instance, made when it is the first with its mesh and values. */
static enum cranny_status find_group(struct write *write, struct pair_map *known, uint32_t instance,
                                     size_t *group, struct cranny_error *why)
{
    const struct scene_values *values = write->values;
    const uint32_t mesh = write->scene->instances[instance].view.mesh;
    struct write_group fresh = {.mesh = mesh,
                                .visibility = values->visibility[instance],
                                .raw_long = values->raw_long ? values->raw_long[instance] : NULL,
                                .raw_short =
                                    values->raw_short ? values->raw_short[instance] : NULL};
    struct pair_entry *entry = pair_map_at(known, mesh, (uintptr_t)fresh.visibility);
    if (!entry || !grow_array((void **)&write->groups, &write->group_capacity,
                              write->group_count + 1, sizeof *write->groups))
        return fail_memory(why, "instances");
    if (entry->value == SIZE_MAX) {
        entry->value = write->group_count;
        write->groups[write->group_count++] = fresh;
    }
    *group = entry->value;
    return CRANNY_OK;
}

/* Which group each node shows; -1: none. */
static enum cranny_status group_nodes(struct write *write, int *node_group, size_t node_count,
                                      struct cranny_error *why)
{
    const struct cranny_scene *scene = write->scene;
    struct pair_map known = {0};
    enum cranny_status status = CRANNY_OK;
    for (uint32_t i = 0; status == CRANNY_OK && i < scene->instance_count; i++) {
        const struct instance *instance = &scene->instances[i];
        const int node = instance->source_node;
        size_t group = 0;
        if (node < 0 || (size_t)node >= node_count || !write->values->visibility[i] ||
            scene->meshes[instance->view.mesh].source_mesh < 0)
            continue;
        status = find_group(write, &known, i, &group, why);
        if (status == CRANNY_OK && node_group[node] >= 0 && node_group[node] != (int)group)
            status = fail(why, CRANNY_USAGE,
                          "%s: /nodes/%d: its instances (EXT_mesh_gpu_instancing) must share one "
                          "set of values",
                          write->document->path, node);
        if (status == CRANNY_OK)
            node_group[node] = (int)group;
    }
    pair_map_free(&known);
    return status;
}

static int node_mesh(const json_t *node)
{
    const json_t *mesh = json_object_get(node, "mesh");
    return json_is_integer(mesh) && json_integer_value(mesh) >= 0 &&
                   json_integer_value(mesh) < INT32_MAX
               ? (int)json_integer_value(mesh)
               : -1;
}

/* Give every group a glTF mesh: the first one that shows it takes the original, unless a node
 * without values shows that too; the others get copies. */
static enum cranny_status assign_meshes(struct write *write, const int *node_group,
                                        struct cranny_error *why)
{
    json_t *meshes = json_object_get(write->edit.root, "meshes"), *node;
    const json_t *nodes = json_object_get(write->edit.root, "nodes");
    const size_t mesh_count = json_array_size(meshes);
    bool *taken = alloc_array(mesh_count, sizeof *taken);
    enum cranny_status status = taken ? CRANNY_OK : fail_memory(why, "meshes");
    size_t i;
    json_array_foreach(nodes, i, node)
    {
        const int mesh = node_mesh(node);
        if (taken && node_group[i] < 0 && mesh >= 0 && (size_t)mesh < mesh_count)
            taken[mesh] = true;
    }
    for (i = 0; status == CRANNY_OK && i < write->group_count; i++) {
        struct write_group *group = &write->groups[i];
        const int source = write->scene->meshes[group->mesh].source_mesh;
        if ((size_t)source >= mesh_count) {
            status =
                fail(why, CRANNY_INPUT, "%s: there is no mesh %d", write->document->path, source);
        } else if (taken[source]) {
            status = write_append(write, "meshes",
                                  json_deep_copy(json_array_get(meshes, (size_t)source)),
                                  &group->gltf_mesh, why);
        } else {
            taken[source] = true;
            group->gltf_mesh = (size_t)source;
        }
    }
    free(taken);
    return status;
}

static enum cranny_status point_nodes(struct write *write, const int *node_group,
                                      struct cranny_error *why)
{
    const json_t *nodes = json_object_get(write->edit.root, "nodes");
    size_t i;
    json_t *node;
    json_array_foreach(nodes, i, node)
    {
        if (node_group[i] < 0)
            continue;
        const size_t mesh = write->groups[node_group[i]].gltf_mesh;
        if (node_mesh(node) != (int)mesh &&
            json_object_set_new(node, "mesh", json_integer((json_int_t)mesh)) != 0)
            return fail_memory(why, "nodes");
    }
    return CRANNY_OK;
}

/* All attributes of a primitive have the count of its POSITION accessor; a Draco stream that holds
 * another number of vertices leaves no valid place for values of its own. */
static bool part_fits(const struct write *write, const json_t *primitive,
                      const struct mesh_part *part)
{
    const json_t *position = json_object_get(json_object_get(primitive, "attributes"), "POSITION");
    const json_t *accessor = json_array_get(json_object_get(write->edit.root, "accessors"),
                                            (size_t)json_integer_value(position));
    const json_int_t count = json_integer_value(json_object_get(accessor, "count"));
    if (count == part->vertex_count)
        return true;
    hook_warn(write->params->hooks,
              "%s: a Draco-compressed primitive gets no values: it holds %" PRIu32
              " vertices, but its POSITION accessor says %" JSON_INTEGER_FORMAT
              "; compress the file again",
              write->document->path, part->vertex_count, count);
    return false;
}

static enum cranny_status map_parts(struct write *write, struct write_group *group,
                                    struct cranny_error *why)
{
    const struct mesh *mesh = &write->scene->meshes[group->mesh];
    json_t *gltf_mesh =
        json_array_get(json_object_get(write->edit.root, "meshes"), group->gltf_mesh);
    group->primitives = json_object_get(gltf_mesh, "primitives");
    group->primitive_count = json_array_size(group->primitives);
    group->part_of = alloc_array(group->primitive_count, sizeof *group->part_of);
    if (!group->part_of)
        return fail_memory(why, "primitives");
    for (uint32_t p = 0; p < mesh->part_count; p++) {
        const struct mesh_part *part = &mesh->parts[p];
        const json_t *primitive = json_array_get(group->primitives, part->primitive);
        if (primitive && part_fits(write, primitive, part))
            group->part_of[part->primitive] = p + 1;
    }
    return CRANNY_OK;
}

enum cranny_status write_plan(struct write *write, struct cranny_error *why)
{
    const size_t node_count = json_array_size(json_object_get(write->edit.root, "nodes"));
    int *node_group = alloc_array(node_count, sizeof *node_group);
    if (!node_group)
        return fail_memory(why, "nodes");
    for (size_t i = 0; i < node_count; i++)
        node_group[i] = -1;
    enum cranny_status status = group_nodes(write, node_group, node_count, why);
    if (status == CRANNY_OK)
        status = assign_meshes(write, node_group, why);
    if (status == CRANNY_OK)
        status = point_nodes(write, node_group, why);
    for (size_t i = 0; status == CRANNY_OK && i < write->group_count; i++)
        status = map_parts(write, &write->groups[i], why);
    free(node_group);
    return status;
}
