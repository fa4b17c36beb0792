/* Rays in Embree's structures. */
#ifndef TRACE_PACK_H
#define TRACE_PACK_H

#include "trace/tracer.h"

static inline struct RTCRayHit pack_ray(const float origin[3], const float direction[3], float end,
                                        uint32_t id)
{
    return (struct RTCRayHit){
        .ray = {.org_x = origin[0],
                .org_y = origin[1],
                .org_z = origin[2],
                .dir_x = direction[0],
                .dir_y = direction[1],
                .dir_z = direction[2],
                .tfar = end,
                .mask = UINT32_MAX,
                .id = id},
        .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}}};
}

/* Rays `first` … `first + count − 1`, and invalid ones to fill up. `ends`: a number a ray of the
 * block; NULL: the block's reach. One body for both widths: Embree's packet types differ in nothing
 * but the lane count. */
#define DEFINE_PACK_RAYS(WIDTH)                                                                    \
    static inline void pack_rays##WIDTH(const float origin[3], const struct ray_block *block,      \
                                        int first, int count, const float *ends, int valid[WIDTH], \
                                        struct RTCRayHit##WIDTH *r)                                \
    {                                                                                              \
        for (int i = 0; i < WIDTH; i++) {                                                          \
            valid[i] = i < count ? -1 : 0;                                                         \
            r->ray.org_x[i] = origin[0];                                                           \
            r->ray.org_y[i] = origin[1];                                                           \
            r->ray.org_z[i] = origin[2];                                                           \
            r->ray.dir_x[i] = block->x[first + i];                                                 \
            r->ray.dir_y[i] = block->y[first + i];                                                 \
            r->ray.dir_z[i] = block->z[first + i];                                                 \
            r->ray.tnear[i] = 0;                                                                   \
            r->ray.tfar[i] = ends ? ends[first + i] : block->reach;                                \
            r->ray.time[i] = 0;                                                                    \
            r->ray.mask[i] = UINT32_MAX;                                                           \
            r->ray.id[i] = block->ids + (uint32_t)(first + i);                                     \
            r->ray.flags[i] = 0;                                                                   \
            r->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;                                            \
            r->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;                                         \
        }                                                                                          \
    }

DEFINE_PACK_RAYS(8)
DEFINE_PACK_RAYS(16)

#undef DEFINE_PACK_RAYS

#endif
