/* A frame from its G-buffer to visibility: prepare, estimate, filter, resolve. */
#include "screen/pipeline.h"

static enum cranny_status check_params(const struct cranny_screen_params *params,
                                       struct cranny_error *why)
{
    if ((unsigned)params->method >= CRANNY_METHOD_COUNT)
        return fail(why, CRANNY_USAGE, "method %d: there are 0 to %d", params->method,
                    CRANNY_METHOD_COUNT - 1);
    enum cranny_status status = cranny_params_validate(
        cranny_screen_param_table((enum cranny_method)params->method), params, why);
    if (status != CRANNY_OK)
        return status;
    if (params->method == CRANNY_RAYMARCH && params->directions * params->elevations > TABLE_MAX)
        return fail(why, CRANNY_USAGE, "directions %d times elevations %d: at most %d rays",
                    params->directions, params->elevations, TABLE_MAX);
    if (params->filter == CRANNY_FILTER_BLOOM && params->method != CRANNY_CREASE)
        return fail(why, CRANNY_USAGE, "filter bloom: only with crease, whose parameters it has");
    return CRANNY_OK;
}

static enum cranny_status progress(const struct pipeline *p, const char *stage,
                                   struct cranny_error *why)
{
    if (hook_progress(p->params->hooks, stage, 0, 1))
        return CRANNY_OK;
    return fail(why, CRANNY_CANCELLED, "cancelled");
}

/* The viewport and the filters' reach around it, from a multiple of 16 on. */
static struct cranny_rect grow_region(const struct pipeline *p)
{
    const struct cranny_rect *v = &p->window.viewport;
    const int reach = filter_reach(p->params, v->height);
    const int x0 = max_int(0, v->x - reach) / 16 * 16, y0 = max_int(0, v->y - reach);
    const int x1 = min_int(p->canvas.width, v->x + v->width + reach);
    const int y1 = min_int(p->canvas.height, v->y + v->height + reach);
    return (struct cranny_rect){x0, y0, x1 - x0, y1 - y0};
}

static void report_invalid(const struct pipeline *p, uint64_t invalid)
{
    if (p->params->report)
        p->params->report->invalid_depths = invalid;
    if (invalid)
        hook_warn(
            p->params->hooks,
            "%llu depths are NaN, zero or negative and count as sky; see cranny check --depth",
            (unsigned long long)invalid);
}

static enum cranny_status prepare(struct pipeline *p, struct cranny_error *why)
{
    uint64_t invalid, valid;
    enum cranny_status status = progress(p, "prepare", why);
    if (status != CRANNY_OK)
        return status;
    status = canvas_prepare(&p->canvas, p->gbuffer, p->params->normals == CRANNY_NORMALS_FACE,
                            p->kernels, p->threads, p->workspace, &invalid, &valid, why);
    if (status != CRANNY_OK)
        return status;
    if (invalid && !valid)
        return fail(why, CRANNY_INPUT,
                    "depth: no pixel is in front of the camera (%llu are NaN, zero or negative); "
                    "linear depth is positive: pass −z, see cranny check --depth",
                    (unsigned long long)invalid);
    report_invalid(p, invalid);
    p->region = grow_region(p);
    p->raw = canvas_plane(&p->canvas, p->workspace, SLOT_RAW);
    return p->raw ? CRANNY_OK : fail_memory(why, "frame");
}

static void estimate_full(struct pipeline *p)
{
    estimate_fn *estimate = p->kernels->estimate[p->params->method];
    FOR_TILES(p->region, square_tiles, p->threads, span,
              estimate(&p->canvas, &p->constants, &span, p->raw));
}

static enum cranny_status estimate_half(struct pipeline *p, double *upsample_ms,
                                        struct cranny_error *why)
{
    struct canvas half;
    struct screen_constants constants;
    enum cranny_status status = canvas_halve(&p->canvas, &half, p->threads, p->workspace, why);
    if (status != CRANNY_OK)
        return status;
    float *raw = canvas_plane(&half, p->workspace, SLOT_HALF_RAW);
    if (!raw)
        return fail_memory(why, "frame");
    constants_make(&constants, p->params, p->gbuffer, &p->window.viewport, true);
    estimate_fn *estimate = p->kernels->estimate[p->params->method];
    const struct cranny_rect r = p->region;
    struct cranny_rect region = {r.x / 2 / 16 * 16, r.y / 2, 0, 0};
    region.width = min_int(half.width, (r.x + r.width) / 2 + 1) - region.x;
    region.height = min_int(half.height, (r.y + r.height) / 2 + 1) - region.y;
    FOR_TILES(region, square_tiles, p->threads, span, estimate(&half, &constants, &span, raw));
    const double begin = seconds_now();
    FOR_TILES(p->region, row_tiles, p->threads, span,
              p->kernels->upsample(&p->canvas, &half, &p->constants, &span, raw, p->raw));
    *upsample_ms = 1e3 * (seconds_now() - begin);
    return CRANNY_OK;
}

static enum cranny_status run_stages(struct pipeline *p, struct cranny_screen_report *report,
                                     struct cranny_error *why)
{
    const double begin = seconds_now();
    double upsample_ms = 0;
    enum cranny_status status = prepare(p, why);
    if (status != CRANNY_OK)
        return status;
    constants_make(&p->constants, p->params, p->gbuffer, &p->window.viewport, false);
    if (p->params->filter != CRANNY_FILTER_NONE || p->gbuffer->sample_count > 1)
        status = pipeline_edges(p, why);
    const double prepared = seconds_now();
    if (status == CRANNY_OK)
        status = progress(p, "estimate", why);
    if (status == CRANNY_OK && p->params->resolution == CRANNY_RESOLUTION_HALF)
        status = estimate_half(p, &upsample_ms, why);
    else if (status == CRANNY_OK)
        estimate_full(p);
    const double estimated = seconds_now();
    if (status == CRANNY_OK)
        status = progress(p, "filter", why);
    if (status == CRANNY_OK)
        status = filter_apply(p, why);
    const double filtered = seconds_now();
    report->prepare_ms = 1e3 * (prepared - begin);
    report->estimate_ms = 1e3 * (estimated - prepared) - upsample_ms;
    report->filter_ms = 1e3 * (filtered - estimated) + upsample_ms;
    return status;
}

typedef void resolve_fn(const struct pipeline *pipeline, float *visibility, size_t stride);

static enum cranny_status render(const struct cranny_gbuffer *gbuffer,
                                 const struct cranny_screen_params *params, float *visibility,
                                 size_t stride, resolve_fn *resolve, struct cranny_error *why)
{
    struct cranny_workspace own = {0};
    struct cranny_screen_report none, *report = params->report ? params->report : &none;
    *report = (struct cranny_screen_report){0};
    enum cranny_status status = cranny_gbuffer_validate(gbuffer, why);
    if (status == CRANNY_OK)
        status = check_params(params, why);
    if (status != CRANNY_OK)
        return status;
    if (!visibility)
        return fail(why, CRANNY_USAGE, "render: an output is needed");
    const double begin = seconds_now();
    enum cranny_isa isa;
    struct pipeline p = {
        .gbuffer = gbuffer,
        .params = params,
        .kernels = kernels_choose((enum cranny_isa)params->isa, &isa),
        .workspace = params->workspace ? params->workspace : &own,
        .threads = thread_count(params->threads),
        .window = frame_window(gbuffer),
    };
    report->isa = (int)isa;
    status = run_stages(&p, report, why);
    if (status == CRANNY_OK) {
        const double filtered = seconds_now();
        resolve(&p, visibility, stride ? stride : (size_t)p.window.viewport.width * sizeof(float));
        report->filter_ms += 1e3 * (seconds_now() - filtered);
    }
    report->total_ms = 1e3 * (seconds_now() - begin);
    workspace_clear(&own);
    return status;
}

enum cranny_status cranny_screen_render(const struct cranny_gbuffer *gbuffer,
                                        const struct cranny_screen_params *params,
                                        float *visibility, size_t stride, struct cranny_error *why)
{
    return render(gbuffer, params, visibility, stride, resolve_mean, why);
}

enum cranny_status cranny_screen_render_samples(const struct cranny_gbuffer *gbuffer,
                                                const struct cranny_screen_params *params,
                                                float *visibility, size_t stride,
                                                struct cranny_error *why)
{
    return render(gbuffer, params, visibility, stride, resolve_samples, why);
}

enum cranny_status cranny_normals_reconstruct(const struct cranny_gbuffer *gbuffer, int threads,
                                              float *normals, size_t stride,
                                              struct cranny_error *why)
{
    struct cranny_workspace own = {0};
    struct canvas canvas;
    enum cranny_isa isa;
    uint64_t invalid, valid;
    enum cranny_status status = cranny_gbuffer_validate(gbuffer, why);
    if (status != CRANNY_OK)
        return status;
    if (!normals || threads < 0)
        return fail(why, CRANNY_USAGE, "normals: an output and threads of 0 or more are needed");
    status = canvas_prepare(&canvas, gbuffer, true, kernels_choose(CRANNY_ISA_AUTO, &isa),
                            thread_count(threads), &own, &invalid, &valid, why);
    const struct frame_window window = frame_window(gbuffer);
    const struct cranny_rect *v = &window.viewport;
    stride = stride ? stride : (size_t)v->width * 3 * sizeof(float);
    for (int y = 0; status == CRANNY_OK && y < v->height; y++) {
        float *row = (float *)(void *)((char *)normals + (size_t)y * stride);
        const ptrdiff_t at = canvas_index(&canvas, v->x, v->y + y);
        for (int x = 0; x < v->width; x++)
            for (int i = 0; i < 3; i++)
                row[3 * x + i] = canvas.normal[i][at + x];
    }
    workspace_clear(&own);
    return status;
}
