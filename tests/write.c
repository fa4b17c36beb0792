/* Writing values into scenes: what is there afterwards, and that taking it away again gives back
 * the input. */
#include "check.h"
#include "scene_files.h"

#include "scene/document.h"
#include "scene/scene.h"

#include <unistd.h>

static struct cranny_error why;
static char *folder;

static const char *out_path(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

struct log {
    int lines;
    char last[2048];
};

static void keep_line(void *user, enum cranny_log_level level, const char *line)
{
    struct log *log = user;
    if (level != CRANNY_LOG_WARNING)
        return;
    log->lines++;
    snprintf(log->last, sizeof log->last, "%s", line);
}

/* Values that differ between vertices and, when `split`, between instances. */
struct synthetic {
    const float **pointers, **longs, **shorts;
    float **arrays;
    size_t count;
    struct scene_values values;
};

static struct synthetic make_values(const struct cranny_scene *scene, bool split)
{
    const size_t instances = scene->instance_count, meshes = scene->mesh_count;
    struct synthetic made = {.count = split ? instances : meshes};
    made.arrays = calloc(made.count + 1, sizeof *made.arrays);
    made.pointers = calloc(instances + 1, sizeof *made.pointers);
    for (size_t i = 0; i < instances; i++) {
        const uint32_t mesh = scene->instances[i].view.mesh;
        const struct cranny_mesh *view = &scene->meshes[mesh].view;
        /* Instances of one node (EXT_mesh_gpu_instancing) share. */
        const bool follows = split && i && scene->instances[i].source_index > 0;
        float **array = &made.arrays[split ? i : mesh];
        if (!follows && !*array) {
            *array = calloc(view->vertex_count + 1, sizeof **array);
            for (uint32_t v = 0; v < view->vertex_count; v++)
                (*array)[v] = (float)((v * 7 + i * 13) % 101) / 100;
        }
        made.pointers[i] = follows ? made.pointers[i - 1] : *array;
    }
    made.values = (struct scene_values){
        .visibility = made.pointers, .raw_long = made.pointers, .raw_short = made.pointers};
    return made;
}

static void free_values(struct synthetic *made)
{
    for (size_t i = 0; i < made->count; i++)
        free(made->arrays[i]);
    free(made->arrays);
    free(made->pointers);
}

static struct cranny_scene *load_text(const char *text)
{
    struct cranny_scene *scene = NULL;
    CHECK_OK(cranny_scene_load_memory(text, strlen(text), "test.gltf", NULL, &scene, &why), why);
    return scene;
}

/* Save with values that differ per instance, and parse the outcome. */
static struct document *bake(const struct cranny_scene *scene, bool split,
                             struct cranny_save_params params, const char *name)
{
    struct document *result = NULL;
    struct synthetic made = make_values(scene, split);
    CHECK_OK(scene_write(scene, &made.values, out_path(name), &params, &why), why);
    CHECK_OK(document_load(out_path(name), false, 1u << 30, NULL, &result, &why), why);
    free_values(&made);
    return result;
}

static const json_t *at(const json_t *root, const char *pointer)
{
    char step[128];
    while (root && *pointer) {
        pointer++;
        const size_t length = strcspn(pointer, "/");
        snprintf(step, sizeof step, "%.*s", (int)length, pointer);
        root = json_is_array(root) ? json_array_get(root, (size_t)atoi(step))
                                   : json_object_get(root, step);
        pointer += length;
    }
    return root;
}

static long long whole(const struct document *document, const char *pointer)
{
    const json_t *value = at(document->root, pointer);
    return json_is_integer(value) ? json_integer_value(value) : -1;
}

/* Three vertices, one triangle: 36 bytes of positions, 6 of indices. */
#define TRIANGLE                                                                                   \
    "\"buffers\":[{\"byteLength\":44,\"uri\":\"data:application/octet-stream;base64,"              \
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA=\"}],"                            \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"                                           \
    "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":6}],"                                          \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","       \
    "\"min\":[0,0,0],\"max\":[1,1,0]},{\"bufferView\":1,\"componentType\":5123,\"count\":3,"       \
    "\"type\":\"SCALAR\"},{\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}],"
#define HEAD "{\"asset\":{\"version\":\"2.0\"}," TRIANGLE
#define ONE_NODE "\"nodes\":[{\"mesh\":0}],\"scenes\":[{\"nodes\":[0]}],\"scene\":0,"

static void test_occlusion(void)
{
    struct cranny_scene *scene = load_text(
        HEAD ONE_NODE "\"materials\":[{\"name\":\"m\"}],\"meshes\":[{\"primitives\":["
                      "{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2},\"indices\":1,"
                      "\"material\":0},{\"attributes\":{\"POSITION\":0},\"indices\":1}]}]}");
    struct document *result = bake(scene, true, cranny_save_params_default(), "occlusion.glb");
    CHECK_INT(whole(result, "/meshes/0/primitives/0/attributes/TEXCOORD_1"), 3);
    CHECK_INT(whole(result, "/materials/0/occlusionTexture/texCoord"), 1);
    CHECK_INT(whole(result, "/materials/0/occlusionTexture/index"), 0);
    CHECK_INT(whole(result, "/meshes/0/primitives/1/material"), 1);
    CHECK_INT(whole(result, "/materials/1/occlusionTexture/index"), 0);
    CHECK(!at(result->root, "/materials/1/occlusionTexture/texCoord"));
    CHECK_INT(json_array_size(at(result->root, "/images")), 1);
    CHECK_INT(json_array_size(at(result->root, "/materials")), 2);
    const uint8_t *data;
    size_t size;
    CHECK_OK(document_buffer(result, 0, &data, &size, &why), why);
    const size_t offset = (size_t)whole(result, "/bufferViews/2/byteOffset");
    CHECK_INT(offset % 16, 0);
    uint16_t pairs[3][2];
    memcpy(pairs, data + offset, sizeof pairs);
    for (int v = 0; v < 3; v++) {
        CHECK_NEAR(pairs[v][0] / 65535.0, v * 0.07, 1e-5);
        CHECK_INT(pairs[v][1], 32768);
    }
    uint8_t *owned;
    CHECK_OK(document_image(result, 0, &data, &size, &owned, &why), why);
    CHECK(size > 8 && memcmp(data, "\x89PNG", 4) == 0);
    free(owned);
    document_destroy(&result);
    cranny_scene_destroy(&scene);
}

/* The same material with and without values, and in two sets; a kept occlusion texture. */
static void test_materials(void)
{
    const char *text =
        HEAD "\"images\":[{\"uri\":\"data:image/png;base64,iVBORw0KGgo=\"}],"
             "\"textures\":[{\"source\":0}],"
             "\"nodes\":[{\"mesh\":0},{\"mesh\":1}],\"scenes\":[{\"nodes\":[0]}],\"scene\":0,"
             "\"materials\":[{\"name\":\"a\"},{\"name\":\"b\"},{\"name\":\"kept\","
             "\"occlusionTexture\":{\"index\":0}},{\"emissiveTexture\":{\"index\":0,"
             "\"texCoord\":1}}],\"meshes\":[{\"primitives\":["
             "{\"attributes\":{\"POSITION\":0},\"indices\":1,\"material\":0},"
             "{\"attributes\":{\"POSITION\":0},\"indices\":1,\"material\":1},"
             "{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2},\"indices\":1,\"material\":1},"
             "{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2},\"indices\":1,\"material\":2},"
             "{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2},\"indices\":1,\"material\":3}"
             "]},{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"material\":0}]}]}";
    struct cranny_scene *scene = load_text(text);
    struct log log = {0};
    struct cranny_hooks hooks = {.user = &log, .log = keep_line};
    struct cranny_save_params params = cranny_save_params_default();
    params.hooks = &hooks;
    struct document *result = bake(scene, true, params, "materials.gltf");
    /* Node 1 is outside the scene and needs material 0 as it was. */
    CHECK_INT(whole(result, "/meshes/1/primitives/0/material"), 0);
    CHECK(!at(result->root, "/materials/0/occlusionTexture"));
    CHECK_INT(whole(result, "/meshes/0/primitives/0/material"), 4);
    CHECK(at(result->root, "/materials/4/occlusionTexture") != NULL);
    CHECK_INT(whole(result, "/meshes/0/primitives/1/material"), 1);
    CHECK_INT(whole(result, "/meshes/0/primitives/2/material"), 5);
    CHECK_INT(whole(result, "/materials/5/occlusionTexture/texCoord"), 1);
    CHECK_INT(whole(result, "/meshes/0/primitives/3/material"), 2);
    CHECK_INT(whole(result, "/materials/2/occlusionTexture/index"), 0);
    CHECK(!at(result->root, "/meshes/0/primitives/3/attributes/TEXCOORD_1"));
    /* Set 1 stays what the emissive texture saw: zeros; ours is set 2. */
    const long long filled = whole(result, "/meshes/0/primitives/4/attributes/TEXCOORD_1");
    CHECK(filled > 2 &&
          !at(json_array_get(at(result->root, "/accessors"), (size_t)filled), "/bufferView"));
    CHECK(whole(result, "/meshes/0/primitives/4/attributes/TEXCOORD_2") > 2);
    CHECK_INT(whole(result, "/materials/3/occlusionTexture/texCoord"), 2);
    CHECK_INT(log.lines, 2);
    document_destroy(&result);
    params.replace = true;
    result = bake(scene, true, params, "replaced.gltf");
    CHECK_INT(whole(result, "/materials/2/occlusionTexture/index"), 1);
    CHECK_INT(whole(result, "/materials/2/occlusionTexture/texCoord"), 1);
    document_destroy(&result);
    cranny_scene_destroy(&scene);
}

static void test_copies(void)
{
    const char *text =
        HEAD "\"nodes\":[{\"mesh\":0},{\"mesh\":0},{\"mesh\":0}],\"scenes\":[{\"nodes\":[0,1]}],"
             "\"scene\":0,\"meshes\":[{\"name\":\"twice\",\"primitives\":["
             "{\"attributes\":{\"POSITION\":0},\"indices\":1}]}]}";
    struct cranny_scene *scene = load_text(text);
    struct cranny_save_params params = {.to = CRANNY_OUTPUT_ATTRIBUTE};
    struct document *result = bake(scene, true, params, "copies.glb");
    /* Node 2 is not baked and keeps the original. */
    CHECK_INT(whole(result, "/nodes/2/mesh"), 0);
    CHECK(!at(result->root, "/meshes/0/primitives/0/attributes/_AO"));
    CHECK_INT(whole(result, "/nodes/0/mesh"), 1);
    CHECK_INT(whole(result, "/nodes/1/mesh"), 2);
    CHECK(whole(result, "/meshes/1/primitives/0/attributes/_AO") !=
          whole(result, "/meshes/2/primitives/0/attributes/_AO"));
    CHECK(json_equal(at(result->root, "/meshes/2/name"), at(result->root, "/meshes/0/name")));
    document_destroy(&result);
    params.raw = true;
    result = bake(scene, false, params, "shared.glb");
    CHECK_INT(whole(result, "/nodes/0/mesh"), whole(result, "/nodes/1/mesh"));
    CHECK_INT(json_array_size(at(result->root, "/meshes")), 2);
    const json_t *accessor =
        json_array_get(at(result->root, "/accessors"),
                       (size_t)whole(result, "/meshes/1/primitives/0/attributes/_AO"));
    CHECK(accessor && strcmp(json_string_value(json_object_get(accessor, "type")), "VEC2") == 0);
    document_destroy(&result);
    cranny_scene_destroy(&scene);
}

static void test_color(void)
{
    const char *text =
        HEAD ONE_NODE "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"COLOR_0\":0},"
                      "\"indices\":1},{\"attributes\":{\"POSITION\":0},\"indices\":1}]}]}";
    struct cranny_scene *scene = load_text(text);
    struct cranny_save_params params = {.to = CRANNY_OUTPUT_COLOR};
    struct document *result = bake(scene, true, params, "color.glb");
    const uint8_t *data;
    size_t size;
    CHECK_OK(document_buffer(result, 0, &data, &size, &why), why);
    /* Old colours are the positions: red at vertex 1, green at vertex 2. */
    CHECK_INT(whole(result, "/meshes/0/primitives/0/attributes/COLOR_0"), 3);
    CHECK_INT(whole(result, "/bufferViews/2/byteStride"), 8);
    uint16_t colors[3][4];
    memcpy(colors, data + whole(result, "/bufferViews/2/byteOffset"), sizeof colors);
    for (int v = 0; v < 3; v++)
        for (int c = 0; c < 3; c++)
            CHECK_NEAR(colors[v][c] / 65535.0, v == c + 1 ? v * 0.07 : 0, 2e-5);
    CHECK_INT(whole(result, "/meshes/0/primitives/1/attributes/COLOR_0"), 4);
    memcpy(colors, data + whole(result, "/bufferViews/3/byteOffset"), sizeof colors);
    CHECK_NEAR(colors[2][1] / 65535.0, 0.14, 2e-5);
    CHECK_INT(colors[2][3], 65535);
    document_destroy(&result);
    cranny_scene_destroy(&scene);
}

static void test_variants(void)
{
    const char *text = HEAD ONE_NODE
        "\"extensionsUsed\":[\"KHR_materials_variants\"],\"materials\":[{},{}],\"meshes\":[{"
        "\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1,\"material\":0,"
        "\"extensions\":{\"KHR_materials_variants\":{\"mappings\":[{\"material\":1,"
        "\"variants\":[0]}]}}},{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2},\"indices\":1,"
        "\"material\":1}]}]}";
    struct cranny_scene *scene = load_text(text);
    struct document *result = bake(scene, true, cranny_save_params_default(), "variants.gltf");
    CHECK_INT(whole(result, "/materials/1/occlusionTexture/index"), 0);
    CHECK_INT(whole(result, "/meshes/0/primitives/1/material"), 2);
    CHECK_INT(whole(result, "/materials/2/occlusionTexture/texCoord"), 1);
    document_destroy(&result);
    cranny_scene_destroy(&scene);
}

/* A scene of arrays comes out as glTF with the values in it, and reads back the same. */
static void test_arrays(void)
{
    static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    static const float texcoords[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const uint32_t triangles[3][3] = {{0, 1, 2}, {0, 2, 3}, {1, 2, 3}};
    static const uint32_t materials[3] = {1, 0, 1};
    static const uint8_t alpha[4] = {0, 255, 255, 0};
    struct cranny_scene *scene, *back = NULL;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    struct cranny_alpha_texture texture = {2, 2, CRANNY_WRAP_CLAMP, CRANNY_WRAP_MIRROR, alpha};
    struct cranny_material plain = cranny_material_default(), masked = plain;
    masked.alpha_mode = CRANNY_ALPHA_MASK;
    masked.alpha_texture = 0;
    masked.double_sided = true;
    masked.uv_transform[0] = 2;
    masked.uv_transform[5] = 0.25f;
    CHECK_OK(cranny_scene_add_texture(scene, &texture, NULL, &why), why);
    CHECK_OK(cranny_scene_add_material(scene, &plain, NULL, &why), why);
    CHECK_OK(cranny_scene_add_material(scene, &masked, NULL, &why), why);
    struct cranny_mesh mesh = {"quad", 4, 3, positions, NULL, texcoords, triangles, materials};
    CHECK_OK(cranny_scene_add_mesh(scene, &mesh, NULL, &why), why);
    struct cranny_instance instance = {.name = "i",
                                       .world_from_object = {1, 0, 0, 5, 0, 2, 0, 0, 0, 0, 1, 0}};
    CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
    CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
    struct document *result = bake(scene, true, cranny_save_params_default(), "arrays.glb");
    CHECK_INT(json_array_size(at(result->root, "/meshes")), 2);
    CHECK_INT(whole(result, "/meshes/1/primitives/1/attributes/TEXCOORD_1"),
              whole(result, "/meshes/1/primitives/0/attributes/TEXCOORD_1"));
    document_destroy(&result);
    CHECK_OK(cranny_scene_load(out_path("arrays.glb"), NULL, &back, &why), why);
    CHECK_INT(cranny_scene_triangle_count(back), 6);
    double bounds[6];
    cranny_scene_bounds(back, bounds);
    CHECK_NEAR(bounds[3], 6, 0);
    CHECK_NEAR(bounds[4], 2, 0);
    struct cranny_scene_info info;
    cranny_scene_get_info(back, &info);
    CHECK_INT(info.masked_triangles, 4);
    for (uint32_t m = 0; m < cranny_scene_material_count(back); m++) {
        const struct cranny_material *material = cranny_scene_material(back, m);
        if (material->alpha_mode == CRANNY_ALPHA_MASK) {
            CHECK_NEAR(material->uv_transform[0], 2, 1e-6);
            CHECK_NEAR(material->uv_transform[5], 0.25, 1e-6);
        }
    }
    cranny_scene_destroy(&back);
    cranny_scene_destroy(&scene);
}

/* Whether `after` is `before` with additions: members added, lists grown at their end, indices that
 * now name something appended. */
static bool is_extension(const json_t *before, const json_t *after, const char *key)
{
    if (json_is_object(before)) {
        const char *name;
        json_t *value;
        size_t last = 0;
        json_object_foreach((json_t *)(uintptr_t)before, name, value)
        {
            const char *other;
            json_t *unused;
            size_t place = 0;
            json_object_foreach((json_t *)(uintptr_t)after, other, unused)
            {
                place++;
                if (strcmp(other, name) == 0)
                    break;
            }
            if (place <= last && last)
                return false;
            last = place;
            if (!is_extension(value, json_object_get(after, name), name))
                return false;
        }
        return json_is_object(after);
    }
    if (json_is_array(before)) {
        if (json_array_size(after) < json_array_size(before))
            return false;
        for (size_t i = 0; i < json_array_size(before); i++)
            if (!is_extension(json_array_get(before, i), json_array_get(after, i), key))
                return false;
        return true;
    }
    if (json_equal(before, after))
        return true;
    return json_is_integer(before) && json_is_integer(after) &&
           json_integer_value(after) > json_integer_value(before) &&
           (strcmp(key, "mesh") == 0 || strcmp(key, "material") == 0 ||
            strcmp(key, "byteLength") == 0 || strcmp(key, "COLOR_0") == 0 ||
            strcmp(key, "_AO") == 0);
}

static void compare_buffers(const struct document *before, struct document *after, const char *path)
{
    for (size_t i = 0; i < before->buffer_count; i++) {
        const uint8_t *old, *fresh;
        size_t old_size, fresh_size;
        if (document_buffer((struct document *)(uintptr_t)before, i, &old, &old_size, NULL) !=
            CRANNY_OK)
            continue;
        const enum cranny_status status = document_buffer(after, i, &fresh, &fresh_size, &why);
        CHECK_MSG(status == CRANNY_OK && fresh_size >= old_size &&
                      memcmp(old, fresh, old_size) == 0,
                  "%s: buffer %zu changed", path, i);
    }
}

static int files_written;

static void write_file(const char *path, void *user)
{
    struct cranny_scene *scene, *back;
    const bool to_glb = *(const bool *)user;
    char name[64];
    if (cranny_scene_load(path, NULL, &scene, NULL) != CRANNY_OK)
        return;
    if (!scene->document || scene->document->imported) {
        cranny_scene_destroy(&scene);
        return;
    }
    for (int to = 0; to < 3; to++) {
        struct cranny_save_params params = {.to = (enum cranny_output)to, .replace = to_glb};
        struct synthetic made = make_values(scene, true);
        const bool glb = to_glb || scene->document->is_glb;
        struct document *after = NULL;
        snprintf(name, sizeof name, "%d-%d/out.%s", files_written++, to, glb ? "glb" : "gltf");
        char *target = strdup(out_path(name)), *slash = strrchr(target, '/');
        *slash = 0;
        make_folder(target);
        *slash = '/';
        const enum cranny_status status = scene_write(scene, &made.values, target, &params, &why);
        CHECK_MSG(status == CRANNY_OK, "%s: %s", path, why.message);
        if (status == CRANNY_OK)
            CHECK_OK(document_load(target, false, 1u << 30, NULL, &after, &why), why);
        if (after && (to_glb == scene->document->is_glb || !to_glb)) {
            CHECK_MSG(params.replace || is_extension(scene->document->root, after->root, ""),
                      "%s: something of the JSON is gone", path);
            compare_buffers(scene->document, after, path);
        }
        document_destroy(&after);
        if (status == CRANNY_OK) {
            const enum cranny_status again = cranny_scene_load(target, NULL, &back, &why);
            CHECK_MSG(again == CRANNY_OK, "%s: does not load again: %s", path, why.message);
            if (again == CRANNY_OK)
                CHECK_MSG(cranny_scene_triangle_count(back) == cranny_scene_triangle_count(scene),
                          "%s: triangles", path);
            cranny_scene_destroy(&back);
        }
        free(target);
        free_values(&made);
    }
    cranny_scene_destroy(&scene);
}

int main(void)
{
    folder = scratch_folder();
    if (!folder)
        return 1;
    test_occlusion();
    test_materials();
    test_copies();
    test_color();
    test_variants();
    test_arrays();
    if (check_scenes()) {
        bool to_glb = false;
        walk_scenes("formats", write_file, &to_glb);
        walk_scenes("variants_camp", write_file, &to_glb);
        CHECK(files_written > 300);
        to_glb = true;
        walk_scenes("formats", write_file, &to_glb);
    }
    remove_folder(folder);
    free(folder);
    return check_end("write");
}
