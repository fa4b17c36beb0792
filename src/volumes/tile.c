/* A tile: points into the kernels' form, bounds of blocks, and the volumes near them.
 *
 * Based on: McGuire, Ambient Occlusion Volumes, 2009, §5. The paper rasterises volumes; here tiles
 * ask a tree for the volumes around the box of their points, so that only what is visible costs,
 * and a camera inside of a volume or a near plane through it is no special case. */
#include "volumes/frame.h"
#include "volumes/tree.h"

#define NOTHING -1e30f

struct origin {
    float place[3]; /* relative to the scene's centre: exact in floats */
    float inverse;  /* one over δ */
};

/* Inlined, as those of libm are not. */
static inline float min_float(float a, float b)
{
    return a < b ? a : b;
}

static inline float max_float(float a, float b)
{
    return a > b ? a : b;
}

static void place_point(const struct volume_frame *frame, const struct origin *origin,
                        const struct volume_point *point, struct tile *tile, int slot)
{
    for (int k = 0; k < 3; k++) {
        tile->position[k][slot] =
            (float)((point->position[k] - (double)origin->place[k]) * (double)origin->inverse);
        tile->normal[k][slot] = point->normal[k];
    }
    tile->rise[slot] = (frame->bias * point->w + frame->rise_least) * origin->inverse;
}

/* Places of no pixel take a neighbour's point, for bounds and vectors to have numbers. */
static void repeat_point(struct tile *tile, int from, int to)
{
    for (int k = 0; k < 3; k++) {
        tile->position[k][to] = tile->position[k][from];
        tile->normal[k][to] = tile->normal[k][from];
    }
    tile->rise[to] = tile->rise[from];
}

static void bound_positions(const struct tile *tile, int first, int end, float bounds[BOUND_COUNT])
{
    for (int k = 0; k < 3; k++) {
        float low = INFINITY, high = -INFINITY;
        for (int i = first; i < end; i++) {
            low = min_float(low, tile->position[k][i]);
            high = max_float(high, tile->position[k][i]);
        }
        bounds[BOUND_CENTRE + k] = 0.5f * (low + high);
        bounds[BOUND_HALF + k] = 0.5f * (high - low) * 1.00001f;
    }
}

static void bound_normals(const struct tile *tile, int first, int end, float bounds[BOUND_COUNT])
{
    float *n = bounds + BOUND_NORMAL, sum[3] = {0}, spread2 = 0, lift = NOTHING;
    for (int k = 0; k < 3; k++)
        for (int i = first; i < end; i++)
            sum[k] += tile->normal[k][i];
    const float length = sqrtf(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int k = 0; k < 3; k++)
        n[k] = length > 0 ? sum[k] / length : 0;
    for (int i = first; i < end; i++) {
        float away2 = 0, above = -tile->rise[i];
        for (int k = 0; k < 3; k++) {
            const float d = tile->normal[k][i] - n[k];
            away2 += d * d;
            above += (bounds[BOUND_CENTRE + k] - tile->position[k][i]) * n[k];
        }
        spread2 = max_float(spread2, away2);
        lift = max_float(lift, above);
    }
    bounds[BOUND_SPREAD] = sqrtf(spread2) + 1e-6f;
    bounds[BOUND_LIFT] = lift;
}

static void bound_blocks(struct tile *tile, const int *used)
{
    float bounds[BOUND_COUNT] = {0};
    for (int b = 0; b < TILE_BLOCKS; b++) {
        if (used[b] >= 0) {
            bound_positions(tile, b * BLOCK, (b + 1) * BLOCK, bounds);
            bound_normals(tile, b * BLOCK, (b + 1) * BLOCK, bounds);
        } else {
            bounds[BOUND_LIFT] = NOTHING;
        }
        for (int k = 0; k < BOUND_COUNT; k++)
            tile->bounds[k][b] = bounds[k];
    }
    bound_positions(tile, 0, TILE, tile->all);
    bound_normals(tile, 0, TILE, tile->all);
}

/* Blocks without a pixel repeat the tile's first point. Returns its slot, −1: all sky. */
static int fill_tile(const struct volume_frame *frame, struct tile_work *work,
                     const struct pixel *pixels, struct origin *origin, bool *shown)
{
    int used[TILE_BLOCKS], first = -1;
    for (int i = 0; i < TILE; i++) {
        if (i % BLOCK == 0)
            used[i / BLOCK] = -1;
        shown[i] =
            pixels[i].x >= 0 && frame_point(frame, pixels[i].x, pixels[i].y, &work->points[i]);
        if (!shown[i])
            continue;
        work->pixels++;
        used[i / BLOCK] = used[i / BLOCK] < 0 ? i : used[i / BLOCK];
        first = first < 0 ? i : first;
    }
    if (first < 0)
        return first;
    for (int k = 0; k < 3; k++)
        origin->place[k] = (float)work->points[first].position[k];
    origin->inverse = 1 / frame->delta;
    for (int i = 0; i < TILE; i++)
        if (shown[i])
            place_point(frame, origin, &work->points[i], &work->tile, i);
    for (int i = 0; i < TILE; i++)
        if (!shown[i])
            repeat_point(&work->tile, used[i / BLOCK] < 0 ? first : used[i / BLOCK], i);
    bound_blocks(&work->tile, used);
    return first;
}

static void hand_over(const struct volume_frame *frame, struct tile_work *work)
{
    struct batch *batch = &work->batch;
    work->candidates += (uint64_t)batch->count;
    for (; batch->count % BLOCK; batch->count++) {
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 3; k++)
                batch->corner[i][k][batch->count] = 0;
        batch->alpha[batch->count] = 0;
        batch->lowest[batch->count] = 0;
        batch->triangle[batch->count] = 0;
    }
    frame->kernels->occlude(batch, &work->tile);
    batch->count = 0;
}

static float lowest_height(const struct volume_frame *frame, const struct volume_polygon *polygon)
{
    switch ((enum cranny_volume_faces)frame->params->faces) {
    case CRANNY_FACES_FRONT:
        return 0;
    case CRANNY_FACES_MATERIAL:
        return polygon->flags & POLYGON_DOUBLE_SIDED ? -1 : 0;
    case CRANNY_FACES_BOTH:
        return -1;
    }
    return 0;
}

static void add_polygon(const struct volume_frame *frame, struct tile_work *work,
                        const struct origin *origin, const struct volume_polygon *polygon)
{
    struct batch *batch = &work->batch;
    const int at = batch->count++;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++)
            batch->corner[i][k][at] = (polygon->corner[i][k] - origin->place[k]) * origin->inverse;
    batch->alpha[at] = polygon->alpha;
    batch->lowest[at] = lowest_height(frame, polygon);
    batch->triangle[at] = polygon->flags & POLYGON_QUAD ? 0 : 1;
    if (batch->count == BATCH)
        hand_over(frame, work);
}

static struct tree_query tile_query(const struct volume_frame *frame, const struct tile *tile,
                                    const struct origin *origin)
{
    struct tree_query query = {.delta = frame->delta,
                               .extra = frame->params->faces == CRANNY_FACES_BOTH ? 1 : 0};
    for (int k = 0; k < 3; k++) {
        const float centre = tile->all[BOUND_CENTRE + k], half = tile->all[BOUND_HALF + k];
        query.low[k] = origin->place[k] + (centre - half) * frame->delta;
        query.high[k] = origin->place[k] + (centre + half) * frame->delta;
    }
    return query;
}

/* What combining with `knee` bends: the sum alone. */
static float curve_knee(const struct cranny_volumes_params *params)
{
    return params->combine == CRANNY_COMBINE_KNEE ? params->knee : 1;
}

void tile_render(const struct volume_frame *frame, struct tile_work *work,
                 const struct pixel *pixels, float *values)
{
    const struct cranny_volumes *volumes = frame->volumes;
    struct tile *tile = &work->tile;
    struct origin origin;
    bool shown[TILE];
    memset(tile->occlusion, 0, sizeof tile->occlusion);
    tile->product = frame->params->combine == CRANNY_COMBINE_PRODUCT;
    work->batch.count = 0;
    if (fill_tile(frame, work, pixels, &origin, shown) >= 0) {
        const struct tree_query query = tile_query(frame, tile, &origin);
        for (uint32_t at = tree_next(volumes, &query, 0); at < volumes->node_count;) {
            const struct volume_node *leaf = &volumes->nodes[at];
            for (uint32_t i = 0; i < leaf->count; i++)
                add_polygon(frame, work, &origin, &volumes->polygons[leaf->first + i]);
            at = tree_next(volumes, &query, leaf->skip);
        }
        hand_over(frame, work);
        frame->kernels->finish(curve_knee(frame->params), frame->params->intensity,
                               frame->params->contrast, tile->occlusion);
    }
    for (int i = 0; i < TILE; i++)
        values[i] = shown[i] ? tile->occlusion[i] : 1;
}
