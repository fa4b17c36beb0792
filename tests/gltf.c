/* The glTF reader, feature by feature, on documents made here. */
#include "gltf_text.h"

#include "base/image.h"
#include "scene/accessor.h"
#include "scene/scene.h"

static struct cranny_error why;

/* Load, check that it worked, and give back the scene (NULL when it failed). */
static struct cranny_scene *good(const struct bytes *bytes, const char *rest)
{
    struct cranny_scene *scene;
    CHECK_OK(gltf_load(bytes, rest, -1, &scene, &why), why);
    return scene;
}

/* Load, and check that it is refused with `status`, the message holding `part`. */
static void bad(const struct bytes *bytes, const char *rest, enum cranny_status status,
                const char *part)
{
    struct cranny_scene *scene;
    CHECK_INT(gltf_load(bytes, rest, -1, &scene, &why), status);
    CHECK(scene == NULL);
    CHECK_MSG(strstr(why.message, part) && strstr(why.message, "test.gltf"),
              "'%s' should name '%s'", why.message, part);
    cranny_scene_destroy(&scene);
}

static const float quad[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};

#define ONE_NODE "'nodes':[{'mesh':0}],'scenes':[{'nodes':[0]}],"
#define QUAD_VIEW "{'buffer':0,'byteOffset':0,'byteLength':48}"
#define QUAD_POSITIONS "{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'}"

static struct bytes quad_bytes(void)
{
    struct bytes bytes = {.size = 0};
    bytes_put(&bytes, quad, sizeof quad);
    return bytes;
}

static double face_z(const struct cranny_mesh *mesh, uint32_t t)
{
    const float *a = mesh->positions[mesh->triangles[t][0]];
    const float *b = mesh->positions[mesh->triangles[t][1]];
    const float *c = mesh->positions[mesh->triangles[t][2]];
    return (double)(b[0] - a[0]) * (c[1] - a[1]) - (double)(b[1] - a[1]) * (c[0] - a[0]);
}

static void test_modes(void)
{
    static const struct {
        int mode;
        uint8_t indices[8];
        int count, triangles;
        double area;
    } cases[] = {
        {4, {0, 1, 2, 2, 1, 3}, 6, 2, 1},
        {4, {0, 1, 2, 2, 1}, 5, 1, 0.5}, /* an incomplete triangle at the end */
        {5, {0, 1, 2, 3}, 4, 2, 1},
        {5, {0, 1, 2, 2, 2, 1, 3}, 7, 2, 1}, /* two strips joined by empty triangles */
        {6, {0, 1, 3, 2}, 4, 2, 1},
        {5, {0, 1}, 2, 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bytes bytes = quad_bytes();
        char rest[1024];
        bytes_put(&bytes, cases[i].indices, 8);
        snprintf(rest, sizeof rest,
                 ONE_NODE
                 "'bufferViews':[" QUAD_VIEW
                 ",{'buffer':0,'byteOffset':48,'byteLength':8}],'accessors':[" QUAD_POSITIONS
                 ",{'bufferView':1,'componentType':5121,'count':%d,'type':'SCALAR'}],"
                 "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1,'mode':%d}]}]",
                 cases[i].count, cases[i].mode);
        struct cranny_scene *scene = good(&bytes, rest);
        if (!scene)
            continue;
        CHECK_INT(cranny_scene_triangle_count(scene), cases[i].triangles);
        double area = 0;
        for (uint32_t t = 0; t < cranny_scene_triangle_count(scene); t++) {
            const double z = face_z(cranny_scene_mesh(scene, 0), t);
            CHECK_MSG(z > 0, "case %zu, triangle %u looks away", i, t);
            area += z / 2;
        }
        CHECK_NEAR(area, cases[i].area, 1e-6);
        cranny_scene_destroy(&scene);
    }
}

static void test_points_and_empty(void)
{
    struct bytes bytes = quad_bytes(), none = {.size = 0};
    struct cranny_scene_info info;
    struct cranny_scene *scene =
        good(&bytes, ONE_NODE "'bufferViews':[" QUAD_VIEW "],'accessors':[" QUAD_POSITIONS "],"
                              "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':0},"
                              "{'attributes':{'POSITION':0},'mode':1}]}]");
    if (scene) {
        cranny_scene_get_info(scene, &info);
        CHECK_INT(info.skipped_primitives, 2);
        CHECK_INT(info.triangles, 0);
        CHECK_INT(info.instances, 0);
    }
    cranny_scene_destroy(&scene);
    scene = good(&none, "'scenes':[{}]");
    if (scene)
        CHECK_INT(cranny_scene_instance_count(scene), 0);
    cranny_scene_destroy(&scene);
}

static void test_sparse(void)
{
    struct bytes bytes = quad_bytes();
    const uint16_t places[2] = {1, 3};
    const float values[2][3] = {{2, 0, 0}, {2, 1, 0}};
    bytes_put(&bytes, places, sizeof places);
    bytes_put(&bytes, values, sizeof values);
    static const char sparse[] =
        "'sparse':{'count':2,'indices':{'bufferView':1,'componentType':5123},"
        "'values':{'bufferView':2}}";
    for (int based = 0; based < 2; based++) {
        char rest[1024];
        snprintf(rest, sizeof rest,
                 ONE_NODE "'bufferViews':[" QUAD_VIEW
                          ",{'buffer':0,'byteOffset':48,'byteLength':4},"
                          "{'buffer':0,'byteOffset':52,'byteLength':24}],"
                          "'accessors':[{%s'componentType':5126,'count':4,'type':'VEC3',%s}],"
                          "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':5}]}]",
                 based ? "'bufferView':0," : "", sparse);
        struct cranny_scene *scene = good(&bytes, rest);
        if (!scene)
            continue;
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, 0);
        CHECK_NEAR(mesh->positions[1][0], 2, 0);
        CHECK_NEAR(mesh->positions[3][1], 1, 0);
        CHECK_NEAR(mesh->positions[2][1], based ? 1 : 0, 0);
        cranny_scene_destroy(&scene);
    }
}

static void test_quantized(void)
{
    struct bytes bytes = {.size = 0};
    const int16_t positions[3][4] = {{-32768, 0, 0, 0}, {32767, 0, 0, 0}, {0, 16384, 0, 0}};
    bytes_put(&bytes, positions, sizeof positions);
    for (int normalized = 0; normalized < 2; normalized++) {
        char rest[1024];
        snprintf(rest, sizeof rest,
                 "'extensionsUsed':['KHR_mesh_quantization'],'extensionsRequired':"
                 "['KHR_mesh_quantization']," ONE_NODE
                 "'bufferViews':[{'buffer':0,'byteLength':22,'byteStride':8}],'accessors':["
                 "{'bufferView':0,'componentType':5122,'count':3,'type':'VEC3','normalized':%s}],"
                 "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]",
                 normalized ? "true" : "false");
        struct cranny_scene *scene = good(&bytes, rest);
        if (!scene)
            continue;
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, 0);
        CHECK_NEAR(mesh->positions[0][0], normalized ? -1 : -32768, 0);
        CHECK_NEAR(mesh->positions[1][0], normalized ? 1 : 32767, 0);
        CHECK_NEAR(mesh->positions[2][1], normalized ? 16384.0 / 32767 : 16384, 1e-6);
        cranny_scene_destroy(&scene);
    }
}

#define QUAD_MESH                                                                                  \
    "'bufferViews':[" QUAD_VIEW "],'accessors':[" QUAD_POSITIONS "],"                              \
    "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':5}]}]"

static void test_nodes(void)
{
    struct bytes bytes = quad_bytes();
    struct cranny_scene *scene =
        good(&bytes, "'nodes':[{'children':[1],'translation':[1,2,3],'scale':[2,2,2]},"
                     "{'mesh':0,'scale':[-1,1,1],'rotation':[0,0,0.70710678,0.70710678]},"
                     "{'mesh':0,'matrix':[1,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]}],"
                     "'scenes':[{'nodes':[2]},{'nodes':[0]}],'scene':1," QUAD_MESH);
    if (scene && cranny_scene_instance_count(scene) == 1) {
        const double *m = cranny_scene_instance(scene, 0)->world_from_object;
        double p[3];
        CHECK(transform_determinant(m) < 0);
        transform_point(m, (const float[3]){1, 0, 0}, p); /* (−1,0,0) turned to (0,−1,0), doubled */
        CHECK_NEAR(p[0], 1, 1e-6);
        CHECK_NEAR(p[1], 0, 1e-6);
        CHECK_NEAR(p[2], 3, 1e-6);
    } else {
        CHECK(false);
    }
    cranny_scene_destroy(&scene);
    scene = good(&bytes, "'nodes':[{'mesh':0},{'mesh':0,'translation':[4,0,0]}]," QUAD_MESH);
    if (scene) {
        CHECK_INT(cranny_scene_mesh_count(scene), 1);
        CHECK_INT(cranny_scene_instance_count(scene), 2);
    }
    cranny_scene_destroy(&scene);
}

static void test_scene_choice(void)
{
    struct bytes bytes = quad_bytes();
    static const char rest[] = "'nodes':[{'mesh':0},{'mesh':0},{'mesh':0}],"
                               "'scenes':[{'nodes':[0]},{'nodes':[1,2]}]," QUAD_MESH;
    struct cranny_scene *scene;
    CHECK_OK(gltf_load(&bytes, rest, 1, &scene, &why), why);
    CHECK_INT(scene ? cranny_scene_instance_count(scene) : 0, 2);
    cranny_scene_destroy(&scene);
    CHECK_OK(gltf_load(&bytes, rest, -1, &scene, &why), why);
    CHECK_INT(scene ? cranny_scene_instance_count(scene) : 0, 1);
    cranny_scene_destroy(&scene);
    CHECK_INT(gltf_load(&bytes, rest, 2, &scene, &why), CRANNY_USAGE);
    CHECK(scene == NULL);
}

static void test_bad_nodes(void)
{
    struct bytes bytes = quad_bytes();
    bad(&bytes, "'nodes':[{'children':[1]},{'children':[0],'mesh':0}]," QUAD_MESH, CRANNY_INPUT,
        "/nodes/0");
    bad(&bytes, "'nodes':[{'children':[0]}]," QUAD_MESH, CRANNY_INPUT, "/nodes/0");
    bad(&bytes, "'nodes':[{'children':[2]},{'children':[2]},{'mesh':0}]," QUAD_MESH, CRANNY_INPUT,
        "/nodes/1/children/0");
    bad(&bytes, "'nodes':[{'children':[9]}]," QUAD_MESH, CRANNY_INPUT, "/nodes/0/children/0");
    bad(&bytes, "'nodes':[{'mesh':7}]," QUAD_MESH, CRANNY_INPUT, "/nodes/0/mesh");
    bad(&bytes, "'nodes':[{'mesh':0,'translation':[1,2]}]," QUAD_MESH, CRANNY_INPUT,
        "/nodes/0/translation");
    bad(&bytes,
        "'nodes':[{'scale':[1e200,1,1],'children':[1]},{'mesh':0,'scale':[1e200,1,1]}]," QUAD_MESH,
        CRANNY_INPUT, "/nodes/0");
}

/* A chain that a recursive reader would not survive. */
static void test_deep_chain(void)
{
    struct bytes bytes = quad_bytes();
    const size_t depth = 200000;
    char *rest = malloc(depth * 40 + 1024), *end = rest;
    end += sprintf(end, "'scenes':[{'nodes':[0]}],'nodes':[");
    for (size_t i = 0; i + 1 < depth; i++)
        end += sprintf(end, "{'children':[%zu]},", i + 1);
    sprintf(end, "{'mesh':0}]," QUAD_MESH);
    struct cranny_scene *scene = good(&bytes, rest);
    CHECK_INT(scene ? cranny_scene_instance_count(scene) : 0, 1);
    cranny_scene_destroy(&scene);
    free(rest);
}

static void test_skin(void)
{
    struct bytes bytes = quad_bytes();
    const uint8_t joints[4][4] = {{0}, {1}, {0, 1}, {1, 0}};
    const float weights[4][4] = {{1}, {1}, {0.5f, 0.5f}, {0.25f}}; /* the last does not add to 1 */
    const float bind[2][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                               {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}};
    bytes_put(&bytes, joints, 16);
    bytes_put(&bytes, weights, 64);
    bytes_put(&bytes, bind, 128);
    static const char rest[] =
        "'nodes':[{'mesh':0,'skin':0,'translation':[100,0,0]},{'translation':[0,0,5]},"
        "{'translation':[1,0,10]}],'skins':[{'joints':[1,2],'inverseBindMatrices':3}],"
        "'bufferViews':[" QUAD_VIEW ",{'buffer':0,'byteOffset':48,'byteLength':16},"
        "{'buffer':0,'byteOffset':64,'byteLength':64},"
        "{'buffer':0,'byteOffset':128,'byteLength':128}],"
        "'accessors':[" QUAD_POSITIONS
        ",{'bufferView':1,'componentType':5121,'count':4,'type':'VEC4'},"
        "{'bufferView':2,'componentType':5126,'count':4,'type':'VEC4'},"
        "{'bufferView':3,'componentType':5126,'count':2,'type':'MAT4'}],"
        "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':1,'WEIGHTS_0':2},"
        "'mode':5}]}]";
    struct cranny_scene *scene = good(&bytes, rest);
    if (scene && cranny_scene_instance_count(scene) == 1) {
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, 0);
        static const double expected_z[4] = {5, 10, 7.5, 10};
        for (int v = 0; v < 4; v++) {
            double p[3];
            transform_point(cranny_scene_instance(scene, 0)->world_from_object, mesh->positions[v],
                            p);
            CHECK_NEAR(p[0], quad[v][0], 1e-6);
            CHECK_NEAR(p[2], expected_z[v], 1e-6);
        }
    } else {
        CHECK(false);
    }
    cranny_scene_destroy(&scene);
    bytes.data[48 + 4] = 2;
    bad(&bytes, rest, CRANNY_INPUT, "/meshes/0/primitives/0");
}

static void test_morph(void)
{
    struct bytes bytes = quad_bytes();
    const float deltas[4][3] = {{0, 0, 1}, {0, 0, 2}, {0, 0, 3}, {0, 0, 4}};
    bytes_put(&bytes, deltas, sizeof deltas);
    struct cranny_scene *scene =
        good(&bytes, "'nodes':[{'mesh':0},{'mesh':0},{'mesh':0,'weights':[2]},"
                     "{'mesh':0,'weights':[0.5]}],'bufferViews':[" QUAD_VIEW
                     ",{'buffer':0,'byteOffset':48,'byteLength':48}],'accessors':[" QUAD_POSITIONS
                     ",{'bufferView':1,'componentType':5126,'count':4,'type':'VEC3'}],"
                     "'meshes':[{'weights':[0.5],'primitives':[{'attributes':{'POSITION':0},"
                     "'mode':5,'targets':[{'POSITION':1}]}]}]");
    if (scene) {
        CHECK_INT(cranny_scene_mesh_count(scene), 2); /* the last node's weights are the mesh's */
        CHECK_INT(cranny_scene_instance_count(scene), 4);
        CHECK_NEAR(cranny_scene_mesh(scene, 0)->positions[3][2], 2, 1e-6);
        CHECK_NEAR(cranny_scene_mesh(scene, 1)->positions[3][2], 8, 1e-6);
        CHECK_INT(cranny_scene_instance(scene, 3)->mesh, 0);
    }
    cranny_scene_destroy(&scene);
}

static void test_instancing(void)
{
    struct bytes bytes = quad_bytes();
    const float moves[2][3] = {{10, 0, 0}, {20, 0, 0}};
    const int8_t turns[2][4] = {{0, 0, 0, 127}, {0, 0, 127, 0}};
    const float scales[2][3] = {{1, 1, 1}, {3, 3, 3}};
    bytes_put(&bytes, moves, 24);
    bytes_put(&bytes, turns, 8);
    bytes_put(&bytes, scales, 24);
    static const char form[] =
        "'extensionsUsed':['EXT_mesh_gpu_instancing'],'nodes':[{'mesh':0,'translation':[0,0,1],"
        "'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':1,'ROTATION':2,"
        "'SCALE':3}}}}],'bufferViews':[" QUAD_VIEW ",{'buffer':0,'byteOffset':48,'byteLength':24},"
        "{'buffer':0,'byteOffset':72,'byteLength':8},{'buffer':0,'byteOffset':80,'byteLength':24}],"
        "'accessors':[" QUAD_POSITIONS
        ",{'bufferView':1,'componentType':5126,'count':2,'type':'VEC3'},"
        "{'bufferView':2,'componentType':5120,'count':2,'type':'VEC4','normalized':true},"
        "{'bufferView':3,'componentType':5126,'count':%d,'type':'VEC3'}],"
        "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':5}]}]";
    char rest[2048];
    snprintf(rest, sizeof rest, form, 2);
    struct cranny_scene *scene = good(&bytes, rest);
    if (scene && cranny_scene_instance_count(scene) == 2) {
        double p[3];
        transform_point(cranny_scene_instance(scene, 1)->world_from_object,
                        (const float[3]){1, 0, 0}, p);
        CHECK_NEAR(p[0], 17, 1e-5); /* half a turn about z, three times as large */
        CHECK_NEAR(p[1], 0, 1e-5);
        CHECK_NEAR(p[2], 1, 1e-5);
        CHECK_INT(scene->instances[1].source_index, 1);
        CHECK_INT(scene->instances[1].source_node, 0);
    } else {
        CHECK(false);
    }
    cranny_scene_destroy(&scene);
    snprintf(rest, sizeof rest, form, 1);
    bad(&bytes, rest, CRANNY_INPUT, "/nodes/0/extensions/EXT_mesh_gpu_instancing/SCALE");
}

static struct bytes masked_bytes(const float (*texcoords)[2], size_t *png_size)
{
    struct bytes bytes = quad_bytes();
    const uint8_t pixels[4][4] = {
        {255, 0, 0, 0}, {0, 255, 0, 80}, {0, 0, 255, 160}, {9, 9, 9, 255}};
    uint8_t *png;
    bytes_put(&bytes, texcoords, 32);
    CHECK_OK(png_encode(2, 2, 4, &pixels[0][0], 8, &png, png_size, &why), why);
    bytes_put(&bytes, png, *png_size);
    free(png);
    return bytes;
}

static const char masked_form[] =
    ONE_NODE "'bufferViews':[" QUAD_VIEW ",{'buffer':0,'byteOffset':48,'byteLength':32},"
             "{'buffer':0,'byteOffset':80,'byteLength':%zu}],'accessors':[" QUAD_POSITIONS
             ",{'bufferView':1,'componentType':5126,'count':4,'type':'VEC2'}],"
             "'images':[{'bufferView':2,'mimeType':'image/png'}],"
             "'samplers':[{'wrapS':33071,'wrapT':33648}],'textures':[{'source':0,'sampler':0}],"
             "'materials':[%s],'meshes':[{'primitives':[{'attributes':{'POSITION':0,"
             "'TEXCOORD_0':1},'mode':5,'material':0}]}]";

static struct cranny_scene *load_masked(const char *material)
{
    const float texcoords[4][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
    size_t png_size;
    char rest[2048];
    const struct bytes bytes = masked_bytes(texcoords, &png_size);
    snprintf(rest, sizeof rest, masked_form, png_size, material);
    return good(&bytes, rest);
}

static void test_alpha(void)
{
    struct cranny_scene *scene = load_masked(
        "{'alphaMode':'MASK','alphaCutoff':0.25,'doubleSided':true,'pbrMetallicRoughness':{"
        "'baseColorFactor':[1,1,1,0.5],'baseColorTexture':{'index':0,'extensions':{"
        "'KHR_texture_transform':{'offset':[0,1],'rotation':1.57079632679,'scale':[0.5,0.5]}}}}}");
    if (scene && cranny_scene_texture_count(scene) == 1) {
        const struct cranny_material *material = cranny_scene_material(scene, 0);
        const struct cranny_alpha_texture *texture = cranny_scene_texture(scene, 0);
        CHECK_INT(material->alpha_mode, CRANNY_ALPHA_MASK);
        CHECK_NEAR(material->alpha_cutoff, 0.25, 0);
        CHECK_NEAR(material->opacity, 0.5, 0);
        CHECK(material->double_sided);
        CHECK_INT(texture->wrap_u, CRANNY_WRAP_CLAMP);
        CHECK_INT(texture->wrap_v, CRANNY_WRAP_MIRROR);
        CHECK_INT(texture->alpha[1], 80);
        CHECK_INT(texture->alpha[2], 160);
        /* the extension's own example: the lower left quadrant, v down */
        const float *t = material->uv_transform, uv[2] = {0.5f, 0.5f};
        const double u = t[0] * uv[0] + t[1] * uv[1] + t[2], v = t[3] * uv[0] + t[4] * uv[1] + t[5];
        CHECK_NEAR(u, 0.25, 1e-6);
        CHECK_NEAR(v, 0.75, 1e-6);
        CHECK(cranny_scene_mesh(scene, 0)->texcoords != NULL);
    } else {
        CHECK(false);
    }
    cranny_scene_destroy(&scene);
}

static void test_materials(void)
{
    struct cranny_scene *scene = load_masked("{'pbrMetallicRoughness':{'baseColorTexture':"
                                             "{'index':0}}}");
    if (scene) { /* opaque materials' textures are not decoded */
        CHECK_INT(cranny_scene_texture_count(scene), 0);
        CHECK(cranny_scene_mesh(scene, 0)->texcoords == NULL);
    }
    cranny_scene_destroy(&scene);
    scene = load_masked("{'alphaMode':'BLEND','extensions':{'KHR_materials_pbrSpecularGlossiness':"
                        "{'diffuseFactor':[1,1,1,0.25],'diffuseTexture':{'index':0}}}}");
    if (scene) {
        CHECK_NEAR(cranny_scene_material(scene, 0)->opacity, 0.25, 0);
        CHECK_INT(cranny_scene_material(scene, 0)->alpha_texture, 0);
    }
    cranny_scene_destroy(&scene);
    scene =
        load_masked("{'extensions':{'KHR_materials_transmission':{'transmissionFactor':0.75}}}");
    if (scene) {
        CHECK_INT(cranny_scene_material(scene, 0)->alpha_mode, CRANNY_ALPHA_BLEND);
        CHECK_NEAR(cranny_scene_material(scene, 0)->opacity, 0.25, 1e-6);
    }
    cranny_scene_destroy(&scene);
}

static void count_warning(void *user, enum cranny_log_level level, const char *line)
{
    *(int *)user += level == CRANNY_LOG_WARNING && strstr(line, "opaque") != NULL;
}

/* What cannot be decoded is said, and taken as opaque. */
static void test_missing_texture(void)
{
    struct bytes bytes = quad_bytes();
    int warnings = 0;
    const struct cranny_hooks hooks = {.user = &warnings, .log = count_warning};
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    struct cranny_scene *scene;
    params.hooks = &hooks;
    char *text = gltf_text(
        &bytes, ONE_NODE "'images':[{'uri':'data:image/png;base64,AAAA'}],'textures':[{'source':0},"
                         "{'extensions':{'EXT_texture_webp':{'source':0}}}],"
                         "'materials':[{'alphaMode':'MASK','pbrMetallicRoughness':{"
                         "'baseColorTexture':{'index':0}}},{'alphaMode':'BLEND',"
                         "'pbrMetallicRoughness':{'baseColorTexture':{'index':1}}}],"
                         "'bufferViews':[" QUAD_VIEW "],'accessors':[" QUAD_POSITIONS "],"
                         "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':5,"
                         "'material':0},{'attributes':{'POSITION':0},'mode':5,'material':1}]}]");
    CHECK_OK(cranny_scene_load_memory(text, strlen(text), "test.gltf", &params, &scene, &why), why);
    CHECK_INT(warnings, 2);
    if (scene) {
        CHECK_INT(cranny_scene_material(scene, 0)->alpha_texture, -1);
        CHECK_INT(scene->meshes[0].part_count, 2);
    }
    cranny_scene_destroy(&scene);
    free(text);
}

static void test_shared_runs(void)
{
    struct bytes bytes = quad_bytes();
    const uint16_t indices[6] = {0, 1, 2, 2, 1, 3};
    bytes_put(&bytes, indices, sizeof indices);
    struct cranny_scene *scene =
        good(&bytes, ONE_NODE
             "'bufferViews':[" QUAD_VIEW ",{'buffer':0,'byteOffset':48,'byteLength':12}],"
             "'accessors':[" QUAD_POSITIONS ",{'bufferView':1,'componentType':5123,'count':3,"
             "'type':'SCALAR'},{'bufferView':1,'byteOffset':6,'componentType':5123,'count':3,"
             "'type':'SCALAR'}," QUAD_POSITIONS "],'meshes':[{'primitives':["
             "{'attributes':{'POSITION':0},'indices':1},{'attributes':{'POSITION':3},"
             "'indices':1},{'attributes':{'POSITION':0},'indices':2}]}]");
    if (scene) {
        const struct mesh *mesh = &scene->meshes[0];
        CHECK_INT(mesh->view.vertex_count, 8);
        CHECK_INT(mesh->part_count, 3);
        CHECK_INT(mesh->parts[0].vertex_first, mesh->parts[2].vertex_first);
        CHECK_INT(mesh->parts[1].vertex_first, 4);
        CHECK_INT(mesh->view.triangles[1][0], 4);
        CHECK_INT(mesh->view.triangles[2][2], 3);
    }
    cranny_scene_destroy(&scene);
}

static void test_normals(void)
{
    struct bytes bytes = quad_bytes();
    const float normals[4][3] = {{0, 0, 5}, {0, 0, 0}, {NAN, 0, 0}, {1, 0, 0}};
    bytes_put(&bytes, normals, sizeof normals);
    struct cranny_scene *scene =
        good(&bytes,
             ONE_NODE "'bufferViews':[" QUAD_VIEW ",{'buffer':0,'byteOffset':48,'byteLength':48}],"
                      "'accessors':[" QUAD_POSITIONS
                      ",{'bufferView':1,'componentType':5126,'count':4,'type':'VEC3'}],"
                      "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1},'mode':5},"
                      "{'attributes':{'POSITION':0},'mode':5}]}]");
    if (scene) {
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, 0);
        CHECK(mesh->normals != NULL);
        for (uint32_t v = 0; mesh->normals && v < mesh->vertex_count; v++) {
            CHECK_NEAR(mesh->normals[v][2], v == 3 ? 0 : 1, 1e-6);
            CHECK_NEAR(mesh->normals[v][0], v == 3 ? 1 : 0, 1e-6);
        }
    }
    cranny_scene_destroy(&scene);
    scene = good(&bytes, ONE_NODE QUAD_MESH);
    CHECK(scene && cranny_scene_mesh(scene, 0)->normals == NULL);
    cranny_scene_destroy(&scene);
}

static void test_broken_positions(void)
{
    float positions[4][3];
    memcpy(positions, quad, sizeof quad);
    positions[3][1] = NAN;
    struct bytes bytes = {.size = 0};
    bytes_put(&bytes, positions, sizeof positions);
    bad(&bytes, ONE_NODE QUAD_MESH, CRANNY_INPUT, "vertex 3");
    struct cranny_scene *scene =
        good(&bytes, ONE_NODE "'bufferViews':[" QUAD_VIEW "],'accessors':[" QUAD_POSITIONS "],"
                              "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]");
    if (scene) /* four vertices in list mode: the last is not used */
        CHECK_NEAR(cranny_scene_mesh(scene, 0)->positions[3][1], 0, 0);
    cranny_scene_destroy(&scene);
}

static void test_bad_accessors(void)
{
    struct bytes bytes = quad_bytes();
    static const struct {
        const char *view, *accessor;
        enum cranny_status status;
        const char *part;
    } cases[] = {
        {QUAD_VIEW, "'bufferView':0,'componentType':5126,'count':5,'type':'VEC3'", CRANNY_INPUT,
         "/accessors/0"},
        {QUAD_VIEW, "'bufferView':0,'byteOffset':4,'componentType':5126,'count':4,'type':'VEC3'",
         CRANNY_INPUT, "/accessors/0"},
        {QUAD_VIEW, "'bufferView':0,'componentType':5126,'count':4,'type':'VEC2'", CRANNY_INPUT,
         "POSITION"},
        {QUAD_VIEW, "'bufferView':0,'componentType':5124,'count':4,'type':'VEC3'", CRANNY_INPUT,
         "componentType"},
        {QUAD_VIEW, "'bufferView':3,'componentType':5126,'count':4,'type':'VEC3'", CRANNY_INPUT,
         "/accessors/0/bufferView"},
        {QUAD_VIEW, "'bufferView':0,'componentType':5126,'count':-4,'type':'VEC3'", CRANNY_INPUT,
         "/accessors/0/count"},
        {QUAD_VIEW, "'bufferView':0,'componentType':5126,'count':9007199254740993,'type':'VEC3'",
         CRANNY_INPUT, "/accessors/0"},
        {QUAD_VIEW, "'componentType':5126,'count':4000000000,'type':'VEC3'", CRANNY_INPUT,
         "32 bits"},
        {"{'buffer':0,'byteOffset':4,'byteLength':48}",
         "'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'", CRANNY_INPUT,
         "/bufferViews/0"},
        {"{'buffer':0,'byteOffset':9223372036854775807,'byteLength':9223372036854775807}",
         "'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'", CRANNY_INPUT,
         "/bufferViews/0"},
        {"{'buffer':0,'byteLength':48,'byteStride':8}",
         "'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'", CRANNY_INPUT,
         "/accessors/0"},
        {QUAD_VIEW,
         "'componentType':5126,'count':4,'type':'VEC3','sparse':{'count':1,'indices':{'bufferView':"
         "0,'byteOffset':13,'componentType':5121},'values':{'bufferView':0}}",
         CRANNY_OK, ""},
        {QUAD_VIEW,
         "'componentType':5126,'count':4,'type':'VEC3','sparse':{'count':1,'indices':{'bufferView':"
         "0,'byteOffset':15,'componentType':5121},'values':{'bufferView':0}}",
         CRANNY_INPUT, "/accessors/0/sparse/indices"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char rest[1024];
        snprintf(rest, sizeof rest,
                 ONE_NODE "'bufferViews':[%s],'accessors':[{%s}],"
                          "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':5}]}]",
                 cases[i].view, cases[i].accessor);
        struct cranny_scene *scene;
        enum cranny_status status = gltf_load(&bytes, rest, -1, &scene, &why);
        CHECK_MSG(status == cases[i].status, "case %zu: %s, '%s'", i, cranny_status_name(status),
                  why.message);
        CHECK_MSG(strstr(why.message, cases[i].part) != NULL, "case %zu: '%s' should name %s", i,
                  why.message, cases[i].part);
        cranny_scene_destroy(&scene);
    }
}

static void test_bad_primitives(void)
{
    struct bytes bytes = quad_bytes();
    const uint8_t indices[4] = {0, 1, 4, 0};
    bytes_put(&bytes, indices, sizeof indices);
    static const struct {
        const char *mesh, *part;
    } cases[] = {
        {"{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}", "index 2 is 4"},
        {"{'primitives':[{'attributes':{'POSITION':0},'indices':0}]}", "/primitives/0/indices"},
        {"{'primitives':[{'attributes':{'POSITION':0},'mode':7}]}", "mode 7"},
        {"{'primitives':[{'attributes':{'POSITION':9}}]}", "/attributes/POSITION"},
        {"{'primitives':[{'attributes':{'POSITION':0,'NORMAL':2}}]}", "/attributes/NORMAL"},
        {"{'primitives':[{}]}", "/meshes/0/primitives/0"},
        {"{'primitives':[{'attributes':{'POSITION':0},'material':0}]}", "material"},
        {"{}", "/meshes/0"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char rest[1024];
        snprintf(rest, sizeof rest,
                 ONE_NODE "'bufferViews':[" QUAD_VIEW
                          ",{'buffer':0,'byteOffset':48,'byteLength':4}],"
                          "'accessors':[" QUAD_POSITIONS
                          ",{'bufferView':1,'componentType':5121,'count':3,'type':'SCALAR'},"
                          "{'componentType':5126,'count':3,'type':'VEC3'}],'meshes':[%s]",
                 cases[i].mesh);
        bad(&bytes, rest, CRANNY_INPUT, cases[i].part);
    }
}

static void test_camera(void)
{
    struct bytes none = {.size = 0};
    struct cranny_scene *scene = good(
        &none, "'nodes':[{'camera':0,'translation':[1,2,3],'scale':[2,3,-4]},{'camera':1}],"
               "'cameras':[{'type':'perspective','perspective':{'yfov':0.6,'znear':0.1}},"
               "{'type':'orthographic','orthographic':{'xmag':-1,'ymag':0,'znear':0,'zfar':1}}]");
    if (scene && cranny_scene_camera_count(scene) == 2) {
        const struct cranny_camera *camera = cranny_scene_camera(scene, 0);
        CHECK_NEAR(camera->fov_y, 0.6, 1e-6);
        CHECK_NEAR(camera->world_from_view[3], 1, 0);
        CHECK_NEAR(transform_determinant(camera->world_from_view), 1, 1e-9);
        camera = cranny_scene_camera(scene, 1);
        CHECK(camera->orthographic && camera->half_height > 0 && camera->near_plane > 0);
    } else {
        CHECK(false);
    }
    cranny_scene_destroy(&scene);
}

static void test_attribute_reader(void)
{
    struct bytes bytes = quad_bytes();
    const uint8_t colors[4][4] = {{255, 0, 0, 255}, {0, 51, 0, 255}, {0}, {0}};
    bytes_put(&bytes, colors, sizeof colors);
    struct cranny_scene *scene =
        good(&bytes,
             ONE_NODE "'bufferViews':[" QUAD_VIEW ",{'buffer':0,'byteOffset':48,'byteLength':16}],"
                      "'accessors':[" QUAD_POSITIONS ",{'bufferView':1,'componentType':5121,"
                      "'count':4,'type':'VEC4','normalized':true}],'meshes':[{'primitives':"
                      "[{'attributes':{'POSITION':0,'COLOR_0':1},'mode':5}]}]");
    float *values;
    size_t count;
    int components;
    if (!scene)
        return;
    CHECK_OK(
        primitive_attribute(scene->document, 0, 0, "COLOR_0", &values, &count, &components, &why),
        why);
    CHECK_INT(count, 4);
    CHECK_INT(components, 4);
    if (values)
        CHECK_NEAR(values[5], 0.2, 1e-6);
    free(values);
    CHECK_OK(
        primitive_attribute(scene->document, 0, 0, "COLOR_1", &values, &count, &components, &why),
        why);
    CHECK(values == NULL);
    cranny_scene_destroy(&scene);
}

int main(void)
{
    test_modes();
    test_points_and_empty();
    test_sparse();
    test_quantized();
    test_nodes();
    test_scene_choice();
    test_bad_nodes();
    test_deep_chain();
    test_skin();
    test_morph();
    test_instancing();
    test_alpha();
    test_materials();
    test_missing_texture();
    test_shared_runs();
    test_normals();
    test_broken_positions();
    test_bad_accessors();
    test_bad_primitives();
    test_camera();
    test_attribute_reader();
    return check_end("gltf");
}
