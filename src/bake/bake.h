/* Inside the bake layer: the values of a bake, and where each set of them came from. */
#ifndef BAKE_BAKE_H
#define BAKE_BAKE_H

#include "bake/cache.h"
#include "bake/fit.h"

enum { CHANNELS = 3 }; /* of enum cranny_channel */

/* One set of values and what became of it. */
struct value_set {
    enum cranny_treatment treatment;
    uint32_t mesh, instance_first, instance_count;
    uint32_t vertex_count;
    float *values; /* the channels, one after the other */
    uint64_t key;  /* of the values in the cache; 0: they are not there */
    double area;
    uint64_t samples;
    struct fit_report fit;
};

struct cranny_bake {
    struct cranny_bake_report report;
    const struct cranny_scene *scene; /* for names only */
    uint32_t instance_count;
    uint32_t *set_of; /* per instance; SET_NONE: no values */
    struct value_set *sets;
    size_t set_count, set_capacity;
    struct cache *cache;          /* while it is made; NULL: none */
    uint8_t *treatments;          /* per instance: enum cranny_treatment */
    float (*linear)[CHANNELS][4]; /* per instance; NULL: none has coefficients */
};

#define SET_NONE UINT32_MAX

/* v = clamp(1 − intensity (1 − blend)) ^ contrast, blend = (1 − w) long + w short. */
float bake_remap(const struct cranny_bake_params *params, const float raw[2]);

/* Which treatment each instance gets: by its role, its level of detail and, for meshes with several
 * instances, `instances`. */
enum cranny_status treatments_choose(const struct cranny_scene *scene,
                                     const struct cranny_bake_params *params, uint8_t *treatments,
                                     struct cranny_error *why);

/* Value of a channel at a place on an instance's surface, its linear function included; 1 where
 * there are no values. `v`, `w`: barycentrics of the triangle's second and third corner. */
double bake_value_at(const struct cranny_bake *bake, uint32_t instance, uint32_t triangle, double v,
                     double w, enum cranny_channel channel);

/* A set more, with room for its values; NULL: out of memory. Valid until the next one. */
struct value_set *bake_add_set(struct cranny_bake *bake, uint32_t mesh, uint32_t vertex_count);

/* One set for all instances of a mesh that have a treatment. `make` appends it, for the first of
 * them; NULL: ones. */
typedef enum cranny_status mesh_set_fn(void *user, uint32_t instance, struct cranny_error *why);
enum cranny_status bake_set_per_mesh(struct cranny_bake *bake, enum cranny_treatment treatment,
                                     mesh_set_fn *make, void *user, struct cranny_error *why);

/* A tracer as a bake's parameters ask for it, with roles. */
enum cranny_status bake_tracer_create(const struct cranny_scene *scene,
                                      const struct cranny_bake_params *params,
                                      struct cranny_tracer **tracer, struct cranny_error *why);

/* Coefficients 1 0 0 0 for every instance, unless that has been done. */
enum cranny_status bake_need_linear(struct cranny_bake *bake, struct cranny_error *why);

#endif
