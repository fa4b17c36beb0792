/* What takes the noise out: blurs within edges (Bavoil, Sainz 2009 and McGuire et al. 2011 use
 * cross-bilateral ones, made separable), Kajalin's 4×4 box, and the crease article's two blooms.
 *
 * All weigh a neighbour by the packed connections between the pixels on the way to it, found once a
 * frame, so that a pass reads one float and one byte a tap instead of depths and normals. */
#include "base/portable.h"
#include "screen/pipeline.h"

static float bloom_px(float share, int viewport_height)
{
    return share * (float)viewport_height;
}

int filter_reach(const struct cranny_screen_params *params, int viewport_height)
{
    switch ((enum cranny_filter)params->filter) {
    case CRANNY_FILTER_NONE:
        return 0;
    case CRANNY_FILTER_BOX:
        return 2;
    case CRANNY_FILTER_BILATERAL:
        return params->filter_radius;
    case CRANNY_FILTER_BLOOM:
        return (int)ceilf(3 *
                          bloom_px(fmaxf(params->bloom_wide, params->bloom_near), viewport_height));
    }
    return 0;
}

/* exp(−x² / 2σ²), the same bits on every machine. */
static float bell_at(double x, double deviation)
{
    return exp2_negative((float)(-0.7213475204444817 * x * x / (deviation * deviation)));
}

/* A bell of `radius` taps on each side that is a box of four convolved with a Gaussian: noise that
 * repeats every 4 pixels is taken out wholly, whatever the radius (from 3 on). */
static void bell(int radius, float *weights)
{
    const double deviation = 0.5 * (radius + 1);
    for (int k = 0; k <= radius; k++) {
        double sum = 0;
        for (int j = 0; j < 4; j++) {
            const double at = k + j - 1.5;
            sum += fabs(at) > radius - 1 ? 0 : (double)bell_at(at, deviation);
        }
        weights[k] = (float)sum;
    }
    if (radius < 3)
        for (int k = 0; k <= radius; k++)
            weights[k] = 1;
}

static void gaussian(int radius, float deviation, float *weights)
{
    for (int k = 0; k <= radius; k++)
        weights[k] = bell_at(k, (double)deviation);
}

enum cranny_status pipeline_edges(struct pipeline *p, struct cranny_error *why)
{
    struct canvas *c = &p->canvas;
    uint8_t *memory = workspace_get(p->workspace, SLOT_EDGES, canvas_cells(c), 1);
    if (!memory)
        return fail_memory(why, "edges");
    c->edges = memory + HALO_ROWS * c->stride + HALO_COLUMNS;
    for (int y = -HALO_ROWS; y < c->height + HALO_ROWS; y++) {
        memset(c->edges + canvas_index(c, -HALO_COLUMNS, y), 0, HALO_COLUMNS);
        const int right = (c->width + 15) / 16 * 16;
        memset(c->edges + canvas_index(c, right, y), 0, HALO_COLUMNS);
    }
    /* One row and column beyond: a connection is stored on its left and upper side. */
    struct cranny_rect r = p->region;
    r.x = max_int(0, r.x - 16);
    r.width += p->region.x - r.x;
    r.y = max_int(0, r.y - 1);
    r.height += p->region.y - r.y;
    FOR_TILES(r, row_tiles, p->threads, span, p->kernels->edges(c, &p->constants, &span));
    return CRANNY_OK;
}

/* Along x into `between`, then along y into `out`. */
static void blur_both(const struct pipeline *p, int before, int after, const float *weights,
                      const float *in, float *between, float *out)
{
    const struct canvas *c = &p->canvas;
    FOR_TILES(p->region, row_tiles, p->threads, span,
              p->kernels->blur(c, false, before, after, weights, &span, in, between));
    FOR_TILES(p->region, row_tiles, p->threads, span,
              p->kernels->blur(c, true, before, after, weights, &span, between, out));
}

/* One running mean of 2 half + 1 values along a row of `count`, ends repeated. */
static void box_row(const float *in, float *out, int count, ptrdiff_t step, int half)
{
    const float scale = 1 / (float)(2 * half + 1);
    float sum = in[0] * (float)half;
    for (int k = 0; k <= half; k++)
        sum += in[min_int(k, count - 1) * step];
    for (int x = 0; x < count; x++) {
        out[x * step] = sum * scale;
        sum += in[min_int(x + half + 1, count - 1) * step] - in[max_int(x - half, 0) * step];
    }
}

/* The same down 16 columns at a time. */
static void box_columns(const float *in, float *out, int count, ptrdiff_t step, int half)
{
    const float scale = 1 / (float)(2 * half + 1);
    float sum[16];
    for (int i = 0; i < 16; i++)
        sum[i] = in[i] * (float)half;
    for (int k = 0; k <= half; k++)
        for (int i = 0; i < 16; i++)
            sum[i] += in[min_int(k, count - 1) * step + i];
    for (int y = 0; y < count; y++) {
        const float *enter = in + min_int(y + half + 1, count - 1) * step;
        const float *leave = in + max_int(y - half, 0) * step;
        for (int i = 0; i < 16; i++) {
            out[y * step + i] = sum[i] * scale;
            sum[i] += enter[i] - leave[i];
        }
    }
}

/* Half-widths of three boxes whose variances, h (h + 1) / 3 each, come nearest to a Gaussian's. */
static void three_boxes(float deviation, int half[3])
{
    const float variance = deviation * deviation;
    const int least = (int)(0.5f * (sqrtf(4 * variance + 1) - 1));
    const float rest = variance - (float)(least * (least + 1));
    const int wider = (int)(1.5f * rest / (float)(least + 1) + 0.5f);
    for (int i = 0; i < 3; i++)
        half[i] = least + (i < wider);
}

/* A Gaussian as three boxes each way: cost does not grow with its size. `a` holds the result. */
static void wide_gaussian(const struct pipeline *p, float deviation, float *a, float *b)
{
    const struct cranny_rect *r = &p->region;
    const ptrdiff_t step = p->canvas.stride, at = canvas_index(&p->canvas, r->x, r->y);
    int half[3];
    three_boxes(deviation, half);
#pragma omp parallel for schedule(static) num_threads(p->threads)
    for (int y = 0; y < r->height; y++) {
        float *row = a + at + y * step, *other = b + at + y * step;
        box_row(row, other, r->width, 1, half[0]);
        box_row(other, row, r->width, 1, half[1]);
        box_row(row, other, r->width, 1, half[2]);
    }
#pragma omp parallel for schedule(static) num_threads(p->threads)
    for (int x = 0; x < r->width; x += 16) {
        box_columns(b + at + x, a + at + x, r->height, step, half[0]);
        box_columns(a + at + x, b + at + x, r->height, step, half[1]);
        box_columns(b + at + x, a + at + x, r->height, step, half[2]);
    }
}

/* Repeated blurs within edges: their variances add up. `a` holds the result. */
static void edge_gaussian(const struct pipeline *p, float deviation, float *a, float *b)
{
    enum { RADIUS = FILTER_RADIUS_MAX };
    const float most = RADIUS / 2.5f;
    const int passes = max_int(1, (int)ceilf(deviation * deviation / (most * most)));
    float weights[RADIUS + 1];
    gaussian(RADIUS, fmaxf(deviation / sqrtf((float)passes), 0.3f), weights);
    for (int i = 0; i < passes; i++)
        blur_both(p, RADIUS, RADIUS, weights, a, b, a);
}

static void copy_region(const struct pipeline *p, const float *from, float *to)
{
    const struct cranny_rect *r = &p->region;
    for (int y = r->y; y < r->y + r->height; y++) {
        const ptrdiff_t at = canvas_index(&p->canvas, r->x, y);
        memcpy(to + at, from + at, (size_t)r->width * sizeof(float));
    }
}

/* Two blooms of the occlusion, blended. */
static enum cranny_status bloom(struct pipeline *p, float *wide, float *near,
                                struct cranny_error *why)
{
    const struct cranny_screen_params *k = p->params;
    const int height = p->window.viewport.height;
    float *between = canvas_plane(&p->canvas, p->workspace, SLOT_HALF_RAW);
    if (!between)
        return fail_memory(why, "bloom");
    copy_region(p, p->raw, wide);
    copy_region(p, p->raw, near);
    void (*blur)(const struct pipeline *, float, float *, float *) =
        k->edge_bloom ? edge_gaussian : wide_gaussian;
    blur(p, bloom_px(k->bloom_wide, height), wide, between);
    blur(p, bloom_px(k->bloom_near, height), near, between);
    const float wide_share = (1 - k->bloom_blend) * k->bloom_wide_gain;
    const float near_share = k->bloom_blend * k->bloom_near_gain;
    const struct cranny_rect *r = &p->region;
#pragma omp parallel for schedule(static) num_threads(p->threads)
    for (int y = r->y; y < r->y + r->height; y++)
        for (int x = r->x; x < r->x + r->width; x++) {
            const ptrdiff_t at = canvas_index(&p->canvas, x, y);
            const float open = 1 - wide_share * (1 - wide[at]) - near_share * (1 - near[at]);
            const bool sky = p->canvas.depth[at] > SKY_LIMIT;
            wide[at] = sky ? 1 : p->any_range ? open : clamp_float(open, 0, 1);
        }
    p->filtered = wide;
    return CRANNY_OK;
}

enum cranny_status filter_apply(struct pipeline *p, struct cranny_error *why)
{
    const enum cranny_filter filter = (enum cranny_filter)p->params->filter;
    p->filtered = p->raw;
    if (filter == CRANNY_FILTER_NONE)
        return CRANNY_OK;
    float *first = canvas_plane(&p->canvas, p->workspace, SLOT_FIRST);
    float *second = canvas_plane(&p->canvas, p->workspace, SLOT_SECOND);
    if (!first || !second)
        return fail_memory(why, "filter");
    if (filter == CRANNY_FILTER_BLOOM)
        return bloom(p, first, second, why);
    float weights[FILTER_RADIUS_MAX + 1];
    const int radius = p->params->filter_radius;
    if (filter == CRANNY_FILTER_BOX) {
        static const float even[3] = {1, 1, 1};
        blur_both(p, 2, 1, even, p->raw, first, second);
    } else {
        bell(radius, weights);
        blur_both(p, radius, radius, weights, p->raw, first, second);
    }
    p->filtered = second;
    return CRANNY_OK;
}
