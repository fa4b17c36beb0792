/* Ambient visibility from a G-buffer: four published screen-space methods and an image-space ray
 * marcher, behind one contract. 1 = open; the truth they approximate is ray-traced obscurance with
 * linear falloff over `radius_world` (cranny/frame.h traces it).
 *
 * Based on:
 * ssao      Kajalin, Screen-Space Ambient Occlusion, ShaderX7 §6.1, 2009
 * hbao      Bavoil, Sainz, Image-Space Horizon-Based Ambient Occlusion, ShaderX7 §6.2, 2009
 * raymarch  the same chapter's brute-force image-space tracer
 * crease    Fox, Compton, Ambient Occlusive Crease Shading, Game Developer, March 2008
 * alchemy   McGuire, Osman, Bukowski, Hennessy, The Alchemy Screen-Space Ambient Obscurance
 *           Algorithm, 2011 */
#ifndef CRANNY_SCREEN_H
#define CRANNY_SCREEN_H

#include <cranny/gbuffer.h>

#ifdef __cplusplus
extern "C" {
#endif

enum cranny_method {
    CRANNY_SSAO,
    CRANNY_HBAO,
    CRANNY_CREASE,
    CRANNY_ALCHEMY,
    CRANNY_RAYMARCH,
    CRANNY_METHOD_COUNT
};

/* Memory that frames of one size reuse; see cranny_workspace_create. */
struct cranny_workspace;

/* Wall time of a frame's stages, milliseconds. */
struct cranny_screen_report {
    double prepare_ms;  /* copy, normals, edges */
    double estimate_ms; /* the method's own pass */
    double filter_ms;   /* upsampling, filters, per-sample reconstruction */
    double total_ms;
    int isa;                 /* enum cranny_isa that ran */
    uint64_t invalid_depths; /* NaN, zero or negative: taken as sky */
};

/* Which build of the kernels runs; the result is the same bits. */
enum cranny_isa { CRANNY_ISA_AUTO, CRANNY_ISA_PORTABLE, CRANNY_ISA_AVX2, CRANNY_ISA_AVX512 };

enum cranny_resolution { CRANNY_RESOLUTION_FULL, CRANNY_RESOLUTION_HALF };
enum cranny_noise {
    CRANNY_NOISE_TILE, /* 4×4 pixels of evenly spread turns */
    CRANNY_NOISE_HASH, /* a hash of the pixel */
    CRANNY_NOISE_NONE, /* every pixel alike */
};
enum cranny_anchor { CRANNY_ANCHOR_SCREEN, CRANNY_ANCHOR_SURFACE };
enum cranny_border {
    CRANNY_BORDER_CLAMP,  /* samples beyond the frame read its edge */
    CRANNY_BORDER_IGNORE, /* they do not count, and the others count more */
};
enum cranny_normals { CRANNY_NORMALS_GIVEN, CRANNY_NORMALS_FACE };
enum cranny_filter {
    CRANNY_FILTER_NONE,
    CRANNY_FILTER_BOX,       /* 4×4, within edges */
    CRANNY_FILTER_BILATERAL, /* separable, cross-bilateral on depth and normal */
    CRANNY_FILTER_BLOOM,     /* two wide Gaussians, blended (crease) */
};
enum cranny_resolve {
    CRANNY_RESOLVE_FIRST, /* the first sample's value for the whole pixel */
    CRANNY_RESOLVE_CROSS, /* per sample, from five pixels in a cross (Alchemy) */
    CRANNY_RESOLVE_BLUR,  /* per sample, from the filter's whole window (HBAO) */
};
enum cranny_kernel_space { CRANNY_KERNEL_SCREEN, CRANNY_KERNEL_WORLD };
enum cranny_rotation { CRANNY_ROTATION_MATRIX, CRANNY_ROTATION_MIRROR };
enum cranny_falloff {
    CRANNY_FALLOFF_NONE,      /* what lies within the radius counts in full */
    CRANNY_FALLOFF_QUADRATIC, /* 1 − (d / r)² */
    CRANNY_FALLOFF_LINEAR,    /* 1 − d / r */
    CRANNY_FALLOFF_SMOOTH,    /* (1 − (d / r)²)² */
};

/* Fields are described, with units, ranges and defaults, by cranny_screen_param_table(method). A
 * field without a row there is not read by that method. */
struct cranny_screen_params {
    int method; /* enum cranny_method; not in the table */
    float radius_world;
    float radius_scale; /* reach = radius_scale × radius_world */
    float intensity, contrast, bias;
    int samples;
    int directions, steps, elevations; /* hbao, raymarch */
    float angle_bias;                  /* degrees */
    int falloff;                       /* enum cranny_falloff */
    bool cosine, spread, curve, facing, edge_bloom;
    int kernel; /* enum cranny_kernel_space */
    float kernel_scale, kernel_growth, kernel_limit;
    int rotation; /* enum cranny_rotation */
    float range_default, thickness;
    float minimum_crease, crease_scale, averager;
    float bloom_wide, bloom_near, bloom_wide_gain, bloom_near_gain, bloom_blend;
    float epsilon;
    int bands;
    float band_begin;
    float fade_begin, fade_end;                          /* metres of depth */
    int resolution;                                      /* enum cranny_resolution */
    int noise, anchor, border, normals, filter, resolve; /* the enums above */
    int filter_radius;
    float filter_depth, filter_normal;
    int seed;
    int isa;                             /* enum cranny_isa */
    int threads;                         /* 0: all cores; never changes the result */
    struct cranny_workspace *workspace;  /* not in the table; NULL: memory for this call only */
    struct cranny_screen_report *report; /* not in the table; NULL: none */
    const struct cranny_hooks *hooks;    /* not in the table; warnings; progress and cancel between
                                            stages ("prepare", "estimate", "filter") */
};

/* "ssao", "hbao", "crease", "alchemy", "raymarch". */
CRANNY_API const char *cranny_method_name(enum cranny_method method);

/* The method of that name into *method; false when there is none. */
CRANNY_API bool cranny_method_find(const char *name, enum cranny_method *method);

/* The rows that `method` reads. Defaults are the preset `calibrated`. */
CRANNY_API const struct cranny_param_table *cranny_screen_param_table(enum cranny_method method);

/* Names of a method's presets, NULL-terminated: "calibrated" (constants fitted to the truth, the
 * default) and "paper" (published constants and steps). */
CRANNY_API const char *const *cranny_screen_preset_names(enum cranny_method method);

/* Set every field that a preset states; what is no part of a look (threads, isa, hooks …) keeps its
 * value. CRANNY_USAGE when there is no such preset. */
CRANNY_API enum cranny_status cranny_screen_params_apply(struct cranny_screen_params *params,
                                                         const char *preset,
                                                         struct cranny_error *why);

/* All fields of a method's preset; an unknown name gives `calibrated`. NULL: `calibrated`. */
CRANNY_API struct cranny_screen_params cranny_screen_params_preset(enum cranny_method method,
                                                                   const char *preset);

/* Visibility of the viewport. `params` as above. `visibility`: floats in [0,1], viewport width ×
 * height, rows `stride` bytes apart (0: tight); never NaN; sky is 1. With several samples a pixel,
 * the mean of the samples' values. Unspecified on failure.
 * CRANNY_USAGE for fields out of range, CRANNY_INPUT when every depth is NaN, zero or negative,
 * CRANNY_MEMORY, CRANNY_CANCELLED. Thread-safe, but for a shared workspace. */
CRANNY_API enum cranny_status cranny_screen_render(const struct cranny_gbuffer *gbuffer,
                                                   const struct cranny_screen_params *params,
                                                   float *visibility, size_t stride,
                                                   struct cranny_error *why);

/* The same, one value for each of the G-buffer's samples: sample_count planes of the viewport's
 * height rows, one after the other. */
CRANNY_API enum cranny_status
cranny_screen_render_samples(const struct cranny_gbuffer *gbuffer,
                             const struct cranny_screen_params *params, float *visibility,
                             size_t stride, struct cranny_error *why);

/* Memory to hand to successive frames, one at a time, so that none is allocated per frame. */
CRANNY_API enum cranny_status cranny_workspace_create(struct cranny_workspace **workspace,
                                                      struct cranny_error *why);
CRANNY_API void cranny_workspace_destroy(struct cranny_workspace **workspace);

/* The widest instruction set that this machine and build have. */
CRANNY_API enum cranny_isa cranny_isa_best(void);
CRANNY_API const char *cranny_isa_name(enum cranny_isa isa);

#ifdef __cplusplus
}
#endif
#endif
