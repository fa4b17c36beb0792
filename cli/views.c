#include "views.h"

#include "shell.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static const struct option views_rows[] = {
    {.name = "view",
     .type = OPTION_LIST,
     .offset = offsetof(struct views_options, views),
     .value = "[NAME=]EYE:TARGET[:FOV]|CAMERA",
     .help = "look from EYE to TARGET (metres; FOV in degrees, default 60), or through a camera of "
             "the file, by name or from 0; may come again. It is for the scene before it; before "
             "the first scene, for all (default: the file's cameras, else a fitting view)"},
    {.name = "views",
     .type = OPTION_INT,
     .offset = offsetof(struct views_options, count),
     .value = "N",
     .minimum = 1,
     .maximum = 99,
     .help = "N views all around each scene instead"},
    {.name = "radius",
     .type = OPTION_LIST,
     .offset = offsetof(struct views_options, radii),
     .value = "R",
     .help = "where an occluder stops counting, metres (default 0.5); for the scene before it, or "
             "for all, as --view"},
};

/* `target` is set by each command. */
const struct option_group views_options = {"Views", views_rows,
                                           sizeof views_rows / sizeof *views_rows, NULL};

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

enum cranny_status views_check(const struct views_task *task, struct cranny_error *why)
{
    const struct views_options *options = task->options;
    const bool one = task->scene_options->camera || option_given(task->face, "eye");
    const char *single = task->scene_options->camera ? "camera" : "eye";
    if (one && options->views.count)
        return refuse(why, CRANNY_USAGE, "--%s and --view: give one of them", single);
    if (options->count && (one || options->views.count))
        return refuse(why, CRANNY_USAGE, "--%s and --views: give one of them",
                      one ? single : "view");
    enum cranny_status status = scene_view_check(task->face, task->scene_options, why);
    if (status == CRANNY_OK)
        status = view_options_check(task->lens, why);
    return status == CRANNY_OK ? check_radii(&options->radii, why) : status;
}

static const char *input_of(const struct views_task *task)
{
    return task->face->operands[task->number];
}

/* A scene whose views are looked for, and who takes them. */
struct hunt {
    const struct views_task *task;
    views_take *take;
    void *user;
};

/* Of the scene, or of all: the list's items after it and those before the first scene. */
static bool applies(const struct option_list *list, size_t item, size_t input)
{
    return list->items[item].operands == 0 || list->items[item].operands == input + 1;
}

static double radius_of(const struct views_task *task)
{
    const struct option_list *radii = &task->options->radii;
    double radius = (double)cranny_raytrace_params_default().radius_world;
    for (size_t i = 0; i < radii->count; i++)
        if (applies(radii, i, task->number))
            radius = strtod(radii->items[i].text, NULL);
    return radius;
}

bool views_grow(void **views, size_t count, size_t *room, size_t size)
{
    if (count == *room && count < VIEW_LIMIT) {
        const size_t wanted = 2 * *room + 4;
        void *more = realloc(*views, wanted * size);
        *views = more ? more : *views;
        *room = more ? wanted : *room;
    }
    return count < *room && count < VIEW_LIMIT;
}

void sight_free(struct sight *sight)
{
    free(sight->camera);
    free(sight->options);
    *sight = (struct sight){0};
}

static enum cranny_status add(const struct hunt *hunt, char *camera, char *options,
                              const struct cranny_camera *eye, struct cranny_error *why)
{
    const struct views_task *task = hunt->task;
    struct sight sight = {camera, options, *eye, radius_of(task),
                          scene_view_guard(task->scene_options->size, task->lens->guard)};
    if (!camera || !options) {
        sight_free(&sight);
        return refuse(why, CRANNY_MEMORY, "out of memory for views");
    }
    scene_view_set_lens(task->lens, &sight.eye);
    return hunt->take(hunt->user, sight, why);
}

static char *camera_name(const struct cranny_camera *camera, uint32_t number)
{
    return camera->name[0] ? strdup(camera->name) : text_of_format("camera %u", number);
}

static enum cranny_status add_camera(const struct hunt *hunt, uint32_t number,
                                     struct cranny_error *why)
{
    const struct cranny_camera *camera = cranny_scene_camera(hunt->task->scene, number);
    return add(hunt, camera_name(camera, number), text_of_format(" --camera %u", number), camera,
               why);
}

static enum cranny_status add_spot(const struct hunt *hunt, const struct spot *s, char *name,
                                   struct cranny_error *why)
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
    const bool own_lens = hunt->task->lens->fov_degrees != 0 || hunt->task->lens->half_height != 0;
    char *lens = own_lens ? strdup("") : text_of_format(" --fov %.9g", s->fov_degrees);
    char *options =
        text_of_format(" --eye %.9g,%.9g,%.9g --target %.9g,%.9g,%.9g%s", s->eye[0], s->eye[1],
                       s->eye[2], s->target[0], s->target[1], s->target[2], lens ? lens : "");
    free(lens);
    return add(hunt, name, options, &camera, why);
}

/* --view: a place and a target, with a name or without, else a camera's name or number. */
static enum cranny_status add_given(const struct hunt *hunt, const char *text,
                                    struct cranny_error *why)
{
    const char *equals = strchr(text, '=');
    struct spot spot;
    if (equals && read_spot(equals + 1, &spot))
        return add_spot(hunt, &spot, strndup(text, (size_t)(equals - text)), why);
    if (read_spot(text, &spot))
        return add_spot(hunt, &spot, strdup(text), why);
    const uint32_t count = cranny_scene_camera_count(hunt->task->scene);
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(cranny_scene_camera(hunt->task->scene, i)->name, text) == 0)
            return add_camera(hunt, i, why);
    char *end;
    const long number = strtol(text, &end, 10);
    if (end != text && !*end && number >= 0 && number < (long)count)
        return add_camera(hunt, (uint32_t)number, why);
    return refuse(
        why, CRANNY_USAGE,
        "--view: '%.200s' is neither EYE:TARGET[:FOV], as in nave=10,2,0:0,3,0:60, nor one of "
        "the %u cameras of %.400s",
        text, count, input_of(hunt->task));
}

static enum cranny_status default_view(const struct views_task *task, struct cranny_camera *camera,
                                       struct cranny_error *why)
{
    const struct scene_view view = {task->scene,         task->tracer, task->face,
                                    task->scene_options, task->lens,   input_of(task)};
    return scene_view_camera(&view, camera, why);
}

/* Enough digits to look the same, few enough to read. */
static double rounded(double value)
{
    char text[32];
    snprintf(text, sizeof text, "%.9g", value);
    return strtod(text, NULL);
}

/* A camera's place and target turned by a share of a whole turn: around the scene when it is seen
 * from outside, else around the eye. */
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
static enum cranny_status add_fitting(const struct hunt *hunt, struct cranny_error *why)
{
    const int count = hunt->task->options->count;
    const int *size = hunt->task->scene_options->size;
    double bounds[6];
    struct cranny_camera camera;
    cranny_scene_bounds(hunt->task->scene, bounds);
    enum cranny_status status = cranny_camera_default(
        hunt->task->scene, hunt->task->tracer, (float)size[0] / (float)size[1], &camera, why);
    for (int i = 0; i < count && status == CRANNY_OK; i++) {
        const struct spot spot = turned(bounds, &camera, (double)i / count);
        status = add_spot(hunt, &spot, text_of_format("view %d of %d", i + 1, count), why);
    }
    return status;
}

/* What --eye and --camera say, which are options of `render`, too. */
static enum cranny_status add_single(const struct hunt *hunt, struct cranny_error *why)
{
    const struct scene_options *o = hunt->task->scene_options;
    struct cranny_camera camera;
    const enum cranny_status status = default_view(hunt->task, &camera, why);
    if (status != CRANNY_OK)
        return status;
    char *options = NULL, *name = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&options, &size);
    if (out && o->camera) {
        fputs(" --camera ", out);
        shell_word(out, o->camera);
        name = strdup(o->camera);
    } else if (out && option_given(hunt->task->face, "eye")) {
        name = text_of_format("%g,%g,%g to %g,%g,%g", o->eye[0], o->eye[1], o->eye[2], o->target[0],
                              o->target[1], o->target[2]);
        fprintf(out, " --eye %.9g,%.9g,%.9g --target %.9g,%.9g,%.9g", o->eye[0], o->eye[1],
                o->eye[2], o->target[0], o->target[1], o->target[2]);
        if (option_given(hunt->task->face, "up"))
            fprintf(out, " --up %.9g,%.9g,%.9g", o->up[0], o->up[1], o->up[2]);
    } else
        name = strdup("fitting view");
    if (out)
        fclose(out);
    return add(hunt, name, options, &camera, why);
}

static enum cranny_status add_listed(const struct hunt *hunt, size_t *added,
                                     struct cranny_error *why)
{
    const struct option_list *views = &hunt->task->options->views;
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; i < views->count && status == CRANNY_OK; i++)
        if (applies(views, i, hunt->task->number)) {
            status = add_given(hunt, views->items[i].text, why);
            ++*added;
        }
    return status;
}

enum cranny_status views_find(const struct views_task *task, views_take *take, void *user,
                              struct cranny_error *why)
{
    const struct hunt own = {task, take, user}, *hunt = &own;
    const uint32_t cameras = cranny_scene_camera_count(task->scene);
    size_t added = 0;
    enum cranny_status status = add_listed(hunt, &added, why);
    if (status != CRANNY_OK || added)
        return status;
    if (task->options->count)
        return add_fitting(hunt, why);
    if (!cameras || task->scene_options->camera || option_given(task->face, "eye"))
        return add_single(hunt, why);
    for (uint32_t i = 0; i < cameras && status == CRANNY_OK; i++)
        status = add_camera(hunt, i, why);
    return status;
}

enum cranny_status views_turn(const struct views_task *task, const struct sight *sight,
                              double share, struct sight *out, struct cranny_error *why)
{
    static const double up[3] = {0, 1, 0};
    double bounds[6];
    struct cranny_camera camera;
    cranny_scene_bounds(task->scene, bounds);
    const struct spot spot = turned(bounds, &sight->eye, share);
    const enum cranny_status status =
        cranny_camera_look_at(spot.eye, spot.target, up, 1, &camera, why);
    if (status != CRANNY_OK)
        return status;
    *out = *sight;
    memcpy(out->eye.world_from_view, camera.world_from_view, sizeof camera.world_from_view);
    out->camera = text_of_format("%s, turned by %.0f degrees", sight->camera, 360 * share);
    out->options = strdup("");
    if (out->camera && out->options)
        return CRANNY_OK;
    sight_free(out);
    return refuse(why, CRANNY_MEMORY, "out of memory for views");
}

enum cranny_status views_load(struct ui *ui, const char *path, const struct load_options *options,
                              int threads, struct cranny_scene **scene,
                              struct cranny_tracer **tracer, struct cranny_error *why)
{
    struct cranny_tracer_params params = cranny_tracer_params_default();
    struct cranny_error own = {0};
    params.threads = threads;
    params.hooks = &ui->hooks;
    enum cranny_status status = load_scene(ui, path, options, scene, why);
    if (status != CRANNY_OK)
        return status;
    if (cranny_scene_triangle_count(*scene) == 0)
        return refuse(why, CRANNY_INPUT, "%.800s: has no triangles to look at", path);
    status = cranny_tracer_create(*scene, &params, tracer, &own);
    if (status == CRANNY_INPUT)
        return refuse(why, status, "%.200s: %.800s", path, own.message);
    if (status != CRANNY_OK)
        *why = own;
    return status;
}

enum cranny_status views_draw(const struct views_task *task, const struct sight *sight, int threads,
                              const struct cranny_hooks *hooks, struct cranny_frame **frame,
                              struct cranny_error *why)
{
    struct cranny_frame_params params = cranny_frame_params_default();
    params.width = task->scene_options->size[0];
    params.height = task->scene_options->size[1];
    params.guard_band = sight->guard;
    params.samples = 1 << task->scene_options->msaa;
    params.normals = task->scene_options->normals_from;
    params.threads = threads;
    params.hooks = hooks;
    return cranny_frame_create(task->scene, task->tracer, &sight->eye, &params, frame, why);
}

const char *views_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash && slash[1] ? slash + 1 : path;
}
