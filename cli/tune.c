#include "tune.h"

#include "paths.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const hold_names[] = {"alternate", "rest", "none", NULL};

static const struct option tune_rows[] = {
    {.name = "method",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct tune_options, method),
     .choices = method_names,
     .help = "whose parameters; 'cranny tune --method hbao --help' lists hbao's"},
    {.name = "output",
     .letter = 'o',
     .type = OPTION_TEXT,
     .offset = offsetof(struct tune_options, output),
     .value = "PRESET.json",
     .help = "file for what was found, which --preset of render, compare and tune reads (default: "
             "it is only printed)"},
    {.name = "fit",
     .type = OPTION_TEXT,
     .offset = offsetof(struct tune_options, fit),
     .value = "NAME,NAME",
     .help = "parameters to fit, of any type (default: those that the method's table marks, but "
             "for what the command line sets)"},
    {.name = "held-out",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct tune_options, hold),
     .choices = hold_names,
     .help = "views that judge and are not fitted to: every other one of each scene (default), "
             "all but each scene's first, or none. A scene with one view gets another, turned, "
             "to be judged by"},
    {.name = "evaluations",
     .type = OPTION_INT,
     .offset = offsetof(struct tune_options, evaluations),
     .value = "N",
     .minimum = 1,
     .maximum = 100000,
     .help = "sets of parameters to try at most (default 300); 1 measures what there is"},
    {.name = "rays",
     .type = OPTION_INT,
     .offset = offsetof(struct tune_options, rays),
     .value = "N",
     .minimum = 1,
     .maximum = 65536,
     .help = "of the truth, a pixel (default 1024)"},
    {.name = "cache",
     .type = OPTION_TEXT,
     .offset = offsetof(struct tune_options, cache),
     .value = "DIR",
     .help = "folder that keeps truths between runs, found by their content; may be compare's "
             "(default: none are kept)"},
};

static const char summary[] =
    "Fits a method's parameters to ray-traced truth on your scenes: changes them as long as that\n"
    "lowers sqrt(error x rmse) on some of the views (error is eq. 31 of 'cranny diff'), and "
    "judges\n"
    "by the others, before and after. When these get worse, a warning says so: the fit then suits\n"
    "its own views alone.\n"
    "--set, --preset and the options below 'Parameters' say where to begin; what they set is not\n"
    "fitted unless --fit names it. The outcome appears whole or not at all: an interrupted fit\n"
    "writes nothing, but the truths in --cache stay. The same command gives the same outcome,\n"
    "whatever --threads and --cpu-mask.";

static const char examples[] =
    "  cranny tune level.glb --method hbao -o mine.json       then: render --method hbao --preset "
    "mine.json\n"
    "  cranny tune a.glb --radius 1 b.glb --radius 0.03 --views 4 --method alchemy --size 640x360\n"
    "  cranny tune level.glb --method volumes --fit delta_scale,knee --set contrast=1\n"
    "  cranny tune level.glb --method ssao --preset paper --evaluations 1      how good is it?\n"
    "  cranny tune level.glb --method ssao --json -v | jq .parameters\n"
    "  cranny tune --method volumes --help                    volumes' parameters\n";

bool tune_is_fixed(const char *name)
{
    static const char *const names[] = {"radius_world", "threads", "isa", "seed", "quads"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(names[i], name) == 0)
            return true;
    return false;
}

static enum cranny_status add_name(struct tune *tune, const char *name, struct cranny_error *why)
{
    if (tune->fit_count == TUNE_FIT_LIMIT)
        return refuse(why, CRANNY_USAGE, "--fit: more than %d parameters", TUNE_FIT_LIMIT);
    tune->fit[tune->fit_count++] = name;
    return CRANNY_OK;
}

static const struct cranny_param *row_of(const struct tune *tune, const char *name)
{
    const struct cranny_param_table *table = method_table(tune->method);
    for (size_t i = 0; i < table->row_count; i++)
        if (strcmp(table->rows[i].name, name) == 0)
            return &table->rows[i];
    return NULL;
}

static enum cranny_status check_name(const struct tune *tune, const char *name,
                                     struct cranny_error *why)
{
    const struct cranny_param_table *table = method_table(tune->method);
    const char *names[OPTION_GIVEN_LIMIT];
    size_t count = 0;
    if (tune_is_fixed(name) && row_of(tune, name))
        return refuse(why, CRANNY_USAGE,
                      "--fit: %s is no matter of looks, or the same for all "
                      "views; set it instead",
                      name);
    for (size_t i = 0; i < tune->fit_count; i++)
        if (strcmp(tune->fit[i], name) == 0)
            return refuse(why, CRANNY_USAGE, "--fit: %s is named twice", name);
    if (row_of(tune, name))
        return CRANNY_OK;
    for (; count < table->row_count && count < OPTION_GIVEN_LIMIT; count++)
        names[count] = table->rows[count].name;
    const char *near = nearest_name(name, names, count);
    return refuse(why, CRANNY_USAGE, "--fit: %s has no parameter '%.200s'%s%s%s",
                  tune->method->name, name, near ? "; did you mean '" : "", near ? near : "",
                  near ? "'?" : "");
}

static enum cranny_status cut_names(struct tune *tune, struct cranny_error *why)
{
    tune->names = strdup(tune->options.fit);
    if (!tune->names)
        return refuse(why, CRANNY_MEMORY, "out of memory for names");
    char *rest = tune->names;
    enum cranny_status status = CRANNY_OK;
    for (char *name; status == CRANNY_OK && (name = strsep(&rest, ","));) {
        for (char *c = name; *c; c++)
            *c = *c == '-' ? '_' : *c;
        status = check_name(tune, name, why);
        if (status == CRANNY_OK)
            status = add_name(tune, name, why);
    }
    return status;
}

/* What the table marks, but for what the command line sets. */
static enum cranny_status choose_names(struct tune *tune, struct cranny_error *why)
{
    const struct cranny_param_table *table = method_table(tune->method);
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; i < table->row_count && status == CRANNY_OK; i++)
        if (table->rows[i].step > 0 && !option_given(tune->face, table->rows[i].name))
            status = add_name(tune, table->rows[i].name, why);
    if (status == CRANNY_OK && !tune->fit_count)
        return refuse(why, CRANNY_USAGE,
                      "the command line sets all that is fitted; name some with --fit");
    return status;
}

static enum cranny_status check_options(struct tune *tune, struct cranny_error *why)
{
    const struct views_task task = tune_task(tune, 0);
    static const char *const endings[] = {".json", NULL};
    enum cranny_status status = CRANNY_OK;
    if (tune->options.method < 0)
        return refuse(why, CRANNY_USAGE, "--method: name the method to fit, as in --method hbao");
    if (tune->method->kind->is_truth)
        return refuse(why, CRANNY_USAGE, "--method %s: is the truth that the others are fitted to",
                      tune->method->name);
    if (tune->options.output)
        status = path_check_extension(tune->options.output, endings, "-o", why);
    if (status == CRANNY_OK)
        status = views_check(&task, why);
    if (status == CRANNY_OK)
        status = tune->options.fit ? cut_names(tune, why) : choose_names(tune, why);
    if (status == CRANNY_OK && tune->options.output)
        status = path_check_output(tune->options.output, why);
    return status;
}

/* The method's own progress would only flicker. */
static enum cranny_status draw(void *user, size_t number, const void *params, float *visibility,
                               struct cranny_error *why)
{
    struct tune *tune = user;
    const struct tune_view *view = &tune->views[number];
    const struct cranny_hooks quiet = {NULL, NULL, ui_goes_on};
    struct method_input input = {.gbuffer = view->gbuffer};
    struct method_report report;
    union method_params own;
    memcpy(&own, params, sizeof own);
    const struct method_fields fields = method_fields(tune->method, &own);
    *fields.radius_world = (float)view->sight.radius_world;
    *fields.hooks = &quiet;
    input.gbuffer.world_from_view = view->world_from_view;
    return method_run(tune->method, &input, &own, &tune->states[view->scene], visibility, &report,
                      why);
}

/* Every scene counts alike in its set, however many views it has. */
static double weight_of(const struct tune *tune, const struct tune_view *view)
{
    size_t count = 0;
    for (size_t v = 0; v < tune->view_count; v++)
        count += tune->views[v].scene == view->scene && tune->views[v].held_out == view->held_out;
    return 1.0 / (double)count;
}

static enum cranny_status fit(struct tune *tune, struct cranny_error *why)
{
    const struct cranny_tune_params params = {tune->options.evaluations, &tune->ui.hooks};
    struct cranny_tune_view *views = calloc(tune->view_count, sizeof *views);
    tune->changes = calloc(tune->view_count, sizeof *tune->changes);
    const struct cranny_tune_problem problem = {.table = method_table(tune->method),
                                                .params_size = sizeof tune->params,
                                                .params = &tune->params,
                                                .names = tune->fit,
                                                .name_count = tune->fit_count,
                                                .views = views,
                                                .view_count = tune->view_count,
                                                .draw = draw,
                                                .user = tune};
    enum cranny_status status =
        views && tune->changes ? CRANNY_OK : refuse(why, CRANNY_MEMORY, "out of memory for views");
    for (size_t v = 0; v < tune->view_count && status == CRANNY_OK; v++)
        views[v] =
            (struct cranny_tune_view){tune->views[v].truth.width, tune->views[v].truth.height,
                                      tune->views[v].truth.visibility,
                                      weight_of(tune, &tune->views[v]), tune->views[v].held_out};
    if (status == CRANNY_OK)
        status = cranny_tune(&problem, &params, &tune->fitted, &tune->report, tune->changes, why);
    free(views);
    return status;
}

static enum cranny_status write_preset(struct tune *tune, struct cranny_error *why)
{
    json_t *preset = tune_preset(tune);
    char *text = preset ? json_dumps(preset, JSON_INDENT(2) | JSON_REAL_PRECISION(9)) : NULL;
    enum cranny_status status =
        text ? CRANNY_OK : refuse(why, CRANNY_MEMORY, "out of memory for the preset");
    json_decref(preset);
    if (status == CRANNY_OK && ui_interrupted())
        status = refuse(why, CRANNY_CANCELLED, "interrupted");
    if (status == CRANNY_OK)
        status = cranny_file_write(tune->options.output, text, strlen(text), why);
    free(text);
    return status;
}

static enum cranny_status run(struct tune *tune, struct cranny_error *why)
{
    const double begin_s = clock_s();
    enum cranny_status status = check_options(tune, why);
    if (status == CRANNY_OK)
        status = tune_open_views(tune, why);
    if (status == CRANNY_OK)
        status = fit(tune, why);
    if (status == CRANNY_OK && tune->options.output)
        status = write_preset(tune, why);
    tune->total_s = clock_s() - begin_s;
    return status;
}

static void choose_method(struct tune *tune, struct interface *face)
{
    const struct method *method = tune->method;
    tune->fields = method_fields(method, &tune->params);
    method_params_preset(method, NULL, &tune->params);
    face->table = method_table(method);
    face->params = &tune->params;
    face->presets = method_presets(method);
    face->apply_preset = method->kind->apply;
}

static int tune_scenes(struct tune *tune, int argc, char **argv)
{
    struct option_group groups[] = {
        {"Fitting", tune_rows, sizeof tune_rows / sizeof *tune_rows, &tune->options},
        views_options,
        scene_options,
        view_options,
        load_options,
        ui_options};
    void *const targets[] = {&tune->options, &tune->looks, &tune->view_scene,
                             &tune->lens,    &tune->load,  &tune->ui};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
        groups[i].target = targets[i];
    char command[64];
    snprintf(command, sizeof command, "tune --method %s", tune->method->name);
    struct interface face = {
        .command = command,
        .usage = "SCENE... --method METHOD [-o PRESET.json] [OPTION...]",
        .summary = summary,
        .examples = examples,
        .groups = groups,
        .group_count = sizeof groups / sizeof *groups,
        .operands = tune->inputs,
        .operand_limit = SCENE_LIMIT,
    };
    struct cranny_error why;
    choose_method(tune, &face);
    tune->face = &face;
    int exit = begin_command(&face, &tune->ui, argc, argv);
    if (exit < 0)
        exit = run(tune, &why) == CRANNY_OK ? tune_print(tune) : ui_fail(&tune->ui, &why);
    tune->face = NULL;
    return exit;
}

int command_tune(int argc, char **argv)
{
    struct tune *tune = calloc(1, sizeof *tune);
    if (!tune)
        return cranny_exit_status(CRANNY_MEMORY);
    tune->method = method_named(argc, argv, &methods[METHOD_ALCHEMY]);
    tune->options = (struct tune_options){.method = -1, .evaluations = 300, .rays = 1024};
    tune->load = load_options_default();
    tune->view_scene = scene_options_default();
    tune->lens = view_options_default();
    const int exit = tune_scenes(tune, argc, argv);
    tune_close_views(tune);
    if (tune->made_cache)
        rmdir(tune->options.cache); /* stays when there is something in it */
    free(tune->names);
    free(tune->changes);
    ui_end(&tune->ui);
    free(tune);
    return exit;
}
