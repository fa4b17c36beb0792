/* What lower levels of detail take over from the last bake. */
#ifndef BAKE_LEVELS_H
#define BAKE_LEVELS_H

#include "bake/pass.h"

struct levels;

/* Where the rays of a level's samples go, for the cache. */
struct level_rays {
    const double *radius; /* per instance of the scene: of the first sphere */
    int doublings;        /* the most times that it is doubled */
};

/* Look up what is known of the pass's targets. *levels NULL: the bake has no cache. */
enum cranny_status levels_create(struct pass *pass, const struct level_rays *rays,
                                 struct levels **levels, struct cranny_error *why);

/* Per target: its values are known, and need neither samples nor a fit. */
const bool *levels_found(const struct levels *levels);
bool levels_all_found(const struct levels *levels);

/* Samples that stand although values did change, as long as they changed by less than reuse_limit
 * where the sample's rays ended. Samples must say by `back` how often the sphere was doubled. */
struct sample_reuse *levels_reuse(struct levels *levels);

/* Let the next bake have the samples. */
enum cranny_status levels_keep(struct levels *levels, struct cranny_error *why);

void levels_destroy(struct levels **levels);

#endif
