/* The truth of a frame: obscurance per pixel by rays (AOV paper, §6.1), in passes that complement
 * one another and whose spread tells the error.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, eq. 1. */
#include "base/vector.h"
#include "base/watch.h"
#include "frame/frame.h"
#include "trace/gather.h"

#define TILE 16
#define PASSES_MAX 8
#define PASS_RAYS_MIN 4 /* below, a pass says little about the hemisphere */

struct truth {
    const struct cranny_frame *frame;
    struct gather_plan *plans[2]; /* of `rays` rays a sample, and one more */
    int rays, passes;             /* of the shorter passes; passes in all */
    int longer;                   /* passes that take the second plan: the first ones */
    char *visibility;             /* the mean of the passes so far */
    size_t stride;
    float *spread; /* Σ rays × (pass − mean)², per pixel */
    uint64_t traced;
};

static enum cranny_status validate(const struct cranny_frame *frame,
                                   const struct cranny_raytrace_params *p, const float *visibility,
                                   size_t stride, struct cranny_error *why)
{
    if (!frame || !visibility)
        return fail(why, CRANNY_USAGE, "raytrace: a frame and an output are needed");
    if (stride && (stride < sizeof(float) * (size_t)frame->width || stride % sizeof(float)))
        return fail(why, CRANNY_USAGE, "raytrace: rows %zu bytes apart do not hold %d floats",
                    stride, frame->width);
    if (!(p->radius_world > 0 && isfinite(p->radius_world)))
        return fail(why, CRANNY_USAGE, "raytrace: radius_world is %g; it must be above 0",
                    (double)p->radius_world);
    if (p->rays < 1 || p->rays > 65536)
        return fail(why, CRANNY_USAGE, "raytrace: rays is %d; 1 to 65536 are possible", p->rays);
    if ((unsigned)p->kernel > CRANNY_KERNEL_HARD || !(p->error_target >= 0) || p->threads < 0)
        return fail(why, CRANNY_USAGE, "raytrace: kernel, error_target or threads is out of range");
    return CRANNY_OK;
}

/* As many passes as have rays enough each, and rather a number that divides the rays. */
static void split_rays(struct truth *truth, int rays)
{
    rays = max_int(1, rays / truth->frame->samples);
    const int most = max_int(1, min_int(PASSES_MAX, rays / PASS_RAYS_MIN));
    truth->passes = most;
    for (int passes = most; 2 * passes > most; passes--)
        if (rays % passes == 0) {
            truth->passes = passes;
            break;
        }
    truth->rays = rays / truth->passes;
    truth->longer = rays % truth->passes;
}

static enum cranny_status make_plans(struct truth *truth,
                                     const struct cranny_raytrace_params *params,
                                     struct cranny_error *why)
{
    struct cranny_gather_params gather = cranny_gather_params_default();
    gather.kernel = params->kernel;
    gather.distances[0] = gather.distances[1] = params->radius_world;
    gather.seed = (uint32_t)params->seed;
    for (int k = 0; k <= (truth->longer > 0); k++) {
        gather.rays = truth->rays + k;
        const enum cranny_status status = gather_plan_create(&gather, false, &truth->plans[k], why);
        if (status != CRANNY_OK)
            return status;
        gather_plan_shorten(truth->plans[k]);
    }
    return CRANNY_OK;
}

/* The point that a sample shows, ready to gather at; false: sky. */
static bool sample_point(const struct cranny_frame *frame, struct frame_pixel pixel,
                         struct gather_point *point)
{
    const size_t index = frame_index(frame, pixel);
    if (!isfinite(frame->depth[index]))
        return false;
    const struct frame_ray ray = frame_ray(frame, pixel);
    const struct frame_surface surface =
        frame_surface(frame, &ray, &frame->hits[index], (double)frame->depth[index]);
    double n[3] = {surface.normal[0], surface.normal[1], surface.normal[2]};
    if (frame->shading == CRANNY_FRAME_SMOOTH)
        frame_to_world(frame, frame->normals[index], n);
    normalise3(n);
    for (int i = 0; i < 3; i++) {
        point->position[i] = (float)(ray.origin[i] + surface.depth * ray.direction[i]);
        point->normal[i] = (float)n[i];
        point->face_normal[i] = (float)surface.normal[i];
    }
    point->extent = surface.extent;
    return true;
}

/* One pass's value of a pixel, by West's update of mean and spread. */
static void add_value(const struct truth *truth, int x, int y, int pass, float value)
{
    float *mean = (float *)(void *)(truth->visibility + (size_t)y * truth->stride) + x;
    float *spread = &truth->spread[(size_t)y * (size_t)truth->frame->width + (size_t)x];
    const int before = pass * truth->rays + min_int(pass, truth->longer);
    const int rays = truth->rays + (pass < truth->longer);
    if (pass == 0)
        *mean = *spread = 0;
    const float change = value - *mean;
    *mean += change * (float)rays / (float)(before + rays);
    *spread += (float)rays * change * (value - *mean);
}

/* A row of a tile: all of its points at once. Returns the rays traced. */
static uint64_t trace_row(const struct truth *truth, int pass, int y, int first, int end)
{
    const struct cranny_frame *frame = truth->frame;
    struct gather_point points[TILE * CRANNY_SAMPLES_MAX] = {0};
    struct gather_result results[TILE * CRANNY_SAMPLES_MAX];
    int counts[TILE] = {0};
    size_t count = 0;
    for (int x = first; x < end; x++)
        for (int sample = 0; sample < frame->samples; sample++) {
            if (!sample_point(frame, (struct frame_pixel){x, y, sample}, &points[count]))
                continue;
            const uint32_t pixel = (uint32_t)y * (uint32_t)frame->width + (uint32_t)x;
            const uint32_t number = pixel * (uint32_t)frame->samples + (uint32_t)sample;
            points[count++].id = number * (uint32_t)truth->passes + (uint32_t)pass;
            counts[x - first]++;
        }
    gather_points(frame->tracer, truth->plans[pass < truth->longer], points, count, results);
    const struct gather_result *result = results;
    for (int x = first; x < end; x++) {
        double sum = frame->samples - counts[x - first];
        for (int k = 0; k < counts[x - first]; k++)
            sum += (double)(result++)->visibility[0];
        add_value(truth, x, y, pass, (float)(sum / frame->samples));
    }
    return count * (uint64_t)(truth->rays + (pass < truth->longer));
}

static void trace_pass(struct truth *truth, int pass, int threads, struct watch *watch)
{
    const int width = truth->frame->width, height = truth->frame->height;
    const int across = (width + TILE - 1) / TILE, down = (height + TILE - 1) / TILE;
    uint64_t traced = 0;
#pragma omp parallel num_threads(thread_count(threads)) reduction(+ : traced)
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 1)
        for (int tile = 0; tile < across * down; tile++) {
            if (!watch_goes_on(watch))
                continue;
            const int x = tile % across * TILE, y = tile / across * TILE;
            for (int row = y; row < min_int(y + TILE, height); row++)
                traced += trace_row(truth, pass, row, x, min_int(x + TILE, width));
            watch_advance(watch, 1);
        }
        gather_thread_end(saved);
    }
    truth->traced += traced;
}

static bool is_sky(const struct cranny_frame *frame, int x, int y)
{
    for (int sample = 0; sample < frame->samples; sample++)
        if (isfinite(frame->depth[frame_index(frame, (struct frame_pixel){x, y, sample})]))
            return false;
    return true;
}

/* Of the mean of `passes` passes, from their spread. Since passes complement one another, their
 * mean is better than that of as many independent ones: by passes^0.2, within 15 % for all kernels
 * and 16 to 1024 rays on Crytek's Sponza and the dragon. */
static float pixel_error(const struct truth *truth, size_t pixel, int passes)
{
    static const float complement[PASSES_MAX + 1] = {1,      1,      .8706f, .8027f, .7579f,
                                                     .7248f, .6988f, .6776f, .6598f};
    const int rays = passes * truth->rays + min_int(passes, truth->longer);
    const float spread = fmaxf(truth->spread[pixel], 0);
    return passes > 1 ? complement[passes] * sqrtf(spread / ((float)rays * (float)(passes - 1)))
                      : 0;
}

static void measure_errors(const struct truth *truth, int passes, float *errors,
                           struct cranny_raytrace_report *report)
{
    const struct cranny_frame *frame = truth->frame;
    double sum = 0, largest = 0;
    size_t seen = 0;
    for (int y = 0; y < frame->height; y++)
        for (int x = 0; x < frame->width; x++) {
            const size_t pixel = (size_t)y * (size_t)frame->width + (size_t)x;
            const bool sky = is_sky(frame, x, y);
            const float error = sky ? 0 : pixel_error(truth, pixel, passes);
            sum += (double)error;
            largest = fmax(largest, (double)error);
            seen += !sky;
            if (errors)
                *(float *)(void *)((char *)errors + (size_t)y * truth->stride +
                                   (size_t)x * sizeof(float)) = error;
        }
    report->standard_error_mean = seen ? sum / (double)seen : 0;
    report->standard_error_max = largest;
}

static enum cranny_status trace_passes(struct truth *truth,
                                       const struct cranny_raytrace_params *params,
                                       struct cranny_raytrace_report *report,
                                       struct cranny_error *why)
{
    const struct cranny_frame *frame = truth->frame;
    const size_t across = (size_t)(frame->width + TILE - 1) / TILE;
    const size_t down = (size_t)(frame->height + TILE - 1) / TILE;
    struct watch watch;
    watch_begin(&watch, params->hooks, "trace", across * down * (size_t)truth->passes);
    watch_goes_on(&watch);
    for (int pass = 0; pass < truth->passes && !watch_stopped(&watch); pass++) {
        trace_pass(truth, pass, params->threads, &watch);
        report->passes = pass + 1;
        if (!(params->error_target > 0) || pass == 0)
            continue;
        measure_errors(truth, pass + 1, NULL, report);
        if (report->standard_error_mean < (double)params->error_target)
            break;
    }
    watch.next = 0;
    if (!watch_goes_on(&watch))
        return fail(why, CRANNY_CANCELLED, "raytrace: cancelled");
    return CRANNY_OK;
}

enum cranny_status cranny_frame_raytrace(const struct cranny_frame *frame,
                                         const struct cranny_raytrace_params *params,
                                         float *visibility, size_t stride, float *standard_error,
                                         struct cranny_raytrace_report *report,
                                         struct cranny_error *why)
{
    const struct cranny_raytrace_params defaults = cranny_raytrace_params_default();
    params = params ? params : &defaults;
    const double begun = seconds_now();
    enum cranny_status status = validate(frame, params, visibility, stride, why);
    if (status != CRANNY_OK)
        return status;
    struct truth truth = {.frame = frame,
                          .visibility = (char *)visibility,
                          .stride = stride ? stride : sizeof(float) * (size_t)frame->width};
    struct cranny_raytrace_report made = {0};
    split_rays(&truth, params->rays);
    truth.spread = alloc_array((size_t)frame->width * (size_t)frame->height, sizeof(float));
    status = truth.spread ? make_plans(&truth, params, why) : fail_memory(why, "raytrace");
    if (status == CRANNY_OK)
        status = trace_passes(&truth, params, &made, why);
    if (status == CRANNY_OK) {
        measure_errors(&truth, made.passes, standard_error, &made);
        made.rays = truth.traced;
        made.rays_per_pixel =
            (made.passes * truth.rays + min_int(made.passes, truth.longer)) * frame->samples;
        made.seconds = seconds_now() - begun;
        if (report)
            *report = made;
    }
    gather_plan_destroy(&truth.plans[0]);
    gather_plan_destroy(&truth.plans[1]);
    free(truth.spread);
    return status;
}
