/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2, eq. 3.
 */
#include "bake/linear.h"

#include "bake/pass.h"
#include "bake/volume.h"
#include "base/hash.h"
#include "base/vector.h"

/* Weight of the pull of the three slopes toward 0, in points' worth: instances whose points lie in
 * a plane leave one of them open. */
#define SLOPE_RIDGE 0.01
/* A mesh in isolation stands for many instances: that many times the samples on a face. */
#define ISOLATED_WORTH 4.0f

/* Points on a mesh that stand for its surface, the same for all its instances. */
struct probe {
    double position[3], normal[3], face[3]; /* object space; normals not unit */
    float local[CHANNELS];
};

struct model {
    uint32_t mesh, set;
    struct probe *probes;
    uint32_t probe_count;
    uint64_t shape;          /* mesh_shape_key, with a cache */
    double center[3], scale; /* of its box, for the conditioning of the fit */
};

static double triangle_area(const struct cranny_mesh *mesh, uint32_t t)
{
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    return metric_area(identity, mesh, t);
}

static void make_probe(const struct cranny_mesh *mesh, const struct value_set *set, uint32_t t,
                       const double l[3], struct probe *probe)
{
    const uint32_t *corner = mesh->triangles[t];
    double a[3], b[3];
    *probe = (struct probe){.position = {0}};
    for (int k = 0; k < 3; k++) {
        const float p0 = mesh->positions[corner[0]][k];
        a[k] = (double)mesh->positions[corner[1]][k] - (double)p0;
        b[k] = (double)mesh->positions[corner[2]][k] - (double)p0;
        for (int c = 0; c < 3; c++) {
            probe->position[k] += l[c] * (double)mesh->positions[corner[c]][k];
            probe->normal[k] += mesh->normals ? l[c] * (double)mesh->normals[corner[c]][k] : 0;
        }
    }
    cross3(a, b, probe->face);
    if (!mesh->normals)
        memcpy(probe->normal, probe->face, sizeof probe->face);
    for (int c = 0; c < CHANNELS; c++) {
        const float *values = set->values + (size_t)c * set->vertex_count;
        for (int i = 0; i < 3; i++)
            probe->local[c] += (float)l[i] * values[corner[i]];
    }
}

/* Points spread by area: even steps through the triangles' areas. */
static void place_probes(const struct cranny_mesh *mesh, const struct value_set *set,
                         uint32_t wanted, struct model *model)
{
    static const uint32_t shift[2] = {0x6c8e9cf5u, 0x1b873593u};
    double total = 0, passed = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        total += triangle_area(mesh, t);
    for (uint32_t t = 0; t < mesh->triangle_count && total > 0; t++) {
        passed += triangle_area(mesh, t);
        while (model->probe_count < wanted &&
               (model->probe_count + 0.5) * total < passed * wanted) {
            double l[3];
            sample_barycentrics(shift, model->probe_count, l);
            make_probe(mesh, set, t, l, &model->probes[model->probe_count++]);
        }
    }
}

static enum cranny_status model_create(const struct cranny_bake *bake,
                                       const struct cranny_scene *scene, uint32_t set, int points,
                                       struct model *model, struct cranny_error *why)
{
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const struct cranny_mesh *mesh = &scene->meshes[bake->sets[set].mesh].view;
    double box[6];
    *model = (struct model){.mesh = bake->sets[set].mesh, .set = set};
    model->probes = alloc_array((size_t)points, sizeof *model->probes);
    if (!model->probes)
        return fail_memory(why, "coefficients");
    instance_bounds(&scene->meshes[bake->sets[set].mesh], identity, box);
    for (int k = 0; k < 3; k++) {
        model->center[k] = 0.5 * (box[k] + box[3 + k]);
        model->scale = fmax(model->scale, 0.5 * (box[3 + k] - box[k]));
    }
    model->scale = model->scale > 0 ? model->scale : 1;
    model->shape = bake->cache ? mesh_shape_key(mesh) : 0;
    place_probes(mesh, &bake->sets[set], (uint32_t)points, model);
    return CRANNY_OK;
}

/* A probe in the world: position, unit normal on the face's side, unit face normal. */
static bool show_probe(const struct frame *frame, const struct probe *probe, double position[3],
                       double normal[3], double face[3])
{
    if (frame->singular)
        return false;
    for (int i = 0; i < 3; i++) {
        position[i] = frame->world[4 * i] * probe->position[0] +
                      frame->world[4 * i + 1] * probe->position[1] +
                      frame->world[4 * i + 2] * probe->position[2] + frame->world[4 * i + 3];
        normal[i] = dot3(frame->normal + (ptrdiff_t)3 * i, probe->normal);
        face[i] = dot3(frame->normal + (ptrdiff_t)3 * i, probe->face);
    }
    if (!normalise3(face))
        return false;
    if (!normalise3(normal))
        memcpy(normal, face, 3 * sizeof *normal);
    if (dot3(normal, face) < 0)
        for (int k = 0; k < 3; k++)
            normal[k] = -normal[k];
    return true;
}

/* Solve the symmetric positive definite 4 × 4 system in place by Cholesky's method. */
static void solve4(double m[4][4], double b[4])
{
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j <= i; j++) {
            for (int k = 0; k < j; k++)
                m[i][j] -= m[i][k] * m[j][k];
            m[i][j] = i == j ? sqrt(fmax(m[i][i], 1e-300)) : m[i][j] / m[j][j];
        }
        for (int k = 0; k < i; k++)
            b[i] -= m[i][k] * b[k];
        b[i] /= m[i][i];
    }
    for (int i = 3; i >= 0; i--) {
        for (int k = i + 1; k < 4; k++)
            b[i] -= m[k][i] * b[k];
        b[i] /= m[i][i];
    }
}

/* min Σ (f − G L)², eq. 3. `truth`: per probe and channel; NaN: not known. */
static void fit_instance(const struct model *model, const float (*truth)[CHANNELS],
                         float linear[CHANNELS][4])
{
    for (int c = 0; c < CHANNELS; c++) {
        double m[4][4] = {{0}}, b[4] = {0};
        for (uint32_t i = 0; i < model->probe_count; i++) {
            const struct probe *probe = &model->probes[i];
            if (isnan(truth[i][c]))
                continue;
            double row[4] = {1};
            for (int k = 0; k < 3; k++)
                row[1 + k] = (probe->position[k] - model->center[k]) / model->scale;
            for (int r = 0; r < 4; r++) {
                row[r] *= (double)probe->local[c];
                b[r] += row[r] * (double)truth[i][c];
                for (int s = 0; s <= r; s++)
                    m[r][s] += row[r] * row[s];
            }
        }
        if (!(m[0][0] > 1e-6))
            continue; /* nothing is known, or the mesh is black by itself: 1 0 0 0 stays */
        for (int r = 1; r < 4; r++)
            m[r][r] += SLOPE_RIDGE * m[0][0] / model->probe_count;
        solve4(m, b);
        linear[c][0] = (float)b[0];
        for (int k = 0; k < 3; k++) {
            linear[c][1 + k] = (float)(b[1 + k] / model->scale);
            linear[c][0] -= (float)(b[1 + k] / model->scale * model->center[k]);
        }
    }
}

struct fitting {
    struct cranny_bake *bake;
    const struct cranny_scene *scene;
    const struct cranny_tracer *tracer;
    const struct cranny_bake_params *params;
    struct model *models;
    uint32_t *model_of;  /* per set */
    uint32_t *instances; /* the linear ones */
    size_t count;
    struct volume volume;
    struct kept *kept; /* linear_points an instance; NULL: no cache */
    atomic_bool traced;
};

static const struct model *model_of(const struct fitting *fitting, uint32_t instance)
{
    return &fitting->models[fitting->model_of[fitting->bake->set_of[instance]]];
}

static void set_truth(const struct cranny_bake_params *params, const float raw[2],
                      float truth[CHANNELS])
{
    truth[CRANNY_CHANNEL_VISIBILITY] = bake_remap(params, raw);
    truth[CRANNY_CHANNEL_LONG] = raw[0];
    truth[CRANNY_CHANNEL_SHORT] = raw[1];
}

static void fit_from_volume(const struct fitting *fitting, uint32_t instance,
                            float (*truth)[CHANNELS])
{
    const struct model *model = model_of(fitting, instance);
    struct frame frame;
    frame_make(&fitting->scene->instances[instance].view, &frame);
    for (uint32_t i = 0; i < model->probe_count; i++) {
        double position[3], normal[3], face[3];
        float raw[2];
        truth[i][0] = truth[i][1] = truth[i][2] = NAN;
        if (show_probe(&frame, &model->probes[i], position, normal, face) &&
            volume_sample(&fitting->volume, position, normal, raw))
            set_truth(fitting->params, raw, truth[i]);
    }
    fit_instance(model, (const float(*)[CHANNELS])truth, fitting->bake->linear[instance]);
}

static bool place_point(const struct model *model, const struct frame *frame, uint32_t probe,
                        uint64_t place, struct gather_point *point)
{
    double position[3], normal[3], face[3];
    if (!show_probe(frame, &model->probes[probe], position, normal, face))
        return false;
    *point = (struct gather_point){.id = (uint32_t)place + probe};
    for (int k = 0; k < 3; k++) {
        point->position[k] = (float)position[k];
        point->normal[k] = (float)normal[k];
        point->face_normal[k] = (float)face[k];
    }
    double stretch = 0;
    for (int k = 0; k < 3; k++)
        stretch =
            fmax(stretch, hypot(hypot(frame->world[k], frame->world[4 + k]), frame->world[8 + k]));
    point->extent = (float)(2 * model->scale * stretch);
    return true;
}

/* `back` 0: good, 255: buried. */
static void trace_probe(const struct fitting *fitting, const struct gather_plan *gather,
                        const struct gather_point *point, struct kept *kept)
{
    struct gather_result result;
    const double limit = (double)fitting->params->back_limit;
    gather_points(fitting->tracer, gather, point, 1, &result);
    *kept = (struct kept){
        .back = limit >= 1 || (double)result.back_faces <= limit * result.rays ? 0 : 255};
    for (int c = 0; c < 2; c++)
        kept->visibility[c] = (uint16_t)(clamp_float(result.visibility[c], 0, 1) * 65535 + 0.5f);
}

static uint64_t probes_key(const struct model *model, const double world_from_object[12])
{
    return hash_bytes(model->shape, world_from_object, 12 * sizeof *world_from_object);
}

static const struct kept *find_probes(const struct fitting *fitting, const struct model *model,
                                      uint64_t key)
{
    size_t size = 0;
    const struct kept *old =
        fitting->kept ? state_find(&fitting->bake->cache->old, STATE_PROBES, key, &size) : NULL;
    return size == model->probe_count * sizeof *old ? old : NULL;
}

/* One probe's rays, kept or traced; false: nothing is known there. */
static bool probe_values(struct fitting *fitting, const struct gather_plan *gather,
                         const struct gather_point *point, const struct kept *old,
                         struct kept *kept, float raw[2])
{
    if (!old || !cache_stands(fitting->bake->cache, gather, point, old, kept)) {
        trace_probe(fitting, gather, point, kept);
        atomic_store(&fitting->traced, true);
    }
    for (int c = 0; c < 2; c++)
        raw[c] = (float)(kept->visibility[c] * (1.0 / 65535));
    return !kept->back;
}

/* `number`: of the instance among the linear ones. */
static void fit_from_surface(struct fitting *fitting, const struct gather_plan *gather,
                             size_t number, float (*truth)[CHANNELS])
{
    const uint32_t instance = fitting->instances[number];
    const struct model *model = model_of(fitting, instance);
    struct frame frame;
    frame_make(&fitting->scene->instances[instance].view, &frame);
    const uint64_t place = hash_bytes(HASH_BEGIN, frame.world, sizeof frame.world);
    const struct kept *old = find_probes(fitting, model, probes_key(model, frame.world));
    struct kept *keep =
        fitting->kept ? fitting->kept + number * (size_t)fitting->params->linear_points : NULL;
    for (uint32_t i = 0; i < model->probe_count; i++) {
        struct gather_point point;
        struct kept kept = {.back = 255};
        float raw[2];
        truth[i][0] = truth[i][1] = truth[i][2] = NAN;
        if (place_point(model, &frame, i, place, &point) &&
            probe_values(fitting, gather, &point, old ? &old[i] : NULL, &kept, raw))
            set_truth(fitting->params, raw, truth[i]);
        if (keep)
            keep[i] = kept;
    }
    fit_instance(model, (const float(*)[CHANNELS])truth, fitting->bake->linear[instance]);
}

/* Let the next bake have the probes. */
static enum cranny_status keep_probes(struct fitting *fitting, struct cranny_error *why)
{
    struct cache *cache = fitting->bake->cache;
    struct kept *kept = fitting->kept;
    if (!kept)
        return CRANNY_OK;
    fitting->kept = NULL;
    const enum cranny_status status = cache_own(cache, kept, why);
    cache->news |= atomic_load(&fitting->traced);
    for (size_t i = 0; status == CRANNY_OK && i < fitting->count; i++) {
        const uint32_t instance = fitting->instances[i];
        const struct model *model = model_of(fitting, instance);
        const uint64_t key =
            probes_key(model, fitting->scene->instances[instance].view.world_from_object);
        if (!state_add(&cache->next, STATE_PROBES, key,
                       kept + i * (size_t)fitting->params->linear_points,
                       model->probe_count * sizeof *kept))
            return fail_memory(why, "cache");
    }
    return status;
}

static enum cranny_status fit_all(struct fitting *fitting, const struct gather_plan *gather,
                                  struct cranny_error *why)
{
    struct watch watch;
    atomic_bool failed = false;
    watch_begin(&watch, fitting->params->hooks, "linear", fitting->count);
#pragma omp parallel num_threads(thread_count(fitting->params->threads))
    {
        const unsigned saved = gather_thread_begin();
        float(*truth)[CHANNELS] =
            alloc_array((size_t)fitting->params->linear_points, sizeof *truth);
        if (!truth)
            atomic_store(&failed, true);
#pragma omp for schedule(dynamic, 4)
        for (size_t i = 0; i < fitting->count; i++) {
            if (atomic_load(&failed) || !watch_goes_on(&watch))
                continue;
            if (gather)
                fit_from_surface(fitting, gather, i, truth);
            else
                fit_from_volume(fitting, fitting->instances[i], truth);
            watch_advance(&watch, 1);
        }
        free(truth);
        gather_thread_end(saved);
    }
    if (atomic_load(&failed))
        return fail_memory(why, "coefficients");
    watch.next = 0; /* the last word, however short the stage was */
    return !watch_goes_on(&watch) ? fail(why, CRANNY_CANCELLED, "bake: cancelled at the instances")
                                  : CRANNY_OK;
}

static enum cranny_status make_volume(struct fitting *fitting, struct cranny_error *why)
{
    struct cranny_bake_report *report = &fitting->bake->report;
    const double begin = seconds_now();
    double(*boxes)[6] = alloc_array(fitting->count, sizeof *boxes);
    if (!boxes)
        return fail_memory(why, "volume around the instances");
    for (size_t i = 0; i < fitting->count; i++) {
        const struct cranny_instance *instance =
            &fitting->scene->instances[fitting->instances[i]].view;
        instance_bounds(&fitting->scene->meshes[instance->mesh], instance->world_from_object,
                        boxes[i]);
    }
    enum cranny_status status =
        volume_create((const double(*)[6])boxes, fitting->count,
                      (double)fitting->params->volume_spacing, &fitting->volume, why);
    free(boxes);
    if (status == CRANNY_OK)
        status = volume_trace(&fitting->volume, fitting->tracer, fitting->params, why);
    report->volume_points = fitting->volume.point_count;
    report->volume_buried = fitting->volume.buried;
    report->bytes_volume = volume_bytes(&fitting->volume);
    report->seconds_volume = seconds_now() - begin;
    return status;
}

static enum cranny_status make_models(struct fitting *fitting, struct cranny_error *why)
{
    struct cranny_bake *bake = fitting->bake;
    uint32_t count = 0;
    fitting->models = alloc_array(bake->set_count, sizeof *fitting->models);
    fitting->model_of = alloc_array(bake->set_count, sizeof *fitting->model_of);
    fitting->instances = alloc_array(bake->instance_count, sizeof *fitting->instances);
    if (!fitting->models || !fitting->model_of || !fitting->instances)
        return fail_memory(why, "coefficients");
    enum cranny_status status = CRANNY_OK;
    for (uint32_t s = 0; status == CRANNY_OK && s < bake->set_count; s++) {
        if (bake->sets[s].treatment != CRANNY_TREATMENT_LINEAR)
            continue;
        fitting->model_of[s] = count;
        status = model_create(bake, fitting->scene, s, fitting->params->linear_points,
                              &fitting->models[count++], why);
    }
    for (uint32_t i = 0; i < bake->instance_count; i++)
        if (bake->treatments[i] == CRANNY_TREATMENT_LINEAR && bake->set_of[i] != SET_NONE)
            fitting->instances[fitting->count++] = i;
    return status;
}

static enum cranny_status fit_models(struct fitting *fitting, struct cranny_error *why)
{
    struct gather_plan *gather = NULL;
    enum cranny_status status = bake_need_linear(fitting->bake, why);
    if (status != CRANNY_OK)
        return status;
    if (fitting->params->linear_from == CRANNY_LINEAR_VOLUME) {
        status = make_volume(fitting, why);
    } else {
        const struct cranny_gather_params wanted = bake_gather_params(fitting->params);
        status = gather_plan_create(&wanted, false, &gather, why);
        if (fitting->bake->cache)
            fitting->kept = alloc_array(fitting->count * (size_t)fitting->params->linear_points,
                                        sizeof *fitting->kept);
        if (status == CRANNY_OK && fitting->bake->cache && !fitting->kept)
            status = fail_memory(why, "cache");
    }
    const double begin = seconds_now();
    if (status == CRANNY_OK)
        status = fit_all(fitting, gather, why);
    if (status == CRANNY_OK)
        status = keep_probes(fitting, why);
    fitting->bake->report.seconds_linear = seconds_now() - begin;
    gather_plan_destroy(&gather);
    return status;
}

enum cranny_status linear_fit(struct cranny_bake *bake, const struct cranny_scene *scene,
                              const struct cranny_tracer *tracer,
                              const struct cranny_bake_params *params, struct cranny_error *why)
{
    struct fitting fitting = {.bake = bake, .scene = scene, .tracer = tracer, .params = params};
    enum cranny_status status = make_models(&fitting, why);
    bake->report.linear_instances = fitting.count;
    if (status == CRANNY_OK && fitting.count)
        status = fit_models(&fitting, why);
    for (size_t i = 0; fitting.models && i < bake->set_count; i++)
        free(fitting.models[i].probes);
    free(fitting.models);
    free(fitting.model_of);
    free(fitting.instances);
    free(fitting.kept);
    volume_free(&fitting.volume);
    return status;
}

/* The mesh of `instance` in a scene of its own, turned upright and as large as the instances' mean.
 * Borrows everything from `scene`. */
static void isolate(const struct cranny_scene *scene, uint32_t instance, double scale,
                    struct instance *alone, struct cranny_scene *stand_in)
{
    *stand_in = *scene;
    *alone = scene->instances[instance];
    for (int i = 0; i < 12; i++)
        alone->view.world_from_object[i] = i % 5 == 0 ? scale : 0;
    stand_in->instances = alone;
    stand_in->instance_count = 1;
}

/* Mean over the linear instances of a mesh of the cube root of their volume's scale. */
static double mean_scale(const struct cranny_bake *bake, const struct cranny_scene *scene,
                         uint32_t mesh)
{
    double sum = 0, count = 0;
    for (uint32_t i = 0; i < bake->instance_count; i++)
        if (bake->treatments[i] == CRANNY_TREATMENT_LINEAR &&
            scene->instances[i].view.mesh == mesh) {
            sum += cbrt(fabs(transform_determinant(scene->instances[i].view.world_from_object)));
            count++;
        }
    return count > 0 && sum > 0 ? sum / count : 1;
}

struct isolation {
    struct cranny_bake *bake;
    const struct cranny_scene *scene;
    const struct cranny_bake_params *params;
};

/* mesh_set_fn */
static enum cranny_status bake_alone(void *user, uint32_t instance, struct cranny_error *why)
{
    static const uint8_t surface[1] = {CRANNY_TREATMENT_SURFACE};
    const struct isolation *isolation = user;
    struct cranny_bake *bake = isolation->bake;
    struct cranny_bake_params own = *isolation->params;
    struct instance alone;
    struct cranny_scene stand_in;
    struct cranny_tracer *tracer = NULL;
    struct pass pass;
    own.ground = false;
    own.samples_total = 0;
    own.samples_per_face *= ISOLATED_WORTH;
    isolate(isolation->scene, instance,
            mean_scale(bake, isolation->scene, isolation->scene->instances[instance].view.mesh),
            &alone, &stand_in);
    enum cranny_status status =
        pass_begin(&pass, bake, &stand_in, &own, surface, 1u << CRANNY_TREATMENT_SURFACE, why);
    if (status == CRANNY_OK)
        status = bake_tracer_create(&stand_in, &own, &tracer, why);
    if (status == CRANNY_OK && own.fit != CRANNY_FIT_VERTEX)
        status = samples_collect(&pass.plan, tracer, &own, NULL, &pass.samples, why);
    if (status == CRANNY_OK)
        status = pass_fit(&pass, tracer, why);
    bake->report.rays += pass.samples.rays;
    pass_end(&pass);
    cranny_tracer_destroy(&tracer);
    return status;
}

enum cranny_status linear_local(struct cranny_bake *bake, const struct cranny_scene *scene,
                                const struct cranny_bake_params *params, struct cranny_error *why)
{
    const double begin = seconds_now();
    struct isolation isolation = {bake, scene, params};
    const enum cranny_status status = bake_set_per_mesh(
        bake, CRANNY_TREATMENT_LINEAR, params->local == CRANNY_LOCAL_ISOLATED ? bake_alone : NULL,
        &isolation, why);
    bake->report.seconds_local = seconds_now() - begin;
    return status;
}
