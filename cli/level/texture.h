/* The level's pictures: pickets, leaves, grass blades; colour with an alpha mask. */
#ifndef LEVEL_TEXTURE_H
#define LEVEL_TEXTURE_H

#include <stddef.h>
#include <stdint.h>

enum texture { TEXTURE_FENCE, TEXTURE_LEAVES, TEXTURE_GRASS, TEXTURE_COUNT };

/* The texture as PNG, malloced; NULL when memory ran out. */
uint8_t *texture_png(enum texture texture, size_t *size);

#endif
