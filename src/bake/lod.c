/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2.1. */
#include "bake/lod.h"

#include "bake/levels.h"
#include "bake/pass.h"
#include "bake/resample.h"

/* Samples are not noisy here, and a coarse face has much to take over. */
#define SAMPLES_WORTH 4.0f
#define RAYS 8
/* The sphere's radius starts at this share of an instance's diagonal and is doubled where it finds
 * nothing, up to 1/6 of the diagonal. */
#define RADIUS_SHARE 0.005
#define DOUBLINGS 5
/* A sample says how often its sphere was doubled by that many of as many rays; or that there was
 * nothing, by all of them. */
#define TELLING_RAYS 255

struct transfer {
    struct resampler resampler; /* group aside */
    const struct cranny_scene *scene;
    double *radius; /* per instance */
};

/* Returns how often the radius was doubled; −1: there is nothing. */
static int transfer_point(const struct transfer *transfer, uint32_t instance,
                          const float position[3], const float normal[3], uint32_t id, float raw[2])
{
    struct resampler resampler = transfer->resampler;
    const double center[3] = {(double)position[0], (double)position[1], (double)position[2]};
    const double facing[3] = {(double)normal[0], (double)normal[1], (double)normal[2]};
    double values[CHANNELS];
    resampler.lod_group = transfer->scene->instances[instance].view.lod_group;
    const int doublings = resample_widening(&resampler, center, facing, transfer->radius[instance],
                                            DOUBLINGS, id, RAYS, values);
    raw[0] = (float)values[CRANNY_CHANNEL_LONG];
    raw[1] = (float)values[CRANNY_CHANNEL_SHORT];
    return doublings;
}

static void transfer_source(void *user, const struct gather_point *points,
                            const uint32_t *instances, size_t count, struct gather_result *results)
{
    for (size_t i = 0; i < count; i++) {
        const int doublings =
            transfer_point(user, instances[i], points[i].position, points[i].face_normal,
                           points[i].id, results[i].visibility);
        results[i].rays = TELLING_RAYS;
        results[i].back_faces = doublings < 0 ? TELLING_RAYS : (uint32_t)doublings;
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
        instance_bounds(&scene->meshes[instance->mesh], instance->world_from_object, box);
        for (int k = 0; k < 3; k++)
            square += (box[3 + k] - box[k]) * (box[3 + k] - box[k]);
        transfer->radius[i] = RADIUS_SHARE * sqrt(square);
    }
    return CRANNY_OK;
}

/* Values at the vertices themselves, for comparison. */
static enum cranny_status fit_at_vertices(struct pass *pass, const struct transfer *transfer,
                                          size_t index, struct cranny_error *why)
{
    const struct target *target = &pass->plan.targets[index];
    const struct cranny_mesh *mesh = plan_mesh(&pass->plan, target);
    const uint32_t instance = pass->plan.order[target->instance_first];
    struct value_set *set = &pass->bake->sets[pass->first_set + index];
    for (size_t v = 0; v < (size_t)CHANNELS * mesh->vertex_count; v++)
        set->values[v] = 1;
    if (!(target->area > 0))
        return CRANNY_OK;
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

/* Of targets that the cache has values for. */
static uint64_t known_misses(const struct pass *pass)
{
    uint64_t misses = 0;
    for (size_t i = 0; pass->entries && i < pass->plan.target_count; i++)
        if (pass->entries[i].found)
            misses += pass->entries[i].found->report.invalid;
    return misses;
}

static enum cranny_status resample_and_fit(struct pass *pass, struct transfer *transfer,
                                           struct levels *levels, struct cranny_error *why)
{
    struct cranny_bake_report *report = &pass->bake->report;
    double begin = seconds_now();
    enum cranny_status status =
        samples_collect_from(&pass->plan, transfer_source, transfer, pass->params,
                             levels_found(levels), levels_reuse(levels), &pass->samples, why);
    if (status == CRANNY_OK && levels)
        status = levels_keep(levels, why);
    report->seconds_resample += seconds_now() - begin;
    report->lod_samples = pass->plan.sample_count;
    report->lod_missed = pass->samples.invalid + known_misses(pass);
    begin = seconds_now();
    if (status == CRANNY_OK)
        status = fit(pass, transfer, why);
    report->seconds_lod = seconds_now() - begin;
    return status;
}

/* Only what is fitted is kept. */
static enum cranny_status look_up(struct pass *pass, const struct transfer *transfer,
                                  struct levels **levels, struct cranny_error *why)
{
    const struct level_rays rays = {transfer->radius, DOUBLINGS};
    return pass->params->lod_fit == CRANNY_LOD_LEAST_SQUARES
               ? levels_create(pass, &rays, levels, why)
               : CRANNY_OK;
}

static enum cranny_status transfer_all(struct pass *pass, struct cranny_error *why)
{
    struct cranny_scene finest = *pass->scene;
    struct transfer transfer = {.scene = NULL};
    struct levels *levels = NULL;
    struct cranny_tracer *tracer = NULL;
    const double begin = seconds_now();
    finest.instances = keep_finest(pass->scene);
    enum cranny_status status = finest.instances ? CRANNY_OK : fail_memory(why, "levels of detail");
    if (status == CRANNY_OK)
        status = transfer_begin(&transfer, pass->bake, pass->scene, why);
    if (status == CRANNY_OK)
        status = look_up(pass, &transfer, &levels, why);
    if (status == CRANNY_OK && !levels_all_found(levels)) {
        struct cranny_tracer_params params = cranny_tracer_params_default();
        params.threads = pass->params->threads;
        params.hooks = pass->params->hooks;
        status = cranny_tracer_create(&finest, &params, &tracer, why);
    }
    pass->bake->report.seconds_resample = seconds_now() - begin;
    transfer.resampler.tracer = tracer;
    if (status == CRANNY_OK)
        status = resample_and_fit(pass, &transfer, levels, why);
    cranny_tracer_destroy(&tracer);
    free(transfer.radius);
    levels_destroy(&levels);
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
