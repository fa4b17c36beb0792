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

/* How what lies on the way to a ray's hit dims it. */
enum cranny_dimming {
    CRANNY_DIMMING_KERNEL, /* as much as is taken at a distance counts as a hit there: with shares
                              wᵢ taken at dᵢ and the rest W left at the hit, Σ wᵢ ρ(dᵢ) + W ρ(d);
                              in fog the sum is an integral, solved exactly. At short r this is
                              what matters: see docs/measurements/fog.md */
    CRANNY_DIMMING_PLAIN,  /* W ρ(d), whatever the distance (2013, §2.1) */
};

/* What to build, and with what. Instances that do not exist (cranny_instance_exists) are left out.
 * With `roles` false, all others are surfaces. With `roles` true (2013, §2.1) only solid ones are,
 * and a ray's way up to its hit is looked at for the others; grass is not there.
 *
 * Trees: each crossing of a triangle that counts (by its alpha, as everywhere) takes `tree_opacity`
 * of what is left; crossings of one instance in the same place, to rounding, are one. A ray keeps
 * 64 crossings in order, the nearest; further ones are taken together where the first of them is.
 *
 * A shrub is a box of fog, its mesh's bounding box in the instance's own space, at least 1/16 as
 * thick as it is long. Over a length s in it, in the mesh's own units, fog takes 1 − exp(−σ s);
 * where boxes overlap, their σ add. σ of a mesh is such that over lines that are even in the box
 * its mean 1 − exp(−σ s) is the share that its triangles stop. Where boxes overlap, σ is divided
 * by the mean number of boxes at points of the box, so that n boxes in one place take as much as
 * one. A ray keeps 64 boxes in order, as above. A shrub without volume is not there.
 *
 * Building fog takes time in the number of boxes times those near each; it grows with the square
 * where thousands are in one place. */
struct cranny_tracer_params {
    bool ground;         /* add an infinite occluding plane under everything; default false */
    float ground_height; /* metres, world y of that plane; NaN (default): the lowest vertex */
    bool roles;          /* default false */
    enum cranny_dimming dimming; /* default kernel */
    float tree_opacity;          /* share that a crossing of a tree takes, [0,1]; default 0.5 */
    float fog_density;           /* factor on σ, ≥ 0; default 1 */
    int threads;                 /* 0 (default): all cores */
    const struct cranny_hooks *hooks; /* may be NULL */
};

/* The defaults named above, no hooks. */
CRANNY_API struct cranny_tracer_params cranny_tracer_params_default(void);

/* Build. `params` NULL means defaults. CRANNY_MEMORY when the structure does not fit, CRANNY_USAGE
 * for parameters out of range. */
CRANNY_API enum cranny_status cranny_tracer_create(const struct cranny_scene *scene,
                                                   const struct cranny_tracer_params *params,
                                                   struct cranny_tracer **tracer,
                                                   struct cranny_error *why);

/* Frees the structure and sets *tracer to NULL; accepts NULL. */
CRANNY_API void cranny_tracer_destroy(struct cranny_tracer **tracer);

/* Bytes that the acceleration structures hold, fog's boxes included. */
CRANNY_API uint64_t cranny_tracer_bytes(const struct cranny_tracer *tracer);

/* What was built. Of `trees` and `fog_boxes` there are only those that can take anything. */
struct cranny_tracer_info {
    uint64_t bytes;                    /* all structures */
    uint64_t solids, trees, fog_boxes; /* instances */
    uint64_t fog_bytes, tree_bytes;    /* of `bytes`; meshes that trees share count as theirs */
    double seconds, fog_seconds;       /* to build, on the wall; of these, densities and boxes */
};

CRANNY_API void cranny_tracer_get_info(const struct cranny_tracer *tracer,
                                       struct cranny_tracer_info *info);

/* How a distance becomes visibility, ρ(d). A ray that hits nothing has ρ = 1. */
enum cranny_kernel {
    CRANNY_KERNEL_EXPONENTIAL, /* 1 − exp(ln(½) d / r): half open at r (2013, §2) */
    CRANNY_KERNEL_LINEAR,      /* min(d / r, 1) */
    CRANNY_KERNEL_HARD,        /* 0 below r, else 1 */
};

/* Where the directions of a point come from; cosine-distributed, or even over the sphere. */
enum cranny_sampler {
    CRANNY_SAMPLER_SPIRAL, /* Vogel spiral lifted to the hemisphere or sphere, rotated per point */
    CRANNY_SAMPLER_SOBOL,  /* Owen-scrambled Sobol, scrambled per point */
    CRANNY_SAMPLER_RANDOM, /* independent; the yardstick */
};

/* Which Embree call carries the rays: a strategy of the benches, not of the result.
 * (Rays are the same; hits agree but for rounding at edges.) */
enum cranny_packet { CRANNY_PACKET_1, CRANNY_PACKET_8, CRANNY_PACKET_16 };

/* Rays per point, and how their distances count. */
struct cranny_gather_params {
    int rays;           /* per point, 1..65536; default 64 */
    float distances[2]; /* metres, 1e-30 to 1e30: long and short r of the kernel; default 300, 2 */
    enum cranny_kernel kernel;   /* default exponential */
    enum cranny_sampler sampler; /* default spiral */
    enum cranny_packet packet;   /* default: the fastest measured */
    uint32_t seed;               /* default 0 */
    int threads;                 /* 0 (default): all cores; never changes the result */
    const struct cranny_hooks *hooks;
};

/* The defaults named above, no hooks. */
CRANNY_API struct cranny_gather_params cranny_gather_params_default(void);

/* Obscurance at points on surfaces, eq. 1 of the 2013 paper, dimmed as the tracer's roles say.
 * `positions`, `normals`: point_count vectors, world space; normals are unit shading normals.
 * `face_normals`: unit geometric normals to whose side rays are kept and along which the origin is
 * offset; NULL: `normals`. A ray below the face is mirrored to above it.
 * `visibility`: point_count × 2 floats in [0,1], for distances[0] and distances[1].
 * `back_fraction`: point_count floats, the share of rays that hit back faces of single-sided
 * materials (of solids, whatever dims the way); may be NULL.
 * CRANNY_USAGE for parameters out of range, CRANNY_CANCELLED from the progress hook. */
CRANNY_API enum cranny_status cranny_gather(const struct cranny_tracer *tracer, size_t point_count,
                                            const float (*positions)[3], const float (*normals)[3],
                                            const float (*face_normals)[3],
                                            const struct cranny_gather_params *params,
                                            float (*visibility)[2], float *back_fraction,
                                            struct cranny_error *why);

/* Spherical obscurance at points in the open (2013, §2.2 and §2.3): ρ over the whole sphere of
 * directions, for distances[0] and distances[1], on the nine real spherical harmonics up to l = 2
 * in the order and signs of cranny/runtime.h: ∫ ρ Y, so that the open has √(4π) and eight zeros,
 * exactly. Not convolved: cranny_sh_convolve makes visibilities. Rays start at the points, without
 * an offset, and are even over the sphere; `params->sampler` is read as there. `harmonics`:
 * point_count × 2 × 9 floats. `back_fraction` as above; may be NULL. Same statuses. */
CRANNY_API enum cranny_status cranny_gather_sphere(const struct cranny_tracer *tracer,
                                                   size_t point_count, const float (*positions)[3],
                                                   const struct cranny_gather_params *params,
                                                   float (*harmonics)[2][9], float *back_fraction,
                                                   struct cranny_error *why);

/* What a ray met first. */
struct cranny_hit {
    uint32_t instance; /* UINT32_MAX: nothing, or the ground plane */
    uint32_t triangle; /* of the instance's mesh */
    float u, v;        /* barycentrics of the triangle's second and third vertex */
    bool back_face;    /* seen from behind, whatever the material */
};

/* The nearest surface along each ray (with `roles`: of solids); the ray starts at `origins` (no
 * offset is added). `directions` unit. `distances`: metres, +INFINITY for none. `hits` may be NULL.
 * `threads` 0: all cores; never changes the result. */
CRANNY_API enum cranny_status cranny_trace(const struct cranny_tracer *tracer, size_t ray_count,
                                           const float (*origins)[3], const float (*directions)[3],
                                           float *distances, struct cranny_hit *hits, int threads,
                                           struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
