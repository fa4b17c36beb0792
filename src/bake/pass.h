/* One pass over some of a scene's instances: place samples, give them values, fit. */
#ifndef BAKE_PASS_H
#define BAKE_PASS_H

#include "bake/bake.h"

/* A target's values in the cache. */
struct pass_entry {
    uint64_t key; /* 0: not known yet */
    const struct kept_values *found;
    struct kept_values *made; /* owned */
};

struct pass {
    const struct cranny_scene *scene;
    const struct cranny_bake_params *params;
    struct cranny_bake *bake; /* gets the sets */
    struct plan plan;
    struct samples samples;
    struct cache *cache;                /* NULL: none */
    struct pass_entry *entries;         /* per target, with a cache */
    const struct cranny_tracer *tracer; /* during pass_fit */
    int threads;
    struct watch watch;      /* of the fit */
    uint64_t triangle_total; /* over targets */
    size_t first_set;        /* of bake's, for target 0 */
};

/* Place the samples of the instances whose treatment is in `takes` (see plan_create). The pass must
 * be ended whatever comes back. */
enum cranny_status pass_begin(struct pass *pass, struct cranny_bake *bake,
                              const struct cranny_scene *scene,
                              const struct cranny_bake_params *params, const uint8_t *treatments,
                              unsigned takes, struct cranny_error *why);

/* Let the cache take part; what pass_fit makes goes into it. */
enum cranny_status pass_use_cache(struct pass *pass, struct cache *cache, struct cranny_error *why);

/* Whether the cache has a target's values under this key; then it needs no samples. */
bool pass_find(struct pass *pass, size_t target, uint64_t key);

/* Append an empty set for each target to the bake. */
enum cranny_status pass_add_sets(struct pass *pass, struct cranny_error *why);

/* A fit's pairs (long, short) into a set's three channels. */
void pass_spread(const struct cranny_bake_params *params, const float (*raw)[2], uint32_t count,
                 float *values);

/* Fit all targets to the pass's samples (or, for CRANNY_FIT_VERTEX, to rays of `tracer` from the
 * vertices) and append a set for each to the bake, with `treatment`. Progress stage "solve". */
enum cranny_status pass_fit(struct pass *pass, const struct cranny_tracer *tracer,
                            struct cranny_error *why);

/* Point the pass's instances to its sets. */
void pass_publish(const struct pass *pass, const uint8_t *treatments);

void pass_end(struct pass *pass);

#endif
