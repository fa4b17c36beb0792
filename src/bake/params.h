/* Checking what a caller asked of a bake. */
#ifndef BAKE_PARAMS_H
#define BAKE_PARAMS_H

#include <cranny/bake.h>

/* Every row of the table, and what the rows cannot say of one another. */
enum cranny_status bake_params_check(const struct cranny_bake_params *params,
                                     struct cranny_error *why);

#endif
