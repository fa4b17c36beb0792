/* Roles: what extras say, rules by name, and what a scene counts of them. */
#include "scene_files.h"
#include "triangle_text.h"

#include "scene/scene.h"

static struct cranny_error why;
static struct log log_;

static enum cranny_role role_of(const struct cranny_scene *scene, uint32_t index)
{
    return cranny_scene_instance(scene, index)->role;
}

/* A forest: node, mesh and nodes above speak; the nearest is heard. */
static void test_extras(void)
{
    struct cranny_scene *scene = load_quoted(
        "'meshes':[{" PRIMITIVES "},{" PRIMITIVES ",'extras':{'cranny_role':'shrub'}}],"
        "'nodes':[{'children':[1,2,3],'extras':{'cranny_role':'tree'}},{'mesh':0},"
        "{'mesh':1,'children':[4]},{'mesh':1,'extras':{'cranny_role':'Grass'}},{'mesh':0},"
        "{'mesh':1},{'mesh':0}],'scenes':[{'nodes':[0,5,6]}]}",
        &log_);
    const enum cranny_role expected[] = {CRANNY_ROLE_TREE, CRANNY_ROLE_SHRUB, CRANNY_ROLE_GRASS,
                                         CRANNY_ROLE_TREE, CRANNY_ROLE_SHRUB, CRANNY_ROLE_SOLID};
    CHECK_INT(cranny_scene_instance_count(scene), 6);
    for (uint32_t i = 0; i < 6; i++)
        CHECK_INT(role_of(scene, i), expected[i]);
    CHECK_INT(log_.lines, 0);
    cranny_scene_destroy(&scene);
}

static void test_wrong_words(void)
{
    struct cranny_scene *scene =
        load_quoted("'meshes':[{" PRIMITIVES ",'extras':{'cranny_role':7}}],"
                    "'nodes':[{'mesh':0,'extras':{'cranny_role':'bush'}},{'mesh':0}]}",
                    &log_);
    CHECK_INT(log_.lines, 2); /* the mesh is complained of once */
    CHECK_MSG(strstr(log_.first, "/nodes/0/extras/cranny_role: 'bush' is no role"), "%s",
              log_.first);
    CHECK_MSG(strstr(log_.last, "/meshes/0/extras/cranny_role"), "%s", log_.last);
    CHECK_INT(role_of(scene, 0), CRANNY_ROLE_SOLID);
    cranny_scene_destroy(&scene);
}

/* Instances of EXT_mesh_gpu_instancing have their node's role; accessor 0 serves as translations.
 */
static void test_instanced(void)
{
    struct cranny_scene *scene = load_quoted(
        "'extensionsUsed':['EXT_mesh_gpu_instancing'],'meshes':[{" PRIMITIVES "}],"
        "'nodes':[{'mesh':0,'name':'Clump','extras':{'cranny_role':'grass'},'extensions':"
        "{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':0}}}},{'mesh':0}]}",
        &log_);
    struct cranny_scene_info info;
    cranny_scene_get_info(scene, &info);
    CHECK_INT(info.role_instances[CRANNY_ROLE_GRASS], 3);
    CHECK_INT(info.role_instances[CRANNY_ROLE_SOLID], 1);
    const struct cranny_role_rule rules[] = {{"clump", CRANNY_ROLE_IGNORED}};
    uint32_t matched;
    CHECK_OK(cranny_scene_assign_roles(scene, rules, 1, &matched, &why), why);
    CHECK_INT(matched, 3);
    CHECK_INT(cranny_scene_triangle_count(scene), 1);
    CHECK_INT(cranny_scene_vertex_count(scene), 3);
    cranny_scene_get_info(scene, &info);
    CHECK_INT(info.instances, 4);
    CHECK_INT(info.role_triangles[CRANNY_ROLE_IGNORED], 3);
    cranny_scene_destroy(&scene);
}

/* Own names, mesh names, names above; the last rule wins. */
static void test_rules(void)
{
    struct cranny_scene *scene = load_quoted(
        "'meshes':[{'name':'Leaf'," PRIMITIVES "},{'name':'Rock'," PRIMITIVES "}],"
        "'nodes':[{'name':'Garden','children':[1,2]},{'name':'Tree_Oak','mesh':0},"
        "{'name':'Stone','mesh':1},{'name':'tree','mesh':1}],'scenes':[{'nodes':[0,3]}]}",
        &log_);
    const struct cranny_role_rule rules[] = {{"TREE_*", CRANNY_ROLE_TREE},
                                             {"garden", CRANNY_ROLE_GRASS},
                                             {"l??f", CRANNY_ROLE_SHRUB},
                                             {"nothing*", CRANNY_ROLE_IGNORED}};
    uint32_t matched[4];
    CHECK_OK(cranny_scene_assign_roles(scene, rules, 4, matched, &why), why);
    CHECK_INT(matched[0], 1);
    CHECK_INT(matched[1], 2);
    CHECK_INT(matched[2], 1);
    CHECK_INT(matched[3], 0);
    CHECK_INT(role_of(scene, 0), CRANNY_ROLE_SHRUB);
    CHECK_INT(role_of(scene, 1), CRANNY_ROLE_GRASS);
    CHECK_INT(role_of(scene, 2), CRANNY_ROLE_SOLID);
    const struct cranny_role_rule wrong = {"*", (enum cranny_role)9};
    CHECK_INT(cranny_scene_assign_roles(scene, &wrong, 1, NULL, &why), CRANNY_USAGE);
    cranny_scene_destroy(&scene);
}

/* One name against patterns, through the public door. */
static void test_patterns(void)
{
    static const struct {
        const char *name, *pattern;
        bool match;
    } cases[] = {
        {"Tree", "tree", true},
        {"Tree", "tre", false},
        {"Tree", "tree?", false},
        {"Tree", "*", true},
        {"Tree", "", false},
        {"", "", true},
        {"", "*", true},
        {"", "?", false},
        {"abcabd", "*abd", true},
        {"abcabd", "*b*b*", true},
        {"abcabd", "*b*b*b", false},
        {"B\xc3\xbcsche", "b?sche", true},
        {"a*b", "a*b", true},
        {"aXb", "a**b", true},
        {"shrub_12", "shrub_??", true},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        static const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
        static const uint32_t triangle[1][3] = {{0, 1, 2}};
        struct cranny_scene *scene;
        CHECK_OK(cranny_scene_create(&scene, &why), why);
        const struct cranny_mesh mesh = {.name = "\x01",
                                         .vertex_count = 3,
                                         .triangle_count = 1,
                                         .positions = corners,
                                         .triangles = triangle};
        CHECK_OK(cranny_scene_add_mesh(scene, &mesh, NULL, &why), why);
        struct cranny_instance instance = {.name = cases[i].name,
                                           .world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
        CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
        const struct cranny_role_rule rule = {cases[i].pattern, CRANNY_ROLE_TREE};
        uint32_t matched;
        CHECK_OK(cranny_scene_assign_roles(scene, &rule, 1, &matched, &why), why);
        /* the mesh's name takes part, too: only patterns of any one character match it */
        CHECK_MSG((role_of(scene, 0) == CRANNY_ROLE_TREE) ==
                      (cases[i].match || !strcmp(cases[i].pattern, "?")),
                  "'%s' against '%s'", cases[i].name, cases[i].pattern);
        cranny_scene_destroy(&scene);
    }
}

/* A long name of one letter and a pattern of many stars: quick, or the test's time runs out. */
static void test_hostile_pattern(void)
{
    enum { LENGTH = 100000, STARS = 2000 };
    char *rest = malloc(LENGTH + 256), *pattern = malloc(2 * STARS + 8);
    char *at = rest + sprintf(rest, "'meshes':[{" PRIMITIVES "}],'nodes':[{'mesh':0,'name':'");
    memset(at, 'a', LENGTH);
    strcpy(at + LENGTH, "'}]}");
    for (int i = 0; i < STARS; i++)
        memcpy(pattern + 2 * i, "*a", 2);
    strcpy(pattern + 2 * STARS, "*b");
    struct cranny_scene *scene = load_quoted(rest, &log_);
    const struct cranny_role_rule rule = {pattern, CRANNY_ROLE_TREE};
    uint32_t matched = 1;
    CHECK_OK(cranny_scene_assign_roles(scene, &rule, 1, &matched, &why), why);
    CHECK_INT(matched, 0);
    cranny_scene_destroy(&scene);
    free(rest);
    free(pattern);
}

/* A chain of nodes, each with a mesh: names above are looked at once a rule. */
static void test_deep(void)
{
    enum { DEPTH = 100000 };
    char *rest = malloc(64 * DEPTH + 256), *at = rest;
    at +=
        sprintf(at, "'meshes':[{" PRIMITIVES "}],'nodes':[{'name':'top','mesh':0,'children':[1]}");
    for (int i = 1; i < DEPTH; i++)
        at += sprintf(at, i + 1 < DEPTH ? ",{'mesh':0,'children':[%d]}" : ",{'mesh':0}", i + 1);
    sprintf(at, "],'scenes':[{'nodes':[0]}]}");
    struct cranny_scene *scene = load_quoted(rest, &log_);
    const struct cranny_role_rule rules[] = {{"top", CRANNY_ROLE_TREE}, {"x", CRANNY_ROLE_SHRUB}};
    uint32_t matched[2];
    CHECK_OK(cranny_scene_assign_roles(scene, rules, 2, matched, &why), why);
    CHECK_INT(matched[0], DEPTH);
    CHECK_INT(matched[1], 0);
    cranny_scene_destroy(&scene);
    free(rest);
}

/* Imports keep the names that their format has. */
static void test_import(void)
{
    char *folder = scratch_folder(), path[512];
    snprintf(path, sizeof path, "%s/two.obj", folder);
    static const char text[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no Tree_1\nf 1 2 3\n"
                               "o Wall\nf 1 2 4\n";
    CHECK_OK(cranny_file_write(path, text, sizeof text - 1, &why), why);
    struct cranny_scene *scene = NULL;
    CHECK_OK(cranny_scene_load(path, NULL, &scene, &why), why);
    const struct cranny_role_rule rule = {"tree_*", CRANNY_ROLE_TREE};
    uint32_t matched = 0;
    if (scene)
        CHECK_OK(cranny_scene_assign_roles(scene, &rule, 1, &matched, &why), why);
    CHECK_INT(matched, 1);
    cranny_scene_destroy(&scene);
    remove_folder(folder);
    free(folder);
}

/* What the doctor says of roles and levels, one finding a line. */
struct findings {
    char text[8192];
    int proposed, unpaired;
};

static void keep_finding(void *user, enum cranny_severity severity, const char *code,
                         const char *text)
{
    struct findings *findings = user;
    const size_t used = strlen(findings->text);
    (void)severity;
    findings->proposed += !strcmp(code, "role-proposed");
    findings->unpaired += !strcmp(code, "unpaired-lods");
    snprintf(findings->text + used, sizeof findings->text - used, "%s\n", text);
}

/* `count` copies of a triangle of `size` metres on a ground of 100 m. */
static struct findings examine(const char *mesh, const char *name, int count, double size,
                               const char *material)
{
    struct findings findings = {0};
    char *rest = malloc(4096 + 160 * (size_t)count), *at = rest;
    at += sprintf(at,
                  "'materials':[{'name':'ground'},%s],'meshes':[{'name':'ground','primitives':"
                  "[{'attributes':{'POSITION':0},'indices':1,'material':0}]},{'name':'%s',"
                  "'primitives':[{'attributes':{'POSITION':0},'indices':1,'material':1}]}],"
                  "'nodes':[{'name':'ground','mesh':0,'scale':[100,1,100]},"
                  "{'name':'ground','mesh':0,'rotation':[0.7071068,0,0,0.7071068],"
                  "'scale':[100,100,1]}",
                  material, mesh);
    for (int i = 0; i < count; i++) {
        at += sprintf(at, ",{'name':'");
        at += sprintf(at, name, i);
        at += sprintf(at, "','mesh':1,'scale':[%g,%g,1],'translation':[%d,0,%d]}", size, size,
                      i % 10, i / 10);
    }
    sprintf(at, "]}");
    struct cranny_scene *scene = load_quoted(rest, &log_);
    CHECK_OK(cranny_scene_check(scene, keep_finding, &findings, &why), why);
    cranny_scene_destroy(&scene);
    free(rest);
    return findings;
}

static void test_proposals(void)
{
    static const char plain[] = "{'name':'m'}", mask[] = "{'name':'m','alphaMode':'MASK'}";
    static const struct {
        const char *mesh, *name, *material;
        int count;
        double size;
        const char *said; /* NULL: nothing */
    } cases[] = {
        {"m", "Shrub_%03d", plain, 20, 1, "--role shrub='Shrub*'"},
        {"appleTree", "node %d", plain, 5, 6, "--role tree='appleTree'"},
        {"Fern.004", "", plain, 5, 1, "--role shrub='Fern*'"},
        {"m", "grass %d", plain, 9, 0.3, "--role grass='grass*'"},
        {"m", "street_%d", plain, 20, 1, NULL},
        {"m", "grass %d", plain, 9, 30, NULL}, /* lawns */
        {"m", "plant_%d", plain, 9, 0.2, "--role grass="},
        {"m", "plant_%d", plain, 9, 1, "--role shrub="},
        {"m", "plant_%d", plain, 9, 4, "--role tree="},
        {"m", "thing_%d", plain, 300, 1, NULL},
        {"m", "thing_%d", mask, 9, 1, NULL},
        {"frond", "thing_%d", mask, 30, 1, "--role shrub='frond'"},
        {"ground", "thing_%d", mask, 30, 1, NULL}, /* the name is the ground's, too */
        {"m", "quick \\u0027n\\u0027 bush*%d", plain, 5, 1, "--role shrub='quick ?n? bush?*'"},
        {"m", "SkyBox", plain, 1, 99, "--role ignored='SkyBox'"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct findings findings =
            examine(cases[i].mesh, cases[i].name, cases[i].count, cases[i].size, cases[i].material);
        CHECK_MSG(findings.proposed == (cases[i].said != NULL) &&
                      (!cases[i].said || strstr(findings.text, cases[i].said)),
                  "case %zu: %s", i, findings.text);
        CHECK_INT(findings.unpaired, 0);
    }
    const struct findings findings = examine("m", "a_LOD%d", 1, 1, plain);
    CHECK_INT(findings.unpaired, 0);
}

static void test_unpaired(void)
{
    struct findings findings = {0};
    struct cranny_scene *scene = load_quoted(
        "'meshes':[{" PRIMITIVES "}],'nodes':[{'name':'a_LOD1','mesh':0},{'name':'b_LOD1.001',"
        "'mesh':0},{'name':'b_LOD2.001','mesh':0},{'name':'c','mesh':0},"
        "{'name':'c_LOD1','mesh':0}]}",
        &log_);
    CHECK_OK(cranny_scene_check(scene, keep_finding, &findings, &why), why);
    CHECK_INT(findings.unpaired, 1);
    CHECK_MSG(strstr(findings.text, "2 instances are named") &&
                  strstr(findings.text, "--role ignored='*_LOD1*'"),
              "%s", findings.text);
    const struct cranny_role_rule rule = {"*_LOD1*", CRANNY_ROLE_IGNORED};
    CHECK_OK(cranny_scene_assign_roles(scene, &rule, 1, NULL, &why), why);
    findings = (struct findings){0};
    CHECK_OK(cranny_scene_check(scene, keep_finding, &findings, &why), why);
    CHECK_INT(findings.unpaired, 0);
    cranny_scene_destroy(&scene);
}

static void test_names(void)
{
    const char *const *names = cranny_role_names();
    int count = 0;
    while (names[count])
        count++;
    CHECK_INT(count, CRANNY_ROLE_COUNT);
    CHECK(!strcmp(names[CRANNY_ROLE_SOLID], "solid"));
    CHECK(!strcmp(names[CRANNY_ROLE_IGNORED], "ignored"));
}

int main(void)
{
    test_names();
    test_extras();
    test_wrong_words();
    test_instanced();
    test_rules();
    test_patterns();
    test_hostile_pattern();
    test_deep();
    test_import();
    test_proposals();
    test_unpaired();
    return check_end("scene_roles");
}
