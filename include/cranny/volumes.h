/* Ambient occlusion volumes: analytic occlusion by the polygons of a scene, at the points that a
 * G-buffer shows. Free of noise, independent of the view; cost follows the pixels that volumes
 * cover. On the CPU.
 *
 * Based on: McGuire, Ambient Occlusion Volumes, 2009. */
#ifndef CRANNY_VOLUMES_H
#define CRANNY_VOLUMES_H

#include <cranny/scene.h>
#include <cranny/screen.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The scene's polygons in world space, ready to render. Immutable: rendering from several threads
 * is safe. Keeps nothing of the scene. */
struct cranny_volumes;

/* Which side of a polygon occludes. */
enum cranny_volume_faces {
    CRANNY_FACES_FRONT,    /* the front, as the paper has it */
    CRANNY_FACES_MATERIAL, /* the front, and of double-sided materials the back, too, unless the
                                surface is closed: then nobody sees it */
    CRANNY_FACES_BOTH,
};

/* How the occlusions of many polygons make one. */
enum cranny_volume_combine {
    CRANNY_COMBINE_SUM,     /* their sum, saturated (the paper): exact while nothing overlaps */
    CRANNY_COMBINE_KNEE,    /* the sum up to `knee`, from there on towards 1 without reaching it */
    CRANNY_COMBINE_PRODUCT, /* 1 − Π(1 − o): as if polygons overlapped at random */
};

/* What a frame took. */
struct cranny_volumes_report {
    double prepare_ms, estimate_ms, filter_ms, total_ms;
    int isa;             /* enum cranny_isa that ran */
    uint64_t pixels;     /* at which occlusion was evaluated */
    uint64_t candidates; /* pairs of a tile and a volume near it */
    uint64_t tested;     /* pairs of 16 pixels and a volume that meets their bounds */
    uint64_t evaluated;  /* of these, the ones with a pixel that loses something */
    uint64_t pairs;      /* of a pixel and a volume that hides something of it */
    uint64_t arcs;       /* vectors of 16 pairs that took arc cosines; the others are far */
    uint64_t refined;    /* sparse sampling: pixels without a sample that fits, done exactly */
};

/* Fields are described, with units, ranges and defaults, by cranny_volumes_param_table. */
struct cranny_volumes_params {
    float radius_world; /* metres: where an occluder stops counting in the truth */
    float delta_scale;  /* the volumes' own reach is δ = delta_scale × radius_world */
    float intensity, contrast, bias;
    int faces;   /* enum cranny_volume_faces */
    int combine; /* enum cranny_volume_combine */
    float knee;
    bool quads;  /* read when the volumes are made */
    int spacing; /* pixels from sample to sample each way: 1 all, 15 one in 225 */
    bool refine;
    float filter_depth, filter_normal;
    int isa;                              /* enum cranny_isa; same result, bit for bit */
    int threads;                          /* 0: all cores; never changes the result */
    struct cranny_volumes_report *report; /* not in the table; NULL: none */
    const struct cranny_hooks *hooks;     /* not in the table; stages "volumes" (making them) and
                                             "occlusion" (rendering); may be NULL */
};

/* The rows; defaults are the preset `calibrated`. */
CRANNY_API const struct cranny_param_table *cranny_volumes_param_table(void);

/* Names of the presets, NULL-terminated: "calibrated" (fitted to the truth, the default), "paper".
 */
CRANNY_API const char *const *cranny_volumes_preset_names(void);

/* Set every field that a preset states; radius, isa, threads and hooks keep their values.
 * CRANNY_USAGE when there is no such preset. */
CRANNY_API enum cranny_status cranny_volumes_params_apply(struct cranny_volumes_params *params,
                                                          const char *preset,
                                                          struct cranny_error *why);

/* All fields of a preset; NULL or an unknown name gives `calibrated`. */
CRANNY_API struct cranny_volumes_params cranny_volumes_params_preset(const char *preset);

/* What a scene's volumes hold. */
struct cranny_volumes_info {
    uint64_t triangles; /* of the scene, in the world */
    uint64_t polygons;  /* kept: triangles, and quads made of two */
    uint64_t quads;
    uint64_t dropped;    /* triangles without area, not finite, or wholly transparent */
    uint64_t size_bytes; /* at most 96 a polygon */
    double seconds;      /* to make them */
};

/* Make the volumes of a scene, to be kept while it stands still. `params` NULL: defaults; only
 * `quads`, `threads` and `hooks` are read, so that everything else can change from frame to frame.
 * CRANNY_USAGE, CRANNY_MEMORY, CRANNY_CANCELLED. A scene without triangles is open everywhere. */
CRANNY_API enum cranny_status cranny_volumes_create(const struct cranny_scene *scene,
                                                    const struct cranny_volumes_params *params,
                                                    struct cranny_volumes **volumes,
                                                    struct cranny_error *why);

/* Frees them and sets *volumes to NULL; accepts NULL. */
CRANNY_API void cranny_volumes_destroy(struct cranny_volumes **volumes);

CRANNY_API struct cranny_volumes_info cranny_volumes_info(const struct cranny_volumes *volumes);

/* Visibility of the G-buffer's viewport. The buffer needs `world_from_view` (rigid); a guard band
 * is not needed. `params` NULL: defaults. `visibility`: floats in [0,1], viewport width × height,
 * rows `stride` bytes apart (0: tight); never NaN; sky is 1. With several samples a pixel, the mean
 * of the samples' values. Unspecified on failure.
 * CRANNY_USAGE for fields out of range, CRANNY_INPUT when every depth is NaN, zero or negative,
 * CRANNY_MEMORY, CRANNY_CANCELLED. */
CRANNY_API enum cranny_status cranny_volumes_render(const struct cranny_volumes *volumes,
                                                    const struct cranny_gbuffer *gbuffer,
                                                    const struct cranny_volumes_params *params,
                                                    float *visibility, size_t stride,
                                                    struct cranny_error *why);

/* What sparse sampling makes of values that come from elsewhere: rays, another method. On entry
 * `visibility` holds a value for every pixel, shaped as there; on return it is as if only every
 * spacing-th each way, and with `refine` those that no sample fits, had been known, and the
 * report's `pixels` says how many were. Values in [0,1]. Reads spacing, refine, the two filter
 * widths, radius_world, delta_scale, threads and report; the buffer may not have several samples a
 * pixel. CRANNY_USAGE, CRANNY_INPUT, CRANNY_MEMORY. */
CRANNY_API enum cranny_status cranny_volumes_reconstruct(const struct cranny_gbuffer *gbuffer,
                                                         const struct cranny_volumes_params *params,
                                                         float *visibility, size_t stride,
                                                         struct cranny_error *why);

/* The ways to write a polygon's occlusion; they agree. */
enum cranny_polygon_form {
    CRANNY_FORM_ANGLES,   /* eq. 9: angles from dot products (Baum et al. 1989) */
    CRANNY_FORM_SEGMENTS, /* eq. 12 and 19: elliptic segments in the tangent plane */
};

/* The share of the cosine-weighted hemisphere about unit `normal` at `point` that a flat convex
 * polygon of `count` (3 to 8) corners hides, clipped to the tangent plane; either side hides.
 * In [0,1], finite for every finite input; 0 for other counts. */
CRANNY_API double cranny_polygon_occlusion(const double (*corners)[3], int count,
                                           const double point[3], const double normal[3],
                                           enum cranny_polygon_form form);

#ifdef __cplusplus
}
#endif
#endif
