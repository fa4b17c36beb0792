/* Frames of small scenes, for the tests of the frame layer. */
#ifndef TESTS_FRAME_SCENES_H
#define TESTS_FRAME_SCENES_H

#include "trace_scenes.h"

#include <cranny/frame.h>

/* A scene with everything that a frame of it needs. */
struct stage {
    struct cranny_scene *scene;
    struct cranny_tracer *tracer;
    struct cranny_camera camera;
};

static inline struct cranny_camera look(const double eye[3], const double target[3], float fov_y)
{
    struct cranny_error why;
    struct cranny_camera camera = {.name = ""};
    const double up[3] = {0, 1, 0};
    CHECK_OK(cranny_camera_look_at(eye, target, up, fov_y, &camera, &why), why);
    return camera;
}

/* From above, the picture's top towards −z; parallel. */
static inline struct cranny_camera look_down(double x, double y, double z, float half_height)
{
    return (struct cranny_camera){.name = "",
                                  .orthographic = true,
                                  .half_height = half_height,
                                  .near_plane = 0.01f,
                                  .world_from_view = {1, 0, 0, x, 0, 0, 1, y, 0, -1, 0, z}};
}

static inline struct cranny_frame_params frame_size(int width, int height)
{
    struct cranny_frame_params params = cranny_frame_params_default();
    params.width = width;
    params.height = height;
    return params;
}

static inline struct cranny_frame *draw(const struct stage *stage,
                                        const struct cranny_frame_params *params)
{
    struct cranny_error why;
    struct cranny_frame *frame;
    CHECK_OK(cranny_frame_create(stage->scene, stage->tracer, &stage->camera, params, &frame, &why),
             why);
    return frame;
}

static inline void leave(struct stage *stage)
{
    cranny_tracer_destroy(&stage->tracer);
    cranny_scene_destroy(&stage->scene);
}

/* A room of 4 × 3 × 4 m with a ball in it. */
static inline struct stage room(void)
{
    struct stage stage = {.scene = new_scene()};
    add_instance(stage.scene,
                 box_mesh(stage.scene, (float[3]){-2, 0, -2}, (float[3]){2, 3, 2}, true), identity);
    add_instance(stage.scene, sphere_mesh(stage.scene, (double[3]){0.5, 0.6, -0.5}, 0.6, 24),
                 identity);
    stage.tracer = new_tracer(stage.scene);
    stage.camera = look((double[3]){-1.5, 1.6, 1.8}, (double[3]){0.5, 0.5, -0.5}, 1.2f);
    return stage;
}

static inline bool stop_at_once(void *user, const char *stage, double done, double total)
{
    CHECK_MSG(strcmp(stage, (const char *)user) == 0, "stage is %s", stage);
    CHECK(done >= 0 && done <= total);
    return false;
}

#endif
