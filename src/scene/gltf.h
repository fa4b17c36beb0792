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
    bool reached; /* below a root of the chosen scene, or below a level of detail of such a node */
    json_t *object; /* borrowed */
    /* levels of detail, by lods.c */
    int base;       /* whose world its transform counts from: its parent, or that of its finest */
    int lod_of;     /* the node that it is a coarser level of; -1: none */
    uint32_t level; /* how many levels coarser */
    bool finest;    /* has such levels */
    bool hung;      /* outside the scene graph */
    bool by_name;   /* it, or a node above it, is a level by its name alone */
    bool stated;    /* it, or a node above it, is a level by MSFT_lod */
    uint8_t visit;
    uint32_t lod, lod_group, stated_lod; /* the last without levels by name */
    /* by roles.c */
    enum cranny_role role;       /* of what it shows itself */
    enum cranny_role role_below; /* of the nodes below it that say nothing */
};

/* Where a node's group and role come from: its finest level, else its parent. */
static inline int node_up(const struct node *node)
{
    return node->lod_of >= 0 ? node->lod_of : node->parent;
}

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
    size_t role_complaints;
    int *mesh_roles; /* what each glTF mesh says: a role, or one of enum said_role */
    size_t mesh_count;
    uint32_t lod_group_count;
};

/* nodes.c: the hierarchy, with world transforms and what scene `scene_index` reaches. */
enum cranny_status nodes_read(struct gltf *gltf, int scene_index, struct cranny_error *why);
/* 3 rows of 4 from `translation`, unit quaternion `rotation` (x, y, z, w) and `scale`. */
void transform_from_trs(const double translation[3], const double rotation[4],
                        const double scale[3], double out[12]);
bool transform_finite(const double m[12]);
/* Visit below the nodes already in `queue` (`count` of them), parents before children, and mark all
 * of them reached; what is below and was reached before stays out. The new count. */
size_t nodes_walk(struct gltf *gltf, size_t *queue, size_t count);

/* Complaints of one kind that are said; a broken file has thousands. */
enum { COMPLAINT_LIMIT = 8 };

/* lods.c: the coarser levels of what the scene reaches, then groups and roles of all reached nodes.
 * `queue` has room for all nodes. */
enum cranny_status lods_read(struct gltf *gltf, size_t *queue, struct cranny_error *why);
/* After the instances: drop groups of one level, and levels by name that stand apart; let every
 * group begin at 0. */
enum cranny_status lods_finish(struct gltf *gltf, struct cranny_error *why);

/* lod_names.c: levels by the names of siblings ("X_LOD1"). */
enum cranny_status lods_by_name(struct gltf *gltf, struct cranny_error *why);
/* A name that ends in _LOD and a number, perhaps with Blender's .001 behind that. `base` bytes come
 * before the ending; *rest is what follows the number. False: not such a name. */
bool lod_name(const char *name, size_t *base, uint32_t *level, const char **rest);

/* roles.c */
enum said_role { ROLE_UNREAD = -2, ROLE_UNSAID = -1 };
/* Role of a node whose node above has been given one. */
void node_take_role(struct gltf *gltf, size_t index);

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
