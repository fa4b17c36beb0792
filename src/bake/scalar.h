/* Shrubs and grass: one number an instance. */
#ifndef BAKE_SCALAR_H
#define BAKE_SCALAR_H

#include "bake/bake.h"

struct cranny_tracer;

/* Give each instance of treatment SCALAR what the ground under it has, as the constant of its
 * linear function, and one set of ones per mesh. `tracer`: with roles. Progress stage "scatter". */
enum cranny_status scalar_bake(struct cranny_bake *bake, const struct cranny_scene *scene,
                               const struct cranny_tracer *tracer,
                               const struct cranny_bake_params *params, struct cranny_error *why);

#endif
