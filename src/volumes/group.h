/* Scattered pixels in an order in which neighbours are close in the world. */
#ifndef VOLUMES_GROUP_H
#define VOLUMES_GROUP_H

#include "volumes/frame.h"

#define GROUP_AXES 6
#define GROUP_MAX 65536 /* points sorted at once: bounds the memory */

struct group_point {
    struct pixel pixel;
    uint32_t to;          /* where its value goes */
    float at[GROUP_AXES]; /* place in units of δ, and weighed normal */
};

/* Sorts the points so that each TILE and each BLOCK of them lie close together and face one way:
 * a k-d tree's order. The same for every number of threads. */
void group_points(struct group_point *points, int count, int threads);

#endif
