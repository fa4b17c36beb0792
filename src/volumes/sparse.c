/* Sparse sampling: one pixel in spacing × spacing, and the others from the 5 × 5 samples around
 * them within their surface (McGuire 2009, §3.2). Beyond the paper, pixels that no sample fits are
 * done exactly (`refine`): thin things and far small ones keep their own occlusion. */
#include "volumes/group.h"

#include <omp.h>

/* Of the screen's Gaussian, in cells; and of a pixel's fitting samples together, as a share of the
 * nearest one's weight, under which it is done exactly. */
#define DEVIATION 0.7f
#define LEAST_WEIGHT 0.15f
#define TURN 0.5f /* of δ: how far apart points count that face 60° apart */
#define INVERSE_LN2 1.44269504f

struct grid {
    const struct volume_frame *frame;
    int spacing, columns, rows;
    float *samples; /* visibility; −1 for sky */
    uint8_t *rough; /* pixels that need refinement */
    float *values;
    struct group_point *points; /* GROUP_MAX */
};

static struct pixel sample_pixel(const struct grid *g, int column, int row)
{
    const int s = g->spacing;
    return (struct pixel){min_int(column * s + s / 2, g->frame->viewport.width - 1),
                          min_int(row * s + s / 2, g->frame->viewport.height - 1)};
}

static ptrdiff_t canvas_at(const struct grid *g, struct pixel p)
{
    const struct volume_frame *f = g->frame;
    return canvas_index(&f->canvas, f->viewport.x + p.x, f->viewport.y + p.y);
}

static bool is_sky(const struct grid *g, struct pixel p)
{
    return g->frame->canvas.depth[canvas_at(g, p)] > SKY_LIMIT;
}

/* View space, in units of δ: floats are enough to tell surfaces apart. */
static void view_point(const struct grid *g, struct pixel p, float position[3], float normal[3])
{
    const struct volume_frame *f = g->frame;
    const ptrdiff_t at = canvas_at(g, p);
    const float depth = f->canvas.depth[at] / f->delta;
    const float w = f->canvas.orthographic ? 1 / f->delta : depth;
    position[0] = ((float)f->scale_x * (float)p.x + (float)f->shift_x) * w;
    position[1] = ((float)f->scale_y * (float)p.y + (float)f->shift_y) * w;
    position[2] = -depth;
    for (int k = 0; k < 3; k++)
        normal[k] = f->canvas.normal[k][at];
}

static void add_point(const struct grid *g, struct pixel p, uint32_t to, struct group_point *point)
{
    *point = (struct group_point){.pixel = p, .to = to};
    view_point(g, p, point->at, point->at + 3);
    for (int k = 0; k < 3; k++)
        point->at[3 + k] *= TURN;
}

/* Values of the points, into `values` where each of them says. */
static void render_points(const struct grid *g, struct tile_work *work, struct group_point *points,
                          int count, float *values)
{
    group_points(points, count, g->frame->threads);
#pragma omp parallel for schedule(dynamic) num_threads(g->frame->threads)
    for (int t = 0; t < (count + TILE - 1) / TILE; t++) {
        const struct group_point *from = points + (ptrdiff_t)t * TILE;
        const int here = min_int(TILE, count - t * TILE);
        struct pixel pixels[TILE];
        float out[TILE];
        if (!watch_goes_on(g->frame->watch))
            continue;
        for (int i = 0; i < TILE; i++)
            pixels[i] = i < here ? from[i].pixel : (struct pixel){-1, 0};
        tile_render(g->frame, &work[omp_get_thread_num()], pixels, out);
        for (int i = 0; i < here; i++)
            values[from[i].to] = out[i];
        watch_advance(g->frame->watch, 1);
    }
}

static void render_samples(const struct grid *g, struct tile_work *work)
{
    int count = 0;
    for (int row = 0; row < g->rows; row++)
        for (int column = 0; column < g->columns; column++) {
            const struct pixel p = sample_pixel(g, column, row);
            const uint32_t to = (uint32_t)row * (uint32_t)g->columns + (uint32_t)column;
            g->samples[to] = -1;
            if (!is_sky(g, p))
                add_point(g, p, to, &g->points[count++]);
            if (count < GROUP_MAX && (row + 1 < g->rows || column + 1 < g->columns))
                continue;
            render_points(g, work, g->points, count, g->samples);
            count = 0;
        }
}

static void gather_taps(const struct grid *g, int column, int row, struct sparse_cell *cell)
{
    cell->taps = 0;
    for (int j = max_int(0, row - 2); j <= min_int(g->rows - 1, row + 2); j++)
        for (int i = max_int(0, column - 2); i <= min_int(g->columns - 1, column + 2); i++) {
            const float value = g->samples[(size_t)j * (size_t)g->columns + (size_t)i];
            if (value < 0)
                continue;
            const int tap = cell->taps++;
            const struct pixel p = sample_pixel(g, i, j);
            view_point(g, p, cell->tap_position[tap], cell->tap_normal[tap]);
            cell->tap_x[tap] = (float)(p.x - column * g->spacing) / (float)g->spacing;
            cell->tap_y[tap] = (float)(p.y - row * g->spacing) / (float)g->spacing;
            cell->tap_value[tap] = value;
        }
}

/* The cell's pixels that are not sky, into `places`. */
static void gather_pixels(const struct grid *g, int column, int row, struct sparse_cell *cell,
                          struct pixel *places)
{
    const int s = g->spacing;
    cell->pixels = 0;
    for (int k = 0; k < s * s; k++) {
        const struct pixel p = {column * s + k % s, row * s + k / s};
        if (p.x >= g->frame->viewport.width || p.y >= g->frame->viewport.height || is_sky(g, p))
            continue;
        float position[3], normal[3];
        const int at = cell->pixels++;
        view_point(g, p, position, normal);
        for (int c = 0; c < 3; c++) {
            cell->position[c][at] = position[c];
            cell->normal[c][at] = normal[c];
        }
        cell->x[at] = (float)(k % s) / (float)s;
        cell->y[at] = (float)(k / s) / (float)s;
        places[at] = p;
    }
}

static void fill_cell(const struct grid *g, int column, int row, struct sparse_cell *cell)
{
    struct pixel places[CELL_PIXELS];
    _Alignas(64) float values[CELL_PIXELS], weights[CELL_PIXELS];
    gather_pixels(g, column, row, cell, places);
    if (cell->pixels == 0)
        return;
    gather_taps(g, column, row, cell);
    g->frame->kernels->reconstruct(cell, values, weights);
    for (int i = 0; i < cell->pixels; i++) {
        const size_t at =
            (size_t)places[i].y * (size_t)g->frame->viewport.width + (size_t)places[i].x;
        g->values[at] = cell->taps ? clamp_float(values[i], 0, 1) : 1;
        g->rough[at] = cell->taps == 0 || weights[i] < LEAST_WEIGHT;
    }
}

static void fill_cells(const struct grid *g, struct tile_work *work)
{
    const struct volume_frame *f = g->frame;
    const float apart = f->params->filter_depth / f->params->delta_scale;
#pragma omp parallel for schedule(dynamic) num_threads(f->threads)
    for (int row = 0; row < g->rows; row++) {
        struct sparse_cell *cell = &work[omp_get_thread_num()].cell;
        cell->sharpness = INVERSE_LN2 / (2 * DEVIATION * DEVIATION);
        cell->inverse_distance = 1 / apart;
        cell->least_cosine = f->params->filter_normal;
        cell->inverse_cosine = 1 / (1 - f->params->filter_normal);
        for (int column = 0; column < g->columns; column++)
            fill_cell(g, column, row, cell);
    }
}

static void refine(const struct grid *g, struct tile_work *work)
{
    const size_t width = (size_t)g->frame->viewport.width;
    const size_t pixels = width * (size_t)g->frame->viewport.height;
    int count = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (g->rough[i]) {
            const struct pixel p = {(int)(i % width), (int)(i / width)};
            add_point(g, p, (uint32_t)i, &g->points[count++]);
        }
        if (count < GROUP_MAX && i + 1 < pixels)
            continue;
        render_points(g, work, g->points, count, g->values);
        g->frame->counts->refined += (uint64_t)count;
        count = 0;
    }
}

enum cranny_status render_sparse(const struct volume_frame *frame, struct tile_work *work,
                                 float *values, struct cranny_error *why)
{
    const int s = frame->params->spacing;
    const size_t pixels = (size_t)frame->viewport.width * (size_t)frame->viewport.height;
    struct grid g = {.frame = frame,
                     .spacing = s,
                     .columns = (frame->viewport.width + s - 1) / s,
                     .rows = (frame->viewport.height + s - 1) / s,
                     .values = values};
    g.samples = alloc_array((size_t)g.columns * (size_t)g.rows, sizeof *g.samples);
    g.rough = alloc_array(pixels, 1);
    g.points = alloc_array(GROUP_MAX, sizeof *g.points);
    const bool ready = g.samples && g.rough && g.points;
    if (ready) {
        for (size_t i = 0; i < pixels; i++)
            values[i] = 1;
        render_samples(&g, work);
        const double begin = seconds_now();
        fill_cells(&g, work);
        frame->counts->filter_ms += 1e3 * (seconds_now() - begin);
        if (frame->params->refine)
            refine(&g, work);
    }
    free(g.samples);
    free(g.rough);
    free(g.points);
    return ready ? CRANNY_OK : fail_memory(why, "volumes");
}
