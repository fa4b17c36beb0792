/* A hierarchy of boxes over the polygons, split where the surface area heuristic says, among
 * sixteen places on the longest axis. */
#include "volumes/tree.h"

#include "base/vector.h"

#define LEAF_MAX 8
#define BINS 16
#define DEPTH_MAX 48    /* below, split in the middle whatever it costs */
#define TASK_LEAST 4096 /* polygons worth a task */
#define STACK_MAX (DEPTH_MAX + 34)

/* Inlined, as those of libm are not. */
static inline float least(float a, float b)
{
    return a < b ? a : b;
}

static inline float most(float a, float b)
{
    return a > b ? a : b;
}

/* A polygon on its way to its leaf: its box and its number. */
struct tree_item {
    float low[3], high[3];
    uint32_t polygon;
};

struct forest {
    struct cranny_volumes *volumes;
    const struct volume_polygon *polygons;
    struct tree_item *items;
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
        box->low[k] = least(box->low[k], other->low[k]);
        box->high[k] = most(box->high[k], other->high[k]);
        box->reach_low[k] = most(box->reach_low[k], other->reach_low[k]);
        box->reach_high[k] = most(box->reach_high[k], other->reach_high[k]);
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
            box.low[k] = least(box.low[k], p->corner[i][k]);
            box.high[k] = most(box.high[k], p->corner[i][k]);
            box.reach_low[k] = most(box.reach_low[k], (float)-(e[k] + low) + 1e-4f);
            box.reach_high[k] = most(box.reach_high[k], (float)(e[k] + high) + 1e-4f);
        }
    }
    return box;
}

/* What splitting looks at: the extent without the reach. */
struct extent {
    float low[3], high[3];
};

static const struct extent empty_extent = {{INFINITY, INFINITY, INFINITY},
                                           {-INFINITY, -INFINITY, -INFINITY}};

static inline void join_extent(struct extent *e, const float low[3], const float high[3])
{
    for (int k = 0; k < 3; k++) {
        e->low[k] = least(low[k], e->low[k]);
        e->high[k] = most(high[k], e->high[k]);
    }
}

static float extent_area(const struct extent *e)
{
    const float x = e->high[0] - e->low[0], y = e->high[1] - e->low[1], z = e->high[2] - e->low[2];
    return x * y + y * z + z * x;
}

static inline float middle(const struct tree_item *item, int axis)
{
    return 0.5f * item->low[axis] + 0.5f * item->high[axis];
}

struct spread {
    int axis;
    float low, scale; /* of the middles; bins per metre */
};

static inline int bin_of(const struct tree_item *item, const struct spread *s)
{
    const float at = (middle(item, s->axis) - s->low) * s->scale;
    return at > 0 ? min_int((int)least(at, BINS), BINS - 1) : 0;
}

static bool find_spread(const struct tree_item *items, uint32_t count, struct spread *s)
{
    struct extent middles = empty_extent;
    float widest = 0;
    for (uint32_t i = 0; i < count; i++) {
        const float at[3] = {middle(&items[i], 0), middle(&items[i], 1), middle(&items[i], 2)};
        join_extent(&middles, at, at);
    }
    *s = (struct spread){0};
    for (int k = 0; k < 3; k++) {
        const float width = middles.high[k] - middles.low[k];
        if (width > widest) {
            widest = width;
            *s = (struct spread){k, middles.low[k], BINS / width};
        }
    }
    return isfinite(s->scale) && s->scale > 0;
}

/* The bin from which on polygons go right; 0: nowhere. */
static int cheapest_split(const struct tree_item *items, uint32_t count, const struct spread *s)
{
    struct extent extents[BINS], right[BINS], left = empty_extent;
    uint32_t counts[BINS] = {0}, after[BINS], before = 0;
    for (int b = 0; b < BINS; b++)
        extents[b] = empty_extent;
    for (uint32_t i = 0; i < count; i++) {
        const int b = bin_of(&items[i], s);
        join_extent(&extents[b], items[i].low, items[i].high);
        counts[b]++;
    }
    for (int b = BINS - 1; b >= 0; b--) {
        right[b] = b + 1 < BINS ? right[b + 1] : empty_extent;
        after[b] = (b + 1 < BINS ? after[b + 1] : 0) + counts[b];
        join_extent(&right[b], extents[b].low, extents[b].high);
    }
    int best = 0;
    float lowest = INFINITY;
    for (int b = 1; b < BINS; b++) {
        join_extent(&left, extents[b - 1].low, extents[b - 1].high);
        before += counts[b - 1];
        if (!before || !after[b])
            continue;
        const float cost =
            extent_area(&left) * (float)before + extent_area(&right[b]) * (float)after[b];
        if (cost < lowest || !best) {
            lowest = cost;
            best = b;
        }
    }
    return best;
}

/* Sorts the items into left and right of the split; returns where the right begins. */
static uint32_t part(struct tree_item *items, uint32_t count, const struct spread *s, int bin)
{
    uint32_t left = 0, right = count;
    while (left < right) {
        if (bin_of(&items[left], s) < bin) {
            left++;
            continue;
        }
        const struct tree_item swap = items[--right];
        items[right] = items[left];
        items[left] = swap;
    }
    return left;
}

static uint32_t split(struct tree_item *items, uint32_t count, int depth)
{
    struct spread spread;
    if (depth < DEPTH_MAX && find_spread(items, count, &spread)) {
        const int bin = cheapest_split(items, count, &spread);
        if (bin > 0)
            return part(items, count, &spread, bin);
    }
    return count / 2;
}

static void make_leaf(const struct forest *f, uint32_t first, uint32_t count,
                      struct volume_node *node)
{
    node->count = count;
    node->box = empty_box();
    for (uint32_t i = first; i < first + count; i++) {
        const struct volume_box box = polygon_box(&f->polygons[f->items[i].polygon]);
        join_box(&node->box, &box);
    }
}

/* The subtree at node `at`, which may take 2 count − 1 nodes from there; left before right, each at
 * the first of its own. `skip`: the right child. */
static void grow(const struct forest *f, uint32_t at, uint32_t first, uint32_t count, int depth)
{
    struct volume_node *node = &f->volumes->nodes[at];
    *node = (struct volume_node){.first = first};
    if (count <= LEAF_MAX) {
        make_leaf(f, first, count, node);
        return;
    }
    const uint32_t half = split(f->items + first, count, depth);
    const uint32_t left = at + 1, right = at + 2 * half;
#pragma omp task if (count >= TASK_LEAST)
    grow(f, left, first, half, depth + 1);
    grow(f, right, first + half, count - half, depth + 1);
#pragma omp taskwait
    node->skip = right;
    node->box = f->volumes->nodes[left].box;
    join_box(&node->box, &f->volumes->nodes[right].box);
}

/* Closes the gaps between subtrees, and lets `skip` mean what it says. */
static uint32_t pack_nodes(struct volume_node *nodes)
{
    struct {
        uint32_t right, parent;
    } open[STACK_MAX];
    uint32_t count = 0, depth = 0;
    for (uint32_t at = 0;;) {
        struct volume_node node = nodes[at];
        const uint32_t here = count++;
        if (node.count == 0) {
            open[depth].parent = here;
            open[depth++].right = node.skip;
            nodes[here] = node;
            at++;
            continue;
        }
        node.skip = count;
        nodes[here] = node;
        while (depth > 0 && open[depth - 1].right == 0)
            nodes[open[--depth].parent].skip = count;
        if (depth == 0)
            return count;
        at = open[depth - 1].right;
        open[depth - 1].right = 0;
    }
}

static bool allocate(struct forest *f, uint32_t count)
{
    f->items = alloc_array(count, sizeof *f->items);
    f->volumes->polygons = alloc_array(count, sizeof *f->volumes->polygons);
    f->volumes->nodes = alloc_array(2 * (size_t)count, sizeof *f->volumes->nodes);
    return f->items && f->volumes->polygons && f->volumes->nodes;
}

/* Give back what the leaves did not need. */
static void shrink(struct cranny_volumes *volumes)
{
    void *nodes = realloc(volumes->nodes, (volumes->node_count + 1) * sizeof *volumes->nodes);
    if (nodes)
        volumes->nodes = nodes;
}

static void fill_items(const struct forest *f, uint32_t count, int threads)
{
#pragma omp parallel for num_threads(threads)
    for (uint32_t i = 0; i < count; i++) {
        struct tree_item *item = &f->items[i];
        struct extent extent = empty_extent;
        for (int c = 0; c < 4; c++)
            join_extent(&extent, f->polygons[i].corner[c], f->polygons[i].corner[c]);
        memcpy(item->low, extent.low, sizeof item->low);
        memcpy(item->high, extent.high, sizeof item->high);
        item->polygon = i;
    }
}

static void plant(const struct forest *f, uint32_t count, int threads)
{
    fill_items(f, count, threads);
#pragma omp parallel num_threads(threads)
#pragma omp single
    grow(f, 0, 0, count, 0);
#pragma omp parallel for num_threads(threads)
    for (uint32_t i = 0; i < count; i++)
        f->volumes->polygons[i] = f->polygons[f->items[i].polygon];
    f->volumes->node_count = pack_nodes(f->volumes->nodes);
}

enum cranny_status tree_build(struct cranny_volumes *volumes, struct volume_polygon *polygons,
                              int threads, struct cranny_error *why)
{
    const uint32_t count = volumes->polygon_count;
    struct forest f = {.volumes = volumes, .polygons = polygons};
    const bool ready = allocate(&f, count);
    if (ready && count > 0)
        plant(&f, count, threads);
    if (ready)
        shrink(volumes);
    free(f.items);
    free(polygons);
    return ready ? CRANNY_OK : fail_memory(why, "volumes");
}
