#include "bake/change.h"

#include "bake/plan.h"
#include "base/hash.h"
#include "trace/tracer.h"

/* Share of its size that a box is enlarged by: more than rays and boxes are rounded. */
#define SLACK 0x1p-18

static uint64_t texture_key(const struct cranny_alpha_texture *texture)
{
    const uint64_t size = (uint64_t)texture->width << 32 | texture->height;
    const uint64_t wrap = (uint64_t)texture->wrap_u << 8 | (uint64_t)texture->wrap_v;
    return hash_bytes(hash_word(hash_word(HASH_BEGIN, size), wrap), texture->alpha,
                      (size_t)texture->width * texture->height);
}

static uint64_t material_key(const struct cranny_material *material, const uint64_t *textures)
{
    const float numbers[2] = {material->alpha_cutoff, material->opacity};
    uint64_t key = hash_word(HASH_BEGIN, (uint64_t)material->alpha_mode);
    if (material->alpha_mode != CRANNY_ALPHA_OPAQUE) {
        key = hash_bytes(key, numbers, sizeof numbers);
        if (material->alpha_texture >= 0) {
            key = hash_bytes(key, material->uv_transform, sizeof material->uv_transform);
            key = hash_word(key, textures[material->alpha_texture]);
        }
    }
    return hash_word(key, material->double_sided);
}

static uint64_t *material_keys(const struct cranny_scene *scene)
{
    uint64_t *textures = alloc_array(scene->texture_count, sizeof *textures);
    uint64_t *keys = alloc_array(scene->material_count, sizeof *keys);
    for (size_t i = 0; textures && keys && i < scene->texture_count; i++)
        textures[i] = texture_key(&scene->textures[i]);
    for (size_t i = 0; textures && keys && i < scene->material_count; i++)
        keys[i] = material_key(&scene->materials[i], textures);
    if (!textures) {
        free(keys);
        keys = NULL;
    }
    free(textures);
    return keys;
}

static uint64_t look_key(const struct cranny_scene *scene, const struct cranny_mesh *mesh,
                         const uint64_t *materials)
{
    uint64_t key = mesh_shape_key(mesh);
    bool textured = false;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const struct cranny_material *material = &scene->materials[mesh->triangle_materials[t]];
        key = hash_word(key, materials[mesh->triangle_materials[t]]);
        textured |= material->alpha_texture >= 0 && material->alpha_mode != CRANNY_ALPHA_OPAQUE;
    }
    if (textured && mesh->texcoords)
        key = hash_bytes(key, mesh->texcoords, mesh->vertex_count * sizeof *mesh->texcoords);
    return key;
}

enum cranny_status mesh_look_keys(const struct cranny_scene *scene, uint64_t *keys,
                                  struct cranny_error *why)
{
    uint64_t *materials = material_keys(scene);
    if (!materials)
        return fail_memory(why, "cache");
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t m = 0; m < scene->mesh_count; m++)
        keys[m] = look_key(scene, &scene->meshes[m].view, materials);
    free(materials);
    return CRANNY_OK;
}

/* What an instance's key and box need to know of its mesh. */
struct mesh_facts {
    uint64_t look;
    uint32_t uses;      /* by triangles that rays meet */
    uint32_t first_fog; /* the first instance that is fog */
    bool blended;       /* rays throw dice, into which the instance's number goes */
    bool fog;
};

static bool is_occluder(const struct cranny_instance *instance)
{
    return cranny_instance_exists(instance) && instance->role != CRANNY_ROLE_GRASS;
}

static bool is_fog(const struct cranny_instance *instance)
{
    return instance->role == CRANNY_ROLE_SHRUB;
}

static bool is_blended(const struct cranny_scene *scene, const struct cranny_mesh *mesh)
{
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        if (scene->materials[mesh->triangle_materials[t]].alpha_mode == CRANNY_ALPHA_BLEND)
            return true;
    return false;
}

static enum cranny_status learn_meshes(const struct cranny_scene *scene, struct mesh_facts *facts,
                                       struct cranny_error *why)
{
    uint64_t *looks = alloc_array(scene->mesh_count, sizeof *looks);
    const enum cranny_status status =
        looks ? mesh_look_keys(scene, looks, why) : fail_memory(why, "cache");
    for (size_t m = 0; status == CRANNY_OK && m < scene->mesh_count; m++) {
        facts[m].look = looks[m];
        facts[m].blended = is_blended(scene, &scene->meshes[m].view);
    }
    for (uint32_t i = 0; status == CRANNY_OK && i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        struct mesh_facts *mesh = &facts[instance->mesh];
        if (!is_occluder(instance))
            continue;
        mesh->uses += !is_fog(instance);
        if (is_fog(instance) && !mesh->fog)
            mesh->first_fog = i;
        mesh->fog |= is_fog(instance);
    }
    free(looks);
    return status;
}

static uint64_t occluder_key(const struct cranny_scene *scene, uint32_t index,
                             const struct mesh_facts *mesh)
{
    const struct cranny_instance *instance = &scene->instances[index].view;
    const bool shared =
        mesh->uses > 1 && scene->meshes[instance->mesh].view.triangle_count >= SHARED_TRIANGLES_MIN;
    uint64_t key =
        hash_bytes(mesh->look, instance->world_from_object, sizeof instance->world_from_object);
    key = hash_word(key, (uint64_t)instance->role << 1 | shared);
    if (mesh->blended)
        key = hash_word(key, (uint64_t)index << 32 | mesh->first_fog);
    return key;
}

static void find_box(const struct mesh *mesh, const struct cranny_instance *instance, double box[6])
{
    double thick[6] = {0}, slack[3];
    instance_bounds(mesh, instance->world_from_object, box);
    if (is_fog(instance)) {
        static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        double own[6], longest = 0;
        instance_bounds(mesh, identity, own);
        for (int k = 0; k < 3; k++)
            longest = fmax(longest, 0.5 * (own[3 + k] - own[k]));
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                thick[k] += (double)FOG_THICKNESS_MIN * longest *
                            fabs(instance->world_from_object[4 * k + c]);
    }
    for (int k = 0; k < 3; k++) {
        const double largest = fmax(fabs(box[k]), fabs(box[3 + k]));
        slack[k] = thick[k] + SLACK * (largest + box[3 + k] - box[k]) + 1e-30;
    }
    for (int k = 0; k < 3; k++) {
        box[k] -= slack[k];
        box[3 + k] += slack[k];
    }
}

static int compare_occluders(const void *a, const void *b)
{
    const struct occluder *x = a, *y = b;
    return (x->key > y->key) - (x->key < y->key);
}

enum cranny_status occluders_list(const struct cranny_scene *scene, struct occluders *list,
                                  struct cranny_error *why)
{
    struct mesh_facts *facts = alloc_array(scene->mesh_count, sizeof *facts);
    *list = (struct occluders){.items = alloc_array(scene->instance_count, sizeof *list->items)};
    enum cranny_status status =
        facts && list->items ? learn_meshes(scene, facts, why) : fail_memory(why, "cache");
    for (uint32_t i = 0; status == CRANNY_OK && i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        if (!is_occluder(instance))
            continue;
        struct occluder *item = &list->items[list->count++];
        item->key = occluder_key(scene, i, &facts[instance->mesh]);
        item->fog = is_fog(instance);
        find_box(&scene->meshes[instance->mesh], instance, item->box);
    }
    free(facts);
    if (status == CRANNY_OK) {
        qsort(list->items, list->count, sizeof *list->items, compare_occluders);
        return CRANNY_OK;
    }
    free(list->items);
    *list = (struct occluders){0};
    return status;
}

/* Boxes on their way into a change. */
struct boxes {
    double (*items)[6];
    size_t count, capacity, fog_count; /* the boxes of fog come first */
};

static bool add_box(struct boxes *boxes, const double box[6])
{
    if (!grow_array((void **)&boxes->items, &boxes->capacity, boxes->count + 1,
                    sizeof *boxes->items))
        return false;
    memcpy(boxes->items[boxes->count++], box, sizeof *boxes->items);
    return true;
}

/* The boxes of what is in one list only. */
static bool add_differences(const struct occluder *old, size_t old_count,
                            const struct occluders *now, bool fog, struct boxes *boxes,
                            struct change *change)
{
    for (size_t i = 0, j = 0; i < old_count || j < now->count;) {
        const bool have_old = i < old_count, have_now = j < now->count;
        if (have_old && have_now && old[i].key == now->items[j].key) {
            i++;
            j++;
            continue;
        }
        const bool gone = have_old && (!have_now || old[i].key < now->items[j].key);
        const struct occluder *item = gone ? &old[i++] : &now->items[j++];
        if ((item->fog != 0) != fog)
            continue;
        change->removed += gone;
        change->added += !gone;
        if (!add_box(boxes, item->box))
            return false;
    }
    return true;
}

/* Whether fog in `box` is thinned otherwise when fog in `other` comes or goes: boxes are counted
 * within √3 times the root of the sum of squares of its half sides (see fog.c). */
static bool fog_meets(const double box[6], const double other[6])
{
    double reach = 0, apart = 0;
    for (int k = 0; k < 3; k++) {
        const double half = 0.5 * (box[3 + k] - box[k]), middle = 0.5 * (box[3 + k] + box[k]);
        const double gap = fmax(fmax(other[k] - middle, middle - other[3 + k]), 0);
        reach += half * half;
        apart += gap * gap;
    }
    return apart <= 3 * reach;
}

static bool add_thinned_fog(const struct occluders *now, struct boxes *boxes)
{
    const size_t changed = boxes->fog_count;
    for (size_t i = 0; i < now->count && changed; i++) {
        bool meets = false;
        for (size_t b = 0; b < changed && now->items[i].fog && !meets; b++)
            meets = fog_meets(now->items[i].box, boxes->items[b]);
        if (meets && !add_box(boxes, now->items[i].box))
            return false;
    }
    return true;
}

static void join_boxes(const double (*boxes)[6], size_t count, float out[6])
{
    double box[6];
    memcpy(box, boxes[0], sizeof box);
    for (size_t i = 1; i < count; i++)
        for (int k = 0; k < 3; k++) {
            box[k] = fmin(box[k], boxes[i][k]);
            box[3 + k] = fmax(box[3 + k], boxes[i][3 + k]);
        }
    for (int k = 0; k < 3; k++) {
        out[k] = nextafterf((float)box[k], -INFINITY);
        out[3 + k] = nextafterf((float)box[3 + k], INFINITY);
    }
}

static int compare_x(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (x[0] + x[3] > y[0] + y[3]) - (x[0] + x[3] < y[0] + y[3]);
}
static int compare_y(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (x[1] + x[4] > y[1] + y[4]) - (x[1] + x[4] < y[1] + y[4]);
}
static int compare_z(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (x[2] + x[5] > y[2] + y[5]) - (x[2] + x[5] < y[2] + y[5]);
}

/* At most `groups` unions of boxes near each other: halved along the longest axis. */
static void group_boxes(double (*boxes)[6], size_t count, size_t groups, struct change *change)
{
    static int (*const compare[3])(const void *, const void *) = {compare_x, compare_y, compare_z};
    if (count == 1 || groups == 1) {
        join_boxes((const double(*)[6])boxes, count, change->boxes[change->box_count++]);
        return;
    }
    int axis = 0;
    double widest = -1;
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t i = 0; i < count; i++) {
            low = fmin(low, boxes[i][k] + boxes[i][3 + k]);
            high = fmax(high, boxes[i][k] + boxes[i][3 + k]);
        }
        if (high - low > widest) {
            widest = high - low;
            axis = k;
        }
    }
    qsort(boxes, count, sizeof *boxes, compare[axis]);
    group_boxes(boxes, count / 2, groups / 2, change);
    group_boxes(boxes + count / 2, count - count / 2, groups - groups / 2, change);
}

enum cranny_status change_find(const struct occluder *old, size_t old_count,
                               const struct occluders *now, struct change *change,
                               struct cranny_error *why)
{
    struct boxes boxes = {.items = NULL};
    *change = (struct change){.boxes = alloc_array(CHANGE_BOXES_MAX, sizeof *change->boxes)};
    bool good = change->boxes && add_differences(old, old_count, now, true, &boxes, change);
    boxes.fog_count = boxes.count;
    good = good && add_differences(old, old_count, now, false, &boxes, change) &&
           add_thinned_fog(now, &boxes);
    if (good && boxes.count)
        group_boxes(boxes.items, boxes.count, CHANGE_BOXES_MAX, change);
    free(boxes.items);
    if (!good)
        change_free(change);
    return good ? CRANNY_OK : fail_memory(why, "cache");
}

void change_free(struct change *change)
{
    free(change->boxes);
    *change = (struct change){0};
}
