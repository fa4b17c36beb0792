/* What a scene is made of, counted. */
#include "scene/scene.h"

static void count_alpha(const struct cranny_scene *scene, const struct cranny_mesh *mesh,
                        struct cranny_scene_info *info)
{
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const struct cranny_material *material = &scene->materials[mesh->triangle_materials[t]];
        info->masked_triangles += material->alpha_mode == CRANNY_ALPHA_MASK;
        info->blended_triangles += material->alpha_mode == CRANNY_ALPHA_BLEND;
        info->double_sided_triangles += material->double_sided;
    }
}

static void count_instance(const struct cranny_scene *scene, const struct cranny_instance *instance,
                           struct cranny_scene_info *info)
{
    const struct cranny_mesh *mesh = &scene->meshes[instance->mesh].view;
    if (instance->lod) {
        info->lod_instances++;
        info->lod_vertices += mesh->vertex_count;
        info->lod_triangles += mesh->triangle_count;
        return;
    }
    info->role_instances[instance->role]++;
    info->role_triangles[instance->role] += mesh->triangle_count;
    if (cranny_instance_exists(instance))
        count_alpha(scene, mesh, info);
}

static int compare_groups(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Callers number groups as they like; without memory to sort them, the count is an upper bound. */
static uint64_t count_groups(const struct cranny_scene *scene)
{
    uint32_t *groups = alloc_array(scene->instance_count, sizeof *groups);
    size_t count = 0, distinct = 0;
    for (size_t i = 0; i < scene->instance_count; i++) {
        const uint32_t group = scene->instances[i].view.lod_group;
        if (group && groups)
            groups[count] = group;
        count += group > 0;
    }
    if (!groups)
        return count;
    qsort(groups, count, sizeof *groups, compare_groups);
    for (size_t i = 0; i < count; i++)
        distinct += i == 0 || groups[i] != groups[i - 1];
    free(groups);
    return distinct;
}

void cranny_scene_get_info(const struct cranny_scene *scene, struct cranny_scene_info *info)
{
    *info = (struct cranny_scene_info){.format = scene->format,
                                       .generator = scene->generator ? scene->generator : "",
                                       .meshes = scene->mesh_count,
                                       .instances = scene->instance_count,
                                       .materials = scene->material_count,
                                       .textures = scene->texture_count,
                                       .cameras = scene->camera_count,
                                       .vertices = cranny_scene_vertex_count(scene),
                                       .triangles = cranny_scene_triangle_count(scene),
                                       .lod_groups = count_groups(scene),
                                       .skipped_primitives = scene->skipped_primitives};
    for (size_t i = 0; i < scene->mesh_count; i++) {
        info->unique_vertices += scene->meshes[i].view.vertex_count;
        info->unique_triangles += scene->meshes[i].view.triangle_count;
    }
    for (size_t i = 0; i < scene->instance_count; i++)
        count_instance(scene, &scene->instances[i].view, info);
    cranny_scene_bounds(scene, info->bounds);
}
