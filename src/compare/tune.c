/* A method's parameters against the truth. */
#include "compare/search.h"

#include <cranny/tune.h>

enum { SIDE_MAX = 16384, EVALUATIONS_MAX = 100000 };

struct tune {
    const struct cranny_tune_problem *problem;
    const struct cranny_hooks *hooks;
    const struct cranny_param **rows; /* that are fitted */
    size_t row_count;
    void *params;                    /* a copy to draw with */
    float *picture;                  /* of the largest view */
    struct cranny_difference *drawn; /* each view by `params`; views not drawn keep theirs */
    const char *stage;
    double done, total; /* views drawn, of the stage */
    double best_cost;
    int tried;
};

struct cranny_tune_params cranny_tune_params_default(void)
{
    return (struct cranny_tune_params){.evaluations = 300};
}

/* The means of a set. */
static struct cranny_tune_score score_of(const struct tune *tune, bool held_out)
{
    struct cranny_tune_score score = {0};
    double weights = 0;
    for (size_t v = 0; v < tune->problem->view_count; v++) {
        const struct cranny_tune_view *view = &tune->problem->views[v];
        if (view->held_out != held_out)
            continue;
        score.error += view->weight * tune->drawn[v].error;
        score.rmse += view->weight * tune->drawn[v].rmse;
        score.mean += view->weight * tune->drawn[v].mean;
        weights += view->weight;
    }
    if (!(weights > 0))
        return score;
    score.error /= weights;
    score.rmse /= weights;
    score.mean /= weights;
    score.cost = sqrt(score.error * score.rmse);
    return score;
}

static enum cranny_status draw_view(struct tune *tune, size_t number, struct cranny_error *why)
{
    const struct cranny_tune_view *view = &tune->problem->views[number];
    enum cranny_status status =
        tune->problem->draw(tune->problem->user, number, tune->params, tune->picture, why);
    if (status == CRANNY_OK)
        status = cranny_difference_measure(view->width, view->height, tune->picture, 0, view->truth,
                                           0, &tune->drawn[number], why);
    if (status == CRANNY_OK && !hook_progress(tune->hooks, tune->stage, ++tune->done, tune->total))
        status = fail(why, CRANNY_CANCELLED, "fit: cancelled");
    return status;
}

static enum cranny_status draw_set(struct tune *tune, bool held_out, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (size_t v = 0; v < tune->problem->view_count && status == CRANNY_OK; v++)
        if (tune->problem->views[v].held_out == held_out)
            status = draw_view(tune, v, why);
    return status;
}

/* "intensity 1.2, bias 0.0002" */
static void describe(const struct tune *tune, char *text, size_t size)
{
    size_t used = 0;
    text[0] = 0;
    for (size_t i = 0; i < tune->row_count && used < size; i++) {
        char value[64];
        cranny_params_get(tune->problem->table, tune->params, tune->rows[i]->name, value,
                          sizeof value);
        used += (size_t)snprintf(text + used, size - used, "%s%s %s", i ? ", " : "",
                                 tune->rows[i]->name, value);
    }
}

static void log_trial(struct tune *tune, const struct cranny_tune_score *score)
{
    const bool better = !(score->cost >= tune->best_cost);
    char text[512];
    if (better)
        tune->best_cost = score->cost;
    describe(tune, text, sizeof text);
    hook_log(tune->hooks, better ? CRANNY_LOG_INFO : CRANNY_LOG_DEBUG,
             "fit %d: cost %.5f, error %.4f, rmse %.5f, mean %+.4f: %s%s", tune->tried, score->cost,
             score->error, score->rmse, score->mean, text, better ? " (best so far)" : "");
}

static void set_values(struct tune *tune, const double *values)
{
    for (size_t i = 0; i < tune->row_count; i++)
        param_store(tune->rows[i], tune->params, values[i]);
}

static enum cranny_status cost_of(void *user, const double *values, double *cost,
                                  struct cranny_error *why)
{
    struct tune *tune = user;
    set_values(tune, values);
    const enum cranny_status status = draw_set(tune, false, why);
    if (status != CRANNY_OK)
        return status;
    const struct cranny_tune_score score = score_of(tune, false);
    tune->tried++;
    log_trial(tune, &score);
    *cost = score.cost;
    return CRANNY_OK;
}

static enum cranny_status check_view(const struct cranny_tune_view *view, size_t number,
                                     struct cranny_error *why)
{
    if (view->width < 1 || view->height < 1 || view->width > SIDE_MAX || view->height > SIDE_MAX)
        return fail(why, CRANNY_USAGE, "fit: view %zu: %d x %d pixels; sides must lie in [1, %d]",
                    number, view->width, view->height, SIDE_MAX);
    if (!view->truth)
        return fail(why, CRANNY_USAGE, "fit: view %zu: has no truth", number);
    if (!(view->weight > 0) || !isfinite(view->weight))
        return fail(why, CRANNY_USAGE, "fit: view %zu: a weight of %g; it must be above 0", number,
                    view->weight);
    return CRANNY_OK;
}

static enum cranny_status check_problem(const struct cranny_tune_problem *problem,
                                        const struct cranny_tune_params *params,
                                        struct cranny_error *why)
{
    size_t fitted = 0;
    if (params->evaluations < 1 || params->evaluations > EVALUATIONS_MAX)
        return fail(why, CRANNY_USAGE, "fit: %d evaluations; it must lie in [1, %d]",
                    params->evaluations, EVALUATIONS_MAX);
    if (!problem->table || !problem->params || !problem->draw || !problem->views)
        return fail(why, CRANNY_USAGE, "fit: needs a table, parameters, views and who draws them");
    for (size_t v = 0; v < problem->view_count; v++) {
        const enum cranny_status status = check_view(&problem->views[v], v, why);
        if (status != CRANNY_OK)
            return status;
        fitted += !problem->views[v].held_out;
    }
    if (!fitted)
        return fail(why, CRANNY_USAGE, "fit: no view to fit to: all are held out");
    return cranny_params_validate(problem->table, problem->params, why);
}

static enum cranny_status add_row(struct tune *tune, const struct cranny_param *row,
                                  struct cranny_error *why)
{
    for (size_t i = 0; i < tune->row_count; i++)
        if (tune->rows[i] == row)
            return fail(why, CRANNY_USAGE, "%s: named twice among what is fitted", row->name);
    if (isnan(param_load(row, tune->problem->params)))
        return fail(why, CRANNY_USAGE, "%s: has no value for the fit to begin with; set one",
                    row->name);
    tune->rows[tune->row_count++] = row;
    return CRANNY_OK;
}

static enum cranny_status choose_rows(struct tune *tune, struct cranny_error *why)
{
    const struct cranny_tune_problem *problem = tune->problem;
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; i < problem->table->row_count && !problem->names; i++)
        if (problem->table->rows[i].step > 0 && status == CRANNY_OK)
            status = add_row(tune, &problem->table->rows[i], why);
    for (size_t i = 0; problem->names && i < problem->name_count && status == CRANNY_OK; i++) {
        const struct cranny_param *row = param_find(problem->table, problem->names[i]);
        status = row ? add_row(tune, row, why)
                     : fail(why, CRANNY_USAGE, "%s: no such parameter of '%s'", problem->names[i],
                            problem->table->name);
    }
    return status;
}

static enum cranny_status make_room(struct tune *tune, struct cranny_error *why)
{
    const struct cranny_tune_problem *problem = tune->problem;
    size_t pixels = 0;
    for (size_t v = 0; v < problem->view_count; v++) {
        const size_t own = (size_t)problem->views[v].width * (size_t)problem->views[v].height;
        pixels = own > pixels ? own : pixels;
    }
    tune->rows = alloc_array(problem->table->row_count, sizeof *tune->rows);
    tune->params = alloc_array(1, problem->params_size);
    tune->drawn = alloc_array(problem->view_count, sizeof *tune->drawn);
    tune->picture = alloc_array(pixels, sizeof *tune->picture);
    if (!tune->rows || !tune->params || !tune->drawn || !tune->picture)
        return fail_memory(why, "fit");
    memcpy(tune->params, problem->params, problem->params_size);
    return choose_rows(tune, why);
}

static size_t count_views(const struct tune *tune, bool held_out)
{
    size_t count = 0;
    for (size_t v = 0; v < tune->problem->view_count; v++)
        count += tune->problem->views[v].held_out == held_out;
    return count;
}

static void begin_stage(struct tune *tune, const char *stage, double total)
{
    tune->stage = stage;
    tune->done = 0;
    tune->total = total;
}

/* Every view as `params` are; `when`: 0 before, 1 after. */
static enum cranny_status judge(struct tune *tune, int when, struct cranny_tune_score *held,
                                struct cranny_tune_score *fit, struct cranny_tune_change *changes,
                                struct cranny_error *why)
{
    const size_t views = tune->problem->view_count;
    begin_stage(tune, when ? "after" : "before", (double)views);
    enum cranny_status status = draw_set(tune, true, why);
    if (status == CRANNY_OK)
        status = draw_set(tune, false, why);
    *held = score_of(tune, true);
    *fit = score_of(tune, false);
    for (size_t v = 0; changes && v < views; v++)
        *(when ? &changes[v].after : &changes[v].before) = tune->drawn[v];
    return status;
}

static enum cranny_status search(struct tune *tune, int evaluations, double *values,
                                 struct cranny_tune_report *report, struct cranny_error *why)
{
    const struct search_task task = {tune->rows, tune->row_count, cost_of, tune,
                                     (size_t)evaluations};
    struct search_outcome outcome;
    for (size_t i = 0; i < tune->row_count; i++)
        values[i] = param_load(tune->rows[i], tune->problem->params);
    begin_stage(tune, "fit", (double)evaluations * (double)count_views(tune, false));
    tune->best_cost = INFINITY;
    const enum cranny_status status = search_minimum(&task, values, &outcome, why);
    report->evaluations = (int)outcome.evaluations;
    report->converged = outcome.converged;
    report->flat = outcome.flat;
    return status;
}

static void warn(const struct tune *tune, const struct cranny_tune_report *report)
{
    const double before = report->held_before.cost, after = report->held_after.cost;
    if (report->flat)
        hook_warn(tune->hooks, "fit: no parameter changes the error: the views show nothing that "
                               "it could be told by");
    if (after > before)
        hook_warn(tune->hooks,
                  "fit: the views held out got worse, cost %.4f before and %.4f after: fit fewer "
                  "parameters, or to more views",
                  before, after);
}

static enum cranny_status run(struct tune *tune, int evaluations, struct cranny_tune_report *report,
                              struct cranny_tune_change *changes, struct cranny_error *why)
{
    double *values = alloc_array(tune->row_count, sizeof *values);
    enum cranny_status status = values ? CRANNY_OK : fail_memory(why, "fit");
    if (status == CRANNY_OK)
        status = judge(tune, 0, &report->held_before, &report->fit_before, changes, why);
    if (status == CRANNY_OK)
        status = search(tune, evaluations, values, report, why);
    if (status == CRANNY_OK) {
        set_values(tune, values);
        status = judge(tune, 1, &report->held_after, &report->fit_after, changes, why);
    }
    free(values);
    return status;
}

enum cranny_status cranny_tune(const struct cranny_tune_problem *problem,
                               const struct cranny_tune_params *params, void *fitted,
                               struct cranny_tune_report *report,
                               struct cranny_tune_change *changes, struct cranny_error *why)
{
    const struct cranny_tune_params defaults = cranny_tune_params_default();
    params = params ? params : &defaults;
    struct tune tune = {.problem = problem, .hooks = params->hooks};
    struct cranny_tune_report own;
    report = report ? report : &own;
    *report = (struct cranny_tune_report){0};
    enum cranny_status status = check_problem(problem, params, why);
    if (status == CRANNY_OK)
        status = make_room(&tune, why);
    if (status == CRANNY_OK)
        status = run(&tune, params->evaluations, report, changes, why);
    if (status == CRANNY_OK) {
        warn(&tune, report);
        memcpy(fitted, tune.params, problem->params_size);
    }
    free(tune.rows);
    free(tune.params);
    free(tune.drawn);
    free(tune.picture);
    return status;
}
