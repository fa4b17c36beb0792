#include "bake/lsq.h"

/* Both signals side by side, as the matrix pass wants them. */
typedef double pair[2];

struct solver {
    const struct lsq_system *system;
    int threads;
    pair *x, *residual, *direction, *product;
    pair *partial; /* per chunk */
};

static uint32_t chunk_rows(const struct lsq_system *system, size_t chunk)
{
    const size_t left = system->count - chunk * LSQ_CHUNK;
    return (uint32_t)(left < LSQ_CHUNK ? left : LSQ_CHUNK);
}

/* out = A in for the chunk's rows; adds up in · out. */
static void multiply_chunk(const struct lsq_system *system, size_t index, const pair *in, pair *out,
                           pair sum)
{
    const struct lsq_chunk *chunk = &system->chunks[index];
    const uint32_t rows = chunk_rows(system, index);
    const size_t first = index * LSQ_CHUNK;
    sum[0] = sum[1] = 0;
    for (uint32_t i = 0; i < rows; i++) {
        double a = 0, b = 0;
        for (uint32_t e = chunk->start[i]; e < chunk->start[i + 1]; e++) {
            const double value = chunk->value[e];
            const double *v = in[chunk->column[e]];
            a += value * v[0];
            b += value * v[1];
        }
        out[first + i][0] = a;
        out[first + i][1] = b;
        sum[0] += a * in[first + i][0];
        sum[1] += b * in[first + i][1];
    }
}

static void add_up(const struct solver *solver, pair sum)
{
    sum[0] = sum[1] = 0;
    for (size_t i = 0; i < solver->system->chunk_count; i++) {
        sum[0] += solver->partial[i][0];
        sum[1] += solver->partial[i][1];
    }
}

static void multiply(const struct solver *solver, const pair *in, pair *out, pair sum)
{
#pragma omp parallel for num_threads(solver->threads) schedule(static) if (solver->threads > 1)
    for (size_t i = 0; i < solver->system->chunk_count; i++)
        multiply_chunk(solver->system, i, in, out, solver->partial[i]);
    add_up(solver, sum);
}

/* x += step p, r −= step A p; sums r · D⁻¹ r. */
static void advance(const struct solver *solver, const pair step, pair sum)
{
    const struct lsq_system *system = solver->system;
#pragma omp parallel for num_threads(solver->threads) schedule(static) if (solver->threads > 1)
    for (size_t i = 0; i < system->chunk_count; i++) {
        const size_t first = i * LSQ_CHUNK, end = first + chunk_rows(system, i);
        pair local = {0, 0};
        for (size_t u = first; u < end; u++)
            for (int s = 0; s < 2; s++) {
                solver->x[u][s] += step[s] * solver->direction[u][s];
                const double r = solver->residual[u][s] -= step[s] * solver->product[u][s];
                local[s] += r * r / system->diagonal[u];
            }
        memcpy(solver->partial[i], local, sizeof local);
    }
    add_up(solver, sum);
}

/* p = D⁻¹ r + keep p */
static void turn(const struct solver *solver, const pair keep)
{
    const struct lsq_system *system = solver->system;
#pragma omp parallel for num_threads(solver->threads) schedule(static) if (solver->threads > 1)
    for (size_t i = 0; i < system->chunk_count; i++) {
        const size_t first = i * LSQ_CHUNK, end = first + chunk_rows(system, i);
        for (size_t u = first; u < end; u++)
            for (int s = 0; s < 2; s++)
                solver->direction[u][s] = solver->residual[u][s] / system->diagonal[u] +
                                          keep[s] * solver->direction[u][s];
    }
}

/* r = b − A x; sums r · D⁻¹ r. */
static void begin(const struct solver *solver, pair sum)
{
    const pair none = {0, 0};
    pair unused;
    multiply(solver, (const pair *)solver->x, solver->product, unused);
    for (uint32_t u = 0; u < solver->system->count; u++)
        for (int s = 0; s < 2; s++)
            solver->residual[u][s] = solver->system->right[u][s] - solver->product[u][s];
    advance(solver, none, sum);
    turn(solver, none);
}

static double trace(const struct lsq_system *system)
{
    double sum = 0;
    for (uint32_t u = 0; u < system->count; u++)
        sum += system->diagonal[u];
    return sum;
}

/* False when the watch stopped it. */
static bool iterate(const struct solver *solver, const struct lsq_params *params,
                    struct lsq_outcome *outcome)
{
    pair rho, curvature, next;
    begin(solver, rho);
    const double scale = 1 / trace(solver->system);
    const double enough = params->tolerance * params->tolerance;
    for (;;) {
        const double worst = fmax(rho[0], rho[1]) * scale;
        outcome->residual = sqrt(worst);
        outcome->converged = worst <= enough;
        if (outcome->converged || outcome->iterations >= params->iterations_max)
            return true;
        if (!watch_goes_on(params->watch))
            return false;
        multiply(solver, (const pair *)solver->direction, solver->product, curvature);
        pair step, keep;
        for (int s = 0; s < 2; s++)
            step[s] = curvature[s] > 0 ? rho[s] / curvature[s] : 0;
        advance(solver, step, next);
        for (int s = 0; s < 2; s++) {
            keep[s] = rho[s] > 0 ? next[s] / rho[s] : 0;
            rho[s] = next[s];
        }
        turn(solver, keep);
        outcome->iterations++;
    }
}

enum cranny_status lsq_solve(const struct lsq_system *system, const struct lsq_params *params,
                             double (*x)[2], struct lsq_outcome *outcome, struct cranny_error *why)
{
    *outcome = (struct lsq_outcome){.converged = true};
    if (!system->count)
        return CRANNY_OK;
    struct solver solver = {
        .system = system,
        .threads = params->threads,
        .x = x,
        .residual = alloc_aligned(system->count, sizeof(pair)),
        .direction = alloc_array(system->count, sizeof(pair)),
        .product = alloc_aligned(system->count, sizeof(pair)),
        .partial = alloc_array(system->chunk_count, sizeof(pair)),
    };
    const bool complete = solver.residual && solver.direction && solver.product && solver.partial;
    const bool finished = complete && iterate(&solver, params, outcome);
    free(solver.residual);
    free(solver.direction);
    free(solver.product);
    free(solver.partial);
    if (!complete)
        return fail_memory(why, "least squares");
    return finished ? CRANNY_OK : fail(why, CRANNY_CANCELLED, "bake: cancelled while solving");
}
