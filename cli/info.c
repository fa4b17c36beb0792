#include "commands.h"

#include <inttypes.h>
#include <math.h>

static json_t *roles_json(const struct cranny_scene_info *info)
{
    json_t *roles = json_object();
    for (int role = 0; role < CRANNY_ROLE_COUNT; role++)
        json_object_set_new(roles, cranny_role_names()[role],
                            json_pack("{sI sI}", "instances",
                                      (json_int_t)info->role_instances[role], "triangles",
                                      (json_int_t)info->role_triangles[role]));
    return roles;
}

static json_t *info_json(const char *path, const struct cranny_scene *scene,
                         const struct cranny_scene_info *info, const struct ui *ui)
{
    const double *b = info->bounds;
    json_t *cameras = json_array();
    for (uint32_t i = 0; i < cranny_scene_camera_count(scene); i++)
        json_array_append_new(cameras, json_text(cranny_scene_camera(scene, i)->name));
    json_t *object = json_pack(
        "{so ss so sI sI sI sI sI sI sI sI sI sI sI sI sI}", "input", json_text(path), "format",
        info->format, "generator", json_text(info->generator), "meshes", (json_int_t)info->meshes,
        "instances", (json_int_t)info->instances, "materials", (json_int_t)info->materials,
        "alpha_textures", (json_int_t)info->textures, "cameras", (json_int_t)info->cameras,
        "vertices", (json_int_t)info->vertices, "triangles", (json_int_t)info->triangles,
        "unique_vertices", (json_int_t)info->unique_vertices, "unique_triangles",
        (json_int_t)info->unique_triangles, "masked_triangles", (json_int_t)info->masked_triangles,
        "blended_triangles", (json_int_t)info->blended_triangles, "double_sided_triangles",
        (json_int_t)info->double_sided_triangles, "skipped_primitives",
        (json_int_t)info->skipped_primitives);
    json_object_set_new(object, "roles", roles_json(info));
    json_object_set_new(object, "lods",
                        json_pack("{sI sI sI sI}", "groups", (json_int_t)info->lod_groups,
                                  "instances", (json_int_t)info->lod_instances, "vertices",
                                  (json_int_t)info->lod_vertices, "triangles",
                                  (json_int_t)info->lod_triangles));
    json_object_set_new(object, "camera_names", cameras);
    json_object_set_new(
        object, "bounds",
        json_pack("{s[fff] s[fff]}", "min", b[0], b[1], b[2], "max", b[3], b[4], b[5]));
    json_object_set_new(object, "warnings", ui->warnings ? json_copy(ui->warnings) : json_array());
    return object;
}

static void print_camera(const struct cranny_camera *camera, uint32_t index)
{
    printf("  camera %-6" PRIu32 "%s%s", index, camera->name, camera->name[0] ? ", " : "");
    if (camera->orthographic)
        printf("orthographic, %.4g m high\n", 2 * (double)camera->half_height);
    else
        printf("perspective, %.3g degrees high\n", (double)camera->fov_y * 180 / 3.14159265358979);
}

/* Nothing when all there is is solid. */
static void print_roles(const struct cranny_scene_info *info)
{
    for (int role = CRANNY_ROLE_TREE; role < CRANNY_ROLE_COUNT; role++)
        if (info->role_instances[role])
            printf("  role %-8s%" PRIu64 " instances, %" PRIu64 " triangles\n",
                   cranny_role_names()[role], info->role_instances[role],
                   info->role_triangles[role]);
    if (info->lod_groups)
        printf("  levels       %" PRIu64 " things have %" PRIu64
               " instances at coarser levels of detail: %" PRIu64 " vertices, %" PRIu64
               " triangles\n",
               info->lod_groups, info->lod_instances, info->lod_vertices, info->lod_triangles);
}

static void print_info(const char *path, const struct cranny_scene *scene,
                       const struct cranny_scene_info *info)
{
    const double *b = info->bounds;
    printf("%s\n", path);
    printf("  format       %s%s%s\n", info->format, info->generator[0] ? ", by " : "",
           info->generator);
    printf("  meshes       %" PRIu64 " in %" PRIu64 " instances\n", info->meshes, info->instances);
    printf("  vertices     %" PRIu64, info->vertices);
    if (info->unique_vertices != info->vertices)
        printf(" (%" PRIu64 " stored)", info->unique_vertices);
    printf("\n  triangles    %" PRIu64, info->triangles);
    if (info->unique_triangles != info->triangles)
        printf(" (%" PRIu64 " stored)", info->unique_triangles);
    printf("\n  materials    %" PRIu64 "; triangles: %" PRIu64 " masked, %" PRIu64
           " blended, %" PRIu64 " double-sided\n",
           info->materials, info->masked_triangles, info->blended_triangles,
           info->double_sided_triangles);
    print_roles(info);
    if (info->skipped_primitives)
        printf("  skipped      %" PRIu64 " primitives of points or lines\n",
               info->skipped_primitives);
    printf("  size         %.4g x %.4g x %.4g m, from (%.4g, %.4g, %.4g) to (%.4g, %.4g, %.4g)\n",
           b[3] - b[0], b[4] - b[1], b[5] - b[2], b[0], b[1], b[2], b[3], b[4], b[5]);
    for (uint32_t i = 0; i < cranny_scene_camera_count(scene); i++)
        print_camera(cranny_scene_camera(scene, i), i);
}

int command_info(int argc, char **argv)
{
    struct ui ui = {0};
    struct load_options load = load_options_default();
    struct option_group groups[] = {load_options, ui_options};
    groups[0].target = &load;
    groups[1].target = &ui;
    const char *path = NULL;
    struct interface face = {
        .command = "info",
        .usage = "SCENE",
        .summary = "What is in a scene: counts, materials, cameras, size.",
        .examples = "  cranny info level.glb\n"
                    "  cranny info --json level.glb | jq .triangles\n",
        .groups = groups,
        .group_count = 2,
        .operands = &path,
        .operand_limit = 1,
    };
    int status = begin_command(&face, &ui, argc, argv);
    if (status >= 0)
        return status;
    struct cranny_error why;
    struct cranny_scene *scene;
    if (load_scene(&ui, path, &load, &scene, &why) != CRANNY_OK) {
        status = ui_fail(&ui, &why);
    } else {
        struct cranny_scene_info info;
        cranny_scene_get_info(scene, &info);
        ui_erase(&ui);
        if (ui.json)
            status = ui_print_json(&ui, info_json(path, scene, &info, &ui));
        else {
            print_info(path, scene, &info);
            status = ui_finish_output(&ui);
        }
        cranny_scene_destroy(&scene);
    }
    ui_end(&ui);
    return status;
}
