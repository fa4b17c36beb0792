/* The filters for buffers that are not Cranny's own: a frame's pipeline with everything but the
 * estimate. */
#include "screen/pipeline.h"

#include <cranny/filter.h>

struct cranny_edges {
    struct canvas canvas; /* width 0: no frame */
    struct screen_constants constants;
    struct cranny_workspace memory; /* what the canvas points into */
};

static const char *const isa_names[] = {"auto", "portable", "avx2", "avx512", NULL};

#define ROW(NAME, TYPE, UNIT, LOW, HIGH, DEFAULT, CHOICES, HELP)                                   \
    {                                                                                              \
        .name = #NAME, .offset = offsetof(struct cranny_filter_params, NAME),                      \
        .type = CRANNY_PARAM_##TYPE, .unit = UNIT, .minimum = LOW, .maximum = HIGH,                \
        .fallback = DEFAULT, .choices = CHOICES, .help = HELP                                      \
    }

static const struct cranny_param rows[] = {
    ROW(tolerance_world, FLOAT, "m", 1e-9, 1e9, 0.05, NULL,
        "distance from each other's plane at which surfaces are apart"),
    ROW(normal_cosine, FLOAT, "", -1, 0.999, 0.6, NULL,
        "cosine of the angle at which surfaces are apart"),
    ROW(reach_px, INT, "pixels", 1, FILTER_RADIUS_MAX, 3, NULL,
        "taps of the bilateral filter on each side"),
    ROW(wide_px, FLOAT, "pixels", 0.1, 256, 20, NULL, "deviation of the wide Gaussian"),
    ROW(near_px, FLOAT, "pixels", 0.1, 256, 5, NULL, "deviation of the near Gaussian"),
    ROW(wide_gain, FLOAT, "", 0, 10, 1, NULL, "factor on what the wide Gaussian blurs"),
    ROW(near_gain, FLOAT, "", 0, 10, 1, NULL, "factor on what the near Gaussian blurs"),
    ROW(blend, FLOAT, "", 0, 1, 0.5, NULL, "share of the near Gaussian"),
    ROW(edge_bloom, BOOL, "", 0, 1, 1, NULL, "bloom within edges only"),
    ROW(isa, ENUM, "", 0, COUNT_OF(isa_names) - 2, CRANNY_ISA_AUTO, isa_names,
        "instruction set of the kernels; same result, bit for bit"),
    ROW(threads, INT, "threads", 0, 1024, 0, NULL, "threads to use, 0 for all cores; same result"),
};
static const struct cranny_param_table table = {"filter", rows, COUNT_OF(rows)};

const struct cranny_param_table *cranny_filter_param_table(void)
{
    return &table;
}

struct cranny_filter_params cranny_filter_params_default(void)
{
    struct cranny_filter_params params = {0};
    cranny_params_defaults(&table, &params);
    return params;
}

/* `given` or the defaults, checked, into *params. */
static enum cranny_status read_params(const struct cranny_filter_params *given,
                                      struct cranny_filter_params *params, struct cranny_error *why)
{
    *params = given ? *given : cranny_filter_params_default();
    return cranny_params_validate(&table, params, why);
}

static struct cranny_rect whole(const struct canvas *canvas)
{
    return (struct cranny_rect){0, 0, canvas->width, canvas->height};
}

enum cranny_status cranny_edges_update(struct cranny_edges *edges,
                                       const struct cranny_gbuffer *gbuffer,
                                       const struct cranny_filter_params *given,
                                       struct cranny_error *why)
{
    struct cranny_filter_params params;
    if (!edges || !gbuffer)
        return fail(why, CRANNY_USAGE, "edges: they and a G-buffer are needed");
    edges->canvas.width = 0;
    enum cranny_status status = read_params(given, &params, why);
    if (status == CRANNY_OK)
        status = cranny_gbuffer_validate(gbuffer, why);
    if (status != CRANNY_OK)
        return status;
    /* Beyond the viewport the caller's buffer has no values. */
    struct cranny_gbuffer inner = *gbuffer;
    inner.guard_band = 0;
    enum cranny_isa isa;
    struct pipeline p = {.kernels = kernels_choose((enum cranny_isa)params.isa, &isa),
                         .threads = thread_count(params.threads),
                         .workspace = &edges->memory,
                         .constants = {.filter_tolerance = params.tolerance_world,
                                       .filter_cosine = params.normal_cosine,
                                       .footprint = FILTER_FOOTPRINT}};
    uint64_t invalid, valid;
    status = canvas_prepare(&p.canvas, &inner, false, p.kernels, p.threads, p.workspace, &invalid,
                            &valid, why);
    p.region = whole(&p.canvas);
    if (status == CRANNY_OK)
        status = pipeline_edges(&p, why);
    if (status != CRANNY_OK)
        return status;
    edges->canvas = p.canvas;
    edges->constants = p.constants;
    return CRANNY_OK;
}

enum cranny_status cranny_edges_create(const struct cranny_gbuffer *gbuffer,
                                       const struct cranny_filter_params *params,
                                       struct cranny_edges **edges, struct cranny_error *why)
{
    if (!edges)
        return fail(why, CRANNY_USAGE, "edges: a place for them is needed");
    *edges = alloc_array(1, sizeof **edges);
    if (!*edges)
        return fail_memory(why, "edges");
    enum cranny_status status = cranny_edges_update(*edges, gbuffer, params, why);
    if (status != CRANNY_OK)
        cranny_edges_destroy(edges);
    return status;
}

void cranny_edges_destroy(struct cranny_edges **edges)
{
    if (!edges || !*edges)
        return;
    workspace_clear(&(*edges)->memory);
    free(*edges);
    *edges = NULL;
}

/* A caller's buffer. */
struct plane {
    const float *input;
    float *output;
    size_t input_stride, output_stride; /* bytes */
};

static const float *input_row(const struct plane *plane, int y)
{
    return (const float *)(const void *)((const char *)plane->input +
                                         (size_t)y * plane->input_stride);
}

static float *output_row(const struct plane *plane, int y)
{
    return (float *)(void *)((char *)plane->output + (size_t)y * plane->output_stride);
}

/* 0 becomes tight; CRANNY_USAGE where rows would overlap or floats be misaligned. */
static enum cranny_status check_stride(size_t *stride, int width, const char *name,
                                       struct cranny_error *why)
{
    const size_t tight = (size_t)width * sizeof(float);
    if (*stride && (*stride < tight || *stride % sizeof(float)))
        return fail(why, CRANNY_USAGE,
                    "%s: %zu bytes; rows of %d floats need %zu or more, in fours", name, *stride,
                    width, tight);
    *stride = *stride ? *stride : tight;
    return CRANNY_OK;
}

/* One filter's call. */
struct call {
    struct plane plane;
    struct cranny_filter_params params;
    struct cranny_workspace own; /* where the caller has none */
    struct pipeline pipeline;
};

static enum cranny_status begin(const struct cranny_edges *edges,
                                const struct cranny_filter_params *given, int input_width,
                                struct call *call, struct cranny_error *why)
{
    struct plane *plane = &call->plane;
    if (!edges || !plane->input || !plane->output)
        return fail(why, CRANNY_USAGE, "filter: edges, an input and an output are needed");
    if (!edges->canvas.width)
        return fail(why, CRANNY_USAGE, "edges: they hold no frame, as their last update failed");
    const struct canvas *canvas = &edges->canvas;
    const struct cranny_filter_params *params = &call->params;
    enum cranny_status status = read_params(given, &call->params, why);
    if (status == CRANNY_OK)
        status = check_stride(&plane->input_stride, input_width, "input_stride", why);
    if (status == CRANNY_OK)
        status = check_stride(&plane->output_stride, canvas->width, "output_stride", why);
    enum cranny_isa isa;
    call->pipeline =
        (struct pipeline){.kernels = kernels_choose((enum cranny_isa)params->isa, &isa),
                          .threads = thread_count(params->threads),
                          .workspace = params->workspace ? params->workspace : &call->own,
                          .window = {.viewport = whole(canvas)},
                          .canvas = *canvas,
                          .constants = edges->constants,
                          .region = whole(canvas),
                          .any_range = true};
    return status;
}

/* The caller's values on the canvas; a row's ends go on into the halo. */
static void copy_in(const struct pipeline *p, const struct canvas *canvas,
                    const struct plane *plane, float *to)
{
#pragma omp parallel for schedule(static) num_threads(p->threads)
    for (int y = 0; y < canvas->height; y++) {
        const float *from = input_row(plane, y),
                    *depth = canvas->depth + canvas_index(canvas, 0, y);
        float *row = to + canvas_index(canvas, 0, y);
        for (int x = 0; x < canvas->width; x++)
            row[x] = depth[x] > SKY_LIMIT ? 1 : isfinite(from[x]) ? from[x] : 0;
        row[canvas->width] = row[canvas->width - 1];
    }
}

static void copy_out(const struct pipeline *p, const struct plane *plane)
{
    const struct canvas *c = &p->canvas;
#pragma omp parallel for schedule(static) num_threads(p->threads)
    for (int y = 0; y < c->height; y++) {
        const float *from = p->filtered + canvas_index(c, 0, y);
        const float *depth = c->depth + canvas_index(c, 0, y), *came = input_row(plane, y);
        float *to = output_row(plane, y);
        for (int x = 0; x < c->width; x++)
            to[x] = depth[x] > SKY_LIMIT ? came[x] : from[x];
    }
}

/* One of the pipeline's filters on the caller's plane. */
static enum cranny_status run(const struct cranny_edges *edges,
                              const struct cranny_filter_params *given, enum cranny_filter filter,
                              struct plane plane, struct cranny_error *why)
{
    struct call call = {.plane = plane};
    enum cranny_status status = begin(edges, given, edges ? edges->canvas.width : 0, &call, why);
    if (status != CRANNY_OK)
        return status;
    struct pipeline *p = &call.pipeline;
    const struct cranny_filter_params *params = &call.params;
    const float height = (float)p->canvas.height;
    const struct cranny_screen_params screen = {.filter = (int)filter,
                                                .filter_radius = params->reach_px,
                                                .bloom_wide = params->wide_px / height,
                                                .bloom_near = params->near_px / height,
                                                .bloom_wide_gain = params->wide_gain,
                                                .bloom_near_gain = params->near_gain,
                                                .bloom_blend = params->blend,
                                                .edge_bloom = params->edge_bloom};
    p->params = &screen;
    p->raw = canvas_plane(&p->canvas, p->workspace, SLOT_RAW);
    if (!p->raw)
        status = fail_memory(why, "filter");
    if (status == CRANNY_OK) {
        copy_in(p, &p->canvas, &call.plane, p->raw);
        status = filter_apply(p, why);
    }
    if (status == CRANNY_OK)
        copy_out(p, &call.plane);
    workspace_clear(&call.own);
    return status;
}

enum cranny_status cranny_filter_bilateral(const struct cranny_edges *edges,
                                           const struct cranny_filter_params *params,
                                           const float *input, size_t input_stride, float *output,
                                           size_t output_stride, struct cranny_error *why)
{
    const struct plane plane = {input, output, input_stride, output_stride};
    return run(edges, params, CRANNY_FILTER_BILATERAL, plane, why);
}

enum cranny_status cranny_filter_box4(const struct cranny_edges *edges,
                                      const struct cranny_filter_params *params, const float *input,
                                      size_t input_stride, float *output, size_t output_stride,
                                      struct cranny_error *why)
{
    const struct plane plane = {input, output, input_stride, output_stride};
    return run(edges, params, CRANNY_FILTER_BOX, plane, why);
}

enum cranny_status cranny_filter_bloom(const struct cranny_edges *edges,
                                       const struct cranny_filter_params *params,
                                       const float *input, size_t input_stride, float *output,
                                       size_t output_stride, struct cranny_error *why)
{
    const struct plane plane = {input, output, input_stride, output_stride};
    return run(edges, params, CRANNY_FILTER_BLOOM, plane, why);
}

/* Half the canvas, its values, and the full ones. */
static enum cranny_status upsample(struct pipeline *p, const struct plane *plane,
                                   struct cranny_error *why)
{
    struct canvas half;
    enum cranny_status status = canvas_halve(&p->canvas, &half, p->threads, p->workspace, why);
    if (status != CRANNY_OK)
        return status;
    float *coarse = canvas_plane(&half, p->workspace, SLOT_HALF_RAW);
    p->filtered = canvas_plane(&p->canvas, p->workspace, SLOT_FIRST);
    if (!coarse || !p->filtered)
        return fail_memory(why, "upsample");
    copy_in(p, &half, plane, coarse);
    FOR_TILES(p->region, row_tiles, p->threads, span,
              p->kernels->upsample(&p->canvas, &half, &p->constants, &span, coarse, p->filtered));
    for (int y = 0; y < p->canvas.height; y++)
        memcpy(output_row(plane, y), p->filtered + canvas_index(&p->canvas, 0, y),
               (size_t)p->canvas.width * sizeof(float));
    return CRANNY_OK;
}

enum cranny_status cranny_filter_upsample(const struct cranny_edges *edges,
                                          const struct cranny_filter_params *given,
                                          const float *input, size_t input_stride, float *output,
                                          size_t output_stride, struct cranny_error *why)
{
    struct call call = {.plane = {input, output, input_stride, output_stride}};
    enum cranny_status status =
        begin(edges, given, edges ? (edges->canvas.width + 1) / 2 : 0, &call, why);
    if (status == CRANNY_OK)
        status = upsample(&call.pipeline, &call.plane, why);
    workspace_clear(&call.own);
    return status;
}
