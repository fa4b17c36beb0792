/* A minimum of a cost over the rows of a parameter table, without derivatives.
 *
 * Based on: Powell, UOBYQA: unconstrained optimization by quadratic approximation, 2002. Costs of
 * rendering are smooth with long valleys, as where more intensity and less contrast are nearly the
 * same; a model that knows how parameters pull together crosses them in one step, where searches
 * along the rows (Hooke, Jeeves 1961; Rosenbrock 1960 was tried, too) creep.
 * Departures: the model is made anew in each round, from points on a cross and one a pair of rows;
 * ranges are kept; steps that pay are doubled. */
#ifndef COMPARE_SEARCH_H
#define COMPARE_SEARCH_H

#include "base/base.h"

/* The cost of the fields' values, in the rows' order. */
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
    double cost;
    size_t evaluations;
    bool converged, flat;
};

/* `values`: where to begin, and the best found. Bounded by the rows' ranges; the same values are
 * never asked for twice. Stops with the first status of `cost` that is no success. */
enum cranny_status search_minimum(const struct search_task *task, double *values,
                                  struct search_outcome *outcome, struct cranny_error *why);

#endif
