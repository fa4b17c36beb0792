#include "frame/frame.h"
#include "trace/texel.h"

static void apply_texture(const struct cranny_frame *frame,
                          const struct cranny_color_texture *texture, const double st[2],
                          float color[3])
{
    struct texel_cell cell;
    if (!texel_cell(texture->width, texture->height, texture->wrap_u, texture->wrap_v, st, &cell))
        return;
    for (int i = 0; i < 3; i++) {
        float values[4];
        for (int k = 0; k < 4; k++)
            values[k] = frame->decode[texture->rgb[3 * cell.texels[k] + (size_t)i]];
        color[i] *= texel_blend(&cell, values);
    }
}

void frame_color(const struct cranny_frame *frame, const struct cranny_hit *hit, uint16_t color[3])
{
    float base[3] = {1, 1, 1};
    if (hit->instance != UINT32_MAX) {
        const struct cranny_mesh *mesh = cranny_scene_mesh(
            frame->scene, cranny_scene_instance(frame->scene, hit->instance)->mesh);
        const struct cranny_material *material =
            cranny_scene_material(frame->scene, mesh->triangle_materials[hit->triangle]);
        memcpy(base, material->base_color, sizeof base);
        if (material->color_texture >= 0 && mesh->texcoords) {
            double st[2];
            texel_place(material, mesh, hit->triangle, hit->u, hit->v, st);
            apply_texture(
                frame, cranny_scene_color_texture(frame->scene, (uint32_t)material->color_texture),
                st, base);
        }
    }
    for (int i = 0; i < 3; i++)
        color[i] = (uint16_t)(65535 * clamp_float(base[i], 0, 1) + 0.5f);
}
