/* The least-squares fit: (M + αR) x = b over the vertices of one surface, for two signals at once.
 *
 * Based on: Kavan, Bargteil, Sloan, Least Squares Vertex Baking, 2011; Sloan, Tranchida, Chen,
 * Kavan, Ambient Obscurance Baking on the GPU, 2013 (eq. 2). */
#ifndef BAKE_LSQ_H
#define BAKE_LSQ_H

#include "bake/surface.h"
#include "base/watch.h"

/* What the samples of one triangle add to M and b: entries 00, 11, 22, 01, 12, 20 of its 3×3 block
 * and, per signal, the corners' right-hand sides. */
struct lsq_term {
    double m[6];
    double b[2][3];
    double count; /* of samples */
};

/* One sample: weight (m²), barycentrics, the signals' values. */
static inline void lsq_add(struct lsq_term *term, double weight, const double l[3],
                           const double f[2])
{
    term->count += 1;
    for (int c = 0; c < 3; c++) {
        const double wl = weight * l[c];
        term->m[c] += wl * l[c];
        term->m[3 + c] += wl * l[(c + 1) % 3];
        term->b[0][c] += wl * f[0];
        term->b[1][c] += wl * f[1];
    }
}

struct lsq_params {
    double alpha;
    double ridge; /* pull toward the prior, times the mean lumped mass; keeps empty rows regular */
    double pull;  /* of every vertex toward its prior, in samples' worth; 0: pure eq. 2 */
    double tolerance; /* rms of a last Jacobi step, in units of the signal */
    int iterations_max;
    int threads;
    const float *smooth; /* per unknown: factor of α, the same within a connected piece; NULL: 1 */
    struct watch *watch; /* asked at every iteration; NULL: nobody */
    bool retunable;      /* keep R apart, for lsq_retune */
};

struct lsq_params lsq_params_default(void);

/* Rows of the matrix in pieces of LSQ_CHUNK, each its own CSR. */
#define LSQ_CHUNK 2048
struct lsq_chunk {
    uint32_t *start; /* rows of the piece + 1 */
    uint32_t *column;
    double *value;
    double *rough; /* R's part of value / α; NULL unless retunable */
};

struct lsq_system {
    uint32_t count;
    size_t chunk_count;
    struct lsq_chunk *chunks;
    double *diagonal;
    double (*right)[2];
    uint64_t entry_count;
    double alpha;
    bool borrowed; /* all but values and diagonal belong to the system it was retuned from */
};

/* Build the matrix and right-hand sides; `prior`: unknown_count × 2. */
enum cranny_status lsq_build(const struct surface *surface, const struct lsq_term *terms,
                             const double (*prior)[2], const struct lsq_params *params,
                             struct lsq_system *system, struct cranny_error *why);
/* The same system with another α; the original must be retunable and outlive it. */
enum cranny_status lsq_retune(const struct lsq_system *system, double alpha,
                              struct lsq_system *other, struct cranny_error *why);
void lsq_free(struct lsq_system *system);

struct lsq_outcome {
    int iterations;
    double residual; /* as `tolerance` measures it */
    bool converged;
};

/* Jacobi-preconditioned conjugate gradients from the values in `x`. Dot products are summed per
 * chunk, then over chunks, so that the bits do not depend on the threads. */
enum cranny_status lsq_solve(const struct lsq_system *system, const struct lsq_params *params,
                             double (*x)[2], struct lsq_outcome *outcome, struct cranny_error *why);

/* Coefficients of the jump across the edge p0–p1 with apexes p2 and p3, unfolded into one plane;
 * false for degenerate pairs. */
bool lsq_edge(const double p0[3], const double p1[3], const double p2[3], const double p3[3],
              double r[4]);

#endif
