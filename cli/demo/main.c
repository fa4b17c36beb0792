/* cranny-demo: bake a scene and show it, before and after, on a page of its own. */
#include "files.h"
#include "page.h"
#include "view.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define PICTURE_WIDTH 1280
#define PICTURE_HEIGHT 800
#define RAYS_TO_SHOW 64 /* at least: pictures of rooms show noise that a game level hides */

static const char help[] =
    "usage: cranny-demo SCENE -o FOLDER [--rays N] [--quiet]\n"
    "\n"
    "Bakes SCENE (.glb, .gltf, .obj ...) and writes into FOLDER, which is made if need be:\n"
    "  index.html                  the page: pictures before and after, a frame by each "
    "screen-space\n"
    "                              method beside the truth, what was done, how long it took\n"
    "  before-N.png, after-N.png   from the file's first three cameras, or from views of it\n"
    "  frame-*.png                 the truth, each method, its errors, a lit picture\n"
    "  SCENE-ao.glb                the baked scene\n"
    "\n"
    "  --rays N   rays per sample of the bake (default: as cranny bake, but at least 64) and per\n"
    "             pixel of the frame's truth (default: 128)\n"
    "  --quiet    no progress on stderr\n"
    "\n"
    "example: cranny-level -o level.glb && cranny-demo level.glb -o demo\n";

struct options {
    const char *scene, *folder, *rays;
    bool quiet, help;
};

struct demo {
    const struct options *options;
    struct cranny_scene *scene;
    struct cranny_bake *bake;
    struct page page;
    struct cranny_camera views[VIEW_LIMIT];
    char *stem, *output_name; /* owned */
    const char *stage;        /* of the last progress line */
    int percent;
};

static void say(const struct demo *demo, const char *what)
{
    if (!demo->options->quiet)
        fprintf(stderr, "%s\n", what);
}

/* One line per quarter of a stage: readable in a log as well as in a terminal. */
static bool progress(void *user, const char *stage, double done, double total)
{
    struct demo *demo = user;
    int percent = total > 0 ? (int)(100 * done / total) / 25 * 25 : 0;
    bool again = demo->stage && strcmp(demo->stage, stage) == 0 && demo->percent == percent;
    if (!again && !demo->options->quiet && percent > 0)
        fprintf(stderr, "%s %d %%\n", stage, percent);
    demo->stage = stage;
    demo->percent = percent;
    return true;
}

static void log_line(void *user, enum cranny_log_level level, const char *line)
{
    const struct demo *demo = user;
    if (level == CRANNY_LOG_WARNING && !demo->options->quiet)
        fprintf(stderr, "warning: %s\n", line);
}

static enum cranny_status name_output(struct demo *demo, struct cranny_error *why)
{
    const char *slash = strrchr(demo->options->scene, '/');
    const char *name = slash ? slash + 1 : demo->options->scene, *dot = strrchr(name, '.');
    size_t length = dot && dot > name ? (size_t)(dot - name) : strlen(name);
    demo->stem = strndup(name, length);
    demo->output_name = malloc(length + sizeof "-ao.glb");
    if (!demo->stem || !demo->output_name)
        return no_memory(why);
    snprintf(demo->output_name, length + sizeof "-ao.glb", "%s-ao.glb", demo->stem);
    demo->page.scene_path = demo->options->scene;
    demo->page.scene_name = name;
    demo->page.folder = demo->options->folder;
    demo->page.output_name = demo->output_name;
    return CRANNY_OK;
}

static enum cranny_status make_folder(const char *folder, struct cranny_error *why)
{
    struct stat info;
    if (mkdir(folder, 0777) == 0 || (stat(folder, &info) == 0 && S_ISDIR(info.st_mode)))
        return CRANNY_OK;
    snprintf(why->message, sizeof why->message, "%s: cannot be made into a folder: %s", folder,
             errno == EEXIST ? "a file of that name is there" : strerror(errno));
    return CRANNY_FAILED;
}

static bool within(const double bounds[6], const double m[12])
{
    for (int i = 0; i < 3; i++)
        if (m[4 * i + 3] < bounds[i] || m[4 * i + 3] > bounds[3 + i])
            return false;
    return true;
}

/* The view turned about the vertical: on the spot within a room, else around the scene. */
static struct cranny_camera turned(const struct cranny_camera *view, const double bounds[6],
                                   double angle)
{
    struct cranny_camera out = *view;
    const double *m = view->world_from_view, c = cos(angle), s = sin(angle);
    bool inside = within(bounds, m);
    double px = inside ? m[3] : (bounds[0] + bounds[3]) / 2;
    double pz = inside ? m[11] : (bounds[2] + bounds[5]) / 2;
    for (int k = 0; k < 4; k++) {
        double x = m[k] - (k == 3 ? px : 0), z = m[8 + k] - (k == 3 ? pz : 0);
        out.world_from_view[k] = c * x + s * z + (k == 3 ? px : 0);
        out.world_from_view[8 + k] = c * z - s * x + (k == 3 ? pz : 0);
    }
    return out;
}

/* The last view round a building gives way to one from within it. */
static enum cranny_status go_inside(struct demo *demo, const struct cranny_hooks *hooks,
                                    struct cranny_error *why)
{
    struct cranny_camera camera;
    bool found;
    const int last = demo->page.view_count - 1;
    enum cranny_status status = view_within(demo->scene, hooks, &camera, &found, why);
    if (status == CRANNY_OK && found) {
        demo->views[last] = camera;
        demo->page.view_names[last] = "From within";
    }
    return status;
}

static enum cranny_status choose_views(struct demo *demo, const struct cranny_hooks *hooks,
                                       struct cranny_error *why)
{
    static const char *const around[VIEW_LIMIT] = {"From the front", "A third of the way round",
                                                   "Two thirds of the way round"};
    uint32_t count = cranny_scene_camera_count(demo->scene);
    count = count < VIEW_LIMIT ? count : VIEW_LIMIT;
    for (uint32_t i = 0; i < count; i++) {
        demo->views[i] = *cranny_scene_camera(demo->scene, i);
        demo->page.view_names[i] =
            demo->views[i].name[0] ? demo->views[i].name : "A camera of the file";
    }
    demo->page.view_count = (int)count;
    struct cranny_camera view;
    double bounds[6];
    if (count >= 2)
        return CRANNY_OK;
    enum cranny_status status = cranny_preview_default_view(
        demo->scene, (float)PICTURE_WIDTH / PICTURE_HEIGHT, NULL, &view, why);
    cranny_scene_bounds(demo->scene, bounds);
    for (uint32_t i = count; status == CRANNY_OK && i < VIEW_LIMIT; i++) {
        demo->views[i] = turned(&view, bounds, 2.0943951023931953 * (i - count));
        demo->page.view_names[i] = around[i - count];
        demo->page.view_count = (int)i + 1;
    }
    return status == CRANNY_OK ? go_inside(demo, hooks, why) : status;
}

static enum cranny_status load(struct demo *demo, const struct cranny_hooks *hooks,
                               struct cranny_error *why)
{
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    params.hooks = hooks;
    params.colors = true;
    double begin = clock_s();
    enum cranny_status status = cranny_scene_load(demo->options->scene, &params, &demo->scene, why);
    demo->page.seconds_load = clock_s() - begin;
    if (status == CRANNY_OK)
        cranny_scene_get_info(demo->scene, &demo->page.info);
    return status;
}

static enum cranny_status bake(struct demo *demo, const struct cranny_hooks *hooks,
                               struct cranny_error *why)
{
    demo->page.params = cranny_bake_params_default();
    if (demo->page.params.rays < RAYS_TO_SHOW)
        demo->page.params.rays = RAYS_TO_SHOW;
    demo->page.params.hooks = hooks;
    enum cranny_status status = CRANNY_OK;
    if (demo->options->rays)
        status = cranny_params_set(cranny_bake_param_table(), &demo->page.params, "rays",
                                   demo->options->rays, why);
    if (status == CRANNY_OK)
        status = cranny_bake_create(demo->scene, &demo->page.params, &demo->bake, why);
    if (status == CRANNY_OK)
        cranny_bake_get_report(demo->bake, &demo->page.report);
    return status;
}

static enum cranny_status save(struct demo *demo, const struct cranny_hooks *hooks,
                               struct cranny_error *why)
{
    struct cranny_save_params params = cranny_save_params_default();
    params.hooks = hooks;
    double begin = clock_s();
    char *path = path_in(demo->options->folder, demo->output_name);
    enum cranny_status status =
        path ? cranny_scene_save(demo->scene, demo->bake, path, &params, why) : no_memory(why);
    free(path);
    demo->page.seconds_write = clock_s() - begin;
    return status;
}

static enum cranny_status picture(struct demo *demo, int number, bool after, uint8_t *rgb,
                                  struct cranny_error *why)
{
    char name[32];
    snprintf(name, sizeof name, "%s-%d.png", after ? "after" : "before", number);
    char *path = path_in(demo->options->folder, name);
    enum cranny_status status =
        path ? cranny_preview_render_view(demo->scene, after ? demo->bake : NULL,
                                          &demo->views[number - 1], PICTURE_WIDTH, PICTURE_HEIGHT,
                                          NULL, rgb, why)
             : no_memory(why);
    if (status == CRANNY_OK)
        status =
            cranny_png_write(path, PICTURE_WIDTH, PICTURE_HEIGHT, 3, rgb, PICTURE_WIDTH * 3, why);
    free(path);
    return status;
}

static enum cranny_status pictures(struct demo *demo, const struct cranny_hooks *hooks,
                                   struct cranny_error *why)
{
    uint8_t *rgb = malloc((size_t)PICTURE_WIDTH * PICTURE_HEIGHT * 3);
    enum cranny_status status = rgb ? choose_views(demo, hooks, why) : no_memory(why);
    for (int i = 1; status == CRANNY_OK && i <= demo->page.view_count; i++) {
        say(demo, "pictures");
        status = picture(demo, i, false, rgb, why);
        if (status == CRANNY_OK)
            status = picture(demo, i, true, rgb, why);
    }
    free(rgb);
    return status;
}

/* The bake's values have been written and shown: their memory is of more use here. */
static enum cranny_status frame(struct demo *demo, const struct cranny_hooks *hooks,
                                struct cranny_error *why)
{
    const struct frame_job job = {
        .scene = demo->scene,
        .views = demo->views,
        .view_count = demo->page.view_count,
        .folder = demo->options->folder,
        .rays = demo->options->rays ? demo->page.params.rays : FRAME_RAYS,
        .hooks = hooks,
    };
    say(demo, "frame");
    cranny_bake_destroy(&demo->bake);
    double begin = clock_s();
    enum cranny_status status = frame_make(&job, &demo->page.frame, why);
    demo->page.seconds_frame = clock_s() - begin;
    return status;
}

static enum cranny_status write_page(struct demo *demo, struct cranny_error *why)
{
    demo->page.width = PICTURE_WIDTH;
    demo->page.height = PICTURE_HEIGHT;
    char *path = path_in(demo->options->folder, "index.html");
    enum cranny_status status = path ? page_write(&demo->page, path, why) : no_memory(why);
    if (status == CRANNY_OK && !demo->options->quiet)
        fprintf(stderr, "%s\n", path);
    free(path);
    return status;
}

static enum cranny_status show(struct demo *demo, struct cranny_error *why)
{
    const struct cranny_hooks hooks = {demo, log_line, progress};
    double begin = clock_s();
    enum cranny_status status = name_output(demo, why);
    if (status == CRANNY_OK)
        status = load(demo, &hooks, why);
    if (status == CRANNY_OK)
        status = make_folder(demo->options->folder, why);
    if (status == CRANNY_OK)
        status = bake(demo, &hooks, why);
    if (status == CRANNY_OK)
        status = save(demo, &hooks, why);
    demo->page.seconds_total = clock_s() - begin;
    if (status == CRANNY_OK)
        status = pictures(demo, &hooks, why);
    if (status == CRANNY_OK)
        status = frame(demo, &hooks, why);
    if (status == CRANNY_OK)
        status = write_page(demo, why);
    return status;
}

static bool wrong(const char *what, const char *value)
{
    fprintf(stderr, "cranny-demo: %s %s; see cranny-demo --help\n", what, value);
    return false;
}

static bool parse(int count, char **args, struct options *options)
{
    *options = (struct options){0};
    for (int i = 1; i < count; i++) {
        const char *arg = args[i];
        bool folder = strcmp(arg, "-o") == 0, rays = strcmp(arg, "--rays") == 0;
        if (strcmp(arg, "--help") == 0 || strcmp(arg, "-h") == 0)
            options->help = true;
        else if (strcmp(arg, "--quiet") == 0)
            options->quiet = true;
        else if ((folder || rays) && i + 1 == count)
            return wrong("a value is missing after", arg);
        else if (folder)
            options->folder = args[++i];
        else if (rays)
            options->rays = args[++i];
        else if (arg[0] == '-' || options->scene)
            return wrong("does not know", arg);
        else
            options->scene = arg;
    }
    if (!options->help && !options->scene)
        return wrong("a scene is missing:", "cranny-demo SCENE -o FOLDER");
    if (!options->help && !options->folder)
        return wrong("a folder is missing:", "-o FOLDER");
    return true;
}

int main(int count, char **args)
{
    struct options options;
    if (!parse(count, args, &options))
        return 2;
    if (options.help) {
        fputs(help, stdout);
        return 0;
    }
    struct demo demo = {.options = &options};
    struct cranny_error why = {0};
    enum cranny_status status = show(&demo, &why);
    if (status != CRANNY_OK)
        fprintf(stderr, "cranny-demo: %s\n", why.message);
    cranny_bake_destroy(&demo.bake);
    cranny_scene_destroy(&demo.scene);
    free(demo.stem);
    free(demo.output_name);
    return cranny_exit_status(status);
}
