/* The parameters of the volumes: each number stands here once. */
#include "base/rows.h"

#include <cranny/volumes.h>

static const char *const faces_names[] = {"front", "material", "both", NULL};
static const char *const combine_names[] = {"sum", "knee", "product", NULL};
static const char *const isa_names[] = {"auto", "portable", "avx2", "avx512", NULL};

#define ROW_STRUCT struct cranny_volumes_params

static const struct cranny_param rows[] = {
    REAL(radius_world, "m", 1e-9, 1e9, 0.5, "where an occluder stops counting"),
    FITTED(delta_scale, "", 0.01, 10, 0.75, 0.1,
           "reach of the volumes as a share of radius_world: their falloff is steeper than a line"),
    FITTED(intensity, "", 0, 100, 1, 0.2, "factor on the occlusion"),
    FITTED(contrast, "", 0.05, 20, 1, 0.2, "exponent on the visibility"),
    FITTED(bias, "heights", 0, 1, 2e-5, 2e-5,
           "height over the tangent plane under which nothing occludes, as a share of what the "
           "picture's height spans at that depth"),
    CHOICE(faces, faces_names, CRANNY_FACES_MATERIAL,
           "sides of polygons that occlude: the front, the back too where the material is "
           "double-sided, or always both"),
    CHOICE(combine, combine_names, CRANNY_COMBINE_KNEE,
           "polygons' occlusions are added up to 1, bent towards 1 from the knee on, or multiplied "
           "as if they overlapped at random"),
    FITTED(knee, "", 0, 1, 0, 0.1, "occlusion from which the sum is bent"),
    SWITCH(quads, 1, "make one volume of two triangles that form a flat, convex quad"),
    WHOLE(spacing, "pixels", 1, 16, 1,
          "distance between samples each way; 1 all pixels, 2 a quarter, 15 one in 225"),
    SWITCH(refine, 1, "sparse sampling: do pixels exactly that no sample around fits"),
    REAL(filter_depth, "radii", 1e-6, 1e3, 0.1,
         "distance from each other's plane at which surfaces are apart for sparse sampling"),
    REAL(filter_normal, "", -1, 0.999, 0.6,
         "cosine of the angle at which surfaces are apart for sparse sampling"),
    CHOICE(isa, isa_names, CRANNY_ISA_AUTO,
           "instruction set of the kernels; same result, bit for bit"),
    WHOLE(threads, "threads", 0, 1024, 0, "threads to use, 0 for all cores; same result"),
};

static const struct cranny_param_table table = {"volumes", rows, COUNT_OF(rows)};

/* What the paper has, as differences from `calibrated`. */
static const struct {
    const char *name, *value;
} paper[] = {
    {"delta_scale", "0.6"}, {"intensity", "1"}, {"contrast", "1"},
    {"faces", "material"},  {"combine", "sum"}, {"refine", "false"},
};

const struct cranny_param_table *cranny_volumes_param_table(void)
{
    return &table;
}

const char *const *cranny_volumes_preset_names(void)
{
    static const char *const names[] = {"calibrated", "paper", NULL};
    return names;
}

enum cranny_status cranny_volumes_params_apply(struct cranny_volumes_params *params,
                                               const char *preset, struct cranny_error *why)
{
    const bool published = strcmp(preset, "paper") == 0;
    if (!published && strcmp(preset, "calibrated") != 0)
        return fail(why, CRANNY_USAGE, "preset '%s': there is calibrated and paper", preset);
    const struct cranny_volumes_params kept = *params;
    cranny_params_defaults(&table, params);
    for (size_t i = 0; published && i < COUNT_OF(paper); i++) {
        const enum cranny_status status =
            cranny_params_set(&table, params, paper[i].name, paper[i].value, why);
        if (status != CRANNY_OK)
            return status;
    }
    params->radius_world = kept.radius_world;
    params->isa = kept.isa;
    params->threads = kept.threads;
    return CRANNY_OK;
}

struct cranny_volumes_params cranny_volumes_params_preset(const char *preset)
{
    struct cranny_volumes_params params = {0};
    cranny_params_defaults(&table, &params);
    if (preset)
        cranny_volumes_params_apply(&params, preset, NULL);
    return params;
}
