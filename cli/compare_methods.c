/* A view's truth, and every row of the list beside it: times, errors, pictures. */
#include "compare.h"
#include "shell.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#define MAP_SCALE 0.25f  /* as cranny diff's */
#define RUNS_SECONDS 2.0 /* no further run of a method that has taken as long */

enum { RUN_LIMIT = 1000 };

/* A frame and its truth, while its methods run. */
struct stage {
    struct compare *compare;
    struct compare_view *view;
    size_t number; /* of the view, from 1 */
    struct cranny_frame *frame;
    struct cranny_gbuffer gbuffer;
    struct cranny_truth truth;
    float *visibility;
    uint8_t *map;
};

/* Its own progress would only flicker. */
static struct cranny_hooks quiet_hooks(const struct compare *compare)
{
    return (struct cranny_hooks){compare->ui.hooks.user, compare->ui.hooks.log, ui_goes_on};
}

static struct cranny_raytrace_params truth_params(const struct stage *stage)
{
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    params.radius_world = (float)stage->view->sight.radius_world;
    params.rays = stage->compare->options.rays;
    params.threads = stage->compare->options.threads;
    return params;
}

/* What the view and the command line say, over the row's parameters. */
static union method_params params_of(const struct stage *stage, const struct compare_method *row)
{
    union method_params params = row->params;
    const struct method_fields fields = method_fields(row->method, &params);
    *fields.radius_world = (float)stage->view->sight.radius_world;
    *fields.threads = stage->compare->options.threads;
    if (fields.isa)
        *fields.isa = stage->compare->options.isa;
    return params;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median of --repeat runs; the first one, which gets the memory, does not count. */
static enum cranny_status run_often(struct stage *stage, struct compare_trial *trial,
                                    const union method_params *params, struct cranny_error *why)
{
    struct compare *compare = stage->compare;
    const struct method_input input = {compare->scene, stage->frame, stage->gbuffer};
    const int wanted = compare->options.repeat;
    double times[RUN_LIMIT + 1], spent_ms = 0;
    enum cranny_status status = CRANNY_OK;
    int count = 0;
    for (; count <= wanted && status == CRANNY_OK; count++) {
        if (count && spent_ms > 1e3 * RUNS_SECONDS)
            break;
        status = method_run(trial->method->method, &input, params, &compare->state,
                            stage->visibility, &trial->report, why);
        times[count] = trial->report.total_ms;
        spent_ms += times[count];
    }
    if (status != CRANNY_OK)
        return status;
    const int first = count > 1;
    qsort(times + first, (size_t)(count - first), sizeof *times, compare_doubles);
    trial->runs = count - first;
    trial->milliseconds = times[first + trial->runs / 2];
    return CRANNY_OK;
}

/* The row's own hooks would flicker; those of what is made once for it are worth seeing. */
static enum cranny_status run_row(struct stage *stage, struct compare_trial *trial,
                                  struct cranny_error *why)
{
    struct compare *compare = stage->compare;
    const struct method *method = trial->method->method;
    const struct method_input input = {compare->scene, stage->frame, stage->gbuffer};
    const struct cranny_hooks quiet = quiet_hooks(compare);
    union method_params params = params_of(stage, trial->method);
    const struct method_fields fields = method_fields(method, &params);
    trial->parameters = method_parameters_json(method, &params);
    *fields.hooks = &compare->ui.hooks;
    const enum cranny_status status = method_prepare(method, &input, &params, &compare->state, why);
    *fields.hooks = &quiet;
    return status == CRANNY_OK ? run_often(stage, trial, &params, why) : status;
}

/* A file's name out of any words: letters, digits and a few signs. */
static char *picture_name(const struct stage *stage, const char *what, const char *ending)
{
    const char *slash = strrchr(stage->view->scene, '/');
    const char *scene = slash ? slash + 1 : stage->view->scene;
    const char *dot = strrchr(scene, '.');
    const int stem = (int)(dot && dot != scene ? dot - scene : (long)strlen(scene));
    char *name = text_of_format("%03zu-%.*s-%s%s", stage->number, stem < 60 ? stem : 60, scene,
                                what, ending);
    for (char *c = name; c && *c; c++)
        if (!isalnum((unsigned char)*c) && !strchr("._-", *c))
            *c = '-';
    return name;
}

/* Files may be named like presets, or like other files but for signs: their number tells apart. */
static void row_words(const struct compare_method *row, char words[128])
{
    char number[16] = "";
    if (row->file)
        snprintf(number, sizeof number, "file%d-", row->file);
    snprintf(words, 128, "%s-%s%s", row->method->name, number, row->label);
}

/* `cranny render` with what makes the same picture. */
static char *command_of(const struct stage *stage, const struct compare_method *row,
                        const char *picture)
{
    const struct compare *compare = stage->compare;
    const struct scene_options *o = &compare->view_scene;
    char *command = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&command, &size);
    if (!out)
        return NULL;
    fputs("cranny render ", out);
    shell_path(out, stage->view->scene);
    if (compare->load.scene >= 0)
        fprintf(out, " --scene %d", compare->load.scene);
    fprintf(out, "%s --size %dx%d%s", compare->load.allow_outside ? " --allow-outside" : "",
            o->size[0], o->size[1], stage->view->sight.options);
    if (compare->lens.fov_degrees != 0)
        fprintf(out, " --fov %.9g", compare->lens.fov_degrees);
    if (compare->lens.half_height != 0)
        fprintf(out, " --ortho %.9g", compare->lens.half_height);
    if (compare->lens.guard >= 0)
        fprintf(out, " --guard %d", compare->lens.guard);
    if (o->msaa)
        fprintf(out, " --msaa %d", 1 << o->msaa);
    fprintf(out, "%s --method %s --radius %.9g", o->normals_from ? " --normals-from smooth" : "",
            row->method->name, stage->view->sight.radius_world);
    if (row->preset) {
        fputs(" --preset ", out);
        shell_path(out, row->preset);
    }
    if (row->setting)
        fprintf(out, " --set %s", row->setting);
    fprintf(out, " -o %s", picture);
    if (fclose(out) == 0)
        return command;
    free(command);
    return NULL;
}

static enum cranny_status write_picture(const struct stage *stage, const char *name,
                                        const float *visibility, struct cranny_error *why)
{
    char *path = compare_path(stage->compare, name);
    const enum cranny_status status =
        path ? cranny_image_write(path, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_BITS8, stage->truth.width,
                                  stage->truth.height, 1, visibility, 0, why)
             : refuse(why, CRANNY_MEMORY, "out of memory for file names");
    free(path);
    return status;
}

static enum cranny_status write_map(const struct stage *stage, const char *name,
                                    struct cranny_error *why)
{
    const int width = stage->truth.width, height = stage->truth.height;
    char *path = compare_path(stage->compare, name);
    enum cranny_status status =
        path ? cranny_difference_map(width, height, stage->visibility, 0, stage->truth.visibility,
                                     0, MAP_SCALE, stage->map, why)
             : refuse(why, CRANNY_MEMORY, "out of memory for file names");
    if (status == CRANNY_OK)
        status = cranny_png_write(path, width, height, 3, stage->map, 3 * (size_t)width, why);
    free(path);
    return status;
}

static enum cranny_status try_row(struct stage *stage, const struct compare_method *row,
                                  struct cranny_error *why)
{
    struct compare_trial *trial = &stage->view->trials[stage->view->trial_count++];
    *trial = (struct compare_trial){.method = row};
    char words[128];
    row_words(row, words);
    trial->image = picture_name(stage, words, ".png");
    trial->map = picture_name(stage, words, "-error.png");
    if (!trial->image || !trial->map)
        return refuse(why, CRANNY_MEMORY, "out of memory for file names");
    trial->command = command_of(stage, row, trial->image);
    enum cranny_status status = run_row(stage, trial, why);
    if (status == CRANNY_OK)
        status =
            cranny_difference_measure(stage->truth.width, stage->truth.height, stage->visibility, 0,
                                      stage->truth.visibility, 0, &trial->difference, why);
    if (status == CRANNY_OK)
        status = write_picture(stage, trial->image, stage->visibility, why);
    return status == CRANNY_OK ? write_map(stage, trial->map, why) : status;
}

static enum cranny_status try_all(struct stage *stage, struct cranny_error *why)
{
    struct compare *compare = stage->compare;
    enum cranny_status status = CRANNY_OK;
    for (size_t m = 0; m < compare->method_count && status == CRANNY_OK; m++) {
        status = try_row(stage, &compare->methods[m], why);
        if (status == CRANNY_OK &&
            !compare->ui.hooks.progress(compare->ui.hooks.user, "methods", (double)(m + 1),
                                        (double)compare->method_count))
            status = refuse(why, CRANNY_CANCELLED, "interrupted");
    }
    return status;
}

static enum cranny_status get_truth(struct stage *stage, struct cranny_error *why)
{
    struct compare *compare = stage->compare;
    struct compare_view *view = stage->view;
    struct cranny_raytrace_params params = truth_params(stage);
    params.hooks = &compare->ui.hooks;
    enum cranny_status status = compare_need_cache(compare, why);
    if (status == CRANNY_OK)
        status = cranny_truth_get(compare->scene, stage->frame, &params, compare->cache,
                                  &stage->truth, why);
    if (status != CRANNY_OK)
        return status;
    view->truth = stage->truth.report;
    view->truth_s = stage->truth.seconds;
    view->truth_kept = stage->truth.kept;
    if (!view->truth_kept)
        compare->ui.written = compare->cache;
    view->image = picture_name(stage, "truth", ".png");
    if (!view->image)
        return refuse(why, CRANNY_MEMORY, "out of memory for file names");
    char setting[32];
    snprintf(setting, sizeof setting, "rays=%d", compare->options.rays);
    view->command = command_of(
        stage, &(struct compare_method){.method = &methods[METHOD_RAYTRACE], .setting = setting},
        view->image);
    return write_picture(stage, view->image, stage->truth.visibility, why);
}

static enum cranny_status draw_frame(struct stage *stage, struct cranny_error *why)
{
    const struct compare *compare = stage->compare;
    const struct views_task task = compare_views(compare, 0);
    const enum cranny_status status =
        views_draw(&task, &stage->view->sight, compare->options.threads, &compare->ui.hooks,
                   &stage->frame, why);
    if (status == CRANNY_OK)
        stage->gbuffer = cranny_frame_gbuffer(stage->frame);
    return status;
}

static enum cranny_status set_stage(struct stage *stage, struct cranny_error *why)
{
    const int *size = stage->compare->view_scene.size;
    const size_t pixels = (size_t)size[0] * (size_t)size[1];
    stage->visibility = malloc(pixels * sizeof *stage->visibility);
    stage->map = malloc(pixels * 3);
    if (!stage->visibility || !stage->map)
        return refuse(why, CRANNY_MEMORY, "%d x %d pixels do not fit in memory", size[0], size[1]);
    return draw_frame(stage, why);
}

enum cranny_status compare_measure(struct compare *compare, struct compare_view *view,
                                   struct cranny_error *why)
{
    struct stage stage = {
        .compare = compare, .view = view, .number = (size_t)(view - compare->views) + 1};
    enum cranny_status status = set_stage(&stage, why);
    if (status == CRANNY_OK) {
        warn_about_radius(&compare->ui, view->scene, &stage.gbuffer, view->sight.radius_world,
                          false);
        status = get_truth(&stage, why);
    }
    if (status == CRANNY_OK)
        status = try_all(&stage, why);
    cranny_truth_free(&stage.truth);
    cranny_frame_destroy(&stage.frame);
    free(stage.visibility);
    free(stage.map);
    return status;
}

void compare_view_free(struct compare_view *view)
{
    for (size_t t = 0; t < view->trial_count; t++) {
        free(view->trials[t].image);
        free(view->trials[t].map);
        free(view->trials[t].command);
        json_decref(view->trials[t].parameters);
    }
    sight_free(&view->sight);
    free(view->image);
    free(view->command);
}
