#include "compare.h"

#include "shell.h"

#include <stdlib.h>
#include <string.h>

/* cranny_isa_name's order. */
static const char *const isa_names[] = {"auto", "portable", "avx2", "avx512", NULL};

static const struct option compare_rows[] = {
    {.name = "output",
     .letter = 'o',
     .type = OPTION_TEXT,
     .offset = offsetof(struct compare_options, output),
     .value = "DIR",
     .help = "folder for index.html, results.json and images/; made when it is missing"},
    {.name = "cache",
     .type = OPTION_TEXT,
     .offset = offsetof(struct compare_options, cache),
     .value = "DIR",
     .help = "folder that keeps truths between runs, found by their content (default: cache in the "
             "output folder)"},
};

static const struct option measure_rows[] = {
    {.name = "methods",
     .type = OPTION_TEXT,
     .offset = offsetof(struct compare_options, methods),
     .value = "LIST",
     .help = "only these, as in alchemy,hbao,raytrace (default: all)"},
    {.name = "preset",
     .type = OPTION_LIST,
     .offset = offsetof(struct compare_options, presets),
     .value = "FILE.json",
     .help = "a row more, named as the file: a preset that says whose it is, as in {\"method\": "
             "\"volumes\", \"intensity\": 1.2}; may come again"},
    {.name = "rays",
     .type = OPTION_INT,
     .offset = offsetof(struct compare_options, rays),
     .value = "N",
     .minimum = 1,
     .maximum = 65536,
     .help = "of the truth, a pixel (default 5000)"},
    {.name = "repeat",
     .type = OPTION_INT,
     .offset = offsetof(struct compare_options, repeat),
     .value = "N",
     .minimum = 1,
     .maximum = 1000,
     .help = "runs of each method, of which the median time counts; fewer of those that take long "
             "(default 5)"},
    {.name = "threads",
     .type = OPTION_INT,
     .offset = offsetof(struct compare_options, threads),
     .value = "N",
     .minimum = 0,
     .maximum = 4096,
     .help = "0: all cores (default); never changes a picture"},
    {.name = "cpu-mask",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct compare_options, isa),
     .choices = isa_names,
     .help = "instruction set of the methods (default auto); never changes a picture"},
};

static const char summary[] =
    "Every method at every preset beside ray-traced truth, on your scenes: DIR/index.html is a "
    "page\n"
    "that needs nothing else, DIR/results.json holds the numbers, DIR/images the pictures. Truths\n"
    "are kept, so that a second run is quick. Each picture's command stands beside it.\n"
    "A scene that cannot be read is reported, and the others go on; the exit status is then its,\n"
    "and the page names it. An interrupted run leaves the old files as they were, and keeps the\n"
    "truths that it has traced.";

static const char examples[] =
    "  cranny compare level.glb -o out                        the file's cameras\n"
    "  cranny compare level.glb -o out --rays 256 --size 640x360      a quick look\n"
    "  cranny compare sponza.glb --view nave=10,2,0:0,3,0 --radius 1 dragon.glb --radius 0.03 -o "
    "out\n"
    "  cranny compare *.glb --views 3 -o out --cache ~/truths\n"
    "  cranny compare level.glb -o out --json | jq '.views[].methods[] | [.name, .error]'\n";

/* As typed, before parsing takes it apart. */
static char *whole_command(int argc, char **argv)
{
    char *command = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&command, &size);
    if (!out)
        return NULL;
    fputs("cranny compare", out);
    for (int i = 0; i < argc; i++) {
        fputc(' ', out);
        shell_word(out, argv[i]);
    }
    if (fclose(out) == 0)
        return command;
    free(command);
    return NULL;
}

static enum cranny_status check_options(struct compare *compare, struct cranny_error *why)
{
    if (!compare->options.output || !compare->options.output[0])
        return refuse(why, CRANNY_USAGE, "-o: name a folder for the results");
    if (!compare->command)
        return refuse(why, CRANNY_MEMORY, "out of memory for the command line");
    const struct views_task task = compare_views(compare, 0);
    const enum cranny_status status = views_check(&task, why);
    return status == CRANNY_OK ? compare_list_methods(compare, why) : status;
}

struct views_task compare_views(const struct compare *compare, size_t input)
{
    return (struct views_task){.face = compare->face,
                               .options = &compare->looks,
                               .scene_options = &compare->view_scene,
                               .lens = &compare->lens,
                               .scene = compare->scene,
                               .tracer = compare->tracer,
                               .number = input};
}

static void unload(struct compare *compare)
{
    method_state_leave_scene(&compare->state);
    cranny_tracer_destroy(&compare->tracer);
    cranny_scene_destroy(&compare->scene);
}

static enum cranny_status measure_views(struct compare *compare, size_t input, size_t first,
                                        struct cranny_error *why)
{
    const size_t scenes = compare->face->operand_count;
    enum cranny_status status = CRANNY_OK;
    for (size_t v = first; v < compare->view_count && status == CRANNY_OK; v++) {
        struct cranny_error own;
        ui_head(&compare->ui,
                "%.40s (%zu of %zu), view %zu of %zu: ", views_name(compare->inputs[input]),
                input + 1, scenes, v - first + 1, compare->view_count - first);
        status = compare_measure(compare, &compare->views[v], &own);
        if (status == CRANNY_INPUT)
            refuse(why, status, "%.200s: %.800s", compare->inputs[input], own.message);
        else if (status != CRANNY_OK)
            *why = own;
    }
    return status;
}

/* Whose views are being found. */
struct finder {
    struct compare *compare;
    size_t input;
};

static enum cranny_status add_view(void *user, struct sight sight, struct cranny_error *why)
{
    const struct finder *finder = user;
    struct compare *compare = finder->compare;
    if (!views_grow((void **)&compare->views, compare->view_count, &compare->view_room,
                    sizeof *compare->views)) {
        sight_free(&sight);
        return refuse(why, CRANNY_MEMORY, "more views than fit");
    }
    compare->views[compare->view_count++] =
        (struct compare_view){.scene = compare->inputs[finder->input],
                              .sight = sight,
                              .triangles = cranny_scene_triangle_count(compare->scene)};
    return CRANNY_OK;
}

/* All of a scene's views or none of them. */
static enum cranny_status compare_scene(struct compare *compare, size_t input,
                                        struct cranny_error *why)
{
    const size_t first = compare->view_count;
    ui_head(&compare->ui, "%.40s (%zu of %zu): ", views_name(compare->inputs[input]), input + 1,
            compare->face->operand_count);
    enum cranny_status status =
        views_load(&compare->ui, compare->inputs[input], &compare->load, compare->options.threads,
                   &compare->scene, &compare->tracer, why);
    const struct views_task task = compare_views(compare, input);
    struct finder finder = {compare, input};
    if (status == CRANNY_OK)
        status = views_find(&task, add_view, &finder, why);
    if (status == CRANNY_OK)
        status = measure_views(compare, input, first, why);
    unload(compare);
    while (status != CRANNY_OK && compare->view_count > first)
        compare_view_free(&compare->views[--compare->view_count]);
    return status;
}

/* Is it the scene's fault, so that others may go on? */
static bool is_of_scene(enum cranny_status status)
{
    return status == CRANNY_INPUT || status == CRANNY_MEMORY || status == CRANNY_USAGE;
}

static enum cranny_status compare_scenes(struct compare *compare, struct cranny_error *why)
{
    const size_t scenes = compare->face->operand_count;
    for (size_t i = 0; i < scenes; i++) {
        const enum cranny_status status = compare_scene(compare, i, why);
        if (status == CRANNY_OK)
            continue;
        /* The last word when nothing could be shown is the caller's. */
        const bool last = i + 1 == scenes && !compare->view_count;
        if (!is_of_scene(status) || last)
            return status;
        ui_complain(&compare->ui, why);
        compare->failure = compare->failure ? compare->failure : status;
        compare->failures[compare->failure_count++] = strdup(why->message);
    }
    return CRANNY_OK;
}

static void print_text(const struct compare *compare)
{
    const size_t count = compare->view_count;
    printf("%s/index.html: %zu view%s, %zu methods and presets\n", compare->folder, count,
           count == 1 ? "" : "s", compare->method_count);
    for (size_t v = 0; v < count; v++) {
        const struct compare_view *view = &compare->views[v];
        const struct compare_trial *best = NULL;
        for (size_t t = 0; t < view->trial_count; t++)
            if (!view->trials[t].method->method->kind->is_truth &&
                (!best || view->trials[t].difference.error < best->difference.error))
                best = &view->trials[t];
        if (best)
            printf("  %s, %s: nearest to the truth is %s %s, error %.3f, %.1f ms\n",
                   views_name(view->scene), view->sight.camera, best->method->method->name,
                   best->method->label, best->difference.error, best->milliseconds);
    }
}

static int print_results(struct compare *compare, json_t *results)
{
    int exit;
    ui_erase(&compare->ui);
    if (compare->ui.json)
        exit = ui_print_json(&compare->ui, json_incref(results));
    else {
        if (!compare->ui.quiet)
            print_text(compare);
        exit = ui_finish_output(&compare->ui);
    }
    return exit ? exit : cranny_exit_status(compare->failure);
}

static int run(struct compare *compare)
{
    struct cranny_error why;
    json_t *results = NULL;
    enum cranny_status status = check_options(compare, &why);
    if (status == CRANNY_OK)
        status = compare_open_folder(compare, &why);
    if (status == CRANNY_OK)
        status = compare_scenes(compare, &why);
    if (status == CRANNY_OK) {
        results = compare_json(compare);
        status = compare_write(compare, results, &why);
    }
    if (status == CRANNY_OK && ui_interrupted())
        status = refuse(&why, CRANNY_CANCELLED, "interrupted");
    if (status == CRANNY_OK)
        status = compare_fill_folder(compare, results, &why);
    const int exit =
        status == CRANNY_OK ? print_results(compare, results) : ui_fail(&compare->ui, &why);
    json_decref(results);
    return exit;
}

static void destroy(struct compare *compare)
{
    compare_close_folder(compare);
    method_state_free(&compare->state);
    for (size_t v = 0; v < compare->view_count; v++)
        compare_view_free(&compare->views[v]);
    for (size_t i = 0; i < compare->failure_count; i++)
        free(compare->failures[i]);
    free(compare->views);
    free(compare->command);
    ui_end(&compare->ui);
    free(compare);
}

int command_compare(int argc, char **argv)
{
    struct compare *compare = calloc(1, sizeof *compare);
    if (!compare)
        return cranny_exit_status(CRANNY_MEMORY);
    compare->load = load_options_default();
    compare->options = (struct compare_options){.rays = 5000, .repeat = 5};
    compare->view_scene = scene_options_default();
    compare->lens = view_options_default();
    compare->command = whole_command(argc, argv);
    struct option_group groups[] = {
        {"Output", compare_rows, sizeof compare_rows / sizeof *compare_rows, &compare->options},
        {"Comparing", measure_rows, sizeof measure_rows / sizeof *measure_rows, &compare->options},
        views_options,
        scene_options,
        view_options,
        load_options,
        ui_options};
    void *const targets[] = {&compare->looks, &compare->view_scene, &compare->lens, &compare->load,
                             &compare->ui};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
        groups[2 + i].target = targets[i];
    struct interface face = {
        .command = "compare",
        .usage = "SCENE... -o DIR [OPTION...]",
        .summary = summary,
        .examples = examples,
        .groups = groups,
        .group_count = sizeof groups / sizeof *groups,
        .operands = compare->inputs,
        .operand_limit = SCENE_LIMIT,
    };
    compare->face = &face;
    int exit = begin_command(&face, &compare->ui, argc, argv);
    if (exit < 0)
        exit = run(compare);
    destroy(compare);
    return exit;
}
