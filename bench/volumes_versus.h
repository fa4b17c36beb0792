/* Volumes against rays on the same cores, over five scenes and three radii: a markdown table. */
#ifndef BENCH_VOLUMES_VERSUS_H
#define BENCH_VOLUMES_VERSUS_H

#include "views.h"

struct versus_options {
    int width, height, rays, runs;      /* rays: of the truth */
    const char *preset, *scene, *cache; /* scene: NULL for all */
};

enum cranny_status volumes_versus(const struct versus_options *options, struct cranny_error *why);

#endif
