#include "bake/tune.h"

#include "bake/forest.h"

/* Factors of α that are tried; between them the best is interpolated. */
#define TRIES 4
static const double factors[TRIES] = {0.25, 2, 16, 128};
/* Pieces with fewer held-out samples than this are judged together. */
#define OWN_JUDGEMENT 48.0
/* The trial fits need not be exact. */
#define TRIAL_TOLERANCE 4e-4
#define TRIAL_ITERATIONS 150

struct judgement {
    double squares[TRIES];
    double count;
};

struct tuner {
    const struct surface *surface;
    uint32_t *piece_of; /* per unknown; first a forest of parents */
    uint32_t piece_count;
    struct judgement *pieces;
    tune_score_fn *score;
    void *user;
};

/* Roots are the smallest of their piece, so that one pass turns parents into numbers. */
static void label_pieces(struct tuner *tuner)
{
    const struct surface *surface = tuner->surface;
    uint32_t *parent = tuner->piece_of;
    for (uint32_t u = 0; u < surface->unknown_count; u++)
        parent[u] = u;
    for (uint32_t t = 0; t < surface->triangle_count; t++)
        for (int c = 0; c < 2 && surface->triangles[t][0] != SURFACE_NONE; c++)
            forest_join(parent, surface->triangles[t][c], surface->triangles[t][c + 1]);
    for (uint32_t u = 0; u < surface->unknown_count; u++)
        parent[u] = parent[u] == u ? tuner->piece_count++ : parent[parent[u]];
}

static void add_scores(const struct tuner *tuner, const struct tune_score *scores, int attempt)
{
    const struct surface *surface = tuner->surface;
    for (uint32_t t = 0; t < surface->triangle_count; t++) {
        if (surface->triangles[t][0] == SURFACE_NONE)
            continue;
        struct judgement *piece = &tuner->pieces[tuner->piece_of[surface->triangles[t][0]]];
        piece->squares[attempt] += scores[t].squares;
        if (attempt == 0)
            piece->count += scores[t].count;
    }
}

/* The factor at the least squares, by a parabola through the lowest try and its neighbours. */
static double best_factor(const struct judgement *judgement)
{
    const double *s = judgement->squares;
    int best = 0;
    for (int i = 1; i < TRIES; i++)
        if (s[i] < s[best])
            best = i;
    if (best == 0 || best == TRIES - 1)
        return factors[best];
    const double bend = s[best - 1] - 2 * s[best] + s[best + 1];
    const double shift = bend > 0 ? 0.5 * (s[best - 1] - s[best + 1]) / bend : 0;
    return factors[best] * pow(factors[best + 1] / factors[best], shift);
}

static void choose(const struct tuner *tuner, float *smooth)
{
    struct judgement small = {.count = 0};
    for (uint32_t p = 0; p < tuner->piece_count; p++)
        for (int i = 0; i < TRIES && tuner->pieces[p].count < OWN_JUDGEMENT; i++)
            small.squares[i] += tuner->pieces[p].squares[i];
    const double shared = best_factor(&small);
    for (uint32_t u = 0; u < tuner->surface->unknown_count; u++) {
        const struct judgement *piece = &tuner->pieces[tuner->piece_of[u]];
        smooth[u] = (float)(piece->count < OWN_JUDGEMENT ? shared : best_factor(piece));
    }
}

static enum cranny_status run_trial(const struct tuner *tuner, const struct lsq_system *system,
                                    const struct lsq_params *params, const double (*prior)[2],
                                    int attempt, struct cranny_error *why)
{
    const struct surface *surface = tuner->surface;
    struct lsq_system own = {0};
    struct lsq_outcome outcome;
    double(*x)[2] = alloc_array(surface->unknown_count, sizeof *x);
    struct tune_score *scores = alloc_array(surface->triangle_count, sizeof *scores);
    enum cranny_status status = x && scores ? CRANNY_OK : fail_memory(why, "least squares");
    if (status == CRANNY_OK)
        status = lsq_retune(system, params->alpha * factors[attempt], &own, why);
    if (status == CRANNY_OK) {
        memcpy(x, prior, surface->unknown_count * sizeof *x);
        status = lsq_solve(&own, params, x, &outcome, why);
    }
    if (status == CRANNY_OK) {
        tuner->score(tuner->user, (const double(*)[2])x, scores);
        add_scores(tuner, scores, attempt);
    }
    lsq_free(&own);
    free(scores);
    free(x);
    return status;
}

/* Side by side: each thread solves alone, without barriers. */
static enum cranny_status run_trials(const struct tuner *tuner, const struct lsq_system *system,
                                     const struct lsq_params *params, const double (*prior)[2],
                                     struct cranny_error *why)
{
    enum cranny_status statuses[TRIES];
    struct cranny_error errors[TRIES];
    struct lsq_params alone = *params;
    alone.threads = 1;
#pragma omp parallel for num_threads(params->threads) schedule(dynamic, 1) if (params->threads > 1)
    for (int i = 0; i < TRIES; i++)
        statuses[i] = run_trial(tuner, system, &alone, prior, TRIES - 1 - i, &errors[i]);
    for (int i = 0; i < TRIES; i++) {
        if (statuses[i] == CRANNY_OK)
            continue;
        if (why)
            *why = errors[i];
        return statuses[i];
    }
    return CRANNY_OK;
}

enum cranny_status tune_smoothness(const struct surface *surface, const struct lsq_term *terms,
                                   const struct lsq_params *params, const double (*prior)[2],
                                   tune_score_fn *score, void *user, float *smooth,
                                   struct cranny_error *why)
{
    struct lsq_params trial = *params;
    struct lsq_system system = {0};
    struct tuner tuner = {.surface = surface, .score = score, .user = user};
    trial.retunable = true;
    trial.smooth = NULL;
    trial.tolerance = TRIAL_TOLERANCE;
    trial.iterations_max = min_int(params->iterations_max, TRIAL_ITERATIONS);
    tuner.piece_of = alloc_array(surface->unknown_count, sizeof *tuner.piece_of);
    if (tuner.piece_of)
        label_pieces(&tuner);
    tuner.pieces = alloc_array(tuner.piece_count, sizeof *tuner.pieces);
    enum cranny_status status =
        tuner.piece_of && tuner.pieces ? CRANNY_OK : fail_memory(why, "least squares");
    if (status == CRANNY_OK)
        status = lsq_build(surface, terms, prior, &trial, &system, why);
    if (status == CRANNY_OK)
        status = run_trials(&tuner, &system, &trial, prior, why);
    if (status == CRANNY_OK)
        choose(&tuner, smooth);
    lsq_free(&system);
    free(tuner.piece_of);
    free(tuner.pieces);
    return status;
}
