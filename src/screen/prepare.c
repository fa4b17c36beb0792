/* G-buffers into canvases. */
#include "screen/prepare.h"

#define ROWS_AT_ONCE 8

static int round_up(int x, int to)
{
    return (x + to - 1) / to * to;
}

struct frame_window frame_window(const struct cranny_gbuffer *gbuffer)
{
    struct cranny_rect v = gbuffer->viewport;
    if (!v.x && !v.y && !v.width && !v.height)
        v = (struct cranny_rect){0, 0, gbuffer->width, gbuffer->height};
    const int x0 = max_int(0, v.x - gbuffer->guard_band);
    const int y0 = max_int(0, v.y - gbuffer->guard_band);
    const int x1 = min_int(gbuffer->width, v.x + v.width + gbuffer->guard_band);
    const int y1 = min_int(gbuffer->height, v.y + v.height + gbuffer->guard_band);
    return (struct frame_window){
        .readable = {x0, y0, x1 - x0, y1 - y0},
        .viewport = {v.x - x0, v.y - y0, v.width, v.height},
    };
}

static void layout(struct canvas *canvas, int width, int height)
{
    canvas->width = width;
    canvas->height = height;
    canvas->stride = round_up(width, 16) + 2 * HALO_COLUMNS;
}

static bool allocate(struct canvas *canvas, struct cranny_workspace *workspace, enum slot depth,
                     enum slot normals)
{
    const size_t cells = canvas_cells(canvas);
    const ptrdiff_t first = HALO_ROWS * canvas->stride + HALO_COLUMNS;
    float *d = workspace_get(workspace, depth, cells, sizeof(float));
    float *n = workspace_get(workspace, normals, 3 * cells, sizeof(float));
    if (!d || !n)
        return false;
    canvas->depth = d + first;
    for (int i = 0; i < 3; i++)
        canvas->normal[i] = n + (size_t)i * cells + first;
    return true;
}

static void fill(float *row, int from, int to, float value)
{
    for (int x = from; x < to; x++)
        row[x] = value;
}

/* The halo of one row, or all of a row outside: sky that faces the camera. */
static void fill_halo(const struct canvas *canvas, int y)
{
    const int end = (int)canvas->stride - HALO_COLUMNS;
    const bool outside = y < 0 || y >= canvas->height;
    const ptrdiff_t at = canvas_index(canvas, 0, y);
    const int right = outside ? -HALO_COLUMNS : canvas->width;
    fill(canvas->depth + at, -HALO_COLUMNS, 0, SKY_DEPTH);
    fill(canvas->depth + at, right, end, SKY_DEPTH);
    for (int i = 0; i < 3; i++) {
        const float value = i == 2 ? 1 : 0;
        fill(canvas->normal[i] + at, -HALO_COLUMNS, 0, value);
        fill(canvas->normal[i] + at, right, end, value);
    }
}

float *canvas_plane(const struct canvas *canvas, struct cranny_workspace *workspace, enum slot slot)
{
    float *plane = workspace_get(workspace, slot, canvas_cells(canvas), sizeof(float));
    if (!plane)
        return NULL;
    plane += HALO_ROWS * canvas->stride + HALO_COLUMNS;
    const int end = (int)canvas->stride - HALO_COLUMNS;
    for (int y = -HALO_ROWS; y < canvas->height + HALO_ROWS; y++) {
        float *row = plane + canvas_index(canvas, 0, y);
        fill(row, -HALO_COLUMNS, 0, 1);
        fill(row, canvas->width, end, 1);
    }
    return plane;
}

/* Returns how many depths of the row are none (NaN, zero or negative). */
static int copy_depth_row(float *out, const float *in, int width, int *surfaces)
{
    int invalid = 0, seen = 0;
    for (int x = 0; x < width; x++) {
        const float d = in[x];
        const bool good = depth_is_surface(d);
        out[x] = good ? d : SKY_DEPTH;
        invalid += !(d > 0);
        seen += good;
    }
    *surfaces = seen;
    return invalid;
}

static void copy_normal_row(const struct canvas *canvas, int y, const char *in,
                            enum cranny_normal_format format)
{
    const ptrdiff_t row = canvas_index(canvas, 0, y);
    const size_t bytes = cranny_normal_bytes(format);
    if (format == CRANNY_NORMAL_FLOAT3 || format == CRANNY_NORMAL_FLOAT4) {
        const size_t step = bytes / sizeof(float);
        const float *n = (const float *)(const void *)in;
        float *nx = canvas->normal[0] + row, *ny = canvas->normal[1] + row;
        float *nz = canvas->normal[2] + row;
        for (int x = 0; x < canvas->width; x++, n += step) {
            nx[x] = n[0];
            ny[x] = n[1];
            nz[x] = n[2];
        }
        return;
    }
    for (int x = 0; x < canvas->width; x++) {
        float n[3];
        cranny_normal_decode(format, in + (size_t)x * bytes, n);
        for (int i = 0; i < 3; i++)
            canvas->normal[i][row + x] = n[i];
    }
}

/* View coordinates over the pixels of the readable part. */
static void place(struct canvas *canvas, const struct cranny_gbuffer *gbuffer,
                  const struct frame_window *window)
{
    const struct cranny_projection *p = &gbuffer->projection;
    float at[2] = {0.5f, 0.5f};
    if (gbuffer->sample_count > 1) {
        const float(*places)[2] = gbuffer->sample_positions
                                      ? gbuffer->sample_positions
                                      : cranny_sample_positions(gbuffer->sample_count);
        at[0] = places[0][0];
        at[1] = places[0][1];
    }
    const double sx = ((double)p->right - p->left) / window->viewport.width;
    const double sy = ((double)p->bottom - p->top) / window->viewport.height;
    canvas->scale_x = (float)sx;
    canvas->scale_y = (float)sy;
    canvas->shift_x = (float)(p->left + sx * ((double)at[0] - window->viewport.x));
    canvas->shift_y = (float)(p->top + sy * ((double)at[1] - window->viewport.y));
    canvas->orthographic = p->kind == CRANNY_ORTHOGRAPHIC;
    canvas->origin_x = window->viewport.x;
    canvas->origin_y = window->viewport.y;
}

enum cranny_status canvas_prepare(struct canvas *canvas, const struct cranny_gbuffer *gbuffer,
                                  bool face_normals, const struct kernels *kernels, int threads,
                                  struct cranny_workspace *workspace, uint64_t *invalid,
                                  uint64_t *valid, struct cranny_error *why)
{
    const struct frame_window window = frame_window(gbuffer);
    const struct cranny_rect *r = &window.readable;
    const bool given = gbuffer->normal && !face_normals;
    *canvas = (struct canvas){0};
    layout(canvas, r->width, r->height);
    place(canvas, gbuffer, &window);
    if (!allocate(canvas, workspace, SLOT_DEPTH, SLOT_NORMALS))
        return fail_memory(why, "frame");
    uint64_t bad = 0, good = 0;
#pragma omp parallel for schedule(static) num_threads(threads) reduction(+ : bad, good)
    for (int y = -HALO_ROWS; y < canvas->height + HALO_ROWS; y++) {
        fill_halo(canvas, y);
        if (y < 0 || y >= canvas->height)
            continue;
        int surfaces;
        bad += (uint64_t)copy_depth_row(canvas->depth + canvas_index(canvas, 0, y),
                                        gbuffer_depth_row(gbuffer, 0, r->y + y) + r->x,
                                        canvas->width, &surfaces);
        good += (uint64_t)surfaces;
        if (given)
            copy_normal_row(canvas, y,
                            gbuffer_normal_row(gbuffer, 0, r->y + y) +
                                (size_t)r->x * cranny_normal_bytes(gbuffer->normal_format),
                            gbuffer->normal_format);
    }
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int y = 0; y < canvas->height; y += ROWS_AT_ONCE) {
        const struct span span = {0, canvas->width, y, min_int(y + ROWS_AT_ONCE, canvas->height)};
        kernels->finish_normals(canvas, given, &span);
    }
    *invalid = bad;
    *valid = good;
    return CRANNY_OK;
}

enum cranny_status canvas_halve(const struct canvas *full, struct canvas *half, int threads,
                                struct cranny_workspace *workspace, struct cranny_error *why)
{
    *half = *full;
    layout(half, (full->width + 1) / 2, (full->height + 1) / 2);
    half->scale_x = 2 * full->scale_x;
    half->scale_y = 2 * full->scale_y;
    half->origin_x = full->origin_x / 2;
    half->origin_y = full->origin_y / 2;
    if (!allocate(half, workspace, SLOT_HALF_DEPTH, SLOT_HALF_NORMALS))
        return fail_memory(why, "frame");
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int y = -HALO_ROWS; y < half->height + HALO_ROWS; y++) {
        fill_halo(half, y);
        if (y < 0 || y >= half->height)
            continue;
        const ptrdiff_t from = canvas_index(full, 0, 2 * y), to = canvas_index(half, 0, y);
        for (int x = 0; x < half->width; x++) {
            half->depth[to + x] = full->depth[from + 2 * x];
            for (int i = 0; i < 3; i++)
                half->normal[i][to + x] = full->normal[i][from + 2 * x];
        }
    }
    return CRANNY_OK;
}
