/* A hierarchy of boxes over the polygons, split where the surface area heuristic says, among
 * sixteen places on the longest axis. */
#include "volumes/tree.h"

#include "base/vector.h"

#define LEAF_MAX 8
#define BINS 16
#define DEPTH_MAX 48 /* below, split in the middle whatever it costs */

struct forest {
    struct cranny_volumes *volumes;
    const struct volume_polygon *polygons;
    struct volume_box *boxes; /* of polygons */
    uint32_t *order;
};

static struct volume_box empty_box(void)
{
    struct volume_box box;
    for (int k = 0; k < 3; k++) {
        box.low[k] = INFINITY;
        box.high[k] = box.reach_low[k] = box.reach_high[k] = -INFINITY;
    }
    return box;
}

static void join_box(struct volume_box *box, const struct volume_box *other)
{
    for (int k = 0; k < 3; k++) {
        box->low[k] = fminf(box->low[k], other->low[k]);
        box->high[k] = fmaxf(box->high[k], other->high[k]);
        box->reach_low[k] = fmaxf(box->reach_low[k], other->reach_low[k]);
        box->reach_high[k] = fmaxf(box->reach_high[k], other->reach_high[k]);
    }
}

/* Eq. 28 for δ = 1: along the bisector of the adjacent edge normals, at most 2 long. */
static void extension(const double before[3], const double after[3], double out[3])
{
    const double q = fmax(1 + dot3(before, after), 1e-6);
    const double length = q < 0.5 ? sqrt(2 / q) : 1 / q;
    for (int k = 0; k < 3; k++)
        out[k] = -(before[k] + after[k]) * length;
}

/* Unit normals of the edges, inward, and of the face. */
static void polygon_planes(const struct volume_polygon *p, int count, double edges[4][3],
                           double face[3])
{
    double d[2][3];
    for (int k = 0; k < 3; k++) {
        d[0][k] = (double)p->corner[2][k] - p->corner[0][k];
        d[1][k] = (double)p->corner[3][k] - p->corner[1][k];
    }
    normalise3(d[0]);
    normalise3(d[1]);
    cross3(d[0], d[1], face);
    normalise3(face);
    for (int i = 0; i < count; i++) {
        double along[3];
        for (int k = 0; k < 3; k++)
            along[k] = (double)p->corner[(i + 1) % count][k] - p->corner[i][k];
        if (!normalise3(along))
            along[0] = along[1] = along[2] = 0;
        cross3(face, along, edges[i]);
    }
}

/* A little wider than exact: the kernels work in floats. */
static struct volume_box polygon_box(const struct volume_polygon *p)
{
    const int count = p->flags & POLYGON_QUAD ? 4 : 3;
    struct volume_box box = empty_box();
    double edges[4][3], face[3], e[3];
    polygon_planes(p, count, edges, face);
    for (int i = 0; i < count; i++) {
        extension(edges[(i + count - 1) % count], edges[i], e);
        for (int k = 0; k < 3; k++) {
            const double up = fmax(face[k], 0), down = fmin(face[k], 0);
            const bool both = p->flags & POLYGON_DOUBLE_SIDED;
            const double low = both ? fmin(down, -up) : down, high = both ? fmax(up, -down) : up;
            box.low[k] = fminf(box.low[k], p->corner[i][k]);
            box.high[k] = fmaxf(box.high[k], p->corner[i][k]);
            box.reach_low[k] = fmaxf(box.reach_low[k], (float)-(e[k] + low) + 1e-4f);
            box.reach_high[k] = fmaxf(box.reach_high[k], (float)(e[k] + high) + 1e-4f);
        }
    }
    return box;
}

static float box_area(const struct volume_box *b)
{
    const float x = b->high[0] - b->low[0], y = b->high[1] - b->low[1], z = b->high[2] - b->low[2];
    return x * y + y * z + z * x;
}

static float middle(const struct forest *f, uint32_t i, int axis)
{
    const struct volume_box *b = &f->boxes[f->order[i]];
    return 0.5f * b->low[axis] + 0.5f * b->high[axis];
}

struct spread {
    int axis;
    float low, scale; /* of the middles; bins per metre */
};

static int bin_of(const struct forest *f, uint32_t i, const struct spread *s)
{
    const float at = (middle(f, i, s->axis) - s->low) * s->scale;
    return at > 0 ? min_int((int)fminf(at, BINS), BINS - 1) : 0;
}

static bool find_spread(const struct forest *f, uint32_t first, uint32_t end, struct spread *s)
{
    float widest = 0;
    *s = (struct spread){0};
    for (int k = 0; k < 3; k++) {
        float low = INFINITY, high = -INFINITY;
        for (uint32_t i = first; i < end; i++) {
            low = fminf(low, middle(f, i, k));
            high = fmaxf(high, middle(f, i, k));
        }
        if (high - low > widest) {
            widest = high - low;
            *s = (struct spread){k, low, BINS / (high - low)};
        }
    }
    return isfinite(s->scale) && s->scale > 0;
}

/* The bin from which on polygons go right; 0: nowhere. */
static int cheapest_split(const struct forest *f, uint32_t first, uint32_t end,
                          const struct spread *s)
{
    struct volume_box boxes[BINS], right[BINS], left = empty_box();
    uint32_t counts[BINS] = {0}, after[BINS], before = 0;
    for (int b = 0; b < BINS; b++)
        boxes[b] = empty_box();
    for (uint32_t i = first; i < end; i++) {
        const int b = bin_of(f, i, s);
        join_box(&boxes[b], &f->boxes[f->order[i]]);
        counts[b]++;
    }
    for (int b = BINS - 1; b >= 0; b--) {
        right[b] = b + 1 < BINS ? right[b + 1] : empty_box();
        after[b] = (b + 1 < BINS ? after[b + 1] : 0) + counts[b];
        join_box(&right[b], &boxes[b]);
    }
    int best = 0;
    float least = INFINITY;
    for (int b = 1; b < BINS; b++) {
        join_box(&left, &boxes[b - 1]);
        before += counts[b - 1];
        if (!before || !after[b])
            continue;
        const float cost = box_area(&left) * (float)before + box_area(&right[b]) * (float)after[b];
        if (cost < least || !best) {
            least = cost;
            best = b;
        }
    }
    return best;
}

/* Sorts the range into left and right of the split; returns where the right begins. */
static uint32_t part(struct forest *f, uint32_t first, uint32_t end, const struct spread *s,
                     int bin)
{
    uint32_t left = first, right = end;
    while (left < right) {
        if (bin_of(f, left, s) < bin) {
            left++;
            continue;
        }
        const uint32_t swap = f->order[--right];
        f->order[right] = f->order[left];
        f->order[left] = swap;
    }
    return left;
}

static uint32_t split(struct forest *f, uint32_t first, uint32_t end, int depth)
{
    struct spread spread;
    if (depth < DEPTH_MAX && find_spread(f, first, end, &spread)) {
        const int bin = cheapest_split(f, first, end, &spread);
        if (bin > 0)
            return part(f, first, end, &spread, bin);
    }
    return first + (end - first) / 2;
}

static void grow(struct forest *f, uint32_t first, uint32_t end, int depth)
{
    const uint32_t at = f->volumes->node_count++;
    struct volume_node *node = &f->volumes->nodes[at];
    node->box = empty_box();
    for (uint32_t i = first; i < end; i++)
        join_box(&node->box, &f->boxes[f->order[i]]);
    node->first = first;
    if (end - first <= LEAF_MAX) {
        node->count = end - first;
    } else {
        const uint32_t half = split(f, first, end, depth);
        grow(f, first, half, depth + 1);
        grow(f, half, end, depth + 1);
    }
    node->skip = f->volumes->node_count;
}

static bool allocate(struct forest *f, uint32_t count)
{
    f->boxes = alloc_array(count, sizeof *f->boxes);
    f->order = alloc_array(count, sizeof *f->order);
    f->volumes->polygons = alloc_array(count, sizeof *f->volumes->polygons);
    f->volumes->nodes = alloc_array(2 * (size_t)count, sizeof *f->volumes->nodes);
    return f->boxes && f->order && f->volumes->polygons && f->volumes->nodes;
}

/* Give back what the leaves did not need. */
static void shrink(struct cranny_volumes *volumes)
{
    void *nodes = realloc(volumes->nodes, (volumes->node_count + 1) * sizeof *volumes->nodes);
    if (nodes)
        volumes->nodes = nodes;
}

enum cranny_status tree_build(struct cranny_volumes *volumes, struct volume_polygon *polygons,
                              struct cranny_error *why)
{
    const uint32_t count = volumes->polygon_count;
    struct forest f = {.volumes = volumes, .polygons = polygons};
    const bool ready = allocate(&f, count);
    for (uint32_t i = 0; ready && i < count; i++) {
        f.boxes[i] = polygon_box(&polygons[i]);
        f.order[i] = i;
    }
    if (ready && count > 0)
        grow(&f, 0, count, 0);
    for (uint32_t i = 0; ready && i < count; i++)
        volumes->polygons[i] = polygons[f.order[i]];
    if (ready)
        shrink(volumes);
    free(f.boxes);
    free(f.order);
    free(polygons);
    return ready ? CRANNY_OK : fail_memory(why, "volumes");
}
