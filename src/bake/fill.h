/* Values for vertices without a valid sample, so that none is left black. */
#ifndef BAKE_FILL_H
#define BAKE_FILL_H

#include "bake/surface.h"

/* Spread the values of known unknowns over their unsampled neighbours, ring by ring, each taking
 * the mean of the rings before. Pieces without any known one keep what `x` holds; their number goes
 * to `lost`. `known` stays as it was. */
enum cranny_status fill_unknowns(const struct surface *surface, const uint8_t *known,
                                 double (*x)[2], uint64_t *lost, struct cranny_error *why);

#endif
