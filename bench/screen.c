/* What a frame costs: each method and preset at two sizes; each instruction set against the
 * portable build; cost against radius, samples and pixels (McGuire et al. 2011, Fig. 9; Bavoil,
 * Sainz 2009, Table 6.2.1); and how far that is from what the memory and the gathers of this
 * machine allow.
 *
 * Usage: bench-screen [--json] [--runs N] [--threads N] [SCENE-VIEW, as in "sponza nave"]
 * The view comes from CRANNY_SCENES; without it, a generated frame of waves stands in. Times are
 * medians of the runs in milliseconds, all in one process. */
#include "views.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { RUNS_MAX = 99 };

struct bench {
    int runs, threads, width, height;
    bool json, first;
    float radius_world;
    struct cranny_workspace *workspace;
    float *visibility;
    struct cranny_gbuffer gbuffer;
};

struct timing {
    double total, prepare, estimate, filter, spread;
};

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare);
    return values[count / 2];
}

static struct timing run(struct bench *b, struct cranny_screen_params params)
{
    double total[RUNS_MAX], prepare[RUNS_MAX], estimate[RUNS_MAX], filter[RUNS_MAX];
    struct cranny_screen_report report;
    struct cranny_error why;
    params.radius_world = params.radius_world > 0 ? params.radius_world : b->radius_world;
    params.workspace = b->workspace;
    params.report = &report;
    params.threads = b->threads;
    for (int i = -2; i < b->runs; i++) {
        if (cranny_screen_render(&b->gbuffer, &params, b->visibility, 0, &why) != CRANNY_OK) {
            fprintf(stderr, "bench-screen: %s\n", why.message);
            exit(1);
        }
        if (i < 0)
            continue;
        total[i] = report.total_ms;
        prepare[i] = report.prepare_ms;
        estimate[i] = report.estimate_ms;
        filter[i] = report.filter_ms;
    }
    struct timing t = {.total = median(total, b->runs)};
    t.spread = (total[b->runs * 3 / 4] - total[b->runs / 4]) / t.total;
    t.prepare = median(prepare, b->runs);
    t.estimate = median(estimate, b->runs);
    t.filter = median(filter, b->runs);
    return t;
}

static struct cranny_screen_params wish(enum cranny_method method, const char *preset)
{
    struct cranny_screen_params params = cranny_screen_params_preset(method, preset);
    params.radius_world = 0;
    return params;
}

static void row(struct bench *b, const char *table, const char *name, const struct timing *t,
                double ratio)
{
    if (b->json) {
        printf("%s\n  {\"table\": \"%s\", \"name\": \"%s\", \"width\": %d, \"height\": %d, "
               "\"total_ms\": %.3f, \"prepare_ms\": %.3f, \"estimate_ms\": %.3f, \"filter_ms\": "
               "%.3f, \"spread\": %.3f, \"ratio\": %.3f}",
               b->first ? "" : ",", table, name, b->width, b->height, t->total, t->prepare,
               t->estimate, t->filter, t->spread, ratio);
        b->first = false;
        return;
    }
    printf("| %s | %d x %d | %.2f | %.2f | %.2f | %.2f | %.0f %% | %.2f |\n", name, b->width,
           b->height, t->total, t->prepare, t->estimate, t->filter, 100 * t->spread, ratio);
}

static void head(const struct bench *b, const char *title, const char *ratio)
{
    if (!b->json)
        printf("\n### %s\n\n| what | pixels | total ms | prepare | estimate | filter | spread | %s "
               "|\n|---|---|---|---|---|---|---|---|\n",
               title, ratio);
}

static void bench_methods(struct bench *b)
{
    static const char *const presets[] = {"calibrated", "paper"};
    head(b, "Methods", "frames a second");
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        for (int k = 0; k < 2; k++) {
            char name[64];
            const struct timing t = run(b, wish((enum cranny_method)m, presets[k]));
            snprintf(name, sizeof name, "%s %s", cranny_method_name((enum cranny_method)m),
                     presets[k]);
            row(b, "methods", name, &t, 1000 / t.total);
        }
    struct cranny_screen_params full = wish(CRANNY_HBAO, NULL), half = full;
    full.directions = full.steps = 8;
    half.resolution = CRANNY_RESOLUTION_HALF;
    struct timing t = run(b, half);
    row(b, "methods", "hbao 4x4 half resolution", &t, 1000 / t.total);
    t = run(b, full);
    row(b, "methods", "hbao 8x8 full resolution", &t, 1000 / t.total);
}

static void bench_isas(struct bench *b)
{
    head(b, "Instruction sets", "times the portable build");
    for (int m = 0; m < CRANNY_RAYMARCH; m++) {
        double portable = 0;
        for (int isa = CRANNY_ISA_PORTABLE; isa <= (int)cranny_isa_best(); isa++) {
            struct cranny_screen_params params = wish((enum cranny_method)m, NULL);
            params.isa = isa;
            const struct timing t = run(b, params);
            char name[64];
            portable = isa == CRANNY_ISA_PORTABLE ? t.total : portable;
            snprintf(name, sizeof name, "%s %s", cranny_method_name((enum cranny_method)m),
                     cranny_isa_name((enum cranny_isa)isa));
            row(b, "isa", name, &t, portable / t.total);
        }
    }
}

static void bench_radius(struct bench *b)
{
    head(b, "Alchemy against radius", "times the smallest");
    double first = 0;
    for (int i = 0; i < 6; i++) {
        struct cranny_screen_params params = wish(CRANNY_ALCHEMY, NULL);
        char name[64];
        params.radius_world = b->radius_world * ldexpf(1, i - 3);
        params.bands = 1;
        const struct timing t = run(b, params);
        first = i ? first : t.total;
        snprintf(name, sizeof name, "radius %g", (double)params.radius_world);
        row(b, "radius", name, &t, t.total / first);
    }
}

static void bench_samples(struct bench *b)
{
    head(b, "Alchemy against samples", "times 4 samples");
    double first = 0;
    for (int samples = 4; samples <= 64; samples *= 2) {
        struct cranny_screen_params params = wish(CRANNY_ALCHEMY, NULL);
        char name[64];
        params.samples = samples;
        params.bands = 1;
        const struct timing t = run(b, params);
        first = samples == 4 ? t.total : first;
        snprintf(name, sizeof name, "%d samples", samples);
        row(b, "samples", name, &t, t.total / first);
    }
    head(b, "HBAO against directions and steps", "times 4/4");
    for (int n = 4; n <= 16; n *= 2) {
        struct cranny_screen_params params = wish(CRANNY_HBAO, NULL);
        char name[64];
        params.directions = params.steps = n;
        const struct timing t = run(b, params);
        first = n == 4 ? t.total : first;
        snprintf(name, sizeof name, "%d/%d", n, n);
        row(b, "directions", name, &t, t.total / first);
    }
}

/* Seconds for a copy of the size of a float plane, and for as many gathers as alchemy makes: what
 * the machine gives to a program that does nothing else, on the same threads. */
static void bench_limits(struct bench *b)
{
    const size_t pixels = (size_t)b->width * (size_t)b->height;
    float *from = malloc(pixels * sizeof *from), *to = malloc(pixels * sizeof *to);
    double copies[9];
    for (size_t i = 0; from && to && i < pixels; i++)
        from[i] = to[i] = (float)i;
    for (int k = 0; k < 9 && from && to; k++) {
        const double begin = now_ms();
#pragma omp parallel for schedule(static)
        for (int y = 0; y < b->height; y++)
            memcpy(to + (size_t)y * (size_t)b->width, from + (size_t)y * (size_t)b->width,
                   (size_t)b->width * sizeof *to);
        copies[k] = now_ms() - begin;
    }
    struct cranny_screen_params params = wish(CRANNY_ALCHEMY, NULL);
    const struct timing t = run(b, params);
    const double copy = from && to ? median(copies, 9) : NAN;
    /* Prepare reads depth and normals (16 bytes) and writes them (16), reads them for the edges
     * (16) and writes a byte; the estimate reads 16 and writes 4; a blur reads 5 and writes 4, each
     * way; the result is copied (8). */
    const double bytes = 16 + 16 + 16 + 1 + 16 + 4 + 2 * 9 + 8, copy_bytes = 8;
    if (b->json)
        printf("%s\n  {\"table\": \"limits\", \"copy_ms\": %.3f, \"bytes_per_pixel\": %g, "
               "\"fetches_per_pixel\": %d, \"bandwidth_limit_ms\": %.3f, \"total_ms\": %.3f}",
               b->first ? "" : ",", copy, bytes, params.samples, copy * bytes / copy_bytes,
               t.total);
    else
        printf(
            "\n### Limits\n\nA copy of one float plane takes %.2f ms. Alchemy moves %g bytes and "
            "makes %d fetches a pixel:\nat the speed of the copy %.2f ms; measured %.2f ms, %.1f "
            "times that. Its estimator takes %.2f ns a fetch.\n",
            copy, bytes, params.samples, copy * bytes / copy_bytes, t.total,
            t.total / (copy * bytes / copy_bytes),
            1e6 * t.estimate / ((double)pixels * params.samples));
    b->first = false;
    free(from);
    free(to);
}

/* Waves on a plain, for machines without the scenes. */
static void generate(struct bench *b, float *depth, float (*normals)[3])
{
    for (int y = 0; y < b->height; y++)
        for (int x = 0; x < b->width; x++) {
            const size_t i = (size_t)y * (size_t)b->width + (size_t)x;
            const float v = 1.2f * ((float)y + 0.5f) / (float)b->height - 0.2f;
            depth[i] = v > 0.02f
                           ? 2 / v * (1 + 0.01f * sinf(0.05f * (float)x) * cosf(0.06f * (float)y))
                           : INFINITY;
        }
    b->gbuffer = (struct cranny_gbuffer){
        .width = b->width,
        .height = b->height,
        .depth = depth,
        .projection = cranny_perspective(1, (float)b->width / (float)b->height)};
    struct cranny_error why;
    if (cranny_normals_reconstruct(&b->gbuffer, 0, normals[0], 0, &why) == CRANNY_OK)
        b->gbuffer.normal = normals;
}

static void bench_all(struct bench *b, bool small)
{
    b->visibility = malloc((size_t)b->width * (size_t)b->height * sizeof *b->visibility);
    if (!b->visibility)
        return;
    bench_methods(b);
    if (small) {
        bench_isas(b);
        bench_radius(b);
        bench_samples(b);
    }
    bench_limits(b);
    free(b->visibility);
}

static const struct view *find_view(const char *text)
{
    for (int i = 0; i < view_count; i++) {
        char name[64];
        snprintf(name, sizeof name, "%s %s", views[i].scene, views[i].name);
        if (strcmp(name, text) == 0)
            return &views[i];
    }
    return NULL;
}

static int bench_sizes(struct bench *b, const struct view *view)
{
    static const int sizes[2][2] = {{1280, 720}, {1920, 1080}};
    struct view_stage stage = {0};
    struct cranny_error why = {0};
    char *path = view_path(view);
    for (int s = 0; s < 2; s++) {
        struct view_sight sight = {0};
        b->width = sizes[s][0];
        b->height = sizes[s][1];
        const size_t pixels = (size_t)b->width * (size_t)b->height;
        float *depth = malloc(pixels * sizeof *depth);
        float(*normals)[3] = malloc(pixels * sizeof *normals);
        b->radius_world = path ? view->radius_world : 0.5f;
        if (path && view_see(&stage, view, b->width, b->height, 1, NULL, &sight, &why) != CRANNY_OK)
            fprintf(stderr, "bench-screen: %s\n", why.message);
        if (sight.frame)
            b->gbuffer = sight.gbuffer;
        else if (depth && normals)
            generate(b, depth, normals);
        bench_all(b, s == 0);
        view_sight_free(&sight);
        free(depth);
        free(normals);
    }
    view_leave(&stage);
    free(path);
    return 0;
}

int main(int argc, char **argv)
{
    struct bench b = {.runs = 15, .first = true};
    struct cranny_error why;
    const struct view *view = &views[0];
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--json") == 0)
            b.json = true;
        else if (strcmp(argv[i], "--runs") == 0 && i + 1 < argc)
            b.runs = atoi(argv[++i]);
        else if (strcmp(argv[i], "--threads") == 0 && i + 1 < argc)
            b.threads = atoi(argv[++i]);
        else
            view = find_view(argv[i]);
        if (!view || b.runs < 1 || b.runs > RUNS_MAX || b.threads < 0) {
            fprintf(stderr, "bench-screen: wrong usage; see the head of bench/screen.c\n");
            return 2;
        }
    }
    if (cranny_workspace_create(&b.workspace, &why) != CRANNY_OK)
        return 1;
    if (b.json)
        printf("[");
    else
        printf("## Screen space: %s %s\n", view->scene, view->name);
    const int status = bench_sizes(&b, view);
    if (b.json)
        printf("\n]\n");
    cranny_workspace_destroy(&b.workspace);
    return status;
}
