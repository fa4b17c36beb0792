/* Base colour textures, kept small: pictures show them, nothing is measured by them. */
#include "base/image.h"
#include "base/srgb.h"
#include "scene/gltf.h"

#define SIDE_MAX 512 /* texels */

/* The mean of a block of texels, in linear light. */
static void mean_texel(const struct image *image, const float decode[256], uint32_t x, uint32_t y,
                       uint32_t step, uint8_t rgb[3])
{
    const uint32_t right = x + step < image->width ? x + step : image->width;
    const uint32_t bottom = y + step < image->height ? y + step : image->height;
    float sum[3] = {0};
    for (uint32_t row = y; row < bottom; row++)
        for (uint32_t column = x; column < right; column++) {
            const uint8_t *texel = image->rgba + 4 * ((size_t)row * image->width + column);
            for (int i = 0; i < 3; i++)
                sum[i] += decode[texel[i]];
        }
    for (int i = 0; i < 3; i++)
        rgb[i] = srgb_encode(sum[i] / ((float)(right - x) * (float)(bottom - y)));
}

static void shrink(const struct image *image, uint32_t step, struct cranny_color_texture *texture,
                   uint8_t *rgb)
{
    float decode[256];
    for (int i = 0; i < 256; i++)
        decode[i] = srgb_decode((uint8_t)i);
    for (uint32_t y = 0; y < texture->height; y++)
        for (uint32_t x = 0; x < texture->width; x++, rgb += 3) {
            if (step > 1)
                mean_texel(image, decode, x * step, y * step, step, rgb);
            else
                memcpy(rgb, image->rgba + 4 * ((size_t)y * image->width + x), 3);
        }
}

enum cranny_status color_add(struct gltf *gltf, const struct image *image,
                             const struct texture_key *key, int *color, struct cranny_error *why)
{
    struct cranny_scene *scene = gltf->scene;
    const uint32_t side = image->width > image->height ? image->width : image->height;
    const uint32_t step = (side + SIDE_MAX - 1) / SIDE_MAX;
    struct cranny_color_texture texture = {.width = (image->width + step - 1) / step,
                                           .height = (image->height + step - 1) / step,
                                           .wrap_u = key->wrap_u,
                                           .wrap_v = key->wrap_v};
    const size_t count = (size_t)texture.width * texture.height;
    enum cranny_status status = document_reserve(gltf->document, 3 * count, "colour texture", why);
    if (status != CRANNY_OK)
        return status;
    uint8_t *rgb = alloc_array(count, 3);
    if (!rgb || !grow_array((void **)&scene->colors, &scene->color_capacity, scene->color_count + 1,
                            sizeof *scene->colors)) {
        free(rgb);
        return fail_memory(why, "colour texture");
    }
    shrink(image, step, &texture, rgb);
    texture.rgb = rgb;
    *color = (int)scene->color_count;
    scene->colors[scene->color_count++] = texture;
    return CRANNY_OK;
}
