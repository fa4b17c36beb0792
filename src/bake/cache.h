/* What one bake takes over from the last one, and keeps for the next.
 *
 * Rays decide: a sample whose rays enter none of the boxes in which something changed would see the
 * same again, bit for bit. One whose rays do may still be taken over while all that ever changed on
 * their way counts less than `reuse_limit`. All that is computed from samples is found again by a
 * hash of what it is computed from. */
#ifndef BAKE_CACHE_H
#define BAKE_CACHE_H

#include "bake/change.h"
#include "bake/fit.h"
#include "bake/state.h"

struct cache {
    const struct cranny_bake_params *params;
    char *path;
    uint64_t key;
    struct state old;
    struct state_list next;
    void **owned; /* what `next` points to */
    size_t owned_count, owned_capacity;
    struct occluders now;
    struct change change;
    enum cranny_reuse outcome;
    double density;
    bool news; /* the file would be another one */
    uint64_t reused_samples, reused_sets;
    double seconds;
    uint64_t bytes;
};

/* Make sure of the folder, before any work. *cache NULL: params name no folder. */
enum cranny_status cache_create(const struct cranny_bake_params *params, struct cache **cache,
                                struct cranny_error *why);
void cache_destroy(struct cache **cache);

/* Read what the last bake left, and find what has changed since. `plan`: of the pass over surfaces.
 */
enum cranny_status cache_open(struct cache *cache, const struct plan *plan,
                              struct cranny_error *why);

/* Write what was added. What cannot be written is warned of: the bake is good. */
void cache_save(struct cache *cache);

/* Free `data` with the cache. */
enum cranny_status cache_own(struct cache *cache, void *data, struct cranny_error *why);

/* Let the next bake have `size` bytes, which the cache frees. */
enum cranny_status cache_keep(struct cache *cache, enum state_kind kind, uint64_t key, void *data,
                              size_t size, struct cranny_error *why);

/* What was kept of a target's samples; kept NULL: nothing. */
struct pick {
    uint64_t place;
    double share;
};
struct cache_samples {
    const struct kept *kept;
    const struct pick *picks; /* NULL: one instance has them all */
    uint32_t pick_count;
};
struct cache_samples cache_find_samples(const struct cache *cache, const struct target *target);

/* What may still be added to a sample's drift, out of reuse_limit; false: it must be taken anew. */
bool cache_add_drift(const struct cache *cache, float reach, struct kept *kept);

/* Whether kept rays stand for a point's: then `kept` has what they count as now. For one thread.
 * NULL in place of `old`: they do not. */
bool cache_stands(const struct cache *cache, const struct gather_plan *gather,
                  const struct gather_point *point, const struct kept *old, struct kept *kept);

/* Keep the samples; takes samples->kept over. */
enum cranny_status cache_keep_samples(struct cache *cache, const struct plan *plan,
                                      struct samples *samples, struct cranny_error *why);

/* A target's values with how they were fitted, in one piece for the file. */
struct kept_values {
    struct fit_report report;
    float raw[][2]; /* vertex_count */
};
size_t kept_values_size(uint32_t vertex_count);

/* NULL: the key is new. */
const struct kept_values *cache_find_values(const struct cache *cache, uint64_t key,
                                            uint32_t vertex_count);

/* The key of what is fitted to a target's samples. */
uint64_t cache_fit_key(const struct plan *plan, const struct samples *samples, size_t target);

#endif
