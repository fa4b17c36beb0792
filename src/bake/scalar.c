/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2.1. */
#include "bake/scalar.h"

#include "bake/resample.h"
#include "base/hash.h"
#include "trace/gather.h"

#define RAYS 64
/* The sphere has this share of the object's height or width, and is doubled where it finds nothing.
 */
#define RADIUS_SHARE 0.5
#define DOUBLINGS 3

/* The middle of the bottom of an instance's box, and a radius that fits the object. */
static double place(const struct cranny_scene *scene, const struct cranny_instance *instance,
                    double center[3])
{
    double box[6];
    instance_bounds(&scene->meshes[instance->mesh], instance->world_from_object, box);
    center[0] = 0.5 * (box[0] + box[3]);
    center[1] = box[1];
    center[2] = 0.5 * (box[2] + box[5]);
    const double width = fmax(box[3] - box[0], box[5] - box[2]);
    return RADIUS_SHARE * fmax(width, box[4] - box[1]);
}

/* Where no surface is near: what a level ground there would have. */
static void open_ground(const struct cranny_tracer *tracer, const struct gather_plan *gather,
                        const struct cranny_bake_params *params, const double center[3],
                        uint32_t id, double values[CHANNELS])
{
    struct gather_point point = {.normal = {0, 1, 0}, .face_normal = {0, 1, 0}, .id = id};
    struct gather_result result;
    for (int k = 0; k < 3; k++)
        point.position[k] = (float)center[k];
    gather_points(tracer, gather, &point, 1, &result);
    values[CRANNY_CHANNEL_VISIBILITY] = (double)bake_remap(params, result.visibility);
    values[CRANNY_CHANNEL_LONG] = (double)result.visibility[0];
    values[CRANNY_CHANNEL_SHORT] = (double)result.visibility[1];
}

static void set_constant(float linear[CHANNELS][4], const double values[CHANNELS])
{
    for (int c = 0; c < CHANNELS; c++) {
        linear[c][0] = (float)fmin(fmax(values[c], 0), 1);
        linear[c][1] = linear[c][2] = linear[c][3] = 0;
    }
}

static enum cranny_status resample_all(struct cranny_bake *bake, const struct resampler *resampler,
                                       const struct cranny_bake_params *params,
                                       struct cranny_error *why)
{
    const struct cranny_gather_params wanted = bake_gather_params(params);
    struct gather_plan *gather;
    struct watch watch;
    enum cranny_status status = gather_plan_create(&wanted, false, &gather, why);
    if (status != CRANNY_OK)
        return status;
    watch_begin(&watch, params->hooks, "scatter", bake->report.scalar_instances);
#pragma omp parallel num_threads(thread_count(params->threads))
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 16)
        for (uint32_t i = 0; i < bake->instance_count; i++) {
            if (bake->treatments[i] != CRANNY_TREATMENT_SCALAR || !watch_goes_on(&watch))
                continue;
            double center[3], values[CHANNELS];
            const double radius =
                place(resampler->scene, &resampler->scene->instances[i].view, center);
            const uint32_t id = (uint32_t)hash_bytes(HASH_BEGIN, center, sizeof center);
            if (resample_widening(resampler, center, NULL, radius, DOUBLINGS, id, RAYS, values) < 0)
                open_ground(resampler->tracer, gather, params, center, id, values);
            set_constant(bake->linear[i], (const double *)values);
            watch_advance(&watch, 1);
        }
        gather_thread_end(saved);
    }
    gather_plan_destroy(&gather);
    watch.next = 0; /* the last word, however short the stage was */
    return !watch_goes_on(&watch) ? fail(why, CRANNY_CANCELLED, "bake: cancelled at the shrubs")
                                  : CRANNY_OK;
}

enum cranny_status scalar_bake(struct cranny_bake *bake, const struct cranny_scene *scene,
                               const struct cranny_tracer *tracer,
                               const struct cranny_bake_params *params, struct cranny_error *why)
{
    const struct resampler resampler = {.bake = bake, .scene = scene, .tracer = tracer};
    for (uint32_t i = 0; i < bake->instance_count; i++)
        bake->report.scalar_instances += bake->treatments[i] == CRANNY_TREATMENT_SCALAR;
    if (!bake->report.scalar_instances)
        return CRANNY_OK;
    const double begin = seconds_now();
    enum cranny_status status = bake_need_linear(bake, why);
    if (status == CRANNY_OK)
        status = bake_set_per_mesh(bake, CRANNY_TREATMENT_SCALAR, NULL, NULL, why);
    if (status == CRANNY_OK)
        status = resample_all(bake, &resampler, params, why);
    bake->report.seconds_scalar = seconds_now() - begin;
    return status;
}
