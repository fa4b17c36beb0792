/* Decoding a document into a scene: what the reader's parts share. */
#ifndef SCENE_GLTF_H
#define SCENE_GLTF_H

#include "scene/accessor.h"
#include "scene/fields.h"
#include "scene/scene.h"

/* A node of the hierarchy. */
struct node {
    double local[12], world[12];
    int parent; /* -1: a root */
    int mesh, skin, camera;
    bool reached;   /* below a root of the chosen scene */
    json_t *object; /* borrowed */
};

/* A glTF material as far as it has been looked at. */
struct material_state {
    bool prepared; /* its texture has been decoded, or found missing */
    int texcoord;  /* set that its texture wants; -1: no texture */
};

/* Textures already decoded, by image and wrap modes. */
struct texture_key {
    int image;
    enum cranny_wrap wrap_u, wrap_v;
    int texture; /* in the scene; -1: opaque or undecodable */
    int color;   /* among its colour textures; -1: not wanted or undecodable */
};

struct gltf {
    struct document *document;
    struct cranny_scene *scene;
    bool colors; /* wanted, besides alpha */
    struct views views;
    struct node *nodes;
    size_t node_count;
    struct material_state *materials; /* of the document's materials */
    size_t material_count;
    int default_material; /* in the scene; -1: not needed so far */
    struct texture_key *texture_keys;
    size_t texture_key_count, texture_key_capacity;
    int *shared_meshes; /* scene mesh of each glTF mesh in its plain state; -1: not decoded */
    size_t mesh_count;
};

/* nodes.c: the hierarchy, with world transforms and what scene `scene_index` reaches. */
enum cranny_status nodes_read(struct gltf *gltf, int scene_index, struct cranny_error *why);
/* 3 rows of 4 from `translation`, unit quaternion `rotation` (x, y, z, w) and `scale`. */
void transform_from_trs(const double translation[3], const double rotation[4],
                        const double scale[3], double out[12]);
bool transform_finite(const double m[12]);

/* material.c */
enum cranny_status materials_read(struct gltf *gltf, struct cranny_error *why);
/* The scene's material for a primitive's (`material` -1: glTF's default one), its alpha texture
 * decoded. *texcoord: the set its texture wants, -1: none. */
enum cranny_status material_use(struct gltf *gltf, int material, uint32_t *index, int *texcoord,
                                struct cranny_error *why);

/* color.c: an image as a colour texture of the scene, not too large. */
struct image;
enum cranny_status color_add(struct gltf *gltf, const struct image *image,
                             const struct texture_key *key, int *color, struct cranny_error *why);

/* How a node shows its mesh: skinned, morphed, or (all NULL) as it is stored. */
struct pose {
    const json_t *weights;      /* of the morph targets; NULL: none */
    const double (*joints)[12]; /* joint_count matrices that take mesh space to world space */
    size_t joint_count;
};

/* mesh.c: decode glTF mesh `index` in a pose; -1 when it has no triangles. */
enum cranny_status mesh_read(struct gltf *gltf, size_t index, const struct pose *pose,
                             int *scene_mesh, struct cranny_error *why);

/* instances.c: meshes, instances and cameras of all reached nodes. */
enum cranny_status instances_read(struct gltf *gltf, struct cranny_error *why);

#endif
