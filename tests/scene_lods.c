/* Levels of detail: MSFT_lod, pairs by name, what is refused, and values written onto them. */
#include "scene_files.h"
#include "triangle_text.h"

#include "scene/accessor.h"
#include "scene/scene.h"

static struct cranny_error why;
static struct log log_;

#define LOD "'extensions':{'MSFT_lod':{'ids':"
#define MESH "'meshes':[{" PRIMITIVES "}],"

static const struct cranny_instance *named(const struct cranny_scene *scene, const char *name)
{
    static const struct cranny_instance none = {.name = "none", .lod = 99, .lod_group = 99};
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++)
        if (!strcmp(cranny_scene_instance(scene, i)->name, name))
            return cranny_scene_instance(scene, i);
    CHECK_MSG(false, "no instance '%s'", name);
    return &none;
}

static void check_level(const struct cranny_scene *scene, const char *name, uint32_t group,
                        uint32_t lod)
{
    const struct cranny_instance *instance = named(scene, name);
    CHECK_MSG(instance->lod_group == group && instance->lod == lod,
              "%s: group %u, lod %u; expected %u, %u", name, instance->lod_group, instance->lod,
              group, lod);
}

/* A house in a moved village; its levels stand outside the graph, one with a child. */
static void test_extension(void)
{
    struct cranny_scene *scene = load_quoted(
        "'extensionsUsed':['MSFT_lod']," MESH
        "'nodes':[{'children':[1],'translation':[10,0,0],'extras':{'cranny_role':'tree'}},"
        "{'name':'fine','mesh':0,'translation':[1,0,0],'children':[2]," LOD "[3,5]}}},"
        "{'name':'fine child','mesh':0},{'name':'middle','translation':[2,0,0],'mesh':0,"
        "'children':[4]},{'name':'middle child','mesh':0,'translation':[0,1,0]},"
        "{'name':'far','mesh':0},{'name':'other','mesh':0}],'scenes':[{'nodes':[0,6]}]}",
        &log_);
    CHECK_INT(log_.lines, 0);
    CHECK_INT(cranny_scene_instance_count(scene), 6);
    check_level(scene, "fine", 1, 0);
    check_level(scene, "fine child", 1, 0);
    check_level(scene, "middle", 1, 1);
    check_level(scene, "middle child", 1, 1);
    check_level(scene, "far", 1, 2);
    check_level(scene, "other", 0, 0);
    CHECK_NEAR(named(scene, "middle")->world_from_object[3], 12, 0);
    CHECK_NEAR(named(scene, "middle child")->world_from_object[3], 12, 0);
    CHECK_NEAR(named(scene, "middle child")->world_from_object[7], 1, 0);
    CHECK_NEAR(named(scene, "far")->world_from_object[3], 10, 0);
    CHECK_INT(named(scene, "far")->role, CRANNY_ROLE_TREE);
    struct cranny_scene_info info;
    cranny_scene_get_info(scene, &info);
    CHECK_INT(info.triangles, 3);
    CHECK_INT(info.lod_triangles, 3);
    CHECK_INT(info.lod_vertices, 9);
    CHECK_INT(info.lod_instances, 3);
    CHECK_INT(info.lod_groups, 1);
    CHECK_INT(info.role_instances[CRANNY_ROLE_TREE], 2);
    CHECK_NEAR(info.bounds[3], 12, 0); /* "middle" would reach 13 */
    cranny_scene_destroy(&scene);
}

/* Levels that are also drawn by the scene stay in their place and are loaded once. */
static void test_in_graph(void)
{
    struct cranny_scene *scene =
        load_quoted(MESH "'nodes':[{'name':'far','mesh':0,'translation':[5,0,0]},"
                         "{'name':'fine','mesh':0," LOD "[0,2]}},'children':[2]},"
                         "{'name':'child level','mesh':0}],'scenes':[{'nodes':[0,1]}]}",
                    &log_);
    CHECK_INT(log_.lines, 0);
    CHECK_INT(cranny_scene_instance_count(scene), 3);
    check_level(scene, "fine", 1, 0);
    check_level(scene, "far", 1, 1);
    check_level(scene, "child level", 1, 2);
    CHECK_NEAR(named(scene, "far")->world_from_object[3], 5, 0);
    cranny_scene_destroy(&scene);
}

/* Inner groups join the outer one. */
static void test_nested(void)
{
    struct cranny_scene *scene =
        load_quoted(MESH "'nodes':[{'name':'a','mesh':0,'children':[1]," LOD "[3]}}},"
                         "{'name':'b','mesh':0," LOD "[2]}}},{'name':'b1','mesh':0},"
                         "{'name':'a1','mesh':0," LOD "[4]}}},{'name':'a2','mesh':0}],"
                         "'scenes':[{'nodes':[0]}]}",
                    &log_);
    check_level(scene, "a", 1, 0);
    check_level(scene, "b", 1, 0);
    check_level(scene, "b1", 1, 1);
    check_level(scene, "a1", 1, 1);
    check_level(scene, "a2", 1, 2);
    cranny_scene_destroy(&scene);
}

/* What a file may get wrong: one line each, and the rest is loaded. */
static void test_faults(void)
{
    static const struct {
        const char *rest, *said;
        int lines;
    } cases[] = {
        {"[{'name':'a','mesh':0," LOD "[7]}}}]", "/nodes/0/extensions/MSFT_lod/ids/0", 1},
        {"[{'name':'a','mesh':0," LOD "[-1,'x',0.5,null]}}}]", "must be the index of a node", 4},
        {"[{'name':'a','mesh':0," LOD "[0]}}}]", "already is a level of node 0", 1},
        {"[{'name':'a','mesh':0," LOD "3}}}]", "no list of ids", 1},
        {"[{'name':'a','mesh':0," LOD "[1]}}},{'mesh':0," LOD "[0]}}}]", "above their own", 1},
        {"[{'name':'a','mesh':0,'children':[1]},{'mesh':0," LOD "[0]}}}]", "above their own", 1},
        {"[{'name':'a','mesh':0," LOD "[2]}}},{'mesh':0," LOD "[2]}}},{'mesh':0}]",
         "node 2 already is a level of node 0", 1},
        {"[{'name':'a','mesh':0," LOD "[1,1]}}},{'mesh':0}]", "already is a level", 1},
        {"[{'name':'a','mesh':0," LOD "[9,9,9,9,9,9,9,9,9,9,9,9]}}}]", "4 more faults", 9},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char rest[512];
        snprintf(rest, sizeof rest, MESH "'nodes':%s}", cases[i].rest);
        struct cranny_scene *scene = load_quoted(rest, &log_);
        CHECK_MSG(log_.lines == cases[i].lines && strstr(log_.last, cases[i].said),
                  "case %zu: %d lines, %s", i, log_.lines, log_.last);
        CHECK_INT(named(scene, "a")->lod, 0);
        /* names above are climbed to an end */
        const struct cranny_role_rule rule = {"nothing", CRANNY_ROLE_TREE};
        CHECK_OK(cranny_scene_assign_roles(scene, &rule, 1, NULL, &why), why);
        cranny_scene_destroy(&scene);
    }
}

/* Two trees of a hundred thousand nodes that name each other: linear, not quadratic. */
static void test_hostile(void)
{
    enum { DEPTH = 50000 };
    char *rest = malloc(120 * 2 * DEPTH + 512), *at = rest;
    at += sprintf(at, MESH "'nodes':[");
    for (int i = 0; i < 2 * DEPTH; i++) {
        at += sprintf(at, "%s{'mesh':0", i ? "," : "");
        if (i % DEPTH + 1 < DEPTH)
            at += sprintf(at, ",'children':[%d]", i + 1);
        at += sprintf(at, "," LOD "[%d,%d]}}}", 2 * DEPTH - 1 - i, (i * 7) % (2 * DEPTH));
    }
    sprintf(at, "],'scenes':[{'nodes':[0,%d]}]}", DEPTH);
    struct cranny_scene *scene = load_quoted(rest, &log_);
    CHECK_INT(cranny_scene_instance_count(scene), 2 * DEPTH);
    cranny_scene_destroy(&scene);
    free(rest);
}

static void test_material_form(void)
{
    struct cranny_scene *scene =
        load_quoted(MESH "'materials':[{},{" LOD "[0]}}}],'nodes':[{'mesh':0}]}", &log_);
    CHECK_INT(log_.lines, 1);
    CHECK_MSG(strstr(log_.last, "/materials/1"), "%s", log_.last);
    cranny_scene_destroy(&scene);
}

static void test_names(void)
{
    struct cranny_scene *scene = load_quoted(
        MESH
        "'nodes':[{'name':'Rock_LOD0','mesh':0},{'name':'Rock_LOD1','mesh':0},"
        "{'name':'Rock_LOD2','children':[3]},{'name':'inside','mesh':0},"
        "{'name':'House','mesh':0},{'name':'House_lod1','mesh':0},"
        "{'name':'Twig.002','mesh':0},{'name':'Twig_LOD1.002','mesh':0},"
        "{'name':'Fence_LOD1','mesh':0},{'name':'Fence_LOD3','mesh':0},"
        "{'name':'lonely_LOD1','mesh':0},{'name':'both','mesh':0},{'name':'both_LOD0','mesh':0},"
        "{'name':'both_LOD1','mesh':0},{'name':'Rock','children':[15]},"
        "{'name':'Rock_LOD1','mesh':0},{'name':'_LOD1','mesh':0},{'name':'x_LODs','mesh':0}]}",
        &log_);
    CHECK_INT(log_.lines, 0);
    check_level(scene, "Rock_LOD0", 1, 0);
    check_level(scene, "Rock_LOD1", 1, 1);
    check_level(scene, "inside", 1, 2);
    check_level(scene, "House", 2, 0);
    check_level(scene, "House_lod1", 2, 1);
    check_level(scene, "Twig.002", 3, 0);
    check_level(scene, "Twig_LOD1.002", 3, 1);
    check_level(scene, "Fence_LOD1", 4, 0);
    check_level(scene, "Fence_LOD3", 4, 2);
    check_level(scene, "lonely_LOD1", 0, 0);
    check_level(scene, "both", 0, 0);
    check_level(scene, "both_LOD0", 5, 0);
    check_level(scene, "both_LOD1", 5, 1);
    check_level(scene, "_LOD1", 0, 0);
    CHECK_INT(cranny_scene_instance(scene, 13)->lod_group, 0); /* another parent */
    cranny_scene_destroy(&scene);
}

/* A sheet of samples: the levels stand side by side and are all drawn. */
static void test_apart(void)
{
    struct cranny_scene *scene = load_quoted(
        MESH "'nodes':[{'name':'Rock_LOD0','mesh':0},{'name':'Rock_LOD1','mesh':0,'translation':"
             "[3,0,0]},{'name':'Tree_LOD0','mesh':0},{'name':'Tree_LOD1','mesh':0}]}",
        &log_);
    CHECK_INT(log_.lines, 1);
    CHECK_MSG(strstr(log_.last, "/nodes/1: 'Rock_LOD1' is named"), "%s", log_.last);
    check_level(scene, "Rock_LOD0", 0, 0);
    check_level(scene, "Rock_LOD1", 0, 0);
    check_level(scene, "Tree_LOD0", 1, 0);
    check_level(scene, "Tree_LOD1", 1, 1);
    cranny_scene_destroy(&scene);
}

/* A level that hangs before the node above it does: what is below is drawn once, and queued once.
 */
static void test_hung_twice(void)
{
    struct cranny_scene *scene =
        load_quoted(MESH "'nodes':[{'name':'a','mesh':0," LOD "[1,2]}}},{'name':'b','children':"
                         "[3,4,5,6,7]},{'name':'c','children':[1]},{'name':'d','mesh':0},"
                         "{'name':'e','mesh':0},{'name':'f','mesh':0},{'name':'g','mesh':0},"
                         "{'name':'h','mesh':0}],'scenes':[{'nodes':[0]}]}",
                    &log_);
    CHECK_INT(cranny_scene_instance_count(scene), 6);
    check_level(scene, "a", 1, 0);
    check_level(scene, "d", 1, 1);
    check_level(scene, "h", 1, 1);
    cranny_scene_destroy(&scene);
}

/* A finest without triangles: the next one is drawn. */
static void test_empty_finest(void)
{
    struct cranny_scene *scene =
        load_quoted(MESH "'nodes':[{'name':'a'," LOD "[1,2]}}},{'name':'b','mesh':0},"
                         "{'name':'c','mesh':0}],'scenes':[{'nodes':[0]}]}",
                    &log_);
    check_level(scene, "b", 1, 0);
    check_level(scene, "c", 1, 1);
    cranny_scene_destroy(&scene);
}

/* Rules reach coarser levels through their finest. */
static void test_rules(void)
{
    struct cranny_scene *scene =
        load_quoted(MESH "'nodes':[{'name':'Oak','mesh':0," LOD "[1]}}},{'name':'b','mesh':0},"
                         "{'name':'Elm','mesh':0},{'name':'Elm_LOD1','mesh':0}],"
                         "'scenes':[{'nodes':[0,2,3]}]}",
                    &log_);
    const struct cranny_role_rule rules[] = {{"oak", CRANNY_ROLE_TREE}, {"Elm", CRANNY_ROLE_GRASS}};
    CHECK_OK(cranny_scene_assign_roles(scene, rules, 2, NULL, &why), why);
    CHECK_INT(named(scene, "b")->role, CRANNY_ROLE_TREE);
    CHECK_INT(named(scene, "Elm_LOD1")->role, CRANNY_ROLE_GRASS);
    cranny_scene_destroy(&scene);
}

static struct cranny_scene *array_scene(void)
{
    static const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const uint32_t triangle[1][3] = {{0, 1, 2}};
    static const struct {
        const char *name;
        uint32_t group, lod;
        enum cranny_role role;
    } things[] = {
        {"a", 7, 0, CRANNY_ROLE_SOLID},  {"a1", 7, 1, CRANNY_ROLE_SOLID},
        {"a2", 7, 4, CRANNY_ROLE_SOLID}, {"b", 9, 0, CRANNY_ROLE_TREE},
        {"bb", 9, 0, CRANNY_ROLE_TREE},  {"b1", 9, 1, CRANNY_ROLE_TREE},
        {"c", 0, 0, CRANNY_ROLE_GRASS},
    };
    struct cranny_scene *scene;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    const struct cranny_mesh mesh = {.name = "m",
                                     .vertex_count = 3,
                                     .triangle_count = 1,
                                     .positions = corners,
                                     .triangles = triangle};
    CHECK_OK(cranny_scene_add_mesh(scene, &mesh, NULL, &why), why);
    for (size_t i = 0; i < sizeof things / sizeof *things; i++) {
        const struct cranny_instance instance = {
            .name = things[i].name,
            .world_from_object = {1, 0, 0, (double)i, 0, 1, 0, 0, 0, 0, 1},
            .lod = things[i].lod,
            .lod_group = things[i].group,
            .role = things[i].role};
        CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
    }
    return scene;
}

static const struct {
    enum cranny_output to;
    const char *attribute;
} outputs[] = {{CRANNY_OUTPUT_ATTRIBUTE, "_AO"},
               {CRANNY_OUTPUT_OCCLUSION, "TEXCOORD_0"},
               {CRANNY_OUTPUT_COLOR, "COLOR_0"}};

/* Write a value of its own onto every instance, whatever its level, and find it in the file. */
static void check_values(const struct cranny_scene *scene, const char *path, size_t output)
{
    const uint32_t count = cranny_scene_instance_count(scene);
    float(*values)[3] = calloc(count, sizeof *values);
    const float **pointers = calloc(count, sizeof *pointers);
    for (uint32_t i = 0; i < count; i++) {
        for (int v = 0; v < 3; v++)
            values[i][v] = (float)(i + 1) / 16 + (float)v / 256;
        pointers[i] = values[i];
    }
    const struct scene_values all = {.visibility = pointers};
    struct cranny_save_params params = cranny_save_params_default();
    params.to = outputs[output].to;
    CHECK_OK(scene_write(scene, &all, path, &params, &why), why);
    struct cranny_scene *back = NULL;
    struct log warnings = {0};
    struct cranny_hooks hooks = {.user = &warnings, .log = keep_line};
    struct cranny_scene_load_params load = cranny_scene_load_params_default();
    load.hooks = &hooks;
    CHECK_OK(cranny_scene_load(path, &load, &back, &why), why);
    CHECK_INT(warnings.lines, 0);
    CHECK_INT(back ? cranny_scene_instance_count(back) : 0, count);
    for (uint32_t i = 0; back && i < count; i++) {
        const struct cranny_instance *from = cranny_scene_instance(scene, i);
        const struct cranny_instance *to = named(back, from->name);
        CHECK_INT(to->role, from->role);
        CHECK_INT(to->lod > 0, from->lod > 0);
        CHECK_INT(to->lod_group > 0, from->lod_group > 0);
        CHECK_NEAR(to->world_from_object[3], from->world_from_object[3], 0);
        float *read;
        size_t vertices;
        int components;
        CHECK_OK(primitive_attribute(back->document, (size_t)back->meshes[to->mesh].source_mesh, 0,
                                     outputs[output].attribute, &read, &vertices, &components,
                                     &why),
                 why);
        for (size_t v = 0; read && v < 3; v++)
            CHECK_NEAR((double)read[v * (size_t)components], (double)values[i][v], 1e-5);
        free(read);
    }
    cranny_scene_destroy(&back);
    free(values);
    free(pointers);
}

/* Without nodes, too, coarser levels go with their finest. */
static void test_array_rules(void)
{
    struct cranny_scene *scene = array_scene();
    const struct cranny_role_rule rules[] = {{"b", CRANNY_ROLE_IGNORED},
                                             {"a1", CRANNY_ROLE_GRASS},
                                             {"a", CRANNY_ROLE_SHRUB},
                                             {"a2", CRANNY_ROLE_TREE}};
    uint32_t matched[4];
    CHECK_OK(cranny_scene_assign_roles(scene, rules, 4, matched, &why), why);
    for (int i = 0; i < 4; i++)
        CHECK_INT(matched[i], 1);
    CHECK_INT(named(scene, "b1")->role, CRANNY_ROLE_IGNORED);
    CHECK_INT(named(scene, "bb")->role, CRANNY_ROLE_TREE);
    CHECK_INT(named(scene, "a1")->role, CRANNY_ROLE_SHRUB);
    CHECK_INT(named(scene, "a2")->role, CRANNY_ROLE_TREE);
    cranny_scene_destroy(&scene);
}

static void test_values(void)
{
    char *folder = scratch_folder();
    static const char *const names[] = {"out.glb", "out.gltf"};
    for (size_t i = 0; i < 2 * sizeof outputs / sizeof *outputs; i++) {
        char *path = join_path(folder, names[i % 2]);
        struct cranny_scene *scene = array_scene();
        check_values(scene, path, i / 2);
        cranny_scene_destroy(&scene);
        scene = load_quoted(MESH "'extensionsUsed':['MSFT_lod'],'nodes':[{'name':'a','mesh':0," LOD
                                 "[1]}}},{'name':'b','mesh':0},{'name':'c','mesh':0},"
                                 "{'name':'c_LOD1','mesh':0}],'scenes':[{'nodes':[0,2,3]}]}",
                            &log_);
        check_values(scene, path, i / 2);
        cranny_scene_destroy(&scene);
        free(path);
    }
    remove_folder(folder);
    free(folder);
}

static void test_refused(void)
{
    struct cranny_scene *scene = array_scene();
    struct cranny_instance instance = {.world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                       .lod = 1};
    CHECK_INT(cranny_scene_add_instance(scene, &instance, NULL, &why), CRANNY_USAGE);
    instance.lod = 0;
    instance.role = (enum cranny_role)5;
    CHECK_INT(cranny_scene_add_instance(scene, &instance, NULL, &why), CRANNY_USAGE);
    struct cranny_scene_info info;
    cranny_scene_get_info(scene, &info);
    CHECK_INT(info.lod_groups, 2);
    CHECK_INT(info.lod_instances, 3);
    cranny_scene_destroy(&scene);
}

int main(void)
{
    test_extension();
    test_in_graph();
    test_nested();
    test_faults();
    test_hostile();
    test_material_form();
    test_names();
    test_apart();
    test_empty_finest();
    test_hung_twice();
    test_rules();
    test_array_rules();
    test_values();
    test_refused();
    return check_end("scene_lods");
}
