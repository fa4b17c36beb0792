/* Inside the volumes layer: what a scene's volumes are made of.
 *
 * Polygons lie in the order of the tree's leaves, in floats relative to the scene's centre. Nothing
 * here depends on δ: boxes hold how far volumes reach beyond their polygons per unit of it. */
#ifndef VOLUMES_VOLUMES_H
#define VOLUMES_VOLUMES_H

#include "base/base.h"

#include <cranny/volumes.h>

enum polygon_flags { POLYGON_QUAD = 1, POLYGON_DOUBLE_SIDED = 2 };

struct volume_polygon {
    float corner[4][3]; /* front faces counter-clockwise; a triangle's fourth is its first */
    float alpha;
    uint32_t flags;
};

/* For every δ: min − δ reach_low … max + δ reach_high. */
struct volume_box {
    float low[3], high[3], reach_low[3], reach_high[3];
};

/* Nodes in preorder: the next one is the first child, `skip` the next one outside. */
struct volume_node {
    struct volume_box box;
    uint32_t skip, first, count; /* polygons of a leaf; 0: an inner node */
};

struct cranny_volumes {
    struct volume_polygon *polygons;
    struct volume_node *nodes;
    uint32_t polygon_count, node_count;
    double centre[3];
    float half_size; /* of the scene's box, its longest side */
    struct cranny_volumes_info info;
};

/* Boxes around the polygons, and the polygons sorted into their order; the same for every number of
 * threads. Takes `polygons`, which it frees. (tree.c) */
enum cranny_status tree_build(struct cranny_volumes *volumes, struct volume_polygon *polygons,
                              int threads, struct cranny_error *why);

/* Faces of a mesh: quads where two triangles make one, else triangles. (quads.c) */
#define FACE_NONE UINT32_MAX
#define PARALLEL_LEAST 4096 /* triangles or faces worth waking threads for */
struct volume_face {
    uint32_t corner[4];    /* vertices; a triangle's fourth is its first */
    uint32_t triangles[2]; /* the second FACE_NONE for a triangle */
    bool closed;           /* part of a surface without a border */
};
enum cranny_status faces_find(const struct cranny_mesh *mesh, bool quads, int threads,
                              struct volume_face **faces, uint32_t *count,
                              struct cranny_error *why);

/* Mean coverage of a triangle by its material: ᾱ of eq. 24. (alpha.c) */
float mean_alpha(const struct cranny_scene *scene, const struct cranny_mesh *mesh,
                 uint32_t triangle);

#endif
