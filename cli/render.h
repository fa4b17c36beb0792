/* One picture's visibility, from the command line to the files. */
#ifndef CLI_RENDER_H
#define CLI_RENDER_H

#include "commands.h"
#include "depth.h"
#include "method.h"

struct render_options {
    int method; /* index of `methods` */
    const char *output, *gbuffer;
    int bits; /* −1: by the extension; 0: 8; 1: 16 */
    bool lit;
    double exposure; /* 0: from the picture's mean */
    int repeat;
};

struct scene_options {
    int size[2];
    const char *camera; /* NULL: the first one, else a fitting view */
    double eye[3], target[3], up[3];
    int msaa, normals_from; /* indices of the choices */
};

struct render {
    struct ui ui;
    struct load_options load;
    struct render_options options;
    struct scene_options view_scene;
    struct depth_options depth;
    struct view_options view;
    const struct interface *face;
    const struct method *method;
    union method_params params;
    struct method_fields fields; /* of params */
    const char *input;
    char *output;           /* owned */
    char *gbuffer_files[3]; /* depth, normal, description; owned; NULL without --gbuffer */

    struct cranny_scene *scene; /* or `image` */
    struct cranny_tracer *tracer;
    struct cranny_frame *frame;
    struct depth_frame image;
    struct cranny_gbuffer gbuffer;

    float *visibility; /* of the viewport, tight; owned */
    struct method_report report;
    double mean_visibility;
    double load_s, bvh_s, frame_s, write_s, total_s;
};

extern const struct option_group scene_options;
struct scene_options scene_options_default(void);

/* A loaded scene, and how the command line says to look at it. */
struct scene_view {
    const struct cranny_scene *scene;
    const struct cranny_tracer *tracer;
    const struct interface *face;
    const struct scene_options *options;
    const struct view_options *lens;
    const char *input;
};

/* What does not fit together among the options of a camera. */
enum cranny_status scene_view_check(const struct interface *face,
                                    const struct scene_options *options, struct cranny_error *why);

/* The camera that they give: by hand, one of the file's, or a fitting view. */
enum cranny_status scene_view_camera(const struct scene_view *view, struct cranny_camera *camera,
                                     struct cranny_error *why);

/* --fov or --ortho over what the camera has. */
void scene_view_set_lens(const struct view_options *lens, struct cranny_camera *camera);

/* Pixels to draw around a picture of `size`; `given` from the command line, or -1. */
int scene_view_guard(const int size[2], int given);

/* What does not fit together among a scene's options. */
enum cranny_status scene_options_check(const struct render *render, struct cranny_error *why);

/* Fill `gbuffer` from the scene. */
enum cranny_status render_draw(struct render *render, struct cranny_error *why);

/* Fill `gbuffer` from images. */
enum cranny_status render_read(struct render *render, struct cranny_error *why);

/* Fill `visibility` and the reports. */
enum cranny_status render_estimate(struct render *render, struct cranny_error *why);

/* --gbuffer: its names before the work, its files after it. */
enum cranny_status gbuffer_name_files(struct render *render, struct cranny_error *why);
enum cranny_status gbuffer_check_files(const struct render *render, struct cranny_error *why);
enum cranny_status gbuffer_write(const struct render *render, struct cranny_error *why);

/* A warning when the radius is of another scale than what the frame shows, and the picture so
 * white or, for a method that `sees_all` of the scene not, grey; `input` is where the frame is
 * from. */
void warn_about_radius(struct ui *ui, const char *input, const struct cranny_gbuffer *g,
                       double radius, bool sees_all);

/* The result on stdout; the exit status. */
int render_print(struct render *render);

#endif
