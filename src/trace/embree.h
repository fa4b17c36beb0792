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

/* Of scenes that embree_filtered calls are for, with a filter. */
#if CRANNY_EMBREE_MAJOR == 4
#    define EMBREE_SCENE_FILTERED RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS
#else
#    define EMBREE_SCENE_FILTERED RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION
#endif

/* What a call carries to its callbacks; first member of what the caller makes of it. */
#if CRANNY_EMBREE_MAJOR == 4
typedef struct RTCRayQueryContext embree_context;
#else
typedef struct RTCIntersectContext embree_context;
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

/* Calls with a context of the caller's, and a filter (may be NULL) for all hits that the
 * geometries' own filters let through. */
#if CRANNY_EMBREE_MAJOR == 4
#    define EMBREE_FILTERED(CONTEXT, FILTER, CALL)                                                 \
        struct RTCIntersectArguments arguments;                                                    \
        rtcInitIntersectArguments(&arguments);                                                     \
        rtcInitRayQueryContext(CONTEXT);                                                           \
        arguments.context = CONTEXT;                                                               \
        arguments.filter = FILTER;                                                                 \
        if (FILTER)                                                                                \
            arguments.flags |= RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;                          \
        CALL
static inline void embree_filtered1(RTCScene scene, embree_context *context,
                                    RTCFilterFunctionN filter, struct RTCRayHit *ray)
{
    EMBREE_FILTERED(context, filter, rtcIntersect1(scene, ray, &arguments));
}

static inline void embree_filtered8(RTCScene scene, const int *valid, embree_context *context,
                                    RTCFilterFunctionN filter, struct RTCRayHit8 *rays)
{
    EMBREE_FILTERED(context, filter, rtcIntersect8(valid, scene, rays, &arguments));
}

static inline void embree_filtered16(RTCScene scene, const int *valid, embree_context *context,
                                     RTCFilterFunctionN filter, struct RTCRayHit16 *rays)
{
    EMBREE_FILTERED(context, filter, rtcIntersect16(valid, scene, rays, &arguments));
}
#else
static inline void embree_filtered1(RTCScene scene, embree_context *context,
                                    RTCFilterFunctionN filter, struct RTCRayHit *ray)
{
    rtcInitIntersectContext(context);
    context->filter = filter;
    rtcIntersect1(scene, context, ray);
}

static inline void embree_filtered8(RTCScene scene, const int *valid, embree_context *context,
                                    RTCFilterFunctionN filter, struct RTCRayHit8 *rays)
{
    rtcInitIntersectContext(context);
    context->filter = filter;
    rtcIntersect8(valid, scene, context, rays);
}

static inline void embree_filtered16(RTCScene scene, const int *valid, embree_context *context,
                                     RTCFilterFunctionN filter, struct RTCRayHit16 *rays)
{
    rtcInitIntersectContext(context);
    context->filter = filter;
    rtcIntersect16(valid, scene, context, rays);
}
#endif

/* What a filter reads of one lane. Embree's own accessors are C++ only; both structs are N floats
 * or ints per field, in the order of RTCRay and RTCHit. */
struct embree_candidate {
    uint32_t ray, geometry, top, primitive;
    float u, v;
};

/* A ray packet's fields, N of each: RTCRay's, in its order. */
enum embree_field { FIELD_ORIGIN, FIELD_DIRECTION = 4, FIELD_END = 8, FIELD_ID = 10 };

static inline float *embree_floats(void *rays, enum embree_field field, unsigned n)
{
    return (float *)rays + (unsigned)field * n;
}

static inline const uint32_t *embree_ids(const void *rays, unsigned n)
{
    return (const uint32_t *)rays + (unsigned)FIELD_ID * n;
}

static inline struct embree_candidate
embree_candidate(const struct RTCFilterFunctionNArguments *args, unsigned lane)
{
    const unsigned n = args->N;
    const float *numbers = (const float *)args->hit;
    const uint32_t *ids = (const uint32_t *)args->hit;
    return (struct embree_candidate){.ray = embree_ids(args->ray, n)[lane],
                                     .u = numbers[3 * n + lane],
                                     .v = numbers[4 * n + lane],
                                     .primitive = ids[5 * n + lane],
                                     .geometry = ids[6 * n + lane],
                                     .top = ids[7 * n + lane]};
}

/* Any hit: tfar becomes −infinity. */
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
