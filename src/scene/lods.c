/* Levels of detail: MSFT_lod, what hangs beside the scene graph, and who belongs to which group. */
#include "scene/gltf.h"

static const char lod_extension[] = "MSFT_lod";

enum visit { VISIT_NEW, VISIT_OPEN, VISIT_DONE };

struct lods {
    struct gltf *gltf;
    size_t *queue, count; /* reached nodes */
    size_t complaints;
    struct cranny_error *why;
};

/* A broken file has thousands of these; the first few are said. */
static bool complains(struct lods *lods)
{
    return lods->complaints++ < COMPLAINT_LIMIT;
}

static bool level_index(const struct lods *lods, const json_t *value, size_t *index)
{
    const double number = json_is_number(value) ? json_number_value(value) : -1;
    if (!(number >= 0 && number < (double)lods->gltf->node_count) || number != floor(number))
        return false;
    *index = (size_t)number;
    return true;
}

/* What the scene does not reach stands where its finest stands. */
static enum cranny_status hang(struct lods *lods, size_t finest, size_t index)
{
    struct gltf *gltf = lods->gltf;
    const size_t first = lods->count;
    lods->queue[first] = index;
    lods->count += nodes_walk(gltf, lods->queue + first, 1);
    gltf->nodes[index].base = gltf->nodes[finest].base;
    gltf->nodes[index].hung = true;
    for (size_t i = first; i < lods->count; i++) {
        struct node *node = &gltf->nodes[lods->queue[i]];
        if (node->base >= 0)
            transform_multiply(gltf->nodes[node->base].world, node->local, node->world);
        else
            memcpy(node->world, node->local, sizeof node->world);
        if (!transform_finite(node->world))
            return fail_at(gltf->document, PLACE(NULL, "nodes", lods->queue[i]), lods->why,
                           CRANNY_INPUT,
                           "its transform in the world is not finite, or beyond 1e18");
    }
    return CRANNY_OK;
}

static enum cranny_status add_level(struct lods *lods, size_t finest, const struct place *ids,
                                    size_t k, const json_t *value)
{
    struct gltf *gltf = lods->gltf;
    const struct place at = {ids->up, ids->name, k};
    size_t index;
    if (!level_index(lods, value, &index)) {
        if (complains(lods))
            warn_at(gltf->document, &at,
                    "is passed over: it must be the index of a node; there are %zu",
                    gltf->node_count);
        return CRANNY_OK;
    }
    struct node *node = &gltf->nodes[index];
    if (index == finest || node->lod_of >= 0) {
        if (complains(lods))
            warn_at(gltf->document, &at, "is passed over: node %zu already is a level of node %d",
                    index, index == finest ? (int)finest : node->lod_of);
        return CRANNY_OK;
    }
    node->lod_of = (int)finest;
    node->level = (uint32_t)k + 1;
    gltf->nodes[finest].finest = true;
    node->stated = gltf->nodes[finest].stated = true;
    return node->reached ? CRANNY_OK : hang(lods, finest, index);
}

static enum cranny_status read_levels(struct lods *lods, size_t index)
{
    const struct document *document = lods->gltf->document;
    const json_t *extension = extension_of(lods->gltf->nodes[index].object, lod_extension);
    const struct place node = {NULL, "nodes", index};
    const struct place extensions = {&node, "extensions", NO_INDEX};
    const struct place at = {&extensions, lod_extension, NO_INDEX};
    const struct place ids = {&at, "ids", NO_INDEX};
    const json_t *list = json_object_get(extension, "ids");
    enum cranny_status status = CRANNY_OK;
    if (extension && !json_is_array(list) && complains(lods))
        warn_at(document, &at, "is passed over: it has no list of ids");
    for (size_t k = 0; status == CRANNY_OK && k < json_array_size(list); k++)
        status = add_level(lods, index, &ids, k, json_array_get(list, k));
    return status;
}

/* Resolve one node after all above it; false when it is above itself. `stack` has room for all
 * nodes. */
static bool climb(struct gltf *gltf, size_t start, size_t *stack,
                  void (*settle)(struct gltf *gltf, size_t index))
{
    size_t depth = 0;
    for (int at = (int)start; at >= 0 && gltf->nodes[at].visit != VISIT_DONE;
         at = node_up(&gltf->nodes[at])) {
        if (gltf->nodes[at].visit == VISIT_OPEN)
            return false;
        gltf->nodes[at].visit = VISIT_OPEN;
        stack[depth++] = (size_t)at;
    }
    while (depth > 0) {
        const size_t index = stack[--depth];
        if (settle)
            settle(gltf, index);
        gltf->nodes[index].visit = VISIT_DONE;
    }
    return true;
}

/* Levels that hang outside the graph cannot be above their finest; those inside can. */
static void break_circles(struct lods *lods, size_t *stack)
{
    struct gltf *gltf = lods->gltf;
    size_t at = 0;
    while (at < lods->count && climb(gltf, lods->queue[at], stack, NULL))
        at++;
    if (at < lods->count)
        warn_at(gltf->document, PLACE(NULL, "nodes", lods->queue[at]),
                "%s: levels of detail stand above their own finest; those that are in the scene "
                "graph are taken for things of their own",
                lod_extension);
    for (size_t i = 0; i < lods->count; i++) {
        struct node *node = &gltf->nodes[lods->queue[i]];
        node->visit = VISIT_NEW;
        if (at < lods->count && !node->hung)
            node->lod_of = -1;
    }
}

static void settle(struct gltf *gltf, size_t index)
{
    struct node *node = &gltf->nodes[index];
    const int up = node_up(node);
    if (up >= 0) {
        const struct node *above = &gltf->nodes[up];
        const uint32_t level = node->lod_of >= 0 ? node->level : 0;
        node->lod_group = above->lod_group;
        node->lod = above->lod + level;
        node->stated_lod = above->stated_lod + (node->by_name ? 0 : level);
        node->by_name = node->by_name || above->by_name;
        node->stated = node->stated || above->stated;
    }
    if (node->finest && !node->lod_group)
        node->lod_group = ++gltf->lod_group_count;
    node_take_role(gltf, index);
}

static void warn_materials(const struct gltf *gltf)
{
    const json_t *materials = document_array(gltf->document, "materials");
    for (size_t i = 0; i < json_array_size(materials); i++) {
        if (!extension_of(json_array_get(materials, i), lod_extension))
            continue;
        warn_at(gltf->document, PLACE(NULL, "materials", i),
                "%s on materials is ignored: the finest is used everywhere", lod_extension);
        return;
    }
}

static enum cranny_status keep_hierarchy(struct gltf *gltf, struct cranny_error *why)
{
    int *up = alloc_array(gltf->node_count, sizeof *up);
    if (!up)
        return fail_memory(why, "nodes");
    for (size_t i = 0; i < gltf->node_count; i++)
        up[i] = node_up(&gltf->nodes[i]);
    gltf->scene->node_up = up;
    gltf->scene->node_count = gltf->node_count;
    return CRANNY_OK;
}

static enum cranny_status read_groups(struct lods *lods, size_t *stack, struct cranny_error *why)
{
    struct gltf *gltf = lods->gltf;
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; status == CRANNY_OK && i < lods->count; i++) /* grows on the way */
        status = read_levels(lods, lods->queue[i]);
    if (lods->complaints > COMPLAINT_LIMIT)
        warn_at(gltf->document, PLACE(NULL, "nodes", NO_INDEX),
                "%zu more faults of %s are passed over", lods->complaints - COMPLAINT_LIMIT,
                lod_extension);
    if (status == CRANNY_OK) {
        break_circles(lods, stack);
        status = lods_by_name(gltf, why);
    }
    for (size_t i = 0; status == CRANNY_OK && i < lods->count; i++)
        climb(gltf, lods->queue[i], stack, settle);
    return status == CRANNY_OK ? keep_hierarchy(gltf, why) : status;
}

enum cranny_status lods_read(struct gltf *gltf, size_t *queue, struct cranny_error *why)
{
    struct lods lods = {.gltf = gltf, .queue = queue, .why = why};
    size_t *stack = alloc_array(gltf->node_count, sizeof *stack);
    if (!stack)
        return fail_memory(why, "nodes");
    for (size_t i = 0; i < gltf->node_count; i++) {
        gltf->nodes[i].base = gltf->nodes[i].parent;
        if (gltf->nodes[i].reached)
            queue[lods.count++] = i;
    }
    warn_materials(gltf);
    const enum cranny_status status = read_groups(&lods, stack, why);
    free(stack);
    return status;
}

/* What the instances of a group span. */
struct group {
    uint32_t first, last; /* lods that occur */
    bool named, apart;
    uint32_t number; /* in the scene; 0: none */
    double box[6];   /* of its finest */
};

static void grow_box(const struct cranny_scene *scene, const struct cranny_instance *instance,
                     double box[6])
{
    const struct cranny_mesh *mesh = &scene->meshes[instance->mesh].view;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        double p[3];
        transform_point(instance->world_from_object, mesh->positions[v], p);
        for (int k = 0; k < 3; k++) {
            box[k] = fmin(box[k], p[k]);
            box[3 + k] = fmax(box[3 + k], p[k]);
        }
    }
}

static const double empty_box[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};

/* Half the finest's size is far for a coarser shape, and near for a neighbour on a sample sheet. */
static bool stands_apart(const struct cranny_scene *scene, const struct cranny_instance *instance,
                         const double finest[6])
{
    double box[6];
    memcpy(box, empty_box, sizeof box);
    grow_box(scene, instance, box);
    for (int k = 0; k < 3; k++) {
        const double away = fabs(box[k] + box[3 + k] - finest[k] - finest[3 + k]) / 2;
        const double size = fmax(finest[3 + k] - finest[k], box[3 + k] - box[k]);
        if (away > 0.5 * size + 1e-6)
            return true;
    }
    return false;
}

static void measure_groups(const struct gltf *gltf, struct group *groups)
{
    const struct cranny_scene *scene = gltf->scene;
    for (size_t i = 0; i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        struct group *group = &groups[instance->lod_group];
        group->first = instance->lod < group->first ? instance->lod : group->first;
        group->last = instance->lod > group->last ? instance->lod : group->last;
        group->named = group->named || gltf->nodes[scene->instances[i].source_node].by_name;
    }
    for (size_t i = 0; i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        struct group *group = &groups[instance->lod_group];
        if (instance->lod_group && group->named && instance->lod == group->first)
            grow_box(scene, instance, group->box);
    }
}

static void find_apart(const struct gltf *gltf, struct group *groups)
{
    const struct cranny_scene *scene = gltf->scene;
    for (size_t i = 0; i < scene->instance_count; i++) {
        const struct instance *instance = &scene->instances[i];
        struct group *group = &groups[instance->view.lod_group];
        const struct node *node = &gltf->nodes[instance->source_node];
        if (!instance->view.lod_group || !node->by_name || group->apart ||
            instance->view.lod == group->first || !stands_apart(scene, &instance->view, group->box))
            continue;
        group->apart = true;
        warn_at(gltf->document, PLACE(NULL, "nodes", (size_t)instance->source_node),
                "'%.80s' is named as a level of detail, but stands apart from the finest; all of "
                "these levels are taken for things of their own",
                loose_name(node->object));
    }
}

static void number_level(const struct gltf *gltf, struct instance *instance, struct group *groups,
                         uint32_t *count)
{
    struct cranny_instance *view = &instance->view;
    struct group *group = &groups[view->lod_group];
    const struct node *node = &gltf->nodes[instance->source_node];
    const bool apart = group->apart && node->by_name;
    if (!view->lod_group || group->first == group->last || (apart && !node->stated)) {
        view->lod = view->lod_group = 0;
        return;
    }
    const uint32_t lod = apart ? node->stated_lod : view->lod;
    if (!group->number)
        group->number = ++*count;
    view->lod = lod > group->first ? lod - group->first : 0;
    view->lod_group = group->number;
}

enum cranny_status lods_finish(struct gltf *gltf, struct cranny_error *why)
{
    struct cranny_scene *scene = gltf->scene;
    struct group *groups = alloc_array((size_t)gltf->lod_group_count + 1, sizeof *groups);
    uint32_t count = 0;
    if (!groups)
        return fail_memory(why, "levels of detail");
    for (size_t i = 0; i <= gltf->lod_group_count; i++) {
        groups[i].first = UINT32_MAX;
        memcpy(groups[i].box, empty_box, sizeof empty_box);
    }
    if (gltf->lod_group_count) {
        measure_groups(gltf, groups);
        find_apart(gltf, groups);
    }
    for (size_t i = 0; gltf->lod_group_count && i < scene->instance_count; i++)
        number_level(gltf, &scene->instances[i], groups, &count);
    free(groups);
    return CRANNY_OK;
}
