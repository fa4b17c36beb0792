/* Fuzzes the glTF reader: whatever the bytes are, loading ends with a status and a message, a
 * loaded scene can be walked to its last element, and all is freed.
 *
 * Run:    fuzz/run.sh 60                 (seconds; preset fuzz, a temporary corpus from gltf/seeds)
 * Replay: build/tests/fuzz_gltf_replay FILE|FOLDER...      (any compiler, no engine)
 * A crash goes to gltf/seeds, as small as it gets, and stays there. */
#include "../replay.h"

#include <cranny/scene.h>

#define MEMORY_LIMIT_BYTES (256u << 20)

static void log_ignore(void *user, enum cranny_log_level level, const char *line)
{
    (void)level;
    *(size_t *)user += strlen(line);
}

static double mesh_sum(const struct cranny_scene *scene, const struct cranny_mesh *mesh)
{
    double sum = 0;
    uint32_t material_count = cranny_scene_material_count(scene);
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        for (int i = 0; i < 3; i++)
            sum += mesh->positions[v][i] + (mesh->normals ? mesh->normals[v][i] : 0) +
                   (mesh->texcoords && i < 2 ? mesh->texcoords[v][i] : 0);
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        for (int i = 0; i < 3; i++)
            demand(mesh->triangles[t][i] < mesh->vertex_count, "an index is below vertex_count");
        demand(mesh->triangle_materials[t] < material_count, "a material is one of the scene's");
    }
    return sum + (double)strlen(mesh->name);
}

static double material_sum(const struct cranny_scene *scene, uint32_t index)
{
    const struct cranny_material *material = cranny_scene_material(scene, index);
    int texture = material->alpha_texture;
    demand(texture >= -1 && texture < (int)cranny_scene_texture_count(scene),
           "an alpha texture is one of the scene's");
    return material->opacity + (double)strlen(material->name);
}

static double texture_sum(const struct cranny_alpha_texture *texture)
{
    double sum = 0;
    for (size_t i = 0; i < (size_t)texture->width * texture->height; i++)
        sum += texture->alpha[i];
    return sum;
}

static double scene_sum(const struct cranny_scene *scene)
{
    double sum = 0, bounds[6];
    for (uint32_t i = 0; i < cranny_scene_mesh_count(scene); i++)
        sum += mesh_sum(scene, cranny_scene_mesh(scene, i));
    for (uint32_t i = 0; i < cranny_scene_material_count(scene); i++)
        sum += material_sum(scene, i);
    for (uint32_t i = 0; i < cranny_scene_texture_count(scene); i++)
        sum += texture_sum(cranny_scene_texture(scene, i));
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const struct cranny_instance *instance = cranny_scene_instance(scene, i);
        demand(instance->mesh < cranny_scene_mesh_count(scene), "an instance's mesh exists");
        demand(instance->role < CRANNY_ROLE_COUNT, "a role exists");
        demand(!instance->lod || instance->lod_group, "a coarser level has a group");
        sum += instance->world_from_object[3] + (double)strlen(instance->name);
    }
    for (uint32_t i = 0; i < cranny_scene_camera_count(scene); i++)
        sum += cranny_scene_camera(scene, i)->near_plane;
    cranny_scene_bounds(scene, bounds);
    struct cranny_scene_info info;
    cranny_scene_get_info(scene, &info);
    return sum + bounds[5] + (double)info.triangles;
}

static void count_finding(void *user, enum cranny_severity severity, const char *code,
                          const char *text)
{
    (void)severity;
    demand(*code && *text && !strchr(text, '\n'), "a finding is one line");
    *(size_t *)user += strlen(text);
}

/* What names and the doctor make of it. */
static void judge(struct cranny_scene *scene, size_t *logged)
{
    const struct cranny_role_rule rules[] = {{"*a*b?c*", CRANNY_ROLE_TREE},
                                             {"*_LOD?", CRANNY_ROLE_SHRUB}};
    struct cranny_error why = {.message = ""};
    demand(cranny_scene_assign_roles(scene, rules, 2, NULL, &why) == CRANNY_OK, "roles are given");
    demand(cranny_scene_check(scene, count_finding, logged, &why) == CRANNY_OK, "it is checked");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    size_t logged = 0;
    const struct cranny_hooks hooks = {.user = &logged, .log = log_ignore};
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    params.memory_limit_bytes = MEMORY_LIMIT_BYTES;
    params.hooks = &hooks;
    struct cranny_scene *scene = NULL;
    struct cranny_error why = {.message = ""};
    enum cranny_status status =
        cranny_scene_load_memory(data, size, "fuzz.gltf", &params, &scene, &why);
    demand((status == CRANNY_OK) == (scene != NULL), "a scene comes with CRANNY_OK only");
    if (status == CRANNY_OK) {
        volatile double sum = scene_sum(scene);
        (void)sum;
        judge(scene, &logged);
    } else {
        demand(status == CRANNY_INPUT || status == CRANNY_MEMORY, "bytes are to blame");
        demand(why.status == status && *why.message && !strchr(why.message, '\n'),
               "the message is one line");
    }
    cranny_scene_destroy(&scene);
    demand(scene == NULL, "destroying clears the pointer");
    return 0;
}
