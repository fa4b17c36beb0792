/* Blocks of rays through Embree's calls of 1, 8 and 16 rays. */
#include "trace/pack.h"

struct lane_hit {
    uint32_t geometry, top, primitive;
    float normal[3];
};

static void finish_lane(const struct cranny_tracer *tracer, const float origin[3],
                        struct ray_block *block, int ray, float distance,
                        const struct lane_hit *hit)
{
    const float direction[3] = {block->x[ray], block->y[ray], block->z[ray]};
    const float ground = ground_distance(tracer, origin[1], direction[1]);
    if (hit->geometry == RTC_INVALID_GEOMETRY_ID || ground < distance) {
        block->distance[ray] = ground;
        return;
    }
    block->distance[ray] = distance;
    if (tracer_back_face(tracer, hit->top, hit->normal, direction) &&
        !tracer_double_sided(tracer, hit->geometry, hit->top, hit->primitive))
        block->back_faces++;
}

static void trace_single(const struct cranny_tracer *tracer, const float origin[3],
                         struct ray_block *block, int ray)
{
    const float direction[3] = {block->x[ray], block->y[ray], block->z[ray]};
    struct RTCRayHit r = pack_ray(origin, direction, block->reach, block->ids + (uint32_t)ray);
    embree_closest1(tracer->world, &r);
    const struct lane_hit hit = {
        r.hit.geomID, r.hit.instID[0], r.hit.primID, {r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z}};
    finish_lane(tracer, origin, block, ray, r.ray.tfar, &hit);
}

/* One body for both widths: Embree's packet types differ in nothing but the lane count. */
#define DEFINE_TRACE_PACKET(WIDTH)                                                                 \
    static void trace_packet##WIDTH(const struct cranny_tracer *tracer, const float origin[3],     \
                                    struct ray_block *block, int first, int count)                 \
    {                                                                                              \
        struct RTCRayHit##WIDTH r;                                                                 \
        _Alignas(64) int valid[WIDTH];                                                             \
        pack_rays##WIDTH(origin, block, first, count, NULL, valid, &r);                            \
        embree_closest##WIDTH(tracer->world, valid, &r);                                           \
        for (int i = 0; i < count; i++) {                                                          \
            const struct lane_hit hit = {r.hit.geomID[i],                                          \
                                         r.hit.instID[0][i],                                       \
                                         r.hit.primID[i],                                          \
                                         {r.hit.Ng_x[i], r.hit.Ng_y[i], r.hit.Ng_z[i]}};           \
            finish_lane(tracer, origin, block, first + i, r.ray.tfar[i], &hit);                    \
        }                                                                                          \
    }

DEFINE_TRACE_PACKET(8)
DEFINE_TRACE_PACKET(16)

void ray_block_trace(const struct cranny_tracer *tracer, enum cranny_packet packet,
                     const float origin[3], struct ray_block *block, int count)
{
    block->back_faces = 0;
    switch (packet) {
    case CRANNY_PACKET_1:
        for (int ray = 0; ray < count; ray++)
            trace_single(tracer, origin, block, ray);
        return;
    case CRANNY_PACKET_8:
        for (int first = 0; first < count; first += 8)
            trace_packet8(tracer, origin, block, first, min_int(8, count - first));
        return;
    case CRANNY_PACKET_16:
        for (int first = 0; first < count; first += 16)
            trace_packet16(tracer, origin, block, first, min_int(16, count - first));
        return;
    }
}
