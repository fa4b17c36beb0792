/* What is baked: targets (sets of values), and where on them the samples lie. */
#ifndef BAKE_PLAN_H
#define BAKE_PLAN_H

#include "base/sequence.h"
#include "scene/scene.h"

#include <cranny/bake.h>

/* An instance's transform, made ready for points and normals. */
struct frame {
    double world[12];
    double normal[9]; /* inverse transpose of the 3×3 part */
    double side;      /* −1 when the transform mirrors */
    bool singular;    /* flattened: no area, or no normals */
};

/* One set of values: a mesh in one instance, or in several that share their values. */
struct target {
    uint32_t mesh;
    uint32_t instance_first, instance_count; /* in plan->order */
    double metric[9];       /* edges to world metres: the instance's 3×3 part, or a mean scale */
    double area;            /* m², in the metric; 0: nothing to bake, all values are 1 */
    uint32_t *sample_start; /* triangle_count + 1, from sample_base on; NULL when area is 0 */
    uint64_t sample_base;   /* in the arrays of samples */
    uint32_t sample_count;
    uint32_t sequence; /* number of its first sample in the point set */
    uint64_t key;      /* of what its samples' places follow from */
};

struct plan {
    const struct cranny_scene *scene;
    struct frame *frames; /* per instance of the scene */
    uint32_t *order;      /* instances, those of one target together */
    uint32_t order_count;
    double *share; /* per entry of order: cumulative share of the target's world area */
    struct target *targets;
    uint32_t *target_of; /* per instance of the scene; UINT32_MAX: none */
    size_t target_count;
    uint64_t sample_count;
    double density;    /* samples per square metre */
    uint32_t shift[2]; /* of the point set, from the seed */
    uint64_t *places;  /* per instance of the scene: hash of its transform */
};

/* Content of a mesh's shape: vertices, normals, triangles. */
uint64_t mesh_shape_key(const struct cranny_mesh *mesh);

/* Group the instances whose treatment (enum cranny_treatment) is in `takes`, a sum of 1 <<
 * treatment, and place the samples. There may be none. */
enum cranny_status plan_create(const struct cranny_scene *scene,
                               const struct cranny_bake_params *params, const uint8_t *treatments,
                               unsigned takes, struct plan *plan, struct cranny_error *why);
void plan_free(struct plan *plan);

void frame_make(const struct cranny_instance *instance, struct frame *frame);

/* The box in the world (min xyz, max xyz) of a mesh's own box; all zero without vertices. */
void instance_bounds(const struct mesh *mesh, const double world_from_object[12], double box[6]);

/* The instance of a target at `u` in [0,1) of its cumulative share of the area. */
uint32_t plan_pick(const struct plan *plan, const struct target *target, double u);

static inline const struct cranny_mesh *plan_mesh(const struct plan *plan,
                                                  const struct target *target)
{
    return &plan->scene->meshes[target->mesh].view;
}

/* The vector from vertex `a` to vertex `b`, in the target's metric. */
static inline void metric_edge(const double metric[9], const float a[3], const float b[3],
                               double out[3])
{
    const double d[3] = {(double)b[0] - a[0], (double)b[1] - a[1], (double)b[2] - a[2]};
    for (int i = 0; i < 3; i++)
        out[i] = metric[3 * i] * d[0] + metric[3 * i + 1] * d[1] + metric[3 * i + 2] * d[2];
}

/* m², or 0 for a triangle without a usable normal. */
double metric_area(const double metric[9], const struct cranny_mesh *mesh, uint32_t triangle);

/* Where sample `id` (of target->sequence on) lies in its triangle. One Kronecker (R2) sequence runs
 * through all samples of a target, so that each triangle's run is spread evenly and neighbours
 * complement one another. Where it begins follows from the target's own content: what else is in
 * the scene does not move samples. */
static inline void sample_barycentrics(const uint32_t shift[2], uint64_t id, double l[3])
{
    const uint32_t u = shift[0] + (uint32_t)id * 0xc13fa9a9u; /* 2³² / plastic number */
    const uint32_t v = shift[1] + (uint32_t)id * 0x91e10da5u; /* 2³² / its square */
    const double root = sqrt(((double)u + 0.5) * 0x1p-32);
    l[0] = 1 - root;
    l[1] = ((double)v + 0.5) * 0x1p-32 * root;
    l[2] = 1 - l[0] - l[1];
}

#endif
