/* Inside the trace layer: what a tracer is made of, and how a hit leads back to the scene.
 *
 * Geometry ids carry the way back: 2 × instance + class, in the world's Embree scene for flattened
 * meshes, and class alone in the Embree scene of a mesh that several instances share. */
#ifndef TRACE_TRACER_H
#define TRACE_TRACER_H

#include "base/base.h"
#include "trace/embree.h"

#include <cranny/trace.h>
#include <stdatomic.h>

enum triangle_class {
    TRIANGLE_SOLID,    /* every hit counts */
    TRIANGLE_FILTERED, /* alpha decides, in a callback */
    TRIANGLE_CLASSES,
    TRIANGLE_IGNORED, /* no hit ever counts: not in the structure */
};

/* What an instance is to rays. */
enum tracer_kind { KIND_ABSENT, KIND_SOLID, KIND_TREE, KIND_FOG };

enum mesh_sides { SIDES_SINGLE, SIDES_DOUBLE, SIDES_MIXED };

struct tracer_mesh {
    uint32_t counts[TRIANGLE_CLASSES];
    uint32_t *triangles[TRIANGLE_CLASSES]; /* primitive → triangle; NULL: the same number */
    enum mesh_sides sides;
    RTCScene scene;  /* NULL: no instance shares it */
    bool used, tree; /* by anything, by a tree */
};

struct tracer_instance {
    enum tracer_kind kind;
    bool shared;   /* an Embree instance; else flattened into the world or the trees */
    bool mirrored; /* flattened with its winding turned round, so that front faces stay front */
    float object_from_world[9];
};

/* A box of fog: the cube from −1 to 1 in a space of its own, which `unit_from_world` (3 rows of 4)
 * leads to. A step of 1 m along d takes |weight ∘ unit d| of optical depth. */
struct fog_box {
    float unit_from_world[12];
    float weight[3]; /* density times half the box's sides, in the mesh's own space */
    uint32_t instance;
};

struct cranny_tracer {
    const struct cranny_scene *scene;
    RTCDevice device;
    RTCScene world;
    RTCScene trees, fog; /* NULL: none, and rays are not dimmed by them */
    struct fog_box *boxes;
    struct tracer_mesh *meshes;
    struct tracer_instance *instances;
    bool ground;
    float ground_height;
    enum cranny_dimming dimming;
    float tree_opacity;
    struct cranny_tracer_info built; /* all but `bytes` */
    atomic_llong bytes;
};

/* Where a hit is in the scene's own terms. */
struct tracer_place {
    uint32_t instance, mesh, triangle;
};

static inline uint32_t hit_instance(uint32_t geometry, uint32_t top)
{
    return (top == RTC_INVALID_GEOMETRY_ID ? geometry : top) >> 1;
}

struct tracer_place tracer_place(const struct cranny_tracer *tracer, uint32_t geometry,
                                 uint32_t top, uint32_t primitive);

/* Whether a hit shows a face from behind. `normal` is Embree's, in the space of the geometry. */
bool tracer_back_face(const struct cranny_tracer *tracer, uint32_t top, const float normal[3],
                      const float direction[3]);

/* Whether the material at a hit has no back. */
bool tracer_double_sided(const struct cranny_tracer *tracer, uint32_t geometry, uint32_t top,
                         uint32_t primitive);

/* Distance to the ground plane from above; INFINITY when the ray misses it or there is none. */
static inline float ground_distance(const struct cranny_tracer *tracer, float origin_y,
                                    float direction_y)
{
    if (!tracer->ground || !(direction_y < 0) || !(origin_y >= tracer->ground_height))
        return INFINITY;
    return (tracer->ground_height - origin_y) / direction_y;
}

/* The callback for TRIANGLE_FILTERED geometries; their user data is the tracer. (alpha.c) */
void alpha_filter(const struct RTCFilterFunctionNArguments *args);
enum triangle_class alpha_class(const struct cranny_scene *scene, const struct cranny_mesh *mesh,
                                uint32_t triangle);

/* The nearest surface along one ray, at most `reach` away, for one thread; `id` decides the dice of
 * blended surfaces. `hit` may be NULL. (hits.c) */
void trace_ray(const struct cranny_tracer *tracer, const float origin[3], const float direction[3],
               float reach, uint32_t id, float *distance, struct cranny_hit *hit);

/* Whether anything lies on the way that dims a ray. */
static inline bool tracer_dims(const struct cranny_tracer *tracer)
{
    return tracer->trees || tracer->fog;
}

/* Below this many triangles an Embree instance costs more than copies do. Rays meet a shared mesh
 * in its own space, which rounds differently. */
#define SHARED_TRIANGLES_MIN 64

/* A box of fog is at least as thick as this share of its longest side, so that a flat card is one.
 */
#define FOG_THICKNESS_MIN 0.0625f

#define RAY_BLOCK 64

/* Rays from one origin, and what they met. */
struct ray_block {
    _Alignas(64) float x[RAY_BLOCK];
    _Alignas(64) float y[RAY_BLOCK];
    _Alignas(64) float z[RAY_BLOCK];
    _Alignas(64) float distance[RAY_BLOCK]; /* INFINITY: nothing */
    float reach;         /* metres: hits at or beyond it need not be found; INFINITY: all are */
    uint32_t ids;        /* of the first ray; the next ones count on. For the filter's dice */
    uint32_t back_faces; /* hits on back faces of single-sided materials */
};

/* Closest hits for the first `count` rays, at most RAY_BLOCK. Packets never mix two blocks, so a
 * ray's answer depends on nothing but its block. (packets.c) */
void ray_block_trace(const struct cranny_tracer *tracer, enum cranny_packet packet,
                     const float origin[3], struct ray_block *block, int count);

/* What trees and fog on the way make of a block's values of ρ, after ray_block_trace. (dim.c) */
void ray_block_dim(const struct cranny_tracer *tracer, enum cranny_packet packet,
                   enum cranny_kernel kernel, const float distances[2], const float origin[3],
                   const struct ray_block *block, int count, float values[2][RAY_BLOCK]);

/* The callback of the fog's user geometry, for ray_block_dim. (dim.c) */
void fog_intersect(const struct RTCIntersectFunctionNArguments *args);

/* How far above its face a ray must start, in metres. (offset.c) */
float ray_offset(const float position[3], float extent);

#endif
