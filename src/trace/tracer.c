/* Building the acceleration structure. Meshes that several instances share get an Embree scene of
 * their own; small or single ones are flattened into the world. */
#include "trace/build.h"

#include "scene/scene.h"

static void on_error(void *user, enum RTCError error, const char *text)
{
    struct build *build = user;
    if (atomic_flag_test_and_set(&build->failed))
        return;
    build->error = error;
    snprintf(build->text, sizeof build->text, "%s", text ? text : "");
}

static bool on_memory(void *user, ssize_t bytes, bool post)
{
    (void)post;
    struct cranny_tracer *tracer = user;
    atomic_fetch_add(&tracer->bytes, (long long)bytes);
    return true;
}

/* Embree calls this from its workers too; the caller's hook must not be. */
static bool on_progress(void *user, double part)
{
    struct build *build = user;
    const double done = build->done + part * build->weight;
    if (pthread_equal(pthread_self(), build->caller) && done > build->reported) {
        build->reported = done;
        if (!hook_progress(build->hooks, "bvh", fmin(done, build->total), build->total))
            atomic_store(&build->cancelled, true);
    }
    return !atomic_load(&build->cancelled);
}

enum cranny_status build_status(struct build *build, struct cranny_error *why)
{
    if (atomic_load(&build->cancelled))
        return fail(why, CRANNY_CANCELLED, "acceleration structure: cancelled");
    switch (build->error) {
    case RTC_ERROR_NONE:
        return CRANNY_OK;
    case RTC_ERROR_OUT_OF_MEMORY:
        return fail(why, CRANNY_MEMORY,
                    "acceleration structure: out of memory; use a smaller scene");
    default:
        return fail(why, CRANNY_FAILED, "acceleration structure: Embree: %s", build->text);
    }
}

/* Sort a mesh's triangles into classes, and note whether its materials have backs. */
static enum cranny_status classify(struct build *build, uint32_t index, struct cranny_error *why)
{
    const struct cranny_scene *scene = build->tracer->scene;
    const struct cranny_mesh *mesh = cranny_scene_mesh(scene, index);
    struct tracer_mesh *target = &build->tracer->meshes[index];
    uint32_t double_sided = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const enum triangle_class class = alpha_class(scene, mesh, t);
        if (class < TRIANGLE_CLASSES)
            target->counts[class]++;
        double_sided += cranny_scene_material(scene, mesh->triangle_materials[t])->double_sided;
    }
    target->sides = double_sided == 0                      ? SIDES_SINGLE
                    : double_sided == mesh->triangle_count ? SIDES_DOUBLE
                                                           : SIDES_MIXED;
    uint32_t used[TRIANGLE_CLASSES] = {0};
    for (int class = 0; class < TRIANGLE_CLASSES; class ++) {
        if (!target->counts[class] || target->counts[class] == mesh->triangle_count)
            continue;
        target->triangles[class] = alloc_array(target->counts[class], sizeof(uint32_t));
        if (!target->triangles[class])
            return fail_memory(why, "acceleration structure");
    }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const enum triangle_class class = alpha_class(scene, mesh, t);
        if (class < TRIANGLE_CLASSES && target->triangles[class])
            target->triangles[class][used[class]++] = t;
    }
    return CRANNY_OK;
}

/* The mesh's vertices as Embree wants them: floats, and 16 readable bytes at the last one. */
static RTCBuffer new_vertices(struct build *build, const struct cranny_mesh *mesh,
                              const double *world_from_object)
{
    const size_t count = mesh->vertex_count;
    RTCBuffer buffer = rtcNewBuffer(build->tracer->device, count * 3 * sizeof(float) + 16);
    float(*vertices)[3] = buffer ? rtcGetBufferData(buffer) : NULL;
    if (!vertices)
        return buffer;
    if (!world_from_object) {
        memcpy(vertices, mesh->positions, count * sizeof *vertices);
        return buffer;
    }
#pragma omp parallel for num_threads(build->threads) if (count > 20000)
    for (size_t i = 0; i < count; i++) {
        double p[3];
        transform_point(world_from_object, mesh->positions[i], p);
        for (int k = 0; k < 3; k++)
            vertices[i][k] = (float)p[k];
    }
    return buffer;
}

/* One class of a mesh's triangles into an Embree scene. */
static void add_triangles(struct build *build, RTCScene scene, uint32_t mesh_index,
                          enum triangle_class class, RTCBuffer vertices, bool mirrored, uint32_t id)
{
    const struct cranny_mesh *mesh = cranny_scene_mesh(build->tracer->scene, mesh_index);
    const struct tracer_mesh *source = &build->tracer->meshes[mesh_index];
    const uint32_t count = source->counts[class];
    RTCGeometry geometry = rtcNewGeometry(build->tracer->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!geometry)
        return;
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices, 0,
                         3 * sizeof(float), mesh->vertex_count);
    uint32_t(*indices)[3] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                    RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), count);
    for (uint32_t i = 0; indices && i < count; i++) {
        const uint32_t *corners =
            mesh->triangles[source->triangles[class] ? source->triangles[class][i] : i];
        indices[i][0] = corners[0];
        indices[i][1] = corners[mirrored ? 2 : 1];
        indices[i][2] = corners[mirrored ? 1 : 2];
    }
    rtcSetGeometryUserData(geometry, build->tracer);
    if (class == TRIANGLE_FILTERED) {
        rtcSetGeometryIntersectFilterFunction(geometry, alpha_filter);
        rtcSetGeometryOccludedFilterFunction(geometry, alpha_filter);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
}

void build_add_mesh(struct build *build, RTCScene scene, uint32_t mesh_index,
                    const double *world_from_object, bool mirrored, uint32_t first_id)
{
    const struct tracer_mesh *source = &build->tracer->meshes[mesh_index];
    if (!source->counts[TRIANGLE_SOLID] && !source->counts[TRIANGLE_FILTERED])
        return;
    RTCBuffer vertices =
        new_vertices(build, cranny_scene_mesh(build->tracer->scene, mesh_index), world_from_object);
    if (!vertices)
        return;
    for (int class = 0; class < TRIANGLE_CLASSES; class ++)
        if (source->counts[class])
            add_triangles(build, scene, mesh_index, class, vertices, mirrored,
                          first_id + (uint32_t) class);
    rtcReleaseBuffer(vertices);
}

static RTCScene new_scene(struct build *build, bool trees)
{
    RTCScene scene = rtcNewScene(build->tracer->device);
    if (!scene)
        return NULL;
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    if (trees)
        rtcSetSceneFlags(scene, EMBREE_SCENE_FILTERED);
    rtcSetSceneProgressMonitorFunction(scene, on_progress, build);
    return scene;
}

static void commit(struct build *build, RTCScene scene, double weight)
{
    build->weight = weight;
    rtcCommitScene(scene);
    rtcSetSceneProgressMonitorFunction(scene, NULL, NULL);
    build->done += weight;
}

static void add_instance(struct build *build, RTCScene scene, uint32_t index)
{
    struct cranny_tracer *tracer = build->tracer;
    const struct cranny_instance *instance = cranny_scene_instance(tracer->scene, index);
    const double *m = instance->world_from_object;
    RTCGeometry geometry = rtcNewGeometry(tracer->device, RTC_GEOMETRY_TYPE_INSTANCE);
    if (!geometry)
        return;
    float columns[12];
    for (int column = 0; column < 4; column++)
        for (int row = 0; row < 3; row++)
            columns[3 * column + row] = (float)m[4 * row + column];
    rtcSetGeometryInstancedScene(geometry, tracer->meshes[instance->mesh].scene);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, 2 * index);
    rtcReleaseGeometry(geometry);
}

/* Roles that are nothing to rays, or dim nothing as the parameters have it, are absent. */
static enum tracer_kind instance_kind(const struct build *build,
                                      const struct cranny_instance *instance)
{
    if (!cranny_instance_exists(instance))
        return KIND_ABSENT;
    if (!build->params->roles)
        return KIND_SOLID;
    switch (instance->role) {
    case CRANNY_ROLE_SOLID:
        return KIND_SOLID;
    case CRANNY_ROLE_TREE:
        return build->params->tree_opacity > 0 ? KIND_TREE : KIND_ABSENT;
    case CRANNY_ROLE_SHRUB:
        return build->params->fog_density > 0 ? KIND_FOG : KIND_ABSENT;
    case CRANNY_ROLE_GRASS:
    case CRANNY_ROLE_IGNORED:
        return KIND_ABSENT;
    }
    return KIND_ABSENT;
}

static bool has_triangles(enum tracer_kind kind)
{
    return kind == KIND_SOLID || kind == KIND_TREE;
}

static void plan_instance(struct build *build, uint32_t index, uint32_t uses)
{
    struct cranny_tracer *tracer = build->tracer;
    const struct cranny_instance *instance = cranny_scene_instance(tracer->scene, index);
    struct tracer_instance *target = &tracer->instances[index];
    double inverse[9];
    const bool regular = transform_inverse3(instance->world_from_object, inverse);
    const uint32_t triangles = cranny_scene_mesh(tracer->scene, instance->mesh)->triangle_count;
    target->shared = regular && uses > 1 && triangles >= SHARED_TRIANGLES_MIN;
    target->mirrored = !target->shared && transform_determinant(instance->world_from_object) < 0;
    for (int k = 0; k < 9; k++)
        target->object_from_world[k] = (float)inverse[k];
    build->total += target->shared ? 1 : triangles;
}

/* Decide per instance between sharing and flattening; count what will be built. */
static enum cranny_status plan_instances(struct build *build, struct cranny_error *why)
{
    struct cranny_tracer *tracer = build->tracer;
    const uint32_t instance_count = cranny_scene_instance_count(tracer->scene);
    uint32_t *uses = alloc_array(cranny_scene_mesh_count(tracer->scene), sizeof *uses);
    if (!uses)
        return fail_memory(why, "acceleration structure");
    for (uint32_t i = 0; i < instance_count; i++) {
        const struct cranny_instance *instance = cranny_scene_instance(tracer->scene, i);
        const enum tracer_kind kind = instance_kind(build, instance);
        tracer->instances[i].kind = kind;
        uses[instance->mesh] += has_triangles(kind);
        tracer->meshes[instance->mesh].used |= kind != KIND_ABSENT;
        tracer->meshes[instance->mesh].tree |= kind == KIND_TREE;
        tracer->built.solids += kind == KIND_SOLID;
        tracer->built.trees += kind == KIND_TREE;
    }
    for (uint32_t i = 0; i < instance_count; i++)
        if (has_triangles(tracer->instances[i].kind))
            plan_instance(build, i, uses[cranny_scene_instance(tracer->scene, i)->mesh]);
    free(uses);
    return CRANNY_OK;
}

/* The shared meshes' own scenes, before the world that points to them. */
static enum cranny_status build_shared(struct build *build, struct cranny_error *why)
{
    struct cranny_tracer *tracer = build->tracer;
    const uint32_t count = cranny_scene_instance_count(tracer->scene);
    enum cranny_status status = CRANNY_OK;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t mesh = cranny_scene_instance(tracer->scene, i)->mesh;
        if (!tracer->instances[i].shared || tracer->meshes[mesh].scene)
            continue; /* neither absent instances nor fog are shared */
        tracer->meshes[mesh].scene = new_scene(build, tracer->meshes[mesh].tree);
        if (!tracer->meshes[mesh].scene)
            break;
        build->total += cranny_scene_mesh(tracer->scene, mesh)->triangle_count;
    }
    const uint32_t mesh_count = cranny_scene_mesh_count(tracer->scene);
    for (uint32_t m = 0; m < mesh_count && status == CRANNY_OK; m++) {
        if (!tracer->meshes[m].scene)
            continue;
        const uint64_t before = cranny_tracer_bytes(tracer);
        build_add_mesh(build, tracer->meshes[m].scene, m, NULL, false, 0);
        commit(build, tracer->meshes[m].scene, cranny_scene_mesh(tracer->scene, m)->triangle_count);
        if (tracer->meshes[m].tree)
            tracer->built.tree_bytes += cranny_tracer_bytes(tracer) - before;
        status = build_status(build, why);
    }
    return status;
}

/* All instances of one kind into a scene. */
static enum cranny_status build_kind(struct build *build, enum tracer_kind kind, RTCScene *scene,
                                     struct cranny_error *why)
{
    struct cranny_tracer *tracer = build->tracer;
    const uint32_t count = cranny_scene_instance_count(tracer->scene);
    double weight = 0;
    *scene = new_scene(build, kind == KIND_TREE);
    for (uint32_t i = 0; i < count && *scene; i++) {
        const struct cranny_instance *instance = cranny_scene_instance(tracer->scene, i);
        if (tracer->instances[i].kind != kind)
            continue;
        if (tracer->instances[i].shared) {
            add_instance(build, *scene, i);
            weight += 1;
        } else {
            build_add_mesh(build, *scene, instance->mesh, instance->world_from_object,
                           tracer->instances[i].mirrored, 2 * i);
            weight += cranny_scene_mesh(tracer->scene, instance->mesh)->triangle_count;
        }
        if (i % 64 == 0 && build_status(build, why) != CRANNY_OK)
            return build_status(build, why);
    }
    if (*scene)
        commit(build, *scene, weight);
    return build_status(build, why);
}

static enum cranny_status build_trees(struct build *build, struct cranny_error *why)
{
    struct cranny_tracer *tracer = build->tracer;
    const uint64_t before = cranny_tracer_bytes(tracer);
    const enum cranny_status status = build_kind(build, KIND_TREE, &tracer->trees, why);
    tracer->built.tree_bytes += cranny_tracer_bytes(tracer) - before;
    return status;
}

static enum cranny_status build_all(struct build *build, struct cranny_error *why)
{
    struct cranny_tracer *tracer = build->tracer;
    const uint32_t mesh_count = cranny_scene_mesh_count(tracer->scene);
    const uint32_t instance_count = cranny_scene_instance_count(tracer->scene);
    if (instance_count > UINT32_MAX / 2 - 1)
        return fail(why, CRANNY_MEMORY, "acceleration structure: %u instances; at most %u fit",
                    instance_count, UINT32_MAX / 2 - 1);
    tracer->meshes = alloc_array(mesh_count, sizeof *tracer->meshes);
    tracer->instances = alloc_array(instance_count, sizeof *tracer->instances);
    if (!tracer->meshes || !tracer->instances)
        return fail_memory(why, "acceleration structure");
    enum cranny_status status = plan_instances(build, why);
    for (uint32_t m = 0; m < mesh_count && status == CRANNY_OK; m++)
        if (tracer->meshes[m].used)
            status = classify(build, m, why);
    if (status == CRANNY_OK)
        status = build_shared(build, why);
    if (status == CRANNY_OK)
        status = build_kind(build, KIND_SOLID, &tracer->world, why);
    if (status == CRANNY_OK && tracer->built.trees)
        status = build_trees(build, why);
    if (status == CRANNY_OK)
        status = build_fog(build, why);
    return status;
}

static enum cranny_status open_device(struct build *build, struct cranny_error *why)
{
    char config[64];
    snprintf(config, sizeof config, "threads=%d", build->threads);
    struct cranny_tracer *tracer = build->tracer;
    tracer->device = rtcNewDevice(config);
    if (!tracer->device)
        return fail(why, CRANNY_FAILED,
                    "Embree does not start (error %d); is this processor older than SSE2?",
                    (int)rtcGetDeviceError(NULL));
    rtcSetDeviceErrorFunction(tracer->device, on_error, build);
    rtcSetDeviceMemoryMonitorFunction(tracer->device, on_memory, tracer);
    return CRANNY_OK;
}

static void set_params(struct cranny_tracer *tracer, const struct cranny_tracer_params *params)
{
    tracer->dimming = params->dimming;
    tracer->tree_opacity = params->tree_opacity;
    tracer->ground = params->ground;
    tracer->ground_height = params->ground_height;
    if (!params->ground || !isnan(params->ground_height))
        return;
    double bounds[6];
    cranny_scene_bounds(tracer->scene, bounds);
    tracer->ground_height = (float)bounds[1];
}

struct cranny_tracer_params cranny_tracer_params_default(void)
{
    return (struct cranny_tracer_params){.ground_height = NAN,
                                         .dimming = CRANNY_DIMMING_KERNEL,
                                         .tree_opacity = 0.5f,
                                         .fog_density = 1};
}

static enum cranny_status check_params(const struct cranny_tracer_params *params,
                                       struct cranny_error *why)
{
    if (params->threads < 0 || isinf(params->ground_height))
        return fail(why, CRANNY_USAGE,
                    "tracer: threads must be 0 or more, ground_height finite or NaN");
    if ((unsigned)params->dimming > CRANNY_DIMMING_PLAIN || !(params->tree_opacity >= 0) ||
        !(params->tree_opacity <= 1))
        return fail(why, CRANNY_USAGE,
                    "tracer: tree_opacity is %g; it must lie in [0, 1], and "
                    "dimming be one of enum cranny_dimming",
                    (double)params->tree_opacity);
    if (!(params->fog_density >= 0) || !isfinite(params->fog_density))
        return fail(why, CRANNY_USAGE, "tracer: fog_density is %g; it must be 0 or more and finite",
                    (double)params->fog_density);
    return CRANNY_OK;
}

enum cranny_status cranny_tracer_create(const struct cranny_scene *scene,
                                        const struct cranny_tracer_params *params,
                                        struct cranny_tracer **tracer, struct cranny_error *why)
{
    const struct cranny_tracer_params defaults = cranny_tracer_params_default();
    params = params ? params : &defaults;
    *tracer = NULL;
    enum cranny_status status = check_params(params, why);
    if (status != CRANNY_OK)
        return status;
    const double start = seconds_now();
    struct cranny_tracer *made = alloc_array(1, sizeof *made);
    if (!made)
        return fail_memory(why, "acceleration structure");
    made->scene = scene;
    set_params(made, params);
    struct build build = {.tracer = made,
                          .params = params,
                          .hooks = params->hooks,
                          .threads = thread_count(params->threads),
                          .caller = pthread_self(),
                          .failed = ATOMIC_FLAG_INIT};
    status = open_device(&build, why);
    if (status == CRANNY_OK)
        status = build_all(&build, why);
    if (made->device)
        rtcSetDeviceErrorFunction(made->device, NULL, NULL);
    made->built.seconds = seconds_now() - start;
    if (status != CRANNY_OK)
        cranny_tracer_destroy(&made);
    *tracer = made;
    return status;
}

static void release_scene(RTCScene scene)
{
    if (scene)
        rtcReleaseScene(scene);
}

void cranny_tracer_destroy(struct cranny_tracer **tracer)
{
    if (!tracer || !*tracer)
        return;
    struct cranny_tracer *t = *tracer;
    release_scene(t->world);
    release_scene(t->trees);
    release_scene(t->fog);
    const uint32_t mesh_count = t->meshes ? cranny_scene_mesh_count(t->scene) : 0;
    for (uint32_t m = 0; m < mesh_count; m++) {
        release_scene(t->meshes[m].scene);
        for (int class = 0; class < TRIANGLE_CLASSES; class ++)
            free(t->meshes[m].triangles[class]);
    }
    if (t->device)
        rtcReleaseDevice(t->device);
    free(t->meshes);
    free(t->instances);
    free(t->boxes);
    free(t);
    *tracer = NULL;
}

uint64_t cranny_tracer_bytes(const struct cranny_tracer *tracer)
{
    const long long bytes = atomic_load(&tracer->bytes);
    return bytes > 0 ? (uint64_t)bytes : 0;
}

void cranny_tracer_get_info(const struct cranny_tracer *tracer, struct cranny_tracer_info *info)
{
    *info = tracer->built;
    info->bytes = cranny_tracer_bytes(tracer);
}
