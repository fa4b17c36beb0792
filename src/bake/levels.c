/* A level's samples are means of its finest level's values: they change by no more than those do
 * where the rays ended. */
#include "bake/levels.h"

#include "base/hash.h"

/* Cells of the grid that tells where values changed, per instance. */
#define CELLS_MAX 32768

/* Largest change of the values in each cell of an instance's box. */
struct shift {
    bool known;
    double origin[3], cell;
    int size[3];
    float *cells; /* NULL: nothing changed */
};

/* What a finest level's values were, in the file. */
struct source {
    uint64_t key; /* of the values */
    float linear[2][4];
};

/* A finest level that rays meet. */
struct finest {
    uint32_t instance, group;
    double box[6];
    struct shift shift;
};

struct level_target {
    uint64_t place;      /* key of all but the finest levels' values */
    size_t source_first; /* in `sources` */
    size_t source_count;
};

struct levels {
    struct pass *pass;
    const struct cranny_scene *scene;
    const struct cranny_bake *bake;
    struct cache *cache;
    struct level_rays rays;
    uint64_t *looks;       /* per mesh */
    uint64_t *values;      /* per set */
    struct finest *finest; /* by group, then instance */
    size_t finest_count;
    bool blended; /* rays throw dice, into which an instance's number goes */
    struct level_target *targets;
    struct source *sources;
    uint32_t *source_finest; /* of each source */
    size_t source_count, source_capacity, source_finest_capacity;
    bool *found;
    size_t found_count;
    struct cache_samples *old;
    struct sample_reuse reuse;
};

static int compare_finest(const void *a, const void *b)
{
    const struct finest *x = a, *y = b;
    if (x->group != y->group)
        return x->group < y->group ? -1 : 1;
    return (x->instance > y->instance) - (x->instance < y->instance);
}

static void list_finest(struct levels *levels)
{
    const struct cranny_scene *scene = levels->scene;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        if (!cranny_instance_exists(instance) || !instance->lod_group)
            continue;
        struct finest *finest = &levels->finest[levels->finest_count++];
        *finest = (struct finest){.instance = i, .group = instance->lod_group};
        instance_bounds(&scene->meshes[instance->mesh], instance->world_from_object, finest->box);
    }
    qsort(levels->finest, levels->finest_count, sizeof *levels->finest, compare_finest);
    for (size_t i = 0; i < scene->material_count; i++)
        levels->blended |= scene->materials[i].alpha_mode == CRANNY_ALPHA_BLEND;
}

static void hash_values(struct levels *levels)
{
    const struct cranny_bake *bake = levels->bake;
#pragma omp parallel for schedule(dynamic, 4)
    for (size_t s = 0; s < bake->set_count; s++)
        levels->values[s] = hash_bytes(HASH_BEGIN, bake->sets[s].values,
                                       bake->sets[s].vertex_count * CHANNELS * sizeof(float));
}

static void get_linear(const struct cranny_bake *bake, uint32_t instance, float linear[2][4])
{
    for (int c = 0; c < 2; c++)
        cranny_bake_linear(bake, instance, (enum cranny_channel)(CRANNY_CHANNEL_LONG + c),
                           linear[c]);
}

static bool add_source(struct levels *levels, size_t finest)
{
    const uint32_t instance = levels->finest[finest].instance;
    if (!grow_array((void **)&levels->sources, &levels->source_capacity, levels->source_count + 1,
                    sizeof *levels->sources) ||
        !grow_array((void **)&levels->source_finest, &levels->source_finest_capacity,
                    levels->source_count + 1, sizeof *levels->source_finest))
        return false;
    struct source *source = &levels->sources[levels->source_count];
    levels->source_finest[levels->source_count++] = (uint32_t)finest;
    source->key = levels->bake->sets[levels->bake->set_of[instance]].key;
    get_linear(levels->bake, instance, source->linear);
    return true;
}

static bool boxes_meet(const double a[6], const double b[6], double reach)
{
    for (int k = 0; k < 3; k++)
        if (a[k] > b[3 + k] + reach || a[3 + k] < b[k] - reach)
            return false;
    return true;
}

/* Keys of a finest level that rays may meet. What is another thing's is not in `place`: where it
 * changed, the cache knows, unless it is grass. */
static bool add_finest(struct levels *levels, size_t index, uint32_t group, uint64_t *place,
                       uint64_t *values)
{
    const struct finest *finest = &levels->finest[index];
    const struct cranny_instance *instance = &levels->scene->instances[finest->instance].view;
    const uint32_t set = levels->bake->set_of[finest->instance];
    const bool ours = finest->group == group && set != SET_NONE;
    uint64_t key = hash_bytes(levels->looks[instance->mesh], instance->world_from_object,
                              sizeof instance->world_from_object);
    key = hash_word(key, (levels->blended ? (uint64_t)finest->instance << 1 : 0) | ours);
    *values = hash_word(*values, key);
    if (ours || instance->role == CRANNY_ROLE_GRASS)
        *place = hash_word(*place, key);
    if (!ours)
        return true;
    *values = hash_word(*values, levels->values[set]);
    if (levels->bake->linear)
        *values = hash_bytes(*values, levels->bake->linear[finest->instance],
                             sizeof *levels->bake->linear);
    return add_source(levels, index);
}

/* All finest levels around a target; its key with their values. */
static bool gather_sources(struct levels *levels, size_t index, uint64_t *key)
{
    const struct plan *plan = &levels->pass->plan;
    const struct target *target = &plan->targets[index];
    uint64_t place = hash_word(target->key, target->instance_count), values = HASH_BEGIN;
    levels->targets[index].source_first = levels->source_count;
    for (uint32_t i = 0; i < target->instance_count; i++) {
        const uint32_t instance = plan->order[target->instance_first + i];
        const struct cranny_instance *view = &levels->scene->instances[instance].view;
        const double reach = 1.01 * levels->rays.radius[instance] * (1 << levels->rays.doublings);
        double box[6];
        instance_bounds(&levels->scene->meshes[target->mesh], view->world_from_object, box);
        place = hash_word(place, plan->places[instance]);
        for (size_t f = 0; f < levels->finest_count; f++)
            if (boxes_meet(levels->finest[f].box, box, reach) &&
                !add_finest(levels, f, view->lod_group, &place, &values))
                return false;
    }
    levels->targets[index].source_count =
        levels->source_count - levels->targets[index].source_first;
    levels->targets[index].place = place;
    *key = hash_word(place, values);
    return true;
}

/* How much a triangle's values changed at most: |f L − f' L'| ≤ |f − f'| |L| + |L − L'|, since f'
 * is at most 1, and each is linear on the triangle. */
static float triangle_shift(const struct cranny_mesh *mesh, uint32_t triangle,
                            const float *const now[2], const float (*old)[2],
                            const float linear[2][4], const float old_linear[2][4])
{
    float worst = 0;
    for (int c = 0; c < 2; c++) {
        float values = 0, factor = 0, factors = 0;
        for (int i = 0; i < 3; i++) {
            const uint32_t v = mesh->triangles[triangle][i];
            const float *p = mesh->positions[v];
            float l = linear[c][0], m = old_linear[c][0];
            for (int k = 0; k < 3; k++) {
                l += linear[c][1 + k] * p[k];
                m += old_linear[c][1 + k] * p[k];
            }
            values = fmaxf(values, fabsf(now[c][v] - old[v][c]));
            factor = fmaxf(factor, fabsf(l));
            factors = fmaxf(factors, fabsf(l - m));
        }
        worst = fmaxf(worst, values * factor + factors);
    }
    return worst * (1 + 0x1p-20f);
}

/* Cells about as wide as long, over the instance's box. */
static bool shift_alloc(const double box[6], struct shift *shift)
{
    double size[3], longest = 0;
    for (int k = 0; k < 3; k++) {
        size[k] = box[3 + k] - box[k];
        longest = fmax(longest, size[k]);
        shift->origin[k] = box[k];
    }
    shift->cell = fmax(longest, 1e-30) / 1024;
    for (;; shift->cell *= 1.25) {
        double cells = 1;
        for (int k = 0; k < 3; k++) {
            shift->size[k] = 1 + (int)(size[k] / shift->cell);
            cells *= shift->size[k];
        }
        if (cells <= CELLS_MAX)
            break;
    }
    shift->cells =
        alloc_array((size_t)shift->size[0] * (size_t)shift->size[1] * (size_t)shift->size[2],
                    sizeof *shift->cells);
    return shift->cells;
}

/* The cells that a box meets: first and last along each axis. */
static void shift_range(const struct shift *shift, const double box[6], int range[3][2])
{
    for (int k = 0; k < 3; k++)
        for (int e = 0; e < 2; e++) {
            const double at =
                (box[3 * e + k] - shift->origin[k]) / shift->cell + (e ? 1e-6 : -1e-6);
            range[k][e] = (int)fmin(fmax(at, 0), shift->size[k] - 1);
        }
}

static float *shift_row(const struct shift *shift, int y, int z)
{
    return shift->cells + ((size_t)z * (size_t)shift->size[1] + (size_t)y) * (size_t)shift->size[0];
}

static void shift_add(const struct shift *shift, const double box[6], float value)
{
    int r[3][2];
    shift_range(shift, box, r);
    for (int z = r[2][0]; z <= r[2][1]; z++)
        for (int y = r[1][0]; y <= r[1][1]; y++)
            for (int x = r[0][0]; x <= r[0][1]; x++)
                shift_row(shift, y, z)[x] = fmaxf(shift_row(shift, y, z)[x], value);
}

static float shift_find(const struct shift *shift, const double box[6])
{
    float largest = 0;
    int r[3][2];
    if (!shift->cells)
        return 0;
    shift_range(shift, box, r);
    for (int z = r[2][0]; z <= r[2][1]; z++)
        for (int y = r[1][0]; y <= r[1][1]; y++)
            for (int x = r[0][0]; x <= r[0][1]; x++)
                largest = fmaxf(largest, shift_row(shift, y, z)[x]);
    return largest;
}

static void triangle_box(const struct cranny_instance *instance, const struct cranny_mesh *mesh,
                         uint32_t triangle, double box[6])
{
    for (int c = 0; c < 3; c++) {
        double p[3];
        transform_point(instance->world_from_object, mesh->positions[mesh->triangles[triangle][c]],
                        p);
        for (int k = 0; k < 3; k++) {
            box[k] = c ? fmin(box[k], p[k]) : p[k];
            box[3 + k] = c ? fmax(box[3 + k], p[k]) : p[k];
        }
    }
}

/* Where a finest level's values differ from what they were. */
static bool find_shift(struct levels *levels, struct finest *finest, const struct source *old,
                       const struct source *now)
{
    const struct cranny_instance *instance = &levels->scene->instances[finest->instance].view;
    const struct cranny_mesh *mesh = &levels->scene->meshes[instance->mesh].view;
    if (finest->shift.known || !old->key)
        return true;
    const struct kept_values *values =
        cache_find_values(levels->cache, old->key, mesh->vertex_count);
    if (!values)
        return true;
    const float *channels[2];
    for (int c = 0; c < 2; c++)
        channels[c] = cranny_bake_values(levels->bake, finest->instance,
                                         (enum cranny_channel)(CRANNY_CHANNEL_LONG + c));
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const float shift =
            triangle_shift(mesh, t, channels, values->raw, now->linear, old->linear);
        double box[6];
        if (!(shift > 0))
            continue;
        if (!finest->shift.cells && !shift_alloc(finest->box, &finest->shift))
            return false;
        triangle_box(instance, mesh, t, box);
        shift_add(&finest->shift, box, shift);
    }
    finest->shift.known = true;
    return true;
}

/* A target's samples in the last bake, when it is known how all that they come from has changed. */
static bool find_samples(struct levels *levels, size_t index)
{
    const struct level_target *target = &levels->targets[index];
    struct target wanted = levels->pass->plan.targets[index];
    size_t size;
    const struct source *old = state_find(&levels->cache->old, STATE_SOURCES, target->place, &size);
    if (!old || size != target->source_count * sizeof *old)
        return true;
    bool known = true;
    for (size_t i = 0; i < target->source_count; i++) {
        const size_t number = target->source_first + i;
        struct finest *finest = &levels->finest[levels->source_finest[number]];
        if (!find_shift(levels, finest, &old[i], &levels->sources[number]))
            return false;
        known &= finest->shift.known;
    }
    wanted.key = target->place;
    wanted.instance_count = 1; /* the key tells that the same instances are picked */
    if (known)
        levels->old[index] = cache_find_samples(levels->cache, &wanted);
    return true;
}

static bool box_changed(const float change[6], const double box[6])
{
    for (int k = 0; k < 3; k++)
        if ((double)change[k] > box[3 + k] || (double)change[3 + k] < box[k])
            return false;
    return true;
}

/* sample_reuse's */
static bool sample_stands(void *user, const struct gather_point *point, uint32_t instance,
                          const struct kept *old, struct kept *kept)
{
    const struct levels *levels = user;
    const uint32_t group = levels->scene->instances[instance].view.lod_group;
    const int doublings = old->back <= levels->rays.doublings ? old->back : levels->rays.doublings;
    const double radius = 1.001 * levels->rays.radius[instance] * (1 << doublings);
    size_t low = 0, high = levels->finest_count;
    double box[6];
    float reach = 0;
    for (int k = 0; k < 3; k++) {
        box[k] = (double)point->position[k] - radius;
        box[3 + k] = (double)point->position[k] + radius;
    }
    for (size_t i = 0; i < levels->cache->change.box_count; i++)
        if (box_changed(levels->cache->change.boxes[i], box))
            return false;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (levels->finest[middle].group < group)
            low = middle + 1;
        else
            high = middle;
    }
    for (; low < levels->finest_count && levels->finest[low].group == group; low++)
        reach = fmaxf(reach, shift_find(&levels->finest[low].shift, box));
    *kept = *old;
    return cache_add_drift(levels->cache, reach, kept);
}

static enum cranny_status look_up(struct levels *levels, struct cranny_error *why)
{
    const struct plan *plan = &levels->pass->plan;
    for (size_t i = 0; i < plan->target_count; i++) {
        uint64_t key;
        if (!(plan->targets[i].area > 0)) {
            levels->found_count++;
            continue;
        }
        if (!gather_sources(levels, i, &key))
            return fail_memory(why, "levels of detail");
        levels->found[i] = pass_find(levels->pass, i, key);
        levels->found_count += levels->found[i];
        if (!levels->found[i] && !find_samples(levels, i))
            return fail_memory(why, "levels of detail");
    }
    return CRANNY_OK;
}

static enum cranny_status levels_fill(struct levels *levels, struct cranny_error *why)
{
    const size_t targets = levels->pass->plan.target_count;
    levels->looks = alloc_array(levels->scene->mesh_count, sizeof *levels->looks);
    levels->values = alloc_array(levels->bake->set_count, sizeof *levels->values);
    levels->finest = alloc_array(levels->scene->instance_count, sizeof *levels->finest);
    levels->targets = alloc_array(targets, sizeof *levels->targets);
    levels->found = alloc_array(targets, sizeof *levels->found);
    levels->old = alloc_array(targets, sizeof *levels->old);
    if (!levels->looks || !levels->values || !levels->finest || !levels->targets ||
        !levels->found || !levels->old)
        return fail_memory(why, "levels of detail");
    list_finest(levels);
    hash_values(levels);
    enum cranny_status status = mesh_look_keys(levels->scene, levels->looks, why);
    if (status == CRANNY_OK)
        status = pass_use_cache(levels->pass, levels->cache, why);
    levels->reuse =
        (struct sample_reuse){.old = levels->old, .stands = sample_stands, .user = levels};
    return status == CRANNY_OK ? look_up(levels, why) : status;
}

enum cranny_status levels_create(struct pass *pass, const struct level_rays *rays,
                                 struct levels **levels, struct cranny_error *why)
{
    *levels = NULL;
    if (!pass->bake->cache)
        return CRANNY_OK;
    struct levels *made = alloc_array(1, sizeof *made);
    if (!made)
        return fail_memory(why, "levels of detail");
    made->pass = pass;
    made->scene = pass->scene;
    made->bake = pass->bake;
    made->cache = pass->bake->cache;
    made->rays = *rays;
    const enum cranny_status status = levels_fill(made, why);
    if (status != CRANNY_OK)
        levels_destroy(&made);
    *levels = made;
    return status;
}

const bool *levels_found(const struct levels *levels)
{
    return levels ? levels->found : NULL;
}

bool levels_all_found(const struct levels *levels)
{
    return levels && levels->found_count == levels->pass->plan.target_count;
}

struct sample_reuse *levels_reuse(struct levels *levels)
{
    return levels ? &levels->reuse : NULL;
}

/* A found target's samples are in the old file. */
static const struct kept *kept_samples(const struct levels *levels, size_t index,
                                       const struct kept *taken)
{
    struct target target = levels->pass->plan.targets[index];
    if (!levels->found[index])
        return taken + target.sample_base;
    target.key = levels->targets[index].place;
    target.instance_count = 1;
    return cache_find_samples(levels->cache, &target).kept;
}

enum cranny_status levels_keep(struct levels *levels, struct cranny_error *why)
{
    struct pass *pass = levels->pass;
    struct cache *cache = levels->cache;
    struct kept *taken = pass->samples.kept;
    pass->samples.kept = NULL;
    if (cache_own(cache, taken, why) != CRANNY_OK)
        return CRANNY_MEMORY;
    for (size_t i = 0; i < pass->plan.target_count; i++) {
        const struct level_target *target = &levels->targets[i];
        const uint32_t count = pass->plan.targets[i].sample_count;
        const struct kept *kept = count ? kept_samples(levels, i, taken) : NULL;
        if (kept &&
            (!state_add(&cache->next, STATE_SAMPLES, target->place, kept, count * sizeof *kept) ||
             !state_add(&cache->next, STATE_SOURCES, target->place,
                        levels->sources + target->source_first,
                        target->source_count * sizeof *levels->sources)))
            return fail_memory(why, "cache");
    }
    struct source *sources = levels->sources;
    levels->sources = NULL;
    return cache_own(cache, sources, why);
}

void levels_destroy(struct levels **levels)
{
    if (!*levels)
        return;
    for (size_t i = 0; (*levels)->finest && i < (*levels)->finest_count; i++)
        free((*levels)->finest[i].shift.cells);
    free((*levels)->looks);
    free((*levels)->values);
    free((*levels)->finest);
    free((*levels)->targets);
    free((*levels)->sources);
    free((*levels)->source_finest);
    free((*levels)->found);
    free((*levels)->old);
    free(*levels);
    *levels = NULL;
}
