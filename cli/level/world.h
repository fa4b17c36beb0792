/* The level as a whole: its meshes, its nodes, and what makes them. */
#ifndef LEVEL_WORLD_H
#define LEVEL_WORLD_H

#include "shapes.h"

#define LEVEL_HALF_SIZE 80.0 /* metres from the middle of the terrain to its edge */

/* Where copies of a node's mesh stand (EXT_mesh_gpu_instancing). */
struct scatter {
    float (*translations)[3], (*rotations)[4], (*scales)[3];
    size_t count;
};

struct node {
    char name[48];
    int mesh, parent;       /* -1: none */
    int lod;                /* node of the next simpler level, -1: none */
    bool hidden;            /* not part of the scene: reached through `lod` only */
    const char *role;       /* NULL: solid */
    struct scatter scatter; /* count 0: one copy, at the node */
    double translation[3], rotation[4], scale[3];
};

struct view {
    const char *name;
    struct vec eye, target;
    double fov_y; /* degrees */
};

/* A place that the ground is level at, and that plants keep away from. */
struct site {
    double x, z, angle, half_x, half_z; /* metres, before turning */
};

#define HOUSE_COUNT 6
#define COURTYARD HOUSE_COUNT
#define SITE_COUNT (HOUSE_COUNT + 1) /* the last is the courtyard */
#define VIEW_COUNT 3

struct terrain {
    uint32_t seed;
    struct site sites[SITE_COUNT];
    double heights[SITE_COUNT];
};

struct world {
    double scale; /* what was asked for, times a constant that puts 1 near 250 thousand triangles */
    uint32_t seed;
    double edge; /* metres: longest edge of flat surfaces indoors at this scale */
    struct terrain terrain;
    struct mesh *meshes;
    size_t mesh_count, mesh_capacity;
    struct node *nodes;
    size_t node_count, node_capacity;
    struct view views[VIEW_COUNT];
    size_t trees, shrubs, clumps, tree_models;
    bool failed;
};

struct totals {
    uint64_t triangles, vertices; /* in the world: each mesh once per node that shows it */
    uint64_t unique_triangles, unique_vertices; /* stored: each mesh once */
    uint64_t solid_triangles, solid_vertices;   /* in the world, without plants */
    uint64_t lod_triangles, lod_vertices;       /* of the simpler levels, which `triangles` lacks */
};

/* Build everything; false when memory ran out. Same bits for the same scale and seed. */
bool world_build(struct world *world, double scale, uint32_t seed);
void world_free(struct world *world);
struct totals world_totals(const struct world *world);

/* Hand a finished mesh over; its index. */
int world_add_mesh(struct world *world, struct mesh *mesh);
/* A node at `position`, turned by `angle` radians about y; its index. `name` is a printf format
 * without arguments but `number` (%03d). */
int world_add_node(struct world *world, const char *format, int number, int mesh, int parent,
                   struct vec position, double angle);

/* A simpler level of `node`, behind those it has already: the mesh, in the same place. */
void world_add_level(struct world *world, int node, struct mesh *mesh);

/* A number that grows with the scale like its square root: sides, counts. */
int world_count(const struct world *world, double at_scale_1, int minimum);

/* The same for what is also more numerous at a larger scale: with its square in triangles and the
 * square root in copies the whole grows like the scale. */
int world_detail(const struct world *world, double at_scale_1, int minimum);

/* The same for what is small and alike: grows like the scale itself. */
int world_crowd(const struct world *world, double at_scale_1, int minimum);

double terrain_height(const struct terrain *terrain, double x, double z);
/* 0 off the path, 1 on it. */
double terrain_path(const struct terrain *terrain, double x, double z);
/* Metres from the outline of the nearest site; negative inside. */
double terrain_clearance(const struct terrain *terrain, double x, double z);
void terrain_create(struct terrain *terrain, uint32_t seed);
void terrain_build(struct world *world);

/* A point of a site in world axes. */
struct vec site_point(const struct terrain *terrain, int site, struct vec local);

/* Meshes that all houses share. */
struct furniture {
    int table, bench, shelf, crate, barrel, jar, bed, lamp;
};
struct furniture furniture_build(struct world *world);

void houses_build(struct world *world);
void yard_build(struct world *world);   /* courtyard, well, fences, woodpiles */
void stones_build(struct world *world); /* rubble, sunk into ground and walls */
void plants_build(struct world *world); /* trees, shrubs, grass */

#endif
