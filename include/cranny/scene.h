/* Scenes: meshes in world-space instances, read from glTF (losslessly editable), from any format
 * that assimp reads, or built from arrays.
 *
 * World space: metres, right-handed, +Y up. Front faces wind counter-clockwise; an instance whose
 * transform mirrors keeps its front faces, as glTF 2.0 says. */
#ifndef CRANNY_SCENE_H
#define CRANNY_SCENE_H

#include <cranny/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A loaded scene. Reading it from several threads is safe; adding to it is not. */
struct cranny_scene;

/* What to read, and what to refuse. */
struct cranny_scene_load_params {
    bool allow_outside; /* read files that the scene names outside its own folder; default false */
    int scene;   /* index into glTF `scenes`; -1 (default): the file's default, else the first,
                    else every root node */
    bool colors; /* keep base colour textures, for pictures; default false */
    uint64_t memory_limit_bytes;      /* decoded geometry and images beyond this are refused with
                                         CRANNY_MEMORY; default 16 GiB */
    const struct cranny_hooks *hooks; /* warnings and progress; may be NULL */
};

/* The defaults named above, no hooks. */
CRANNY_API struct cranny_scene_load_params cranny_scene_load_params_default(void);

/* Read a scene. .gltf and .glb by Cranny's own reader, everything else (.obj .ply .stl .fbx .dae …)
 * through assimp; decided by content first, then by extension. `params` NULL means defaults.
 * CRANNY_INPUT: missing, broken, or not supported, with the file and JSON pointer at fault.
 * A scene without triangles loads; cranny_scene_triangle_count tells. */
CRANNY_API enum cranny_status cranny_scene_load(const char *path,
                                                const struct cranny_scene_load_params *params,
                                                struct cranny_scene **scene,
                                                struct cranny_error *why);

/* The same from memory (.glb or .gltf text with data URIs). No outside file is ever read.
 * `name` stands for the file in messages. The bytes may be freed after the call. */
CRANNY_API enum cranny_status
cranny_scene_load_memory(const void *data, size_t size, const char *name,
                         const struct cranny_scene_load_params *params, struct cranny_scene **scene,
                         struct cranny_error *why);

/* An empty scene to add to. */
CRANNY_API enum cranny_status cranny_scene_create(struct cranny_scene **scene,
                                                  struct cranny_error *why);

/* Frees the scene and sets *scene to NULL; accepts NULL. */
CRANNY_API void cranny_scene_destroy(struct cranny_scene **scene);

/* glTF's alphaMode: alpha is ignored, compared with the cutoff, or a share of coverage. */
enum cranny_alpha_mode { CRANNY_ALPHA_OPAQUE, CRANNY_ALPHA_MASK, CRANNY_ALPHA_BLEND };

/* What occlusion needs to know of a material. A hit counts with the probability `opacity` times the
 * alpha texture's value (BLEND), or when that product reaches `alpha_cutoff` (MASK). */
struct cranny_material {
    const char *name; /* "" when it has none */
    enum cranny_alpha_mode alpha_mode;
    float alpha_cutoff;
    float opacity;     /* base colour factor's alpha; times 1 − transmission for BLEND */
    bool double_sided; /* its back faces do not mark a sample as buried */
    int alpha_texture; /* index of a texture in the scene, -1: none */
    float
        uv_transform[6]; /* u' = t0 u + t1 v + t2, v' = t3 u + t4 v + t5 (KHR_texture_transform) */
    float base_color[4]; /* linear base colour factor */
    int color_texture;   /* index of a colour texture, which takes the same transform; -1: none.
                            Only scenes that are loaded with `colors` have any */
};

/* Texture coordinates beyond [0,1]. */
enum cranny_wrap { CRANNY_WRAP_REPEAT, CRANNY_WRAP_CLAMP, CRANNY_WRAP_MIRROR };

/* An alpha plane, 8 bits a texel, rows top to bottom without padding. */
struct cranny_alpha_texture {
    uint32_t width, height;
    enum cranny_wrap wrap_u, wrap_v;
    const uint8_t *alpha;
};

/* A base colour texture, sRGB, 3 bytes a texel, rows top to bottom without padding. Large ones are
 * scaled down to 512 texels at most each way. */
struct cranny_color_texture {
    uint32_t width, height;
    enum cranny_wrap wrap_u, wrap_v;
    const uint8_t *rgb;
};

/* Geometry in object space. Arrays belong to the scene and live as long as it does. */
struct cranny_mesh {
    const char *name; /* "" when it has none */
    uint32_t vertex_count;
    uint32_t triangle_count;
    const float (*positions)[3];        /* vertex_count */
    const float (*normals)[3];          /* vertex_count unit vectors, or NULL: faces are flat */
    const float (*texcoords)[2];        /* vertex_count, for textures; NULL when none is needed */
    const uint32_t (*triangles)[3];     /* triangle_count; every index below vertex_count */
    const uint32_t *triangle_materials; /* triangle_count; every index a material of the scene */
};

/* What an instance is to a bake (2013, §2.1 and §2.2). glTF says it as `"cranny_role": "tree"` in
 * the extras of a node, of its mesh or of a node above it; the nearest one counts. A word that is
 * no role is warned of and passed over. A coarser level of detail that says nothing takes the role
 * of its finest. */
enum cranny_role {
    CRANNY_ROLE_SOLID,   /* stops rays; gets values of its own */
    CRANNY_ROLE_TREE,    /* each crossing of a ray takes half of what is left */
    CRANNY_ROLE_SHRUB,   /* to rays a box of fog; one value for the whole of it */
    CRANNY_ROLE_GRASS,   /* nothing to rays; one value for the whole of it */
    CRANNY_ROLE_IGNORED, /* nothing to rays or pictures, no values: sky domes, collision hulls */
};
#define CRANNY_ROLE_COUNT 5

/* Names of the roles ("solid" …), NULL-terminated. */
CRANNY_API const char *const *cranny_role_names(void);

/* A mesh in the world. `world_from_object`: 3 rows of 4, the last column is the translation.
 * Instances that stand for one thing at several levels of detail have one `lod_group`, 1 or more
 * (0: none), and `lod` 0 is the finest of them; what has a `lod` above 0 is nothing to rays or
 * pictures, and its values come from the finest. A group may have several instances at a level
 * (a node with children), and need not have every level.
 *
 * In glTF, levels are
 * - the `ids` of MSFT_lod on a node: those nodes, with all below them, stand where the node stands
 *   (under the same parent, by their own transform) and need not be in the scene graph; one that
 *   is in it stays where it is and is loaded once;
 * - siblings whose names differ in a final _LOD and a number (_lod, _Lod), perhaps with a Blender
 *   copy's .001 behind: "Rock_LOD0", "Rock_LOD1"; "Rock" beside "Rock_LOD1" counts as the finest
 *   when there is no "Rock_LOD0". The lowest number is the finest. Levels by name must stand in
 *   the same place: those that lie apart (as on a sheet of samples) are warned of and stay single.
 * Levels within levels join the outer group. What cannot be followed (a node of two groups, a
 * circle, an index that does not exist, MSFT_lod on a material) is warned of and passed over. */
struct cranny_instance {
    const char *name;
    uint32_t mesh;
    double world_from_object[12];
    enum cranny_role role;
    uint32_t lod, lod_group;
};

/* Whether rays and pictures know an instance at all. */
static inline bool cranny_instance_exists(const struct cranny_instance *instance)
{
    return instance->role != CRANNY_ROLE_IGNORED && instance->lod == 0;
}

/* A camera of the file; view looks down −Z of `world_from_view` (3 rows of 4). */
struct cranny_camera {
    const char *name;
    bool orthographic;
    float fov_y;       /* radians; perspective */
    float half_height; /* metres; orthographic */
    float near_plane;  /* metres, > 0 */
    double world_from_view[12];
};

/* How many there are of each; their indices run from 0. */
CRANNY_API uint32_t cranny_scene_mesh_count(const struct cranny_scene *scene);
CRANNY_API uint32_t cranny_scene_instance_count(const struct cranny_scene *scene);
CRANNY_API uint32_t cranny_scene_material_count(const struct cranny_scene *scene);
CRANNY_API uint32_t cranny_scene_texture_count(const struct cranny_scene *scene);
CRANNY_API uint32_t cranny_scene_color_texture_count(const struct cranny_scene *scene);
CRANNY_API uint32_t cranny_scene_camera_count(const struct cranny_scene *scene);

/* Triangles and vertices in the world: each mesh counted once per instance that exists. */
CRANNY_API uint64_t cranny_scene_triangle_count(const struct cranny_scene *scene);
CRANNY_API uint64_t cranny_scene_vertex_count(const struct cranny_scene *scene);

/* A role for the instances whose own name, or whose mesh's or a node's above them, matches
 * `pattern`: * stands for any text, ? for one character, case does not matter. */
struct cranny_role_rule {
    const char *pattern;
    enum cranny_role role;
};

/* Give roles by name, over what the file says; of several rules that match, the last one counts.
 * A coarser level is below its finest: it takes the rules that match that, too. `matched`
 * (rule_count numbers, may be NULL): instances that each rule matched, so that a caller can
 * complain of one that matched none. Not while the scene is used elsewhere. CRANNY_USAGE for a role
 * that does not exist. */
CRANNY_API enum cranny_status cranny_scene_assign_roles(struct cranny_scene *scene,
                                                        const struct cranny_role_rule *rules,
                                                        size_t rule_count, uint32_t *matched,
                                                        struct cranny_error *why);

/* Views; the index must be below the count (not checked). */
CRANNY_API const struct cranny_mesh *cranny_scene_mesh(const struct cranny_scene *scene,
                                                       uint32_t index);
CRANNY_API const struct cranny_instance *cranny_scene_instance(const struct cranny_scene *scene,
                                                               uint32_t index);
CRANNY_API const struct cranny_material *cranny_scene_material(const struct cranny_scene *scene,
                                                               uint32_t index);
CRANNY_API const struct cranny_alpha_texture *cranny_scene_texture(const struct cranny_scene *scene,
                                                                   uint32_t index);
CRANNY_API const struct cranny_color_texture *
cranny_scene_color_texture(const struct cranny_scene *scene, uint32_t index);
CRANNY_API const struct cranny_camera *cranny_scene_camera(const struct cranny_scene *scene,
                                                           uint32_t index);

/* World-space bounding box of all referenced vertices of instances that exist: min xyz, max xyz.
 * All zero when empty. */
CRANNY_API void cranny_scene_bounds(const struct cranny_scene *scene, double bounds[6]);

/* Add to a scene made by cranny_scene_create; everything is copied. `index` may be NULL.
 * CRANNY_USAGE on an index out of range, a NaN or an infinity, a role that does not exist, a lod
 * above 0 without a lod_group. */
CRANNY_API enum cranny_status cranny_scene_add_material(struct cranny_scene *scene,
                                                        const struct cranny_material *material,
                                                        uint32_t *index, struct cranny_error *why);
CRANNY_API enum cranny_status cranny_scene_add_texture(struct cranny_scene *scene,
                                                       const struct cranny_alpha_texture *texture,
                                                       uint32_t *index, struct cranny_error *why);
/* `triangle_materials` NULL: material 0, made (opaque, single-sided) when the scene has none. */
CRANNY_API enum cranny_status cranny_scene_add_mesh(struct cranny_scene *scene,
                                                    const struct cranny_mesh *mesh, uint32_t *index,
                                                    struct cranny_error *why);
CRANNY_API enum cranny_status cranny_scene_add_instance(struct cranny_scene *scene,
                                                        const struct cranny_instance *instance,
                                                        uint32_t *index, struct cranny_error *why);

/* An opaque, single-sided, white material without textures. */
CRANNY_API struct cranny_material cranny_material_default(void);

/* What a scene is made of, for `cranny info`. */
struct cranny_scene_info {
    const char *format;    /* "glb", "gltf", or assimp's format name; "arrays" */
    const char *generator; /* asset.generator, "" when none */
    uint64_t meshes, instances, materials, textures, cameras; /* all there are */
    uint64_t vertices, triangles;                             /* in the world */
    uint64_t unique_vertices, unique_triangles;               /* each mesh counted once */
    uint64_t masked_triangles, blended_triangles, double_sided_triangles; /* in the world */
    uint64_t skipped_primitives;                                          /* points and lines */
    double bounds[6];
    uint64_t role_instances[CRANNY_ROLE_COUNT]; /* of finest levels, the ignored ones too */
    uint64_t role_triangles[CRANNY_ROLE_COUNT]; /* in the world */
    uint64_t lod_groups;                        /* things at several levels of detail */
    uint64_t lod_instances, lod_vertices, lod_triangles; /* of the levels that are not the finest */
};

/* Counts everything, from the triangles up: linear in the scene's size. */
CRANNY_API void cranny_scene_get_info(const struct cranny_scene *scene,
                                      struct cranny_scene_info *info);

/* Scale doctor and lint, for `cranny check`: calls `report` once per finding, worst first.
 * `severity`: the finding spoils a bake (error), may (warning), or is good to know (note).
 * `code` is a stable kebab-case word; `text` is one line: what is wrong and what to pass or do. */
enum cranny_severity { CRANNY_SEVERITY_ERROR, CRANNY_SEVERITY_WARNING, CRANNY_SEVERITY_NOTE };
typedef void cranny_finding_fn(void *user, enum cranny_severity severity, const char *code,
                               const char *text);
CRANNY_API enum cranny_status cranny_scene_check(const struct cranny_scene *scene,
                                                 cranny_finding_fn *report, void *user,
                                                 struct cranny_error *why);

/* Where the values go in the file (DESIGN.md, "bake writes, losslessly"). */
enum cranny_output {
    CRANNY_OUTPUT_OCCLUSION, /* a TEXCOORD_n and a gradient image as occlusionTexture */
    CRANNY_OUTPUT_COLOR,     /* multiplied into COLOR_0 */
    CRANNY_OUTPUT_ATTRIBUTE, /* _AO: float; VEC2 (long, short) with `raw` */
};

/* How cranny_scene_save (bake.h) writes. */
struct cranny_save_params {
    enum cranny_output to; /* default occlusion */
    bool replace;          /* occlusion: displace occlusion textures that are already there */
    bool raw;              /* attribute: both distances, unblended */
    bool expand;           /* linear instances, shrubs and grass get copies of their mesh with their
                              own final values, for viewers that do not multiply; default false */
    const struct cranny_hooks *hooks;
};

/* An occlusion texture where there is none yet, no hooks. */
CRANNY_API struct cranny_save_params cranny_save_params_default(void);

#ifdef __cplusplus
}
#endif
#endif
