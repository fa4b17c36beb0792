#include "scene/import.h"

#include "base/image.h"
#include "scene/document_parts.h"

#include <assimp/material.h>
#include <strings.h>

#define PIXEL_LIMIT (1ull << 28)

/* A texture as a material names it. */
struct slot {
    struct aiString path;
    unsigned texcoord;
    enum cranny_wrap wrap_u, wrap_v;
};

static enum cranny_wrap wrap_of(enum aiTextureMapMode mode)
{
    return mode == aiTextureMapMode_Clamp || mode == aiTextureMapMode_Decal ? CRANNY_WRAP_CLAMP
           : mode == aiTextureMapMode_Mirror                                ? CRANNY_WRAP_MIRROR
                                                                            : CRANNY_WRAP_REPEAT;
}

static bool find_slot(const struct aiMaterial *material, enum aiTextureType type, struct slot *slot)
{
    enum aiTextureMapMode modes[2] = {aiTextureMapMode_Wrap, aiTextureMapMode_Wrap};
    slot->texcoord = 0;
    if (aiGetMaterialTexture(material, type, 0, &slot->path, NULL, &slot->texcoord, NULL, NULL,
                             modes, NULL) != aiReturn_SUCCESS ||
        !slot->path.length)
        return false;
    if (slot->texcoord >= AI_MAX_NUMBER_OF_TEXTURECOORDS)
        slot->texcoord = 0;
    slot->wrap_u = wrap_of(modes[0]);
    slot->wrap_v = wrap_of(modes[1]);
    return true;
}

static const char *base_name(const char *path)
{
    const char *name = path;
    for (const char *c = path; *c; c++)
        if (*c == '/' || *c == '\\')
            name = c + 1;
    return name;
}

static const struct aiTexture *embedded(const struct aiScene *scene, const char *path)
{
    if (path[0] == '*') {
        const long index = strtol(path + 1, NULL, 10);
        return index >= 0 && index < (long)scene->mNumTextures ? scene->mTextures[index] : NULL;
    }
    for (unsigned i = 0; i < scene->mNumTextures; i++) {
        const char *name = scene->mTextures[i]->mFilename.data;
        if (*name && strcasecmp(base_name(name), base_name(path)) == 0)
            return scene->mTextures[i];
    }
    return NULL;
}

/* Embedded texels become a PNG; embedded files are taken as they are. */
static enum cranny_status unpack_embedded(const struct aiTexture *texture, uint8_t **data,
                                          size_t *size, struct cranny_error *why)
{
    const uint64_t count =
        texture->mHeight ? (uint64_t)texture->mWidth * texture->mHeight : texture->mWidth;
    if (!count || (texture->mHeight && (count > PIXEL_LIMIT || texture->mWidth > 1u << 20)))
        return fail(why, CRANNY_INPUT, "an embedded texture is empty or too large");
    uint8_t *bytes = alloc_array((size_t)count, texture->mHeight ? 4 : 1);
    if (!bytes)
        return fail_memory(why, "texture");
    if (!texture->mHeight) {
        memcpy(bytes, texture->pcData, (size_t)count);
        *data = bytes;
        *size = (size_t)count;
        return CRANNY_OK;
    }
    for (size_t i = 0; i < count; i++) {
        const struct aiTexel texel = texture->pcData[i];
        memcpy(bytes + 4 * i, (uint8_t[4]){texel.r, texel.g, texel.b, texel.a}, 4);
    }
    enum cranny_status status = png_encode((int)texture->mWidth, (int)texture->mHeight, 4, bytes,
                                           4 * (size_t)texture->mWidth, data, size, why);
    free(bytes);
    return status;
}

/* The file of a texture. Paths from other machines are tried by their last step, too. */
static enum cranny_status fetch(const struct import *import, const char *path, uint8_t **data,
                                size_t *size, struct cranny_error *why)
{
    const struct aiTexture *inside = embedded(import->scene, path);
    *data = NULL;
    if (inside)
        return unpack_embedded(inside, data, size, why);
    enum cranny_status status =
        document_fetch_uri(&import->place, path, "texture", data, size, why);
    const char *name = base_name(path);
    if (status == CRANNY_INPUT && name != path && *name &&
        document_fetch_uri(&import->place, name, "texture", data, size, NULL) == CRANNY_OK)
        return CRANNY_OK;
    return status;
}

static const char *file_type(const uint8_t *data, size_t size)
{
    if (size >= 8 && memcmp(data, "\x89PNG\r\n\x1a\n", 8) == 0)
        return "image/png";
    return size >= 3 && memcmp(data, "\xff\xd8\xff", 3) == 0 ? "image/jpeg" : NULL;
}

/* The file of a texture that glTF can hold. */
static enum cranny_status fetch_image(const struct import *import, const char *path, uint8_t **data,
                                      size_t *size, const char **type, struct cranny_error *why)
{
    enum cranny_status status = fetch(import, path, data, size, why);
    if (status != CRANNY_OK)
        return status;
    *type = file_type(*data, *size);
    if (*type)
        return CRANNY_OK;
    free(*data);
    *data = NULL;
    return fail(why, CRANNY_INPUT, "%s: texture '%.200s' is neither PNG nor JPEG",
                import->place.path, path);
}

static bool has_holes(const struct image *image)
{
    const size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++)
        if (image->rgba[4 * i + 3] != 255)
            return true;
    return false;
}

/* glTF keeps opacity in the base colour's alpha: one image of both. The opacity is the map's own
 * alpha where it has one, else its red. */
static void merge_opacity(struct image *opacity, const struct image *color)
{
    const bool by_alpha = has_holes(opacity);
    for (uint32_t y = 0; y < opacity->height; y++)
        for (uint32_t x = 0; x < opacity->width; x++) {
            uint8_t *texel = opacity->rgba + 4 * ((size_t)y * opacity->width + x);
            const uint8_t alpha = texel[by_alpha ? 3 : 0];
            memset(texel, 255, 3);
            if (color->rgba) {
                const size_t u = (size_t)x * color->width / opacity->width;
                const size_t v = (size_t)y * color->height / opacity->height;
                memcpy(texel, color->rgba + 4 * (v * color->width + u), 3);
            }
            texel[3] = alpha;
        }
}

static enum cranny_status decode_slot(const struct import *import, const struct slot *slot,
                                      struct image *image, struct cranny_error *why)
{
    uint8_t *data;
    size_t size;
    enum cranny_status status = fetch(import, slot->path.data, &data, &size, why);
    if (status != CRANNY_OK)
        return status;
    status = image_decode(data, size, slot->path.data, PIXEL_LIMIT, image, why);
    free(data);
    return status;
}

static enum cranny_status masked_texture(struct import *import, const struct slot *mask,
                                         const struct slot *color, size_t *texture,
                                         struct cranny_error *why)
{
    struct image opacity = {0}, base = {0};
    uint8_t *png = NULL;
    size_t size;
    enum cranny_status status = decode_slot(import, mask, &opacity, why);
    if (status != CRANNY_OK)
        return status;
    if (color && decode_slot(import, color, &base, NULL) != CRANNY_OK)
        base = (struct image){0};
    merge_opacity(&opacity, &base);
    status = png_encode((int)opacity.width, (int)opacity.height, 4, opacity.rgba,
                        4 * (size_t)opacity.width, &png, &size, why);
    if (status == CRANNY_OK)
        *texture =
            builder_texture(&import->builder, png, size, "image/png", mask->wrap_u, mask->wrap_v);
    free(png);
    image_free(&opacity);
    image_free(&base);
    return status;
}

static enum cranny_status plain_texture(struct import *import, const struct slot *slot,
                                        size_t *texture, struct cranny_error *why)
{
    uint8_t *data;
    size_t size;
    const char *type;
    enum cranny_status status = fetch_image(import, slot->path.data, &data, &size, &type, why);
    if (status == CRANNY_OK)
        *texture = builder_texture(&import->builder, data, size, type, slot->wrap_u, slot->wrap_v);
    free(data);
    return status;
}

static float number_or(const struct aiMaterial *material, const char *key, float fallback)
{
    float value;
    return aiGetMaterialFloatArray(material, key, 0, 0, &value, NULL) == aiReturn_SUCCESS &&
                   isfinite(value)
               ? value
               : fallback;
}

static void read_values(const struct aiMaterial *material, struct cranny_material *out)
{
    struct aiColor4D color = {1, 1, 1, 1};
    int two_sided = 0;
    if (aiGetMaterialColor(material, AI_MATKEY_BASE_COLOR, &color) != aiReturn_SUCCESS)
        aiGetMaterialColor(material, AI_MATKEY_COLOR_DIFFUSE, &color);
    const float rgb[3] = {color.r, color.g, color.b};
    for (int c = 0; c < 3; c++)
        out->base_color[c] = isfinite(rgb[c]) ? clamp_float(rgb[c], 0, 1) : 1;
    out->opacity = clamp_float(number_or(material, "$mat.opacity", 1), 0, 1);
    if (out->opacity < 1)
        out->alpha_mode = CRANNY_ALPHA_BLEND;
    out->double_sided = aiGetMaterialIntegerArray(material, AI_MATKEY_TWOSIDED, &two_sided, NULL) ==
                            aiReturn_SUCCESS &&
                        two_sided;
}

static enum cranny_status import_material(struct import *import, const struct aiMaterial *material,
                                          struct cranny_error *why)
{
    struct cranny_material out = cranny_material_default();
    struct aiString name = {0};
    struct slot color, mask;
    struct cranny_error problem = {0};
    size_t texture = SIZE_MAX;
    enum cranny_status status = CRANNY_OK;
    read_values(material, &out);
    if (aiGetMaterialString(material, AI_MATKEY_NAME, &name) == aiReturn_SUCCESS)
        out.name = name.data;
    const bool has_color = find_slot(material, aiTextureType_BASE_COLOR, &color) ||
                           find_slot(material, aiTextureType_DIFFUSE, &color);
    const bool has_mask = find_slot(material, aiTextureType_OPACITY, &mask);
    if (has_mask)
        status = masked_texture(import, &mask, has_color ? &color : NULL, &texture, &problem);
    if (has_mask && status == CRANNY_OK)
        out.alpha_mode = CRANNY_ALPHA_MASK;
    if (status == CRANNY_INPUT)
        hook_warn(import->place.hooks, "%s; left out", problem.message);
    if (texture == SIZE_MAX && has_color && (status == CRANNY_OK || status == CRANNY_INPUT)) {
        status = plain_texture(import, &color, &texture, &problem);
        if (status == CRANNY_INPUT)
            hook_warn(import->place.hooks, "%s; left out", problem.message);
    }
    if (status != CRANNY_OK && status != CRANNY_INPUT)
        return fail(why, status, "%s", problem.message);
    builder_material(&import->builder, &out, texture,
                     (int)(out.alpha_mode == CRANNY_ALPHA_MASK ? mask.texcoord
                           : has_color                         ? color.texcoord
                                                               : 0));
    return CRANNY_OK;
}

enum cranny_status import_materials(struct import *import, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (unsigned i = 0; status == CRANNY_OK && i < import->scene->mNumMaterials; i++)
        status = import_material(import, import->scene->mMaterials[i], why);
    return status;
}
