/* The least-squares fit against what it must do: reproduce linear functions, ignore scale, agree
 * with a direct solver, and leave no vertex without a value. */
#include "bake/lsq.h"
#include "bake/fill.h"
#include "bake/plan.h"
#include "check.h"

#include <cranny/cranny.h>

#if CRANNY_TEST_CHOLMOD
#    include <suitesparse/cholmod.h>
#endif

struct model {
    float (*positions)[3];
    uint32_t (*triangles)[3];
    struct cranny_mesh view;
};

static void model_free(struct model *model)
{
    free(model->positions);
    free(model->triangles);
}

static uint32_t next_random(uint32_t *state)
{
    return *state = hash_u32(*state + 0x9e3779b9u);
}

/* (side + 1)² vertices in the plane y = height(x, z), jittered inside; `stretch` along x. */
static struct model make_grid(uint32_t side, float stretch, float bump, float jitter)
{
    struct model model = {0};
    const uint32_t n = side + 1;
    model.positions = malloc((size_t)n * n * sizeof *model.positions);
    model.triangles = malloc((size_t)side * side * 2 * sizeof *model.triangles);
    uint32_t random = 7;
    for (uint32_t i = 0; i < n * n; i++) {
        const uint32_t x = i % n, z = i / n;
        const bool inside = x > 0 && z > 0 && x < side && z < side;
        const float dx = jitter * (unit_from_u32(next_random(&random)) - 0.5f);
        const float dz = jitter * (unit_from_u32(next_random(&random)) - 0.5f);
        float *p = model.positions[i];
        p[0] = stretch * ((float)x + (inside ? dx : 0)) / (float)side;
        p[2] = ((float)z + (inside ? dz : 0)) / (float)side;
        p[1] = bump * sinf(9 * p[0] / stretch) * cosf(7 * p[2]);
    }
    uint32_t t = 0;
    for (uint32_t i = 0; i < side * side; i++) {
        const uint32_t a = i / side * n + i % side;
        const uint32_t quad[2][3] = {{a, a + n, a + 1}, {a + 1, a + n, a + n + 1}};
        memcpy(model.triangles[t], quad, sizeof quad);
        t += 2;
    }
    model.view = (struct cranny_mesh){.name = "grid",
                                      .vertex_count = n * n,
                                      .triangle_count = t,
                                      .positions = (const float(*)[3])model.positions,
                                      .triangles = (const uint32_t(*)[3])model.triangles};
    return model;
}

typedef void signal_fn(const double p[3], double f[2]);

static void linear_signal(const double p[3], double f[2])
{
    f[0] = 0.3 + 0.2 * p[0] - 0.1 * p[2];
    f[1] = 0.9 - 0.4 * p[0] + 0.05 * p[2];
}

static void wavy_signal(const double p[3], double f[2])
{
    f[0] = 0.5 + 0.4 * sin(5 * p[0]) * cos(4 * p[2]);
    f[1] = 0.5 + 0.3 * sin(11 * p[0] + 3 * p[2]);
}

/* `per_face` samples on each triangle that `keep` lets through, with noise. */
static struct lsq_term *make_terms(const struct model *model, const double metric[9], int per_face,
                                   signal_fn *signal, double noise, uint32_t drop)
{
    struct lsq_term *terms = calloc(model->view.triangle_count, sizeof *terms);
    const uint32_t shift[2] = {12345, 678910};
    uint32_t random = 99;
    for (uint32_t t = 0; t < model->view.triangle_count; t++) {
        const double weight = metric_area(metric, &model->view, t) / per_face;
        for (int s = 0; s < per_face && (!drop || t % drop); s++) {
            double l[3], p[3] = {0, 0, 0}, f[2];
            sample_barycentrics(shift, (uint64_t)t * (uint32_t)per_face + (uint32_t)s, l);
            for (int c = 0; c < 3; c++)
                for (int k = 0; k < 3; k++)
                    p[k] += l[c] * model->positions[model->triangles[t][c]][k];
            signal(p, f);
            for (int k = 0; k < 2; k++)
                f[k] += noise * (unit_from_u32(next_random(&random)) - 0.5);
            lsq_add(&terms[t], weight, l, f);
        }
    }
    return terms;
}

static const double unit_metric[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

struct problem {
    struct model model;
    struct surface surface;
    struct lsq_term *terms;
    double (*x)[2];
    double (*prior)[2];
    struct lsq_system system;
    struct lsq_outcome outcome;
};

static void problem_make(struct problem *problem, struct model model, const double metric[9],
                         int per_face, signal_fn *signal, double noise, uint32_t drop)
{
    struct cranny_error why = {0};
    *problem = (struct problem){.model = model};
    CHECK_OK(surface_create(&problem->model.view, metric, 1, &problem->surface, &why), why);
    problem->terms = make_terms(&problem->model, metric, per_face, signal, noise, drop);
    problem->x = calloc(problem->surface.unknown_count, sizeof *problem->x);
    problem->prior = calloc(problem->surface.unknown_count, sizeof *problem->prior);
    for (uint32_t u = 0; u < problem->surface.unknown_count; u++)
        problem->prior[u][0] = problem->prior[u][1] = problem->x[u][0] = problem->x[u][1] = 0.5;
}

static void problem_solve(struct problem *problem, const struct lsq_params *params)
{
    struct cranny_error why = {0};
    CHECK_OK(lsq_build(&problem->surface, problem->terms, (const double(*)[2])problem->prior,
                       params, &problem->system, &why),
             why);
    CHECK_OK(lsq_solve(&problem->system, params, problem->x, &problem->outcome, &why), why);
}

static void problem_free(struct problem *problem)
{
    lsq_free(&problem->system);
    surface_free(&problem->surface);
    free(problem->terms);
    free(problem->x);
    free(problem->prior);
    model_free(&problem->model);
}

static double worst_error(const struct problem *problem, signal_fn *signal)
{
    double worst = 0;
    for (uint32_t u = 0; u < problem->surface.unknown_count; u++) {
        double f[2];
        signal(problem->surface.position[u], f);
        worst = fmax(worst, fmax(fabs(problem->x[u][0] - f[0]), fabs(problem->x[u][1] - f[1])));
    }
    return worst;
}

static struct lsq_params exact_params(double alpha)
{
    struct lsq_params params = lsq_params_default();
    params.alpha = alpha;
    params.ridge = 0;
    params.pull = 0;
    params.tolerance = 1e-12;
    params.iterations_max = 20000;
    return params;
}

static void linear_functions_are_reproduced(void)
{
    static const double alphas[] = {0, 0.1, 1, 10};
    for (size_t i = 0; i < COUNT_OF(alphas); i++) {
        struct problem problem;
        problem_make(&problem, make_grid(20, 1, 0, 0.6f), unit_metric, 4, linear_signal, 0, 0);
        const struct lsq_params params = exact_params(alphas[i]);
        problem_solve(&problem, &params);
        CHECK(problem.outcome.converged);
        CHECK_NEAR(worst_error(&problem, linear_signal), 0, 1e-7);
        problem_free(&problem);
    }
}

/* Two triangles folded along their edge by `angle`: a function linear on the unfolded pair has no
 * jump; constants never have one. */
static void edge_rows_vanish(void)
{
    uint32_t random = 5;
    for (int i = 0; i < 200; i++) {
        double flat[4][2], p[4][3], r[4], sum = 0, linear = 0, size = 0;
        const double angle = 3 * unit_from_u32(next_random(&random));
        const double scale = exp(10 * (unit_from_u32(next_random(&random)) - 0.5));
        flat[0][0] = flat[0][1] = flat[1][1] = 0;
        flat[1][0] = 0.1 + unit_from_u32(next_random(&random));
        for (int k = 2; k < 4; k++) {
            flat[k][0] = 2 * unit_from_u32(next_random(&random)) - 0.5;
            flat[k][1] = (k == 2 ? 1 : -1) * (0.05 + unit_from_u32(next_random(&random)));
        }
        for (int k = 0; k < 4; k++) {
            const double bend = k == 3 ? angle : 0;
            p[k][0] = scale * flat[k][0];
            p[k][1] = scale * flat[k][1] * cos(bend);
            p[k][2] = scale * flat[k][1] * sin(bend);
        }
        CHECK(lsq_edge(p[0], p[1], p[2], p[3], r));
        for (int k = 0; k < 4; k++) {
            sum += r[k];
            linear += r[k] * (0.7 * flat[k][0] - 1.3 * flat[k][1]);
            size += fabs(r[k]);
        }
        CHECK_NEAR(sum / size, 0, 1e-12);
        CHECK_NEAR(linear / size, 0, 1e-12);
        /* 1 on one apex, 0 elsewhere, has the gradient 1/h there. */
        CHECK_NEAR(r[2] * flat[2][1] / (r[3] * -flat[3][1]), 1, 1e-9);
    }
    const double a[3] = {0, 0, 0}, b[3] = {1, 0, 0}, c[3] = {0.5, 0, 0}, d[3] = {0.5, 1, 0};
    double r[4];
    CHECK(!lsq_edge(a, b, c, d, r));
    /* Areas ½ and 1, heights 1 and 2: (A1 + A2) / h. */
    const double e[3] = {0.5, -2, 0};
    CHECK(lsq_edge(a, b, d, e, r));
    CHECK_NEAR(r[2], 1.5, 1e-12);
    CHECK_NEAR(r[3], 0.75, 1e-12);
    CHECK_NEAR(r[0], -0.5 * 1.5 - 0.5 * 0.75, 1e-12);
    CHECK(!lsq_edge(a, a, d, d, r));
}

static void rows_of_r_sum_to_zero(void)
{
    struct problem problem;
    problem_make(&problem, make_grid(12, 3, 0.2f, 0.6f), unit_metric, 4, wavy_signal, 0, 1);
    const struct lsq_params params = exact_params(1);
    struct cranny_error why = {0};
    CHECK_OK(lsq_build(&problem.surface, problem.terms, (const double(*)[2])problem.prior, &params,
                       &problem.system, &why),
             why);
    double largest = 0;
    for (size_t c = 0; c < problem.system.chunk_count; c++) {
        const struct lsq_chunk *chunk = &problem.system.chunks[c];
        const uint32_t first = (uint32_t)(c * LSQ_CHUNK);
        for (uint32_t i = 0; i < LSQ_CHUNK && first + i < problem.system.count; i++) {
            double sum = 0;
            for (uint32_t e = chunk->start[i]; e < chunk->start[i + 1]; e++)
                sum += chunk->value[e];
            CHECK_NEAR(sum / problem.system.diagonal[first + i], 0, 1e-12);
            largest = fmax(largest, problem.system.diagonal[first + i]);
        }
    }
    CHECK(largest > 0);
    problem_free(&problem);
}

static void scale_does_not_matter(void)
{
    struct problem small, large;
    const double thousand[9] = {1000, 0, 0, 0, 1000, 0, 0, 0, 1000};
    struct lsq_params params = exact_params(1);
    params.ridge = 1e-7;
    params.pull = 0.5;
    params.tolerance = 1e-10;
    problem_make(&small, make_grid(25, 1, 0.1f, 0.5f), unit_metric, 3, wavy_signal, 0.2, 0);
    problem_make(&large, make_grid(25, 1, 0.1f, 0.5f), thousand, 3, wavy_signal, 0.2, 0);
    problem_solve(&small, &params);
    problem_solve(&large, &params);
    double worst = 0;
    for (uint32_t u = 0; u < small.surface.unknown_count; u++)
        worst = fmax(worst, fabs(small.x[u][0] - large.x[u][0]));
    CHECK_NEAR(worst, 0, 1e-7);
    problem_free(&small);
    problem_free(&large);
}

/* A third of the faces and one whole corner without samples: the hole continues the slope. */
static void holes_are_extrapolated(void)
{
    struct problem problem;
    problem_make(&problem, make_grid(20, 1, 0, 0.4f), unit_metric, 4, linear_signal, 0, 3);
    for (uint32_t t = 0; t < problem.model.view.triangle_count; t++) {
        const float *p = problem.model.positions[problem.model.triangles[t][0]];
        if (p[0] > 0.6f && p[2] > 0.6f)
            problem.terms[t] = (struct lsq_term){0};
    }
    struct lsq_params params = exact_params(0.1);
    params.ridge = 1e-9;
    problem_solve(&problem, &params);
    CHECK_NEAR(worst_error(&problem, linear_signal), 0, 1e-3);
    problem_free(&problem);
}

static void fill_leaves_nothing_out(void)
{
    struct cranny_error why = {0};
    struct model model = make_grid(10, 1, 0, 0);
    struct surface surface;
    CHECK_OK(surface_create(&model.view, unit_metric, 1, &surface, &why), why);
    uint8_t *known = calloc(surface.unknown_count, 1);
    double(*x)[2] = calloc(surface.unknown_count, sizeof *x);
    uint64_t lost = 0;
    known[0] = 1;
    x[0][0] = 0.7;
    x[0][1] = 0.6;
    CHECK_OK(fill_unknowns(&surface, known, x, &lost, &why), why);
    CHECK_INT(lost, 0);
    for (uint32_t u = 0; u < surface.unknown_count; u++) {
        CHECK_NEAR(x[u][0], 0.7, 1e-12);
        CHECK_NEAR(x[u][1], 0.6, 1e-12);
    }
    known[0] = 0;
    CHECK_OK(fill_unknowns(&surface, known, x, &lost, &why), why);
    CHECK_INT(lost, 1);
    CHECK_NEAR(x[5][0], 0.7, 1e-12);
    free(known);
    free(x);
    surface_free(&surface);
    model_free(&model);
}

/* An unindexed copy welds back to the grid; the same with differing normals does not. */
static void welding(void)
{
    struct cranny_error why = {0};
    struct model grid = make_grid(6, 1, 0.3f, 0.5f);
    const uint32_t corners = grid.view.triangle_count * 3;
    struct model soup = {0};
    soup.positions = malloc(corners * sizeof *soup.positions);
    soup.triangles = malloc(corners * sizeof(uint32_t));
    float(*normals)[3] = calloc(corners, sizeof *normals);
    for (uint32_t i = 0; i < corners; i++) {
        memcpy(soup.positions[i], grid.positions[grid.triangles[i / 3][i % 3]], 12);
        soup.triangles[i / 3][i % 3] = i;
        normals[i][i / 3 % 2] = 1;
    }
    soup.view = grid.view;
    soup.view.vertex_count = corners;
    soup.view.positions = (const float(*)[3])soup.positions;
    soup.view.triangles = (const uint32_t(*)[3])soup.triangles;
    struct surface a, b, c;
    CHECK_OK(surface_create(&grid.view, unit_metric, 1, &a, &why), why);
    CHECK_OK(surface_create(&soup.view, unit_metric, 1, &b, &why), why);
    soup.view.normals = (const float(*)[3])normals;
    CHECK_OK(surface_create(&soup.view, unit_metric, 1, &c, &why), why);
    CHECK_INT(a.unknown_count, 49);
    CHECK_INT(b.unknown_count, 49);
    CHECK(c.unknown_count > 49 && c.unknown_count < corners);
    size_t inner = 0;
    for (uint32_t t = 0; t < b.triangle_count; t++)
        for (int k = 0; k < 3; k++)
            inner += b.across[t][k] != SURFACE_NONE;
    CHECK_INT(inner, 2 * (3 * 36 - 12)); /* a grid of 6 × 6 has 3·36 − 12 inner edges */
    surface_free(&a);
    surface_free(&b);
    surface_free(&c);
    free(normals);
    model_free(&grid);
    model_free(&soup);
}

/* Same winding, or three triangles on an edge: no coupling across it. */
static void odd_edges_are_skipped(void)
{
    struct cranny_error why = {0};
    const float positions[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
    const uint32_t same[2][3] = {{0, 1, 2}, {0, 1, 3}};
    const uint32_t opposite[2][3] = {{0, 1, 2}, {1, 0, 3}};
    const uint32_t folded[2][3] = {{0, 1, 2}, {1, 0, 2}};
    const uint32_t crowd[3][3] = {{0, 1, 2}, {1, 0, 3}, {1, 0, 4}};
    struct cranny_mesh mesh = {.name = "", .vertex_count = 5, .positions = positions};
    const struct {
        const uint32_t (*triangles)[3];
        uint32_t count, expected;
    } cases[] = {{same, 2, SURFACE_NONE},
                 {opposite, 2, 5},
                 {crowd, 3, SURFACE_NONE},
                 {folded, 2, SURFACE_NONE}};
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        struct surface surface;
        mesh.triangles = cases[i].triangles;
        mesh.triangle_count = cases[i].count;
        CHECK_OK(surface_create(&mesh, unit_metric, 1, &surface, &why), why);
        CHECK_INT(surface.across[0][0], cases[i].expected);
        surface_free(&surface);
    }
}

#if CRANNY_TEST_CHOLMOD
static double compare_with_cholmod(const struct problem *problem)
{
    const struct lsq_system *system = &problem->system;
    cholmod_common common;
    cholmod_start(&common);
    common.supernodal = CHOLMOD_SIMPLICIAL;
    common.final_ll = 0;
    cholmod_triplet *triplet = cholmod_allocate_triplet(
        system->count, system->count, system->entry_count, 1, CHOLMOD_REAL, &common);
    for (size_t c = 0; c < system->chunk_count; c++) {
        const struct lsq_chunk *chunk = &system->chunks[c];
        const uint32_t first = (uint32_t)(c * LSQ_CHUNK);
        for (uint32_t i = 0; i < LSQ_CHUNK && first + i < system->count; i++)
            for (uint32_t e = chunk->start[i]; e < chunk->start[i + 1]; e++) {
                if (chunk->column[e] < first + i)
                    continue;
                ((int *)triplet->i)[triplet->nnz] = (int)(first + i);
                ((int *)triplet->j)[triplet->nnz] = (int)chunk->column[e];
                ((double *)triplet->x)[triplet->nnz++] = chunk->value[e];
            }
    }
    cholmod_sparse *matrix = cholmod_triplet_to_sparse(triplet, 0, &common);
    cholmod_factor *factor = cholmod_analyze(matrix, &common);
    cholmod_factorize(matrix, factor, &common);
    cholmod_dense *right = cholmod_zeros(system->count, 1, CHOLMOD_REAL, &common);
    double worst = 0;
    for (int s = 0; s < 2; s++) {
        for (uint32_t u = 0; u < system->count; u++)
            ((double *)right->x)[u] = system->right[u][s];
        cholmod_dense *solution = cholmod_solve(CHOLMOD_A, factor, right, &common);
        for (uint32_t u = 0; u < system->count; u++)
            worst = fmax(worst, fabs(((double *)solution->x)[u] - problem->x[u][s]));
        cholmod_free_dense(&solution, &common);
    }
    cholmod_free_dense(&right, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_free_sparse(&matrix, &common);
    cholmod_free_triplet(&triplet, &common);
    cholmod_finish(&common);
    return worst;
}

static void agrees_with_a_direct_solver(void)
{
    const struct {
        uint32_t side;
        float stretch, jitter;
        uint32_t drop;
        double alpha;
    } cases[] = {{40, 1, 0.6f, 0, 0.1},  {40, 1, 0.6f, 0, 1},   {60, 1, 0.8f, 0, 10},
                 {40, 30, 0.5f, 0, 0.1}, {50, 1, 0.5f, 3, 0.1}, {30, 1, 0.5f, 0, 0}};
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        struct problem problem;
        problem_make(&problem, make_grid(cases[i].side, cases[i].stretch, 0.2f, cases[i].jitter),
                     unit_metric, 4, wavy_signal, 0.2, cases[i].drop);
        struct lsq_params params = exact_params(cases[i].alpha);
        params.ridge = 1e-7;
        params.tolerance = 1e-9;
        problem_solve(&problem, &params);
        const double worst = compare_with_cholmod(&problem);
        CHECK_MSG(worst < 1e-5, "case %zu: %g after %d iterations", i, worst,
                  problem.outcome.iterations);
        problem_free(&problem);
    }
}
#else
static void agrees_with_a_direct_solver(void)
{
    printf("lsq: CHOLMOD is not installed: the comparison with a direct solver was SKIPPED\n");
}
#endif

static void threads_do_not_matter(void)
{
    static const int counts[] = {1, 2, 7};
    struct problem problems[3];
    for (size_t i = 0; i < 3; i++) {
        struct lsq_params params = lsq_params_default();
        params.threads = counts[i];
        problem_make(&problems[i], make_grid(90, 1, 0.2f, 0.6f), unit_metric, 2, wavy_signal, 0.3,
                     0);
        problem_solve(&problems[i], &params);
        CHECK(memcmp(problems[0].x, problems[i].x,
                     problems[0].surface.unknown_count * sizeof *problems[0].x) == 0);
        CHECK_INT(problems[i].outcome.iterations, problems[0].outcome.iterations);
    }
    for (size_t i = 0; i < 3; i++)
        problem_free(&problems[i]);
}

/* Noise averages out: the fit must beat the raw noise and get smoother with alpha. */
static void smoothing_lowers_noise(void)
{
    double rms[2];
    for (int i = 0; i < 2; i++) {
        struct problem problem;
        const struct lsq_params params = exact_params(i ? 1 : 0);
        problem_make(&problem, make_grid(40, 1, 0, 0.5f), unit_metric, 4, linear_signal, 0.3, 0);
        problem_solve(&problem, &params);
        double sum = 0;
        for (uint32_t u = 0; u < problem.surface.unknown_count; u++) {
            double f[2];
            linear_signal(problem.surface.position[u], f);
            sum += (problem.x[u][0] - f[0]) * (problem.x[u][0] - f[0]);
        }
        rms[i] = sqrt(sum / problem.surface.unknown_count);
        problem_free(&problem);
    }
    CHECK_MSG(rms[1] < 0.5 * rms[0], "%g at alpha 1, %g at 0", rms[1], rms[0]);
}

int main(void)
{
    linear_functions_are_reproduced();
    edge_rows_vanish();
    rows_of_r_sum_to_zero();
    scale_does_not_matter();
    holes_are_extrapolated();
    fill_leaves_nothing_out();
    welding();
    odd_edges_are_skipped();
    agrees_with_a_direct_solver();
    threads_do_not_matter();
    smoothing_lowers_noise();
    return check_end("lsq");
}
