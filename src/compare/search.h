/* A derivative-free minimum of a cost over the rows of a parameter table.
 *
 * Based on: Hooke, Jeeves, "Direct Search" Solution of Numerical and Statistical Problems, 1961.
 * Departures: a parabola through the best three points of each line, and the pattern move is a line
 * of its own; both save evaluations on a cost that is smooth. */
#ifndef COMPARE_SEARCH_H
#define COMPARE_SEARCH_H

#include "base/base.h"

/* The cost of the fields' values, in the rows' order; may be the same as another's. */
typedef enum cranny_status search_cost(void *user, const double *values, double *cost,
                                       struct cranny_error *why);

struct search_task {
    const struct cranny_param *const *rows;
    size_t row_count;
    search_cost *cost;
    void *user;
    size_t evaluations; /* at most, from 1 */
};

struct search_outcome {
    double first_cost, cost;
    size_t evaluations;
    bool converged, flat;
};

/* `values`: where to begin, and the best found. Bounded by the rows' ranges; the same values are
 * never asked for twice. Stops with the first status of `cost` that is no success. */
enum cranny_status search_minimum(const struct search_task *task, double *values,
                                  struct search_outcome *outcome, struct cranny_error *why);

#endif
