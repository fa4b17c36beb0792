/* The second ray of a pair: from the origin to the hit, through trees and fog. */
#include "trace/pack.h"
#include "trace/passage.h"

#define LANES_MAX 16

/* Less than this of a ray is left: what is behind makes no difference. */
#define LEFT_MIN 0x1p-10f

struct dim_call {
    embree_context context; /* first: callbacks get its address */
    const struct fog_box *boxes;
    struct passage *passages;
    uint32_t first_id;
    int crossings_enough; /* after as many, less than LEFT_MIN is left; 0: never */
    float apart;          /* see passage_cross; at no distance */
};

static void tree_filter(const struct RTCFilterFunctionNArguments *args)
{
    const struct dim_call *call = (const struct dim_call *)args->context;
    float *ends = embree_floats(args->ray, FIELD_END, args->N);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] != -1)
            continue;
        const struct embree_candidate hit = embree_candidate(args, i);
        struct passage *passage = &call->passages[hit.ray - call->first_id];
        passage_cross(passage, ends[i], hit_instance(hit.geometry, hit.top),
                      call->apart + 0x1p-20f * ends[i]);
        /* Taken as a hit, it shortens the ray; else the ray goes on. */
        if (call->crossings_enough && passage->crossing_count >= call->crossings_enough)
            ends[i] = passage->crossings[call->crossings_enough - 1].distance;
        else
            args->valid[i] = 0;
    }
}

/* From −1 to 1 along one axis. */
static void slab(float start, float step, float *enter, float *leave)
{
    const float a = (-1 - start) / step, b = (1 - start) / step;
    const float low = a < b ? a : b, high = a < b ? b : a;
    *enter = low > *enter ? low : *enter; /* NaN, of a ray in a face's plane, changes nothing */
    *leave = high < *leave ? high : *leave;
}

void fog_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    const struct dim_call *call = (const struct dim_call *)args->context;
    const struct fog_box *box = call->boxes + args->primID;
    const unsigned n = args->N;
    const float *origins = embree_floats(args->rayhit, FIELD_ORIGIN, n);
    const float *directions = embree_floats(args->rayhit, FIELD_DIRECTION, n);
    const float *ends = embree_floats(args->rayhit, FIELD_END, n);
    const uint32_t *ids = embree_ids(args->rayhit, n);
    for (unsigned i = 0; i < n; i++) {
        if (args->valid[i] != -1)
            continue;
        const float *o = origins + i, *d = directions + i;
        float enter = 0, leave = ends[i], square = 0;
        for (int k = 0; k < 3; k++) {
            const float *m = box->unit_from_world + 4 * k;
            const float step = m[0] * d[0] + m[1] * d[n] + m[2] * d[2 * n];
            slab(m[0] * o[0] + m[1] * o[n] + m[2] * o[2 * n] + m[3], step, &enter, &leave);
            square += step * box->weight[k] * step * box->weight[k];
        }
        if (enter < leave)
            passage_enter(&call->passages[ids[i] - call->first_id], enter, leave, sqrtf(square));
    }
}

static void dim_single(const struct cranny_tracer *tracer, struct dim_call *call,
                       const float origin[3], const struct ray_block *block, const float *ends,
                       int ray)
{
    const float direction[3] = {block->x[ray], block->y[ray], block->z[ray]};
    struct RTCRayHit r = pack_ray(origin, direction, ends[ray], block->ids + (uint32_t)ray);
    call->first_id = r.ray.id;
    if (tracer->fog)
        embree_filtered1(tracer->fog, &call->context, NULL, &r);
    if (tracer->trees)
        embree_filtered1(tracer->trees, &call->context, tree_filter, &r);
}

/* As in packets.c. The fog comes first: it leaves the rays as they are. */
#define DEFINE_DIM_PACKET(WIDTH)                                                                   \
    static void dim_packet##WIDTH(const struct cranny_tracer *tracer, struct dim_call *call,       \
                                  const float origin[3], const struct ray_block *block,            \
                                  const float *ends, int first, int count)                         \
    {                                                                                              \
        struct RTCRayHit##WIDTH r;                                                                 \
        _Alignas(64) int valid[WIDTH];                                                             \
        pack_rays##WIDTH(origin, block, first, count, ends, valid, &r);                            \
        call->first_id = r.ray.id[0];                                                              \
        if (tracer->fog)                                                                           \
            embree_filtered##WIDTH(tracer->fog, valid, &call->context, NULL, &r);                  \
        if (tracer->trees)                                                                         \
            embree_filtered##WIDTH(tracer->trees, valid, &call->context, tree_filter, &r);         \
    }

DEFINE_DIM_PACKET(8)
DEFINE_DIM_PACKET(16)

/* How many crossings leave less than LEFT_MIN; 0: more than are kept in order. */
static int enough_crossings(float opacity)
{
    float left = 1;
    for (int count = 1; count <= PASSAGE_MAX; count++) {
        left *= 1 - opacity;
        if (left < LEFT_MIN)
            return count;
    }
    return 0;
}

/* Where a ray may end: at its hit, or where ρ is 1 for both kernels and a share that is taken
 * counts no less than one that is not. */
static void find_ends(const struct passage_rules *rules, const struct ray_block *block, int count,
                      float *ends)
{
    const bool bounded =
        rules->dimming == CRANNY_DIMMING_KERNEL && rules->kernel != CRANNY_KERNEL_EXPONENTIAL;
    const float reach = bounded ? fmaxf(rules->distances[0], rules->distances[1]) : INFINITY;
    for (int i = 0; i < RAY_BLOCK; i++)
        ends[i] = i < count ? fminf(block->distance[i], reach) : 0;
}

static int packet_width(enum cranny_packet packet)
{
    switch (packet) {
    case CRANNY_PACKET_1:
        return 1;
    case CRANNY_PACKET_8:
        return 8;
    case CRANNY_PACKET_16:
        return LANES_MAX;
    }
    return 1;
}

void ray_block_dim(const struct cranny_tracer *tracer, enum cranny_packet packet,
                   enum cranny_kernel kernel, const float distances[2], const float origin[3],
                   const struct ray_block *block, int count, float values[2][RAY_BLOCK])
{
    struct passage passages[LANES_MAX];
    const struct passage_rules rules = {
        tracer->dimming, kernel, {distances[0], distances[1]}, tracer->tree_opacity};
    struct dim_call call = {.boxes = tracer->boxes,
                            .passages = passages,
                            .crossings_enough = enough_crossings(tracer->tree_opacity),
                            .apart = 2 * ray_offset(origin, 0)};
    float ends[RAY_BLOCK];
    find_ends(&rules, block, count, ends);
    const int width = packet_width(packet);
    for (int first = 0; first < count; first += width) {
        const int lanes = min_int(width, count - first);
        for (int i = 0; i < lanes; i++)
            passage_clear(&passages[i]);
        if (width == 1)
            dim_single(tracer, &call, origin, block, ends, first);
        else if (width == 8)
            dim_packet8(tracer, &call, origin, block, ends, first, lanes);
        else
            dim_packet16(tracer, &call, origin, block, ends, first, lanes);
        for (int i = 0; i < lanes; i++) {
            if (passage_empty(&passages[i]))
                continue;
            float pair[2] = {values[0][first + i], values[1][first + i]};
            passage_apply(&passages[i], &rules, pair);
            values[0][first + i] = pair[0];
            values[1][first + i] = pair[1];
        }
    }
}
