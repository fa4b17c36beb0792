/* The numbers of a method, made ready once a frame. */
#ifndef SCREEN_CONSTANTS_H
#define SCREEN_CONSTANTS_H

#include "base/base.h"
#include "screen/kernels.h"

/* `viewport`: its size is what screen-space kernels are shares of. `half`: for a canvas of half the
 * resolution. Parameters are checked by the caller. */
void constants_make(struct screen_constants *constants, const struct cranny_screen_params *params,
                    const struct cranny_gbuffer *gbuffer, const struct cranny_rect *viewport,
                    bool half);

#endif
