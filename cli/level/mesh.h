/* Meshes of the level: growing vertex arrays, one surface per material. */
#ifndef LEVEL_MESH_H
#define LEVEL_MESH_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LEVEL_PI 3.14159265358979323846

struct vec {
    double x, y, z;
};

static inline struct vec vec(double x, double y, double z)
{
    return (struct vec){x, y, z};
}
static inline struct vec add(struct vec a, struct vec b)
{
    return vec(a.x + b.x, a.y + b.y, a.z + b.z);
}
static inline struct vec sub(struct vec a, struct vec b)
{
    return vec(a.x - b.x, a.y - b.y, a.z - b.z);
}
static inline struct vec scale(struct vec a, double s)
{
    return vec(a.x * s, a.y * s, a.z * s);
}
/* a + s b */
static inline struct vec along(struct vec a, struct vec b, double s)
{
    return add(a, scale(b, s));
}
static inline double dot(struct vec a, struct vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline struct vec cross(struct vec a, struct vec b)
{
    return vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline double length(struct vec a)
{
    return sqrt(dot(a, a));
}
static inline struct vec unit(struct vec a)
{
    double l = length(a);
    return l > 0 ? scale(a, 1 / l) : vec(0, 1, 0);
}
static inline double mix(double a, double b, double t)
{
    return a + (b - a) * t;
}
static inline double clamp01(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}
static inline double smooth(double low, double high, double x)
{
    double t = clamp01((x - low) / (high - low));
    return t * t * (3 - 2 * t);
}

/* A well-mixed number in [0,1) for three integers: the level's only source of chance. */
double chance(uint32_t seed, uint32_t a, uint32_t b);

enum material {
    MATERIAL_GROUND, /* white: the terrain's colours are on its vertices */
    MATERIAL_PLASTER,
    MATERIAL_PLASTER_WARM,
    MATERIAL_STONE,
    MATERIAL_WOOD,
    MATERIAL_WOOD_DARK,
    MATERIAL_TILE,
    MATERIAL_FLOOR,
    MATERIAL_WATER,
    MATERIAL_IRON,
    MATERIAL_CLAY,
    MATERIAL_BARK,
    MATERIAL_OAK,
    MATERIAL_PINE,
    MATERIAL_SHRUB,
    MATERIAL_LEAVES, /* masked */
    MATERIAL_GRASS,  /* masked */
    MATERIAL_FENCE,  /* masked */
    MATERIAL_COUNT
};

bool material_is_masked(enum material material);

/* Vertices and triangles of one material: a glTF primitive. */
struct surface {
    float (*positions)[3], (*normals)[3], (*uvs)[2];
    uint8_t (*colors)[4]; /* of the ground only, else NULL */
    uint32_t (*triangles)[3];
    size_t vertex_count, vertex_capacity, triangle_count, triangle_capacity;
};

struct mesh {
    char name[48];
    struct surface surfaces[MATERIAL_COUNT];
    bool failed; /* an allocation did: everything added since is missing */
};

void mesh_free(struct mesh *mesh);
size_t mesh_vertex_count(const struct mesh *mesh);
size_t mesh_triangle_count(const struct mesh *mesh);

/* Append; the index of the new vertex. */
uint32_t mesh_vertex(struct mesh *mesh, enum material material, struct vec position,
                     struct vec normal, double u, double v);
void mesh_triangle(struct mesh *mesh, enum material material, uint32_t a, uint32_t b, uint32_t c);

/* Normals of the vertices from `first` on, from the triangles from `first_triangle` on, each
 * weighted by its area. */
void mesh_smooth(struct mesh *mesh, enum material material, size_t first, size_t first_triangle);

#endif
