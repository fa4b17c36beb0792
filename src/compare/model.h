/* A quadratic model of a cost around a point, and where it is lowest within a box. */
#ifndef COMPARE_MODEL_H
#define COMPARE_MODEL_H

#include <stdbool.h>
#include <stddef.h>

/* f(d) = g·d + ½ dᵀ H d. Arrays of the caller. */
struct model {
    size_t count;
    double *slope;  /* g */
    double *bend;   /* H, count × count, symmetric */
    double *factor; /* count × count, to work with */
    double *step;   /* d: the outcome */
    bool *held;     /* to work with: at the box */
};

/* Slope and bend along a line by its values over the middle's at two places that are not 0. */
void model_line(double p, double over_p, double q, double over_q, double *slope, double *bend);

/* Fill `step` with the lowest place of the box [low, high], which holds 0; near to it where rows
 * meet the box. A model that bends downwards is made steeper until it has one. */
void model_minimum(const struct model *model, const double *low, const double *high);

#endif
