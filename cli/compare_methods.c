/* What is tried on each view: one list, from which times, errors and pictures come. */
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
    struct cranny_workspace *workspace;
    float *visibility;
    uint8_t *map;
};

static bool is_word_of(const char *list, const char *word)
{
    const size_t length = strlen(word);
    for (const char *at = list; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL)
        if (strncmp(at, word, length) == 0 && (at[length] == ',' || !at[length]))
            return true;
    return false;
}

static void list_method(struct compare *compare, struct compare_method method)
{
    const char *wanted = compare->options.methods;
    if ((!wanted || is_word_of(wanted, method.name)) &&
        compare->method_count < COMPARE_METHOD_LIMIT)
        compare->methods[compare->method_count++] = method;
}

/* Every word must be a method; one that is mistyped would only be missed. */
static enum cranny_status check_names(const char *list, struct cranny_error *why)
{
    char names[256] = "", word[64];
    for (int m = 0; render_methods[m]; m++) {
        const size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", m ? ", " : "", render_methods[m]);
    }
    for (const char *at = list; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL) {
        snprintf(word, sizeof word, "%.*s", (int)strcspn(at, ","), at);
        bool known = false;
        for (int m = 0; render_methods[m] && !known; m++)
            known = strcmp(render_methods[m], word) == 0;
        if (!known)
            return refuse(why, CRANNY_USAGE, "--methods: '%s' is none of: %s", word, names);
    }
    return CRANNY_OK;
}

enum cranny_status compare_list_methods(struct compare *compare, struct cranny_error *why)
{
    static const struct {
        int rays;
        const char *name;
    } counts[] = {{64, "rays=64"}, {16, "rays=16"}, {1, "rays=1"}};
    const enum cranny_status status = check_names(compare->options.methods, why);
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        if (counts[i].rays < compare->options.rays)
            list_method(compare, (struct compare_method){.name = render_methods[RENDER_RAYTRACE],
                                                         .preset = counts[i].name,
                                                         .device = "cpu",
                                                         .series = true,
                                                         .id = RENDER_RAYTRACE,
                                                         .rays = counts[i].rays});
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        const char *const *presets = cranny_screen_preset_names((enum cranny_method)m);
        for (int p = 0; presets[p]; p++)
            list_method(compare,
                        (struct compare_method){.name = cranny_method_name((enum cranny_method)m),
                                                .preset = presets[p],
                                                .device = "cpu",
                                                .id = m});
    }
    if (status == CRANNY_OK && !compare->method_count)
        return refuse(why, CRANNY_USAGE, "--methods: fewer rays than the truth's %d are not tried",
                      compare->options.rays);
    return status;
}

static bool goes_on(void *user, const char *stage, double done, double total)
{
    (void)user;
    (void)stage;
    (void)done;
    (void)total;
    return !ui_interrupted();
}

/* Its own progress would only flicker. */
static struct cranny_hooks quiet_hooks(const struct compare *compare)
{
    return (struct cranny_hooks){compare->ui.hooks.user, compare->ui.hooks.log, goes_on};
}

/* One run of a method on the stage: visibility, and what is known of it. */
static enum cranny_status run_screen(struct stage *stage, struct compare_trial *trial, double *ms,
                                     struct cranny_error *why)
{
    const enum cranny_method method = (enum cranny_method)trial->method->id;
    const struct cranny_hooks hooks = quiet_hooks(stage->compare);
    struct cranny_screen_params params = cranny_screen_params_preset(method, trial->method->preset);
    struct cranny_screen_report report;
    params.radius_world = (float)stage->view->radius_world;
    params.threads = stage->compare->options.threads;
    params.isa = stage->compare->options.isa;
    params.workspace = stage->workspace;
    params.report = &report;
    params.hooks = &hooks;
    const enum cranny_status status =
        cranny_screen_render(&stage->gbuffer, &params, stage->visibility, 0, why);
    *ms = report.total_ms;
    trial->isa = report.isa;
    if (!trial->parameters)
        trial->parameters = json_parameters(cranny_screen_param_table(method), &params);
    return status;
}

static struct cranny_raytrace_params rays_of(const struct stage *stage, int rays)
{
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    params.radius_world = (float)stage->view->radius_world;
    params.rays = rays;
    params.threads = stage->compare->options.threads;
    return params;
}

static enum cranny_status run_rays(struct stage *stage, struct compare_trial *trial, double *ms,
                                   struct cranny_error *why)
{
    const struct cranny_hooks hooks = quiet_hooks(stage->compare);
    struct cranny_raytrace_params params = rays_of(stage, trial->method->rays);
    struct cranny_raytrace_report report = {0};
    params.hooks = &hooks;
    const enum cranny_status status =
        cranny_frame_raytrace(stage->frame, &params, stage->visibility, 0, NULL, &report, why);
    *ms = 1e3 * report.seconds;
    trial->standard_error = report.standard_error_mean;
    trial->isa = -1;
    if (!trial->parameters)
        trial->parameters = json_parameters(cranny_raytrace_param_table(), &params);
    return status;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median of --repeat runs; the first one, which gets the memory, does not count. */
static enum cranny_status run_often(struct stage *stage, struct compare_trial *trial,
                                    struct cranny_error *why)
{
    const int wanted = stage->compare->options.repeat;
    double times[RUN_LIMIT + 1], spent_ms = 0;
    enum cranny_status status = CRANNY_OK;
    int count = 0;
    for (; count <= wanted && status == CRANNY_OK; count++) {
        if (count && spent_ms > 1e3 * RUNS_SECONDS)
            break;
        status = trial->method->id == RENDER_RAYTRACE
                     ? run_rays(stage, trial, &times[count], why)
                     : run_screen(stage, trial, &times[count], why);
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

/* A file's name out of any words: letters, digits and a few signs. */
static char *picture_name(const struct stage *stage, const char *what, const char *preset,
                          const char *ending)
{
    const char *slash = strrchr(stage->view->scene, '/');
    const char *scene = slash ? slash + 1 : stage->view->scene;
    const char *dot = strrchr(scene, '.');
    const int stem = (int)(dot && dot != scene ? dot - scene : (long)strlen(scene));
    char *name = text_of_format("%03zu-%.*s-%s%s%s%s", stage->number, stem < 60 ? stem : 60, scene,
                                what, *preset ? "-" : "", preset, ending);
    for (char *c = name; c && *c; c++)
        if (!isalnum((unsigned char)*c) && !strchr("._-", *c))
            *c = '-';
    return name;
}

/* `cranny render` with what makes the same picture. */
static char *command_of(const struct stage *stage, const char *method, const char *preset, int rays,
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
            o->size[0], o->size[1], stage->view->options);
    if (compare->lens.fov_degrees != 0)
        fprintf(out, " --fov %.9g", compare->lens.fov_degrees);
    if (compare->lens.half_height != 0)
        fprintf(out, " --ortho %.9g", compare->lens.half_height);
    if (compare->lens.guard >= 0)
        fprintf(out, " --guard %d", compare->lens.guard);
    if (o->msaa)
        fprintf(out, " --msaa %d", 1 << o->msaa);
    fprintf(out, "%s --method %s --radius %.9g", o->normals_from ? " --normals-from smooth" : "",
            method, stage->view->radius_world);
    if (rays)
        fprintf(out, " --rays %d", rays);
    else
        fprintf(out, " --preset %s", preset);
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

static enum cranny_status try_method(struct stage *stage, const struct compare_method *method,
                                     struct cranny_error *why)
{
    struct compare_trial *trial = &stage->view->trials[stage->view->trial_count++];
    *trial = (struct compare_trial){.method = method};
    trial->image = picture_name(stage, method->name, method->preset, ".png");
    trial->map = picture_name(stage, method->name, method->preset, "-error.png");
    if (!trial->image || !trial->map)
        return refuse(why, CRANNY_MEMORY, "out of memory for file names");
    trial->command = command_of(stage, method->name, method->preset, method->rays, trial->image);
    enum cranny_status status = run_often(stage, trial, why);
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
        status = try_method(stage, &compare->methods[m], why);
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
    struct cranny_raytrace_params params = rays_of(stage, compare->options.rays);
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
    view->image = picture_name(stage, "truth", "", ".png");
    if (!view->image)
        return refuse(why, CRANNY_MEMORY, "out of memory for file names");
    view->command = command_of(stage, render_methods[RENDER_RAYTRACE], NULL, compare->options.rays,
                               view->image);
    return write_picture(stage, view->image, stage->truth.visibility, why);
}

static enum cranny_status draw_frame(struct stage *stage, struct cranny_error *why)
{
    struct compare *compare = stage->compare;
    struct cranny_frame_params params = cranny_frame_params_default();
    params.width = compare->view_scene.size[0];
    params.height = compare->view_scene.size[1];
    params.guard_band = stage->view->guard;
    params.samples = 1 << compare->view_scene.msaa;
    params.normals = compare->view_scene.normals_from;
    params.threads = compare->options.threads;
    params.hooks = &compare->ui.hooks;
    const enum cranny_status status = cranny_frame_create(
        compare->scene, compare->tracer, &stage->view->eye, &params, &stage->frame, why);
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
    const enum cranny_status status = draw_frame(stage, why);
    return status == CRANNY_OK ? cranny_workspace_create(&stage->workspace, why) : status;
}

enum cranny_status compare_measure(struct compare *compare, struct compare_view *view,
                                   struct cranny_error *why)
{
    struct stage stage = {
        .compare = compare, .view = view, .number = (size_t)(view - compare->views) + 1};
    enum cranny_status status = set_stage(&stage, why);
    if (status == CRANNY_OK) {
        warn_about_radius(&compare->ui, view->scene, &stage.gbuffer, view->radius_world);
        status = get_truth(&stage, why);
    }
    if (status == CRANNY_OK)
        status = try_all(&stage, why);
    cranny_workspace_destroy(&stage.workspace);
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
    free(view->camera);
    free(view->options);
    free(view->image);
    free(view->command);
}
