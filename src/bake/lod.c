/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2.1. */
#include "bake/lod.h"

#include "bake/pass.h"
#include "bake/resample.h"
#include "base/hash.h"

/* Samples are not noisy here, and a coarse face has much to take over. */
#define SAMPLES_WORTH 4.0f
#define RAYS 8
/* The sphere's radius starts at this share of an instance's diagonal and is doubled where it finds
 * nothing, up to 1/6 of the diagonal. */
#define RADIUS_SHARE 0.005
#define DOUBLINGS 5

struct transfer {
    struct resampler resampler; /* group aside */
    const struct cranny_scene *scene;
    double *radius; /* per instance */
    bool *found;    /* per target: its values are in the cache; NULL: no cache */
    size_t found_count;
};

/* For the cache: what a level's values follow from. */
struct inputs {
    const struct cranny_bake *bake;
    uint64_t *looks;    /* per mesh */
    uint64_t *values;   /* per set */
    uint32_t *finest;   /* instances of finest levels, which the rays meet */
    double (*boxes)[6]; /* of these */
    size_t finest_count;
    bool blended; /* rays throw dice, into which an instance's number goes */
};

static bool transfer_point(const struct transfer *transfer, uint32_t instance,
                           const float position[3], const float normal[3], uint32_t id,
                           float raw[2])
{
    struct resampler resampler = transfer->resampler;
    const double center[3] = {(double)position[0], (double)position[1], (double)position[2]};
    const double facing[3] = {(double)normal[0], (double)normal[1], (double)normal[2]};
    double values[CHANNELS];
    resampler.lod_group = transfer->scene->instances[instance].view.lod_group;
    const bool found = resample_widening(&resampler, center, facing, transfer->radius[instance],
                                         DOUBLINGS, id, RAYS, values);
    raw[0] = (float)values[CRANNY_CHANNEL_LONG];
    raw[1] = (float)values[CRANNY_CHANNEL_SHORT];
    return found;
}

static void transfer_source(void *user, const struct gather_point *points,
                            const uint32_t *instances, size_t count, struct gather_result *results)
{
    for (size_t i = 0; i < count; i++) {
        results[i].rays = 1;
        results[i].back_faces =
            !transfer_point(user, instances[i], points[i].position, points[i].face_normal,
                            points[i].id, results[i].visibility);
    }
}

/* The scene with nothing but the finest levels of groups that have lower ones. */
static struct instance *keep_finest(const struct cranny_scene *scene)
{
    struct instance *kept = alloc_array(scene->instance_count, sizeof *kept);
    for (size_t i = 0; kept && i < scene->instance_count; i++) {
        kept[i] = scene->instances[i];
        if (!kept[i].view.lod_group || kept[i].view.lod)
            kept[i].view.role = CRANNY_ROLE_IGNORED;
    }
    return kept;
}

static enum cranny_status transfer_begin(struct transfer *transfer, struct cranny_bake *bake,
                                         const struct cranny_scene *scene, struct cranny_error *why)
{
    *transfer = (struct transfer){.scene = scene, .resampler = {.bake = bake, .scene = scene}};
    transfer->radius = alloc_array(scene->instance_count, sizeof *transfer->radius);
    if (!transfer->radius)
        return fail_memory(why, "levels of detail");
    for (size_t i = 0; i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        double box[6], square = 0;
        instance_bounds(&scene->meshes[instance->mesh].view, instance->world_from_object, box);
        for (int k = 0; k < 3; k++)
            square += (box[3 + k] - box[k]) * (box[3 + k] - box[k]);
        transfer->radius[i] = RADIUS_SHARE * sqrt(square);
    }
    return CRANNY_OK;
}

static void inputs_free(struct inputs *inputs)
{
    free(inputs->looks);
    free(inputs->values);
    free(inputs->finest);
    free(inputs->boxes);
}

static void fill_inputs(const struct cranny_scene *scene, struct inputs *inputs)
{
    const struct cranny_bake *bake = inputs->bake;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        if (!cranny_instance_exists(instance) || !instance->lod_group)
            continue;
        instance_bounds(&scene->meshes[instance->mesh].view, instance->world_from_object,
                        inputs->boxes[inputs->finest_count]);
        inputs->finest[inputs->finest_count++] = i;
    }
    for (size_t i = 0; i < scene->material_count; i++)
        inputs->blended |= scene->materials[i].alpha_mode == CRANNY_ALPHA_BLEND;
#pragma omp parallel for schedule(dynamic, 4)
    for (size_t s = 0; s < bake->set_count; s++)
        inputs->values[s] = hash_bytes(HASH_BEGIN, bake->sets[s].values,
                                       bake->sets[s].vertex_count * CHANNELS * sizeof(float));
}

static enum cranny_status inputs_create(const struct cranny_bake *bake,
                                        const struct cranny_scene *scene, struct inputs *inputs,
                                        struct cranny_error *why)
{
    *inputs = (struct inputs){.bake = bake};
    inputs->looks = alloc_array(scene->mesh_count, sizeof *inputs->looks);
    inputs->values = alloc_array(bake->set_count, sizeof *inputs->values);
    inputs->finest = alloc_array(scene->instance_count, sizeof *inputs->finest);
    inputs->boxes = alloc_array(scene->instance_count, sizeof *inputs->boxes);
    if (!inputs->looks || !inputs->values || !inputs->finest || !inputs->boxes)
        return fail_memory(why, "levels of detail");
    fill_inputs(scene, inputs);
    return mesh_look_keys(scene, inputs->looks, why);
}

static uint64_t add_finest(const struct transfer *transfer, const struct inputs *inputs,
                           uint32_t index, uint32_t group, uint64_t key)
{
    const struct cranny_instance *instance = &transfer->scene->instances[index].view;
    const struct cranny_bake *bake = inputs->bake;
    const bool ours = instance->lod_group == group && bake->set_of[index] != SET_NONE;
    key = hash_word(key, inputs->looks[instance->mesh]);
    key = hash_bytes(key, instance->world_from_object, sizeof instance->world_from_object);
    key = hash_word(key, inputs->blended ? index : 0);
    if (ours)
        key = hash_word(key, inputs->values[bake->set_of[index]]);
    if (ours && bake->linear)
        key = hash_bytes(key, bake->linear[index], sizeof *bake->linear);
    return hash_word(key, ours);
}

static bool boxes_meet(const double a[6], const double b[6], double reach)
{
    for (int k = 0; k < 3; k++)
        if (a[k] > b[3 + k] + reach || a[3 + k] < b[k] - reach)
            return false;
    return true;
}

/* All finest levels that the rays around a level's surface may meet, and the values of its own. */
static uint64_t target_inputs(const struct pass *pass, const struct transfer *transfer,
                              const struct inputs *inputs, const struct target *target)
{
    uint64_t key = hash_word(target->key, target->instance_count);
    for (uint32_t i = 0; i < target->instance_count; i++) {
        const uint32_t index = pass->plan.order[target->instance_first + i];
        const struct cranny_instance *instance = &transfer->scene->instances[index].view;
        const double reach = 1.01 * transfer->radius[index] * (1 << DOUBLINGS);
        double box[6];
        instance_bounds(plan_mesh(&pass->plan, target), instance->world_from_object, box);
        key = hash_word(key, pass->plan.places[index]);
        for (size_t f = 0; f < inputs->finest_count; f++)
            if (boxes_meet(inputs->boxes[f], box, reach))
                key = add_finest(transfer, inputs, inputs->finest[f], instance->lod_group, key);
    }
    return key;
}

/* Look up which levels need no rays. */
static enum cranny_status find_levels(struct pass *pass, struct transfer *transfer,
                                      struct cranny_error *why)
{
    struct cache *cache = pass->bake->cache;
    struct inputs inputs;
    if (!cache || pass->params->lod_fit != CRANNY_LOD_LEAST_SQUARES)
        return CRANNY_OK;
    transfer->found = alloc_array(pass->plan.target_count, sizeof *transfer->found);
    if (!transfer->found)
        return fail_memory(why, "levels of detail");
    enum cranny_status status = inputs_create(pass->bake, pass->scene, &inputs, why);
    if (status == CRANNY_OK)
        status = pass_use_cache(pass, cache, why);
    for (size_t i = 0; status == CRANNY_OK && i < pass->plan.target_count; i++) {
        const struct target *target = &pass->plan.targets[i];
        if (target->area > 0)
            transfer->found[i] = pass_find(pass, i, target_inputs(pass, transfer, &inputs, target));
        transfer->found_count += transfer->found[i] || !(target->area > 0);
        if (transfer->found[i])
            pass->bake->report.lod_missed += pass->entries[i].found->report.invalid;
    }
    inputs_free(&inputs);
    return status;
}

/* Values at the vertices themselves, for comparison. */
static enum cranny_status fit_at_vertices(struct pass *pass, const struct transfer *transfer,
                                          size_t index, struct cranny_error *why)
{
    const struct target *target = &pass->plan.targets[index];
    const struct cranny_mesh *mesh = plan_mesh(&pass->plan, target);
    const uint32_t instance = pass->plan.order[target->instance_first];
    struct value_set *set = &pass->bake->sets[pass->first_set + index];
    float(*raw)[2] = alloc_array(mesh->vertex_count, sizeof *raw);
    struct surface surface = {0};
    enum cranny_status status =
        raw ? surface_create(mesh, target->metric, pass->threads, &surface, why)
            : fail_memory(why, "levels of detail");
    if (status != CRANNY_OK) {
        free(raw);
        return status;
    }
#pragma omp parallel num_threads(pass->threads)
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 64)
        for (uint32_t v = 0; v < mesh->vertex_count; v++) {
            struct gather_point point;
            raw[v][0] = raw[v][1] = 1;
            if (surface.unknown_of[v] != SURFACE_NONE &&
                fit_vertex_point(&pass->plan.frames[instance], mesh, &surface, v, &point))
                transfer_point(transfer, instance, point.position, point.normal, v, raw[v]);
        }
        gather_thread_end(saved);
    }
    surface_free(&surface);
    status = fit_measure(&pass->plan, &pass->samples, index, pass->params, (const float(*)[2])raw,
                         &set->fit, why);
    pass_spread(pass->params, (const float(*)[2])raw, mesh->vertex_count, set->values);
    free(raw);
    return status;
}

static enum cranny_status fit(struct pass *pass, const struct transfer *transfer,
                              struct cranny_error *why)
{
    if (pass->params->lod_fit == CRANNY_LOD_LEAST_SQUARES)
        return pass_fit(pass, NULL, why);
    enum cranny_status status = pass_add_sets(pass, why);
    for (size_t i = 0; status == CRANNY_OK && i < pass->plan.target_count; i++)
        status = fit_at_vertices(pass, transfer, i, why);
    return status;
}

static enum cranny_status resample_and_fit(struct pass *pass, struct transfer *transfer,
                                           struct cranny_error *why)
{
    struct cranny_bake_report *report = &pass->bake->report;
    double begin = seconds_now();
    enum cranny_status status = samples_collect_from(
        &pass->plan, transfer_source, transfer, pass->params, transfer->found, &pass->samples, why);
    report->seconds_resample += seconds_now() - begin;
    report->lod_samples = pass->plan.sample_count;
    report->lod_missed += pass->samples.invalid;
    begin = seconds_now();
    if (status == CRANNY_OK)
        status = fit(pass, transfer, why);
    report->seconds_lod = seconds_now() - begin;
    return status;
}

static enum cranny_status transfer_all(struct pass *pass, struct cranny_error *why)
{
    struct cranny_scene finest = *pass->scene;
    struct transfer transfer = {.scene = NULL};
    struct cranny_tracer *tracer = NULL;
    const double begin = seconds_now();
    finest.instances = keep_finest(pass->scene);
    enum cranny_status status = finest.instances ? CRANNY_OK : fail_memory(why, "levels of detail");
    if (status == CRANNY_OK)
        status = transfer_begin(&transfer, pass->bake, pass->scene, why);
    if (status == CRANNY_OK)
        status = find_levels(pass, &transfer, why);
    if (status == CRANNY_OK && transfer.found_count < pass->plan.target_count) {
        struct cranny_tracer_params params = cranny_tracer_params_default();
        params.threads = pass->params->threads;
        params.hooks = pass->params->hooks;
        status = cranny_tracer_create(&finest, &params, &tracer, why);
    }
    pass->bake->report.seconds_resample = seconds_now() - begin;
    transfer.resampler.tracer = tracer;
    if (status == CRANNY_OK)
        status = resample_and_fit(pass, &transfer, why);
    cranny_tracer_destroy(&tracer);
    free(transfer.radius);
    free(transfer.found);
    free(finest.instances);
    return status;
}

enum cranny_status lod_bake(struct cranny_bake *bake, const struct cranny_scene *scene,
                            const struct cranny_bake_params *params, struct cranny_error *why)
{
    /* Each sample is right or missing: no share of rays, no pooling of few. */
    struct cranny_bake_params own = *params;
    own.rays = 65536;
    own.back_limit = 0.5f;
    own.samples_per_face *= SAMPLES_WORTH;
    own.fit = CRANNY_FIT_LEAST_SQUARES;
    struct pass pass;
    enum cranny_status status =
        pass_begin(&pass, bake, scene, &own, bake->treatments, 1u << CRANNY_TREATMENT_LOD, why);
    bake->report.lod_instances = status == CRANNY_OK ? pass.plan.order_count : 0;
    if (status == CRANNY_OK && pass.plan.target_count)
        status = transfer_all(&pass, why);
    if (status == CRANNY_OK)
        pass_publish(&pass, bake->treatments);
    pass_end(&pass);
    return status;
}
