/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.1. */
#include "bake/fit.h"

#include "bake/fill.h"
#include "bake/lsq.h"
#include "bake/tune.h"
#include "trace/gather.h"

/* Triangles summed up before the sums are added: fixed, so that threads do not change the bits. */
#define TRIANGLES_PER_SUM 8192
/* Multiplications that a solve may take in all; big systems get fewer iterations. */
#define SOLVE_BUDGET 2e10
/* Rays a sample at which `alpha` is meant. */
#define ALPHA_RAYS 8.0
#define ITERATIONS_MIN 200
#define ITERATIONS_MAX 3000

/* Which samples take part. */
enum half { BOTH_HALVES, EVEN_HALF, ODD_HALF };

struct fit {
    const struct plan *plan;
    const struct target *target;
    const struct cranny_mesh *mesh;
    const struct samples *samples;
    const struct cranny_bake_params *params;
    int threads;
    struct watch *watch; /* NULL: nobody stops it */
    struct surface surface;
    struct lsq_term *terms; /* per triangle */
    double (*x)[2];         /* per unknown */
    uint8_t *known;         /* per unknown: has a valid sample near */
    float *smooth;          /* per unknown: factor of α; NULL: 1 */
    enum half half;
};

static bool takes_part(const struct fit *fit, uint64_t id, enum half half)
{
    return fit->samples->valid[id] &&
           (half == BOTH_HALVES || ((id - fit->target->sample_base) & 1) == (half == ODD_HALF));
}

static void add_triangle(const struct fit *fit, uint32_t t)
{
    const struct target *target = fit->target;
    const uint32_t first = target->sample_start[t], end = target->sample_start[t + 1];
    if (first == end || fit->surface.triangles[t][0] == SURFACE_NONE)
        return;
    const double weight = metric_area(target->metric, fit->mesh, t) / (end - first);
    for (uint32_t s = first; s < end; s++) {
        const uint64_t id = target->sample_base + s;
        if (!takes_part(fit, id, fit->half))
            continue;
        const struct sample *sample = &fit->samples->values[id];
        const double f[2] = {sample_value(sample, 0), sample_value(sample, 1)};
        double l[3];
        sample_barycentrics(fit->plan->shift, target->sequence + (uint64_t)s, l);
        lsq_add(&fit->terms[t], weight, l, f);
    }
}

static void add_samples(const struct fit *fit)
{
    memset(fit->terms, 0, fit->surface.triangle_count * sizeof *fit->terms);
#pragma omp parallel for num_threads(fit->threads) schedule(static) if (fit->threads > 1)
    for (uint32_t t = 0; t < fit->surface.triangle_count; t++)
        add_triangle(fit, t);
}

/* The weighted mean of the samples around each vertex: Σ w φ f / Σ w φ. */
static void splat(const struct fit *fit)
{
    const struct surface *surface = &fit->surface;
#pragma omp parallel for num_threads(fit->threads) schedule(static) if (fit->threads > 1)
    for (uint32_t u = 0; u < surface->unknown_count; u++) {
        double mass = 0, sum[2] = {0, 0};
        for (uint32_t i = surface->incident_start[u]; i < surface->incident_start[u + 1]; i++) {
            const uint32_t c = surface->incident[i] % 3;
            const struct lsq_term *term = &fit->terms[surface->incident[i] / 3];
            mass += term->m[c] + term->m[3 + c] + term->m[3 + (c + 2) % 3];
            sum[0] += term->b[0][c];
            sum[1] += term->b[1][c];
        }
        fit->known[u] = mass > 0;
        fit->x[u][0] = mass > 0 ? sum[0] / mass : 0;
        fit->x[u][1] = mass > 0 ? sum[1] / mass : 0;
    }
}

/* Whoever has no valid sample starts from the mean of the buried ones around it. */
static void splat_buried(const struct fit *fit)
{
    const struct surface *surface = &fit->surface;
    for (uint32_t u = 0; u < surface->unknown_count; u++) {
        double sum[2] = {0, 0}, count = 0;
        for (uint32_t i = surface->incident_start[u];
             !fit->known[u] && i < surface->incident_start[u + 1]; i++) {
            const uint32_t t = surface->incident[i] / 3;
            for (uint32_t s = fit->target->sample_start[t]; s < fit->target->sample_start[t + 1];
                 s++, count++)
                for (int k = 0; k < 2; k++)
                    sum[k] += sample_value(&fit->samples->values[fit->target->sample_base + s], k);
        }
        for (int k = 0; k < 2 && !fit->known[u]; k++)
            fit->x[u][k] = count > 0 ? sum[k] / count : 1;
    }
}

static struct lsq_params solver_params(const struct fit *fit)
{
    struct lsq_params params = lsq_params_default();
    /* Noise falls with the rays, and what is less noisy needs less smoothing. */
    params.alpha = fit->params->alpha * ALPHA_RAYS / fit->params->rays;
    params.threads = fit->threads;
    params.smooth = fit->smooth;
    params.watch = fit->watch;
    return params;
}

static enum cranny_status solve(const struct fit *fit, struct fit_report *report,
                                struct cranny_error *why)
{
    struct lsq_params params = solver_params(fit);
    struct lsq_system system;
    struct lsq_outcome outcome;
    enum cranny_status status =
        lsq_build(&fit->surface, fit->terms, (const double(*)[2])fit->x, &params, &system, why);
    if (status != CRANNY_OK)
        return status;
    const double budget = SOLVE_BUDGET / (double)(system.entry_count + 1);
    params.iterations_max = (int)fmin(fmax(budget, ITERATIONS_MIN), ITERATIONS_MAX);
    status = lsq_solve(&system, &params, fit->x, &outcome, why);
    report->bytes += system.entry_count * (fit->smooth ? 20 : 12) + /* tuning keeps R apart */
                     (uint64_t)system.count * 96;
    lsq_free(&system);
    if (status == CRANNY_OK) {
        report->iterations = outcome.iterations;
        report->unconverged = !outcome.converged;
    }
    return status;
}

/* A sample's blended value, and the fit's there. */
static void blend_sample(const struct fit *fit, const double (*x)[2], const uint32_t corner[3],
                         uint64_t id, double *fitted, double *sampled)
{
    const double blend[2] = {1 - fit->params->short_weight, fit->params->short_weight};
    double l[3];
    sample_barycentrics(fit->plan->shift, fit->target->sequence + id - fit->target->sample_base, l);
    *fitted = *sampled = 0;
    for (int k = 0; k < 2; k++) {
        *fitted +=
            blend[k] * (l[0] * x[corner[0]][k] + l[1] * x[corner[1]][k] + l[2] * x[corner[2]][k]);
        *sampled += blend[k] * sample_value(&fit->samples->values[id], k);
    }
}

/* Squared distance of a triangle's samples from the fit, in the blended value; weight; value. */
static void compare_triangle(const struct fit *fit, const double (*x)[2], uint32_t t,
                             enum half half, double sum[3])
{
    const struct target *target = fit->target;
    const uint32_t first = target->sample_start[t], end = target->sample_start[t + 1];
    const uint32_t *corner = fit->surface.triangles[t];
    if (first == end || corner[0] == SURFACE_NONE)
        return;
    const double area = metric_area(target->metric, fit->mesh, t) / (end - first);
    for (uint32_t s = first; s < end; s++) {
        const uint64_t id = target->sample_base + s;
        if (!takes_part(fit, id, half))
            continue;
        double fitted, sampled;
        blend_sample(fit, x, corner, id, &fitted, &sampled);
        sum[0] += area * (fitted - sampled) * (fitted - sampled);
        sum[1] += area;
        sum[2] += area * sampled;
    }
}

/* Σ (fit − sample) and the count over half of a triangle's samples; false: it has none. */
static bool mean_departure(const struct fit *fit, uint32_t t, enum half half, double sum[2])
{
    const struct target *target = fit->target;
    const uint32_t *corner = fit->surface.triangles[t];
    sum[0] = sum[1] = 0;
    for (uint32_t s = target->sample_start[t];
         corner[0] != SURFACE_NONE && s < target->sample_start[t + 1]; s++) {
        const uint64_t id = target->sample_base + s;
        if (!takes_part(fit, id, half))
            continue;
        double fitted, sampled;
        blend_sample(fit, (const double(*)[2])fit->x, corner, id, &fitted, &sampled);
        sum[0] += fitted - sampled;
        sum[1] += 1;
    }
    return sum[1] > 0;
}

/* Sums over a run of triangles. */
struct comparison {
    double both[3]; /* as compare_triangle */
    double agreed, agreed_weight;
    uint64_t invalid;
};

/* Noise differs between the halves of a triangle's samples, what the fit cannot follow does not:
 * the product of their mean departures has the latter's square as its expectation. */
static void compare_halves(const struct fit *fit, uint32_t t, struct comparison *sum)
{
    double mean[2];
    for (int h = 0; h < 2; h++) {
        double departure[2];
        if (!mean_departure(fit, t, h ? ODD_HALF : EVEN_HALF, departure))
            return;
        mean[h] = departure[0] / departure[1];
    }
    const double area = metric_area(fit->target->metric, fit->mesh, t);
    sum->agreed += area * mean[0] * mean[1];
    sum->agreed_weight += area;
}

static void compare_run(const struct fit *fit, size_t first, size_t end, struct comparison *sum)
{
    const struct target *target = fit->target;
    for (size_t t = first; t < end; t++) {
        compare_triangle(fit, (const double(*)[2])fit->x, (uint32_t)t, BOTH_HALVES, sum->both);
        compare_halves(fit, (uint32_t)t, sum);
        for (uint32_t s = target->sample_start[t]; s < target->sample_start[t + 1]; s++)
            sum->invalid += !fit->samples->valid[target->sample_base + s];
    }
}

static enum cranny_status compare(const struct fit *fit, struct fit_report *report,
                                  struct cranny_error *why)
{
    const size_t triangles = fit->surface.triangle_count;
    const size_t pieces = (triangles + TRIANGLES_PER_SUM - 1) / TRIANGLES_PER_SUM;
    struct comparison *sums = alloc_array(pieces, sizeof *sums);
    if (!sums)
        return fail_memory(why, "fit");
#pragma omp parallel for num_threads(fit->threads) schedule(static) if (fit->threads > 1)
    for (size_t i = 0; i < pieces; i++) {
        const size_t end = (i + 1) * TRIANGLES_PER_SUM;
        compare_run(fit, i * TRIANGLES_PER_SUM, end < triangles ? end : triangles, &sums[i]);
    }
    for (size_t i = 0; i < pieces; i++) {
        report->squares += sums[i].both[0];
        report->weight += sums[i].both[1];
        report->visibility += sums[i].both[2];
        report->agreed += sums[i].agreed;
        report->agreed_weight += sums[i].agreed_weight;
        report->invalid += sums[i].invalid;
    }
    free(sums);
    return CRANNY_OK;
}

/* tune_score_fn: the held-out half's opinion. */
static void judge_fit(void *user, const double (*x)[2], struct tune_score *scores)
{
    const struct fit *fit = user;
    for (uint32_t t = 0; t < fit->surface.triangle_count; t++) {
        const uint32_t count = fit->target->sample_start[t + 1] - fit->target->sample_start[t];
        const double area = metric_area(fit->target->metric, fit->mesh, t);
        double sum[3] = {0, 0, 0};
        compare_triangle(fit, x, t, ODD_HALF, sum);
        scores[t] = (struct tune_score){sum[0], area > 0 ? sum[1] / area * count : 0};
    }
}

static enum cranny_status splat_all(struct fit *fit, enum half half, struct fit_report *report,
                                    struct cranny_error *why)
{
    fit->half = half;
    add_samples(fit);
    splat(fit);
    splat_buried(fit);
    return fill_unknowns(&fit->surface, fit->known, fit->x, &report->lost_components, why);
}

/* Find each piece's α, with the even samples for the fit and the odd ones for its judge. */
static enum cranny_status tune(struct fit *fit, struct fit_report *report, struct cranny_error *why)
{
    fit->smooth = alloc_array(fit->surface.unknown_count, sizeof *fit->smooth);
    if (!fit->smooth)
        return fail_memory(why, "fit");
    const struct lsq_params params = solver_params(fit);
    enum cranny_status status = splat_all(fit, EVEN_HALF, report, why);
    if (status == CRANNY_OK)
        status = tune_smoothness(&fit->surface, fit->terms, &params, (const double(*)[2])fit->x,
                                 judge_fit, fit, fit->smooth, why);
    return status;
}

/* Where no sample speaks, a gradient continued across a buried edge overshoots: such vertices stay
 * within what their sampled neighbours hold. */
static void limit_extrapolation(const struct fit *fit)
{
    const struct surface *surface = &fit->surface;
    for (uint32_t u = 0; u < surface->unknown_count; u++) {
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (uint32_t i = surface->incident_start[u];
             !fit->known[u] && i < surface->incident_start[u + 1]; i++) {
            const uint32_t *corner = surface->triangles[surface->incident[i] / 3];
            for (int c = 0; c < 3; c++)
                for (int s = 0; s < 2 && fit->known[corner[c]]; s++) {
                    low[s] = fmin(low[s], fit->x[corner[c]][s]);
                    high[s] = fmax(high[s], fit->x[corner[c]][s]);
                }
        }
        for (int s = 0; s < 2 && low[0] <= high[0]; s++)
            fit->x[u][s] = fmin(fmax(fit->x[u][s], low[s]), high[s]);
    }
}

static void clamp_unknowns(const struct fit *fit)
{
    for (uint32_t u = 0; u < fit->surface.unknown_count; u++)
        for (int s = 0; s < 2; s++)
            fit->x[u][s] = fmin(fmax(fit->x[u][s], 0), 1); /* NaN becomes 0, then 0..1 */
}

static void scatter(const struct fit *fit, float (*values)[2], struct fit_report *report)
{
    for (uint32_t v = 0; v < fit->surface.vertex_count; v++) {
        const uint32_t u = fit->surface.unknown_of[v];
        values[v][0] = u == SURFACE_NONE ? 1 : (float)fit->x[u][0];
        values[v][1] = u == SURFACE_NONE ? 1 : (float)fit->x[u][1];
        report->unsampled_vertices += u != SURFACE_NONE && !fit->known[u];
    }
}

static enum cranny_status fit_begin(struct fit *fit, size_t term_count, struct fit_report *report,
                                    struct cranny_error *why)
{
    enum cranny_status status =
        surface_create(fit->mesh, fit->target->metric, fit->threads, &fit->surface, why);
    if (status != CRANNY_OK)
        return status;
    fit->terms = alloc_array(term_count, sizeof *fit->terms);
    fit->x = alloc_array(fit->surface.unknown_count, sizeof *fit->x);
    fit->known = alloc_array(fit->surface.unknown_count, 1);
    report->bytes += surface_bytes(&fit->surface) + term_count * sizeof *fit->terms +
                     (uint64_t)fit->surface.unknown_count * 17;
    return fit->terms && fit->x && fit->known ? CRANNY_OK : fail_memory(why, "fit");
}

static void fit_end(struct fit *fit)
{
    surface_free(&fit->surface);
    free(fit->terms);
    free(fit->x);
    free(fit->known);
    free(fit->smooth);
}

enum cranny_status fit_target(const struct plan *plan, const struct samples *samples, size_t index,
                              const struct cranny_bake_params *params, int threads,
                              struct watch *watch, float (*values)[2], struct fit_report *report,
                              struct cranny_error *why)
{
    const struct target *target = &plan->targets[index];
    struct fit fit = {.plan = plan,
                      .target = target,
                      .mesh = plan_mesh(plan, target),
                      .samples = samples,
                      .params = params,
                      .threads = threads,
                      .watch = watch};
    *report = (struct fit_report){0};
    enum cranny_status status = fit_begin(&fit, fit.mesh->triangle_count, report, why);
    if (status == CRANNY_OK && params->fit == CRANNY_FIT_LEAST_SQUARES && params->tune)
        status = tune(&fit, report, why);
    if (status == CRANNY_OK)
        status = splat_all(&fit, BOTH_HALVES, report, why);
    if (status == CRANNY_OK && params->fit == CRANNY_FIT_LEAST_SQUARES)
        status = solve(&fit, report, why);
    if (status == CRANNY_OK) {
        limit_extrapolation(&fit);
        clamp_unknowns(&fit);
        status = compare(&fit, report, why);
    }
    if (status == CRANNY_OK)
        scatter(&fit, values, report);
    fit_end(&fit);
    return status;
}

enum cranny_status fit_measure(const struct plan *plan, const struct samples *samples, size_t index,
                               const struct cranny_bake_params *params, const float (*values)[2],
                               struct fit_report *report, struct cranny_error *why)
{
    const struct target *target = &plan->targets[index];
    struct fit fit = {.plan = plan,
                      .target = target,
                      .mesh = plan_mesh(plan, target),
                      .samples = samples,
                      .params = params,
                      .threads = thread_count(params->threads)};
    *report = (struct fit_report){0};
    enum cranny_status status = fit_begin(&fit, 0, report, why);
    for (uint32_t v = 0; status == CRANNY_OK && v < fit.surface.vertex_count; v++)
        for (int s = 0; s < 2 && fit.surface.unknown_of[v] != SURFACE_NONE; s++)
            fit.x[fit.surface.unknown_of[v]][s] = values[v][s];
    if (status == CRANNY_OK)
        status = compare(&fit, report, why);
    fit_end(&fit);
    return status;
}

/* Object-space normal of a vertex: its own, else the area-weighted mean of its faces. */
static void vertex_normal(const struct cranny_mesh *mesh, const struct surface *surface,
                          uint32_t vertex, double out[3])
{
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const uint32_t unknown = surface->unknown_of[vertex];
    for (int k = 0; k < 3; k++)
        out[k] = mesh->normals ? mesh->normals[vertex][k] : 0;
    for (uint32_t i = surface->incident_start[unknown];
         !mesh->normals && i < surface->incident_start[unknown + 1]; i++) {
        const uint32_t *corner = mesh->triangles[surface->incident[i] / 3];
        const float(*p)[3] = mesh->positions;
        double a[3], b[3];
        metric_edge(identity, p[corner[0]], p[corner[1]], a);
        metric_edge(identity, p[corner[0]], p[corner[2]], b);
        for (int k = 0; k < 3; k++)
            out[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
}

bool fit_vertex_point(const struct frame *frame, const struct cranny_mesh *mesh,
                      const struct surface *surface, uint32_t vertex, struct gather_point *point)
{
    double normal[3], world[3], n[3], length = 0;
    vertex_normal(mesh, surface, vertex, normal);
    transform_point(frame->world, mesh->positions[vertex], world);
    for (int k = 0; k < 3; k++) {
        n[k] = frame->normal[3 * k] * normal[0] + frame->normal[3 * k + 1] * normal[1] +
               frame->normal[3 * k + 2] * normal[2];
        length += n[k] * n[k];
    }
    if (!(length > 0) || !isfinite(length) || frame->singular)
        return false;
    *point = (struct gather_point){.id = vertex};
    for (int k = 0; k < 3; k++) {
        point->position[k] = (float)world[k];
        point->normal[k] = point->face_normal[k] = (float)(n[k] / sqrt(length));
    }
    return true;
}

/* Instances that a vertex is traced in when its values are shared. */
#define VERTEX_INSTANCES 4u

struct vertex_run {
    const struct fit *fit;
    const struct cranny_tracer *tracer;
    const struct gather_plan *gather;
    const uint32_t *first; /* a vertex of each unknown */
    struct watch watch;
};

static uint64_t gather_unknown(struct vertex_run *run, uint32_t unknown)
{
    const struct fit *fit = run->fit;
    const struct target *target = fit->target;
    const uint32_t vertex = run->first[unknown];
    double sum[2] = {0, 0};
    const uint32_t count =
        target->instance_count < VERTEX_INSTANCES ? target->instance_count : VERTEX_INSTANCES;
    uint64_t rays = 0, good = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double u = (i + ((double)hash_u32(unknown) + 0.5) * 0x1p-32) / count;
        const struct frame *frame = &fit->plan->frames[plan_pick(fit->plan, target, u)];
        struct gather_point point;
        struct gather_result result;
        if (!fit_vertex_point(frame, fit->mesh, &fit->surface, vertex, &point))
            continue;
        point.id = unknown * count + i;
        gather_points(run->tracer, run->gather, &point, 1, &result);
        rays += result.rays;
        const double limit = fit->params->back_limit * result.rays;
        if (fit->params->back_limit < 1 && result.back_faces > limit)
            continue;
        good++;
        sum[0] += result.visibility[0];
        sum[1] += result.visibility[1];
    }
    fit->known[unknown] = good > 0;
    for (int s = 0; s < 2; s++)
        fit->x[unknown][s] = good ? sum[s] / (double)good : 0;
    watch_advance(&run->watch, 1);
    return rays;
}

static uint64_t gather_unknowns(struct vertex_run *run)
{
    uint64_t rays = 0;
#pragma omp parallel num_threads(run->fit->threads) reduction(+ : rays)
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 64)
        for (uint32_t u = 0; u < run->fit->surface.unknown_count; u++)
            if (watch_goes_on(&run->watch))
                rays += gather_unknown(run, u);
        gather_thread_end(saved);
    }
    return rays;
}

static enum cranny_status run_vertices(const struct fit *fit, const struct cranny_tracer *tracer,
                                       struct samples *samples, struct cranny_error *why)
{
    const struct cranny_gather_params wanted = bake_gather_params(fit->params);
    struct vertex_run run = {.fit = fit, .tracer = tracer};
    watch_begin(&run.watch, fit->params->hooks, "trace", fit->surface.unknown_count);
    struct gather_plan *gather;
    uint32_t *first = alloc_array(fit->surface.unknown_count, sizeof *first);
    if (!first)
        return fail_memory(why, "fit");
    for (uint32_t v = fit->surface.vertex_count; v-- > 0;)
        if (fit->surface.unknown_of[v] != SURFACE_NONE)
            first[fit->surface.unknown_of[v]] = v;
    enum cranny_status status = gather_plan_create(&wanted, fit->params->adaptive, &gather, why);
    if (status == CRANNY_OK) {
        run.first = first;
        run.gather = gather;
        samples->rays += gather_unknowns(&run);
        gather_plan_destroy(&gather);
        for (uint32_t u = 0; u < fit->surface.unknown_count; u++)
            samples->invalid += !fit->known[u];
        if (watch_stopped(&run.watch))
            status = fail(why, CRANNY_CANCELLED, "bake: cancelled while tracing");
    }
    free(first);
    return status;
}

enum cranny_status fit_from_vertices(const struct plan *plan, const struct cranny_tracer *tracer,
                                     size_t index, const struct cranny_bake_params *params,
                                     float (*values)[2], struct fit_report *report,
                                     struct samples *samples, struct cranny_error *why)
{
    const struct target *target = &plan->targets[index];
    struct fit fit = {.plan = plan,
                      .target = target,
                      .mesh = plan_mesh(plan, target),
                      .params = params,
                      .threads = thread_count(params->threads)};
    *report = (struct fit_report){0};
    enum cranny_status status = fit_begin(&fit, 0, report, why);
    if (status == CRANNY_OK)
        status = run_vertices(&fit, tracer, samples, why);
    if (status == CRANNY_OK)
        status = fill_unknowns(&fit.surface, fit.known, fit.x, &report->lost_components, why);
    if (status == CRANNY_OK) {
        clamp_unknowns(&fit);
        scatter(&fit, values, report);
    }
    fit_end(&fit);
    return status;
}
