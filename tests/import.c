/* Other formats: what comes out of assimp as a scene, and as a .glb. */
#include "check.h"
#include "scene_files.h"

#include "base/image.h"
#include "scene/document.h"
#include "scene/scene.h"

static struct cranny_error why;
static char *folder;
static int warnings;
static char last_warning[1024];

static const char *in_folder(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_text(const char *name, const char *text)
{
    CHECK_OK(cranny_file_write(in_folder(name), text, strlen(text), &why), why);
}

static void count_warning(void *user, enum cranny_log_level level, const char *line)
{
    (void)user;
    warnings += level == CRANNY_LOG_WARNING;
    if (level == CRANNY_LOG_WARNING)
        snprintf(last_warning, sizeof last_warning, "%s", line);
}

static struct cranny_scene *load(const char *name)
{
    const struct cranny_hooks hooks = {.log = count_warning};
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    struct cranny_scene *scene = NULL;
    params.hooks = &hooks;
    warnings = 0;
    CHECK_OK(cranny_scene_load(in_folder(name), &params, &scene, &why), why);
    return scene;
}

static void refuse(const char *name)
{
    struct cranny_scene *scene;
    const enum cranny_status status = cranny_scene_load(in_folder(name), NULL, &scene, &why);
    CHECK_MSG(status == CRANNY_INPUT && !scene && strstr(why.message, name) &&
                  !strchr(why.message, '\n'),
              "%s: %d %s", name, (int)status, why.message);
}

/* What the scene is as a .glb, loaded again, must have the same shape. */
static void check_export(const struct cranny_scene *scene)
{
    struct cranny_scene *back = NULL;
    double before[6], after[6];
    CHECK_OK(scene_write(scene, NULL, in_folder("out.glb"), NULL, &why), why);
    CHECK_OK(cranny_scene_load(in_folder("out.glb"), NULL, &back, &why), why);
    if (!back)
        return;
    CHECK_INT(cranny_scene_triangle_count(back), cranny_scene_triangle_count(scene));
    cranny_scene_bounds(scene, before);
    cranny_scene_bounds(back, after);
    CHECK(memcmp(before, after, sizeof before) == 0);
    cranny_scene_destroy(&back);
}

#define QUAD                                                                                       \
    "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"                         \
    "usemtl leaf\nf 1/1 2/2 3/3 4/4\n"

static void write_mask(const char *name)
{
    static const uint8_t rows[2][2] = {{255, 255}, {0, 0}};
    CHECK_OK(cranny_png_write(in_folder(name), 2, 2, 1, &rows[0][0], 2, &why), why);
}

static void test_obj(void)
{
    write_text("quad.obj", "mtllib quad.mtl\n" QUAD);
    write_text("quad.mtl", "newmtl leaf\nKd 1 0.5 0.25\nmap_d mask.png\n");
    write_mask("mask.png");
    struct cranny_scene *scene = load("quad.obj");
    CHECK_INT(warnings, 0);
    CHECK_INT(cranny_scene_triangle_count(scene), 2);
    const struct cranny_mesh *mesh = cranny_scene_mesh(scene, 0);
    CHECK_INT(mesh->vertex_count, 4);
    CHECK(mesh->normals == NULL);
    const struct cranny_material *material =
        cranny_scene_material(scene, mesh->triangle_materials[0]);
    CHECK_INT(material->alpha_mode, CRANNY_ALPHA_MASK);
    CHECK_NEAR(material->base_color[1], 0.5, 1e-6);
    CHECK(material->alpha_texture >= 0);
    if (material->alpha_texture >= 0) {
        const uint8_t *alpha = cranny_scene_texture(scene, 0)->alpha;
        CHECK(alpha[0] == 255 && alpha[3] == 0);
    }
    /* OBJ's v points up, glTF's down: the quad's top must meet the image's first row. */
    for (uint32_t v = 0; mesh->texcoords && v < mesh->vertex_count; v++)
        CHECK_NEAR(mesh->texcoords[v][1], 1 - mesh->positions[v][1] / 3, 1e-6);
    check_export(scene);
    cranny_scene_destroy(&scene);
}

static void test_outside(void)
{
    make_folder(in_folder("sub"));
    write_text("sub/out.obj", "mtllib ../quad.mtl\n" QUAD);
    struct cranny_scene *scene = load("sub/out.obj");
    const struct cranny_mesh *mesh = cranny_scene_mesh(scene, 0);
    CHECK_INT(cranny_scene_material(scene, mesh->triangle_materials[0])->alpha_mode,
              CRANNY_ALPHA_OPAQUE);
    cranny_scene_destroy(&scene);
    write_text("sub/in.obj", "mtllib in.mtl\n" QUAD);
    write_text("sub/in.mtl", "newmtl leaf\nd 0.5\nmap_Kd ../mask.png\n");
    scene = load("sub/in.obj");
    CHECK_INT(warnings, 1);
    CHECK_MSG(strstr(last_warning, "leaves"), "%s", last_warning);
    mesh = cranny_scene_mesh(scene, 0);
    const struct cranny_material *material =
        cranny_scene_material(scene, mesh->triangle_materials[0]);
    CHECK_INT(material->alpha_mode, CRANNY_ALPHA_BLEND);
    CHECK_NEAR(material->opacity, 0.5, 1e-6);
    cranny_scene_destroy(&scene);
    /* A path from another machine: its last step lies beside the scene. */
    write_mask("sub/mask.png");
    write_text("sub/in.mtl", "newmtl leaf\nmap_Kd C:\\\\art\\\\mask.png\n");
    scene = load("sub/in.obj");
    CHECK_MSG(warnings == 0, "%s", last_warning);
    cranny_scene_destroy(&scene);
}

#define FBX_HEAD                                                                                   \
    "; FBX 7.4.0 project file\nFBXHeaderExtension: {\n FBXHeaderVersion: 1003\n"                   \
    " FBXVersion: 7400\n}\nGlobalSettings: {\n Version: 1000\n Properties70: {\n"
#define FBX_TAIL                                                                                   \
    " }\n}\nObjects: {\n Geometry: 1001, \"Geometry::g\", \"Mesh\" {\n  Vertices: *9 {\n"          \
    "   a: 0,0,0,100,0,0,0,200,300\n  }\n  PolygonVertexIndex: *3 {\n   a: 0,1,-3\n  }\n"          \
    "  GeometryVersion: 124\n }\n Model: 2001, \"Model::m\", \"Mesh\" {\n  Version: 232\n }\n}\n"  \
    "Connections: {\n C: \"OO\",2001,0\n C: \"OO\",1001,2001\n}\n"

/* FBX in inches with z up: the y axis of the file becomes −z, all in metres. */
static void test_fbx(void)
{
    write_text("z-up.fbx",
               FBX_HEAD "  P: \"UpAxis\", \"int\", \"Integer\", \"\",2\n"
                        "  P: \"UpAxisSign\", \"int\", \"Integer\", \"\",1\n"
                        "  P: \"FrontAxis\", \"int\", \"Integer\", \"\",1\n"
                        "  P: \"FrontAxisSign\", \"int\", \"Integer\", \"\",-1\n"
                        "  P: \"CoordAxis\", \"int\", \"Integer\", \"\",0\n"
                        "  P: \"CoordAxisSign\", \"int\", \"Integer\", \"\",1\n"
                        "  P: \"UnitScaleFactor\", \"double\", \"Number\", \"\",2.54\n" FBX_TAIL);
    struct cranny_scene *scene = load("z-up.fbx");
    double bounds[6];
    cranny_scene_bounds(scene, bounds);
    CHECK_NEAR(bounds[3], 2.54, 1e-5);
    CHECK_NEAR(bounds[4], 7.62, 1e-5);
    CHECK_NEAR(bounds[2], -5.08, 1e-5);
    CHECK_NEAR(bounds[5], 0, 1e-9);
    check_export(scene);
    cranny_scene_destroy(&scene);
}

static void test_others(void)
{
    write_text("t.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float "
                        "y\nproperty float z\nelement face 1\nproperty list uchar int "
                        "vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    write_text("t.stl", "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                        "vertex 0 1 0\nendloop\nendfacet\nendsolid t\n");
    write_text("t.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    static const char *const names[] = {"t.ply", "t.stl", "t.off"};
    for (size_t i = 0; i < 3; i++) {
        struct cranny_scene *scene = load(names[i]);
        if (!scene)
            continue;
        CHECK_INT(cranny_scene_triangle_count(scene), 1);
        CHECK_INT(cranny_scene_vertex_count(scene), 3);
        check_export(scene);
        cranny_scene_destroy(&scene);
    }
}

static void test_broken(void)
{
    write_text("empty.obj", "");
    write_text("noise.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\n");
    write_text("noise.fbx", "Kaydara FBX Binary  \x01");
    write_text("text.xyz", "hello");
    refuse("empty.obj");
    refuse("noise.ply");
    refuse("noise.fbx");
    refuse("text.xyz");
    refuse("missing.obj");
    refuse("sub");
    /* Truncations of a good file: anything but a crash or a leak. */
    struct cranny_scene *scene;
    const char *text = "mtllib quad.mtl\n" QUAD;
    for (size_t cut = 1; cut < strlen(text); cut += 7) {
        CHECK_OK(cranny_file_write(in_folder("cut.obj"), text, cut, &why), why);
        const enum cranny_status status =
            cranny_scene_load(in_folder("cut.obj"), NULL, &scene, &why);
        CHECK(status == CRANNY_OK || status == CRANNY_INPUT);
        cranny_scene_destroy(&scene);
    }
}

int main(void)
{
    folder = scratch_folder();
    if (!folder)
        return 1;
    test_obj();
    test_outside();
    test_fbx();
    test_others();
    test_broken();
    remove_folder(folder);
    free(folder);
    return check_end("import");
}
