/* The views that parameters are fitted to: drawn and traced scene by scene, then kept without it.
 */
#include "tune.h"

#include "paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where the only view of a scene is turned to, to have one that judges: the first of these that
 * shows enough. */
static const double turns[] = {1.0 / 3, 2.0 / 3, 0.5};
#define ENOUGH_SHOWN 0.05

struct views_task tune_task(const struct tune *tune, size_t input)
{
    return (struct views_task){.face = tune->face,
                               .options = &tune->looks,
                               .scene_options = &tune->view_scene,
                               .lens = &tune->lens,
                               .scene = tune->scene,
                               .tracer = tune->tracer,
                               .number = input};
}

static void free_view(struct tune_view *view)
{
    sight_free(&view->sight);
    free((void *)(uintptr_t)view->gbuffer.depth);
    free((void *)(uintptr_t)view->gbuffer.normal);
    cranny_truth_free(&view->truth);
}

static enum cranny_status add_view(struct tune *tune, size_t scene, struct sight sight,
                                   struct cranny_error *why)
{
    if (!views_grow((void **)&tune->views, tune->view_count, &tune->view_room,
                    sizeof *tune->views)) {
        sight_free(&sight);
        return refuse(why, CRANNY_MEMORY, "more views than fit");
    }
    tune->views[tune->view_count++] = (struct tune_view){.scene = scene, .sight = sight};
    return CRANNY_OK;
}

/* Whose views are being found. */
struct finder {
    struct tune *tune;
    size_t scene;
};

static enum cranny_status take_sight(void *user, struct sight sight, struct cranny_error *why)
{
    const struct finder *finder = user;
    return add_view(finder->tune, finder->scene, sight, why);
}

/* A frame's planes one after the other, tight, and all that a method may read. */
static void *copy_planes(const void *from, size_t row_bytes, size_t stride, size_t plane_stride,
                         int rows, int planes)
{
    const size_t height = (size_t)rows;
    char *copy = calloc((size_t)planes * height, row_bytes);
    stride = stride ? stride : row_bytes;
    plane_stride = plane_stride ? plane_stride : stride * height;
    for (size_t p = 0; copy && p < (size_t)planes; p++)
        for (size_t y = 0; y < height; y++)
            memcpy(copy + (p * height + y) * row_bytes,
                   (const char *)from + p * plane_stride + y * stride, row_bytes);
    return copy;
}

static enum cranny_status keep_frame(struct tune_view *view, const struct cranny_gbuffer *g,
                                     struct cranny_error *why)
{
    const int planes = g->sample_count > 1 ? g->sample_count : 1;
    const size_t width = (size_t)g->width;
    view->gbuffer = *g;
    view->gbuffer.depth = copy_planes(g->depth, width * sizeof *g->depth, g->depth_stride,
                                      g->depth_sample_stride, g->height, planes);
    view->gbuffer.normal =
        copy_planes(g->normal, width * cranny_normal_bytes(g->normal_format), g->normal_stride,
                    g->normal_sample_stride, g->height, planes);
    view->gbuffer.depth_stride = view->gbuffer.normal_stride = 0;
    view->gbuffer.depth_sample_stride = view->gbuffer.normal_sample_stride = 0;
    memcpy(view->world_from_view, g->world_from_view, sizeof view->world_from_view);
    view->gbuffer.world_from_view = NULL; /* set where it is drawn: views move as there are more */
    if (view->gbuffer.depth && view->gbuffer.normal)
        return CRANNY_OK;
    return refuse(why, CRANNY_MEMORY, "views of %d x %d pixels do not all fit in memory", g->width,
                  g->height);
}

static enum cranny_status get_truth(struct tune *tune, struct tune_view *view,
                                    const struct cranny_frame *frame, struct cranny_error *why)
{
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    const char *cache = tune->options.cache;
    enum cranny_status status = CRANNY_OK;
    params.radius_world = (float)view->sight.radius_world;
    params.rays = tune->options.rays;
    params.threads = *tune->fields.threads;
    params.hooks = &tune->ui.hooks;
    if (cache) {
        bool made;
        status = path_make_folder(cache, "--cache", &made, why);
        tune->made_cache |= made;
    }
    if (status == CRANNY_OK)
        status = cranny_truth_get(tune->scene, frame, &params, cache, &view->truth, why);
    if (status == CRANNY_OK && cache && !view->truth.kept)
        tune->ui.written = cache;
    return status;
}

/* The share of the picture that shows something. */
static double shown(const struct cranny_gbuffer *g)
{
    size_t count = 0;
    const size_t pixels = (size_t)g->width * (size_t)g->height;
    for (size_t i = 0; i < pixels; i++)
        count += g->depth[i] < (float)INFINITY;
    return (double)count / (double)pixels;
}

/* Draw and trace; `least`: leave it at drawing when less is shown. */
static enum cranny_status see(struct tune *tune, struct tune_view *view, double least,
                              struct cranny_error *why)
{
    const struct views_task task = tune_task(tune, view->scene);
    struct cranny_frame *frame = NULL;
    enum cranny_status status =
        views_draw(&task, &view->sight, *tune->fields.threads, &tune->ui.hooks, &frame, why);
    if (status == CRANNY_OK) {
        const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
        status = keep_frame(view, &g, why);
        if (status == CRANNY_OK && shown(&view->gbuffer) >= least) {
            warn_about_radius(&tune->ui, tune->inputs[view->scene], &g, view->sight.radius_world,
                              tune->method->kind->needs_scene);
            status = get_truth(tune, view, frame, why);
        }
    }
    cranny_frame_destroy(&frame);
    return status;
}

static void hold_out(struct tune *tune)
{
    const size_t first = tune->scene_first;
    for (size_t v = first; v < tune->view_count; v++)
        tune->views[v].held_out = tune->options.hold == TUNE_HOLD_ALTERNATE ? (v - first) % 2 == 1
                                  : tune->options.hold == TUNE_HOLD_REST    ? v > first
                                                                            : false;
}

/* The scene's only view turned, so that there is one to judge by. */
static enum cranny_status add_turned(struct tune *tune, size_t scene, struct cranny_error *why)
{
    for (size_t i = 0; i < sizeof turns / sizeof *turns; i++) {
        const struct views_task task = tune_task(tune, scene);
        struct sight sight;
        enum cranny_status status =
            views_turn(&task, &tune->views[tune->scene_first].sight, turns[i], &sight, why);
        if (status == CRANNY_USAGE)
            continue; /* a look straight up or down has no horizon to turn about */
        if (status == CRANNY_OK)
            status = add_view(tune, scene, sight, why);
        if (status != CRANNY_OK)
            return status;
        struct tune_view *view = &tune->views[tune->view_count - 1];
        ui_head(&tune->ui, "%.40s, %.40s: ", views_name(tune->inputs[scene]), view->sight.camera);
        status = see(tune, view, ENOUGH_SHOWN, why);
        if (status != CRANNY_OK || view->truth.visibility)
            return status;
        free_view(&tune->views[--tune->view_count]);
    }
    ui_warn(&tune->ui,
            "%s: has one view, and turned it shows nothing: none judges; give more with --view",
            tune->inputs[scene]);
    return CRANNY_OK;
}

static enum cranny_status see_views(struct tune *tune, size_t scene, struct cranny_error *why)
{
    const size_t first = tune->scene_first, count = tune->view_count - first;
    enum cranny_status status = CRANNY_OK;
    for (size_t v = first; v < first + count && status == CRANNY_OK; v++) {
        ui_head(&tune->ui, "%.40s, view %zu of %zu: ", views_name(tune->inputs[scene]),
                v - first + 1, count);
        status = see(tune, &tune->views[v], 0, why);
    }
    if (status == CRANNY_OK && count == 1 && tune->options.hold != TUNE_HOLD_NONE)
        status = add_turned(tune, scene, why);
    hold_out(tune);
    return status;
}

/* What stands still is made while the scene is there. */
static enum cranny_status prepare(struct tune *tune, size_t scene, struct cranny_error *why)
{
    const struct method_input input = {.scene = tune->scene};
    *tune->fields.hooks = &tune->ui.hooks;
    return method_prepare(tune->method, &input, &tune->params, &tune->states[scene], why);
}

static enum cranny_status open_scene(struct tune *tune, size_t scene, struct cranny_error *why)
{
    const char *path = tune->inputs[scene];
    struct cranny_error own;
    tune->scene_first = tune->view_count;
    ui_head(&tune->ui, "%.40s (%zu of %zu): ", views_name(path), scene + 1,
            tune->face->operand_count);
    enum cranny_status status = views_load(&tune->ui, path, &tune->load, *tune->fields.threads,
                                           &tune->scene, &tune->tracer, why);
    if (status == CRANNY_OK) {
        const struct views_task task = tune_task(tune, scene);
        struct finder finder = {tune, scene};
        status = views_find(&task, take_sight, &finder, why);
    }
    if (status == CRANNY_OK)
        status = prepare(tune, scene, why);
    if (status == CRANNY_OK) {
        status = see_views(tune, scene, &own);
        if (status == CRANNY_INPUT)
            refuse(why, status, "%.200s: %.800s", path, own.message);
        else if (status != CRANNY_OK)
            *why = own;
    }
    cranny_tracer_destroy(&tune->tracer);
    cranny_scene_destroy(&tune->scene);
    return status;
}

enum cranny_status tune_open_views(struct tune *tune, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; i < tune->face->operand_count && status == CRANNY_OK; i++)
        status = open_scene(tune, i, why);
    ui_head(&tune->ui, "%s", "");
    return status;
}

void tune_close_views(struct tune *tune)
{
    for (size_t v = 0; v < tune->view_count; v++)
        free_view(&tune->views[v]);
    for (size_t i = 0; i < SCENE_LIMIT; i++)
        method_state_free(&tune->states[i]);
    free(tune->views);
}
