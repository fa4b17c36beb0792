/* What an instance gets: values of its own, four coefficients, one number, or a finer level's. */
#include "bake/bake.h"

static bool has_surface(const struct cranny_instance *instance)
{
    return cranny_instance_exists(instance) &&
           (instance->role == CRANNY_ROLE_SOLID || instance->role == CRANNY_ROLE_TREE);
}

/* Instances of each mesh that are sampled, and whether one node makes several of them, which no
 * copy of the mesh could tell apart. */
static void count_uses(const struct cranny_scene *scene, uint32_t *uses, uint8_t *crowded)
{
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct instance *instance = &scene->instances[i], *last = instance - 1;
        const uint32_t mesh = instance->view.mesh;
        if (!has_surface(&instance->view))
            continue;
        uses[mesh]++;
        crowded[mesh] |= i > 0 && instance->source_index >= 0 && last->source_index >= 0 &&
                         last->source_node == instance->source_node && last->view.mesh == mesh;
    }
}

static enum cranny_treatment surface_treatment(const struct cranny_bake_params *params,
                                               uint32_t uses, bool crowded)
{
    switch ((enum cranny_instances)params->instances) {
    case CRANNY_INSTANCES_SPLIT:
    case CRANNY_INSTANCES_SHARED:
        return CRANNY_TREATMENT_SURFACE;
    case CRANNY_INSTANCES_LINEAR:
        return uses > 1 ? CRANNY_TREATMENT_LINEAR : CRANNY_TREATMENT_SURFACE;
    case CRANNY_INSTANCES_AUTO:
        break;
    }
    return crowded || uses > (uint32_t)params->split_limit ? CRANNY_TREATMENT_LINEAR
                                                           : CRANNY_TREATMENT_SURFACE;
}

static enum cranny_treatment treatment_of(const struct cranny_instance *instance,
                                          const struct cranny_bake_params *params, uint32_t uses,
                                          bool crowded)
{
    if (instance->role == CRANNY_ROLE_IGNORED)
        return CRANNY_TREATMENT_NONE;
    if (instance->lod)
        return instance->lod_group ? CRANNY_TREATMENT_LOD : CRANNY_TREATMENT_NONE;
    if (has_surface(instance))
        return surface_treatment(params, uses, crowded);
    return CRANNY_TREATMENT_SCALAR;
}

enum cranny_status treatments_choose(const struct cranny_scene *scene,
                                     const struct cranny_bake_params *params, uint8_t *treatments,
                                     struct cranny_error *why)
{
    uint32_t *uses = alloc_array(scene->mesh_count, sizeof *uses);
    uint8_t *crowded = alloc_array(scene->mesh_count, 1);
    if (uses && crowded) {
        count_uses(scene, uses, crowded);
        for (uint32_t i = 0; i < scene->instance_count; i++) {
            const struct cranny_instance *instance = &scene->instances[i].view;
            treatments[i] = (uint8_t)treatment_of(instance, params, uses[instance->mesh],
                                                  crowded[instance->mesh]);
        }
    }
    const bool complete = uses && crowded;
    free(uses);
    free(crowded);
    return complete ? CRANNY_OK : fail_memory(why, "bake plan");
}
