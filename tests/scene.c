/* Scenes from arrays, the doctor, and the reader on every file there is, whole and broken. */
#define _XOPEN_SOURCE 700
#include "check.h"

#include "scene/scene.h"

#include <cranny/scene.h>
#include <ftw.h>
#include <sys/resource.h>

static struct cranny_error why;

static const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const uint32_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

static struct cranny_mesh tetrahedron(void)
{
    return (struct cranny_mesh){.name = "tetrahedron",
                                .vertex_count = 4,
                                .triangle_count = 4,
                                .positions = corners,
                                .triangles = faces};
}

static struct cranny_instance placed(uint32_t mesh, double scale, double x)
{
    return (struct cranny_instance){
        .name = "there",
        .mesh = mesh,
        .world_from_object = {scale, 0, 0, x, 0, scale, 0, 0, 0, 0, scale, 0}};
}

static void test_builder(void)
{
    struct cranny_scene *scene;
    struct cranny_mesh mesh = tetrahedron();
    uint32_t index = 99;
    double bounds[6];
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    CHECK_OK(cranny_scene_add_mesh(scene, &mesh, &index, &why), why);
    CHECK_INT(index, 0);
    CHECK_INT(cranny_scene_material_count(scene), 1);
    struct cranny_instance instance = placed(0, 2, 10);
    CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
    CHECK_OK(cranny_scene_add_instance(scene, &instance, &index, &why), why);
    CHECK_INT(index, 1);
    CHECK_INT(cranny_scene_triangle_count(scene), 8);
    CHECK_INT(cranny_scene_vertex_count(scene), 8);
    cranny_scene_bounds(scene, bounds);
    CHECK_NEAR(bounds[0], 10, 0);
    CHECK_NEAR(bounds[3], 12, 0);
    CHECK_NEAR(bounds[5], 2, 0);
    cranny_scene_destroy(&scene);
    CHECK(scene == NULL);
    cranny_scene_destroy(&scene);
    cranny_scene_destroy(NULL);
}

static void test_builder_refuses(void)
{
    struct cranny_scene *scene;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    const uint32_t outside[1][3] = {{0, 1, 4}};
    struct cranny_mesh mesh = tetrahedron();
    mesh.triangles = outside;
    mesh.triangle_count = 1;
    CHECK_INT(cranny_scene_add_mesh(scene, &mesh, NULL, &why), CRANNY_USAGE);
    const float broken[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}, {0, 0, 1}};
    mesh = tetrahedron();
    mesh.positions = broken;
    CHECK_INT(cranny_scene_add_mesh(scene, &mesh, NULL, &why), CRANNY_USAGE);
    const struct cranny_instance nowhere = placed(0, 1, 0);
    CHECK_INT(cranny_scene_add_instance(scene, &nowhere, NULL, &why), CRANNY_USAGE);
    struct cranny_material material = cranny_material_default();
    material.alpha_texture = 3;
    CHECK_INT(cranny_scene_add_material(scene, &material, NULL, &why), CRANNY_USAGE);
    CHECK_INT(cranny_scene_mesh_count(scene), 0);
    cranny_scene_destroy(&scene);
}

struct heard {
    char codes[1024], texts[8192];
    int worst, sorted, last;
};

static void hear(void *user, enum cranny_severity severity, const char *code, const char *text)
{
    struct heard *heard = user;
    heard->sorted &= (int)severity >= heard->last;
    heard->last = (int)severity;
    heard->worst = (int)severity < heard->worst ? (int)severity : heard->worst;
    strncat(heard->codes, code, sizeof heard->codes - strlen(heard->codes) - 2);
    strcat(heard->codes, " ");
    strncat(heard->texts, text, sizeof heard->texts - strlen(heard->texts) - 2);
    CHECK(*text && !strchr(text, '\n'));
}

static struct heard examine(const struct cranny_scene *scene)
{
    struct heard heard = {.worst = 9, .sorted = 1, .last = 0};
    CHECK_OK(cranny_scene_check(scene, hear, &heard, &why), why);
    CHECK_MSG(heard.sorted, "'%s' is not worst first", heard.codes);
    return heard;
}

/* What the doctor says of one mesh, scaled. */
static struct heard examine_mesh(const struct cranny_mesh *mesh, double scale)
{
    struct cranny_scene *scene;
    const struct cranny_instance instance = placed(0, scale, 0);
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    CHECK_OK(cranny_scene_add_mesh(scene, mesh, NULL, &why), why);
    CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
    const struct heard heard = examine(scene);
    cranny_scene_destroy(&scene);
    return heard;
}

#define CHECK_HEARD(heard, code) CHECK_MSG(strstr((heard).codes, code), "said '%s'", (heard).codes)
#define CHECK_UNHEARD(heard, code)                                                                 \
    CHECK_MSG(!strstr((heard).codes, code), "said '%s'", (heard).codes)

static void test_scale_doctor(void)
{
    struct cranny_mesh mesh = tetrahedron();
    struct heard heard = examine_mesh(&mesh, 10);
    CHECK_UNHEARD(heard, "scale");
    CHECK_UNHEARD(heard, "inverted");
    heard = examine_mesh(&mesh, 1e-4);
    CHECK_HEARD(heard, "scale-small");
    CHECK_INT(heard.worst, CRANNY_SEVERITY_ERROR);
    CHECK(strstr(heard.texts, "--set distance_long=0.001 --set distance_short=6.9e-06") != NULL);
    heard = examine_mesh(&mesh, 10000);
    CHECK_HEARD(heard, "scale-large");
    CHECK(strstr(heard.texts, "--set distance_long=30000 --set distance_short=200") != NULL);
    heard = examine_mesh(&mesh, 100000);
    CHECK(strstr(heard.texts, "millimetres") != NULL);
    CHECK(strstr(heard.texts, "--set distance_long=300000 --set distance_short=2000") != NULL);
}

static void test_face_doctor(void)
{
    const uint32_t inside_out[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    const uint32_t one_turned[4][3] = {{0, 1, 2}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const uint32_t repeated[4][3] = {{0, 2, 1}, {2, 1, 0}, {0, 1, 2}, {0, 0, 1}};
    const uint32_t flat[4][3] = {{0, 0, 1}, {1, 1, 1}, {0, 2, 2}, {3, 3, 0}};
    struct cranny_mesh mesh = tetrahedron();
    struct cranny_scene *scene;
    mesh.triangles = inside_out;
    CHECK_HEARD(examine_mesh(&mesh, 10), "inverted-mesh");
    mesh.triangles = one_turned;
    struct heard heard = examine_mesh(&mesh, 10);
    CHECK_HEARD(heard, "inconsistent-winding");
    CHECK_UNHEARD(heard, "inverted-mesh");
    CHECK(strstr(heard.texts, "at 3 edges") != NULL);
    mesh.triangles = repeated;
    heard = examine_mesh(&mesh, 10);
    CHECK_HEARD(heard, "duplicate-faces");
    CHECK_HEARD(heard, "degenerate-triangles");
    CHECK_HEARD(heard, "unused-vertices");
    CHECK(strstr(heard.texts, "1 triangles repeat another one, and at 1 places") != NULL);
    mesh.triangles = flat;
    heard = examine_mesh(&mesh, 10);
    CHECK_HEARD(heard, "no-area");
    CHECK_INT(heard.worst, CRANNY_SEVERITY_ERROR);
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    CHECK_HEARD(examine(scene), "empty-scene");
    cranny_scene_destroy(&scene);
}

/* Broken files must be refused in one line, by name, whatever is wrong with them. */
static void check_refusal(enum cranny_status status, const char *path)
{
    CHECK_MSG(status == CRANNY_INPUT || status == CRANNY_MEMORY, "%s: status %s, '%s'", path,
              cranny_status_name(status), why.message);
    CHECK_MSG(*why.message && !strchr(why.message, '\n'), "%s: '%s'", path, why.message);
}

static struct cranny_scene_load_params small_limit(void)
{
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    params.memory_limit_bytes = 256u << 20;
    return params;
}

static int sweep_loaded, sweep_refused;

static int sweep_file(const char *path, const struct stat *info, int type, struct FTW *walk)
{
    const char *dot = strrchr(path, '.');
    const struct cranny_scene_load_params params = small_limit();
    struct cranny_scene *scene;
    (void)info, (void)walk;
    if (type != FTW_F || !dot || (strcmp(dot, ".gltf") && strcmp(dot, ".glb")))
        return 0;
    memset(&why, 0, sizeof why);
    enum cranny_status status = cranny_scene_load(path, &params, &scene, &why);
    if (status == CRANNY_OK) {
        double bounds[6];
        struct heard heard = {.worst = 9, .sorted = 1, .last = 0};
        cranny_scene_bounds(scene, bounds);
        for (int k = 0; k < 6; k++)
            CHECK_MSG(isfinite(bounds[k]), "%s: bound %d is %g", path, k, bounds[k]);
        CHECK_OK(cranny_scene_check(scene, hear, &heard, &why), why);
        sweep_loaded++;
    } else {
        CHECK(scene == NULL);
        check_refusal(status, path);
        sweep_refused++;
    }
    cranny_scene_destroy(&scene);
    return 0;
}

/* Counts by the scenes' own README. `unique`: each mesh once. */
static void test_table(const char *folder)
{
    static const struct {
        const char *file;
        uint64_t unique, world;
        uint32_t instances;
    } table[] = {
        {"crytek_sponza/crytek_sponza.glb", 262267, 262267, 393},
        {"stanford_dragon/stanford_dragon_res2.glb", 202520, 202520, 1},
        {"stanford_dragon/stanford_dragon_res3.glb", 47794, 47794, 1},
        {"stanford_dragon/stanford_dragon_res4.glb", 11102, 11102, 1},
        {"stanford_bunny/stanford_bunny.glb", 69451, 69451, 1},
        {"contemporary_bathroom/contemporary_bathroom.glb", 380280, 380280, 851},
        {"level_pandora/pandora.glb", 60810, 60810, 1},
        {"house_lightmap_uv/house.glb", 10497, 10497, 2},
        {"cornell_box_bevy/CornellBox.glb", 36, 36, 4},
        {"cornell_box_original/cornell_box_original.glb", 32, 32, 8},
        {"godot_room/room.glb", 63720, 63720, 17},
        {"webxr_garage/garage.gltf", 11358, 11358, 1},
        {"webxr_camp/camp.gltf", 6285, 6285, 1},
        {"tree_alpha/scene.gltf", 778, 778, 2},
        {"japanese_bridge_garden_meshopt/scene.glb", 21883, 21883, 1},
        {"chess_board_draco/chess-board.glb", 178848, 178848, 8},
        {"instancing_teapots/teapots_galore.gltf", 4034, 7656770, 1900},
        {"instancing_simple/simple-instancing.glb", 12, 1500, 125},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char path[1024];
        struct cranny_scene *scene;
        struct cranny_scene_info info = {0};
        snprintf(path, sizeof path, "%s/%s", folder, table[i].file);
        const enum cranny_status status = cranny_scene_load(path, NULL, &scene, &why);
        if (status != CRANNY_OK && check_left_out(why.message))
            continue;
        CHECK_OK(status, why);
        if (!scene)
            continue;
        cranny_scene_get_info(scene, &info);
        CHECK_MSG(info.unique_triangles == table[i].unique && info.triangles == table[i].world &&
                      info.instances == table[i].instances,
                  "%s: %llu, %llu triangles, %llu instances", table[i].file,
                  (unsigned long long)info.unique_triangles, (unsigned long long)info.triangles,
                  (unsigned long long)info.instances);
        CHECK_MSG(!strcmp(info.format, strrchr(path, '.') + 1), "%s: format %s", path, info.format);
        if (strstr(path, "sponza")) {
            CHECK_INT(info.masked_triangles, 34940);
            CHECK_INT(info.textures, 3);
        }
        cranny_scene_destroy(&scene);
    }
}

static uint8_t *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return NULL;
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    uint8_t *data = malloc(*size + 1);
    *size = fread(data, 1, *size, file);
    fclose(file);
    return data;
}

static void load_bytes(const uint8_t *data, size_t size, const char *name)
{
    const struct cranny_scene_load_params params = small_limit();
    struct cranny_scene *scene;
    uint8_t *exact = malloc(size ? size : 1); /* so that a sanitizer sees reads past the end */
    memcpy(exact, data, size);
    memset(&why, 0, sizeof why);
    enum cranny_status status = cranny_scene_load_memory(exact, size, name, &params, &scene, &why);
    if (status != CRANNY_OK)
        check_refusal(status, name);
    cranny_scene_destroy(&scene);
    free(exact);
}

/* xorshift; seeded, so that a failure can be had again. */
static uint32_t next_random(uint32_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

static void break_file(const char *path)
{
    size_t size;
    uint8_t *data = read_file(path, &size);
    CHECK_MSG(data != NULL, "%s", path);
    if (!data)
        return;
    for (size_t i = 0; i < 40; i++)
        load_bytes(data, size * i / 40, path);
    for (size_t i = 0; i < 64 && i < size; i++)
        load_bytes(data, i, path);
    uint32_t state = 12345;
    const size_t json = size < 4096 ? size : 4096;
    for (int round = 0; round < 150; round++) {
        uint8_t saved[8];
        size_t places[8];
        const size_t range = round % 2 ? size : json; /* the JSON comes first, and breaks more */
        for (int k = 0; k < 8; k++) {
            places[k] = next_random(&state) % range;
            saved[k] = data[places[k]];
            data[places[k]] ^= (uint8_t)(1u << next_random(&state) % 8);
        }
        load_bytes(data, size, path);
        for (int k = 7; k >= 0; k--)
            data[places[k]] = saved[k];
    }
    free(data);
}

static void test_broken(const char *folder)
{
    static const char *const files[] = {
        "cornell_box_bevy/CornellBox.glb",
        "cornell_box_original/cornell_box_original.glb",
        "instancing_simple/simple-instancing.glb",
        "variants_camp/draco.glb",
        "variants_camp/meshopt.glb",
        "variants_camp/sparse.glb",
        "variants_camp/skinned_bind_pose.glb",
        "variants_camp/data_uri.gltf",
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", folder, files[i]);
        break_file(path);
    }
}

int main(void)
{
    test_builder();
    test_builder_refuses();
    test_scale_doctor();
    test_face_doctor();
    const char *folder = check_scenes();
    if (!folder) {
        const int bad = check_end("scene");
        return bad ? bad : check_skip("scene files", "no real scenes");
    }
    nftw(folder, sweep_file, 16, FTW_PHYS);
    printf("%d files load, %d are refused\n", sweep_loaded, sweep_refused);
    CHECK(sweep_loaded > 400 && sweep_refused > 30);
    test_table(folder);
    test_broken(folder);
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    CHECK_MSG(usage.ru_maxrss < 3l << 20, "%ld kB at the peak", usage.ru_maxrss);
    return check_end("scene");
}
