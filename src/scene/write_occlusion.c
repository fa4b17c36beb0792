#include "scene/write.h"

#include "base/image.h"
#include "scene/accessor.h"

#define NO_MATERIAL SIZE_MAX
#define NO_SET UINT32_MAX
#define VARIANTS "KHR_materials_variants"

/* What is known of a material of the input. */
struct material_use {
    bool looked_at;
    bool kept;        /* it has an occlusion texture, which stays */
    bool plain;       /* a primitive without values uses it: the original must not change */
    bool named;       /* its warning has been given */
    uint64_t sets;    /* texture coordinate sets below 64 that its textures sample */
    uint32_t own_set; /* the set of the version that takes the original's place; NO_SET: none */
};

struct occlusion {
    struct write *write;
    struct material_use *materials;
    size_t material_count;    /* of the input */
    struct pair_map versions; /* (material or NO_MATERIAL, set) to the material with occlusion */
    struct pair_map zeros;    /* (count, 0) to an accessor of zeros */
    uint32_t **sets;          /* per group and primitive; NO_SET: nothing is written */
    size_t texture;           /* SIZE_MAX until it is needed */
    bool said_sets, said_unlit;
};

/* Collect the sets that texture references anywhere in `value` name: each has an `index`. */
static uint64_t sampled_sets(const json_t *value, bool skip_occlusion)
{
    uint64_t sets = 0;
    const char *key;
    const json_t *item;
    if (json_is_object(value) && json_is_integer(json_object_get(value, "index"))) {
        const json_t *set = json_object_get(value, "texCoord");
        const json_int_t number = json_is_integer(set) ? json_integer_value(set) : 0;
        sets |= number >= 0 && number < 64 ? 1ull << number : 0;
    }
    if (json_is_object(value)) {
        const json_t *set = json_object_get(value, "texCoord");
        if (json_is_integer(set) && json_integer_value(set) >= 0 && json_integer_value(set) < 64)
            sets |= 1ull << json_integer_value(set);
    }
    void *iter = json_object_iter((json_t *)(uintptr_t)value);
    for (; iter; iter = json_object_iter_next((json_t *)(uintptr_t)value, iter)) {
        key = json_object_iter_key(iter);
        item = json_object_iter_value(iter);
        if (!(skip_occlusion && strcmp(key, "occlusionTexture") == 0) &&
            (json_is_object(item) || json_is_array(item)))
            sets |= sampled_sets(item, false);
    }
    for (size_t i = 0; json_is_array(value) && i < json_array_size(value); i++)
        sets |= sampled_sets(json_array_get(value, i), false);
    return sets;
}

static const json_t *input_material(const struct occlusion *occlusion, size_t index)
{
    return json_array_get(json_object_get(occlusion->write->document->root, "materials"), index);
}

static const char *material_name(const json_t *material)
{
    const char *name = json_string_value(json_object_get(material, "name"));
    return name ? name : "";
}

static void look_at(struct occlusion *occlusion, size_t index)
{
    struct material_use *use = &occlusion->materials[index];
    if (use->looked_at)
        return;
    const json_t *material = input_material(occlusion, index);
    use->looked_at = true;
    use->kept = json_object_get(material, "occlusionTexture") && !occlusion->write->params->replace;
    use->sets = sampled_sets(material, true);
}

/* The material that `owner` (a primitive or a variant's mapping) names; NO_MATERIAL for none. */
static size_t material_of(const struct occlusion *occlusion, const json_t *owner)
{
    const json_t *index = json_object_get(owner, "material");
    if (!json_is_integer(index) || json_integer_value(index) < 0 ||
        (uint64_t)json_integer_value(index) >= occlusion->material_count)
        return NO_MATERIAL;
    return (size_t)json_integer_value(index);
}

static json_t *variant_mappings(const json_t *primitive)
{
    const json_t *extension = json_object_get(json_object_get(primitive, "extensions"), VARIANTS);
    return json_object_get(extension, "mappings");
}

/* Place i of the materials that a primitive can show: itself, then its variants. */
static json_t *material_owner(json_t *primitive, size_t i)
{
    return i ? json_array_get(variant_mappings(primitive), i - 1) : primitive;
}

static size_t owner_count(const json_t *primitive)
{
    return 1 + json_array_size(variant_mappings(primitive));
}

static void note_plain(struct occlusion *occlusion, json_t *primitive)
{
    for (size_t i = 0; i < owner_count(primitive); i++) {
        const size_t material = material_of(occlusion, material_owner(primitive, i));
        if (material != NO_MATERIAL)
            occlusion->materials[material].plain = true;
    }
}

static void warn_kept(struct occlusion *occlusion, size_t index)
{
    struct material_use *use = &occlusion->materials[index];
    if (!use->named)
        hook_warn(occlusion->write->params->hooks,
                  "%s: /materials/%zu: '%s' keeps its occlusion texture, nothing is written where "
                  "it is used; pass --replace to displace it",
                  occlusion->write->document->path, index,
                  material_name(input_material(occlusion, index)));
    use->named = true;
}

static void warn_unlit(struct occlusion *occlusion, size_t index)
{
    const json_t *material = input_material(occlusion, index);
    if (occlusion->said_unlit ||
        !json_object_get(json_object_get(material, "extensions"), "KHR_materials_unlit"))
        return;
    occlusion->said_unlit = true;
    hook_warn(occlusion->write->params->hooks,
              "%s: /materials/%zu: '%s' is unlit, so occlusion textures do not show on it; use "
              "--to color",
              occlusion->write->document->path, index, material_name(material));
}

/* Whether any material of the primitive takes an occlusion texture; *sets: what they sample. */
static bool wants_occlusion(struct occlusion *occlusion, json_t *primitive, uint64_t *sets)
{
    bool wanted = false;
    *sets = 0;
    for (size_t i = 0; i < owner_count(primitive); i++) {
        const size_t material = material_of(occlusion, material_owner(primitive, i));
        if (material == NO_MATERIAL) {
            wanted = wanted || i == 0;
            continue;
        }
        look_at(occlusion, material);
        *sets |= occlusion->materials[material].sets;
        if (occlusion->materials[material].kept)
            warn_kept(occlusion, material);
        else
            wanted = true;
    }
    return wanted;
}

/* The first set that the primitive lacks and none of its textures expects: a texture that names a
 * missing set must not begin to sample ours. */
static uint32_t free_set(const json_t *primitive, uint64_t sampled)
{
    const json_t *attributes = json_object_get(primitive, "attributes");
    char name[32];
    for (uint32_t set = 0;; set++) {
        snprintf(name, sizeof name, "TEXCOORD_%u", set);
        if (!json_object_get(attributes, name) && (set >= 64 || !(sampled >> set & 1)))
            return set;
    }
}

static void warn_sets(struct occlusion *occlusion, uint32_t set)
{
    if (set < 2 || occlusion->said_sets)
        return;
    occlusion->said_sets = true;
    hook_warn(occlusion->write->params->hooks,
              "%s: the values go to TEXCOORD_%u where a primitive has %u sets already; some "
              "viewers show only the first two",
              occlusion->write->document->path, set, set);
}

static void plan_primitive(struct occlusion *occlusion, size_t g, size_t p)
{
    const struct write_group *group = &occlusion->write->groups[g];
    json_t *primitive = json_array_get(group->primitives, p);
    uint64_t sampled;
    occlusion->sets[g][p] = NO_SET;
    if (!group->part_of[p]) {
        note_plain(occlusion, primitive);
        return;
    }
    if (!wants_occlusion(occlusion, primitive, &sampled))
        return;
    const uint32_t set = free_set(primitive, sampled);
    occlusion->sets[g][p] = set;
    warn_sets(occlusion, set);
    for (size_t i = 0; i < owner_count(primitive); i++) {
        const size_t material = material_of(occlusion, material_owner(primitive, i));
        if (material == NO_MATERIAL)
            continue;
        warn_unlit(occlusion, material);
        if (occlusion->materials[material].own_set == NO_SET)
            occlusion->materials[material].own_set = set;
    }
}

/* Primitives of meshes that no group shows. */
static enum cranny_status note_other_meshes(struct occlusion *occlusion, struct cranny_error *why)
{
    const struct write *write = occlusion->write;
    const json_t *meshes = json_object_get(write->edit.root, "meshes");
    bool *shown = alloc_array(json_array_size(meshes), sizeof *shown);
    if (!shown)
        return fail_memory(why, "meshes");
    for (size_t g = 0; g < write->group_count; g++)
        shown[write->groups[g].gltf_mesh] = true;
    for (size_t m = 0; m < json_array_size(meshes); m++) {
        const json_t *primitives = json_object_get(json_array_get(meshes, m), "primitives");
        for (size_t p = 0; !shown[m] && p < json_array_size(primitives); p++)
            note_plain(occlusion, json_array_get(primitives, p));
    }
    free(shown);
    return CRANNY_OK;
}

static enum cranny_status plan(struct occlusion *occlusion, struct cranny_error *why)
{
    struct write *write = occlusion->write;
    occlusion->texture = SIZE_MAX;
    occlusion->material_count =
        json_array_size(json_object_get(write->document->root, "materials"));
    occlusion->materials = alloc_array(occlusion->material_count, sizeof *occlusion->materials);
    occlusion->sets = alloc_array(write->group_count, sizeof *occlusion->sets);
    if (!occlusion->materials || !occlusion->sets)
        return fail_memory(why, "materials");
    for (size_t i = 0; i < occlusion->material_count; i++)
        occlusion->materials[i].own_set = NO_SET;
    for (size_t g = 0; g < write->group_count; g++) {
        const size_t count = write->groups[g].primitive_count;
        occlusion->sets[g] = alloc_array(count, sizeof **occlusion->sets);
        if (!occlusion->sets[g])
            return fail_memory(why, "primitives");
        for (size_t p = 0; p < count; p++)
            plan_primitive(occlusion, g, p);
    }
    return note_other_meshes(occlusion, why);
}

/* A texture whose value is its u: what the sets address. Clamped and filtered, so that the values
 * between the texels come out too. */
static enum cranny_status make_texture(struct occlusion *occlusion, struct cranny_error *why)
{
    struct write *write = occlusion->write;
    uint8_t gradient[256], *png;
    size_t png_size, view, image, sampler;
    if (occlusion->texture != SIZE_MAX)
        return CRANNY_OK;
    for (int i = 0; i < 256; i++)
        gradient[i] = (uint8_t)i;
    enum cranny_status status = png_encode(256, 1, 1, gradient, 256, &png, &png_size, why);
    if (status != CRANNY_OK)
        return status;
    status = document_edit_append(&write->edit, png, png_size, 0, 0, &view, why);
    free(png);
    if (status == CRANNY_OK)
        status = write_append(write, "images",
                              json_pack("{s:s, s:s, s:I}", "name", "ambient occlusion gradient",
                                        "mimeType", "image/png", "bufferView", (json_int_t)view),
                              &image, why);
    if (status == CRANNY_OK)
        status = write_append(write, "samplers",
                              json_pack("{s:i, s:i, s:i, s:i}", "magFilter", 9729, "minFilter",
                                        9729, "wrapS", 33071, "wrapT", 33071),
                              &sampler, why);
    if (status == CRANNY_OK)
        status = write_append(
            write, "textures",
            json_pack("{s:I, s:I}", "sampler", (json_int_t)sampler, "source", (json_int_t)image),
            &occlusion->texture, why);
    return status;
}

static enum cranny_status set_occlusion(struct occlusion *occlusion, json_t *material, uint32_t set,
                                        struct cranny_error *why)
{
    json_t *reference = json_pack("{s:I}", "index", (json_int_t)occlusion->texture);
    if (reference && set)
        json_object_set_new(reference, "texCoord", json_integer(set));
    if (!reference || json_object_set_new(material, "occlusionTexture", reference) != 0)
        return fail_memory(why, "materials");
    return CRANNY_OK;
}

/* The version of `material` that takes its occlusion from `set`. */
static enum cranny_status version_of(struct occlusion *occlusion, size_t material, uint32_t set,
                                     size_t *index, struct cranny_error *why)
{
    struct write *write = occlusion->write;
    struct pair_entry *known = pair_map_at(&occlusion->versions, material, set);
    if (!known)
        return fail_memory(why, "materials");
    *index = known->value;
    if (known->value != SIZE_MAX)
        return CRANNY_OK;
    enum cranny_status status = make_texture(occlusion, why);
    if (status != CRANNY_OK)
        return status;
    const struct material_use *use =
        material == NO_MATERIAL ? NULL : &occlusion->materials[material];
    if (use && !use->plain && use->own_set == set)
        *index = material;
    else
        status = write_append(
            write, "materials",
            use ? json_deep_copy(input_material(occlusion, material)) : json_object(), index, why);
    if (status != CRANNY_OK)
        return status;
    known->value = *index;
    return set_occlusion(occlusion, json_array_get(write_list(write, "materials"), *index), set,
                         why);
}

static enum cranny_status set_materials(struct occlusion *occlusion, json_t *primitive,
                                        uint32_t set, struct cranny_error *why)
{
    for (size_t i = 0; i < owner_count(primitive); i++) {
        json_t *owner = material_owner(primitive, i);
        const size_t material = material_of(occlusion, owner);
        const bool absent = material == NO_MATERIAL;
        size_t version;
        if (absent ? i > 0 : occlusion->materials[material].kept)
            continue;
        enum cranny_status status = version_of(occlusion, material, set, &version, why);
        if (status != CRANNY_OK)
            return status;
        if (version != material &&
            json_object_set_new(owner, "material", json_integer((json_int_t)version)) != 0)
            return fail_memory(why, "materials");
    }
    return CRANNY_OK;
}

static enum cranny_status set_accessor(struct occlusion *occlusion, size_t g,
                                       const struct mesh_part *part, size_t count, size_t *accessor,
                                       struct cranny_error *why)
{
    struct write *write = occlusion->write;
    struct pair_entry *known = pair_map_at(&write->accessors, g, part->vertex_first);
    if (!known)
        return fail_memory(why, "values");
    *accessor = known->value;
    if (known->value != SIZE_MAX)
        return CRANNY_OK;
    uint16_t(*pairs)[2] = alloc_array(count, sizeof *pairs);
    if (!pairs)
        return fail_memory(why, "values");
    for (size_t i = 0; i < count; i++) {
        pairs[i][0] = visibility_u16(part_value(write->groups[g].visibility, part, i));
        pairs[i][1] = 32768;
    }
    struct write_accessor what = {.data = pairs,
                                  .size = count * sizeof *pairs,
                                  .component_type = COMPONENT_U16,
                                  .normalized = true,
                                  .count = count,
                                  .type = "VEC2"};
    enum cranny_status status = write_accessor(write, &what, accessor, why);
    free(pairs);
    known->value = *accessor;
    return status;
}

/* Zeros for the sets below `set` that the primitive lacks: sets must be contiguous. */
static enum cranny_status fill_sets(struct occlusion *occlusion, json_t *primitive, uint32_t set,
                                    size_t count, struct cranny_error *why)
{
    const json_t *attributes = json_object_get(primitive, "attributes");
    enum cranny_status status = CRANNY_OK;
    char name[32];
    for (uint32_t i = 0; status == CRANNY_OK && i < set; i++) {
        snprintf(name, sizeof name, "TEXCOORD_%u", i);
        if (json_object_get(attributes, name))
            continue;
        struct pair_entry *known = pair_map_at(&occlusion->zeros, count, 0);
        if (!known)
            return fail_memory(why, name);
        if (known->value == SIZE_MAX) {
            struct write_accessor what = {
                .component_type = COMPONENT_F32, .count = count, .type = "VEC2"};
            status = write_accessor(occlusion->write, &what, &known->value, why);
        }
        if (status == CRANNY_OK)
            status = write_attribute(occlusion->write, primitive, name, known->value, why);
    }
    return status;
}

static enum cranny_status apply_primitive(struct occlusion *occlusion, size_t g, size_t p,
                                          struct cranny_error *why)
{
    struct write *write = occlusion->write;
    const struct write_group *group = &write->groups[g];
    const struct mesh_part *part = &write->scene->meshes[group->mesh].parts[group->part_of[p] - 1];
    json_t *primitive = json_array_get(group->primitives, p);
    const uint32_t set = occlusion->sets[g][p];
    char name[32];
    size_t accessor, count = write_count(write, primitive, part);
    enum cranny_status status = fill_sets(occlusion, primitive, set, count, why);
    if (status == CRANNY_OK)
        status = set_accessor(occlusion, g, part, count, &accessor, why);
    snprintf(name, sizeof name, "TEXCOORD_%u", set);
    if (status == CRANNY_OK)
        status = write_attribute(write, primitive, name, accessor, why);
    return status == CRANNY_OK ? set_materials(occlusion, primitive, set, why) : status;
}

enum cranny_status write_occlusion(struct write *write, struct cranny_error *why)
{
    struct occlusion occlusion = {.write = write};
    enum cranny_status status = plan(&occlusion, why);
    for (size_t g = 0; status == CRANNY_OK && g < write->group_count; g++)
        for (size_t p = 0; status == CRANNY_OK && p < write->groups[g].primitive_count; p++)
            if (occlusion.sets[g][p] != NO_SET)
                status = apply_primitive(&occlusion, g, p, why);
    for (size_t g = 0; occlusion.sets && g < write->group_count; g++)
        free(occlusion.sets[g]);
    free(occlusion.sets);
    free(occlusion.materials);
    pair_map_free(&occlusion.versions);
    pair_map_free(&occlusion.zeros);
    return status;
}
