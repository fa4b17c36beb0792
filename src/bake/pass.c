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

static enum cranny_status finish_target(struct pass *pass, size_t index, int threads,
                                        struct cranny_error *why)
{
    const struct target *target = &pass->plan.targets[index];
    struct fit_report *report = &pass->bake->sets[pass->first_set + index].fit;
    const uint32_t count = plan_mesh(&pass->plan, target)->vertex_count;
    float *values = pass->bake->sets[pass->first_set + index].values;
    float(*raw)[2] = alloc_array(count, sizeof *raw);
    enum cranny_status status = raw ? CRANNY_OK : fail_memory(why, "values");
    if (status == CRANNY_OK && !(target->area > 0))
        for (uint32_t v = 0; v < count; v++)
            raw[v][0] = raw[v][1] = 1;
    else if (status == CRANNY_OK && pass->params->fit == CRANNY_FIT_VERTEX)
        status = fit_from_vertices(&pass->plan, pass->tracer, index, pass->params, raw, report,
                                   &pass->samples, why);
    else if (status == CRANNY_OK)
        status = fit_target(&pass->plan, &pass->samples, index, pass->params, threads, &pass->watch,
                            raw, report, why);
    if (status == CRANNY_OK)
        pass_spread(pass->params, (const float(*)[2])raw, count, values);
    free(raw);
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
    samples_free(&pass->samples);
    plan_free(&pass->plan);
}
