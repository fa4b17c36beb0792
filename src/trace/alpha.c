/* Alpha at a hit: masks by their cutoff, blends by dice that depend on the ray and the triangle
 * only, so that traversal order does not matter. */
#include "base/sequence.h"
#include "trace/texel.h"
#include "trace/tracer.h"

enum triangle_class alpha_class(const struct cranny_scene *scene, const struct cranny_mesh *mesh,
                                uint32_t triangle)
{
    const struct cranny_material *material =
        cranny_scene_material(scene, mesh->triangle_materials[triangle]);
    const bool textured = material->alpha_texture >= 0 && mesh->texcoords;
    switch (material->alpha_mode) {
    case CRANNY_ALPHA_OPAQUE:
        return TRIANGLE_SOLID;
    case CRANNY_ALPHA_MASK:
        if (material->alpha_cutoff <= 0)
            return TRIANGLE_SOLID;
        if (material->opacity < material->alpha_cutoff)
            return TRIANGLE_IGNORED;
        return textured ? TRIANGLE_FILTERED : TRIANGLE_SOLID;
    case CRANNY_ALPHA_BLEND:
        if (material->opacity <= 0)
            return TRIANGLE_IGNORED;
        return textured || material->opacity < 1 ? TRIANGLE_FILTERED : TRIANGLE_SOLID;
    }
    return TRIANGLE_SOLID;
}

static float texture_alpha(const struct cranny_alpha_texture *texture, const double st[2])
{
    struct texel_cell cell;
    if (!texel_cell(texture->width, texture->height, texture->wrap_u, texture->wrap_v, st, &cell))
        return 1;
    float a[4];
    for (int k = 0; k < 4; k++)
        a[k] = texture->alpha[cell.texels[k]];
    return texel_blend(&cell, a) * (1.0f / 255);
}

static float alpha_at(const struct cranny_scene *scene, const struct cranny_material *material,
                      const struct cranny_mesh *mesh, uint32_t triangle, float u, float v)
{
    if (material->alpha_texture < 0 || !mesh->texcoords)
        return material->opacity;
    double st[2];
    texel_place(material, mesh, triangle, u, v, st);
    return material->opacity *
           texture_alpha(cranny_scene_texture(scene, (uint32_t)material->alpha_texture), st);
}

static bool hit_counts(const struct cranny_tracer *tracer, struct tracer_place place, float u,
                       float v, uint32_t ray)
{
    const struct cranny_mesh *mesh = cranny_scene_mesh(tracer->scene, place.mesh);
    const struct cranny_material *material =
        cranny_scene_material(tracer->scene, mesh->triangle_materials[place.triangle]);
    const bool turned = tracer->instances[place.instance].mirrored;
    const float alpha =
        alpha_at(tracer->scene, material, mesh, place.triangle, turned ? v : u, turned ? u : v);
    if (material->alpha_mode == CRANNY_ALPHA_MASK)
        return alpha >= material->alpha_cutoff;
    const uint32_t dice = hash_combine(hash_combine(ray, place.instance), place.triangle);
    return unit_from_u32(dice) < alpha;
}

void alpha_filter(const struct RTCFilterFunctionNArguments *args)
{
    const struct cranny_tracer *tracer = args->geometryUserPtr;
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] != -1)
            continue;
        const struct embree_candidate hit = embree_candidate(args, i);
        const struct tracer_place place =
            tracer_place(tracer, hit.geometry, hit.top, hit.primitive);
        if (!hit_counts(tracer, place, hit.u, hit.v, hit.ray))
            args->valid[i] = 0;
    }
}
