/* The node hierarchy. Nothing here recurses: a chain of a million nodes is only long. */
#include "scene/gltf.h"

bool transform_finite(const double m[12])
{
    for (int i = 0; i < 12; i++)
        if (!isfinite(m[i]) || fabs(m[i]) > 1e18)
            return false;
    return true;
}

void transform_from_trs(const double t[3], const double q[4], const double s[3], double out[12])
{
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const bool valid = length > 0 && isfinite(length);
    const double x = valid ? q[0] / length : 0, y = valid ? q[1] / length : 0;
    const double z = valid ? q[2] / length : 0, w = valid ? q[3] / length : 1;
    const double rotation[9] = {
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
        2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            out[4 * i + j] = rotation[3 * i + j] * s[j];
        out[4 * i + 3] = t[i];
    }
}

static enum cranny_status read_transform(const struct gltf *gltf, const struct place *place,
                                         struct node *node, struct cranny_error *why)
{
    const struct document *document = gltf->document;
    double matrix[16], t[3] = {0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    bool has_matrix;
    enum cranny_status status =
        field_numbers(document, place, node->object, "matrix", 16, matrix, &has_matrix, why);
    if (status == CRANNY_OK)
        status = field_numbers(document, place, node->object, "translation", 3, t, NULL, why);
    if (status == CRANNY_OK)
        status = field_numbers(document, place, node->object, "rotation", 4, q, NULL, why);
    if (status == CRANNY_OK)
        status = field_numbers(document, place, node->object, "scale", 3, s, NULL, why);
    if (status != CRANNY_OK)
        return status;
    if (has_matrix)
        for (int i = 0; i < 12; i++)
            node->local[i] = matrix[4 * (i % 4) + i / 4];
    else
        transform_from_trs(t, q, s, node->local);
    if (!transform_finite(node->local))
        return fail_at(document, place, why, CRANNY_INPUT,
                       "its transform is not finite, or beyond 1e18");
    return CRANNY_OK;
}

static enum cranny_status read_node(struct gltf *gltf, size_t index, struct cranny_error *why)
{
    struct document *document = gltf->document;
    const struct place place = {NULL, "nodes", index};
    struct node *node = &gltf->nodes[index];
    enum cranny_status status = document_item(document, "nodes", index, &node->object, why);
    if (status == CRANNY_OK)
        status =
            field_index(document, &place, node->object, "mesh", gltf->mesh_count, &node->mesh, why);
    if (status == CRANNY_OK)
        status = field_index(document, &place, node->object, "skin",
                             document_count(document, "skins"), &node->skin, why);
    if (status == CRANNY_OK)
        status = field_index(document, &place, node->object, "camera",
                             document_count(document, "cameras"), &node->camera, why);
    if (status == CRANNY_OK)
        status = read_transform(gltf, &place, node, why);
    return status;
}

static enum cranny_status adopt_children(struct gltf *gltf, size_t index, struct cranny_error *why)
{
    const struct place place = {NULL, "nodes", index};
    json_t *children;
    enum cranny_status status =
        field_array(gltf->document, &place, gltf->nodes[index].object, "children", &children, why);
    for (size_t i = 0; status == CRANNY_OK && i < json_array_size(children); i++) {
        const struct place at = {&place, "children", i};
        size_t child;
        status = value_index(gltf->document, &at, json_array_get(children, i), "node",
                             gltf->node_count, &child, why);
        if (status != CRANNY_OK)
            break;
        if (gltf->nodes[child].parent >= 0)
            return fail_at(gltf->document, &at, why, CRANNY_INPUT,
                           "node %zu already is a child of node %d; give it one parent", child,
                           gltf->nodes[child].parent);
        gltf->nodes[child].parent = (int)index;
    }
    return status;
}

size_t nodes_walk(struct gltf *gltf, size_t *queue, size_t count)
{
    for (size_t head = 0; head < count; head++) {
        struct node *node = &gltf->nodes[queue[head]];
        const json_t *children = json_object_get(node->object, "children");
        node->reached = true;
        for (size_t i = 0; i < json_array_size(children); i++) {
            const size_t child = (size_t)json_number_value(json_array_get(children, i));
            if (!gltf->nodes[child].reached)
                queue[count++] = child;
            gltf->nodes[child].reached = true;
        }
    }
    return count;
}

static enum cranny_status place_nodes(struct gltf *gltf, size_t *queue, struct cranny_error *why)
{
    size_t roots = 0;
    for (size_t i = 0; i < gltf->node_count; i++)
        if (gltf->nodes[i].parent < 0)
            queue[roots++] = i;
    size_t count = nodes_walk(gltf, queue, roots);
    for (size_t i = 0; i < count; i++) {
        struct node *node = &gltf->nodes[queue[i]];
        if (node->parent < 0)
            memcpy(node->world, node->local, sizeof node->world);
        else
            transform_multiply(gltf->nodes[node->parent].world, node->local, node->world);
        if (!transform_finite(node->world))
            return fail_at(gltf->document, PLACE(NULL, "nodes", queue[i]), why, CRANNY_INPUT,
                           "its transform in the world is not finite, or beyond 1e18");
    }
    for (size_t i = 0; i < gltf->node_count; i++)
        if (!gltf->nodes[i].reached)
            return fail_at(gltf->document, PLACE(NULL, "nodes", i), why, CRANNY_INPUT,
                           "is its own ancestor; break the cycle of children");
    return CRANNY_OK;
}

/* The roots that the chosen scene names; *count of them. */
static enum cranny_status scene_roots(struct gltf *gltf, size_t scene, size_t *queue, size_t *count,
                                      struct cranny_error *why)
{
    const struct place place = {NULL, "scenes", scene};
    json_t *object, *roots;
    *count = 0;
    enum cranny_status status = document_item(gltf->document, "scenes", scene, &object, why);
    if (status == CRANNY_OK)
        status = field_array(gltf->document, &place, object, "nodes", &roots, why);
    for (size_t i = 0; status == CRANNY_OK && i < json_array_size(roots); i++) {
        const struct place at = {&place, "nodes", i};
        size_t root;
        status = value_index(gltf->document, &at, json_array_get(roots, i), "node",
                             gltf->node_count, &root, why);
        if (status != CRANNY_OK)
            break;
        if (gltf->nodes[root].parent >= 0)
            return fail_at(gltf->document, &at, why, CRANNY_INPUT,
                           "node %zu is a child of node %d, so it cannot be a root of the scene",
                           root, gltf->nodes[root].parent);
        if (!gltf->nodes[root].reached)
            queue[(*count)++] = root;
        gltf->nodes[root].reached = true;
    }
    return status;
}

static enum cranny_status reach(struct gltf *gltf, int scene_index, size_t *queue,
                                struct cranny_error *why)
{
    struct document *document = gltf->document;
    const size_t scenes = document_count(document, "scenes");
    int chosen = scene_index;
    if (scene_index >= 0 && (size_t)scene_index >= scenes)
        return fail(why, CRANNY_USAGE, "%s: scene %d does not exist; the file has %zu",
                    document->path, scene_index, scenes);
    enum cranny_status status =
        chosen < 0 ? field_index(document, NULL, document->root, "scene", scenes, &chosen, why)
                   : CRANNY_OK;
    if (status != CRANNY_OK)
        return status;
    if (chosen < 0 && scenes)
        chosen = 0;
    if (chosen < 0)
        return CRANNY_OK; /* no scenes: every root node, which is all of them */
    for (size_t i = 0; i < gltf->node_count; i++)
        gltf->nodes[i].reached = false;
    size_t count = 0;
    status = scene_roots(gltf, (size_t)chosen, queue, &count, why);
    if (status == CRANNY_OK)
        nodes_walk(gltf, queue, count);
    return status;
}

enum cranny_status nodes_read(struct gltf *gltf, int scene_index, struct cranny_error *why)
{
    const size_t count = document_count(gltf->document, "nodes");
    enum cranny_status status = document_reserve(
        gltf->document, count * (sizeof *gltf->nodes + 2 * sizeof(size_t) + sizeof(int)), "nodes",
        why);
    if (status != CRANNY_OK)
        return status;
    gltf->nodes = alloc_array(count, sizeof *gltf->nodes);
    size_t *queue = alloc_array(count, sizeof *queue);
    if (!gltf->nodes || !queue) {
        free(queue);
        return fail_memory(why, "nodes");
    }
    gltf->node_count = count;
    for (size_t i = 0; i < count; i++)
        gltf->nodes[i].parent = gltf->nodes[i].lod_of = -1;
    for (size_t i = 0; status == CRANNY_OK && i < count; i++)
        status = read_node(gltf, i, why);
    for (size_t i = 0; status == CRANNY_OK && i < count; i++)
        status = adopt_children(gltf, i, why);
    if (status == CRANNY_OK)
        status = place_nodes(gltf, queue, why);
    if (status == CRANNY_OK)
        status = reach(gltf, scene_index, queue, why);
    if (status == CRANNY_OK)
        status = lods_read(gltf, queue, why);
    free(queue);
    return status;
}
