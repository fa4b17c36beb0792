/* A bake into its scene's file: values as they are, coefficients beside them, or both multiplied.
 */
#include "bake/bake.h"

#include <cranny/runtime.h>

#define EXPANDED_MAX_BYTES (16ull << 30)

/* What the writer is shown, and what is made for it. */
struct saving {
    const struct cranny_bake *bake;
    const struct cranny_scene *scene;
    const float **channels[CHANNELS]; /* per instance */
    struct instance_factor *factors;
    float **made; /* per instance: three channels, or NULL */
};

static bool has_factor(const struct cranny_bake *bake, uint32_t instance)
{
    float linear[4];
    return cranny_bake_linear(bake, instance, CRANNY_CHANNEL_VISIBILITY, linear);
}

static uint32_t vertex_count(const struct saving *saving, uint32_t instance)
{
    return saving->scene->meshes[saving->scene->instances[instance].view.mesh].view.vertex_count;
}

static void show(struct saving *saving, uint32_t instance, const float *values)
{
    for (int c = 0; c < CHANNELS; c++)
        saving->channels[c][instance] =
            values ? values + (size_t)c * vertex_count(saving, instance) : NULL;
}

/* Final values of an instance: its mesh's times its linear function. */
static bool expand(struct saving *saving, uint32_t instance)
{
    const uint32_t count = vertex_count(saving, instance);
    const struct cranny_mesh *mesh =
        &saving->scene->meshes[saving->scene->instances[instance].view.mesh].view;
    float *values = saving->made[instance] = alloc_array(count, CHANNELS * sizeof *values);
    if (!values)
        return false;
    for (int c = 0; c < CHANNELS; c++) {
        const float *local = cranny_bake_values(saving->bake, instance, (enum cranny_channel)c);
        float linear[4];
        cranny_bake_linear(saving->bake, instance, (enum cranny_channel)c, linear);
        for (uint32_t v = 0; v < count; v++)
            values[(size_t)c * count + v] =
                cranny_linear_visibility(linear, mesh->positions[v], local[v]);
    }
    show(saving, instance, values);
    return true;
}

/* Shrubs and grass of one mesh have their mean in the file's mesh, for viewers that know no more.
 */
static bool average(struct saving *saving, uint32_t *first_of_set, double *sums, uint32_t instance)
{
    const uint32_t set = saving->bake->set_of[instance];
    const uint32_t count = vertex_count(saving, instance), first = first_of_set[set];
    if (first != instance) {
        show(saving, instance, saving->made[first]);
        return true;
    }
    float *values = saving->made[instance] = alloc_array(count, CHANNELS * sizeof *values);
    if (!values)
        return false;
    const uint32_t instances = saving->bake->sets[set].instance_count;
    for (int c = 0; c < CHANNELS; c++)
        for (uint32_t v = 0; v < count; v++)
            values[(size_t)c * count + v] =
                (float)(sums[(size_t)CHANNELS * set + (size_t)c] / instances);
    show(saving, instance, values);
    return true;
}

static enum factor_kind factor_kind(const struct cranny_bake *bake, uint32_t instance)
{
    if (!has_factor(bake, instance))
        return FACTOR_NONE;
    return bake->treatments[instance] == CRANNY_TREATMENT_SCALAR ? FACTOR_SCALAR : FACTOR_LINEAR;
}

static void set_factor(const struct cranny_bake *bake, uint32_t instance,
                       struct instance_factor *factor)
{
    factor->kind = factor_kind(bake, instance);
    cranny_bake_linear(bake, instance, CRANNY_CHANNEL_VISIBILITY, factor->visibility);
    cranny_bake_linear(bake, instance, CRANNY_CHANNEL_LONG, factor->raw_long);
    cranny_bake_linear(bake, instance, CRANNY_CHANNEL_SHORT, factor->raw_short);
}

static bool keeps_factor(const struct cranny_scene *scene, const struct cranny_save_params *params,
                         uint32_t instance)
{
    return !params->expand || scene->instances[instance].source_index >= 0;
}

/* Sum of the constants of each set's instances per channel, and its first instance that is not
 * expanded. */
static void sum_scalars(const struct saving *saving, const struct cranny_save_params *params,
                        uint32_t *first_of_set, double *sums)
{
    const struct cranny_bake *bake = saving->bake;
    for (uint32_t i = bake->instance_count; i-- > 0;) {
        const uint32_t set = bake->set_of[i];
        if (factor_kind(bake, i) != FACTOR_SCALAR)
            continue;
        if (keeps_factor(saving->scene, params, i))
            first_of_set[set] = i;
        for (int c = 0; c < CHANNELS; c++)
            sums[(size_t)CHANNELS * set + (size_t)c] += (double)bake->linear[i][c][0];
    }
}

static bool fill(struct saving *saving, const struct cranny_save_params *params,
                 uint32_t *first_of_set, double *sums)
{
    const struct cranny_bake *bake = saving->bake;
    size_t crowded = 0;
    sum_scalars(saving, params, first_of_set, sums);
    for (uint32_t i = 0; i < bake->instance_count; i++) {
        const bool keeps = keeps_factor(saving->scene, params, i);
        show(saving, i, cranny_bake_values(bake, i, CRANNY_CHANNEL_VISIBILITY));
        if (!has_factor(bake, i))
            continue;
        crowded += params->expand && keeps;
        if (keeps)
            set_factor(bake, i, &saving->factors[i]);
        if (!keeps
                ? !expand(saving, i)
                : factor_kind(bake, i) == FACTOR_SCALAR && !average(saving, first_of_set, sums, i))
            return false;
    }
    if (crowded)
        hook_warn(params->hooks,
                  "%zu instances made by EXT_mesh_gpu_instancing are not expanded: the format has "
                  "no place for values of their own",
                  crowded);
    return true;
}

static bool saving_alloc(struct saving *saving, size_t count)
{
    for (int c = 0; c < CHANNELS; c++)
        saving->channels[c] = alloc_array(count, sizeof *saving->channels[c]);
    saving->made = alloc_array(count, sizeof *saving->made);
    saving->factors = alloc_array(count, sizeof *saving->factors);
    return saving->channels[0] && saving->channels[1] && saving->channels[2] && saving->made &&
           saving->factors;
}

static void saving_free(struct saving *saving, size_t count)
{
    for (size_t i = 0; saving->made && i < count; i++)
        free(saving->made[i]);
    for (int c = 0; c < CHANNELS; c++)
        free(saving->channels[c]);
    free(saving->made);
    free(saving->factors);
}

/* Expanded values are held at once; a small file can ask for more than any machine has. */
static bool expands_too_much(const struct saving *saving, const struct cranny_save_params *params)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < saving->bake->instance_count; i++)
        if (has_factor(saving->bake, i) && !keeps_factor(saving->scene, params, i))
            bytes += vertex_count(saving, i) * (uint64_t)CHANNELS * sizeof(float);
    return bytes > EXPANDED_MAX_BYTES;
}

enum cranny_status cranny_scene_save(const struct cranny_scene *scene,
                                     const struct cranny_bake *bake, const char *path,
                                     const struct cranny_save_params *params,
                                     struct cranny_error *why)
{
    const struct cranny_save_params defaults = cranny_save_params_default();
    params = params ? params : &defaults;
    if (!bake)
        return scene_write(scene, NULL, path, params, why);
    const size_t count = scene->instance_count;
    struct saving saving = {.bake = bake, .scene = scene};
    if (expands_too_much(&saving, params))
        return fail(
            why, CRANNY_MEMORY,
            "%s: expanded, the instances' values take more than %llu GiB; write them without", path,
            EXPANDED_MAX_BYTES >> 30);
    uint32_t *first_of_set = alloc_array(bake->set_count, sizeof *first_of_set);
    double *sums = alloc_array(bake->set_count, CHANNELS * sizeof *sums);
    const bool complete = saving_alloc(&saving, count) && first_of_set && sums &&
                          fill(&saving, params, first_of_set, sums);
    const struct scene_values values = {
        saving.channels[CRANNY_CHANNEL_VISIBILITY], saving.channels[CRANNY_CHANNEL_LONG],
        saving.channels[CRANNY_CHANNEL_SHORT], bake->linear ? saving.factors : NULL};
    enum cranny_status status =
        complete ? scene_write(scene, &values, path, params, why) : fail_memory(why, path);
    saving_free(&saving, count);
    free(first_of_set);
    free(sums);
    return status;
}
