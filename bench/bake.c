/* Baking, timed and measured: Cranny against the straightforward baker, which shoots independent
 * random cosine rays from the vertices one at a time. Both errors are root mean squares against
 * ray-traced truth at points spread over the surface by area, between interpolated vertex values
 * and 16,384 rays a point.
 *
 *     bench-bake [--points N] [--truth-rays N] [--repeat N] [--set NAME=VALUE]... [--rays A,B,...]
 *                [--baseline A,B,...|none] [--json] SCENE...
 */
#include "truth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define RUNS_MAX 16

struct options {
    size_t points;
    int truth_rays, repeat;
    int rays[RUNS_MAX], baseline[RUNS_MAX];
    int ray_count, baseline_count;
    struct cranny_bake_params bake;
    bool json;
};

struct outcome {
    int rays;
    double seconds, rms;
    struct cranny_bake_report report;
};

struct table {
    const char *scene;
    uint64_t vertices, triangles;
    double seconds_load, seconds_bvh, floor_rms;
    struct outcome baseline[RUNS_MAX], cranny[RUNS_MAX];
    size_t points;
};

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int compare_outcomes(const void *a, const void *b)
{
    const struct outcome *x = a, *y = b;
    return (x->seconds > y->seconds) - (x->seconds < y->seconds);
}

static float **values_alloc(const struct cranny_scene *scene)
{
    const uint32_t count = cranny_scene_instance_count(scene);
    float **values = calloc(count + 1, sizeof *values);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t mesh = cranny_scene_instance(scene, i)->mesh;
        values[i] = calloc(cranny_scene_mesh(scene, mesh)->vertex_count + 1, sizeof(float));
    }
    return values;
}

static void values_free(const struct cranny_scene *scene, float **values)
{
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++)
        free(values[i]);
    free(values);
}

static uint32_t vertices_of(const struct cranny_scene *scene, uint32_t instance)
{
    return cranny_scene_mesh(scene, cranny_scene_instance(scene, instance)->mesh)->vertex_count;
}

/* The vertices of all instances, one after the other, in one go: the baseline must not pay for many
 * small calls. */
static void list_vertices(const struct cranny_scene *scene, float (*positions)[3],
                          float (*normals)[3])
{
    size_t first = 0;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        world_vertices(scene, i, positions + first, normals + first);
        first += vertices_of(scene, i);
    }
}

static void blend_vertices(const struct cranny_scene *scene, const float (*both)[2],
                           float short_weight, float **values)
{
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const uint32_t count = vertices_of(scene, i);
        for (uint32_t v = 0; v < count; v++)
            values[i][v] = (1 - short_weight) * both[v][0] + short_weight * both[v][1];
        both += count;
    }
}

static enum cranny_status run_baseline(const struct cranny_scene *scene,
                                       const struct cranny_tracer *tracer,
                                       const struct truth *truth, const struct options *options,
                                       double seconds_bvh, struct outcome *outcome,
                                       struct cranny_error *why)
{
    struct cranny_gather_params gather = cranny_gather_params_default();
    gather.rays = outcome->rays;
    gather.sampler = CRANNY_SAMPLER_RANDOM;
    gather.packet = CRANNY_PACKET_1;
    gather.distances[0] = options->bake.distance_long;
    gather.distances[1] = options->bake.distance_short;
    gather.kernel = (enum cranny_kernel)options->bake.kernel;
    gather.threads = options->bake.threads;
    const size_t count = (size_t)cranny_scene_vertex_count(scene);
    float **values = values_alloc(scene);
    float(*positions)[3] = calloc(count + 1, sizeof *positions);
    float(*normals)[3] = calloc(count + 1, sizeof *normals);
    float(*both)[2] = calloc(count + 1, sizeof *both);
    const double start = now();
    list_vertices(scene, positions, normals);
    enum cranny_status status =
        cranny_gather(tracer, count, (const float(*)[3])positions, (const float(*)[3])normals, NULL,
                      &gather, both, NULL, why);
    outcome->seconds = now() - start + seconds_bvh;
    blend_vertices(scene, (const float(*)[2])both, options->bake.short_weight, values);
    outcome->rms = truth_rms(truth, scene, (const float *const *)values);
    free(positions);
    free(normals);
    free(both);
    values_free(scene, values);
    return status;
}

static double bake_rms(const struct cranny_scene *scene, const struct cranny_bake *bake,
                       const struct truth *truth)
{
    const uint32_t count = cranny_scene_instance_count(scene);
    const float **values = calloc(count + 1, sizeof *values);
    for (uint32_t i = 0; i < count; i++)
        values[i] = cranny_bake_values(bake, i, CRANNY_CHANNEL_VISIBILITY);
    const double rms = truth_rms(truth, scene, values);
    free(values);
    return rms;
}

static enum cranny_status run_cranny(const struct cranny_scene *scene, const struct truth *truth,
                                     const struct options *options, struct outcome *outcome,
                                     struct cranny_error *why)
{
    struct outcome runs[RUNS_MAX];
    struct cranny_bake_params params = options->bake;
    params.rays = outcome->rays;
    for (int i = 0; i < options->repeat; i++) {
        struct cranny_bake *bake;
        const double start = now();
        enum cranny_status status = cranny_bake_create(scene, &params, &bake, why);
        if (status != CRANNY_OK)
            return status;
        runs[i] = (struct outcome){.rays = outcome->rays, .seconds = now() - start};
        runs[i].rms = bake_rms(scene, bake, truth);
        cranny_bake_get_report(bake, &runs[i].report);
        cranny_bake_destroy(&bake);
    }
    qsort(runs, (size_t)options->repeat, sizeof *runs, compare_outcomes);
    *outcome = runs[options->repeat / 2];
    return CRANNY_OK;
}

/* Seconds until `rms` is reached, interpolated along the runs on log scales; NaN: never. */
static double time_to(const struct outcome *runs, int count, double rms)
{
    if (count && runs[0].rms <= rms)
        return runs[0].seconds;
    for (int i = 1; i < count; i++) {
        if (runs[i].rms > rms)
            continue;
        const double span = log(runs[i - 1].rms / runs[i].rms);
        const double t = span > 0 ? log(runs[i - 1].rms / rms) / span : 1;
        return runs[i - 1].seconds * pow(runs[i].seconds / runs[i - 1].seconds, t);
    }
    return NAN;
}

static void print_text(const struct table *table, const struct options *options)
{
    printf("\n%s: %llu vertices, %llu triangles, %zu points of truth; load %.2f s, bvh %.2f s\n",
           table->scene, (unsigned long long)table->vertices, (unsigned long long)table->triangles,
           table->points, table->seconds_load, table->seconds_bvh);
    for (int i = 0; i < options->baseline_count; i++)
        printf("  straightforward %5d rays a vertex   %8.3f s  rms %.5f\n", table->baseline[i].rays,
               table->baseline[i].seconds, table->baseline[i].rms);
    for (int i = 0; i < options->ray_count; i++) {
        const struct outcome *run = &table->cranny[i];
        const struct cranny_bake_report *r = &run->report;
        printf("  cranny %5d rays a sample  %8.3f s  rms %.5f  | %.2f M samples (%.1f %% buried) "
               "%.1f Mrays/s; bvh %.3f sample %.3f trace %.3f solve %.3f s, %g iterations; MB bvh "
               "%.0f samples %.0f solve %.0f; fit rms %.4f\n",
               run->rays, run->seconds, run->rms, (double)r->samples * 1e-6,
               r->samples ? 100.0 * (double)r->invalid_samples / (double)r->samples : 0,
               r->mrays_per_s, r->seconds_bvh, r->seconds_sample, r->seconds_trace,
               r->seconds_solve, r->solver_iterations_max, (double)r->bytes_bvh * 1e-6,
               (double)r->bytes_samples * 1e-6, (double)r->bytes_solve * 1e-6, r->fit_rms);
    }
    for (int i = 0; i < options->baseline_count; i++) {
        const double ours = time_to(table->cranny, options->ray_count, table->baseline[i].rms);
        printf("  to the error of %d independent rays a vertex: %.3f s against %.3f s, %.1f times "
               "faster\n",
               table->baseline[i].rays, ours, table->baseline[i].seconds,
               table->baseline[i].seconds / ours);
    }
}

/* NaN has no JSON: null. */
static void print_number(const char *name, double value, const char *end)
{
    if (isfinite(value))
        printf("\"%s\":%.6g%s", name, value, end);
    else
        printf("\"%s\":null%s", name, end);
}

static void print_run(const struct outcome *run, const char *end)
{
    const struct cranny_bake_report *r = &run->report;
    printf("{\"rays\":%d,", run->rays);
    print_number("seconds", run->seconds, ",");
    print_number("rms", run->rms, ",");
    printf("\"samples\":%llu,\"invalid_samples\":%llu,", (unsigned long long)r->samples,
           (unsigned long long)r->invalid_samples);
    print_number("mrays_per_s", r->mrays_per_s, ",");
    print_number("seconds_bvh", r->seconds_bvh, ",");
    print_number("seconds_sample", r->seconds_sample, ",");
    print_number("seconds_trace", r->seconds_trace, ",");
    print_number("seconds_solve", r->seconds_solve, ",");
    printf("\"bytes_bvh\":%llu,\"bytes_samples\":%llu,\"bytes_solve\":%llu}%s",
           (unsigned long long)r->bytes_bvh, (unsigned long long)r->bytes_samples,
           (unsigned long long)r->bytes_solve, end);
}

static void print_json(const struct table *table, const struct options *options)
{
    printf("{\"scene\":\"%s\",\"vertices\":%llu,\"triangles\":%llu,\"points\":%zu,", table->scene,
           (unsigned long long)table->vertices, (unsigned long long)table->triangles,
           table->points);
    print_number("seconds_load", table->seconds_load, ",\"baseline\":[");
    for (int i = 0; i < options->baseline_count; i++) {
        printf("{\"rays\":%d,", table->baseline[i].rays);
        print_number("seconds", table->baseline[i].seconds, ",");
        print_number("rms", table->baseline[i].rms, i + 1 < options->baseline_count ? "}," : "}");
    }
    printf("],\"cranny\":[");
    for (int i = 0; i < options->ray_count; i++)
        print_run(&table->cranny[i], i + 1 < options->ray_count ? "," : "");
    printf("],\"equal_error\":[");
    for (int i = 0; i < options->baseline_count; i++) {
        const double ours = time_to(table->cranny, options->ray_count, table->baseline[i].rms);
        printf("{\"baseline_rays\":%d,", table->baseline[i].rays);
        print_number("seconds", ours, ",");
        print_number("ratio", table->baseline[i].seconds / ours,
                     i + 1 < options->baseline_count ? "}," : "}");
    }
    printf("]}\n");
}

static enum cranny_status measure(const struct cranny_scene *scene, struct options *options,
                                  struct table *table, struct cranny_error *why)
{
    struct cranny_tracer *tracer;
    struct truth truth;
    struct cranny_tracer_params tracing = cranny_tracer_params_default();
    tracing.ground = options->bake.ground;
    tracing.ground_height = options->bake.ground_height;
    tracing.threads = options->bake.threads;
    const double start = now();
    enum cranny_status status = cranny_tracer_create(scene, &tracing, &tracer, why);
    if (status != CRANNY_OK)
        return status;
    table->seconds_bvh = now() - start;
    status = truth_create(scene, tracer, &options->bake, options->points, options->truth_rays,
                          &truth, why);
    table->points = truth.count;
    for (int i = 0; status == CRANNY_OK && i < options->baseline_count; i++) {
        table->baseline[i].rays = options->baseline[i];
        status = run_baseline(scene, tracer, &truth, options, table->seconds_bvh,
                              &table->baseline[i], why);
    }
    for (int i = 0; status == CRANNY_OK && i < options->ray_count; i++) {
        table->cranny[i].rays = options->rays[i];
        status = run_cranny(scene, &truth, options, &table->cranny[i], why);
    }
    truth_free(&truth);
    cranny_tracer_destroy(&tracer);
    return status;
}

static enum cranny_status bench_scene(const char *path, struct options *options,
                                      struct cranny_error *why)
{
    struct cranny_scene *scene;
    struct table table = {.scene = path};
    const double start = now();
    enum cranny_status status = cranny_scene_load(path, NULL, &scene, why);
    if (status != CRANNY_OK)
        return status;
    table.seconds_load = now() - start;
    table.vertices = cranny_scene_vertex_count(scene);
    table.triangles = cranny_scene_triangle_count(scene);
    status = measure(scene, options, &table, why);
    if (status == CRANNY_OK)
        (options->json ? print_json : print_text)(&table, options);
    fflush(stdout);
    cranny_scene_destroy(&scene);
    return status;
}

static int parse_list(const char *text, int *list)
{
    int count = 0;
    if (strcmp(text, "none") == 0)
        return 0;
    for (char *end; count < RUNS_MAX && *text; text = *end ? end + 1 : end) {
        list[count++] = (int)strtol(text, &end, 10);
        if (end == text)
            break;
    }
    return count;
}

static bool parse_set(const char *text, struct cranny_bake_params *params)
{
    char name[64];
    const char *equals = strchr(text, '=');
    struct cranny_error why = {0};
    if (!equals || (size_t)(equals - text) >= sizeof name)
        return false;
    memcpy(name, text, (size_t)(equals - text));
    name[equals - text] = 0;
    if (cranny_params_set(cranny_bake_param_table(), params, name, equals + 1, &why) == CRANNY_OK)
        return true;
    fprintf(stderr, "bench-bake: %s\n", why.message);
    return false;
}

static bool parse_option(struct options *options, const char *name, const char *value)
{
    if (strcmp(name, "--points") == 0)
        return (options->points = strtoul(value, NULL, 10)) > 0;
    if (strcmp(name, "--truth-rays") == 0)
        return (options->truth_rays = (int)strtol(value, NULL, 10)) > 0;
    if (strcmp(name, "--repeat") == 0) {
        options->repeat = (int)strtol(value, NULL, 10);
        return options->repeat > 0 && options->repeat <= RUNS_MAX;
    }
    if (strcmp(name, "--rays") == 0)
        return (options->ray_count = parse_list(value, options->rays)) > 0;
    if (strcmp(name, "--baseline") == 0) {
        options->baseline_count = parse_list(value, options->baseline);
        return true;
    }
    return strcmp(name, "--set") == 0 && parse_set(value, &options->bake);
}

int main(int argc, char **argv)
{
    struct options options = {.points = 4000,
                              .truth_rays = 16384,
                              .repeat = 3,
                              .rays = {1, 2, 4, 8, 16, 32},
                              .ray_count = 6,
                              .baseline = {16, 64, 256},
                              .baseline_count = 3,
                              .bake = cranny_bake_params_default()};
    struct cranny_error why = {0};
    int scenes = 0;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--json") == 0) {
            options.json = true;
        } else if (argv[i][0] == '-') {
            if (i + 1 >= argc || !parse_option(&options, argv[i], argv[i + 1])) {
                fprintf(stderr, "bench-bake: %s is not understood; see the top of bench/bake.c\n",
                        argv[i]);
                return 2;
            }
            i++;
        } else if (bench_scene(argv[i], &options, &why) != CRANNY_OK) {
            fprintf(stderr, "bench-bake: %s\n", why.message);
            return 1;
        } else {
            scenes++;
        }
    }
    if (!scenes)
        fprintf(stderr, "bench-bake: name at least one scene\n");
    return scenes ? 0 : 2;
}
