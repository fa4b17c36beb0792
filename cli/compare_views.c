/* Which views of a scene are compared, and the options of `render` that look at them. */
#include "compare.h"
#include "shell.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

struct spot {
    double eye[3], target[3], fov_degrees;
};

static bool read_triple(const char **text, double out[3])
{
    for (int i = 0; i < 3; i++) {
        char *end;
        out[i] = strtod(*text, &end);
        if (end == *text || !isfinite(out[i]) || (i < 2 && *end != ','))
            return false;
        *text = i < 2 ? end + 1 : end;
    }
    return true;
}

/* "X,Y,Z:X,Y,Z" or "X,Y,Z:X,Y,Z:DEGREES". */
static bool read_spot(const char *text, struct spot *spot)
{
    spot->fov_degrees = 60;
    if (!read_triple(&text, spot->eye) || *text++ != ':' || !read_triple(&text, spot->target))
        return false;
    if (!*text)
        return true;
    char *end;
    spot->fov_degrees = *text == ':' ? strtod(text + 1, &end) : 0;
    return spot->fov_degrees > 0 && spot->fov_degrees < 179.9 && end != text + 1 && !*end;
}

static enum cranny_status check_radii(const struct option_list *radii, struct cranny_error *why)
{
    for (size_t i = 0; i < radii->count; i++) {
        char *end;
        const double value = strtod(radii->items[i].text, &end);
        if (end == radii->items[i].text || *end || !(value > 0) || !isfinite((float)value))
            return refuse(why, CRANNY_USAGE, "--radius: '%.200s' is not a number above 0",
                          radii->items[i].text);
    }
    return CRANNY_OK;
}

enum cranny_status compare_check_views(const struct compare *compare, struct cranny_error *why)
{
    const struct compare_options *options = &compare->options;
    const bool one = compare->view_scene.camera || option_given(compare->face, "eye");
    const char *single = compare->view_scene.camera ? "camera" : "eye";
    if (one && options->views.count)
        return refuse(why, CRANNY_USAGE, "--%s and --view: give one of them", single);
    if (options->view_count && (one || options->views.count))
        return refuse(why, CRANNY_USAGE, "--%s and --views: give one of them",
                      one ? single : "view");
    enum cranny_status status = scene_view_check(compare->face, &compare->view_scene, why);
    if (status == CRANNY_OK)
        status = view_options_check(&compare->lens, why);
    return status == CRANNY_OK ? check_radii(&options->radii, why) : status;
}

/* Of the scene, or of all: the list's items after it and those before the first scene. */
static bool applies(const struct option_list *list, size_t item, size_t input)
{
    return list->items[item].operands == 0 || list->items[item].operands == input + 1;
}

static double radius_of(const struct compare *compare, size_t input)
{
    const struct option_list *radii = &compare->options.radii;
    double radius = (double)cranny_raytrace_params_default().radius_world;
    for (size_t i = 0; i < radii->count; i++)
        if (applies(radii, i, input))
            radius = strtod(radii->items[i].text, NULL);
    return radius;
}

static enum cranny_status add(struct compare *compare, size_t input, char *camera, char *options,
                              const struct cranny_camera *eye, struct cranny_error *why)
{
    if (compare->view_count == compare->view_room && compare->view_count < COMPARE_VIEW_LIMIT) {
        const size_t room = 2 * compare->view_room + 4;
        void *more = realloc(compare->views, room * sizeof *compare->views);
        compare->views = more ? more : compare->views;
        compare->view_room = more ? room : compare->view_room;
    }
    if (!camera || !options || compare->view_count == compare->view_room) {
        free(camera);
        free(options);
        return refuse(why, CRANNY_MEMORY, "more views than fit");
    }
    struct compare_view *view = &compare->views[compare->view_count++];
    *view = (struct compare_view){.scene = compare->inputs[input],
                                  .camera = camera,
                                  .options = options,
                                  .eye = *eye,
                                  .radius_world = radius_of(compare, input),
                                  .triangles = cranny_scene_triangle_count(compare->scene)};
    scene_view_set_lens(&compare->lens, &view->eye);
    view->guard = scene_view_guard(compare->view_scene.size, compare->lens.guard);
    return CRANNY_OK;
}

static char *camera_name(const struct cranny_camera *camera, uint32_t number)
{
    return camera->name[0] ? strdup(camera->name) : text_of_format("camera %u", number);
}

static enum cranny_status add_camera(struct compare *compare, size_t input, uint32_t number,
                                     struct cranny_error *why)
{
    const struct cranny_camera *camera = cranny_scene_camera(compare->scene, number);
    return add(compare, input, camera_name(camera, number), text_of_format(" --camera %u", number),
               camera, why);
}

static enum cranny_status add_spot(struct compare *compare, size_t input, const struct spot *s,
                                   char *name, struct cranny_error *why)
{
    static const double up[3] = {0, 1, 0};
    struct cranny_camera camera;
    const float fov = (float)(s->fov_degrees * PI / 180);
    const enum cranny_status status =
        cranny_camera_look_at(s->eye, s->target, up, fov, &camera, why);
    if (status != CRANNY_OK) {
        free(name);
        return status;
    }
    const bool own_lens = compare->lens.fov_degrees != 0 || compare->lens.half_height != 0;
    char *lens = own_lens ? strdup("") : text_of_format(" --fov %.9g", s->fov_degrees);
    char *options =
        text_of_format(" --eye %.9g,%.9g,%.9g --target %.9g,%.9g,%.9g%s", s->eye[0], s->eye[1],
                       s->eye[2], s->target[0], s->target[1], s->target[2], lens ? lens : "");
    free(lens);
    return add(compare, input, name, options, &camera, why);
}

/* --view: a place and a target, with a name or without, else a camera's name or number. */
static enum cranny_status add_given(struct compare *compare, size_t input, const char *text,
                                    struct cranny_error *why)
{
    const char *equals = strchr(text, '=');
    struct spot spot;
    if (equals && read_spot(equals + 1, &spot))
        return add_spot(compare, input, &spot, strndup(text, (size_t)(equals - text)), why);
    if (read_spot(text, &spot))
        return add_spot(compare, input, &spot, strdup(text), why);
    const uint32_t count = cranny_scene_camera_count(compare->scene);
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(cranny_scene_camera(compare->scene, i)->name, text) == 0)
            return add_camera(compare, input, i, why);
    char *end;
    const long number = strtol(text, &end, 10);
    if (end != text && !*end && number >= 0 && number < (long)count)
        return add_camera(compare, input, (uint32_t)number, why);
    return refuse(
        why, CRANNY_USAGE,
        "--view: '%.200s' is neither EYE:TARGET[:FOV], as in nave=10,2,0:0,3,0:60, nor one of "
        "the %u cameras of %.400s",
        text, count, compare->inputs[input]);
}

static enum cranny_status default_view(const struct compare *compare, size_t input,
                                       struct cranny_camera *camera, struct cranny_error *why)
{
    const struct scene_view view = {compare->scene,       compare->tracer, compare->face,
                                    &compare->view_scene, &compare->lens,  compare->inputs[input]};
    return scene_view_camera(&view, camera, why);
}

/* Enough digits to look the same, few enough to read. */
static double rounded(double value)
{
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    return strtod(text, NULL);
}

/* The fitting view turned by a share of a whole turn: around the scene when it is seen from
 * outside, else around the eye. */
static struct spot turned(const double bounds[6], const struct cranny_camera *camera, double share)
{
    const double *m = camera->world_from_view;
    const double s = sin(2 * PI * share), c = cos(2 * PI * share);
    double center[3], eye[3] = {m[3], m[7], m[11]}, forward[3] = {-m[2], -m[6], -m[10]};
    bool inside = true;
    struct spot spot = {.fov_degrees = rounded((double)camera->fov_y * 180 / PI)};
    for (int i = 0; i < 3; i++) {
        center[i] = (bounds[i] + bounds[3 + i]) / 2;
        inside = inside && eye[i] > bounds[i] && eye[i] < bounds[3 + i];
    }
    double size = hypot(hypot(bounds[3] - bounds[0], bounds[4] - bounds[1]), bounds[5] - bounds[2]);
    const double x = eye[0] - center[0], z = eye[2] - center[2];
    if (!inside) {
        eye[0] = center[0] + c * x + s * z;
        eye[2] = center[2] - s * x + c * z;
    }
    const double turned_forward[3] = {c * forward[0] + s * forward[2], forward[1],
                                      -s * forward[0] + c * forward[2]};
    for (int i = 0; i < 3; i++) {
        spot.eye[i] = rounded(eye[i]);
        spot.target[i] = rounded(eye[i] + size * turned_forward[i]);
    }
    return spot;
}

/* --views N: the fitting view, and N - 1 that are turned from it. */
static enum cranny_status add_fitting(struct compare *compare, size_t input,
                                      struct cranny_error *why)
{
    const int count = compare->options.view_count;
    const int *size = compare->view_scene.size;
    double bounds[6];
    struct cranny_camera camera;
    cranny_scene_bounds(compare->scene, bounds);
    enum cranny_status status = cranny_camera_default(
        compare->scene, compare->tracer, (float)size[0] / (float)size[1], &camera, why);
    for (int i = 0; i < count && status == CRANNY_OK; i++) {
        const struct spot spot = turned(bounds, &camera, (double)i / count);
        status =
            add_spot(compare, input, &spot, text_of_format("view %d of %d", i + 1, count), why);
    }
    return status;
}

/* What --eye and --camera say, which are options of `render`, too. */
static enum cranny_status add_single(struct compare *compare, size_t input,
                                     struct cranny_error *why)
{
    const struct scene_options *o = &compare->view_scene;
    struct cranny_camera camera;
    const enum cranny_status status = default_view(compare, input, &camera, why);
    if (status != CRANNY_OK)
        return status;
    char *options = NULL, *name = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&options, &size);
    if (out && o->camera) {
        fputs(" --camera ", out);
        shell_word(out, o->camera);
        name = strdup(o->camera);
    } else if (out && option_given(compare->face, "eye")) {
        name = text_of_format("%g,%g,%g to %g,%g,%g", o->eye[0], o->eye[1], o->eye[2], o->target[0],
                              o->target[1], o->target[2]);
        fprintf(out, " --eye %.9g,%.9g,%.9g --target %.9g,%.9g,%.9g", o->eye[0], o->eye[1],
                o->eye[2], o->target[0], o->target[1], o->target[2]);
        if (option_given(compare->face, "up"))
            fprintf(out, " --up %.9g,%.9g,%.9g", o->up[0], o->up[1], o->up[2]);
    } else
        name = strdup("fitting view");
    if (out)
        fclose(out);
    return add(compare, input, name, options, &camera, why);
}

static enum cranny_status add_listed(struct compare *compare, size_t input, size_t *added,
                                     struct cranny_error *why)
{
    const struct option_list *views = &compare->options.views;
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; i < views->count && status == CRANNY_OK; i++)
        if (applies(views, i, input)) {
            status = add_given(compare, input, views->items[i].text, why);
            ++*added;
        }
    return status;
}

enum cranny_status compare_add_views(struct compare *compare, size_t input,
                                     struct cranny_error *why)
{
    const uint32_t cameras = cranny_scene_camera_count(compare->scene);
    size_t added = 0;
    enum cranny_status status = add_listed(compare, input, &added, why);
    if (status != CRANNY_OK || added)
        return status;
    if (compare->options.view_count)
        return add_fitting(compare, input, why);
    if (!cameras || compare->view_scene.camera || option_given(compare->face, "eye"))
        return add_single(compare, input, why);
    for (uint32_t i = 0; i < cameras && status == CRANNY_OK; i++)
        status = add_camera(compare, input, i, why);
    return status;
}
