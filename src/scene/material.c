/* Materials as occlusion sees them: how much of a hit counts. */
#include "base/image.h"
#include "scene/gltf.h"

/* The texture info and factor that hold the alpha: glTF 2.0 3.9.2, or those of
 * KHR_materials_pbrSpecularGlossiness, which take precedence where present. */
static void alpha_source(const json_t *material, json_t **info, const char **factor,
                         const json_t **owner)
{
    const json_t *glossiness = extension_of(material, "KHR_materials_pbrSpecularGlossiness");
    *owner = glossiness ? glossiness : json_object_get(material, "pbrMetallicRoughness");
    *factor = glossiness ? "diffuseFactor" : "baseColorFactor";
    *info = json_object_get(*owner, glossiness ? "diffuseTexture" : "baseColorTexture");
}

static enum cranny_status read_alpha_mode(const struct gltf *gltf, const struct place *place,
                                          const json_t *object, struct cranny_material *material,
                                          struct cranny_error *why)
{
    const json_t *mode = json_object_get(object, "alphaMode");
    const char *text = mode ? json_string_value(mode) : "OPAQUE";
    if (text && !strcmp(text, "MASK"))
        material->alpha_mode = CRANNY_ALPHA_MASK;
    else if (text && !strcmp(text, "BLEND"))
        material->alpha_mode = CRANNY_ALPHA_BLEND;
    else if (!text || strcmp(text, "OPAQUE"))
        return fail_at(gltf->document, place, why, CRANNY_INPUT,
                       "alphaMode must be OPAQUE, MASK or BLEND");
    material->alpha_cutoff = (float)loose_number(object, "alphaCutoff", 0.5);
    if (!isfinite(material->alpha_cutoff))
        material->alpha_cutoff = 0.5f;
    material->double_sided = json_is_true(json_object_get(object, "doubleSided"));
    return CRANNY_OK;
}

/* KHR_materials_transmission: what passes through does not occlude. Glass is exported as OPAQUE
 * with transmission, so that it has to become BLEND here. */
static void apply_transmission(const json_t *object, struct cranny_material *material)
{
    const json_t *extension = extension_of(object, "KHR_materials_transmission");
    const float through = (float)loose_number(extension, "transmissionFactor", 0);
    if (!(through > 0) || json_object_get(extension, "transmissionTexture") ||
        material->alpha_mode == CRANNY_ALPHA_MASK)
        return;
    if (material->alpha_mode == CRANNY_ALPHA_OPAQUE)
        material->opacity = 1;
    material->alpha_mode = CRANNY_ALPHA_BLEND;
    material->opacity *= 1 - fminf(through, 1);
}

static enum cranny_status read_material(struct gltf *gltf, size_t index, struct cranny_error *why)
{
    const struct place place = {NULL, "materials", index};
    const struct document *document = gltf->document;
    json_t *object, *info;
    const json_t *owner;
    const char *factor;
    double color[4] = {1, 1, 1, 1};
    struct cranny_material material = cranny_material_default();
    enum cranny_status status = document_item(document, "materials", index, &object, why);
    if (status == CRANNY_OK)
        status = read_alpha_mode(gltf, &place, object, &material, why);
    if (status != CRANNY_OK)
        return status;
    alpha_source(object, &info, &factor, &owner);
    status = field_numbers(document, &place, owner, factor, 4, color, NULL, why);
    if (status != CRANNY_OK)
        return status;
    for (int i = 0; i < 4; i++)
        material.base_color[i] = clamp_float((float)color[i], 0, 1);
    material.opacity = material.base_color[3];
    apply_transmission(object, &material);
    material.name = loose_name(object);
    return cranny_scene_add_material(gltf->scene, &material, NULL, why);
}

enum cranny_status materials_read(struct gltf *gltf, struct cranny_error *why)
{
    gltf->default_material = -1;
    gltf->material_count = document_count(gltf->document, "materials");
    gltf->materials = alloc_array(gltf->material_count, sizeof *gltf->materials);
    enum cranny_status status = gltf->materials ? CRANNY_OK : fail_memory(why, "materials");
    for (size_t i = 0; status == CRANNY_OK && i < gltf->material_count; i++)
        status = read_material(gltf, i, why);
    return status;
}

/* KHR_texture_transform: scale, then rotate, then offset. The rotation's sense is that of the
 * extension's example (a quadrant turned clockwise), which its GLSL once contradicted. */
static void read_uv_transform(const json_t *info, float transform[6], int *texcoord)
{
    const json_t *extension = extension_of(info, "KHR_texture_transform");
    const json_t *offset = json_object_get(extension, "offset");
    const json_t *scale = json_object_get(extension, "scale");
    const double set = loose_number(info, "texCoord", 0);
    const double other = loose_number(extension, "texCoord", set);
    *texcoord = other >= 0 && other < 1000 ? (int)other : 0;
    if (!extension)
        return;
    const double turn = loose_number(extension, "rotation", 0), c = cos(turn), s = sin(turn);
    const bool scaled = json_array_size(scale) == 2, moved = json_array_size(offset) == 2;
    const double su = scaled ? json_number_value(json_array_get(scale, 0)) : 1;
    const double sv = scaled ? json_number_value(json_array_get(scale, 1)) : 1;
    const double values[6] = {
        c * su,  s * sv, moved ? json_number_value(json_array_get(offset, 0)) : 0,
        -s * su, c * sv, moved ? json_number_value(json_array_get(offset, 1)) : 0};
    for (int i = 0; i < 6; i++)
        if (!isfinite((float)values[i]))
            return;
    for (int i = 0; i < 6; i++)
        transform[i] = (float)values[i];
}

static enum cranny_wrap read_wrap(const json_t *sampler, const char *name)
{
    const double mode = loose_number(sampler, name, 10497); /* any number, past int's range too */
    return mode == 33071   ? CRANNY_WRAP_CLAMP
           : mode == 33648 ? CRANNY_WRAP_MIRROR
                           : CRANNY_WRAP_REPEAT;
}

/* The texture's image; -1 when no image that Cranny reads is named. */
static enum cranny_status find_image(const struct gltf *gltf, const struct place *place,
                                     const json_t *info, struct texture_key *key,
                                     struct cranny_error *why)
{
    const struct document *document = gltf->document;
    int texture, sampler;
    key->image = -1;
    enum cranny_status status = field_index(document, place, info, "index",
                                            document_count(document, "textures"), &texture, why);
    if (status != CRANNY_OK || texture < 0)
        return status;
    const struct place at = {NULL, "textures", (size_t)texture};
    json_t *object;
    status = document_item(document, "textures", (size_t)texture, &object, why);
    if (status == CRANNY_OK)
        status = field_index(document, &at, object, "sampler", document_count(document, "samplers"),
                             &sampler, why);
    if (status == CRANNY_OK)
        status = field_index(document, &at, object, "source", document_count(document, "images"),
                             &key->image, why);
    if (status != CRANNY_OK)
        return status;
    const json_t *modes =
        sampler < 0 ? NULL : json_array_get(document_array(document, "samplers"), (size_t)sampler);
    key->wrap_u = read_wrap(modes, "wrapS");
    key->wrap_v = read_wrap(modes, "wrapT");
    if (key->image < 0)
        warn_at(document, &at, "has no PNG or JPEG source; taken as opaque");
    return CRANNY_OK;
}

/* The alpha of an image as a texture of the scene; *texture -1 when it is opaque throughout. */
static enum cranny_status add_alpha(struct gltf *gltf, const struct image *image,
                                    const struct texture_key *key, int *texture,
                                    struct cranny_error *why)
{
    const size_t count = (size_t)image->width * image->height;
    uint8_t least = 255;
    for (size_t i = 0; i < count; i++)
        least = image->rgba[4 * i + 3] < least ? image->rgba[4 * i + 3] : least;
    *texture = -1;
    if (least == 255)
        return CRANNY_OK;
    enum cranny_status status = document_reserve(gltf->document, count, "alpha texture", why);
    for (size_t i = 0; i < count; i++)
        image->rgba[i] = image->rgba[4 * i + 3];
    const struct cranny_alpha_texture plane = {image->width, image->height, key->wrap_u,
                                               key->wrap_v, image->rgba};
    uint32_t index;
    if (status == CRANNY_OK)
        status = cranny_scene_add_texture(gltf->scene, &plane, &index, why);
    if (status == CRANNY_OK)
        *texture = (int)index;
    return status;
}

/* A broken image is a warning, too large a one an error: a bake without it would mislead. */
static enum cranny_status decode_texture(struct gltf *gltf, struct texture_key *key,
                                         struct cranny_error *why)
{
    struct document *document = gltf->document;
    const uint8_t *data;
    uint8_t *owned;
    size_t size;
    struct cranny_error problem = {0};
    struct image image = {0};
    char name[64];
    key->texture = key->color = -1;
    snprintf(name, sizeof name, "/images/%d", key->image);
    enum cranny_status status =
        document_image(document, (size_t)key->image, &data, &size, &owned, &problem);
    uint64_t pixels = (document->memory_limit - document->memory_used) / 4;
    if (status == CRANNY_OK) {
        status = image_decode(data, size, name, pixels, &image, &problem);
        free(owned);
    }
    if (status == CRANNY_INPUT || status == CRANNY_FAILED) {
        hook_warn(document->hooks, "%s; taken as opaque", problem.message);
        return CRANNY_OK;
    }
    if (status != CRANNY_OK)
        return fail(why, status, "%s", problem.message);
    if (gltf->colors)
        status = color_add(gltf, &image, key, &key->color, why);
    if (status == CRANNY_OK)
        status = add_alpha(gltf, &image, key, &key->texture, why);
    image_free(&image);
    return status;
}

static enum cranny_status find_texture(struct gltf *gltf, struct texture_key *key,
                                       struct cranny_error *why)
{
    for (size_t i = 0; i < gltf->texture_key_count; i++) {
        const struct texture_key *known = &gltf->texture_keys[i];
        if (known->image == key->image && known->wrap_u == key->wrap_u &&
            known->wrap_v == key->wrap_v) {
            key->texture = known->texture;
            key->color = known->color;
            return CRANNY_OK;
        }
    }
    enum cranny_status status = decode_texture(gltf, key, why);
    if (status != CRANNY_OK)
        return status;
    if (!grow_array((void **)&gltf->texture_keys, &gltf->texture_key_capacity,
                    gltf->texture_key_count + 1, sizeof *gltf->texture_keys))
        return fail_memory(why, "textures");
    gltf->texture_keys[gltf->texture_key_count++] = *key;
    return CRANNY_OK;
}

static enum cranny_status prepare(struct gltf *gltf, size_t index, struct cranny_error *why)
{
    struct cranny_material *material = &gltf->scene->materials[index];
    struct material_state *state = &gltf->materials[index];
    const struct place place = {NULL, "materials", index};
    json_t *info;
    const json_t *owner;
    const char *factor;
    struct texture_key key = {.image = -1, .texture = -1, .color = -1};
    const bool masked = material->alpha_mode != CRANNY_ALPHA_OPAQUE;
    *state = (struct material_state){.prepared = true, .texcoord = -1};
    alpha_source(json_array_get(document_array(gltf->document, "materials"), index), &info, &factor,
                 &owner);
    if (!info || !(masked || gltf->colors))
        return CRANNY_OK;
    enum cranny_status status = find_image(gltf, &place, info, &key, why);
    if (status == CRANNY_OK && key.image >= 0)
        status = find_texture(gltf, &key, why);
    material->alpha_texture = masked ? key.texture : -1;
    material->color_texture = key.color;
    if (status != CRANNY_OK || (material->alpha_texture < 0 && material->color_texture < 0))
        return status;
    read_uv_transform(info, material->uv_transform, &state->texcoord);
    return CRANNY_OK;
}

enum cranny_status material_use(struct gltf *gltf, int material, uint32_t *index, int *texcoord,
                                struct cranny_error *why)
{
    *texcoord = -1;
    if (material < 0 && gltf->default_material < 0) {
        const struct cranny_material plain = cranny_material_default();
        enum cranny_status status = cranny_scene_add_material(gltf->scene, &plain, index, why);
        if (status != CRANNY_OK)
            return status;
        gltf->default_material = (int)*index;
    }
    *index = (uint32_t)(material < 0 ? gltf->default_material : material);
    if (material < 0)
        return CRANNY_OK;
    enum cranny_status status = CRANNY_OK;
    if (!gltf->materials[material].prepared)
        status = prepare(gltf, (size_t)material, why);
    *texcoord = gltf->materials[material].texcoord;
    return status;
}
