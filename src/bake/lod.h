/* Lower levels of detail take their values over from the finest one. */
#ifndef BAKE_LOD_H
#define BAKE_LOD_H

#include "bake/bake.h"

/* Resample onto the instances of treatment LOD and fit; sets are appended. Everything else has its
 * values. Progress stages "bvh", "resample", "solve". */
enum cranny_status lod_bake(struct cranny_bake *bake, const struct cranny_scene *scene,
                            const struct cranny_bake_params *params, struct cranny_error *why);

#endif
