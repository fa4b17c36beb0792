/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.1: the
 * samples of a face follow its area up to a cap. */
#include "bake/plan.h"

#include "base/hash.h"
#include "base/vector.h"

/* Instances' worth of samples that a shared set of values gets at most. */
#define SHARED_WORTH 4u
/* Steps of density and of a shared set's scale, in logarithms to the base 2. Other objects that
 * come or go seldom lead to another step, and then only samples all over have to be placed anew. */
#define DENSITY_STEP 0.125
#define SCALE_STEP 0.03125
/* Area over squared longest edge below which float vertices hold no normal. */
#define FLAT_RATIO 1e-9

double metric_area(const double metric[9], const struct cranny_mesh *mesh, uint32_t triangle)
{
    const uint32_t *corner = mesh->triangles[triangle];
    double e1[3], e2[3], e3[3], n[3];
    metric_edge(metric, mesh->positions[corner[0]], mesh->positions[corner[1]], e1);
    metric_edge(metric, mesh->positions[corner[0]], mesh->positions[corner[2]], e2);
    metric_edge(metric, mesh->positions[corner[1]], mesh->positions[corner[2]], e3);
    cross3(e1, e2, n);
    const double longest = fmax(dot3(e1, e1), fmax(dot3(e2, e2), dot3(e3, e3)));
    const double area = 0.5 * sqrt(dot3(n, n));
    return area > FLAT_RATIO * longest && isfinite(area) ? area : 0;
}

void frame_make(const struct cranny_instance *instance, struct frame *frame)
{
    memcpy(frame->world, instance->world_from_object, sizeof frame->world);
    double inverse[9];
    frame->singular = !transform_inverse3(frame->world, inverse);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            frame->normal[3 * i + j] = inverse[3 * j + i];
    frame->side = transform_determinant(frame->world) < 0 ? -1 : 1;
}

void instance_bounds(const struct mesh *mesh, const double world_from_object[12], double box[6])
{
    const float(*own)[3] = (const float(*)[3])mesh->bounds;
    memset(box, 0, 6 * sizeof *box);
    for (int c = 0; mesh->view.vertex_count && c < 8; c++) {
        const float corner[3] = {own[c & 1][0], own[c >> 1 & 1][1], own[c >> 2][2]};
        double p[3];
        transform_point(world_from_object, corner, p);
        for (int k = 0; k < 3; k++) {
            box[k] = c ? fmin(box[k], p[k]) : p[k];
            box[3 + k] = c ? fmax(box[3 + k], p[k]) : p[k];
        }
    }
}

uint32_t plan_pick(const struct plan *plan, const struct target *target, double u)
{
    const double *share = plan->share + target->instance_first;
    uint32_t low = 0, high = target->instance_count - 1;
    while (low < high) {
        const uint32_t middle = (low + high) / 2;
        if (share[middle] > u)
            high = middle;
        else
            low = middle + 1;
    }
    return plan->order[target->instance_first + low];
}

static void linear_part(const double world[12], double metric[9])
{
    for (int i = 0; i < 9; i++)
        metric[i] = world[4 * (i / 3) + i % 3];
}

static double mesh_area(const double metric[9], const struct cranny_mesh *mesh)
{
    double sum = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        sum += metric_area(metric, mesh, t);
    return sum;
}

/* Instances ordered so that those which share their values come together. */
struct entry {
    uint32_t mesh, unit, instance; /* unit: what is never split, numbered within the scene */
};

static int compare_entries(const void *a, const void *b)
{
    const struct entry *x = a, *y = b;
    if (x->mesh != y->mesh)
        return x->mesh < y->mesh ? -1 : 1;
    if (x->unit != y->unit)
        return x->unit < y->unit ? -1 : 1;
    return (x->instance > y->instance) - (x->instance < y->instance);
}

/* The instances that one node makes (EXT_mesh_gpu_instancing) are one unit: its first instance. */
static void list_entries(struct plan *plan, const uint8_t *treatments, unsigned takes,
                         struct entry *entries)
{
    uint32_t unit = 0;
    for (uint32_t i = 0; i < plan->scene->instance_count; i++) {
        const struct instance *instance = &plan->scene->instances[i], *last = instance - 1;
        const bool joins = i > 0 && instance->source_index >= 0 && last->source_index >= 0 &&
                           instance->source_node == last->source_node &&
                           instance->view.mesh == last->view.mesh;
        unit = joins ? unit : i;
        plan->target_of[i] = UINT32_MAX;
        if (takes & 1u << treatments[i])
            entries[plan->order_count++] = (struct entry){instance->view.mesh, unit, i};
    }
    qsort(entries, plan->order_count, sizeof *entries, compare_entries);
}

static bool split_mesh(const struct cranny_bake_params *params, enum cranny_treatment treatment,
                       size_t units)
{
    switch (treatment) {
    case CRANNY_TREATMENT_SURFACE:
        return params->instances != CRANNY_INSTANCES_SHARED;
    case CRANNY_TREATMENT_LOD:
        return params->instances == CRANNY_INSTANCES_SPLIT ||
               (params->instances != CRANNY_INSTANCES_SHARED &&
                units <= (size_t)params->split_limit);
    case CRANNY_TREATMENT_LINEAR:
    case CRANNY_TREATMENT_SCALAR:
    case CRANNY_TREATMENT_NONE:
        break;
    }
    return false;
}

/* Targets of one mesh: entries first..end. Returns how many instances stay joined against a split.
 */
static size_t group_mesh(struct plan *plan, const struct entry *entries, size_t first, size_t end,
                         const struct cranny_bake_params *params, const uint8_t *treatments)
{
    size_t units = 0, joined = 0;
    for (size_t i = first; i < end; i++)
        units += i == first || entries[i].unit != entries[i - 1].unit;
    const enum cranny_treatment treatment =
        (enum cranny_treatment)treatments[entries[first].instance];
    const bool split = split_mesh(params, treatment, units);
    for (size_t i = first; i < end; i++) {
        const bool starts = i == first || (split && entries[i].unit != entries[i - 1].unit);
        if (starts)
            plan->targets[plan->target_count++] =
                (struct target){.mesh = entries[i].mesh, .instance_first = (uint32_t)i};
        else
            joined += split;
        plan->targets[plan->target_count - 1].instance_count++;
        plan->order[i] = entries[i].instance;
        plan->target_of[entries[i].instance] = (uint32_t)plan->target_count - 1;
    }
    return joined;
}

static void group_instances(struct plan *plan, struct entry *entries,
                            const struct cranny_bake_params *params, const uint8_t *treatments,
                            unsigned takes)
{
    list_entries(plan, treatments, takes, entries);
    const size_t count = plan->order_count;
    size_t joined = 0;
    for (size_t first = 0, end; first < count; first = end) {
        for (end = first; end < count && entries[end].mesh == entries[first].mesh;)
            end++;
        joined += group_mesh(plan, entries, first, end, params, treatments);
    }
    if (joined && params->instances == CRANNY_INSTANCES_SPLIT)
        hook_warn(params->hooks,
                  "%zu instances made by EXT_mesh_gpu_instancing share the values of their node: "
                  "the format has no place for values of their own",
                  joined);
}

/* The metric and each instance's share. A shared set lives in object space times one scale, the
 * root of the mean area ratio; instances take part by their area in the world. */
static void measure_target(struct plan *plan, struct target *target)
{
    const struct cranny_mesh *mesh = plan_mesh(plan, target);
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double sum = 0;
    uint32_t live = 0;
    for (uint32_t i = 0; i < target->instance_count; i++) {
        struct frame *frame = &plan->frames[plan->order[target->instance_first + i]];
        linear_part(frame->world, target->metric);
        const double area = frame->singular ? 0 : mesh_area(target->metric, mesh);
        sum += area;
        live += area > 0;
        plan->share[target->instance_first + i] = sum;
    }
    target->area = target->instance_count == 1 ? sum : live ? sum / live : 0;
    for (uint32_t i = 0; i < target->instance_count && sum > 0; i++)
        plan->share[target->instance_first + i] /= sum;
    if (target->instance_count > 1) {
        const double object = mesh_area(identity, mesh);
        const double exact = object > 0 ? sqrt(target->area / object) : 0;
        const double scale = exact > 0 ? exp2(SCALE_STEP * round(log2(exact) / SCALE_STEP)) : 0;
        target->area = object > 0 ? target->area : 0;
        for (int k = 0; k < 9; k++)
            target->metric[k] = identity[k] * scale;
    }
}

static uint32_t worth(const struct target *target)
{
    return target->instance_count < SHARED_WORTH ? target->instance_count : SHARED_WORTH;
}

static uint32_t samples_on(double wanted, const struct cranny_bake_params *params)
{
    const double n = ceil(wanted);
    return (uint32_t)fmin(fmax(n, params->samples_min), params->samples_max);
}

/* Faces by the binary logarithm of their area, sixteen bins a doubling. */
#define BIN_COUNT 4096
struct histogram {
    uint64_t bins[BIN_COUNT];
    uint64_t faces;
};

static void count_faces(const struct plan *plan, struct histogram *histogram)
{
    for (size_t i = 0; i < plan->target_count; i++) {
        const struct target *target = &plan->targets[i];
        const struct cranny_mesh *mesh = plan_mesh(plan, target);
        for (uint32_t t = 0; target->area > 0 && t < mesh->triangle_count; t++) {
            const double area = metric_area(target->metric, mesh, t);
            if (!(area > 0))
                continue;
            const double bin = 16 * log2(area) + BIN_COUNT / 2;
            histogram->bins[(int)fmin(fmax(bin, 0), BIN_COUNT - 1)] += worth(target);
            histogram->faces += worth(target);
        }
    }
}

static double expected_samples(const struct histogram *histogram, double density,
                               const struct cranny_bake_params *params)
{
    double sum = 0;
    for (int i = 0; i < BIN_COUNT; i++)
        if (histogram->bins[i])
            sum += (double)histogram->bins[i] *
                   samples_on(density * exp2((i + 0.5 - BIN_COUNT / 2) / 16), params);
    return sum;
}

/* The density that meets samples_per_face on average, caps included, up to the next step. */
static enum cranny_status choose_density(struct plan *plan, const struct cranny_bake_params *params,
                                         struct cranny_error *why)
{
    plan->density = params->density;
    if (params->density > 0)
        return CRANNY_OK;
    struct histogram *histogram = alloc_array(1, sizeof *histogram);
    if (!histogram)
        return fail_memory(why, "samples");
    count_faces(plan, histogram);
    const double aim =
        fmax((double)params->samples_per_face * (double)histogram->faces, params->samples_total);
    double low = -BIN_COUNT / 32.0, high = BIN_COUNT / 32.0;
    for (int i = 0; i < 40; i++) {
        const double middle = 0.5 * (low + high);
        if (expected_samples(histogram, exp2(middle), params) < aim)
            low = middle;
        else
            high = middle;
    }
    plan->density = exp2(DENSITY_STEP * ceil(high / DENSITY_STEP));
    free(histogram);
    return CRANNY_OK;
}

uint64_t mesh_shape_key(const struct cranny_mesh *mesh)
{
    uint64_t key =
        hash_bytes(HASH_BEGIN, mesh->positions, mesh->vertex_count * sizeof *mesh->positions);
    if (mesh->normals)
        key = hash_bytes(key, mesh->normals, mesh->vertex_count * sizeof *mesh->normals);
    return hash_bytes(key, mesh->triangles, mesh->triangle_count * sizeof *mesh->triangles);
}

/* From the shape and where it stands; instances that share a set may move without moving samples.
 * `shape`: of the target's mesh. */
static void name_target(const struct plan *plan, struct target *target, uint64_t shape)
{
    uint64_t key = hash_bytes(shape, target->metric, sizeof target->metric);
    if (target->instance_count == 1)
        key = hash_word(key, plan->places[plan->order[target->instance_first]]);
    target->sequence = (uint32_t)(key >> 32);
    key = hash_bytes(key, &plan->density, sizeof plan->density);
    target->key = hash_word(key, target->sample_count);
}

/* Targets of a mesh follow one another: its shape is looked at once. */
static void name_targets(struct plan *plan)
{
    uint64_t shape = 0;
    for (size_t i = 0; i < plan->target_count; i++) {
        struct target *target = &plan->targets[i];
        if (i == 0 || target->mesh != target[-1].mesh)
            shape = mesh_shape_key(plan_mesh(plan, target));
        name_target(plan, target, shape);
    }
}

static enum cranny_status place_samples(struct plan *plan, struct target *target,
                                        const struct cranny_bake_params *params,
                                        struct cranny_error *why)
{
    const double density = plan->density;
    target->sample_base = plan->sample_count;
    if (!(target->area > 0))
        return CRANNY_OK;
    const struct cranny_mesh *mesh = plan_mesh(plan, target);
    target->sample_start = alloc_array((size_t)mesh->triangle_count + 1, sizeof(uint32_t));
    if (!target->sample_start)
        return fail_memory(why, "samples");
    uint64_t count = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const double area = metric_area(target->metric, mesh, t);
        target->sample_start[t] = (uint32_t)count;
        if (area > 0)
            count += (uint64_t)samples_on(density * area, params) * worth(target);
        if (count > UINT32_MAX)
            return fail(why, CRANNY_MEMORY,
                        "mesh '%s': more than 2^32 samples; lower density or samples_per_face",
                        mesh->name ? mesh->name : "");
    }
    target->sample_start[mesh->triangle_count] = (uint32_t)count;
    target->sample_count = (uint32_t)count;
    plan->sample_count += count;
    return CRANNY_OK;
}

static enum cranny_status plan_alloc(struct plan *plan, struct entry **entries,
                                     struct cranny_error *why)
{
    const size_t count = plan->scene->instance_count;
    plan->frames = alloc_array(count, sizeof *plan->frames);
    plan->order = alloc_array(count, sizeof *plan->order);
    plan->share = alloc_array(count, sizeof *plan->share);
    plan->targets = alloc_array(count, sizeof *plan->targets);
    plan->target_of = alloc_array(count, sizeof *plan->target_of);
    plan->places = alloc_array(count, sizeof *plan->places);
    *entries = alloc_array(count, sizeof **entries);
    const bool complete = plan->frames && plan->order && plan->share && plan->targets &&
                          plan->target_of && plan->places && *entries;
    return complete ? CRANNY_OK : fail_memory(why, "bake plan");
}

static enum cranny_status plan_fill(struct plan *plan, struct entry *entries,
                                    const struct cranny_bake_params *params,
                                    const uint8_t *treatments, unsigned takes,
                                    struct cranny_error *why)
{
    for (size_t i = 0; i < plan->scene->instance_count; i++) {
        frame_make(&plan->scene->instances[i].view, &plan->frames[i]);
        plan->places[i] = hash_bytes(HASH_BEGIN, plan->frames[i].world, sizeof plan->frames->world);
    }
    group_instances(plan, entries, params, treatments, takes);
    for (size_t i = 0; i < plan->target_count; i++)
        measure_target(plan, &plan->targets[i]);
    enum cranny_status status = choose_density(plan, params, why);
    for (size_t i = 0; status == CRANNY_OK && i < plan->target_count; i++)
        status = place_samples(plan, &plan->targets[i], params, why);
    if (status == CRANNY_OK)
        name_targets(plan);
    return status;
}

enum cranny_status plan_create(const struct cranny_scene *scene,
                               const struct cranny_bake_params *params, const uint8_t *treatments,
                               unsigned takes, struct plan *plan, struct cranny_error *why)
{
    *plan = (struct plan){.scene = scene};
    plan->shift[0] = hash_u32((uint32_t)params->seed * 2 + 1);
    plan->shift[1] = hash_u32((uint32_t)params->seed * 2 + 2);
    struct entry *entries;
    enum cranny_status status = plan_alloc(plan, &entries, why);
    if (status == CRANNY_OK)
        status = plan_fill(plan, entries, params, treatments, takes, why);
    free(entries);
    if (status != CRANNY_OK)
        plan_free(plan);
    return status;
}

void plan_free(struct plan *plan)
{
    for (size_t i = 0; i < plan->target_count; i++)
        free(plan->targets[i].sample_start);
    free(plan->frames);
    free(plan->order);
    free(plan->share);
    free(plan->targets);
    free(plan->target_of);
    free(plan->places);
    *plan = (struct plan){0};
}
