/* Four coefficients an instance: what its surroundings do to it, as a linear function.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2, eq. 3.
 */
#ifndef BAKE_LINEAR_H
#define BAKE_LINEAR_H

#include "bake/bake.h"

struct cranny_tracer;

/* A set for each mesh that has linear instances: of the mesh by itself in the open (`local`
 * isolated), or ones. */
enum cranny_status linear_local(struct cranny_bake *bake, const struct cranny_scene *scene,
                                const struct cranny_bake_params *params, struct cranny_error *why);

/* Fit the coefficients of all linear instances, whose sets are there. */
enum cranny_status linear_fit(struct cranny_bake *bake, const struct cranny_scene *scene,
                              const struct cranny_tracer *tracer,
                              const struct cranny_bake_params *params, struct cranny_error *why);

#endif
