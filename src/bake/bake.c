/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013. */
#include "bake/bake.h"

#include "bake/linear.h"
#include "bake/lod.h"
#include "bake/params.h"
#include "bake/pass.h"
#include "bake/scalar.h"

/* Mean visibility below which a scene counts as enclosed. */
#define ENCLOSED 0.08

struct run {
    const struct cranny_scene *scene;
    const struct cranny_bake_params *params;
    struct cranny_bake *bake;
    struct cranny_tracer *tracer;
};

float bake_remap(const struct cranny_bake_params *params, const float raw[2])
{
    const float blend = (1 - params->short_weight) * raw[0] + params->short_weight * raw[1];
    const float dimmed = clamp_float(1 - params->intensity * (1 - blend), 0, 1);
    return params->contrast == 1 ? dimmed : powf(dimmed, params->contrast);
}

double bake_value_at(const struct cranny_bake *bake, uint32_t instance, uint32_t triangle, double v,
                     double w, enum cranny_channel channel)
{
    const float *values = cranny_bake_values(bake, instance, channel);
    if (!values)
        return 1;
    const struct cranny_mesh *mesh =
        &bake->scene->meshes[bake->scene->instances[instance].view.mesh].view;
    const uint32_t *corner = mesh->triangles[triangle];
    const double l[3] = {1 - v - w, v, w};
    double local = 0, linear = 1;
    for (int i = 0; i < 3; i++)
        local += l[i] * (double)values[corner[i]];
    if (bake->linear) {
        const float *y = bake->linear[instance][channel];
        linear = (double)y[0];
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                linear += (double)y[1 + k] * l[i] * (double)mesh->positions[corner[i]][k];
    }
    return fmin(fmax(local * linear, 0), 1);
}

struct value_set *bake_add_set(struct cranny_bake *bake, uint32_t mesh, uint32_t vertex_count)
{
    float *values = alloc_array(vertex_count, CHANNELS * sizeof *values);
    if (!values || !grow_array((void **)&bake->sets, &bake->set_capacity, bake->set_count + 1,
                               sizeof *bake->sets)) {
        free(values);
        return NULL;
    }
    struct value_set *set = &bake->sets[bake->set_count++];
    *set = (struct value_set){.mesh = mesh, .vertex_count = vertex_count, .values = values};
    return set;
}

/* A set for the mesh of an instance, all ones; NULL: out of memory. */
static struct value_set *add_ones(struct cranny_bake *bake, uint32_t instance)
{
    const uint32_t mesh = bake->scene->instances[instance].view.mesh;
    struct value_set *set = bake_add_set(bake, mesh, bake->scene->meshes[mesh].view.vertex_count);
    for (size_t v = 0; set && v < (size_t)set->vertex_count * CHANNELS; v++)
        set->values[v] = 1;
    return set;
}

enum cranny_status bake_set_per_mesh(struct cranny_bake *bake, enum cranny_treatment treatment,
                                     mesh_set_fn *make, void *user, struct cranny_error *why)
{
    uint32_t *set_of_mesh = alloc_array(bake->scene->mesh_count, sizeof *set_of_mesh);
    enum cranny_status status = set_of_mesh ? CRANNY_OK : fail_memory(why, "values");
    for (uint32_t i = 0; status == CRANNY_OK && i < bake->instance_count; i++) {
        const uint32_t mesh = bake->scene->instances[i].view.mesh;
        if (bake->treatments[i] != treatment)
            continue;
        if (!set_of_mesh[mesh]) {
            status = make                ? make(user, i, why)
                     : add_ones(bake, i) ? CRANNY_OK
                                         : fail_memory(why, "values");
            if (status != CRANNY_OK)
                break;
            struct value_set *set = &bake->sets[bake->set_count - 1];
            set->treatment = treatment;
            set->instance_first = i;
            set->instance_count = 0;
            set_of_mesh[mesh] = (uint32_t)bake->set_count;
        }
        bake->set_of[i] = set_of_mesh[mesh] - 1;
        bake->sets[bake->set_of[i]].instance_count++;
    }
    free(set_of_mesh);
    return status;
}

enum cranny_status bake_need_linear(struct cranny_bake *bake, struct cranny_error *why)
{
    if (bake->linear)
        return CRANNY_OK;
    bake->linear = alloc_array(bake->instance_count, sizeof *bake->linear);
    if (!bake->linear)
        return fail_memory(why, "coefficients");
    for (uint32_t i = 0; i < bake->instance_count; i++)
        for (int c = 0; c < CHANNELS; c++)
            bake->linear[i][c][0] = 1;
    return CRANNY_OK;
}

enum cranny_status bake_tracer_create(const struct cranny_scene *scene,
                                      const struct cranny_bake_params *params,
                                      struct cranny_tracer **tracer, struct cranny_error *why)
{
    struct cranny_tracer_params wanted = cranny_tracer_params_default();
    wanted.roles = true;
    wanted.dimming = (enum cranny_dimming)params->dimming;
    wanted.tree_opacity = params->tree_opacity;
    wanted.fog_density = params->fog_density;
    wanted.ground = params->ground;
    wanted.ground_height = params->ground_height;
    wanted.threads = params->threads;
    wanted.hooks = params->hooks;
    return cranny_tracer_create(scene, &wanted, tracer, why);
}

static enum cranny_status build_tracer(struct run *run, struct cranny_error *why)
{
    struct cranny_bake_report *report = &run->bake->report;
    struct cranny_tracer_info info;
    const double begin = seconds_now();
    enum cranny_status status = bake_tracer_create(run->scene, run->params, &run->tracer, why);
    if (status != CRANNY_OK)
        return status;
    cranny_tracer_get_info(run->tracer, &info);
    report->seconds_bvh = seconds_now() - begin;
    report->seconds_fog = info.fog_seconds;
    report->bytes_bvh = info.bytes;
    report->trees = info.trees;
    report->fog_boxes = info.fog_boxes;
    return CRANNY_OK;
}

static enum cranny_status trace_samples(struct run *run, struct pass *pass,
                                        struct cranny_error *why)
{
    if (run->params->fit == CRANNY_FIT_VERTEX)
        return CRANNY_OK;
    struct cranny_bake_report *report = &run->bake->report;
    const double begin = seconds_now();
    enum cranny_status status = samples_collect(&pass->plan, run->tracer, run->params,
                                                run->bake->cache, &pass->samples, why);
    report->seconds_trace = seconds_now() - begin;
    const size_t kept = run->bake->cache ? sizeof(struct kept) : 0;
    report->bytes_samples = pass->plan.sample_count * (sizeof(struct sample) + 1 + kept) +
                            cranny_scene_triangle_count(run->scene) * 4;
    return status;
}

static enum cranny_status fit_samples(struct run *run, struct pass *pass, struct cranny_error *why)
{
    struct cranny_bake_report *report = &run->bake->report;
    const bool vertex = run->params->fit == CRANNY_FIT_VERTEX;
    const double begin = seconds_now();
    enum cranny_status status = pass_fit(pass, run->tracer, why);
    *(vertex ? &report->seconds_trace : &report->seconds_solve) = seconds_now() - begin;
    report->samples = pass->plan.sample_count;
    report->rays = pass->samples.rays;
    report->invalid_samples = pass->samples.invalid;
    report->mrays_per_s =
        report->seconds_trace > 0 ? (double)report->rays * 1e-6 / report->seconds_trace : 0;
    return status;
}

static bool has_area(const struct cranny_scene *scene, uint32_t instance)
{
    const double *m = scene->instances[instance].view.world_from_object;
    const struct cranny_mesh *mesh = &scene->meshes[scene->instances[instance].view.mesh].view;
    const double metric[9] = {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]};
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        if (metric_area(metric, mesh, t) > 0)
            return true;
    return false;
}

static bool anything_to_bake(const struct run *run, const struct pass *pass)
{
    for (size_t i = 0; i < pass->plan.target_count; i++)
        if (pass->plan.targets[i].area > 0)
            return true;
    for (uint32_t i = 0; i < run->bake->instance_count; i++)
        if ((run->bake->treatments[i] == CRANNY_TREATMENT_SCALAR ||
             run->bake->treatments[i] == CRANNY_TREATMENT_LINEAR) &&
            has_area(run->scene, i))
            return true;
    return false;
}

/* What is sampled where it stands. */
static enum cranny_status bake_surfaces(struct run *run, struct cranny_error *why)
{
    const bool shared = run->params->local == CRANNY_LOCAL_SHARED;
    const unsigned takes =
        1u << CRANNY_TREATMENT_SURFACE | (shared ? 1u << CRANNY_TREATMENT_LINEAR : 0);
    const double begin = seconds_now();
    struct pass pass;
    enum cranny_status status =
        pass_begin(&pass, run->bake, run->scene, run->params, run->bake->treatments, takes, why);
    run->bake->report.seconds_sample = seconds_now() - begin;
    if (status == CRANNY_OK && !anything_to_bake(run, &pass))
        status = fail(why, CRANNY_INPUT,
                      "the scene has no triangle with area: there is nothing to bake");
    if (status == CRANNY_OK && run->bake->cache)
        status = cache_open(run->bake->cache, &pass.plan, why);
    if (status == CRANNY_OK)
        status = pass_use_cache(&pass, run->bake->cache, why);
    if (status == CRANNY_OK)
        status = build_tracer(run, why);
    if (status == CRANNY_OK)
        status = trace_samples(run, &pass, why);
    if (status == CRANNY_OK)
        status = fit_samples(run, &pass, why);
    if (status == CRANNY_OK && run->bake->cache)
        status = cache_keep_samples(run->bake->cache, &pass.plan, &pass.samples, why);
    if (status == CRANNY_OK)
        pass_publish(&pass, run->bake->treatments);
    pass_end(&pass);
    return status;
}

static enum cranny_status bake_all(struct run *run, struct cranny_error *why)
{
    struct cranny_bake *bake = run->bake;
    enum cranny_status status = treatments_choose(run->scene, run->params, bake->treatments, why);
    if (status == CRANNY_OK)
        status = bake_surfaces(run, why);
    if (status == CRANNY_OK && run->params->local != CRANNY_LOCAL_SHARED)
        status = linear_local(bake, run->scene, run->params, why);
    if (status == CRANNY_OK)
        status = linear_fit(bake, run->scene, run->tracer, run->params, why);
    if (status == CRANNY_OK)
        status = scalar_bake(bake, run->scene, run->tracer, run->params, why);
    cranny_tracer_destroy(&run->tracer);
    return status == CRANNY_OK ? lod_bake(bake, run->scene, run->params, why) : status;
}

/* At 300 m a courtyard is all walls. Right, but not what most people expect to see. */
static void warn_enclosed(const struct run *run)
{
    double bounds[6], size = 0;
    cranny_scene_bounds(run->scene, bounds);
    for (int k = 0; k < 3; k++)
        size = fmax(size, bounds[3 + k] - bounds[k]);
    const double wanted = 0.2 * size;
    if (wanted < (double)run->params->distance_long)
        hook_warn(run->params->hooks,
                  "the scene is mostly enclosed: at distance_long = %g m the mean visibility is "
                  "%.2f, and ambient light nearly vanishes; for a look at the scene's own scale "
                  "set distance_long to about %.1g",
                  (double)run->params->distance_long, run->bake->report.mean_visibility, wanted);
}

static void sum_sets(struct run *run)
{
    struct cranny_bake_report *report = &run->bake->report;
    double squares = 0, weight = 0, visibility = 0;
    size_t unconverged = 0;
    for (size_t i = 0; i < run->bake->set_count; i++) {
        const struct fit_report *fit = &run->bake->sets[i].fit;
        report->unsampled_vertices += fit->unsampled_vertices;
        report->lost_components += fit->lost_components;
        report->solver_iterations_max = fmax(report->solver_iterations_max, fit->iterations);
        report->bytes_solve = fit->bytes > report->bytes_solve ? fit->bytes : report->bytes_solve;
        squares += fit->squares;
        weight += fit->weight;
        visibility += fit->visibility;
        unconverged += (size_t)fit->unconverged;
    }
    report->fit_rms = weight > 0 ? sqrt(squares / weight) : 0;
    report->mean_visibility = weight > 0 ? visibility / weight : 1;
    if (report->mean_visibility < ENCLOSED)
        warn_enclosed(run);
    if (unconverged)
        hook_warn(run->params->hooks,
                  "the least-squares fit of %zu meshes stopped before it had converged; lower "
                  "alpha if they look blotchy",
                  unconverged);
}

/* Floats of one channel, for the game: values once a set, coefficients once an instance. */
static uint64_t set_bytes(const struct value_set *set)
{
    switch (set->treatment) {
    case CRANNY_TREATMENT_LINEAR:
        return sizeof(float) * (set->vertex_count + 4ull * set->instance_count);
    case CRANNY_TREATMENT_SCALAR:
        return sizeof(float) * set->instance_count;
    case CRANNY_TREATMENT_SURFACE:
    case CRANNY_TREATMENT_LOD:
    case CRANNY_TREATMENT_NONE:
        break;
    }
    return sizeof(float) * set->vertex_count;
}

static void report_cache(struct run *run)
{
    struct cranny_bake_report *report = &run->bake->report;
    const struct cache *cache = run->bake->cache;
    if (run->params->cache_folder)
        report->reuse = cache ? cache->outcome : CRANNY_REUSE_VERTEX;
    if (!cache)
        return;
    report->reused_samples = cache->reused_samples;
    report->reused_sets = cache->reused_sets;
    report->added_occluders = cache->change.added;
    report->removed_occluders = cache->change.removed;
    report->seconds_cache = cache->seconds;
    report->bytes_cache = cache->bytes;
}

static void finish_report(struct run *run)
{
    struct cranny_bake_report *report = &run->bake->report;
    report_cache(run);
    report->meshes = run->bake->set_count;
    report->instances = run->scene->instance_count;
    report->vertices = cranny_scene_vertex_count(run->scene);
    report->triangles = cranny_scene_triangle_count(run->scene);
    for (size_t i = 0; i < run->bake->set_count; i++) {
        const struct value_set *set = &run->bake->sets[i];
        report->bytes_values += set_bytes(set);
        report->bytes_vertices += (uint64_t)set->vertex_count * set->instance_count * sizeof(float);
    }
    sum_sets(run);
}

static enum cranny_status bake_new(const struct cranny_scene *scene, struct cranny_bake **bake,
                                   struct cranny_error *why)
{
    struct cranny_bake *made = *bake = alloc_array(1, sizeof *made);
    if (!made)
        return fail_memory(why, "bake");
    made->scene = scene;
    made->instance_count = (uint32_t)scene->instance_count;
    made->set_of = alloc_array(scene->instance_count, sizeof *made->set_of);
    made->treatments = alloc_array(scene->instance_count, 1);
    if (!made->set_of || !made->treatments)
        return fail_memory(why, "bake");
    for (size_t i = 0; i < scene->instance_count; i++)
        made->set_of[i] = SET_NONE;
    return CRANNY_OK;
}

enum cranny_status cranny_bake_create(const struct cranny_scene *scene,
                                      const struct cranny_bake_params *params,
                                      struct cranny_bake **bake, struct cranny_error *why)
{
    const struct cranny_bake_params defaults = cranny_bake_params_default();
    *bake = NULL;
    struct run run = {.scene = scene, .params = params ? params : &defaults};
    enum cranny_status status = bake_params_check(run.params, why);
    if (status != CRANNY_OK)
        return status;
    status = bake_new(scene, &run.bake, why);
    if (status == CRANNY_OK && run.params->fit != CRANNY_FIT_VERTEX)
        status = cache_create(run.params, &run.bake->cache, why);
    if (status == CRANNY_OK)
        status = bake_all(&run, why);
    if (status == CRANNY_OK && run.bake->cache)
        cache_save(run.bake->cache);
    if (status == CRANNY_OK)
        finish_report(&run);
    if (run.bake)
        cache_destroy(&run.bake->cache);
    if (status != CRANNY_OK)
        cranny_bake_destroy(&run.bake);
    *bake = run.bake;
    return status;
}

void cranny_bake_destroy(struct cranny_bake **bake)
{
    if (!bake || !*bake)
        return;
    for (size_t i = 0; i < (*bake)->set_count; i++)
        free((*bake)->sets[i].values);
    free((*bake)->sets);
    free((*bake)->set_of);
    free((*bake)->treatments);
    free((*bake)->linear);
    free(*bake);
    *bake = NULL;
}

const float *cranny_bake_values(const struct cranny_bake *bake, uint32_t instance,
                                enum cranny_channel channel)
{
    if (bake->set_of[instance] == SET_NONE)
        return NULL;
    const struct value_set *set = &bake->sets[bake->set_of[instance]];
    return set->values + (size_t)channel * set->vertex_count;
}

bool cranny_bake_linear(const struct cranny_bake *bake, uint32_t instance,
                        enum cranny_channel channel, float linear[4])
{
    static const float none[4] = {1, 0, 0, 0};
    const enum cranny_treatment treatment = (enum cranny_treatment)bake->treatments[instance];
    memcpy(linear, bake->linear ? bake->linear[instance][channel] : none, sizeof none);
    return treatment == CRANNY_TREATMENT_LINEAR || treatment == CRANNY_TREATMENT_SCALAR;
}

void cranny_bake_get_report(const struct cranny_bake *bake, struct cranny_bake_report *report)
{
    *report = bake->report;
}

size_t cranny_bake_set_count(const struct cranny_bake *bake)
{
    return bake->set_count;
}

void cranny_bake_get_set(const struct cranny_bake *bake, size_t index, struct cranny_bake_set *set)
{
    const struct value_set *from = &bake->sets[index];
    const struct cranny_mesh *mesh = &bake->scene->meshes[from->mesh].view;
    const struct fit_report *fit = &from->fit;
    *set = (struct cranny_bake_set){
        .mesh = mesh->name,
        .mesh_index = from->mesh,
        .instance_first = from->instance_first,
        .instance_count = from->instance_count,
        .treatment = from->treatment,
        .vertices = from->vertex_count,
        .triangles = mesh->triangle_count,
        .samples = from->samples,
        .invalid_samples = fit->invalid,
        .unsampled_vertices = fit->unsampled_vertices,
        .area = from->area,
        .fit_rms = fit->weight > 0 ? sqrt(fit->squares / fit->weight) : 0,
        .model_rms = fit->agreed_weight > 0 ? sqrt(fmax(fit->agreed / fit->agreed_weight, 0)) : NAN,
        .bytes = set_bytes(from),
    };
}
