/* What the reached nodes show: meshes (plain, posed, instanced) and cameras. */
#include "scene/mesh.h"

static const char instancing_name[] = "EXT_mesh_gpu_instancing";

static enum cranny_status add_instance(struct gltf *gltf, size_t node, uint32_t mesh,
                                       const double transform[12], int source_index,
                                       struct cranny_error *why)
{
    const struct node *from = &gltf->nodes[node];
    struct cranny_instance view = {.name = loose_name(from->object),
                                   .mesh = mesh,
                                   .role = from->role,
                                   .lod = from->lod,
                                   .lod_group = from->lod_group};
    memcpy(view.world_from_object, transform, sizeof view.world_from_object);
    enum cranny_status status =
        document_reserve(gltf->document, strlen(view.name), "instances", why);
    if (status == CRANNY_OK)
        status = cranny_scene_add_instance(gltf->scene, &view, NULL, why);
    if (status != CRANNY_OK)
        return status;
    struct instance *added = &gltf->scene->instances[gltf->scene->instance_count - 1];
    added->source_node = (int)node;
    added->source_index = source_index;
    return CRANNY_OK;
}

/* Joint matrices of a skin times its inverse bind matrices (glTF 2.0, 3.7.3.1). */
static enum cranny_status fill_joints(struct gltf *gltf, const struct place *place,
                                      const json_t *skin, const json_t *list, double (*joints)[12],
                                      struct cranny_error *why)
{
    const struct document *document = gltf->document;
    const size_t count = json_array_size(list);
    int index;
    struct accessor accessor;
    float *inverse = NULL;
    enum cranny_status status = field_index(document, place, skin, "inverseBindMatrices",
                                            document_count(document, "accessors"), &index, why);
    if (status == CRANNY_OK && index >= 0) {
        status = accessor_open(&gltf->views, (size_t)index, &accessor, why);
        if (status == CRANNY_OK && (accessor.components != 16 || accessor.count < count))
            status =
                fail_at(document, place, why, CRANNY_INPUT,
                        "inverseBindMatrices must hold a MAT4 for each of the %zu joints", count);
        if (status == CRANNY_OK)
            status = document_reserve(gltf->document, accessor.count * 64, "skin", why);
        if (status != CRANNY_OK)
            return status;
        inverse = alloc_array(accessor.count, 64);
        if (!inverse)
            return fail_memory(why, "skin");
        accessor_floats(&accessor, inverse);
    }
    for (size_t i = 0; status == CRANNY_OK && i < count; i++) {
        const struct place at = {place, "joints", i};
        size_t node;
        double bind[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        status = value_index(document, &at, json_array_get(list, i), "node", gltf->node_count,
                             &node, why);
        if (status != CRANNY_OK)
            break;
        for (int k = 0; inverse && k < 12; k++)
            bind[k] = inverse[16 * i + 4 * (size_t)(k % 4) + (size_t)(k / 4)];
        transform_multiply(gltf->nodes[node].world, bind, joints[i]);
        if (!transform_finite(joints[i]))
            status = fail_at(document, &at, why, CRANNY_INPUT,
                             "its matrix is not finite, or beyond 1e18");
    }
    free(inverse);
    return status;
}

static enum cranny_status read_skin(struct gltf *gltf, int index, double (**joints)[12],
                                    size_t *count, struct cranny_error *why)
{
    const struct place place = {NULL, "skins", (size_t)index};
    json_t *skin, *list;
    enum cranny_status status = document_item(gltf->document, "skins", (size_t)index, &skin, why);
    if (status == CRANNY_OK)
        status = field_array(gltf->document, &place, skin, "joints", &list, why);
    if (status == CRANNY_OK && !json_array_size(list))
        return fail_at(gltf->document, &place, why, CRANNY_INPUT, "has no joints");
    if (status == CRANNY_OK)
        status =
            document_reserve(gltf->document, json_array_size(list) * sizeof **joints, "skin", why);
    if (status != CRANNY_OK)
        return status;
    *count = json_array_size(list);
    *joints = alloc_array(*count, sizeof **joints);
    return *joints ? fill_joints(gltf, &place, skin, list, *joints, why) : fail_memory(why, "skin");
}

static enum cranny_status check_weights(const struct gltf *gltf, size_t node, const json_t *weights,
                                        struct cranny_error *why)
{
    const struct place place = {NULL, "nodes", node};
    for (size_t i = 0; i < json_array_size(weights); i++)
        if (!json_is_number(json_array_get(weights, i)))
            return fail_at(gltf->document, PLACE(&place, "weights", i), why, CRANNY_INPUT,
                           "must be a number");
    return CRANNY_OK;
}

/* Does any primitive have what a pose changes? */
static bool any_primitive(const json_t *mesh, const char *member, const char *attribute)
{
    const json_t *primitives = json_object_get(mesh, "primitives");
    for (size_t i = 0; i < json_array_size(primitives); i++) {
        const json_t *value = json_object_get(json_array_get(primitives, i), member);
        if (attribute ? json_object_get(value, attribute) != NULL : json_array_size(value) > 0)
            return true;
    }
    return false;
}

/* The node's own mesh, when it is skinned or differs from the stored morph weights. */
static enum cranny_status read_posed(struct gltf *gltf, size_t index, bool skinned,
                                     const json_t *weights, struct cranny_error *why)
{
    const struct node *node = &gltf->nodes[index];
    const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct pose pose = {.weights = weights};
    double(*joints)[12] = NULL;
    int mesh = -1;
    enum cranny_status status = check_weights(gltf, index, weights, why);
    if (status == CRANNY_OK && skinned)
        status = read_skin(gltf, node->skin, &joints, &pose.joint_count, why);
    pose.joints = (const double(*)[12])joints;
    if (status == CRANNY_OK)
        status = mesh_read(gltf, (size_t)node->mesh, &pose, &mesh, why);
    free(joints);
    if (status != CRANNY_OK || mesh < 0)
        return status;
    return add_instance(gltf, index, (uint32_t)mesh, skinned ? identity : node->world, -1, why);
}

/* One attribute of EXT_mesh_gpu_instancing as floats; NULL when absent. */
static enum cranny_status read_instance_values(struct gltf *gltf, const struct place *place,
                                               const json_t *attributes, const char *name,
                                               int components, float **values, size_t *count,
                                               struct cranny_error *why)
{
    const struct document *document = gltf->document;
    struct accessor accessor;
    int index;
    enum cranny_status status = field_index(document, place, attributes, name,
                                            document_count(document, "accessors"), &index, why);
    if (status != CRANNY_OK || index < 0)
        return status;
    status = accessor_open(&gltf->views, (size_t)index, &accessor, why);
    if (status == CRANNY_OK && (accessor.components != components || accessor.rows != components))
        return fail_at(document, PLACE(place, name, NO_INDEX), why, CRANNY_INPUT,
                       "must have the type VEC%d", components);
    if (status == CRANNY_OK && *count != NO_INDEX && *count != accessor.count)
        return fail_at(document, PLACE(place, name, NO_INDEX), why, CRANNY_INPUT,
                       "has %zu elements, but another attribute has %zu", accessor.count, *count);
    if (status == CRANNY_OK)
        status = document_reserve(gltf->document, accessor.count * (16 + sizeof(struct instance)),
                                  "instances", why);
    if (status != CRANNY_OK)
        return status;
    *count = accessor.count;
    *values = alloc_array(accessor.count, (size_t)components * sizeof(float));
    if (!*values)
        return fail_memory(why, "instances");
    accessor_floats(&accessor, *values);
    return CRANNY_OK;
}

static enum cranny_status add_instanced(struct gltf *gltf, size_t node, uint32_t mesh, size_t count,
                                        float *const values[3], struct cranny_error *why)
{
    for (size_t i = 0; i < count; i++) {
        double t[3] = {0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1}, local[12], world[12];
        for (size_t k = 0; k < 4; k++) {
            if (k < 3 && values[0])
                t[k] = values[0][3 * i + k];
            if (values[1])
                q[k] = values[1][4 * i + k];
            if (k < 3 && values[2])
                s[k] = values[2][3 * i + k];
        }
        transform_from_trs(t, q, s, local);
        transform_multiply(gltf->nodes[node].world, local, world);
        if (!transform_finite(world))
            return fail_at(gltf->document, PLACE(NULL, "nodes", node), why, CRANNY_INPUT,
                           "the transform of instance %zu is not finite, or beyond 1e18", i);
        enum cranny_status status = add_instance(gltf, node, mesh, world, (int)i, why);
        if (status != CRANNY_OK)
            return status;
    }
    return CRANNY_OK;
}

static enum cranny_status read_instanced(struct gltf *gltf, size_t index, uint32_t mesh,
                                         const json_t *extension, struct cranny_error *why)
{
    const struct place node = {NULL, "nodes", index};
    const struct place extensions = {&node, "extensions", NO_INDEX};
    const struct place place = {&extensions, instancing_name, NO_INDEX};
    static const char *const names[] = {"TRANSLATION", "ROTATION", "SCALE"};
    float *values[3] = {NULL, NULL, NULL};
    size_t count = NO_INDEX;
    json_t *attributes;
    enum cranny_status status =
        field_object(gltf->document, &place, extension, "attributes", &attributes, why);
    for (int i = 0; status == CRANNY_OK && i < 3; i++)
        status = read_instance_values(gltf, &place, attributes, names[i], i == 1 ? 4 : 3,
                                      &values[i], &count, why);
    if (status == CRANNY_OK && count == NO_INDEX)
        status = add_instance(gltf, index, mesh, gltf->nodes[index].world, -1, why);
    else if (status == CRANNY_OK)
        status = add_instanced(gltf, index, mesh, count, values, why);
    for (int i = 0; i < 3; i++)
        free(values[i]);
    return status;
}

static enum cranny_status read_plain(struct gltf *gltf, size_t index, struct cranny_error *why)
{
    const struct node *node = &gltf->nodes[index];
    int *shared = &gltf->shared_meshes[node->mesh];
    enum cranny_status status = CRANNY_OK;
    if (*shared == -1) {
        status = mesh_read(gltf, (size_t)node->mesh, NULL, shared, why);
        if (*shared == -1)
            *shared = -2; /* has no triangles */
    }
    if (status != CRANNY_OK || *shared < 0)
        return status;
    const json_t *extension = extension_of(node->object, instancing_name);
    if (extension)
        return read_instanced(gltf, index, (uint32_t)*shared, extension, why);
    return add_instance(gltf, index, (uint32_t)*shared, node->world, -1, why);
}

static enum cranny_status read_mesh_node(struct gltf *gltf, size_t index, struct cranny_error *why)
{
    const struct node *node = &gltf->nodes[index];
    const struct place place = {NULL, "nodes", index};
    json_t *mesh, *weights;
    enum cranny_status status =
        document_item(gltf->document, "meshes", (size_t)node->mesh, &mesh, why);
    if (status == CRANNY_OK)
        status = field_array(gltf->document, &place, node->object, "weights", &weights, why);
    if (status != CRANNY_OK)
        return status;
    const json_t *stored = json_object_get(mesh, "weights");
    if (weights &&
        (!any_primitive(mesh, "targets", NULL) || (stored && json_equal(weights, stored))))
        weights = NULL;
    const bool skinned = node->skin >= 0 && any_primitive(mesh, "attributes", "JOINTS_0");
    if (!skinned && !weights)
        return read_plain(gltf, index, why);
    if (extension_of(node->object, instancing_name))
        warn_at(gltf->document, &place, "%s on a skinned or morphed node is ignored",
                instancing_name);
    return read_posed(gltf, index, skinned, weights, why);
}

/* The view's axes without scale or shear; a broken matrix looks down the world's −Z. */
static void camera_axes(const double m[12], double out[12])
{
    double z[3] = {m[2], m[6], m[10]}, y[3] = {m[1], m[5], m[9]}, x[3], dot = 0;
    const double z_length = sqrt(z[0] * z[0] + z[1] * z[1] + z[2] * z[2]);
    for (int k = 0; k < 3; k++) {
        z[k] = z_length > 0 ? z[k] / z_length : k == 2;
        dot += z[k] * y[k];
    }
    for (int k = 0; k < 3; k++)
        y[k] -= dot * z[k];
    double y_length = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
    if (!(y_length > 0)) {
        const double helper = fabs(z[1]) < 0.9; /* +Y, or +Z when the view is vertical */
        const double up[3] = {0, helper, 1 - helper};
        for (int k = 0; k < 3; k++)
            y[k] = up[k] - (up[1] * z[1] + up[2] * z[2]) * z[k];
        y_length = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
    }
    for (int k = 0; k < 3; k++)
        y[k] /= y_length;
    for (int k = 0; k < 3; k++)
        x[k] = y[(k + 1) % 3] * z[(k + 2) % 3] - y[(k + 2) % 3] * z[(k + 1) % 3];
    for (int k = 0; k < 3; k++) {
        out[4 * k] = x[k];
        out[4 * k + 1] = y[k];
        out[4 * k + 2] = z[k];
        out[4 * k + 3] = m[4 * k + 3];
    }
}

static float sane(const json_t *lens, const char *name, double least, double most, double fallback)
{
    const double value = loose_number(lens, name, fallback);
    return (float)(value > least && value < most ? value : fallback);
}

static enum cranny_status read_camera(struct gltf *gltf, size_t index, struct cranny_error *why)
{
    const struct node *node = &gltf->nodes[index];
    struct cranny_scene *scene = gltf->scene;
    json_t *object;
    enum cranny_status status =
        document_item(gltf->document, "cameras", (size_t)node->camera, &object, why);
    if (status != CRANNY_OK)
        return status;
    if (!grow_array((void **)&scene->cameras, &scene->camera_capacity, scene->camera_count + 1,
                    sizeof *scene->cameras))
        return fail_memory(why, "camera");
    const char *type = json_string_value(json_object_get(object, "type"));
    const char *name = loose_name(object);
    struct cranny_camera *camera = &scene->cameras[scene->camera_count];
    *camera = (struct cranny_camera){.orthographic = type && !strcmp(type, "orthographic")};
    const json_t *lens =
        json_object_get(object, camera->orthographic ? "orthographic" : "perspective");
    camera->fov_y = sane(lens, "yfov", 1e-3, 3.14, 0.8);
    camera->half_height = sane(lens, "ymag", 1e-9, 1e9, 1);
    camera->near_plane = sane(lens, "znear", 1e-9, 1e9, 0.01);
    camera_axes(node->world, camera->world_from_view);
    camera->name = copy_text(*name ? name : loose_name(node->object));
    if (!camera->name)
        return fail_memory(why, "camera");
    scene->camera_count++;
    return CRANNY_OK;
}

enum cranny_status instances_read(struct gltf *gltf, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; status == CRANNY_OK && i < gltf->node_count; i++) {
        if (!gltf->nodes[i].reached)
            continue;
        if (gltf->nodes[i].mesh >= 0)
            status = read_mesh_node(gltf, i, why);
        if (status == CRANNY_OK && gltf->nodes[i].camera >= 0)
            status = read_camera(gltf, i, why);
        if (status == CRANNY_OK && i % 64 == 0 &&
            !hook_progress(gltf->document->hooks, "load", (double)i, (double)gltf->node_count))
            status = fail(why, CRANNY_CANCELLED, "%s: loading was cancelled", gltf->document->path);
    }
    return status == CRANNY_OK ? lods_finish(gltf, why) : status;
}
