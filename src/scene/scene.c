#include "scene/scene.h"

#include "scene/document.h"

enum cranny_status cranny_scene_create(struct cranny_scene **scene, struct cranny_error *why)
{
    *scene = alloc_array(1, sizeof **scene);
    if (!*scene)
        return fail_memory(why, "scene");
    (*scene)->format = "arrays";
    return CRANNY_OK;
}

void mesh_free(struct mesh *mesh)
{
    free((void *)mesh->view.name);
    free((void *)mesh->view.positions);
    free((void *)mesh->view.normals);
    free((void *)mesh->view.texcoords);
    free((void *)mesh->view.triangles);
    free((void *)mesh->view.triangle_materials);
    free(mesh->parts);
    *mesh = (struct mesh){0};
}

void cranny_scene_destroy(struct cranny_scene **scene)
{
    if (!scene || !*scene)
        return;
    struct cranny_scene *s = *scene;
    for (size_t i = 0; i < s->mesh_count; i++)
        mesh_free(&s->meshes[i]);
    for (size_t i = 0; i < s->instance_count; i++)
        free((void *)s->instances[i].view.name);
    for (size_t i = 0; i < s->material_count; i++)
        free((void *)s->materials[i].name);
    for (size_t i = 0; i < s->texture_count; i++)
        free((void *)s->textures[i].alpha);
    for (size_t i = 0; i < s->camera_count; i++)
        free((void *)s->cameras[i].name);
    free(s->meshes);
    free(s->instances);
    free(s->materials);
    for (size_t i = 0; i < s->color_count; i++)
        free((void *)s->colors[i].rgb);
    free(s->textures);
    free(s->colors);
    free(s->cameras);
    free(s->generator);
    free(s->node_up);
    document_destroy(&s->document);
    free(s);
    *scene = NULL;
}

uint32_t cranny_scene_mesh_count(const struct cranny_scene *scene)
{
    return (uint32_t)scene->mesh_count;
}

uint32_t cranny_scene_instance_count(const struct cranny_scene *scene)
{
    return (uint32_t)scene->instance_count;
}

uint32_t cranny_scene_material_count(const struct cranny_scene *scene)
{
    return (uint32_t)scene->material_count;
}

uint32_t cranny_scene_texture_count(const struct cranny_scene *scene)
{
    return (uint32_t)scene->texture_count;
}

uint32_t cranny_scene_camera_count(const struct cranny_scene *scene)
{
    return (uint32_t)scene->camera_count;
}

uint64_t cranny_scene_triangle_count(const struct cranny_scene *scene)
{
    uint64_t count = 0;
    for (size_t i = 0; i < scene->instance_count; i++)
        if (cranny_instance_exists(&scene->instances[i].view))
            count += scene->meshes[scene->instances[i].view.mesh].view.triangle_count;
    return count;
}

uint64_t cranny_scene_vertex_count(const struct cranny_scene *scene)
{
    uint64_t count = 0;
    for (size_t i = 0; i < scene->instance_count; i++)
        if (cranny_instance_exists(&scene->instances[i].view))
            count += scene->meshes[scene->instances[i].view.mesh].view.vertex_count;
    return count;
}

const struct cranny_mesh *cranny_scene_mesh(const struct cranny_scene *scene, uint32_t index)
{
    return &scene->meshes[index].view;
}

const struct cranny_instance *cranny_scene_instance(const struct cranny_scene *scene,
                                                    uint32_t index)
{
    return &scene->instances[index].view;
}

const struct cranny_material *cranny_scene_material(const struct cranny_scene *scene,
                                                    uint32_t index)
{
    return &scene->materials[index];
}

const struct cranny_alpha_texture *cranny_scene_texture(const struct cranny_scene *scene,
                                                        uint32_t index)
{
    return &scene->textures[index];
}

uint32_t cranny_scene_color_texture_count(const struct cranny_scene *scene)
{
    return (uint32_t)scene->color_count;
}

const struct cranny_color_texture *cranny_scene_color_texture(const struct cranny_scene *scene,
                                                              uint32_t index)
{
    return &scene->colors[index];
}

const struct cranny_camera *cranny_scene_camera(const struct cranny_scene *scene, uint32_t index)
{
    return &scene->cameras[index];
}

struct cranny_material cranny_material_default(void)
{
    return (struct cranny_material){.name = "",
                                    .alpha_cutoff = 0.5f,
                                    .opacity = 1,
                                    .alpha_texture = -1,
                                    .uv_transform = {1, 0, 0, 0, 1, 0},
                                    .base_color = {1, 1, 1, 1},
                                    .color_texture = -1};
}

double transform_determinant(const double m[12])
{
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
           m[2] * (m[4] * m[9] - m[5] * m[8]);
}

bool transform_inverse3(const double m[12], double inverse[9])
{
    double determinant = transform_determinant(m), scale = 0;
    for (int i = 0; i < 12; i++)
        scale = i % 4 < 3 ? fmax(scale, fabs(m[i])) : scale;
    if (!(fabs(determinant) > 1e-18 * scale * scale * scale)) {
        memset(inverse, 0, 9 * sizeof *inverse);
        return false;
    }
    double r = 1 / determinant;
    inverse[0] = r * (m[5] * m[10] - m[6] * m[9]);
    inverse[1] = r * (m[2] * m[9] - m[1] * m[10]);
    inverse[2] = r * (m[1] * m[6] - m[2] * m[5]);
    inverse[3] = r * (m[6] * m[8] - m[4] * m[10]);
    inverse[4] = r * (m[0] * m[10] - m[2] * m[8]);
    inverse[5] = r * (m[2] * m[4] - m[0] * m[6]);
    inverse[6] = r * (m[4] * m[9] - m[5] * m[8]);
    inverse[7] = r * (m[1] * m[8] - m[0] * m[9]);
    inverse[8] = r * (m[0] * m[5] - m[1] * m[4]);
    return true;
}

void transform_multiply(const double a[12], const double b[12], double out[12])
{
    double product[12];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            product[4 * i + j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] +
                                 a[4 * i + 2] * b[8 + j] + (j == 3 ? a[4 * i + 3] : 0);
    memcpy(out, product, sizeof product);
}

void cranny_scene_bounds(const struct cranny_scene *scene, double bounds[6])
{
    bool any = false;
    memset(bounds, 0, 6 * sizeof *bounds);
    for (size_t i = 0; i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        const struct cranny_mesh *mesh = &scene->meshes[instance->mesh].view;
        if (!cranny_instance_exists(instance))
            continue;
        for (uint32_t t = 0; t < mesh->triangle_count; t++) {
            for (int c = 0; c < 3; c++) {
                double p[3];
                transform_point(instance->world_from_object, mesh->positions[mesh->triangles[t][c]],
                                p);
                for (int k = 0; k < 3; k++) {
                    bounds[k] = any ? fmin(bounds[k], p[k]) : p[k];
                    bounds[3 + k] = any ? fmax(bounds[3 + k], p[k]) : p[k];
                }
                any = true;
            }
        }
    }
}

enum cranny_status cranny_scene_add_material(struct cranny_scene *scene,
                                             const struct cranny_material *material,
                                             uint32_t *index, struct cranny_error *why)
{
    if (material->alpha_texture >= (int)scene->texture_count)
        return fail(why, CRANNY_USAGE, "material: alpha_texture %d; the scene has %zu textures",
                    material->alpha_texture, scene->texture_count);
    if (!(material->opacity >= 0 && material->opacity <= 1) || isnan(material->alpha_cutoff))
        return fail(why, CRANNY_USAGE,
                    "material: opacity must lie in [0, 1], alpha_cutoff be a number");
    if (!grow_array((void **)&scene->materials, &scene->material_capacity,
                    scene->material_count + 1, sizeof *scene->materials))
        return fail_memory(why, "material");
    struct cranny_material *copy = &scene->materials[scene->material_count];
    *copy = *material;
    copy->color_texture = -1;
    copy->name = copy_text(material->name);
    if (!copy->name)
        return fail_memory(why, "material");
    if (index)
        *index = (uint32_t)scene->material_count;
    scene->material_count++;
    return CRANNY_OK;
}

enum cranny_status cranny_scene_add_texture(struct cranny_scene *scene,
                                            const struct cranny_alpha_texture *texture,
                                            uint32_t *index, struct cranny_error *why)
{
    if (!texture->width || !texture->height)
        return fail(why, CRANNY_USAGE, "texture: %u x %u texels", texture->width, texture->height);
    size_t size = (size_t)texture->width * texture->height;
    uint8_t *alpha = alloc_array(size, 1);
    if (!alpha || !grow_array((void **)&scene->textures, &scene->texture_capacity,
                              scene->texture_count + 1, sizeof *scene->textures)) {
        free(alpha);
        return fail_memory(why, "texture");
    }
    memcpy(alpha, texture->alpha, size);
    struct cranny_alpha_texture *copy = &scene->textures[scene->texture_count];
    *copy = *texture;
    copy->alpha = alpha;
    if (index)
        *index = (uint32_t)scene->texture_count;
    scene->texture_count++;
    return CRANNY_OK;
}

static void *copy_array(const void *source, size_t count, size_t size)
{
    void *copy = alloc_array(count, size);
    if (copy && count)
        memcpy(copy, source, count * size);
    return copy;
}

static bool all_finite(const float *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

static enum cranny_status check_mesh(const struct cranny_scene *scene,
                                     const struct cranny_mesh *mesh, struct cranny_error *why)
{
    const size_t vertices = mesh->vertex_count;
    if (!all_finite(&mesh->positions[0][0], vertices * 3) ||
        (mesh->normals && !all_finite(&mesh->normals[0][0], vertices * 3)) ||
        (mesh->texcoords && !all_finite(&mesh->texcoords[0][0], vertices * 2)))
        return fail(why, CRANNY_USAGE, "mesh '%s': a vertex holds a NaN or an infinity",
                    mesh->name ? mesh->name : "");
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        for (int c = 0; c < 3; c++)
            if (mesh->triangles[t][c] >= vertices)
                return fail(why, CRANNY_USAGE, "mesh '%s': triangle %u names vertex %u of %zu",
                            mesh->name ? mesh->name : "", t, mesh->triangles[t][c], vertices);
        if (mesh->triangle_materials && mesh->triangle_materials[t] >= scene->material_count)
            return fail(why, CRANNY_USAGE, "mesh '%s': triangle %u names material %u of %zu",
                        mesh->name ? mesh->name : "", t, mesh->triangle_materials[t],
                        scene->material_count);
    }
    return CRANNY_OK;
}

enum cranny_status scene_take_mesh(struct cranny_scene *scene, const struct mesh *mesh,
                                   struct cranny_error *why)
{
    if (!grow_array((void **)&scene->meshes, &scene->mesh_capacity, scene->mesh_count + 1,
                    sizeof *scene->meshes))
        return fail_memory(why, "mesh");
    struct mesh *taken = &scene->meshes[scene->mesh_count++];
    *taken = *mesh;
    for (uint32_t v = 0; v < mesh->view.vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            const float p = mesh->view.positions[v][k];
            taken->bounds[0][k] = v ? fminf(taken->bounds[0][k], p) : p;
            taken->bounds[1][k] = v ? fmaxf(taken->bounds[1][k], p) : p;
        }
    return CRANNY_OK;
}

enum cranny_status cranny_scene_add_mesh(struct cranny_scene *scene, const struct cranny_mesh *mesh,
                                         uint32_t *index, struct cranny_error *why)
{
    enum cranny_status status = check_mesh(scene, mesh, why);
    if (status == CRANNY_OK && !mesh->triangle_materials && scene->material_count == 0) {
        struct cranny_material material = cranny_material_default();
        status = cranny_scene_add_material(scene, &material, NULL, why);
    }
    if (status != CRANNY_OK)
        return status;
    const size_t vertices = mesh->vertex_count, triangles = mesh->triangle_count;
    struct mesh copy = {.source_mesh = -1};
    copy.view = *mesh;
    copy.view.name = copy_text(mesh->name);
    copy.view.positions = copy_array(mesh->positions, vertices, sizeof *mesh->positions);
    copy.view.normals = mesh->normals ? copy_array(mesh->normals, vertices, 12) : NULL;
    copy.view.texcoords = mesh->texcoords ? copy_array(mesh->texcoords, vertices, 8) : NULL;
    copy.view.triangles = copy_array(mesh->triangles, triangles, 12);
    copy.view.triangle_materials = mesh->triangle_materials
                                       ? copy_array(mesh->triangle_materials, triangles, 4)
                                       : alloc_array(triangles, 4);
    bool complete = copy.view.name && copy.view.positions && copy.view.triangles &&
                    copy.view.triangle_materials && (!mesh->normals || copy.view.normals) &&
                    (!mesh->texcoords || copy.view.texcoords);
    status = complete ? scene_take_mesh(scene, &copy, why) : fail_memory(why, "mesh");
    if (status != CRANNY_OK)
        mesh_free(&copy);
    else if (index)
        *index = (uint32_t)scene->mesh_count - 1;
    return status;
}

enum cranny_status cranny_scene_add_instance(struct cranny_scene *scene,
                                             const struct cranny_instance *instance,
                                             uint32_t *index, struct cranny_error *why)
{
    if (instance->mesh >= scene->mesh_count)
        return fail(why, CRANNY_USAGE, "instance: mesh %u; the scene has %zu", instance->mesh,
                    scene->mesh_count);
    for (int i = 0; i < 12; i++)
        if (!isfinite(instance->world_from_object[i]))
            return fail(why, CRANNY_USAGE, "instance: its transform holds a NaN or an infinity");
    if ((unsigned)instance->role > CRANNY_ROLE_IGNORED)
        return fail(why, CRANNY_USAGE, "instance: role %d does not exist", (int)instance->role);
    if (instance->lod && !instance->lod_group)
        return fail(why, CRANNY_USAGE,
                    "instance: lod %u without a lod_group; give its finest level one too",
                    instance->lod);
    if (!grow_array((void **)&scene->instances, &scene->instance_capacity,
                    scene->instance_count + 1, sizeof *scene->instances))
        return fail_memory(why, "instance");
    struct instance *copy = &scene->instances[scene->instance_count];
    *copy = (struct instance){.view = *instance, .source_node = -1, .source_index = -1};
    copy->view.name = copy_text(instance->name);
    if (!copy->view.name)
        return fail_memory(why, "instance");
    if (index)
        *index = (uint32_t)scene->instance_count;
    scene->instance_count++;
    return CRANNY_OK;
}

struct cranny_scene_load_params cranny_scene_load_params_default(void)
{
    return (struct cranny_scene_load_params){.scene = -1, .memory_limit_bytes = 16ull << 30};
}

struct cranny_save_params cranny_save_params_default(void)
{
    return (struct cranny_save_params){.to = CRANNY_OUTPUT_OCCLUSION};
}
