/* How strongly to smooth each connected piece of a surface, found by hold-out.
 *
 * A departure from eq. 2, whose α is one number for everything: the best α differs by a thousand
 * times between a finely meshed curtain, where it removes noise, and a coarse wall, where it
 * removes the signal. docs/decisions.md has the figures. */
#ifndef BAKE_TUNE_H
#define BAKE_TUNE_H

#include "bake/lsq.h"

/* What the samples that were left out say of a fit, per triangle. */
struct tune_score {
    double squares; /* Σ w (f − g)² */
    double count;   /* of samples */
};

/* Fill scores[triangle_count] for the fit `x`; called from several threads at once. */
typedef void tune_score_fn(void *user, const double (*x)[2], struct tune_score *scores);

/* Fit with several α to `terms` (of one half of the samples), let `score` judge each by the other
 * half, and write the factor of α that suits each unknown's piece to smooth[unknown_count].
 * `prior`: where the fits start. Pieces with few samples are judged together. */
enum cranny_status tune_smoothness(const struct surface *surface, const struct lsq_term *terms,
                                   const struct lsq_params *params, const double (*prior)[2],
                                   tune_score_fn *score, void *user, float *smooth,
                                   struct cranny_error *why);

#endif
