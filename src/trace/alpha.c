/* Alpha at a hit: masks by their cutoff, blends by dice that depend on the ray and the triangle
 * only, so that traversal order does not matter. */
#include "base/sequence.h"
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

/* Into one period of the wrap mode: [0,1), [0,1], or [0,2) for the mirrored one. */
static double wrap_coordinate(double s, enum cranny_wrap wrap)
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
static uint32_t wrap_texel(int64_t index, int64_t size, enum cranny_wrap wrap)
{
    if (wrap == CRANNY_WRAP_REPEAT)
        return (uint32_t)((index + size) % size);
    if (wrap == CRANNY_WRAP_MIRROR && index >= size)
        index = 2 * size - 1 - index;
    return (uint32_t)(index < 0 ? 0 : index >= size ? size - 1 : index);
}

static float texture_alpha(const struct cranny_alpha_texture *texture, double s, double t)
{
    if (!isfinite(s) || !isfinite(t))
        return 1;
    const double x = wrap_coordinate(s, texture->wrap_u) * texture->width - 0.5;
    const double y = wrap_coordinate(t, texture->wrap_v) * texture->height - 0.5;
    const double x0 = floor(x), y0 = floor(y);
    const float fx = (float)(x - x0), fy = (float)(y - y0);
    size_t columns[2], rows[2];
    for (int i = 0; i < 2; i++) {
        columns[i] = wrap_texel((int64_t)x0 + i, texture->width, texture->wrap_u);
        rows[i] =
            wrap_texel((int64_t)y0 + i, texture->height, texture->wrap_v) * (size_t)texture->width;
    }
    const uint8_t *alpha = texture->alpha;
    const float top = alpha[rows[0] + columns[0]] * (1 - fx) + alpha[rows[0] + columns[1]] * fx;
    const float bottom = alpha[rows[1] + columns[0]] * (1 - fx) + alpha[rows[1] + columns[1]] * fx;
    return (top * (1 - fy) + bottom * fy) * (1.0f / 255);
}

static float alpha_at(const struct cranny_scene *scene, const struct cranny_material *material,
                      const struct cranny_mesh *mesh, uint32_t triangle, float u, float v)
{
    if (material->alpha_texture < 0 || !mesh->texcoords)
        return material->opacity;
    const uint32_t *corners = mesh->triangles[triangle];
    const float *a = mesh->texcoords[corners[0]], *b = mesh->texcoords[corners[1]],
                *c = mesh->texcoords[corners[2]];
    const double w = 1.0 - u - v;
    const double s = w * a[0] + u * (double)b[0] + v * (double)c[0];
    const double t = w * a[1] + u * (double)b[1] + v * (double)c[1];
    const float *m = material->uv_transform;
    const struct cranny_alpha_texture *texture =
        cranny_scene_texture(scene, (uint32_t)material->alpha_texture);
    return material->opacity *
           texture_alpha(texture, m[0] * s + m[1] * t + m[2], m[3] * s + m[4] * t + m[5]);
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
