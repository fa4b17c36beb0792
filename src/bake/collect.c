/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.1:
 * samples whose rays see too many back faces are buried and dropped. */
#include "bake/cache.h"
#include "bake/sheets.h"

#include "base/vector.h"
#include "base/watch.h"
#include "trace/gather.h"

/* Rays between two looks at the cancel flag: about 20 ms of one thread. */
#define RAYS_PER_WORK 65536
#define BATCH 128
/* With few rays a sample's share of back faces is noisy; it is drawn toward its face's mean as if
 * that had been seen by this many rays more. */
#define POOL_RAYS 4.0

/* A run of one target's triangles. */
struct work {
    uint32_t target, triangle_first, triangle_end;
};

struct work_list {
    struct work *items;
    size_t count, capacity;
};

/* One thread's points on their way to the rays. */
struct batch {
    struct gather_point points[BATCH];
    struct gather_result results[BATCH];
    uint64_t ids[BATCH];
    uint32_t instances[BATCH];
    int count, passed; /* passed: done without rays */
    uint64_t rays, reused, traced;
};

struct collector {
    const struct plan *plan;
    sample_source_fn *source;
    void *source_user;
    struct samples *samples;
    struct sample_reuse *reuse;  /* NULL: none */
    const struct sheets *sheets; /* NULL: all triangles from the front; else the turned ones */
    int batch_limit;             /* points traced without a look at the cancel flag */
    struct watch watch;
};

static bool add_work(struct work_list *list, const struct target *target, uint32_t index,
                     uint32_t triangle_count, uint32_t grain)
{
    for (uint32_t first = 0, t = 0; t < triangle_count; t++) {
        if (t + 1 < triangle_count &&
            target->sample_start[t + 1] - target->sample_start[first] < grain)
            continue;
        if (!grow_array((void **)&list->items, &list->capacity, list->count + 1,
                        sizeof *list->items))
            return false;
        list->items[list->count++] = (struct work){index, first, t + 1};
        first = t + 1;
    }
    return true;
}

static bool list_work(const struct plan *plan, int rays, const bool *skip, struct work_list *list)
{
    const uint32_t grain = (uint32_t)max_int(RAYS_PER_WORK / rays, 1);
    for (size_t i = 0; i < plan->target_count; i++) {
        const struct target *target = &plan->targets[i];
        if (target->sample_count && !(skip && skip[i]) &&
            !add_work(list, target, (uint32_t)i, plan_mesh(plan, target)->triangle_count, grain))
            return false;
    }
    return true;
}

/* What is seen from behind is not kept: fronts decide where that is of use. */
static void set_sample(struct collector *collector, uint64_t id, const struct kept *kept)
{
    struct samples *samples = collector->samples;
    memcpy(samples->values[id].visibility, kept->visibility, sizeof kept->visibility);
    samples->valid[id] = kept->back;
    if (samples->kept && !collector->sheets)
        samples->kept[id] = *kept;
}

static void flush(struct collector *collector, struct batch *batch)
{
    watch_advance(&collector->watch, (size_t)batch->count + (size_t)batch->passed);
    batch->passed = 0;
    if (!watch_goes_on(&collector->watch))
        batch->count = 0;
    collector->source(collector->source_user, batch->points, batch->instances, (size_t)batch->count,
                      batch->results);
    for (int i = 0; i < batch->count; i++) {
        const struct gather_result *result = &batch->results[i];
        const double share = result->rays ? (double)result->back_faces / result->rays : 0;
        struct kept kept = {.back = (uint8_t)(share * 255 + 0.5)};
        for (int c = 0; c < 2; c++)
            kept.visibility[c] =
                (uint16_t)(clamp_float(result->visibility[c], 0, 1) * 65535 + 0.5f);
        set_sample(collector, batch->ids[i], &kept);
        batch->rays += result->rays;
    }
    batch->traced += (uint64_t)batch->count;
    batch->count = 0;
}

/* A triangle as one of its instances shows it. */
struct placed {
    double corner[3][3];
    double normal[3][3]; /* of the corners; not unit */
    double face[3];      /* unit */
    double extent;
    bool smooth, good;
};

static void turn(const double m[9], const float v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

static void place(const struct frame *frame, const struct cranny_mesh *mesh, uint32_t triangle,
                  struct placed *placed)
{
    const uint32_t *corner = mesh->triangles[triangle];
    double e[3][3], longest = 0;
    for (int c = 0; c < 3; c++) {
        transform_point(frame->world, mesh->positions[corner[c]], placed->corner[c]);
        if (mesh->normals)
            turn(frame->normal, mesh->normals[corner[c]], placed->normal[c]);
    }
    for (int c = 0; c < 3; c++) {
        double square = 0;
        for (int k = 0; k < 3; k++) {
            e[c][k] = placed->corner[(c + 1) % 3][k] - placed->corner[c][k];
            square += e[c][k] * e[c][k];
        }
        longest = fmax(longest, square);
    }
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        placed->face[k] = frame->side * (e[0][a] * e[1][b] - e[0][b] * e[1][a]);
    }
    placed->extent = sqrt(longest);
    placed->smooth = mesh->normals != NULL;
    placed->good = normalise3(placed->face) && !frame->singular;
}

static void shade(const struct placed *placed, const double l[3], double normal[3])
{
    double side = 0;
    for (int k = 0; k < 3; k++) {
        normal[k] = !placed->smooth ? placed->face[k]
                                    : l[0] * placed->normal[0][k] + l[1] * placed->normal[1][k] +
                                          l[2] * placed->normal[2][k];
        side += normal[k] * placed->face[k];
    }
    if (!normalise3(normal))
        memcpy(normal, placed->face, 3 * sizeof *normal);
    else if (side < 0)
        for (int k = 0; k < 3; k++)
            normal[k] = -normal[k];
}

static void make_point(const struct placed *placed, const double l[3], uint32_t id, double side,
                       struct gather_point *point)
{
    double normal[3];
    shade(placed, l, normal);
    for (int k = 0; k < 3; k++) {
        point->position[k] = (float)(l[0] * placed->corner[0][k] + l[1] * placed->corner[1][k] +
                                     l[2] * placed->corner[2][k]);
        point->normal[k] = (float)(side * normal[k]);
        point->face_normal[k] = (float)(side * placed->face[k]);
    }
    point->extent = (float)placed->extent;
    point->id = id;
}

/* Which instance a sample of a shared mesh is traced in: the samples of a triangle step evenly
 * through the instances' shares of the area. */
static double pick_number(const struct plan *plan, uint32_t triangle, uint32_t index)
{
    const uint32_t step = hash_combine(triangle, plan->shift[0]) + index * 0x9e3779b9u;
    return ((double)step + 0.5) * 0x1p-32;
}

static uint32_t pick_instance(const struct plan *plan, const struct target *target,
                              uint32_t triangle, uint32_t index)
{
    return target->instance_count == 1
               ? plan->order[target->instance_first]
               : plan_pick(plan, target, pick_number(plan, triangle, index));
}

/* The same in the last bake: where that instance stood. */
static uint64_t picked_place(const struct cache_samples *old, double u)
{
    uint32_t low = 0, high = old->pick_count - 1;
    while (low < high) {
        const uint32_t middle = (low + high) / 2;
        if (old->picks[middle].share > u)
            high = middle;
        else
            low = middle + 1;
    }
    return old->picks[low].place;
}

/* A sample as the last bake left it; NULL: there is none at this place. */
static const struct kept *find_kept(const struct collector *collector, const struct target *target,
                                    uint32_t triangle, uint32_t s, uint32_t instance)
{
    if (!collector->reuse || collector->sheets)
        return NULL;
    const struct plan *plan = collector->plan;
    const struct cache_samples *old = &collector->reuse->old[target - plan->targets];
    if (!old->kept ||
        (old->picks && picked_place(old, pick_number(plan, triangle, s)) != plan->places[instance]))
        return NULL;
    return &old->kept[target->sample_start[triangle] + s];
}

/* Take a sample over, if it stands. */
static bool reuse_sample(struct collector *collector, const struct kept *old, uint64_t id,
                         uint32_t instance, struct batch *batch)
{
    struct kept kept;
    if (!old || !collector->reuse->stands(collector->reuse->user, &batch->points[batch->count],
                                          instance, old, &kept))
        return false;
    set_sample(collector, id, &kept);
    batch->reused++;
    batch->passed++;
    return true;
}

static void collect_triangle(struct collector *collector, const struct target *target,
                             uint32_t triangle, struct batch *batch)
{
    const struct plan *plan = collector->plan;
    const uint32_t first = target->sample_start[triangle];
    const uint32_t count = target->sample_start[triangle + 1] - first;
    const struct cranny_mesh *mesh = plan_mesh(plan, target);
    struct placed placed = {.good = false};
    uint32_t shown = UINT32_MAX;
    for (uint32_t s = 0; s < count; s++) {
        const uint32_t instance = pick_instance(plan, target, triangle, s);
        const uint64_t id = target->sample_base + first + s;
        if (instance != shown)
            place(&plan->frames[instance], mesh, triangle, &placed);
        shown = instance;
        if (!placed.good) {
            collector->samples->valid[id] = 255;
            continue;
        }
        double l[3];
        const uint32_t number = target->sequence + first + s;
        sample_barycentrics(plan->shift, number, l);
        make_point(&placed, l, number, collector->sheets ? -1 : 1, &batch->points[batch->count]);
        const struct kept *old = find_kept(collector, target, triangle, s, instance);
        if (reuse_sample(collector, old, id, instance, batch))
            continue;
        batch->instances[batch->count] = instance;
        batch->ids[batch->count++] = id;
        if (batch->count == collector->batch_limit)
            flush(collector, batch);
    }
}

static void collect_work(struct collector *collector, const struct work *work, struct batch *batch)
{
    const struct target *target = &collector->plan->targets[work->target];
    const uint8_t *turned = collector->sheets ? collector->sheets->turned[work->target] : NULL;
    if (collector->sheets && !turned)
        return;
    for (uint32_t t = work->triangle_first; t < work->triangle_end; t++) {
        if (watch_stopped(&collector->watch))
            return;
        if (!turned || turned[t])
            collect_triangle(collector, target, t, batch);
    }
    flush(collector, batch);
}

static void collect_all(struct collector *collector, const struct work_list *list, int threads)
{
    uint64_t rays = 0, reused = 0, traced = 0;
#pragma omp parallel num_threads(threads) reduction(+ : rays, reused, traced)
    {
        const unsigned saved = gather_thread_begin();
        struct batch batch = {.count = 0};
#pragma omp for schedule(dynamic, 1)
        for (size_t i = 0; i < list->count; i++)
            if (!watch_stopped(&collector->watch))
                collect_work(collector, &list->items[i], &batch);
        rays += batch.rays;
        reused += batch.reused;
        traced += batch.traced;
        gather_thread_end(saved);
    }
    collector->samples->rays += rays;
    if (collector->reuse && !collector->sheets) {
        collector->reuse->reused += reused;
        collector->reuse->taken += traced;
    }
}

/* Once more, from behind, where the fronts turned out to be the insides of solids. */
static enum cranny_status collect_turned(struct collector *collector, const struct work_list *list,
                                         int threads, struct cranny_error *why)
{
    struct sheets sheets;
    const enum cranny_status status =
        sheets_find(collector->plan, collector->samples, &sheets, why);
    if (status != CRANNY_OK)
        return status;
    if (sheets.sample_count) {
        collector->watch.total += (double)sheets.sample_count;
        collector->sheets = &sheets;
        collect_all(collector, list, threads);
        collector->sheets = NULL;
    }
    sheets_free(&sheets);
    return CRANNY_OK;
}

/* From shares of back faces to validity; returns how many samples fell. */
static uint64_t judge_triangle(uint8_t *state, uint32_t count, double rays, double limit)
{
    uint64_t sum = 0, fallen = 0;
    for (uint32_t s = 0; s < count; s++)
        sum += state[s];
    const double mean = count ? (double)sum / count : 0;
    for (uint32_t s = 0; s < count; s++) {
        const double share = (state[s] * rays + mean * POOL_RAYS) / (rays + POOL_RAYS) / 255;
        state[s] = limit >= 1 || share <= limit;
        fallen += !state[s];
    }
    return fallen;
}

static void judge(const struct plan *plan, const struct work_list *list,
                  const struct cranny_bake_params *params, struct samples *samples, int threads)
{
    uint64_t invalid = 0;
#pragma omp parallel for num_threads(threads) reduction(+ : invalid) schedule(static)
    for (size_t i = 0; i < list->count; i++) {
        const struct work *work = &list->items[i];
        const struct target *target = &plan->targets[work->target];
        for (uint32_t t = work->triangle_first; t < work->triangle_end; t++) {
            const uint32_t first = target->sample_start[t];
            invalid += judge_triangle(samples->valid + target->sample_base + first,
                                      target->sample_start[t + 1] - first, params->rays,
                                      params->back_limit);
        }
    }
    samples->invalid = invalid;
}

struct cranny_gather_params bake_gather_params(const struct cranny_bake_params *params)
{
    struct cranny_gather_params gather = cranny_gather_params_default();
    gather.rays = params->rays;
    gather.distances[0] = params->distance_long;
    gather.distances[1] = params->distance_short;
    gather.kernel = (enum cranny_kernel)params->kernel;
    gather.sampler = (enum cranny_sampler)params->sampler;
    gather.seed = (uint32_t)params->seed;
    gather.threads = params->threads;
    return gather;
}

static enum cranny_status samples_alloc(const struct plan *plan, bool keep, struct samples *samples,
                                        struct cranny_error *why)
{
    *samples = (struct samples){0};
    samples->values = alloc_array(plan->sample_count, sizeof *samples->values);
    samples->valid = alloc_array(plan->sample_count, 1);
    samples->kept = keep ? alloc_array(plan->sample_count, sizeof *samples->kept) : NULL;
    return samples->values && samples->valid && (samples->kept || !keep)
               ? CRANNY_OK
               : fail_memory(why, "samples");
}

struct ray_source {
    const struct cranny_tracer *tracer;
    struct gather_plan *gather;
};

static void trace_source(void *user, const struct gather_point *points, const uint32_t *instances,
                         size_t count, struct gather_result *results)
{
    const struct ray_source *source = user;
    (void)instances;
    gather_points(source->tracer, source->gather, points, count, results);
}

static enum cranny_status run(struct collector *collector, const struct work_list *list,
                              const struct cranny_bake_params *params, struct cranny_error *why)
{
    const int threads = thread_count(params->threads);
    enum cranny_status status = CRANNY_OK;
    collect_all(collector, list, threads);
    if (!watch_stopped(&collector->watch) && collector->source == trace_source)
        status = collect_turned(collector, list, threads, why);
    if (status != CRANNY_OK)
        return status;
    collector->watch.next = 0; /* the last word, however short the stage was */
    if (!watch_goes_on(&collector->watch))
        return fail(why, CRANNY_CANCELLED, "bake: cancelled while sampling");
    judge(collector->plan, list, params, collector->samples, threads);
    return CRANNY_OK;
}

static enum cranny_status collect(struct collector *collector,
                                  const struct cranny_bake_params *params, const bool *skip,
                                  struct cranny_error *why)
{
    const struct plan *plan = collector->plan;
    struct work_list list = {0};
    collector->batch_limit = min_int(BATCH, max_int(RAYS_PER_WORK / params->rays, 1));
    enum cranny_status status = samples_alloc(plan, collector->reuse, collector->samples, why);
    if (status == CRANNY_OK && !list_work(plan, params->rays, skip, &list))
        status = fail_memory(why, "samples");
    watch_begin(&collector->watch, params->hooks,
                collector->source == trace_source ? "trace" : "resample", plan->sample_count);
    if (status == CRANNY_OK)
        status = run(collector, &list, params, why);
    free(list.items);
    if (status != CRANNY_OK)
        samples_free(collector->samples);
    return status;
}

enum cranny_status samples_collect_from(const struct plan *plan, sample_source_fn *source,
                                        void *user, const struct cranny_bake_params *params,
                                        const bool *skip, struct sample_reuse *reuse,
                                        struct samples *samples, struct cranny_error *why)
{
    struct collector collector = {
        .plan = plan, .source = source, .source_user = user, .reuse = reuse, .samples = samples};
    return collect(&collector, params, skip, why);
}

struct ray_reuse {
    const struct cache *cache;
    const struct gather_plan *gather;
};

static bool rays_stand(void *user, const struct gather_point *point, uint32_t instance,
                       const struct kept *old, struct kept *kept)
{
    const struct ray_reuse *rays = user;
    (void)instance;
    return cache_stands(rays->cache, rays->gather, point, old, kept);
}

/* Rays, but for what the cache has. */
static enum cranny_status collect_with_cache(struct collector *collector,
                                             const struct cranny_bake_params *params,
                                             const struct gather_plan *gather, struct cache *cache,
                                             struct cranny_error *why)
{
    const struct plan *plan = collector->plan;
    struct ray_reuse rays = {cache, gather};
    struct cache_samples *old = alloc_array(plan->target_count, sizeof *old);
    struct sample_reuse reuse = {.old = old, .stands = rays_stand, .user = &rays};
    if (!old)
        return fail_memory(why, "samples");
    for (size_t i = 0; i < plan->target_count; i++)
        old[i] = cache_find_samples(cache, &plan->targets[i]);
    collector->reuse = &reuse;
    const enum cranny_status status = collect(collector, params, NULL, why);
    cache->reused_samples += reuse.reused;
    cache->news |= reuse.taken > 0;
    free(old);
    return status;
}

enum cranny_status samples_collect(const struct plan *plan, const struct cranny_tracer *tracer,
                                   const struct cranny_bake_params *params, struct cache *cache,
                                   struct samples *samples, struct cranny_error *why)
{
    const struct cranny_gather_params wanted = bake_gather_params(params);
    struct ray_source source = {.tracer = tracer};
    struct collector collector = {
        .plan = plan, .source = trace_source, .source_user = &source, .samples = samples};
    *samples = (struct samples){0};
    enum cranny_status status = gather_plan_create(&wanted, params->adaptive, &source.gather, why);
    if (status == CRANNY_OK && cache)
        status = collect_with_cache(&collector, params, source.gather, cache, why);
    else if (status == CRANNY_OK)
        status = collect(&collector, params, NULL, why);
    gather_plan_destroy(&source.gather);
    return status;
}

void samples_free(struct samples *samples)
{
    free(samples->values);
    free(samples->valid);
    free(samples->kept);
    *samples = (struct samples){0};
}
