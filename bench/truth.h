/* Ground truth for the benches: visibility at points spread over a scene's surface. */
#ifndef BENCH_TRUTH_H
#define BENCH_TRUTH_H

#include <cranny/cranny.h>

/* Where a point lies, so that vertex values can be interpolated to it. */
struct truth_point {
    uint32_t instance, triangle;
    double l[3];
};

struct truth {
    size_t count;
    struct truth_point *points;
    float (*positions)[3], (*normals)[3], (*face_normals)[3];
    float *visibility; /* blended as the bake blends */
    uint8_t *buried;   /* more than a quarter of the rays hit back faces: left out */
};

/* `count` points, distributed by area with a fixed seed, each seen by `rays` rays. */
enum cranny_status truth_create(const struct cranny_scene *scene,
                                const struct cranny_tracer *tracer,
                                const struct cranny_bake_params *bake, size_t count, int rays,
                                struct truth *truth, struct cranny_error *why);
void truth_free(struct truth *truth);

/* Root mean square distance of interpolated vertex values from the truth. `values`: per instance.
 */
double truth_rms(const struct truth *truth, const struct cranny_scene *scene,
                 const float *const *values);

/* World-space vertices of an instance with unit normals: the mesh's own, or the mean of the faces.
 */
void world_vertices(const struct cranny_scene *scene, uint32_t instance, float (*positions)[3],
                    float (*normals)[3]);

#endif
