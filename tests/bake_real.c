/* Least squares against plain splatting on real scenes, by the error integrated over the surface:
 * 64 rays, about 4 samples a face. Part of that error no vertex values can avoid, since they are
 * linear on a face; what a fit can change is measured against a much better sampled fit. */
#include "check.h"
#include "truth.h"

struct scores {
    double splat, fit, best; /* rms */
};

static double score(const struct cranny_scene *scene, const struct truth *truth,
                    const struct cranny_bake_params *params)
{
    struct cranny_error why = {0};
    struct cranny_bake *bake = NULL;
    CHECK_OK(cranny_bake_create(scene, params, &bake, &why), why);
    const uint32_t count = cranny_scene_instance_count(scene);
    const float **values = calloc(count, sizeof *values);
    for (uint32_t i = 0; i < count; i++)
        values[i] = cranny_bake_values(bake, i, CRANNY_CHANNEL_VISIBILITY);
    const double rms = truth_rms(truth, scene, values);
    free(values);
    cranny_bake_destroy(&bake);
    return rms;
}

static struct scores compare(const char *folder, const char *file)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", folder, file);
    struct cranny_error why = {0};
    struct cranny_scene *scene = NULL;
    struct cranny_tracer *tracer = NULL;
    struct truth truth = {0};
    struct cranny_bake_params params = cranny_bake_params_default();
    CHECK_OK(cranny_scene_load(path, NULL, &scene, &why), why);
    CHECK_OK(cranny_tracer_create(scene, NULL, &tracer, &why), why);
    CHECK_OK(truth_create(scene, tracer, &params, 2000, 1024, &truth, &why), why);
    struct scores scores = {0};
    params.rays = 64;
    params.samples_total = 32768;
    params.samples_per_face = 4;
    scores.fit = score(scene, &truth, &params);
    params.fit = CRANNY_FIT_SPLAT;
    scores.splat = score(scene, &truth, &params);
    params.fit = CRANNY_FIT_LEAST_SQUARES;
    params.samples_per_face = 32;
    params.rays = 32;
    params.alpha = 0.02f;
    scores.best = score(scene, &truth, &params);
    truth_free(&truth);
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
    return scores;
}

/* The part of an error that better values would remove. */
static double avoidable(double rms, double best)
{
    return sqrt(fmax(rms * rms - best * best, 0));
}

int main(void)
{
    const char *folder = check_scenes();
    if (!folder)
        return check_skip("bake_real", "no CRANNY_SCENES");
    /* How much lower the whole error must be; measured, see docs/measurements/bake.md. */
    static const struct {
        const char *file;
        double whole;
    } cases[] = {{"cornell_box_original/cornell_box_original.glb", 0.25},
                 {"webxr_camp/camp.gltf", 0.08},
                 {"house_lightmap_uv/house.glb", 0.06},
                 {"level_pandora/pandora.glb", 0.12}};
    int avoided = 0;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct scores s = compare(folder, cases[i].file);
        const double before = avoidable(s.splat, s.best), after = avoidable(s.fit, s.best);
        printf("%s: rms splat %.4f, least squares %.4f (%+.0f %%), best %.4f; avoidable part %.4f, "
               "%.4f (%+.0f %%)\n",
               cases[i].file, s.splat, s.fit, 100 * (s.fit / s.splat - 1), s.best, before, after,
               100 * (after / before - 1));
        CHECK_MSG(s.fit < (1 - cases[i].whole) * s.splat, "%s: %g against %g", cases[i].file, s.fit,
                  s.splat);
        avoided += after < 0.75 * before;
    }
    CHECK(avoided >= 3);
    return check_end("bake_real");
}
