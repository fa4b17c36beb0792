#include "scene/document_parts.h"

bool json_whole(const json_t *object, const char *key, uint64_t maximum, uint64_t fallback,
                uint64_t *value)
{
    const json_t *number = json_object_get(object, key);
    *value = fallback;
    if (!number)
        return true;
    if (json_is_integer(number)) {
        const json_int_t integer = json_integer_value(number);
        *value = (uint64_t)integer;
        return integer >= 0 && *value <= maximum;
    }
    /* Some writers spell counts as 12.0. */
    const double real = json_is_real(number) ? json_real_value(number) : -1;
    if (!(real >= 0 && real <= 0x1p53) || real != floor(real))
        return false;
    *value = (uint64_t)real;
    return *value <= maximum;
}

/* Required extensions that change geometry: decoded, or by a build with what `needs` names. */
static const struct {
    const char *name, *needs;
} decoded[] = {
    {"KHR_mesh_quantization", NULL},
    {"KHR_texture_transform", NULL},
    {"EXT_mesh_gpu_instancing", NULL},
    {"EXT_meshopt_compression", CRANNY_HAVE_MESHOPT ? NULL : "meshoptimizer"},
    {"KHR_meshopt_compression", CRANNY_HAVE_MESHOPT ? NULL : "meshoptimizer"},
    {"KHR_draco_mesh_compression", CRANNY_HAVE_DRACO ? NULL : "draco"},
};

/* Beginnings of extension names that say nothing about where surfaces are: appearance, light,
 * sound, behaviour, data about the scene. */
static const char *const harmless[] = {
    "KHR_materials_",
    "EXT_materials_",
    "ADOBE_materials_",
    "NV_materials_",
    "FB_materials_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_techniques_",
    "KHR_technique_",
    "KHR_xmp",
    "KHR_animation_",
    "KHR_audio",
    "KHR_node_",
    "KHR_interactivity",
    "KHR_physics_",
    "KHR_rigid_bodies",
    "KHR_implicit_shapes",
    "KHR_collision_",
    "KHR_environment_map",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_feature_metadata",
    "EXT_structural_metadata",
    "MSFT_lod",
    "MSFT_packing_",
    "MSFT_audio_",
    "VRM",
    "OMI_",
    "AGI_",
    "CESIUM_RTC",
    "GODOT_",
    "EXT_image_",
    "FB_ngon_encoding",
};

static bool is_harmless(const char *name)
{
    for (size_t i = 0; i < COUNT_OF(harmless); i++)
        if (strncmp(name, harmless[i], strlen(harmless[i])) == 0)
            return true;
    return false;
}

static enum cranny_status check_extension(const struct document *document, size_t index,
                                          const char *name, struct cranny_error *why)
{
    for (size_t i = 0; i < COUNT_OF(decoded); i++) {
        if (strcmp(name, decoded[i].name) != 0)
            continue;
        if (!decoded[i].needs)
            return CRANNY_OK;
        return fail(why, CRANNY_INPUT,
                    "%s: /extensionsRequired/%zu: the file needs '%.100s', which this build cannot "
                    "decode; build Cranny with %s, or decompress the file first",
                    document->path, index, name, decoded[i].needs);
    }
    if (is_harmless(name))
        return CRANNY_OK;
    return fail(why, CRANNY_INPUT,
                "%s: /extensionsRequired/%zu: the file needs '%.100s', which is not supported; "
                "export it without",
                document->path, index, name);
}

static enum cranny_status check_extensions(const struct document *document,
                                           struct cranny_error *why)
{
    const json_t *required = json_object_get(document->root, "extensionsRequired");
    if (required && !json_is_array(required))
        return fail(why, CRANNY_INPUT, "%s: /extensionsRequired: not a list", document->path);
    for (size_t i = 0; i < json_array_size(required); i++) {
        const char *name = json_string_value(json_array_get(required, i));
        if (!name)
            return fail(why, CRANNY_INPUT, "%s: /extensionsRequired/%zu: not a text",
                        document->path, i);
        enum cranny_status status = check_extension(document, i, name, why);
        if (status != CRANNY_OK)
            return status;
    }
    return CRANNY_OK;
}

static bool parse_version(const char *text, int *major, int *minor)
{
    int length = 0;
    return text && sscanf(text, "%4d.%4d%n", major, minor, &length) == 2 && !text[length] &&
           *major >= 0 && *minor >= 0;
}

static enum cranny_status check_asset(const struct document *document, struct cranny_error *why)
{
    const json_t *asset = json_object_get(document->root, "asset");
    const json_t *least = json_object_get(asset, "minVersion");
    const char *version = json_string_value(json_object_get(asset, "version"));
    int major, minor;
    if (!json_is_object(asset))
        return fail(why, CRANNY_INPUT,
                    "%s: /asset: missing; a glTF must say \"asset\": {\"version\": "
                    "\"2.0\"}",
                    document->path);
    if (json_number_value(json_object_get(asset, "version")) == 1)
        version = "1.0";
    if (!parse_version(version, &major, &minor))
        return fail(why, CRANNY_INPUT, "%s: /asset/version: not a text such as \"2.0\"",
                    document->path);
    if (major == 1)
        return fail(why, CRANNY_INPUT,
                    "%s: /asset/version: glTF %.8s is not supported; convert the "
                    "file to glTF 2.0",
                    document->path, version);
    if (major != 2)
        return fail(why, CRANNY_INPUT,
                    "%s: /asset/version: glTF %.8s is not known; only 2.x is read", document->path,
                    version);
    if (!least)
        return CRANNY_OK;
    if (!parse_version(json_string_value(least), &major, &minor))
        return fail(why, CRANNY_INPUT, "%s: /asset/minVersion: not a text such as \"2.0\"",
                    document->path);
    if (major > 2 || (major == 2 && minor > 0))
        return fail(why, CRANNY_INPUT,
                    "%s: /asset/minVersion: the file needs glTF %d.%d; 2.0 is "
                    "supported",
                    document->path, major, minor);
    return CRANNY_OK;
}

static enum cranny_status check_lists(const struct document *document, struct cranny_error *why)
{
    static const char *const lists[] = {
        "accessors", "animations", "buffers",  "bufferViews", "cameras", "images",  "materials",
        "meshes",    "nodes",      "samplers", "scenes",      "skins",   "textures"};
    for (size_t k = 0; k < COUNT_OF(lists); k++) {
        const json_t *list = json_object_get(document->root, lists[k]);
        if (list && !json_is_array(list))
            return fail(why, CRANNY_INPUT, "%s: /%s: not a list", document->path, lists[k]);
        for (size_t i = 0; i < json_array_size(list); i++)
            if (!json_is_object(json_array_get(list, i)))
                return fail(why, CRANNY_INPUT, "%s: /%s/%zu: not an object", document->path,
                            lists[k], i);
    }
    return CRANNY_OK;
}

enum cranny_status document_check(const struct document *document, struct cranny_error *why)
{
    if (!json_is_object(document->root))
        return fail(why, CRANNY_INPUT, "%s: the JSON is not an object", document->path);
    enum cranny_status status = check_asset(document, why);
    if (status == CRANNY_OK)
        status = check_extensions(document, why);
    return status == CRANNY_OK ? check_lists(document, why) : status;
}
