/* Looking up textures: wrap modes and the four texels around a place. */
#ifndef TRACE_TEXEL_H
#define TRACE_TEXEL_H

#include "base/sequence.h"

#include <cranny/scene.h>

/* Into one period of the wrap mode: [0,1), [0,1], or [0,2) for the mirrored one. */
static inline double wrap_coordinate(double s, enum cranny_wrap wrap)
{
    switch (wrap) {
    case CRANNY_WRAP_REPEAT:
        return fraction(s);
    case CRANNY_WRAP_CLAMP:
        return s < 0 ? 0 : s > 1 ? 1 : s;
    case CRANNY_WRAP_MIRROR:
        return 2 * fraction(s / 2);
    }
    return s;
}

/* A texel index next to the wrapped coordinate: −1 … size, or to 2 × size for the mirrored one. */
static inline uint32_t wrap_texel(int64_t index, int64_t size, enum cranny_wrap wrap)
{
    if (wrap == CRANNY_WRAP_REPEAT)
        return (uint32_t)((index + size) % size);
    if (wrap == CRANNY_WRAP_MIRROR && index >= size)
        index = 2 * size - 1 - index;
    return (uint32_t)(index < 0 ? 0 : index >= size ? size - 1 : index);
}

/* The four texels around a place, top row first, and where between them it lies. */
struct texel_cell {
    size_t texels[4];
    float x, y;
};

/* False when the place is not finite. */
static inline bool texel_cell(uint32_t width, uint32_t height, enum cranny_wrap wrap_u,
                              enum cranny_wrap wrap_v, const double st[2], struct texel_cell *cell)
{
    if (!isfinite(st[0]) || !isfinite(st[1]))
        return false;
    const double x = wrap_coordinate(st[0], wrap_u) * width - 0.5;
    const double y = wrap_coordinate(st[1], wrap_v) * height - 0.5;
    const double x0 = floor(x), y0 = floor(y);
    cell->x = (float)(x - x0);
    cell->y = (float)(y - y0);
    for (int k = 0; k < 4; k++)
        cell->texels[k] = wrap_texel((int64_t)y0 + k / 2, height, wrap_v) * (size_t)width +
                          wrap_texel((int64_t)x0 + k % 2, width, wrap_u);
    return true;
}

/* Between the values of the four texels. */
static inline float texel_blend(const struct texel_cell *cell, const float values[4])
{
    const float top = values[0] * (1 - cell->x) + values[1] * cell->x;
    const float bottom = values[2] * (1 - cell->x) + values[3] * cell->x;
    return top * (1 - cell->y) + bottom * cell->y;
}

/* A hit's place in its material's texture; the mesh has texture coordinates. */
static inline void texel_place(const struct cranny_material *material,
                               const struct cranny_mesh *mesh, uint32_t triangle, float u, float v,
                               double st[2])
{
    const uint32_t *corners = mesh->triangles[triangle];
    const float *a = mesh->texcoords[corners[0]], *b = mesh->texcoords[corners[1]],
                *c = mesh->texcoords[corners[2]];
    const double w = 1.0 - u - v;
    const double s = w * a[0] + u * (double)b[0] + v * (double)c[0];
    const double t = w * a[1] + u * (double)b[1] + v * (double)c[1];
    const float *m = material->uv_transform;
    st[0] = m[0] * s + m[1] * t + m[2];
    st[1] = m[3] * s + m[4] * t + m[5];
}

#endif
