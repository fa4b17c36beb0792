/* The one place that knows which Embree there is: 3 takes a context per call, 4 optional arguments.
 * Filters are registered on geometries, which both do alike. */
#ifndef TRACE_EMBREE_H
#define TRACE_EMBREE_H

#include <math.h>
#include <stdint.h>

#if CRANNY_EMBREE_MAJOR == 4
#    include <embree4/rtcore.h>
#elif CRANNY_EMBREE_MAJOR == 3
#    include <embree3/rtcore.h>
#else
#    error "CRANNY_EMBREE_MAJOR must be 3 or 4"
#endif

/* Closest hits. The default flags (incoherent rays) are meant: see docs/measurements/trace.md. */
static inline void embree_closest1(RTCScene scene, struct RTCRayHit *ray)
{
#if CRANNY_EMBREE_MAJOR == 4
    rtcIntersect1(scene, ray, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, ray);
#endif
}

static inline void embree_closest8(RTCScene scene, const int *valid, struct RTCRayHit8 *rays)
{
#if CRANNY_EMBREE_MAJOR == 4
    rtcIntersect8(valid, scene, rays, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect8(valid, scene, &context, rays);
#endif
}

static inline void embree_closest16(RTCScene scene, const int *valid, struct RTCRayHit16 *rays)
{
#if CRANNY_EMBREE_MAJOR == 4
    rtcIntersect16(valid, scene, rays, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect16(valid, scene, &context, rays);
#endif
}

/* What a filter reads of one lane. Embree's own accessors are C++ only; both structs are N floats
 * or ints per field, in the order of RTCRay and RTCHit. */
struct embree_candidate {
    uint32_t ray, geometry, top, primitive;
    float u, v;
};

static inline struct embree_candidate
embree_candidate(const struct RTCFilterFunctionNArguments *args, unsigned lane)
{
    const unsigned n = args->N;
    const float *numbers = (const float *)args->hit;
    const uint32_t *ids = (const uint32_t *)args->hit, *ray = (const uint32_t *)args->ray;
    return (struct embree_candidate){.ray = ray[10 * n + lane],
                                     .u = numbers[3 * n + lane],
                                     .v = numbers[4 * n + lane],
                                     .primitive = ids[5 * n + lane],
                                     .geometry = ids[6 * n + lane],
                                     .top = ids[7 * n + lane]};
}

/* Any hit: tfar becomes −infinity. Only the benches ask. */
static inline void embree_any8(RTCScene scene, const int *valid, struct RTCRay8 *rays)
{
#if CRANNY_EMBREE_MAJOR == 4
    rtcOccluded8(valid, scene, rays, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded8(valid, scene, &context, rays);
#endif
}

#endif
