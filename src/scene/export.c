#include "scene/builder.h"
#include "scene/write.h"

#include "base/image.h"

/* Sorting a mesh's triangles by material: one primitive for each that occurs. */
struct buckets {
    uint32_t *slots; /* per material of the scene: its slot + 1 in the mesh at hand, 0: unused */
    uint32_t *materials; /* per slot */
    uint32_t *counts;    /* per slot: triangles */
    uint32_t (*sorted)[3];
    uint32_t count;
};

static bool open_buckets(struct buckets *buckets, const struct cranny_scene *scene)
{
    size_t most = 0;
    for (size_t i = 0; i < scene->mesh_count; i++)
        if (scene->meshes[i].view.triangle_count > most)
            most = scene->meshes[i].view.triangle_count;
    buckets->slots = alloc_array(scene->material_count, sizeof *buckets->slots);
    buckets->materials = alloc_array(scene->material_count, sizeof *buckets->materials);
    buckets->counts = alloc_array(scene->material_count, sizeof *buckets->counts);
    buckets->sorted = alloc_array(most, sizeof *buckets->sorted);
    return buckets->slots && buckets->materials && buckets->counts && buckets->sorted;
}

static void close_buckets(struct buckets *buckets)
{
    free(buckets->slots);
    free(buckets->materials);
    free(buckets->counts);
    free(buckets->sorted);
}

/* Triangles sorted by material, in the order in which the materials first occur. */
static void sort_triangles(struct buckets *buckets, const struct cranny_mesh *mesh)
{
    for (uint32_t i = 0; i < buckets->count; i++)
        buckets->slots[buckets->materials[i]] = 0;
    buckets->count = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t material = mesh->triangle_materials[t];
        if (!buckets->slots[material]) {
            buckets->materials[buckets->count] = material;
            buckets->counts[buckets->count++] = 0;
            buckets->slots[material] = buckets->count;
        }
        buckets->counts[buckets->slots[material] - 1]++;
    }
    uint32_t first = 0;
    for (uint32_t i = 0; i < buckets->count; i++) {
        const uint32_t count = buckets->counts[i];
        buckets->counts[i] = first;
        first += count;
    }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        uint32_t *next = &buckets->counts[buckets->slots[mesh->triangle_materials[t]] - 1];
        memcpy(buckets->sorted[(*next)++], mesh->triangles[t], sizeof mesh->triangles[t]);
    }
}

/* A glTF mesh with one primitive per material; all share the vertices. */
static enum cranny_status add_mesh(struct builder *builder, struct buckets *buckets,
                                   struct mesh *mesh, struct cranny_error *why)
{
    const struct cranny_mesh *view = &mesh->view;
    const size_t count = view->vertex_count;
    mesh->source_mesh = -1;
    if (!view->triangle_count)
        return CRANNY_OK;
    sort_triangles(buckets, view);
    mesh->parts = alloc_array(buckets->count, sizeof *mesh->parts);
    if (!mesh->parts)
        return fail_memory(why, "mesh");
    mesh->part_count = buckets->count;
    json_t *attributes = json_object(), *primitives = json_array();
    const size_t position = builder_floats(builder, &view->positions[0][0], count, 3, true);
    builder_set(builder, attributes, "POSITION", json_integer((json_int_t)position));
    if (view->normals)
        builder_set(builder, attributes, "NORMAL",
                    json_integer((json_int_t)builder_floats(builder, &view->normals[0][0], count, 3,
                                                            false)));
    if (view->texcoords)
        builder_set(builder, attributes, "TEXCOORD_0",
                    json_integer((json_int_t)builder_floats(builder, &view->texcoords[0][0], count,
                                                            2, false)));
    uint32_t first = 0;
    for (uint32_t i = 0; i < buckets->count; i++) {
        const uint32_t end = buckets->counts[i];
        const size_t indices =
            builder_indices(builder, buckets->sorted[first], 3 * (size_t)(end - first));
        json_array_append_new(primitives,
                              json_pack("{s:o, s:I, s:I}", "attributes", json_deep_copy(attributes),
                                        "indices", (json_int_t)indices, "material",
                                        (json_int_t)buckets->materials[i]));
        mesh->parts[i] = (struct mesh_part){0, view->vertex_count, first, end - first, i};
        first = end;
    }
    json_decref(attributes);
    json_t *object = json_object();
    builder_name(builder, object, view->name);
    builder_set(builder, object, "primitives", primitives);
    mesh->source_mesh = (int)builder_append(builder, "meshes", object);
    return CRANNY_OK;
}

/* An alpha plane as a white image with that alpha. */
static enum cranny_status add_texture(struct builder *builder,
                                      const struct cranny_alpha_texture *texture, size_t *index,
                                      struct cranny_error *why)
{
    const size_t count = (size_t)texture->width * texture->height;
    uint8_t *rgba = alloc_array(count, 4), *png;
    size_t size;
    if (!rgba || texture->width > INT32_MAX / 4 || texture->height > INT32_MAX) {
        free(rgba);
        return fail_memory(why, "texture");
    }
    memset(rgba, 255, 4 * count);
    for (size_t i = 0; i < count; i++)
        rgba[4 * i + 3] = texture->alpha[i];
    enum cranny_status status = png_encode((int)texture->width, (int)texture->height, 4, rgba,
                                           4 * (size_t)texture->width, &png, &size, why);
    free(rgba);
    if (status != CRANNY_OK)
        return status;
    *index = builder_texture(builder, png, size, "image/png", texture->wrap_u, texture->wrap_v);
    free(png);
    return CRANNY_OK;
}

static enum cranny_status add_materials(struct builder *builder, const struct cranny_scene *scene,
                                        struct cranny_error *why)
{
    size_t *textures = alloc_array(scene->texture_count, sizeof *textures);
    enum cranny_status status = textures ? CRANNY_OK : fail_memory(why, "textures");
    for (size_t i = 0; status == CRANNY_OK && i < scene->texture_count; i++)
        status = add_texture(builder, &scene->textures[i], &textures[i], why);
    for (size_t i = 0; status == CRANNY_OK && i < scene->material_count; i++) {
        const int texture = scene->materials[i].alpha_texture;
        builder_material(builder, &scene->materials[i], texture < 0 ? SIZE_MAX : textures[texture],
                         0);
    }
    free(textures);
    return status;
}

static void add_camera(struct builder *builder, const struct cranny_camera *camera, json_t *roots)
{
    const double near_plane = (double)camera->near_plane, half = (double)camera->half_height;
    json_t *object =
        camera->orthographic
            ? json_pack("{s:s, s:{s:f, s:f, s:f, s:f}}", "type", "orthographic", "orthographic",
                        "xmag", half, "ymag", half, "zfar", near_plane + 1000, "znear", near_plane)
            : json_pack("{s:s, s:{s:f, s:f}}", "type", "perspective", "perspective", "yfov",
                        (double)camera->fov_y, "znear", near_plane);
    builder_name(builder, object, camera->name);
    const size_t index = builder_append(builder, "cameras", object);
    json_t *node = builder_node(builder, camera->name, camera->world_from_view);
    builder_set(builder, node, "camera", json_integer((json_int_t)index));
    const size_t root = builder_append(builder, "nodes", node);
    json_array_append_new(roots, json_integer((json_int_t)root));
}

static json_t *instance_node(struct builder *builder, const struct cranny_scene *scene,
                             const struct cranny_instance *instance)
{
    const int mesh = scene->meshes[instance->mesh].source_mesh;
    json_t *node = builder_node(builder, instance->name, instance->world_from_object);
    if (mesh >= 0)
        builder_set(builder, node, "mesh", json_integer(mesh));
    if (instance->role != CRANNY_ROLE_SOLID)
        builder_set(builder, node, "extras",
                    json_pack("{s:s}", "cranny_role", cranny_role_names()[instance->role]));
    return node;
}

static int compare_levels(const void *a, const void *b)
{
    const struct instance *x = *(struct instance *const *)a, *y = *(struct instance *const *)b;
    if (x->view.lod_group != y->view.lod_group)
        return x->view.lod_group < y->view.lod_group ? -1 : 1;
    if (x->view.lod != y->view.lod)
        return x->view.lod < y->view.lod ? -1 : 1;
    return (x > y) - (x < y);
}

/* A group's instances of one level as one node: itself, or a holder. */
static size_t level_node(struct builder *builder, struct instance *const *instances, size_t count)
{
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    if (count == 1)
        return (size_t)instances[0]->source_node;
    json_t *holder = builder_node(builder, instances[0]->view.name, identity);
    json_t *children = json_array();
    for (size_t i = 0; i < count; i++)
        json_array_append_new(children, json_integer(instances[i]->source_node));
    builder_set(builder, holder, "children", children);
    return builder_append(builder, "nodes", holder);
}

/* One group: its finest level goes to the roots and names the others. */
static void add_group(struct builder *builder, struct instance *const *instances, size_t count,
                      json_t *roots)
{
    json_t *ids = json_array();
    size_t finest = SIZE_MAX;
    for (size_t first = 0, end; first < count; first = end) {
        for (end = first + 1;
             end < count && instances[end]->view.lod == instances[first]->view.lod;)
            end++;
        const size_t node = level_node(builder, instances + first, end - first);
        if (finest != SIZE_MAX)
            json_array_append_new(ids, json_integer((json_int_t)node));
        else
            finest = node;
    }
    json_array_append_new(roots, json_integer((json_int_t)finest));
    if (!json_array_size(ids)) {
        json_decref(ids);
        return;
    }
    json_t *node = json_array_get(json_object_get(builder->root, "nodes"), finest);
    builder_set(builder, node, "extensions", json_pack("{s:{s:o}}", "MSFT_lod", "ids", ids));
    builder_use(builder, "MSFT_lod");
}

/* Whatever has a group, by group and level. `levels` has room for all instances. */
static void add_groups(struct builder *builder, struct cranny_scene *scene,
                       struct instance **levels, json_t *roots)
{
    size_t count = 0;
    for (size_t i = 0; i < scene->instance_count; i++)
        if (scene->instances[i].view.lod_group)
            levels[count++] = &scene->instances[i];
    qsort(levels, count, sizeof *levels, compare_levels);
    for (size_t first = 0, end; first < count; first = end) {
        const uint32_t group = levels[first]->view.lod_group;
        for (end = first + 1; end < count && levels[end]->view.lod_group == group;)
            end++;
        add_group(builder, levels + first, end - first, roots);
    }
}

static enum cranny_status add_nodes(struct builder *builder, struct cranny_scene *scene,
                                    struct cranny_error *why)
{
    struct instance **levels = alloc_array(scene->instance_count, sizeof *levels);
    if (!levels)
        return fail_memory(why, "scene");
    json_t *roots = json_array();
    for (size_t i = 0; i < scene->instance_count; i++) {
        struct instance *instance = &scene->instances[i];
        instance->source_node =
            (int)builder_append(builder, "nodes", instance_node(builder, scene, &instance->view));
        if (!instance->view.lod_group)
            json_array_append_new(roots, json_integer(instance->source_node));
    }
    add_groups(builder, scene, levels, roots);
    free(levels);
    for (size_t i = 0; i < scene->camera_count; i++)
        add_camera(builder, &scene->cameras[i], roots);
    json_t *shown = json_object();
    if (json_array_size(roots))
        builder_set(builder, shown, "nodes", roots);
    else
        json_decref(roots);
    builder_append(builder, "scenes", shown);
    builder_set(builder, builder->root, "scene", json_integer(0));
    return CRANNY_OK;
}

/* Own copies of the lists whose places in the document are noted; the arrays stay borrowed. */
static bool copy_lists(const struct cranny_scene *scene, struct cranny_scene *stand_in)
{
    *stand_in = *scene;
    stand_in->node_up = NULL;
    stand_in->meshes = alloc_array(scene->mesh_count, sizeof *scene->meshes);
    stand_in->instances = alloc_array(scene->instance_count, sizeof *scene->instances);
    if (!stand_in->meshes || !stand_in->instances)
        return false;
    for (size_t i = 0; i < scene->mesh_count; i++)
        stand_in->meshes[i] = (struct mesh){.view = scene->meshes[i].view};
    for (size_t i = 0; i < scene->instance_count; i++)
        stand_in->instances[i] =
            (struct instance){.view = scene->instances[i].view, .source_index = -1};
    return true;
}

enum cranny_status export_begin(const struct cranny_scene *scene, struct cranny_scene *stand_in,
                                struct cranny_error *why)
{
    struct builder builder;
    struct buckets buckets = {0};
    if (!copy_lists(scene, stand_in))
        return fail_memory(why, "scene");
    builder_begin(&builder);
    enum cranny_status status =
        open_buckets(&buckets, scene) ? CRANNY_OK : fail_memory(why, "scene");
    if (status == CRANNY_OK)
        status = add_materials(&builder, scene, why);
    for (size_t i = 0; status == CRANNY_OK && i < scene->mesh_count; i++)
        status = add_mesh(&builder, &buckets, &stand_in->meshes[i], why);
    close_buckets(&buckets);
    if (status == CRANNY_OK)
        status = add_nodes(&builder, stand_in, why);
    if (status != CRANNY_OK) {
        builder_free(&builder);
        return status;
    }
    return builder_finish(&builder, "scene", UINT64_MAX, &stand_in->document, why);
}

void export_end(struct cranny_scene *stand_in)
{
    for (size_t i = 0; stand_in->meshes && i < stand_in->mesh_count; i++)
        free(stand_in->meshes[i].parts);
    free(stand_in->meshes);
    free(stand_in->instances);
    document_destroy(&stand_in->document);
}
