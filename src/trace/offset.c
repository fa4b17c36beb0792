/* How far above its face a ray starts.
 *
 * Three roundings can put a face above a point on it: of the point, of the face's corners (each
 * half a unit in the last place of its coordinates, 2^-25 relative, in three axes), and of Embree's
 * v0 − origin and its dot product with the normal (2^-24 of the face's extent, a few times over).
 * A scan over coordinates to 1e5 and faces of 1 cm to 1 km (tests/gather.c) sees the first hits at
 * 2^-24; 2^-21 leaves 8 times that for the transforms of instances. */
#include "trace/tracer.h"

float ray_offset(const float position[3], float extent)
{
    const float largest = fmaxf(fabsf(position[0]), fmaxf(fabsf(position[1]), fabsf(position[2])));
    return 0x1p-21f * (largest + extent) + 0x1p-100f;
}
