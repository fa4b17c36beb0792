/* From the canvas to the caller's viewport; with several samples a pixel, each sample gets the
 * value of the surface that it lies on.
 *
 * Based on: McGuire et al. 2011 (§2: five pixels in a cross, by camera-space proximity) and Bavoil,
 * Sainz 2009 ("Multisample Antialiasing": a blur for each sample at edges). */
#include "screen/pipeline.h"

struct sample {
    float position[3], normal[3];
    bool sky;
};

static void view_at(const struct canvas *c, float x, float y, float depth, float p[3])
{
    const float w = c->orthographic ? 1 : depth;
    p[0] = (x * c->scale_x + c->shift_x) * w;
    p[1] = (y * c->scale_y + c->shift_y) * w;
    p[2] = -depth;
}

static float tolerance_at(const struct pipeline *p, float depth)
{
    const float w = p->canvas.orthographic ? 1 : depth;
    return p->constants.filter_tolerance + p->constants.footprint * fabsf(p->canvas.scale_x) * w;
}

/* Sample `s` of canvas pixel (x, y). Without normals of its own it has the pixel's. */
static struct sample read_sample(const struct pipeline *p, int s, int x, int y)
{
    const struct cranny_gbuffer *g = p->gbuffer;
    const struct cranny_rect *r = &p->window.readable;
    const float(*places)[2] =
        g->sample_positions ? g->sample_positions : cranny_sample_positions(g->sample_count);
    const float depth = gbuffer_depth_row(g, s, r->y + y)[r->x + x];
    struct sample sample = {.sky = !depth_is_surface(depth)};
    if (sample.sky)
        return sample;
    view_at(&p->canvas, (float)x + places[s][0] - places[0][0],
            (float)y + places[s][1] - places[0][1], depth, sample.position);
    const ptrdiff_t at = canvas_index(&p->canvas, x, y);
    for (int i = 0; i < 3; i++)
        sample.normal[i] = p->canvas.normal[i][at];
    if (!g->normal || p->params->normals == CRANNY_NORMALS_FACE)
        return sample;
    float n[3];
    cranny_normal_decode(g->normal_format,
                         gbuffer_normal_row(g, s, r->y + y) +
                             (size_t)(r->x + x) * cranny_normal_bytes(g->normal_format),
                         n);
    const float square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    for (int i = 0; square > 0.25f && square < 4 && i < 3; i++)
        sample.normal[i] = n[i] / sqrtf(square);
    return sample;
}

/* How well the surface of canvas pixel (x, y) continues that of the sample: 0 … 1. */
static float match(const struct pipeline *p, const struct sample *sample, int x, int y)
{
    const ptrdiff_t at = canvas_index(&p->canvas, x, y);
    const float depth = p->canvas.depth[at];
    if (depth > SKY_LIMIT)
        return 0;
    float there[3], apart = 0, alike = 0;
    view_at(&p->canvas, (float)x, (float)y, depth, there);
    for (int i = 0; i < 3; i++) {
        apart += sample->normal[i] * (there[i] - sample->position[i]);
        alike += sample->normal[i] * p->canvas.normal[i][at];
    }
    const float near = 2 - 2 * fabsf(apart) / tolerance_at(p, -sample->position[2]);
    const float cosine = p->constants.filter_cosine;
    return clamp_float(near, 0, 1) * clamp_float(2 * (alike - cosine) / (1 - cosine), 0, 1);
}

/* The mean of what matches within a window; a wider one when nothing does. */
static float gather_matching(const struct pipeline *p, const struct sample *sample, int x, int y)
{
    const bool cross = p->params->resolve == CRANNY_RESOLVE_CROSS;
    const float *plane = cross ? p->filtered : p->raw;
    const int widest = max_int(2, p->params->filter_radius);
    float best = -1, fallback = p->filtered[canvas_index(&p->canvas, x, y)];
    for (int radius = cross ? 1 : widest; radius <= widest; radius++) {
        const float scale = 1 / (float)((radius + 1) * (radius + 1));
        float sum = 0, weight = 0;
        for (int j = max_int(y - radius, 0); j <= min_int(y + radius, p->canvas.height - 1); j++)
            for (int i = max_int(x - radius, 0); i <= min_int(x + radius, p->canvas.width - 1);
                 i++) {
                const int far = abs(i - x) + abs(j - y);
                if (cross && radius == 1 && far > 1)
                    continue;
                const float m = match(p, sample, i, j);
                const float w = m * fmaxf(0, 1 - (float)(far * far) * 0.25f * scale);
                const float value = plane[canvas_index(&p->canvas, i, j)];
                sum += w * value;
                weight += w;
                if (m > best) {
                    best = m;
                    fallback = value;
                }
            }
        if (weight > 0.05f)
            return sum / weight;
    }
    return fallback;
}

static float sample_value(const struct pipeline *p, int s, int x, int y)
{
    const float value = p->filtered[canvas_index(&p->canvas, x, y)];
    if (p->params->resolve == CRANNY_RESOLVE_FIRST)
        return value;
    const struct sample sample = read_sample(p, s, x, y);
    if (sample.sky)
        return 1;
    /* Most pixels have one surface. */
    if (match(p, &sample, x, y) > 0.99f)
        return value;
    return gather_matching(p, &sample, x, y);
}

static float *output_row(float *visibility, size_t stride, int y)
{
    return (float *)(void *)((char *)visibility + (size_t)y * stride);
}

void resolve_mean(const struct pipeline *p, float *visibility, size_t stride)
{
    const struct cranny_rect *v = &p->window.viewport;
    const int samples = max_int(1, p->gbuffer->sample_count);
#pragma omp parallel for schedule(static) num_threads(p->threads)
    for (int y = 0; y < v->height; y++) {
        float *row = output_row(visibility, stride, y);
        if (samples == 1) {
            memcpy(row, p->filtered + canvas_index(&p->canvas, v->x, v->y + y),
                   (size_t)v->width * sizeof(float));
            continue;
        }
        for (int x = 0; x < v->width; x++) {
            float sum = 0;
            for (int s = 0; s < samples; s++)
                sum += sample_value(p, s, v->x + x, v->y + y);
            row[x] = sum / (float)samples;
        }
    }
}

void resolve_samples(const struct pipeline *p, float *visibility, size_t stride)
{
    const struct cranny_rect *v = &p->window.viewport;
    const int samples = max_int(1, p->gbuffer->sample_count);
#pragma omp parallel for schedule(static) num_threads(p->threads)
    for (int y = 0; y < v->height; y++)
        for (int s = 0; s < samples; s++) {
            float *row = output_row(visibility, stride, s * v->height + y);
            for (int x = 0; x < v->width; x++)
                row[x] = samples == 1 ? p->filtered[canvas_index(&p->canvas, v->x + x, v->y + y)]
                                      : sample_value(p, s, v->x + x, v->y + y);
        }
}
