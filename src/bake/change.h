/* What stands in the way of rays, and where that differs between two bakes. */
#ifndef BAKE_CHANGE_H
#define BAKE_CHANGE_H

#include "base/base.h"

#include <cranny/bake.h>

/* An instance that rays meet. */
struct occluder {
    uint64_t key;  /* of all that rays notice: shape, materials, place, role */
    uint64_t fog;  /* 1: a box of fog */
    double box[6]; /* world: min xyz, max xyz; a little larger than what rays may meet */
};

struct occluders {
    struct occluder *items; /* by key */
    size_t count;
};

/* List them. */
enum cranny_status occluders_list(const struct cranny_scene *scene, struct occluders *list,
                                  struct cranny_error *why);

/* Keys of the meshes with their materials, as rays notice them: mesh_count numbers. */
enum cranny_status mesh_look_keys(const struct cranny_scene *scene, uint64_t *keys,
                                  struct cranny_error *why);

/* The most boxes in a change: each costs every sample's rays a look. */
#define CHANGE_BOXES_MAX 64

/* Where something came, went, or is different. */
struct change {
    float (*boxes)[6];
    size_t box_count;
    uint64_t added, removed; /* occluders; one that moved is both */
};

enum cranny_status change_find(const struct occluder *old, size_t old_count,
                               const struct occluders *now, struct change *change,
                               struct cranny_error *why);
void change_free(struct change *change);

#endif
