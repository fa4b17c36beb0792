/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013. */
#include "bake/fit.h"
#include "bake/params.h"
#include "base/watch.h"

/* Targets above this many triangles are fitted one after the other with all threads. */
#define BIG_TRIANGLES 100000u

/* Mean visibility below which a scene counts as enclosed. */
#define ENCLOSED 0.08

struct cranny_bake {
    struct cranny_bake_report report;
    uint32_t instance_count;
    uint32_t *target_of;
    size_t target_count;
    float **values; /* per target: vertex_count of each channel, one after the other */
    uint32_t *vertex_counts;
};

struct run {
    uint64_t triangle_total; /* over targets */
    struct watch watch;      /* of the solve */
    const struct cranny_scene *scene;
    const struct cranny_bake_params *params;
    struct cranny_bake *bake;
    struct plan plan;
    struct samples samples;
    struct cranny_tracer *tracer;
    int threads;
};

static enum cranny_status build_tracer(struct run *run, struct cranny_error *why)
{
    const double start = seconds_now();
    struct cranny_tracer_params params = cranny_tracer_params_default();
    params.ground = run->params->ground;
    params.ground_height = run->params->ground_height;
    params.threads = run->params->threads;
    params.hooks = run->params->hooks;
    enum cranny_status status = cranny_tracer_create(run->scene, &params, &run->tracer, why);
    if (status != CRANNY_OK)
        return status;
    run->bake->report.seconds_bvh = seconds_now() - start;
    run->bake->report.bytes_bvh = cranny_tracer_bytes(run->tracer);
    return CRANNY_OK;
}

static enum cranny_status place_samples(struct run *run, struct cranny_error *why)
{
    const double start = seconds_now();
    enum cranny_status status = plan_create(run->scene, run->params, &run->plan, why);
    run->bake->report.seconds_sample = seconds_now() - start;
    return status;
}

static enum cranny_status trace_samples(struct run *run, struct cranny_error *why)
{
    if (run->params->fit == CRANNY_FIT_VERTEX)
        return CRANNY_OK;
    const double start = seconds_now();
    enum cranny_status status =
        samples_collect(&run->plan, run->tracer, run->params, &run->samples, why);
    struct cranny_bake_report *report = &run->bake->report;
    report->seconds_trace = seconds_now() - start;
    report->samples = run->plan.sample_count;
    report->bytes_samples = run->plan.sample_count * (sizeof(struct sample) + 1) +
                            cranny_scene_triangle_count(run->scene) * 4;
    return status;
}

/* v = clamp(1 − intensity (1 − blend)) ^ contrast */
static float remap(const struct cranny_bake_params *params, const float raw[2])
{
    const float blend = (1 - params->short_weight) * raw[0] + params->short_weight * raw[1];
    const float dimmed = clamp_float(1 - params->intensity * (1 - blend), 0, 1);
    return params->contrast == 1 ? dimmed : powf(dimmed, params->contrast);
}

/* The fit's pairs in place become the three channels, one after the other. */
static void spread_channels(const struct cranny_bake_params *params, const float (*raw)[2],
                            uint32_t count, float *values)
{
    for (uint32_t v = 0; v < count; v++) {
        values[v] = remap(params, raw[v]);
        values[(size_t)count + v] = raw[v][0];
        values[2 * (size_t)count + v] = raw[v][1];
    }
}

static enum cranny_status finish_target(struct run *run, size_t index, int threads,
                                        struct fit_report *report, struct cranny_error *why)
{
    const struct target *target = &run->plan.targets[index];
    const uint32_t count = plan_mesh(&run->plan, target)->vertex_count;
    float *values = alloc_array(count, 3 * sizeof *values);
    float(*raw)[2] = alloc_array(count, sizeof *raw);
    run->bake->values[index] = values;
    run->bake->vertex_counts[index] = count;
    enum cranny_status status = values && raw ? CRANNY_OK : fail_memory(why, "values");
    if (status == CRANNY_OK && !(target->area > 0))
        for (uint32_t v = 0; v < count; v++)
            raw[v][0] = raw[v][1] = 1;
    else if (status == CRANNY_OK && run->params->fit == CRANNY_FIT_VERTEX)
        status = fit_from_vertices(&run->plan, run->tracer, index, run->params, raw, report,
                                   &run->samples, why);
    else if (status == CRANNY_OK)
        status = fit_target(&run->plan, &run->samples, index, run->params, threads, &run->watch,
                            raw, report, why);
    if (status == CRANNY_OK)
        spread_channels(run->params, (const float(*)[2])raw, count, values);
    free(raw);
    return status;
}

static uint32_t target_triangles(const struct run *run, size_t index)
{
    return plan_mesh(&run->plan, &run->plan.targets[index])->triangle_count;
}

/* Fitted by all threads together; the others are fitted side by side, which needs no barriers. */
static bool is_big(const struct run *run, size_t index)
{
    const uint64_t triangles = target_triangles(run, index);
    return run->params->fit == CRANNY_FIT_VERTEX ||
           (triangles > BIG_TRIANGLES && triangles * (uint64_t)run->threads > run->triangle_total);
}

struct turn {
    uint32_t triangles, index;
};

static int compare_turns(const void *a, const void *b)
{
    const struct turn *x = a, *y = b;
    if (x->triangles != y->triangles)
        return x->triangles > y->triangles ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

/* Largest first, so that no thread is left with a large one at the end. */
static struct turn *order_targets(struct run *run)
{
    struct turn *turns = alloc_array(run->plan.target_count, sizeof *turns);
    run->triangle_total = 0;
    for (size_t i = 0; turns && i < run->plan.target_count; i++) {
        turns[i] = (struct turn){target_triangles(run, i), (uint32_t)i};
        run->triangle_total += turns[i].triangles;
    }
    if (turns)
        qsort(turns, run->plan.target_count, sizeof *turns, compare_turns);
    return turns;
}

static enum cranny_status stopped(struct run *run, struct cranny_error *why)
{
    return watch_goes_on(&run->watch)
               ? CRANNY_OK
               : fail(why, CRANNY_CANCELLED, "bake: cancelled while solving");
}

static enum cranny_status finish_big(struct run *run, struct fit_report *reports,
                                     struct cranny_error *why)
{
    enum cranny_status status = stopped(run, why);
    for (size_t i = 0; status == CRANNY_OK && i < run->plan.target_count; i++) {
        if (!is_big(run, i))
            continue;
        status = finish_target(run, i, run->threads, &reports[i], why);
        watch_advance(&run->watch, 1);
        if (status == CRANNY_OK)
            status = stopped(run, why);
    }
    return status;
}

static enum cranny_status finish_small(struct run *run, const struct turn *turns,
                                       struct fit_report *reports, struct cranny_error *why)
{
    int failed = CRANNY_OK;
#pragma omp parallel for num_threads(run->threads) schedule(dynamic, 1)
    for (size_t turn = 0; turn < run->plan.target_count; turn++) {
        const size_t i = turns[turn].index;
        int seen;
#pragma omp atomic read
        seen = failed;
        if (seen != CRANNY_OK || is_big(run, i))
            continue;
        struct cranny_error own = {0};
        enum cranny_status status = stopped(run, &own);
        if (status == CRANNY_OK)
            status = finish_target(run, i, 1, &reports[i], &own);
        watch_advance(&run->watch, 1);
        if (status == CRANNY_OK)
            continue;
#pragma omp critical
        {
#pragma omp atomic write
            failed = (int)status;
            if (why)
                *why = own;
        }
    }
    return failed == CRANNY_OK ? stopped(run, why) : (enum cranny_status)failed;
}

/* At 300 m a courtyard is all walls. Right, but not what most people expect to see. */
static void warn_enclosed(const struct run *run)
{
    double bounds[6], size = 0;
    cranny_scene_bounds(run->plan.scene, bounds);
    for (int k = 0; k < 3; k++)
        size = fmax(size, bounds[3 + k] - bounds[k]);
    const double wanted = 0.2 * size;
    if (wanted < run->params->distance_long)
        hook_warn(run->params->hooks,
                  "the scene is mostly enclosed: at distance_long = %g m the mean visibility is "
                  "%.2f, and ambient light nearly vanishes; for a look at the scene's own scale "
                  "set distance_long to about %.1g",
                  (double)run->params->distance_long, run->bake->report.mean_visibility, wanted);
}

static void sum_reports(struct run *run, const struct fit_report *reports)
{
    struct cranny_bake_report *report = &run->bake->report;
    double squares = 0, weight = 0, visibility = 0;
    size_t unconverged = 0;
    for (size_t i = 0; i < run->plan.target_count; i++) {
        report->unsampled_vertices += reports[i].unsampled_vertices;
        report->lost_components += reports[i].lost_components;
        report->solver_iterations_max = fmax(report->solver_iterations_max, reports[i].iterations);
        if (reports[i].bytes > report->bytes_solve)
            report->bytes_solve = reports[i].bytes;
        squares += reports[i].squares;
        weight += reports[i].weight;
        visibility += reports[i].visibility;
        unconverged += (size_t)reports[i].unconverged;
    }
    report->fit_rms = weight > 0 ? sqrt(squares / weight) : 0;
    report->mean_visibility = weight > 0 ? visibility / weight : 1;
    if (report->mean_visibility < ENCLOSED)
        warn_enclosed(run);
    if (unconverged)
        hook_warn(run->params->hooks,
                  "the least-squares fit of %zu meshes stopped before it had converged; lower "
                  "alpha if they look blotchy",
                  unconverged);
}

static enum cranny_status fit_all(struct run *run, struct cranny_error *why)
{
    const double start = seconds_now();
    struct cranny_bake *bake = run->bake;
    const size_t count = run->plan.target_count;
    bake->values = alloc_array(count, sizeof *bake->values);
    bake->vertex_counts = alloc_array(count, sizeof *bake->vertex_counts);
    struct fit_report *reports = alloc_array(count, sizeof *reports);
    enum cranny_status status = CRANNY_OK;
    if (!bake->values || !bake->vertex_counts || !reports) {
        free(reports);
        return fail_memory(why, "values");
    }
    bake->target_count = count;
    struct turn *turns = order_targets(run);
    watch_begin(&run->watch, run->params->hooks, "solve", count);
    status = turns ? finish_big(run, reports, why) : fail_memory(why, "values");
    if (status == CRANNY_OK)
        status = finish_small(run, turns, reports, why);
    free(turns);
    if (status == CRANNY_OK)
        sum_reports(run, reports);
    free(reports);
    *(run->params->fit == CRANNY_FIT_VERTEX ? &bake->report.seconds_trace
                                            : &bake->report.seconds_solve) = seconds_now() - start;
    return status;
}

static enum cranny_status bake_run(struct run *run, struct cranny_error *why)
{
    enum cranny_status status = place_samples(run, why);
    if (status == CRANNY_OK)
        status = build_tracer(run, why);
    if (status == CRANNY_OK)
        status = trace_samples(run, why);
    if (status == CRANNY_OK)
        status = fit_all(run, why);
    return status;
}

static void finish_report(struct run *run)
{
    struct cranny_bake_report *report = &run->bake->report;
    report->meshes = run->plan.target_count;
    report->instances = run->scene->instance_count;
    report->vertices = cranny_scene_vertex_count(run->scene);
    report->triangles = cranny_scene_triangle_count(run->scene);
    report->rays = run->samples.rays;
    report->invalid_samples = run->samples.invalid;
    report->mrays_per_s =
        report->seconds_trace > 0 ? (double)report->rays * 1e-6 / report->seconds_trace : 0;
    run->bake->target_of = run->plan.target_of;
    run->plan.target_of = NULL;
}

enum cranny_status cranny_bake_create(const struct cranny_scene *scene,
                                      const struct cranny_bake_params *params,
                                      struct cranny_bake **bake, struct cranny_error *why)
{
    const struct cranny_bake_params defaults = cranny_bake_params_default();
    *bake = NULL;
    struct run run = {.scene = scene, .params = params ? params : &defaults};
    enum cranny_status status = bake_params_check(run.params, why);
    if (status != CRANNY_OK)
        return status;
    run.threads = thread_count(run.params->threads);
    run.bake = alloc_array(1, sizeof *run.bake);
    if (!run.bake)
        return fail_memory(why, "bake");
    run.bake->instance_count = (uint32_t)scene->instance_count;
    status = bake_run(&run, why);
    if (status == CRANNY_OK)
        finish_report(&run);
    samples_free(&run.samples);
    plan_free(&run.plan);
    cranny_tracer_destroy(&run.tracer);
    if (status != CRANNY_OK)
        cranny_bake_destroy(&run.bake);
    *bake = run.bake;
    return status;
}

void cranny_bake_destroy(struct cranny_bake **bake)
{
    if (!*bake)
        return;
    for (size_t i = 0; i < (*bake)->target_count; i++)
        free((*bake)->values[i]);
    free((*bake)->values);
    free((*bake)->vertex_counts);
    free((*bake)->target_of);
    free(*bake);
    *bake = NULL;
}

const float *cranny_bake_values(const struct cranny_bake *bake, uint32_t instance,
                                enum cranny_channel channel)
{
    const uint32_t target = bake->target_of[instance];
    return bake->values[target] + (size_t)channel * bake->vertex_counts[target];
}

void cranny_bake_get_report(const struct cranny_bake *bake, struct cranny_bake_report *report)
{
    *report = bake->report;
}
