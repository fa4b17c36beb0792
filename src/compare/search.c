#include "compare/search.h"

#include "compare/model.h"

#define FIRST_STEP 1.0 /* in steps of the rows */
#define LAST_STEP 0.1
#define GRID 0.01           /* on which reals lie, in steps of the rows */
#define TRUST 4.0           /* how far the model is believed, in steps of its cross */
#define DOUBLINGS 6         /* of a move that pays */
#define ENOUGH 2e-3         /* a round that gains less than this share is followed by finer ones */
#define STEPLESS_SHARE 0.25 /* step of rows without one, as a share of the value */

struct search {
    const struct search_task *task;
    struct cranny_error *why;
    enum cranny_status status; /* of the cost; the search ends when it is no success */
    double *steps;             /* per row: a unit of the search; 0: choices */
    double *best, best_cost;
    double *origin, origin_cost; /* of the round */
    double *tried;
    double *known; /* values and cost of everything tried */
    size_t known_count;
    bool full, varied;
    size_t *reals; /* rows of the model */
    struct model model;
    double *places, *costs; /* two of each real's line: offsets from the origin in steps, and the
                               cost over the origin's */
    double *low, *high;     /* how far each real may go, in steps */
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

/* Within the row's range, on its grid, and as the field holds it. */
static double snapped(const struct cranny_param *row, double step, double value)
{
    const double grid = row->type == CRANNY_PARAM_INT ? 1 : step * GRID;
    value = fmin(fmax(floor(value / grid + 0.5) * grid, row->minimum), row->maximum);
    return row->type == CRANNY_PARAM_FLOAT ? (double)(float)value : value;
}

static size_t row_bytes(const struct search *search)
{
    return search->task->row_count * sizeof(double);
}

static double *entry(const struct search *search, size_t number)
{
    return search->known + number * (search->task->row_count + 1);
}

/* The cost of `tried`, which becomes `best` when it is lower; INFINITY when no more may be asked
 * for. */
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
    double *kept = entry(search, search->known_count++);
    memcpy(kept, search->tried, row_bytes(search));
    kept[rows] = cost;
    search->varied |= cost != entry(search, 0)[rows];
    if (cost < search->best_cost) {
        memcpy(search->best, search->tried, row_bytes(search));
        search->best_cost = cost;
    }
    return cost;
}

static bool goes_on(const struct search *search)
{
    return !search->full && search->status == CRANNY_OK;
}

static void begin_at_best(struct search *search)
{
    memcpy(search->origin, search->best, row_bytes(search));
    memcpy(search->tried, search->best, row_bytes(search));
    search->origin_cost = search->best_cost;
}

static void try_choices(struct search *search, size_t row)
{
    const struct cranny_param *own = search->task->rows[row];
    for (double value = own->minimum; value <= own->maximum; value++) {
        begin_at_best(search);
        search->tried[row] = value;
        ask(search);
    }
}

/* A whole number, up or else down, and on as long as that pays. */
static void try_numbers(struct search *search, size_t row, double h)
{
    const struct cranny_param *own = search->task->rows[row];
    const double before = search->best_cost;
    for (int side = 1; side >= -1 && search->best_cost == before; side -= 2) {
        double last = INFINITY, move = fmax(1, h * search->steps[row]);
        for (int i = 0; i < DOUBLINGS && search->best_cost < last; i++, move *= 2) {
            last = search->best_cost;
            begin_at_best(search);
            search->tried[row] = snapped(own, 1, search->origin[row] + side * move);
            ask(search);
        }
    }
}

/* Put a real of `tried` to an offset from the origin; the offset that it really has. */
static double place(struct search *search, size_t real, double offset)
{
    const size_t row = search->reals[real];
    const double step = search->steps[row];
    search->tried[row] =
        snapped(search->task->rows[row], step, search->origin[row] + offset * step);
    return (search->tried[row] - search->origin[row]) / step;
}

static double over_origin(struct search *search)
{
    return ask(search) - search->origin_cost;
}

/* Both sides of the origin, or two places inwards where it lies on its range's end. */
static void ask_line(struct search *search, size_t real, double h)
{
    for (int side = 0; side < 2; side++) {
        const double offset = side ? -h : h;
        double at = place(search, real, offset);
        if (fabs(at) < 0.25 * h)
            at = place(search, real, -2 * offset);
        search->places[2 * real + side] = at;
        search->costs[2 * real + side] = at != 0 ? over_origin(search) : 0;
        place(search, real, 0);
    }
}

/* The second derivative by two reals, from the corner of their better places. */
static void ask_pair(struct search *search, size_t a, size_t b)
{
    const struct model *m = &search->model;
    const double *costs = search->costs;
    const double at_a = search->places[2 * a + (costs[2 * a + 1] < costs[2 * a])];
    const double at_b = search->places[2 * b + (costs[2 * b + 1] < costs[2 * b])];
    const double p = place(search, a, at_a), q = place(search, b, at_b);
    double bend = 0;
    if (p != 0 && q != 0)
        bend = (over_origin(search) - m->slope[a] * p - m->slope[b] * q -
                0.5 * (m->bend[a * m->count + a] * p * p + m->bend[b * m->count + b] * q * q)) /
               (p * q);
    m->bend[a * m->count + b] = m->bend[b * m->count + a] = bend;
    place(search, a, 0);
    place(search, b, 0);
}

static void make_model(struct search *search, double h)
{
    const struct model *m = &search->model;
    begin_at_best(search);
    for (size_t a = 0; a < m->count; a++) {
        const double *at = search->places + 2 * a, *cost = search->costs + 2 * a;
        ask_line(search, a, h);
        m->slope[a] = m->bend[a * m->count + a] = 0;
        if (at[0] != 0 && at[1] != 0 && at[0] != at[1])
            model_line(at[0], cost[0], at[1], cost[1], &m->slope[a], &m->bend[a * m->count + a]);
        const struct cranny_param *row = search->task->rows[search->reals[a]];
        const double step = search->steps[search->reals[a]];
        const double value = search->origin[search->reals[a]];
        search->low[a] = fmax(-TRUST * h, (row->minimum - value) / step);
        search->high[a] = fmin(TRUST * h, (row->maximum - value) / step);
    }
    for (size_t a = 0; a < m->count; a++)
        for (size_t b = 0; b < a; b++)
            ask_pair(search, a, b);
}

/* To the model's lowest place, and on while that pays. */
static void follow_model(struct search *search)
{
    double last = INFINITY;
    model_minimum(&search->model, search->low, search->high);
    for (int i = 0; i < DOUBLINGS && goes_on(search); i++) {
        for (size_t a = 0; a < search->model.count; a++)
            place(search, a, ldexp(search->model.step[a], i));
        const double cost = ask(search);
        if (!(cost < last))
            return;
        last = cost;
    }
}

static void search_round(struct search *search, double h)
{
    for (size_t i = 0; i < search->task->row_count; i++)
        if (is_choice(search->task->rows[i]))
            try_choices(search, i);
        else if (search->task->rows[i]->type == CRANNY_PARAM_INT)
            try_numbers(search, i, h);
    if (!search->model.count)
        return;
    make_model(search, h);
    if (goes_on(search))
        follow_model(search);
}

static void search_all(struct search *search)
{
    for (double h = FIRST_STEP; h >= LAST_STEP && goes_on(search);) {
        const double before = search->best_cost;
        search_round(search, h);
        if (before - search->best_cost <= ENOUGH * before)
            h /= 2;
    }
}

/* One block of doubles, cut up. */
static enum cranny_status make_room(struct search *search, double **memory,
                                    struct cranny_error *why)
{
    const size_t n = search->task->row_count + 1;
    double *block = *memory = alloc_array(11 * n + 2 * n * n, sizeof *block);
    search->known = alloc_array(search->task->evaluations, n * sizeof *search->known);
    search->reals = alloc_array(n, sizeof *search->reals);
    search->model.held = alloc_array(n, sizeof *search->model.held);
    if (!block || !search->known || !search->reals || !search->model.held)
        return fail_memory(why, "fit");
    double **const parts[] = {&search->steps,     &search->origin, &search->tried,
                              &search->low,       &search->high,   &search->model.slope,
                              &search->model.step};
    for (size_t i = 0; i < COUNT_OF(parts); i++, block += n)
        *parts[i] = block;
    search->places = block;
    search->costs = block + 2 * n;
    search->model.bend = block + 4 * n;
    search->model.factor = block + 4 * n + n * n;
    return CRANNY_OK;
}

static void set_out(struct search *search)
{
    for (size_t i = 0; i < search->task->row_count; i++) {
        const struct cranny_param *row = search->task->rows[i];
        search->steps[i] = step_of(row, search->best[i]);
        if (row->type == CRANNY_PARAM_FLOAT && search->steps[i] > 0)
            search->reals[search->model.count++] = i;
    }
    memcpy(search->tried, search->best, row_bytes(search));
    ask(search);
}

enum cranny_status search_minimum(const struct search_task *task, double *values,
                                  struct search_outcome *outcome, struct cranny_error *why)
{
    struct search search = {.task = task, .why = why, .best = values, .best_cost = INFINITY};
    double *memory;
    search.status = make_room(&search, &memory, why);
    if (search.status == CRANNY_OK)
        set_out(&search);
    if (search.status == CRANNY_OK)
        search_all(&search);
    *outcome = (struct search_outcome){.cost = search.best_cost,
                                       .evaluations = search.known_count,
                                       .converged = !search.full,
                                       .flat = !search.varied && search.known_count > 1};
    free(memory);
    free(search.known);
    free(search.reals);
    free(search.model.held);
    return search.status;
}
