#include "views.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SPONZA "sponza", .file = "crytek_sponza/crytek_sponza.glb", .radius_world = 1
#define DRAGON "dragon", .file = "stanford_dragon/stanford_dragon_res2.glb", .radius_world = 0.03f
#define BATHROOM                                                                                   \
    "bathroom", .file = "contemporary_bathroom/contemporary_bathroom.glb", .radius_world = 0.4f
#define PANDORA "pandora", .file = "level_pandora/pandora.glb", .radius_world = 1.5f
#define ROOM "room", .file = "godot_room/room.glb", .radius_world = 0.5f
#define GARDEN "garden", .file = "japanese_bridge_garden_meshopt/scene.glb", .radius_world = 0.6f

const struct view views[] = {
    {SPONZA, .name = "nave", .eye = {10, 2, 0}, .target = {0, 3, 0}, .fov_y = 60},
    {SPONZA, .name = "aisle", .eye = {-12, 2, 4.5}, .target = {4, 2.5, 4.8}, .fov_y = 60},
    {SPONZA, .name = "gallery", .eye = {-9, 7, -3}, .target = {8, 5.5, 3.5}, .fov_y = 70},
    {DRAGON, .name = "front", .eye = {0.05, 0.18, 0.36}, .target = {0, 0.12, 0}, .fov_y = 32},
    {DRAGON, .name = "top", .eye = {-0.12, 0.4, 0.12}, .target = {0, 0.12, 0}, .fov_y = 35},
    {DRAGON, .name = "head", .eye = {-0.2, 0.19, 0.08}, .target = {-0.06, 0.15, 0}, .fov_y = 35},
    {BATHROOM, .name = "camera"},
    {BATHROOM, .name = "basin", .eye = {1.2, 1.5, -1}, .target = {-1.5, 0.7, -2}, .fov_y = 60},
    {BATHROOM, .name = "tub", .eye = {-1.8, 1.6, -0.6}, .target = {1.5, 0.6, -2}, .fov_y = 60},
    {PANDORA, .name = "hall", .eye = {20, 9, 0}, .target = {-10, 9, 2}, .fov_y = 70},
    {PANDORA, .name = "down", .eye = {-20, 14, 8}, .target = {10, 4, -4}, .fov_y = 70},
    {PANDORA, .name = "side", .eye = {0, 8, 15}, .target = {-6, 6, -15}, .fov_y = 70},
    {ROOM, .name = "corner", .eye = {3.5, 2.6, 3.5}, .target = {-2, 0.8, -2}, .fov_y = 65},
    {ROOM, .name = "across", .eye = {-3.8, 1.4, 2}, .target = {3, 1.2, -2}, .fov_y = 65},
    {ROOM, .name = "above", .eye = {0.5, 4.4, 3}, .target = {-0.5, 0, -1}, .fov_y = 65},
    {GARDEN, .name = "bridge", .eye = {8, 5, 7}, .target = {0, 2.2, 0}, .fov_y = 45},
    {GARDEN, .name = "low", .eye = {-5.5, 2.6, 5}, .target = {0.5, 2.2, -0.5}, .fov_y = 55},
    {GARDEN, .name = "over", .eye = {-3, 10, -4}, .target = {0, 1.8, 0}, .fov_y = 50},
};
const int view_count = sizeof views / sizeof *views;

static enum cranny_status refuse(struct cranny_error *why, const char *text, const char *name)
{
    why->status = CRANNY_INPUT;
    snprintf(why->message, sizeof why->message, "%s: %s", name, text);
    return CRANNY_INPUT;
}

enum cranny_status view_camera(const struct view *view, const struct cranny_scene *scene,
                               struct cranny_camera *camera, struct cranny_error *why)
{
    static const double up[3] = {0, 1, 0};
    if (view->fov_y > 0)
        return cranny_camera_look_at(view->eye, view->target, up, view->fov_y * 0.01745329f, camera,
                                     why);
    if (cranny_scene_camera_count(scene) == 0)
        return refuse(why, "has no camera", view->file);
    *camera = *cranny_scene_camera(scene, 0);
    return CRANNY_OK;
}

char *view_path(const struct view *view)
{
    const char *folder = getenv("CRANNY_SCENES");
    if (!folder || !*folder)
        return NULL;
    const size_t size = strlen(folder) + strlen(view->file) + 2;
    char *path = malloc(size);
    if (path)
        snprintf(path, size, "%s/%s", folder, view->file);
    if (path && access(path, R_OK) != 0) {
        free(path);
        path = NULL;
    }
    return path;
}

void view_leave(struct view_stage *stage)
{
    cranny_tracer_destroy(&stage->tracer);
    cranny_scene_destroy(&stage->scene);
    stage->loaded = NULL;
}

enum cranny_status view_enter(struct view_stage *stage, const struct view *view,
                              struct cranny_error *why)
{
    if (stage->loaded && strcmp(stage->loaded, view->file) == 0)
        return CRANNY_OK;
    view_leave(stage);
    char *path = view_path(view);
    if (!path)
        return refuse(why, "not in CRANNY_SCENES", view->file);
    enum cranny_status status = cranny_scene_load(path, NULL, &stage->scene, why);
    if (status == CRANNY_OK)
        status = cranny_tracer_create(stage->scene, NULL, &stage->tracer, why);
    if (status == CRANNY_OK)
        stage->loaded = view->file;
    free(path);
    return status;
}

static bool read_truth(const char *path, const struct view_sight *sight)
{
    struct cranny_image image;
    struct cranny_error why;
    if (cranny_image_read(path, CRANNY_IMAGE_VALUE, &image, &why) != CRANNY_OK)
        return false;
    const bool fits = image.width == sight->width && image.height == sight->height;
    if (fits)
        memcpy(sight->truth, image.pixels,
               (size_t)sight->width * (size_t)sight->height * sizeof *sight->truth);
    cranny_image_free(&image);
    return fits;
}

static enum cranny_status get_truth(const struct view *view, int rays, const char *cache,
                                    const struct view_sight *sight, struct cranny_error *why)
{
    char path[1024] = "";
    if (cache)
        snprintf(path, sizeof path, "%s/%s-%s-%dx%d-%g-%d.pfm", cache, view->scene, view->name,
                 sight->width, sight->height, (double)view->radius_world, rays);
    if (cache && read_truth(path, sight))
        return CRANNY_OK;
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    params.radius_world = view->radius_world;
    params.rays = rays;
    enum cranny_status status =
        cranny_frame_raytrace(sight->frame, &params, sight->truth, 0, NULL, NULL, why);
    if (status == CRANNY_OK && cache)
        status = cranny_image_write(path, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_AUTO, sight->width,
                                    sight->height, 1, sight->truth, 0, why);
    return status;
}

void view_sight_free(struct view_sight *sight)
{
    cranny_frame_destroy(&sight->frame);
    free(sight->truth);
    *sight = (struct view_sight){0};
}

enum cranny_status view_see(struct view_stage *stage, const struct view *view, int width,
                            int height, int rays, const char *cache, struct view_sight *sight,
                            struct cranny_error *why)
{
    struct cranny_camera camera;
    struct cranny_frame_params params = cranny_frame_params_default();
    params.width = width;
    params.height = height;
    params.guard_band = height / 10;
    *sight = (struct view_sight){.width = width, .height = height};
    sight->truth = malloc((size_t)width * (size_t)height * sizeof *sight->truth);
    enum cranny_status status =
        sight->truth ? view_enter(stage, view, why) : refuse(why, "out of memory", view->name);
    if (status == CRANNY_OK)
        status = view_camera(view, stage->scene, &camera, why);
    if (status == CRANNY_OK)
        status =
            cranny_frame_create(stage->scene, stage->tracer, &camera, &params, &sight->frame, why);
    if (status == CRANNY_OK)
        status = get_truth(view, rays, cache, sight, why);
    if (status == CRANNY_OK)
        sight->gbuffer = cranny_frame_gbuffer(sight->frame);
    else
        view_sight_free(sight);
    return status;
}
