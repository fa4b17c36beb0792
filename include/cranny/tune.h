/* Fitting a method's parameters to the truth, over several views; others, held out, judge. */
#ifndef CRANNY_TUNE_H
#define CRANNY_TUNE_H

#include <cranny/compare.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A view and its truth. */
struct cranny_tune_view {
    int width, height;  /* 1 to 16384 */
    const float *truth; /* visibility, width × height, tight rows; NaN counts as 0 */
    double weight;      /* of the view among those of its set, > 0 */
    bool held_out;      /* it judges, and has no part in the fit */
};

/* Draw a view by the method with `params`: visibility, width × height floats, tight rows. Called
 * from the thread that called cranny_tune. The same parameters must give the same picture; then the
 * outcome is the same, too. A status other than CRANNY_OK ends the fit with that status. */
typedef enum cranny_status cranny_tune_draw(void *user, size_t view, const void *params,
                                            float *visibility, struct cranny_error *why);

/* What is to be fitted to what. Pointers must live during the call. */
struct cranny_tune_problem {
    const struct cranny_param_table *table;
    size_t params_size;       /* of the struct whose offsets the rows hold, bytes */
    const void *params;       /* to begin with: what is not fitted stays as it is here */
    const char *const *names; /* of the rows to fit, name_count; NULL: those with a step */
    size_t name_count;
    const struct cranny_tune_view *views; /* at least one is not held out */
    size_t view_count;
    cranny_tune_draw *draw;
    void *user;
};

/* How long to search. */
struct cranny_tune_params {
    int evaluations; /* sets of parameters to try at most, each on all views of the fit; 1 to
                        100000, default 300. 1: only what there is to begin with */
    const struct cranny_hooks *hooks; /* stages "before", "fit" (to `evaluations`, if it takes them
                                         all) and "after", counting views drawn; each better set
                                         goes to the log as info, others as debug; may be NULL */
};
CRANNY_API struct cranny_tune_params cranny_tune_params_default(void);

/* Weighted means over a set of views. */
struct cranny_tune_score {
    double cost; /* √(error × rmse): a percent less of either is worth the same. It is what the fit
                    lowers: eq. 31 alone prefers pictures that are too bright */
    double error; /* eq. 31 */
    double rmse;  /* of visibility */
    double mean;  /* of picture − truth: below 0 is too dark */
};

/* A view before the fit and after it. */
struct cranny_tune_change {
    struct cranny_difference before, after;
};

/* What came of it. */
struct cranny_tune_report {
    struct cranny_tune_score fit_before, fit_after;
    struct cranny_tune_score held_before, held_after; /* zeros when no view is held out */
    int evaluations;                                  /* sets of parameters tried */
    bool converged; /* no neighbour is better; false: `evaluations` were used up */
    bool flat;      /* every set that was tried costs the same: the views say nothing */
};

/* Search parameters that lower the cost of the views that are not held out: by lines along the
 * rows, first in steps of their `step` (a quarter of the value, for rows without one), then in
 * halves of it down to a thirtieth; each round of lines turns the next one's into the way that it
 * went. Whole numbers move by whole numbers, choices and switches are tried one by one. No field
 * leaves its row's range; reals end as multiples of a hundredth of their step.
 *
 * `fitted`: params_size bytes, filled with problem->params and the best values found; may be
 * problem->params itself. `changes`: NULL, or view_count of them, in the order of the views.
 * A warning is logged when the views held out got worse, which is the sign of too few views for so
 * many parameters. Unspecified outputs on failure.
 * CRANNY_USAGE for names that are not in the table, are given twice or have no value to begin with,
 * and for counts or sizes that make no sense; CRANNY_MEMORY, CRANNY_CANCELLED, or what `draw` gave.
 */
CRANNY_API enum cranny_status cranny_tune(const struct cranny_tune_problem *problem,
                                          const struct cranny_tune_params *params, void *fitted,
                                          struct cranny_tune_report *report,
                                          struct cranny_tune_change *changes,
                                          struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
