/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.1. */
#include "bake/pass.h"

/* Targets above this many triangles are fitted one after the other with all threads. */
#define BIG_TRIANGLES 100000u

enum cranny_status pass_begin(struct pass *pass, struct cranny_bake *bake,
                              const struct cranny_scene *scene,
                              const struct cranny_bake_params *params, const uint8_t *treatments,
                              unsigned takes, struct cranny_error *why)
{
    *pass = (struct pass){.scene = scene,
                          .params = params,
                          .bake = bake,
                          .threads = thread_count(params->threads),
                          .first_set = bake->set_count};
    return plan_create(scene, params, treatments, takes, &pass->plan, why);
}

void pass_spread(const struct cranny_bake_params *params, const float (*raw)[2], uint32_t count,
                 float *values)
{
    for (uint32_t v = 0; v < count; v++) {
        values[v] = bake_remap(params, raw[v]);
        values[(size_t)count + v] = raw[v][0];
        values[2 * (size_t)count + v] = raw[v][1];
    }
}

enum cranny_status pass_use_cache(struct pass *pass, struct cache *cache, struct cranny_error *why)
{
    pass->cache = cache;
    if (!cache)
        return CRANNY_OK;
    pass->entries = alloc_array(pass->plan.target_count, sizeof *pass->entries);
    return pass->entries ? CRANNY_OK : fail_memory(why, "cache");
}

bool pass_find(struct pass *pass, size_t target, uint64_t key)
{
    struct pass_entry *entry = &pass->entries[target];
    entry->key = key;
    entry->found = cache_find_values(
        pass->cache, key, plan_mesh(&pass->plan, &pass->plan.targets[target])->vertex_count);
    return entry->found;
}

static enum cranny_status make_values(struct pass *pass, size_t index, int threads,
                                      struct kept_values *values, struct cranny_error *why)
{
    const struct target *target = &pass->plan.targets[index];
    const uint32_t count = plan_mesh(&pass->plan, target)->vertex_count;
    if (!(target->area > 0)) {
        for (uint32_t v = 0; v < count; v++)
            values->raw[v][0] = values->raw[v][1] = 1;
        return CRANNY_OK;
    }
    if (pass->params->fit == CRANNY_FIT_VERTEX)
        return fit_from_vertices(&pass->plan, pass->tracer, index, pass->params, values->raw,
                                 &values->report, &pass->samples, why);
    return fit_target(&pass->plan, &pass->samples, index, pass->params, threads, &pass->watch,
                      values->raw, &values->report, why);
}

/* Fit, or take what the same samples led to before. */
static enum cranny_status finish_target(struct pass *pass, size_t index, int threads,
                                        struct cranny_error *why)
{
    struct value_set *set = &pass->bake->sets[pass->first_set + index];
    struct pass_entry *entry = pass->entries ? &pass->entries[index] : NULL;
    if (entry && !entry->key && pass->plan.targets[index].area > 0)
        pass_find(pass, index, cache_fit_key(&pass->plan, &pass->samples, index));
    struct kept_values *made = NULL;
    if (!entry || !entry->found) {
        made = alloc_array(kept_values_size(set->vertex_count), 1);
        if (!made)
            return fail_memory(why, "values");
        const enum cranny_status status = make_values(pass, index, threads, made, why);
        if (status != CRANNY_OK) {
            free(made);
            return status;
        }
    }
    const struct kept_values *values = made ? made : entry->found;
    set->fit = values->report;
    set->key = entry ? entry->key : 0;
    pass_spread(pass->params, values->raw, set->vertex_count, set->values);
    if (entry && entry->key && made)
        entry->made = made;
    else
        free(made);
    return CRANNY_OK;
}

/* Let the next bake have the values. */
static enum cranny_status keep_values(struct pass *pass, struct cranny_error *why)
{
    struct cache *cache = pass->cache;
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; cache && status == CRANNY_OK && i < pass->plan.target_count; i++) {
        struct pass_entry *entry = &pass->entries[i];
        const size_t size =
            kept_values_size(plan_mesh(&pass->plan, &pass->plan.targets[i])->vertex_count);
        cache->reused_sets += entry->found != NULL;
        if (entry->found && !state_add(&cache->next, STATE_VALUES, entry->key, entry->found, size))
            return fail_memory(why, "cache");
        if (!entry->made)
            continue;
        cache->news = true;
        status = cache_keep(cache, STATE_VALUES, entry->key, entry->made, size, why);
        entry->made = NULL;
    }
    return status;
}

static uint32_t target_triangles(const struct pass *pass, size_t index)
{
    return plan_mesh(&pass->plan, &pass->plan.targets[index])->triangle_count;
}

/* Fitted by all threads together; the others are fitted side by side, which needs no barriers. */
static bool is_big(const struct pass *pass, size_t index)
{
    const uint64_t triangles = target_triangles(pass, index);
    return pass->params->fit == CRANNY_FIT_VERTEX ||
           (triangles > BIG_TRIANGLES &&
            triangles * (uint64_t)pass->threads > pass->triangle_total);
}

struct turn {
    uint32_t triangles, index;
};

static int compare_turns(const void *a, const void *b)
{
    const struct turn *x = a, *y = b;
    if (x->triangles != y->triangles)
        return x->triangles > y->triangles ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

/* Largest first, so that no thread is left with a large one at the end. */
static struct turn *order_targets(struct pass *pass)
{
    struct turn *turns = alloc_array(pass->plan.target_count, sizeof *turns);
    pass->triangle_total = 0;
    for (size_t i = 0; turns && i < pass->plan.target_count; i++) {
        turns[i] = (struct turn){target_triangles(pass, i), (uint32_t)i};
        pass->triangle_total += turns[i].triangles;
    }
    if (turns)
        qsort(turns, pass->plan.target_count, sizeof *turns, compare_turns);
    return turns;
}

static enum cranny_status stopped(struct pass *pass, struct cranny_error *why)
{
    return watch_goes_on(&pass->watch)
               ? CRANNY_OK
               : fail(why, CRANNY_CANCELLED, "bake: cancelled while solving");
}

static enum cranny_status finish_big(struct pass *pass, struct cranny_error *why)
{
    enum cranny_status status = stopped(pass, why);
    for (size_t i = 0; status == CRANNY_OK && i < pass->plan.target_count; i++) {
        if (!is_big(pass, i))
            continue;
        status = finish_target(pass, i, pass->threads, why);
        watch_advance(&pass->watch, 1);
        if (status == CRANNY_OK)
            status = stopped(pass, why);
    }
    return status;
}

static enum cranny_status finish_small(struct pass *pass, const struct turn *turns,
                                       struct cranny_error *why)
{
    int failed = CRANNY_OK;
#pragma omp parallel for num_threads(pass->threads) schedule(dynamic, 1)
    for (size_t turn = 0; turn < pass->plan.target_count; turn++) {
        const size_t i = turns[turn].index;
        int seen;
#pragma omp atomic read
        seen = failed;
        if (seen != CRANNY_OK || is_big(pass, i))
            continue;
        struct cranny_error own = {0};
        enum cranny_status status = stopped(pass, &own);
        if (status == CRANNY_OK)
            status = finish_target(pass, i, 1, &own);
        watch_advance(&pass->watch, 1);
        if (status == CRANNY_OK)
            continue;
#pragma omp critical
        {
#pragma omp atomic write
            failed = (int)status;
            if (why)
                *why = own;
        }
    }
    return failed == CRANNY_OK ? stopped(pass, why) : (enum cranny_status)failed;
}

enum cranny_status pass_add_sets(struct pass *pass, struct cranny_error *why)
{
    for (size_t i = 0; i < pass->plan.target_count; i++) {
        const struct target *target = &pass->plan.targets[i];
        struct value_set *set =
            bake_add_set(pass->bake, target->mesh, plan_mesh(&pass->plan, target)->vertex_count);
        if (!set)
            return fail_memory(why, "values");
        set->instance_first = pass->plan.order[target->instance_first];
        set->instance_count = target->instance_count;
        set->area = target->area;
        set->samples = target->sample_count;
    }
    return CRANNY_OK;
}

enum cranny_status pass_fit(struct pass *pass, const struct cranny_tracer *tracer,
                            struct cranny_error *why)
{
    const size_t count = pass->plan.target_count;
    struct turn *turns = order_targets(pass);
    pass->tracer = tracer;
    watch_begin(&pass->watch, pass->params->hooks, "solve", count);
    enum cranny_status status = turns ? pass_add_sets(pass, why) : fail_memory(why, "values");
    if (status == CRANNY_OK)
        status = finish_big(pass, why);
    if (status == CRANNY_OK)
        status = finish_small(pass, turns, why);
    if (status == CRANNY_OK)
        status = keep_values(pass, why);
    free(turns);
    return status;
}

void pass_publish(const struct pass *pass, const uint8_t *treatments)
{
    for (uint32_t i = 0; i < pass->scene->instance_count; i++) {
        const uint32_t target = pass->plan.target_of[i];
        if (target == UINT32_MAX)
            continue;
        const size_t set = pass->first_set + target;
        pass->bake->set_of[i] = (uint32_t)set;
        pass->bake->sets[set].treatment = (enum cranny_treatment)treatments[i];
    }
}

void pass_end(struct pass *pass)
{
    for (size_t i = 0; pass->entries && i < pass->plan.target_count; i++)
        free(pass->entries[i].made);
    free(pass->entries);
    samples_free(&pass->samples);
    plan_free(&pass->plan);
}
