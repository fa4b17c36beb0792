#include "compare/search.h"

#define FIRST_STEP 1.0      /* in steps of the rows */
#define LAST_STEP 0.05      /* the grid on which reals lie */
#define DOUBLINGS 6         /* along a line, while it goes down */
#define ENOUGH 1e-3         /* a round that gains less than this share is followed by finer ones */
#define STEPLESS_SHARE 0.25 /* step of rows without one, as a share of the value */

struct search {
    const struct search_task *task;
    struct cranny_error *why;
    enum cranny_status status; /* of the cost; the search ends when it is no success */
    double *steps;             /* per row: a unit of the search; 0: choices */
    double *best, best_cost;
    double *begin;              /* of the round */
    double *origin, *direction; /* of the line, in values */
    double *tried;
    double *known; /* values and cost of everything tried */
    size_t known_count;
    bool full, varied;
};

static bool is_choice(const struct cranny_param *row)
{
    return row->type == CRANNY_PARAM_BOOL || row->type == CRANNY_PARAM_ENUM;
}

static double step_of(const struct cranny_param *row, double value)
{
    const double range = row->maximum - row->minimum;
    double step = row->step;
    if (is_choice(row))
        return 0;
    if (!(step > 0))
        step = value != 0 ? STEPLESS_SHARE * fabs(value) : 0.01 * range;
    step = fmin(step, range);
    return row->type == CRANNY_PARAM_INT ? fmax(1, floor(step + 0.5)) : step;
}

static double bounded(const struct cranny_param *row, double value)
{
    return fmin(fmax(value, row->minimum), row->maximum);
}

/* On the grid of the row, within its range, and as the field holds it. */
static double snapped(const struct cranny_param *row, double step, double value)
{
    const double grid = row->type == CRANNY_PARAM_INT ? 1 : step * LAST_STEP;
    value = bounded(row, floor(value / grid + 0.5) * grid);
    return row->type == CRANNY_PARAM_FLOAT ? (double)(float)value : value;
}

static size_t row_bytes(const struct search *search)
{
    return search->task->row_count * sizeof(double);
}

static const double *entry(const struct search *search, size_t number)
{
    return search->known + number * (search->task->row_count + 1);
}

/* The cost of `tried`, which becomes `best` when it is lower; INFINITY when there is none left to
 * ask for. */
static double ask(struct search *search)
{
    const size_t rows = search->task->row_count;
    double cost;
    for (size_t i = 0; i < search->known_count; i++)
        if (memcmp(entry(search, i), search->tried, row_bytes(search)) == 0)
            return entry(search, i)[rows];
    search->full |= search->known_count == search->task->evaluations;
    if (search->full || search->status != CRANNY_OK)
        return INFINITY;
    search->status = search->task->cost(search->task->user, search->tried, &cost, search->why);
    if (search->status != CRANNY_OK)
        return INFINITY;
    double *kept = search->known + search->known_count++ * (rows + 1);
    memcpy(kept, search->tried, row_bytes(search));
    kept[rows] = cost;
    search->varied |= cost != search->known[rows];
    if (cost < search->best_cost) {
        memcpy(search->best, search->tried, row_bytes(search));
        search->best_cost = cost;
    }
    return cost;
}

/* How far along the line the ranges allow. */
static double reach_of(const struct search *search, double side)
{
    double reach = INFINITY;
    for (size_t i = 0; i < search->task->row_count; i++) {
        const struct cranny_param *row = search->task->rows[i];
        const double speed = side * search->direction[i];
        const double end = speed > 0 ? row->maximum : row->minimum;
        if (speed != 0)
            reach = fmin(reach, (end - search->origin[i]) / speed);
    }
    return fmax(0, reach);
}

/* The cost at `t` along the line. */
static double ask_at(struct search *search, double t)
{
    for (size_t i = 0; i < search->task->row_count; i++) {
        const struct cranny_param *row = search->task->rows[i];
        const double value = search->origin[i] + t * search->direction[i];
        search->tried[i] =
            search->direction[i] == 0 ? search->origin[i] : snapped(row, search->steps[i], value);
    }
    return ask(search);
}

struct point {
    double t, cost;
};

/* Where a parabola through three points is lowest, the middle one being the lowest of them. */
static double valley(struct point a, struct point b, struct point c)
{
    const double left = (b.t - a.t) * (b.cost - c.cost), right = (b.t - c.t) * (b.cost - a.cost);
    const double bend = left - right;
    if (!isfinite(bend) || bend == 0)
        return b.t;
    return b.t - 0.5 * ((b.t - a.t) * left - (b.t - c.t) * right) / bend;
}

/* Down one side of the line as long as it goes down, then the parabola. True when it went; else
 * `beyond` is the point that is no better. */
static bool descend(struct search *search, double side, double h, struct point *beyond)
{
    const double reach = reach_of(search, side);
    struct point last, middle = {0, search->best_cost};
    bool went = false;
    for (int i = 0; i < DOUBLINGS; i++, h *= 2) {
        struct point next = {side * fmin(side * middle.t + h, reach), 0};
        next.cost = ask_at(search, next.t);
        if (!(next.cost < middle.cost)) {
            *beyond = next;
            if (went && next.t != middle.t)
                ask_at(search, valley(last, middle, next));
            return went;
        }
        went = true;
        last = middle;
        middle = next;
    }
    return went;
}

/* The best place on the line through `best`, looked for `h` away from it and farther. */
static void search_line(struct search *search, double h)
{
    const struct point middle = {0, search->best_cost};
    struct point up, down;
    memcpy(search->origin, search->best, row_bytes(search));
    if (descend(search, 1, h, &up) || descend(search, -1, h, &down))
        return;
    if (up.t > 0 && down.t < 0)
        ask_at(search, valley(down, middle, up));
}

static void try_choices(struct search *search, size_t row)
{
    for (double value = search->task->rows[row]->minimum; value <= search->task->rows[row]->maximum;
         value++) {
        memcpy(search->tried, search->best, row_bytes(search));
        search->tried[row] = value;
        ask(search);
    }
}

/* Every row, then all of them the way they went together. */
static void search_round(struct search *search, double h)
{
    const size_t rows = search->task->row_count;
    memcpy(search->begin, search->best, row_bytes(search));
    for (size_t i = 0; i < rows; i++) {
        memset(search->direction, 0, row_bytes(search));
        search->direction[i] = search->steps[i];
        if (search->steps[i] > 0)
            search_line(search, h);
        else
            try_choices(search, i);
    }
    size_t moved = 0;
    for (size_t i = 0; i < rows; i++) {
        const bool real = search->steps[i] > 0;
        search->direction[i] = real ? search->best[i] - search->begin[i] : 0;
        moved += search->direction[i] != 0;
    }
    if (moved > 1)
        search_line(search, 1);
}

static void search_all(struct search *search)
{
    double h = FIRST_STEP;
    while (h >= LAST_STEP && !search->full && search->status == CRANNY_OK) {
        const double before = search->best_cost;
        search_round(search, h);
        if (before - search->best_cost <= ENOUGH * before)
            h /= 2;
    }
}

static enum cranny_status make_room(struct search *search, double **memory,
                                    struct cranny_error *why)
{
    const size_t rows = search->task->row_count;
    double *block = *memory = alloc_array(5 * (rows + 1), sizeof *block);
    search->known = alloc_array(search->task->evaluations, (rows + 1) * sizeof *search->known);
    if (!block || !search->known)
        return fail_memory(why, "fit");
    search->steps = block;
    search->begin = block + (rows + 1);
    search->origin = block + 2 * (rows + 1);
    search->direction = block + 3 * (rows + 1);
    search->tried = block + 4 * (rows + 1);
    return CRANNY_OK;
}

enum cranny_status search_minimum(const struct search_task *task, double *values,
                                  struct search_outcome *outcome, struct cranny_error *why)
{
    struct search search = {.task = task, .why = why, .best = values, .best_cost = INFINITY};
    double *memory;
    search.status = make_room(&search, &memory, why);
    if (search.status == CRANNY_OK) {
        for (size_t i = 0; i < task->row_count; i++)
            search.steps[i] = step_of(task->rows[i], values[i]);
        memcpy(search.tried, values, row_bytes(&search));
        outcome->first_cost = ask(&search);
    }
    if (search.status == CRANNY_OK && task->row_count)
        search_all(&search);
    outcome->cost = search.best_cost;
    outcome->evaluations = search.known_count;
    outcome->converged = !search.full;
    outcome->flat = !search.varied && search.known_count > 1;
    free(memory);
    free(search.known);
    return search.status;
}
