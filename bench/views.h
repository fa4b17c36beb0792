/* Views of real scenes that the benches of frames share: what is looked at, and the radius that
 * fits it. */
#ifndef BENCH_VIEWS_H
#define BENCH_VIEWS_H

#include <cranny/cranny.h>

struct view {
    const char *scene, *name, *file; /* file: below CRANNY_SCENES */
    double eye[3], target[3];        /* both zero: the file's camera */
    float fov_y;                     /* degrees */
    float radius_world;              /* metres */
};

/* Views of one scene stand together. */
extern const struct view views[];
extern const int view_count;

/* The view's camera in its loaded scene. */
enum cranny_status view_camera(const struct view *view, const struct cranny_scene *scene,
                               struct cranny_camera *camera, struct cranny_error *why);

/* The scene's file in CRANNY_SCENES, malloced; NULL when that is not set or lacks the file. */
char *view_path(const struct view *view);

/* One scene at a time, kept while successive views share it. */
struct view_stage {
    const char *loaded;
    struct cranny_scene *scene;
    struct cranny_tracer *tracer;
};

/* The view's scene and tracer on the stage; CRANNY_INPUT when there is no such file. */
enum cranny_status view_enter(struct view_stage *stage, const struct view *view,
                              struct cranny_error *why);
void view_leave(struct view_stage *stage);

/* A view's frame and its truth, at one size. */
struct view_sight {
    int width, height;
    struct cranny_frame *frame;
    struct cranny_gbuffer gbuffer;
    float *truth; /* width × height */
};

/* Draw the view with a guard band of a tenth of the height, and trace `rays` a pixel; with `cache`
 * (a folder, or NULL) the truth is read from there, or left there. */
enum cranny_status view_see(struct view_stage *stage, const struct view *view, int width,
                            int height, int rays, const char *cache, struct view_sight *sight,
                            struct cranny_error *why);
void view_sight_free(struct view_sight *sight);

#endif
