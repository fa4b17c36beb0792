/* Baking: ambient obscurance on vertices by least squares, written into the scene's own file.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013 (§2, §2.1);
 * Kavan, Bargteil, Sloan, Least Squares Vertex Baking, 2011. */
#ifndef CRANNY_BAKE_H
#define CRANNY_BAKE_H

#include <cranny/trace.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How a mesh that several instances share is baked. */
enum cranny_instances {
    CRANNY_INSTANCES_AUTO,   /* split up to `split_limit` instances of a mesh, else linear */
    CRANNY_INSTANCES_SPLIT,  /* every instance its own values (and its own copy in the file) */
    CRANNY_INSTANCES_SHARED, /* one set of values: the mean over the instances */
    CRANNY_INSTANCES_LINEAR, /* one set of values, times four coefficients an instance (2013, §2.2)
                              */
};

/* What the one set of values of linear instances is. */
enum cranny_local {
    CRANNY_LOCAL_SHARED, /* the mean over the instances: right by itself where nobody multiplies */
    CRANNY_LOCAL_ISOLATED, /* of the mesh alone in the open, as the paper has it */
    CRANNY_LOCAL_NONE,     /* ones: nothing but the coefficients */
};

/* What the four coefficients are fitted to. */
enum cranny_linear_from {
    CRANNY_LINEAR_VOLUME,  /* spherical obscurance on a sparse grid around the instances (2013) */
    CRANNY_LINEAR_SURFACE, /* rays from points on each instance's surface */
};

/* How samples become vertex values. */
enum cranny_fit {
    CRANNY_FIT_LEAST_SQUARES, /* (M + αR) x = b, eq. 2 */
    CRANNY_FIT_SPLAT,         /* weighted mean of the samples around a vertex */
    CRANNY_FIT_VERTEX,        /* rays from the vertices themselves; no fit */
};

/* How lower levels of detail get their values from the finest one (2013, §2.2.1). */
enum cranny_lod_fit {
    CRANNY_LOD_LEAST_SQUARES, /* its values at samples on the coarse surface, and a fit */
    CRANNY_LOD_VERTEX,        /* its values at the coarse vertices */
};

/* Fields are described, with units, ranges and defaults, by cranny_bake_param_table(). */
struct cranny_bake_params {
    int rays;                     /* per sample */
    float density;                /* samples per square metre; 0: chosen from the mean face area */
    float samples_per_face;       /* aim of the automatic density */
    int samples_min, samples_max; /* per face */
    int samples_total;            /* fewest in all: scenes of few faces get more on each */
    float distance_long, distance_short; /* metres */
    float short_weight;                  /* blend: v = (1 − w) long + w short */
    int kernel;                          /* enum cranny_kernel */
    int sampler;                         /* enum cranny_sampler */
    int fit;                             /* enum cranny_fit */
    float alpha;                         /* of the edge regulariser, eq. 2 */
    bool tune;                           /* adapt alpha to each connected piece, by hold-out */
    float back_limit; /* share of back-face rays above which a sample is buried; 1: never */
    float intensity, contrast; /* remap: clamp(1 − intensity (1 − v)) ^ contrast */
    bool adaptive;             /* fewer rays where the first ones find nothing near */
    bool ground;               /* an occluding plane under everything, not written */
    float ground_height;       /* metres; NaN: the lowest vertex */
    int instances;             /* enum cranny_instances */
    int split_limit;           /* see CRANNY_INSTANCES_AUTO */
    int local;                 /* enum cranny_local */
    int linear_from;           /* enum cranny_linear_from */
    int linear_points;         /* on an instance's surface, to fit its coefficients to */
    float volume_spacing;      /* metres between points of the grid; 0: from the instances' sizes */
    int volume_rays;           /* per point of the grid, over the sphere */
    int dimming;               /* enum cranny_dimming, of trees and fog */
    float tree_opacity;        /* share that a crossing of a tree takes */
    float fog_density;         /* factor on the measured density of shrubs */
    int lod_fit;               /* enum cranny_lod_fit */
    int seed;
    float reuse_limit;                /* see cache_folder */
    int threads;                      /* 0: all cores; never changes the result */
    const struct cranny_hooks *hooks; /* not in the table */

    /* A folder that keeps what the next bake of the scene with these parameters can take over; made
     * when it is missing. NULL (default): none. What was computed from the same inputs, and samples
     * whose rays meet nothing that changed, are taken over as they are, bit for bit. A sample whose
     * rays do is traced again when all that changed on its way since it was traced, over any number
     * of bakes, could change its visibility by more than `reuse_limit`: the sum over its rays of
     * 1 − ρ(d), d being where one enters the box of something that came, went or moved, over the
     * number of rays. So every sample is within `reuse_limit` of what it would be without the
     * folder, before `intensity` and `contrast`; one of a lower level of detail, within twice that.
     * With 0, it is the same. 6 bytes a sample and 8 a vertex. Not in the table.
     * cranny_bake_create: CRANNY_FAILED, before any work, when the folder takes no file. */
    const char *cache_folder;
    const char *cache_name; /* tells scenes in one folder apart; NULL is "" */
};

/* Whether a cache folder was of use. */
enum cranny_reuse {
    CRANNY_REUSE_OFF,        /* no folder */
    CRANNY_REUSE_DONE,       /* taken over, as far as the counts say */
    CRANNY_REUSE_FIRST,      /* nothing of this name was there */
    CRANNY_REUSE_PARAMETERS, /* what was there is of other parameters, or of another version */
    CRANNY_REUSE_DAMAGED,    /* what was there could not be read */
    CRANNY_REUSE_DENSITY,    /* faces call for another density of samples; parameter `density` fixes
                                it */
    CRANNY_REUSE_GROUND,     /* the ground plane is elsewhere */
    CRANNY_REUSE_VERTEX,     /* `fit` vertex has no samples to keep */
};

/* The rows of struct cranny_bake_params: names, units, ranges, defaults, help. */
CRANNY_API const struct cranny_param_table *cranny_bake_param_table(void);

/* Every field at its row's default, no hooks. */
CRANNY_API struct cranny_bake_params cranny_bake_params_default(void);

/* Baked values. Immutable. Keeps a pointer to the scene, which must outlive it. */
struct cranny_bake;

/* Sample, trace, fit. `params` NULL means defaults.
 * CRANNY_INPUT when the scene has no triangle with area; CRANNY_USAGE for parameters out of range;
 * CRANNY_CANCELLED from the progress hook (stages "bvh", "trace", "solve", and where there are such
 * instances "volume", "linear", "scatter", "resample"). */
CRANNY_API enum cranny_status cranny_bake_create(const struct cranny_scene *scene,
                                                 const struct cranny_bake_params *params,
                                                 struct cranny_bake **bake,
                                                 struct cranny_error *why);

/* Frees the values and sets *bake to NULL; accepts NULL. */
CRANNY_API void cranny_bake_destroy(struct cranny_bake **bake);

/* Which values: both distances blended and remapped, or one of them as it was fitted. */
enum cranny_channel { CRANNY_CHANNEL_VISIBILITY, CRANNY_CHANNEL_LONG, CRANNY_CHANNEL_SHORT };

/* Values of an instance's vertices, in [0,1], 1 = open: the blended and remapped visibility, or one
 * raw distance. As many floats as the instance's mesh has vertices; to be multiplied by the
 * instance's linear function. Instances that were baked `shared` or `linear` return the same
 * pointer, as do shrubs and grass, all ones. Vertices that no triangle uses hold 1. NULL: the
 * instance has no values (role ignored). */
CRANNY_API const float *cranny_bake_values(const struct cranny_bake *bake, uint32_t instance,
                                           enum cranny_channel channel);

/* The linear function of the position in the mesh's own space that goes with an instance's values:
 * constant, x, y, z (2013, eq. 3; cranny_linear_visibility evaluates it). 1 0 0 0 where the values
 * are the instance's own. False then, else true. */
CRANNY_API bool cranny_bake_linear(const struct cranny_bake *bake, uint32_t instance,
                                   enum cranny_channel channel, float linear[4]);

/* How a set of values came to be. */
enum cranny_treatment {
    CRANNY_TREATMENT_NONE,    /* role ignored */
    CRANNY_TREATMENT_SURFACE, /* sampled where its instances stand */
    CRANNY_TREATMENT_LINEAR,  /* one set, times four coefficients an instance */
    CRANNY_TREATMENT_SCALAR,  /* shrubs and grass: one number an instance, of the ground nearby */
    CRANNY_TREATMENT_LOD,     /* taken over from the finest level of detail */
};

/* What became of one set of values. */
struct cranny_bake_set {
    const char *mesh; /* its name, as long as the scene lives */
    uint32_t mesh_index, instance_first, instance_count;
    enum cranny_treatment treatment;
    uint64_t vertices, triangles;
    uint64_t samples, invalid_samples, unsampled_vertices;
    double area;      /* m² */
    double fit_rms;   /* between the samples and the fit: noise included */
    double model_rms; /* of this, what no values on these vertices would mend: the part that both
                         halves of a triangle's samples agree on; NaN with too few samples */
    uint64_t bytes;   /* of the values and coefficients, as floats */
};

/* How many sets there are, and one of them. */
CRANNY_API size_t cranny_bake_set_count(const struct cranny_bake *bake);
CRANNY_API void cranny_bake_get_set(const struct cranny_bake *bake, size_t index,
                                    struct cranny_bake_set *set);

/* What a bake did; seconds are wall time. */
struct cranny_bake_report {
    uint64_t meshes;                         /* sets of values made */
    uint64_t instances, vertices, triangles; /* in the world */
    uint64_t samples, invalid_samples, rays;
    uint64_t unsampled_vertices; /* referenced, but without a valid sample: extrapolated */
    uint64_t lost_components;    /* connected pieces without any valid sample */
    double mrays_per_s;
    double mean_visibility; /* of the samples, blended, area-weighted */
    double fit_rms;         /* between the samples and the fitted function, area-weighted */
    double solver_iterations_max;
    double seconds_bvh, seconds_sample, seconds_trace, seconds_solve;
    double seconds_fog;                   /* of seconds_bvh: densities and boxes of shrubs */
    double seconds_local;                 /* meshes in isolation */
    double seconds_volume;                /* the grid around linear instances, its rays included */
    double seconds_linear;                /* coefficients */
    double seconds_scalar;                /* shrubs and grass */
    double seconds_resample, seconds_lod; /* lower levels of detail: samples, fit */
    uint64_t bytes_bvh, bytes_samples, bytes_solve, bytes_volume;
    uint64_t trees, fog_boxes; /* instances */
    uint64_t linear_instances, scalar_instances, lod_instances;
    uint64_t volume_points, volume_buried;
    uint64_t lod_samples, lod_missed; /* missed: found no surface of the finest level near */
    uint64_t bytes_values;            /* what a game keeps: values and coefficients, as floats */
    uint64_t bytes_vertices;          /* what values on every vertex of every instance would take */
    enum cranny_reuse reuse;
    uint64_t reused_samples, reused_sets; /* of samples and meshes, taken over */
    uint64_t added_occluders,
        removed_occluders; /* since the last bake; what moved counts as both */
    double seconds_cache;  /* to read, compare and write */
    uint64_t bytes_cache;  /* of the file in the folder */
};

/* Copies what cranny_bake_create measured into *report. */
CRANNY_API void cranny_bake_get_report(const struct cranny_bake *bake,
                                       struct cranny_bake_report *report);

/* Write the scene with its values to `path` (.glb or .gltf); the file appears whole or not at all.
 * `bake` NULL writes the scene unchanged. Scenes built from arrays are written as new glTF.
 * CRANNY_FAILED when it cannot be written, CRANNY_USAGE for another extension. */
CRANNY_API enum cranny_status cranny_scene_save(const struct cranny_scene *scene,
                                                const struct cranny_bake *bake, const char *path,
                                                const struct cranny_save_params *params,
                                                struct cranny_error *why);

/* How a picture is made, not what it shows. */
struct cranny_preview_params {
    int threads;                      /* 0 (default): all cores; never changes the result */
    const struct cranny_hooks *hooks; /* may be NULL; stages "bvh", "preview" */
};

/* All cores, no hooks. */
CRANNY_API struct cranny_preview_params cranny_preview_params_default(void);

/* A picture of the baked values: grey clay times visibility, sky white-blue, for a quick look.
 * Dark pictures (rooms) are brightened, as an eye would, by up to 5.
 * `bake` NULL: the scene before. `camera`: index of a camera of the scene; -1: the file's first,
 * else cranny_preview_default_view. `width`, `height`: 1 to 16384. `params` NULL means defaults.
 * `rgb`: width × height × 3 bytes, rows top to bottom; unspecified on failure.
 * CRANNY_USAGE for numbers out of range, CRANNY_CANCELLED from the progress hook. */
CRANNY_API enum cranny_status cranny_preview_render(const struct cranny_scene *scene,
                                                    const struct cranny_bake *bake, int camera,
                                                    int width, int height,
                                                    const struct cranny_preview_params *params,
                                                    uint8_t *rgb, struct cranny_error *why);

/* The view that cranny_preview_render takes when the file has no camera: from the front, right and
 * above, so that everything fits a picture of `aspect` (width over height); or, where the outside
 * shows mostly back faces (a room), the longest look from a place within. `params` as there. */
CRANNY_API enum cranny_status
cranny_preview_default_view(const struct cranny_scene *scene, float aspect,
                            const struct cranny_preview_params *params, struct cranny_camera *view,
                            struct cranny_error *why);

/* The same picture from a view of one's own; its `name` is not read. CRANNY_USAGE when its numbers
 * make no picture. */
CRANNY_API enum cranny_status cranny_preview_render_view(const struct cranny_scene *scene,
                                                         const struct cranny_bake *bake,
                                                         const struct cranny_camera *view,
                                                         int width, int height,
                                                         const struct cranny_preview_params *params,
                                                         uint8_t *rgb, struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
