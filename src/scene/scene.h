/* Inside the scene layer: the scene's storage, and where each piece came from in its document. */
#ifndef SCENE_SCENE_H
#define SCENE_SCENE_H

#include "base/base.h"

#include <cranny/scene.h>

struct document;

/* A run of a mesh's vertices and triangles that came from one glTF primitive. Primitives that share
 * their vertex accessors share the vertex run too. */
struct mesh_part {
    uint32_t vertex_first, vertex_count;
    uint32_t triangle_first, triangle_count;
    uint32_t primitive; /* index in the glTF mesh */
};

/* Owns its arrays (all malloced); `view` shows them. */
struct mesh {
    struct cranny_mesh view;
    float bounds[2][3]; /* of all vertices: low, high; all zero without any */
    int source_mesh; /* glTF mesh, -1: none. Several scene meshes may share one (skins, morphs) */
    struct mesh_part *parts;
    uint32_t part_count;
};

struct instance {
    struct cranny_instance view;
    int source_node;  /* glTF node, -1: none */
    int source_index; /* within EXT_mesh_gpu_instancing, -1: an ordinary node */
};

struct cranny_scene {
    struct mesh *meshes;
    size_t mesh_count, mesh_capacity;
    struct instance *instances;
    size_t instance_count, instance_capacity;
    struct cranny_material *materials; /* names malloced */
    size_t material_count, material_capacity;
    struct cranny_alpha_texture *textures; /* alpha malloced */
    size_t texture_count, texture_capacity;
    struct cranny_color_texture *colors; /* rgb malloced */
    size_t color_count, color_capacity;
    struct cranny_camera *cameras; /* names malloced */
    size_t camera_count, camera_capacity;
    struct document *document; /* owned; NULL for scenes built from arrays */
    int *node_up; /* of each of its nodes: the parent, or the finest level; -1: none; may be NULL */
    size_t node_count;
    uint64_t skipped_primitives;
    const char *format; /* static text */
    char *generator;
};

/* Append an already allocated piece, taking ownership of what it points to. CRANNY_MEMORY leaves
 * the ownership with the caller. */
enum cranny_status scene_take_mesh(struct cranny_scene *scene, const struct mesh *mesh,
                                   struct cranny_error *why);
void mesh_free(struct mesh *mesh);

/* What an instance has besides its mesh's values: a linear function to multiply them by (constant,
 * x, y, z in the mesh's own space), or one number in their place. */
enum factor_kind { FACTOR_NONE, FACTOR_LINEAR, FACTOR_SCALAR };
struct instance_factor {
    enum factor_kind kind;
    float visibility[4], raw_long[4], raw_short[4]; /* FACTOR_SCALAR: the first of each */
};

/* Instances that exist and that a role rule with this pattern matches. False: out of memory. */
bool roles_count(const struct cranny_scene *scene, const char *pattern, uint32_t *count);

/* Per-vertex values to write into a scene's file: for every instance, a float per vertex of its
 * mesh. Instances of one mesh that give the same pointer share one set in the file. */
struct scene_values {
    const float *const *visibility; /* instance_count pointers */
    const float *const *raw_long;   /* for `raw`; may be NULL otherwise */
    const float *const *raw_short;
    const struct instance_factor *factors; /* instance_count; NULL: none */
};

/* cranny_scene_save, below the bake layer; `values` NULL writes the scene as it is. */
enum cranny_status scene_write(const struct cranny_scene *scene, const struct scene_values *values,
                               const char *path, const struct cranny_save_params *params,
                               struct cranny_error *why);

/* Points, rows of 4. */
static inline void transform_point(const double m[12], const float p[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
}

double transform_determinant(const double m[12]);
/* Rows of the inverse of the 3×3 part; false (and zeros) when it is singular. */
bool transform_inverse3(const double m[12], double inverse[9]);
/* a ∘ b */
void transform_multiply(const double a[12], const double b[12], double out[12]);

#endif
