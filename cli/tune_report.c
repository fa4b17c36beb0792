/* What a fit says: a table for people, an object for programs, and the preset. */
#include "tune.h"

#include <string.h>

json_t *tune_preset(const struct tune *tune)
{
    json_t *preset = method_parameters_json(tune->method, &tune->fitted);
    const struct cranny_param_table *table = method_table(tune->method);
    for (size_t i = 0; i < table->row_count; i++)
        if (tune_is_fixed(table->rows[i].name) && strcmp(table->rows[i].name, "quads") != 0)
            json_object_del(preset, table->rows[i].name);
    return preset;
}

static void add(struct cranny_difference *sum, const struct cranny_difference *d, double factor)
{
    sum->error += factor * d->error;
    sum->rmse += factor * d->rmse;
    sum->mean += factor * d->mean;
}

/* The means of a scene's views in a set; how many there are. */
static size_t scene_means(const struct tune *tune, size_t scene, bool held_out,
                          struct cranny_tune_change *means)
{
    size_t count = 0;
    struct cranny_tune_change sums = {0};
    for (size_t v = 0; v < tune->view_count; v++) {
        if (tune->views[v].scene != scene || tune->views[v].held_out != held_out)
            continue;
        count++;
        add(&sums.before, &tune->changes[v].before, 1);
        add(&sums.after, &tune->changes[v].after, 1);
    }
    *means = (struct cranny_tune_change){0};
    if (count) {
        add(&means->before, &sums.before, 1.0 / (double)count);
        add(&means->after, &sums.after, 1.0 / (double)count);
    }
    return count;
}

static size_t count_of(const struct tune *tune, bool held_out)
{
    size_t count = 0;
    for (size_t v = 0; v < tune->view_count; v++)
        count += tune->views[v].held_out == held_out;
    return count;
}

static void print_numbers(const struct cranny_difference *d)
{
    printf("  %8.4f %7.4f %+7.4f", d->error, d->rmse, d->mean);
}

static void print_score(const struct cranny_tune_score *score)
{
    print_numbers(&(struct cranny_difference){
        .error = score->error, .rmse = score->rmse, .mean = score->mean});
}

static void print_set(const struct tune *tune, const char *title, bool held_out,
                      const struct cranny_tune_score *before, const struct cranny_tune_score *after)
{
    struct cranny_tune_change means;
    const size_t views = count_of(tune, held_out);
    if (!views)
        return;
    printf("\n%-34s  %-24s    %s\n", title, "before", "after");
    printf("  %-32s  %8s %7s %7s    %8s %7s %7s\n", "scene (views)", "error", "rmse", "mean",
           "error", "rmse", "mean");
    for (size_t i = 0; i < tune->face->operand_count; i++) {
        const size_t count = scene_means(tune, i, held_out, &means);
        char name[64];
        if (!count)
            continue;
        snprintf(name, sizeof name, "%.26s (%zu)", views_name(tune->inputs[i]), count);
        printf("  %-32s", name);
        print_numbers(&means.before);
        printf("  ");
        print_numbers(&means.after);
        printf("\n");
    }
    printf("  %-32s", "mean");
    print_score(before);
    printf("  ");
    print_score(after);
    printf("\n  %-32s  %8.4f %16s    %8.4f  (%+.1f %%)\n", "cost, sqrt(error x rmse)", before->cost,
           "", after->cost,
           before->cost > 0 ? 100 * (after->cost - before->cost) / before->cost : 0);
}

static void print_text(const struct tune *tune)
{
    const struct cranny_tune_report *r = &tune->report;
    const struct cranny_param_table *table = method_table(tune->method);
    if (tune->options.output)
        printf("%s: ", tune->options.output);
    printf("%s, fitted to %zu view%s, judged by %zu; %d sets tried%s\n", tune->method->name,
           count_of(tune, false), count_of(tune, false) == 1 ? "" : "s", count_of(tune, true),
           r->evaluations, r->converged ? "" : ", all that --evaluations allows");
    print_set(tune, "fitted to", false, &r->fit_before, &r->fit_after);
    print_set(tune, "held out", true, &r->held_before, &r->held_after);
    printf("\nparameters\n");
    for (size_t i = 0; i < tune->fit_count; i++) {
        char before[64], after[64];
        cranny_params_get(table, &tune->params, tune->fit[i], before, sizeof before);
        cranny_params_get(table, &tune->fitted, tune->fit[i], after, sizeof after);
        printf("  %-32s  %12s -> %s\n", tune->fit[i], before, after);
    }
}

static json_t *numbers_json(const struct cranny_difference *d)
{
    return json_pack("{so so so}", "error", json_number(d->error), "rmse", json_number(d->rmse),
                     "mean", json_number(d->mean));
}

static json_t *score_json(const struct cranny_tune_score *score)
{
    return json_pack("{so so so so}", "cost", json_number(score->cost), "error",
                     json_number(score->error), "rmse", json_number(score->rmse), "mean",
                     json_number(score->mean));
}

static json_t *set_json(const struct tune *tune, bool held_out,
                        const struct cranny_tune_score *before,
                        const struct cranny_tune_score *after)
{
    json_t *scenes = json_array();
    struct cranny_tune_change means;
    for (size_t i = 0; i < tune->face->operand_count; i++) {
        const size_t count = scene_means(tune, i, held_out, &means);
        if (count)
            json_array_append_new(scenes, json_pack("{so si so so}", "scene",
                                                    json_text(tune->inputs[i]), "views", (int)count,
                                                    "before", numbers_json(&means.before), "after",
                                                    numbers_json(&means.after)));
    }
    return json_pack("{si so so so}", "views", (int)count_of(tune, held_out), "before",
                     score_json(before), "after", score_json(after), "scenes", scenes);
}

static json_t *view_json(const struct tune *tune, size_t number)
{
    const struct tune_view *view = &tune->views[number];
    return json_pack("{so so so sb sb so so}", "scene", json_text(tune->inputs[view->scene]),
                     "camera", json_text(view->sight.camera), "radius_world",
                     json_number(view->sight.radius_world), "held_out", view->held_out, "cached",
                     view->truth.kept, "before", numbers_json(&tune->changes[number].before),
                     "after", numbers_json(&tune->changes[number].after));
}

static json_t *values_json(const struct tune *tune)
{
    json_t *fitted = json_array();
    json_t *before = method_parameters_json(tune->method, &tune->params);
    json_t *after = method_parameters_json(tune->method, &tune->fitted);
    for (size_t i = 0; i < tune->fit_count; i++)
        json_array_append_new(fitted, json_pack("{ss sO sO}", "name", tune->fit[i], "before",
                                                json_object_get(before, tune->fit[i]), "after",
                                                json_object_get(after, tune->fit[i])));
    json_decref(before);
    json_decref(after);
    return fitted;
}

static json_t *result_json(const struct tune *tune)
{
    const struct cranny_tune_report *r = &tune->report;
    const char *output = tune->options.output;
    json_t *views = json_array();
    for (size_t v = 0; v < tune->view_count; v++)
        json_array_append_new(views, view_json(tune, v));
    return json_pack("{ss so si si si sb sb so so so so so so so so}", "method", tune->method->name,
                     "output", output ? json_text(output) : json_null(), "width",
                     tune->view_scene.size[0], "height", tune->view_scene.size[1], "evaluations",
                     r->evaluations, "converged", r->converged, "flat", r->flat, "fitted",
                     values_json(tune), "fit", set_json(tune, false, &r->fit_before, &r->fit_after),
                     "held_out", set_json(tune, true, &r->held_before, &r->held_after), "views",
                     views, "parameters", tune_preset(tune), "rays",
                     json_integer(tune->options.rays), "seconds",
                     json_pack("{so}", "total", json_number(tune->total_s)), "warnings",
                     json_warnings(&tune->ui));
}

int tune_print(struct tune *tune)
{
    ui_erase(&tune->ui);
    if (tune->ui.json)
        return ui_print_json(&tune->ui, result_json(tune));
    if (!tune->ui.quiet)
        print_text(tune);
    return ui_finish_output(&tune->ui);
}
