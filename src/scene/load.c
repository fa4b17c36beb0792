#include "scene/document.h"
#include "scene/scene.h"

#include <ctype.h>
#include <strings.h>

static const char *extension_start(const char *path)
{
    const char *slash = strrchr(path, '/'), *dot = strrchr(path, '.');
    return dot && (!slash || dot > slash) ? dot + 1 : "";
}

/* Binary glTF by its magic, JSON by its brace; names only decide where neither is there. */
static bool looks_like_gltf(const char *path)
{
    unsigned char head[64];
    FILE *file = fopen(path, "rb");
    size_t count = file ? fread(head, 1, sizeof head, file) : 0, at = 0;
    if (file)
        fclose(file);
    const char *extension = extension_start(path);
    if (!strcasecmp(extension, "glb") || !strcasecmp(extension, "gltf"))
        return true;
    if (count >= 4 && !memcmp(head, "glTF", 4))
        return true;
    if (count >= 3 && !memcmp(head, "\xEF\xBB\xBF", 3))
        at = 3;
    while (at < count && isspace(head[at]))
        at++;
    return at < count && head[at] == '{';
}

/* Format names are static text, so that the scene need not own one. */
static const char *format_name(const struct document *document)
{
    static const char *const known[] = {"OBJ", "PLY",   "STL", "FBX", "DAE", "3DS", "OFF",
                                        "X3D", "BLEND", "LWO", "DXF", "ASE", "AC",  "IFC"};
    if (!document->imported)
        return document->is_glb ? "glb" : "gltf";
    const char *extension = extension_start(document->path);
    for (size_t i = 0; i < COUNT_OF(known); i++)
        if (!strcasecmp(extension, known[i]))
            return known[i];
    return "assimp";
}

/* Decode `document`, which the scene then owns. */
static enum cranny_status scene_from(struct document *document,
                                     const struct cranny_scene_load_params *params,
                                     struct cranny_scene **scene, struct cranny_error *why)
{
    enum cranny_status status = cranny_scene_create(scene, why);
    if (status != CRANNY_OK) {
        document_destroy(&document);
        return status;
    }
    (*scene)->document = document;
    (*scene)->format = format_name(document);
    const json_t *asset = json_object_get(document->root, "asset");
    (*scene)->generator = copy_text(json_string_value(json_object_get(asset, "generator")));
    status =
        (*scene)->generator ? gltf_read(document, params, *scene, why) : fail_memory(why, "scene");
    document->hooks = NULL;
    if (status != CRANNY_OK)
        cranny_scene_destroy(scene);
    return status;
}

enum cranny_status cranny_scene_load(const char *path,
                                     const struct cranny_scene_load_params *params,
                                     struct cranny_scene **scene, struct cranny_error *why)
{
    const struct cranny_scene_load_params fallback = cranny_scene_load_params_default();
    struct document *document = NULL;
    *scene = NULL;
    if (!params)
        params = &fallback;
    enum cranny_status status =
        looks_like_gltf(path)
            ? document_load(path, params->allow_outside, params->memory_limit_bytes, params->hooks,
                            &document, why)
            : document_import(path, params->allow_outside, params->memory_limit_bytes,
                              params->hooks, &document, why);
    return status == CRANNY_OK ? scene_from(document, params, scene, why) : status;
}

enum cranny_status cranny_scene_load_memory(const void *data, size_t size, const char *name,
                                            const struct cranny_scene_load_params *params,
                                            struct cranny_scene **scene, struct cranny_error *why)
{
    const struct cranny_scene_load_params fallback = cranny_scene_load_params_default();
    struct document *document = NULL;
    *scene = NULL;
    if (!params)
        params = &fallback;
    if (size == SIZE_MAX)
        return fail(why, CRANNY_USAGE, "%s: the size is out of range", name ? name : "memory");
    uint8_t *copy = malloc(size + 1);
    if (!copy)
        return fail_memory(why, name ? name : "memory");
    if (size)
        memcpy(copy, data, size);
    copy[size] = 0;
    enum cranny_status status =
        document_parse(copy, size, name ? name : "memory", true, false, params->memory_limit_bytes,
                       params->hooks, &document, why);
    return status == CRANNY_OK ? scene_from(document, params, scene, why) : status;
}
