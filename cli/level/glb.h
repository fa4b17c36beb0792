/* A world as binary glTF 2.0. */
#ifndef LEVEL_GLB_H
#define LEVEL_GLB_H

#include "world.h"

/* The whole file, malloced; NULL when memory ran out or it would pass 4 GiB. */
uint8_t *glb_encode(const struct world *world, size_t *size);

#endif
