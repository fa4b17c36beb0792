#include "scene/gltf.h"

static void gltf_close(struct gltf *gltf)
{
    views_close(&gltf->views);
    free(gltf->nodes);
    free(gltf->materials);
    free(gltf->texture_keys);
    free(gltf->shared_meshes);
    free(gltf->mesh_roles);
}

static enum cranny_status check_arrays(const struct document *document, struct cranny_error *why)
{
    static const char *const names[] = {"accessors", "bufferViews", "buffers", "cameras",
                                        "images",    "materials",   "meshes",  "nodes",
                                        "samplers",  "scenes",      "skins",   "textures"};
    for (size_t i = 0; i < COUNT_OF(names); i++) {
        json_t *array;
        enum cranny_status status =
            field_array(document, NULL, document->root, names[i], &array, why);
        if (status == CRANNY_OK && json_array_size(array) >= INT32_MAX)
            status = fail_at(document, PLACE(NULL, names[i], NO_INDEX), why, CRANNY_INPUT,
                             "is longer than Cranny can count");
        if (status != CRANNY_OK)
            return status;
    }
    return CRANNY_OK;
}

static enum cranny_status read_parts(struct gltf *gltf, int scene_index, struct cranny_error *why)
{
    gltf->mesh_count = document_count(gltf->document, "meshes");
    gltf->shared_meshes = alloc_array(gltf->mesh_count, sizeof *gltf->shared_meshes);
    gltf->mesh_roles = alloc_array(gltf->mesh_count, sizeof *gltf->mesh_roles);
    if (!gltf->shared_meshes || !gltf->mesh_roles)
        return fail_memory(why, "meshes");
    for (size_t i = 0; i < gltf->mesh_count; i++) {
        gltf->shared_meshes[i] = -1;
        gltf->mesh_roles[i] = ROLE_UNREAD;
    }
    enum cranny_status status = views_open(gltf->document, &gltf->views, why);
    if (status == CRANNY_OK)
        status = materials_read(gltf, why);
    if (status == CRANNY_OK)
        status = nodes_read(gltf, scene_index, why);
    if (status == CRANNY_OK)
        status = instances_read(gltf, why);
    return status;
}

enum cranny_status gltf_read(struct document *document,
                             const struct cranny_scene_load_params *params,
                             struct cranny_scene *scene, struct cranny_error *why)
{
    struct gltf gltf = {.document = document, .scene = scene, .colors = params->colors};
    enum cranny_status status = check_arrays(document, why);
    if (status == CRANNY_OK)
        status = read_parts(&gltf, params->scene, why);
    gltf_close(&gltf);
    return status;
}
