/* A frame: prepare, occlusion of every pixel or of sparse ones, the mean over samples. */
#include "volumes/frame.h"

#include <omp.h>

static const struct cranny_volumes_params *params_or(const struct cranny_volumes_params *params,
                                                     struct cranny_volumes_params *defaults)
{
    *defaults = cranny_volumes_params_preset(NULL);
    return params ? params : defaults;
}

static enum cranny_status check(const struct cranny_volumes *volumes,
                                const struct cranny_gbuffer *gbuffer,
                                const struct cranny_volumes_params *params, const float *visibility,
                                size_t stride, struct cranny_error *why)
{
    if (!volumes || !gbuffer || !visibility)
        return fail(why, CRANNY_USAGE, "volumes: polygons, a G-buffer and an output are needed");
    enum cranny_status status = cranny_gbuffer_validate(gbuffer, why);
    if (status == CRANNY_OK)
        status = cranny_params_validate(cranny_volumes_param_table(), params, why);
    if (status != CRANNY_OK)
        return status;
    if (!gbuffer->world_from_view)
        return fail(why, CRANNY_USAGE,
                    "volumes: the G-buffer needs world_from_view, to know where the scene is");
    const struct cranny_rect v = frame_window(gbuffer).viewport;
    if (stride && (stride < sizeof(float) * (size_t)v.width || stride % sizeof(float)))
        return fail(why, CRANNY_USAGE, "volumes: rows %zu bytes apart do not hold %d floats",
                    stride, v.width);
    return CRANNY_OK;
}

/* One sample of each pixel as a G-buffer of its own, and its place in the pixel. */
static struct cranny_gbuffer take_sample(const struct cranny_gbuffer *gbuffer, int sample,
                                         float place[2])
{
    struct cranny_gbuffer one = *gbuffer;
    place[0] = place[1] = 0.5f;
    one.guard_band = min_int(gbuffer->guard_band, 2); /* for normals from depth */
    if (gbuffer->sample_count < 2)
        return one;
    const float(*places)[2] = gbuffer->sample_positions
                                  ? gbuffer->sample_positions
                                  : cranny_sample_positions(gbuffer->sample_count);
    memcpy(place, places[sample], sizeof places[sample]);
    one.depth = gbuffer_depth_row(gbuffer, sample, 0);
    if (gbuffer->normal)
        one.normal = gbuffer_normal_row(gbuffer, sample, 0);
    one.sample_count = 0;
    return one;
}

static void place_frame(struct volume_frame *frame, const struct cranny_gbuffer *gbuffer,
                        const float place[2])
{
    const struct cranny_projection *p = &gbuffer->projection;
    frame->viewport = frame_window(gbuffer).viewport;
    frame->scale_x = ((double)p->right - (double)p->left) / frame->viewport.width;
    frame->scale_y = ((double)p->bottom - (double)p->top) / frame->viewport.height;
    frame->shift_x = (double)p->left + frame->scale_x * (double)place[0];
    frame->shift_y = (double)p->top + frame->scale_y * (double)place[1];
    frame->world_from_view = gbuffer->world_from_view;
    frame->delta = frame->params->delta_scale * frame->params->radius_world;
    frame->bias = frame->params->bias * (p->top - p->bottom);
    frame->rise_least = 2e-7f * frame->volumes->half_size;
}

void render_dense(const struct volume_frame *frame, struct tile_work *work, float *values)
{
    const int columns = (frame->viewport.width + 15) / 16,
              rows = (frame->viewport.height + 15) / 16;
#pragma omp parallel for schedule(dynamic) num_threads(frame->threads)
    for (int t = 0; t < columns * rows; t++) {
        const int x0 = t % columns * 16, y0 = t / columns * 16;
        struct pixel pixels[TILE];
        float out[TILE];
        if (!watch_goes_on(frame->watch))
            continue;
        for (int i = 0; i < TILE; i++) {
            const struct pixel p = tile_place(i);
            const bool in = x0 + p.x < frame->viewport.width && y0 + p.y < frame->viewport.height;
            pixels[i] = (struct pixel){in ? x0 + p.x : -1, y0 + p.y};
        }
        tile_render(frame, &work[omp_get_thread_num()], pixels, out);
        for (int i = 0; i < TILE; i++)
            if (pixels[i].x >= 0)
                values[(size_t)pixels[i].y * (size_t)frame->viewport.width + (size_t)pixels[i].x] =
                    out[i];
        watch_advance(frame->watch, 1);
    }
}

static void count_work(const struct volume_frame *frame, const struct tile_work *work)
{
    for (int t = 0; t < frame->threads; t++) {
        frame->counts->pixels += work[t].pixels;
        frame->counts->candidates += work[t].candidates;
        frame->counts->tested += work[t].tile.tested;
        frame->counts->evaluated += work[t].tile.evaluated;
    }
}

static enum cranny_status render_plane(struct volume_frame *frame, float *values,
                                       struct cranny_error *why)
{
    struct tile_work *work = alloc_aligned((size_t)frame->threads, sizeof *work);
    if (!work)
        return fail_memory(why, "volumes");
    memset(work, 0, (size_t)frame->threads * sizeof *work);
    enum cranny_status status = CRANNY_OK;
    watch_goes_on(frame->watch);
    if (frame->params->spacing > 1)
        status = render_sparse(frame, work, values, why);
    else
        render_dense(frame, work, values);
    count_work(frame, work);
    free(work);
    if (status == CRANNY_OK && watch_stopped(frame->watch))
        return fail(why, CRANNY_CANCELLED, "cancelled");
    return status;
}

/* Adds a plane's share of the mean. */
static void add_plane(const struct volume_frame *frame, const float *values, float share,
                      bool first, float *visibility, size_t stride)
{
    const int width = frame->viewport.width;
    for (int y = 0; y < frame->viewport.height; y++) {
        float *row = (float *)(void *)((char *)visibility + (size_t)y * stride);
        const float *from = values + (size_t)y * (size_t)width;
        for (int x = 0; x < width; x++)
            row[x] = (first ? 0 : row[x]) + share * from[x];
    }
}

struct render {
    struct volume_frame frame;
    struct cranny_workspace workspace;
    uint64_t invalid, valid;
    double prepare_ms;
};

static enum cranny_status render_sample(struct render *r, const struct cranny_gbuffer *gbuffer,
                                        int sample, float *values, struct cranny_error *why)
{
    float place[2];
    uint64_t invalid, valid;
    enum cranny_isa isa;
    const double begin = seconds_now();
    const struct cranny_gbuffer one = take_sample(gbuffer, sample, place);
    const struct kernels *kernels = kernels_choose((enum cranny_isa)r->frame.params->isa, &isa);
    enum cranny_status status =
        canvas_prepare(&r->frame.canvas, &one, false, kernels, r->frame.threads, &r->workspace,
                       &invalid, &valid, why);
    if (status != CRANNY_OK)
        return status;
    r->invalid += invalid;
    r->valid += valid;
    place_frame(&r->frame, &one, place);
    r->prepare_ms += 1e3 * (seconds_now() - begin);
    return render_plane(&r->frame, values, why);
}

static enum cranny_status render_samples(struct render *r, const struct cranny_gbuffer *gbuffer,
                                         float *visibility, size_t stride, struct cranny_error *why)
{
    const struct cranny_rect v = frame_window(gbuffer).viewport;
    const int samples = max_int(1, gbuffer->sample_count);
    float *values = alloc_aligned((size_t)v.width * (size_t)v.height, sizeof *values);
    if (!values)
        return fail_memory(why, "volumes");
    stride = stride ? stride : (size_t)v.width * sizeof(float);
    enum cranny_status status = CRANNY_OK;
    for (int s = 0; s < samples && status == CRANNY_OK; s++) {
        status = render_sample(r, gbuffer, s, values, why);
        if (status == CRANNY_OK)
            add_plane(&r->frame, values, 1 / (float)samples, s == 0, visibility, stride);
    }
    free(values);
    if (status == CRANNY_OK && r->invalid && !r->valid)
        return fail(why, CRANNY_INPUT,
                    "depth: no pixel is in front of the camera (%llu are NaN, zero or negative); "
                    "linear depth is positive: pass −z, see cranny check --depth",
                    (unsigned long long)r->invalid);
    return status;
}

/* Progress counts the tiles that are done; those of the filter go with them. */
static size_t tile_count(const struct cranny_gbuffer *gbuffer, int spacing)
{
    const struct cranny_rect v = frame_window(gbuffer).viewport;
    const int step = 16 * spacing;
    return (size_t)max_int(1, gbuffer->sample_count) * (size_t)((v.width + step - 1) / step) *
           (size_t)((v.height + step - 1) / step);
}

enum cranny_status cranny_volumes_render(const struct cranny_volumes *volumes,
                                         const struct cranny_gbuffer *gbuffer,
                                         const struct cranny_volumes_params *params,
                                         float *visibility, size_t stride, struct cranny_error *why)
{
    struct cranny_volumes_params defaults;
    struct cranny_volumes_report counts = {0};
    struct watch watch;
    enum cranny_isa isa;
    const double begin = seconds_now();
    params = params_or(params, &defaults);
    enum cranny_status status = check(volumes, gbuffer, params, visibility, stride, why);
    if (status != CRANNY_OK)
        return status;
    watch_begin(&watch, params->hooks, "occlusion", tile_count(gbuffer, params->spacing));
    struct render r = {
        .frame = {.volumes = volumes,
                  .params = params,
                  .kernels = volume_kernels_choose((enum cranny_isa)params->isa, &isa),
                  .threads = thread_count(params->threads),
                  .watch = &watch,
                  .counts = &counts},
    };
    status = render_samples(&r, gbuffer, visibility, stride, why);
    workspace_clear(&r.workspace);
    counts.isa = (int)isa;
    counts.prepare_ms = r.prepare_ms;
    counts.total_ms = 1e3 * (seconds_now() - begin);
    counts.estimate_ms = counts.total_ms - counts.prepare_ms - counts.filter_ms;
    if (params->report)
        *params->report = counts;
    return status;
}
