/* A scene's polygons, in world space. */
#include "volumes/volumes.h"

#include "base/vector.h"
#include "scene/scene.h"

struct maker {
    const struct cranny_scene *scene;
    struct cranny_volumes *volumes;
    struct volume_polygon *polygons;
    size_t count, capacity;
    int threads;
};

/* False for a face without area, or not finite. */
static bool has_area(const double corners[4][3])
{
    double d[2][3], n[3];
    for (int k = 0; k < 3; k++) {
        d[0][k] = corners[2][k] - corners[0][k];
        d[1][k] = corners[3][k] - corners[1][k];
    }
    if (!normalise3(d[0]) || !normalise3(d[1]))
        return false;
    cross3(d[0], d[1], n);
    return dot3(n, n) > 1e-14;
}

/* One face of one instance; a mirrored one winds the other way round. */
static bool place_face(const struct maker *m, const struct cranny_mesh *mesh,
                       const struct volume_face *face, const double *world, bool mirrored,
                       struct volume_polygon *polygon)
{
    const bool quad = face->triangles[1] != FACE_NONE;
    double corners[4][3];
    for (int i = 0; i < 4; i++) {
        const int from = !mirrored || i == 0 ? i : quad ? 4 - i : 3 - i;
        transform_point(world, mesh->positions[face->corner[from]], corners[i]);
        for (int k = 0; k < 3; k++) {
            polygon->corner[i][k] = (float)(corners[i][k] - m->volumes->centre[k]);
            if (!isfinite(polygon->corner[i][k]))
                return false;
        }
    }
    polygon->flags = quad ? POLYGON_QUAD : 0;
    return has_area((const double(*)[3])corners);
}

static float face_alpha(const struct maker *m, const struct cranny_mesh *mesh,
                        const struct volume_face *face)
{
    const float first = mean_alpha(m->scene, mesh, face->triangles[0]);
    if (face->triangles[1] == FACE_NONE)
        return first;
    return 0.5f * (first + mean_alpha(m->scene, mesh, face->triangles[1]));
}

static void find_alphas(const struct maker *m, const struct cranny_mesh *mesh,
                        const struct volume_face *faces, uint32_t count, float *alphas)
{
#pragma omp parallel for schedule(dynamic, 1024)                                                   \
    num_threads(m->threads) if (count >= PARALLEL_LEAST)
    for (uint32_t f = 0; f < count; f++)
        alphas[f] = face_alpha(m, mesh, &faces[f]);
}

/* Of the polygons placed behind the others, those with an alpha. */
static void keep_placed(struct maker *m, const struct volume_face *faces, uint32_t count)
{
    const struct volume_polygon *placed = m->polygons + m->count;
    for (uint32_t f = 0; f < count; f++) {
        const bool quad = faces[f].triangles[1] != FACE_NONE;
        if (!(placed[f].alpha > 0)) {
            m->volumes->info.dropped += 1 + (uint64_t)quad;
            continue;
        }
        m->polygons[m->count++] = placed[f];
        m->volumes->info.quads += quad;
    }
}

static enum cranny_status add_instance(struct maker *m, const struct cranny_instance *instance,
                                       const struct volume_face *faces, const float *alphas,
                                       uint32_t count, struct cranny_error *why)
{
    const struct cranny_mesh *mesh = cranny_scene_mesh(m->scene, instance->mesh);
    const double *world = instance->world_from_object;
    const bool mirrored = transform_determinant(world) < 0;
    void *items = m->polygons;
    const bool grown = grow_array(&items, &m->capacity, m->count + count, sizeof *m->polygons);
    m->polygons = items;
    if (!grown || m->count + count > UINT32_MAX / 2)
        return fail_memory(why, "volumes");
    struct volume_polygon *placed = m->polygons + m->count;
#pragma omp parallel for num_threads(m->threads) if (count >= PARALLEL_LEAST)
    for (uint32_t f = 0; f < count; f++) {
        const bool kept =
            alphas[f] > 0 && place_face(m, mesh, &faces[f], world, mirrored, &placed[f]);
        const uint32_t material = mesh->triangle_materials[faces[f].triangles[0]];
        placed[f].alpha = kept ? alphas[f] : 0;
        if (!faces[f].closed && cranny_scene_material(m->scene, material)->double_sided)
            placed[f].flags |= POLYGON_DOUBLE_SIDED;
    }
    keep_placed(m, faces, count);
    return CRANNY_OK;
}

/* All instances of a mesh, whose faces are found once. */
static enum cranny_status add_mesh(struct maker *m, uint32_t mesh_index, bool quads,
                                   struct cranny_error *why)
{
    const struct cranny_mesh *mesh = cranny_scene_mesh(m->scene, mesh_index);
    struct volume_face *faces = NULL;
    float *alphas = NULL;
    uint32_t count = 0;
    enum cranny_status status = CRANNY_OK;
    for (uint32_t i = 0; i < cranny_scene_instance_count(m->scene) && status == CRANNY_OK; i++) {
        const struct cranny_instance *instance = cranny_scene_instance(m->scene, i);
        if (instance->mesh != mesh_index || !cranny_instance_exists(instance))
            continue;
        if (!faces) {
            status = faces_find(mesh, quads, m->threads, &faces, &count, why);
            alphas = alloc_array(count, sizeof *alphas);
            if (status == CRANNY_OK && !alphas)
                status = fail_memory(why, "volumes");
            find_alphas(m, mesh, faces, status == CRANNY_OK ? count : 0, alphas);
        }
        if (status == CRANNY_OK)
            status = add_instance(m, instance, faces, alphas, count, why);
    }
    free(faces);
    free(alphas);
    return status;
}

static void find_centre(struct maker *m)
{
    double bounds[6], half = 0;
    cranny_scene_bounds(m->scene, bounds);
    for (int k = 0; k < 3; k++) {
        m->volumes->centre[k] = 0.5 * bounds[k] + 0.5 * bounds[k + 3];
        half = fmax(half, 0.5 * bounds[k + 3] - 0.5 * bounds[k]);
    }
    m->volumes->half_size = (float)fmin(half, 1e30);
}

static enum cranny_status make(struct maker *m, const struct cranny_volumes_params *params,
                               struct cranny_error *why)
{
    const uint32_t meshes = cranny_scene_mesh_count(m->scene);
    enum cranny_status status = CRANNY_OK;
    find_centre(m);
    for (uint32_t i = 0; i < meshes && status == CRANNY_OK; i++) {
        if (!hook_progress(params->hooks, "volumes", i, meshes + 1.0))
            status = fail(why, CRANNY_CANCELLED, "cancelled");
        else if (cranny_scene_mesh(m->scene, i)->triangle_count > 0)
            status = add_mesh(m, i, params->quads, why);
    }
    if (status == CRANNY_OK && !hook_progress(params->hooks, "volumes", meshes, meshes + 1.0))
        status = fail(why, CRANNY_CANCELLED, "cancelled");
    m->volumes->polygon_count = (uint32_t)m->count;
    struct volume_polygon *polygons = m->polygons;
    m->polygons = NULL;
    if (status == CRANNY_OK)
        return tree_build(m->volumes, polygons, m->threads, why);
    free(polygons);
    return status;
}

enum cranny_status cranny_volumes_create(const struct cranny_scene *scene,
                                         const struct cranny_volumes_params *params,
                                         struct cranny_volumes **volumes, struct cranny_error *why)
{
    const struct cranny_volumes_params defaults = cranny_volumes_params_preset(NULL);
    const double begin = seconds_now();
    *volumes = NULL;
    params = params ? params : &defaults;
    if (!scene)
        return fail(why, CRANNY_USAGE, "volumes: a scene is needed");
    enum cranny_status status = cranny_params_validate(cranny_volumes_param_table(), params, why);
    if (status != CRANNY_OK)
        return status;
    struct maker maker = {.scene = scene,
                          .volumes = alloc_array(1, sizeof **volumes),
                          .threads = thread_count(params->threads)};
    if (!maker.volumes)
        return fail_memory(why, "volumes");
    status = make(&maker, params, why);
    struct cranny_volumes *made = maker.volumes;
    made->info.triangles = cranny_scene_triangle_count(scene);
    made->info.polygons = made->polygon_count;
    made->info.size_bytes = sizeof *made + made->polygon_count * sizeof *made->polygons +
                            made->node_count * sizeof *made->nodes;
    made->info.seconds = seconds_now() - begin;
    if (status != CRANNY_OK)
        cranny_volumes_destroy(&made);
    *volumes = made;
    return status;
}

void cranny_volumes_destroy(struct cranny_volumes **volumes)
{
    if (!volumes || !*volumes)
        return;
    free((*volumes)->polygons);
    free((*volumes)->nodes);
    free(*volumes);
    *volumes = NULL;
}

struct cranny_volumes_info cranny_volumes_info(const struct cranny_volumes *volumes)
{
    return volumes->info;
}
