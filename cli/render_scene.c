/* From a scene to a G-buffer: which camera, and what is drawn around the picture. */
#include "render.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static const char *const msaa_names[] = {"1", "2", "4", "8", NULL};
static const char *const normals_names[] = {"face", "smooth", NULL};

static const struct option scene_rows[] = {
    {.name = "size",
     .type = OPTION_SIZE,
     .offset = offsetof(struct scene_options, size),
     .value = "WxH",
     .minimum = 1,
     .maximum = CRANNY_SIDE_MAX,
     .help = "of the picture in pixels (default 1280x720)"},
    {.name = "camera",
     .type = OPTION_TEXT,
     .offset = offsetof(struct scene_options, camera),
     .value = "N|NAME",
     .help = "which of the file's cameras, by name or from 0 (default: the first, else a fitting "
             "view)"},
    {.name = "eye",
     .type = OPTION_VECTOR,
     .offset = offsetof(struct scene_options, eye),
     .value = "X,Y,Z",
     .help = "look from here, metres, instead; with --target"},
    {.name = "target",
     .type = OPTION_VECTOR,
     .offset = offsetof(struct scene_options, target),
     .value = "X,Y,Z",
     .help = "to here"},
    {.name = "up",
     .type = OPTION_VECTOR,
     .offset = offsetof(struct scene_options, up),
     .value = "X,Y,Z",
     .help = "which way is up in the picture (default 0,1,0)"},
    {.name = "msaa",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct scene_options, msaa),
     .choices = msaa_names,
     .help = "samples a pixel (default 1)"},
    {.name = "normals-from",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct scene_options, normals_from),
     .choices = normals_names,
     .help = "normals of the triangles (default), or interpolated from the vertices"},
};

const struct option_group scene_options = {"Scene", scene_rows,
                                           sizeof scene_rows / sizeof *scene_rows, NULL};

struct scene_options scene_options_default(void)
{
    return (struct scene_options){.size = {1280, 720}, .up = {0, 1, 0}};
}

enum cranny_status scene_view_check(const struct interface *face,
                                    const struct scene_options *options, struct cranny_error *why)
{
    const bool eye = option_given(face, "eye"), target = option_given(face, "target");
    if (eye != target)
        return refuse(why, CRANNY_USAGE, "--%s needs --%s, too", eye ? "eye" : "target",
                      eye ? "target" : "eye");
    if (!eye && option_given(face, "up"))
        return refuse(why, CRANNY_USAGE, "--up goes with --eye and --target");
    if (eye && options->camera)
        return refuse(why, CRANNY_USAGE, "--camera and --eye: give one of them");
    return CRANNY_OK;
}

enum cranny_status scene_options_check(const struct render *render, struct cranny_error *why)
{
    if (render->depth.depth)
        return options_refuse(render->face, &scene_options, 0, "a scene, not with --depth", why);
    const enum cranny_status status = scene_view_check(render->face, &render->view_scene, why);
    if (status != CRANNY_OK)
        return status;
    if (render->options.gbuffer && render->view_scene.msaa)
        return refuse(why, CRANNY_USAGE, "--gbuffer holds one sample a pixel: leave out --msaa");
    return CRANNY_OK;
}

static enum cranny_status find_camera(const struct scene_view *view, struct cranny_camera *camera,
                                      struct cranny_error *why)
{
    const uint32_t count = cranny_scene_camera_count(view->scene);
    const char *name = view->options->camera;
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(cranny_scene_camera(view->scene, i)->name, name) == 0) {
            *camera = *cranny_scene_camera(view->scene, i);
            return CRANNY_OK;
        }
    char *end;
    const long number = strtol(name, &end, 10);
    if (end == name || *end || number < 0 || number >= (long)count)
        return refuse(why, CRANNY_USAGE,
                      "--camera: '%.200s' is none of the %" PRIu32 " cameras of %.400s; 'cranny "
                      "info' names them",
                      name, count, view->input);
    *camera = *cranny_scene_camera(view->scene, (uint32_t)number);
    return CRANNY_OK;
}

void scene_view_set_lens(const struct view_options *lens, struct cranny_camera *camera)
{
    if (lens->fov_degrees != 0) {
        camera->orthographic = false;
        camera->fov_y = (float)(lens->fov_degrees * PI / 180);
    } else if (lens->half_height != 0) {
        camera->orthographic = true;
        camera->half_height = (float)lens->half_height;
    }
}

enum cranny_status scene_view_camera(const struct scene_view *view, struct cranny_camera *camera,
                                     struct cranny_error *why)
{
    const struct scene_options *options = view->options;
    const double degrees = view->lens->fov_degrees;
    const float aspect = (float)options->size[0] / (float)options->size[1];
    enum cranny_status status = CRANNY_OK;
    if (option_given(view->face, "eye"))
        status =
            cranny_camera_look_at(options->eye, options->target, options->up,
                                  (float)((degrees != 0 ? degrees : 60) * PI / 180), camera, why);
    else if (options->camera)
        status = find_camera(view, camera, why);
    else if (cranny_scene_camera_count(view->scene))
        *camera = *cranny_scene_camera(view->scene, 0);
    else
        status = cranny_camera_default(view->scene, view->tracer, aspect, camera, why);
    scene_view_set_lens(view->lens, camera);
    return status;
}

/* A tenth of the height, as far as it fits: half of what a method may reach, and nearly all of
 * what it does. */
int scene_view_guard(const int size[2], int given)
{
    if (given >= 0)
        return given;
    const int longer = size[0] > size[1] ? size[0] : size[1];
    const int room = (CRANNY_SIDE_MAX - longer) / 2, wanted = size[1] / 10;
    return wanted < room ? wanted : room;
}

static int guard_of(const struct render *render)
{
    const int given = render->view.guard;
    if (given < 0 && !render->method->kind->reads_guard)
        return 0;
    return scene_view_guard(render->view_scene.size, given);
}

static enum cranny_status draw(struct render *render, int threads, struct cranny_error *why)
{
    struct cranny_frame_params params = cranny_frame_params_default();
    struct cranny_camera camera;
    params.width = render->view_scene.size[0];
    params.height = render->view_scene.size[1];
    params.guard_band = guard_of(render);
    params.samples = 1 << render->view_scene.msaa;
    params.normals = render->view_scene.normals_from;
    params.threads = threads;
    params.hooks = &render->ui.hooks;
    const double begin_s = clock_s();
    const struct scene_view view = {render->scene,       render->tracer, render->face,
                                    &render->view_scene, &render->view,  render->input};
    enum cranny_status status = scene_view_camera(&view, &camera, why);
    if (status == CRANNY_OK)
        status = cranny_frame_create(render->scene, render->tracer, &camera, &params,
                                     &render->frame, why);
    if (status == CRANNY_OK)
        render->gbuffer = cranny_frame_gbuffer(render->frame);
    render->frame_s = clock_s() - begin_s;
    return status;
}

enum cranny_status render_draw(struct render *render, struct cranny_error *why)
{
    struct cranny_tracer_params params = cranny_tracer_params_default();
    params.threads = *render->fields.threads;
    params.hooks = &render->ui.hooks;
    render->load.colors = render->options.lit;
    const double begin_s = clock_s();
    enum cranny_status status =
        load_scene(&render->ui, render->input, &render->load, &render->scene, why);
    const double loaded_s = clock_s();
    render->load_s = loaded_s - begin_s;
    if (status != CRANNY_OK)
        return status;
    struct cranny_error own = {0};
    status = cranny_tracer_create(render->scene, &params, &render->tracer, &own);
    render->bvh_s = clock_s() - loaded_s;
    if (status == CRANNY_INPUT)
        return refuse(why, status, "%.200s: %.800s", render->input, own.message);
    if (status == CRANNY_OK)
        return draw(render, params.threads, why);
    *why = own;
    return status;
}
