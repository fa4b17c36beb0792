/* The samples' visibilities: traced once, kept small. */
#ifndef BAKE_COLLECT_H
#define BAKE_COLLECT_H

#include "bake/plan.h"
#include "trace/gather.h"

/* 65535 is 1. */
struct sample {
    uint16_t visibility[2];
};

/* What a point's rays found, as they were traced, and by how much the scene may have changed on
 * their way since: in 255ths of reuse_limit, rounded up. */
struct kept {
    uint16_t visibility[2];
    uint8_t back; /* share of back faces, 255 is 1 */
    uint8_t drift;
};

struct cache;
struct cache_samples;

/* Samples that need not be taken anew. */
struct sample_reuse {
    const struct cache_samples *old; /* per target */
    /* Whether a sample stands; then `kept` has what it counts as now. Called from many threads. */
    bool (*stands)(void *user, const struct gather_point *point, uint32_t instance,
                   const struct kept *old, struct kept *kept);
    void *user;
    uint64_t reused, taken; /* on return: how many stood, and how many did not */
};

struct samples {
    struct sample *values; /* plan->sample_count */
    uint8_t *valid;        /* plan->sample_count */
    struct kept *kept;     /* plan->sample_count; NULL without reuse */
    uint64_t rays, invalid;
};

static inline double sample_value(const struct sample *sample, int channel)
{
    return sample->visibility[channel] * (1.0 / 65535);
}

/* Trace all samples of the plan and mark the buried ones. Progress stage "trace". `cache` (may be
 * NULL): take over what still stands. */
enum cranny_status samples_collect(const struct plan *plan, const struct cranny_tracer *tracer,
                                   const struct cranny_bake_params *params, struct cache *cache,
                                   struct samples *samples, struct cranny_error *why);

/* Where samples get their values when it is not from rays: fill results[count] for points on the
 * given instances. A result of which all rays are back faces is invalid. Called from many threads,
 * each between gather_thread_begin and _end. `skip` (may be NULL): targets without need of samples.
 * `reuse` may be NULL. */
typedef void sample_source_fn(void *user, const struct gather_point *points,
                              const uint32_t *instances, size_t count,
                              struct gather_result *results);
enum cranny_status samples_collect_from(const struct plan *plan, sample_source_fn *source,
                                        void *user, const struct cranny_bake_params *params,
                                        const bool *skip, struct sample_reuse *reuse,
                                        struct samples *samples, struct cranny_error *why);
void samples_free(struct samples *samples);

/* The gathering settings that a bake's parameters ask for. */
struct cranny_gather_params bake_gather_params(const struct cranny_bake_params *params);

#endif
