/* Rays: a scene made ready for tracing, and obscurance gathered at given points.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013 (§2). */
#ifndef CRANNY_TRACE_H
#define CRANNY_TRACE_H

#include <cranny/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A scene in an acceleration structure. Immutable: gathering from several threads is safe.
 * Keeps a pointer to the scene, which must outlive it. */
struct cranny_tracer;

/* What to build, and with what. */
struct cranny_tracer_params {
    bool ground;         /* add an infinite occluding plane under everything; default false */
    float ground_height; /* metres, world y of that plane; NaN (default): the lowest vertex */
    int threads;         /* 0 (default): all cores */
    const struct cranny_hooks *hooks; /* may be NULL */
};

/* The defaults named above, no hooks. */
CRANNY_API struct cranny_tracer_params cranny_tracer_params_default(void);

/* Build. `params` NULL means defaults. CRANNY_MEMORY when the structure does not fit. */
CRANNY_API enum cranny_status cranny_tracer_create(const struct cranny_scene *scene,
                                                   const struct cranny_tracer_params *params,
                                                   struct cranny_tracer **tracer,
                                                   struct cranny_error *why);

/* Frees the structure and sets *tracer to NULL; accepts NULL. */
CRANNY_API void cranny_tracer_destroy(struct cranny_tracer **tracer);

/* Bytes that the acceleration structure holds. */
CRANNY_API uint64_t cranny_tracer_bytes(const struct cranny_tracer *tracer);

/* How a distance becomes visibility, ρ(d). A ray that hits nothing has ρ = 1. */
enum cranny_kernel {
    CRANNY_KERNEL_EXPONENTIAL, /* 1 − exp(ln(½) d / r): half open at r (2013, §2) */
    CRANNY_KERNEL_LINEAR,      /* min(d / r, 1) */
    CRANNY_KERNEL_HARD,        /* 0 below r, else 1 */
};

/* Where the directions of a point come from; all are cosine-distributed. */
enum cranny_sampler {
    CRANNY_SAMPLER_SPIRAL, /* Vogel spiral lifted to the hemisphere, rotated per point */
    CRANNY_SAMPLER_SOBOL,  /* Owen-scrambled Sobol, scrambled per point */
    CRANNY_SAMPLER_RANDOM, /* independent; the yardstick */
};

/* Which Embree call carries the rays: a strategy of the benches, not of the result.
 * (Rays are the same; hits agree but for rounding at edges.) */
enum cranny_packet { CRANNY_PACKET_1, CRANNY_PACKET_8, CRANNY_PACKET_16 };

/* Rays per point, and how their distances count. */
struct cranny_gather_params {
    int rays;                   /* per point, 1..65536; default 64 */
    float distances[2];         /* metres, > 0: long and short r of the kernel; default 300 and 2 */
    enum cranny_kernel kernel;  /* default exponential */
    enum cranny_sampler sampler; /* default spiral */
    enum cranny_packet packet;  /* default: the fastest measured */
    uint32_t seed;              /* default 0 */
    int threads;                /* 0 (default): all cores; never changes the result */
    const struct cranny_hooks *hooks;
};

/* The defaults named above, no hooks. */
CRANNY_API struct cranny_gather_params cranny_gather_params_default(void);

/* Obscurance at points on surfaces, eq. 1 of the 2013 paper.
 * `positions`, `normals`: point_count vectors, world space; normals are unit shading normals.
 * `face_normals`: unit geometric normals to whose side rays are kept and along which the origin is
 * offset; NULL: `normals`. A ray below the face is mirrored to above it.
 * `visibility`: point_count × 2 floats in [0,1], for distances[0] and distances[1].
 * `back_fraction`: point_count floats, the share of rays that hit back faces of single-sided
 * materials; may be NULL.
 * CRANNY_USAGE for parameters out of range, CRANNY_CANCELLED from the progress hook. */
CRANNY_API enum cranny_status
cranny_gather(const struct cranny_tracer *tracer, size_t point_count, const float (*positions)[3],
              const float (*normals)[3], const float (*face_normals)[3],
              const struct cranny_gather_params *params, float (*visibility)[2],
              float *back_fraction, struct cranny_error *why);

/* What a ray met first. */
struct cranny_hit {
    uint32_t instance;     /* UINT32_MAX: nothing, or the ground plane */
    uint32_t triangle;     /* of the instance's mesh */
    float u, v;            /* barycentrics of the triangle's second and third vertex */
    bool back_face;        /* seen from behind, whatever the material */
};

/* The nearest surface along each ray; the ray starts at `origins` (no offset is added).
 * `directions` unit. `distances`: metres, +INFINITY for none. `hits` may be NULL.
 * `threads` 0: all cores; never changes the result. */
CRANNY_API enum cranny_status cranny_trace(const struct cranny_tracer *tracer, size_t ray_count,
                                           const float (*origins)[3], const float (*directions)[3],
                                           float *distances, struct cranny_hit *hits, int threads,
                                           struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
