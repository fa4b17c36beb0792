/* The mean alpha of masked and blended triangles (McGuire 2009, §5.3). The paper reads a low MIP
 * level; here evenly spread places of the triangle are looked up, which knows its outline. */
#include "base/sequence.h"
#include "trace/texel.h"
#include "volumes/volumes.h"

#define LOOKUPS 64

static float texture_alpha(const struct cranny_alpha_texture *texture, const double st[2])
{
    struct texel_cell cell;
    float values[4];
    if (!texel_cell(texture->width, texture->height, texture->wrap_u, texture->wrap_v, st, &cell))
        return 1;
    for (int k = 0; k < 4; k++)
        values[k] = texture->alpha[cell.texels[k]];
    return texel_blend(&cell, values) * (1.0f / 255);
}

/* What of a hit with that alpha counts, on average. */
static float coverage(const struct cranny_material *material, float alpha)
{
    if (material->alpha_mode == CRANNY_ALPHA_MASK)
        return alpha >= material->alpha_cutoff ? 1 : 0;
    return clamp_float(alpha, 0, 1);
}

float mean_alpha(const struct cranny_scene *scene, const struct cranny_mesh *mesh,
                 uint32_t triangle)
{
    const struct cranny_material *material =
        cranny_scene_material(scene, mesh->triangle_materials[triangle]);
    if (material->alpha_mode == CRANNY_ALPHA_OPAQUE)
        return 1;
    if (material->alpha_texture < 0 || !mesh->texcoords)
        return coverage(material, material->opacity);
    const struct cranny_alpha_texture *texture =
        cranny_scene_texture(scene, (uint32_t)material->alpha_texture);
    const double shift[2] = {0.5, 0.5};
    float sum = 0;
    for (uint32_t i = 0; i < LOOKUPS; i++) {
        double p[2], st[2];
        r2_point(i, shift, p);
        const bool folded = p[0] + p[1] > 1;
        const double u = folded ? 1 - p[0] : p[0], v = folded ? 1 - p[1] : p[1];
        texel_place(material, mesh, triangle, (float)u, (float)v, st);
        sum += coverage(material, material->opacity * texture_alpha(texture, st));
    }
    return sum / LOOKUPS;
}
