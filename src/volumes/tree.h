/* Which polygons have volumes near a box. */
#ifndef VOLUMES_TREE_H
#define VOLUMES_TREE_H

#include "volumes/volumes.h"

/* A box relative to the scene's centre, and the δ for which volumes count. */
struct tree_query {
    float low[3], high[3], delta;
    float extra; /* further reach, per δ: 1 where backs of single-sided polygons hide, too */
};

static inline bool tree_meets(const struct volume_box *box, const struct tree_query *q)
{
    bool meets = true;
    for (int k = 0; k < 3; k++) {
        meets &= box->low[k] - q->delta * (box->reach_low[k] + q->extra) <= q->high[k];
        meets &= box->high[k] + q->delta * (box->reach_high[k] + q->extra) >= q->low[k];
    }
    return meets;
}

/* From node `at` on, the first leaf that may hold such polygons; node_count: none. Go on from the
 * leaf's `skip`. */
static inline uint32_t tree_next(const struct cranny_volumes *volumes, const struct tree_query *q,
                                 uint32_t at)
{
    while (at < volumes->node_count) {
        const struct volume_node *node = &volumes->nodes[at];
        if (!tree_meets(&node->box, q))
            at = node->skip;
        else if (node->count > 0)
            return at;
        else
            at++;
    }
    return at;
}

#endif
