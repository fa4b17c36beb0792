/* Obscurance at a point: (1/N) Σ ρ(d) over cosine-distributed rays.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, eq. 1. */
#include "trace/gather.h"

#include "base/portable.h"
#include "trace/directions.h"

#if defined(__SSE__)
#    include <xmmintrin.h>
#    define MXCSR_FLUSH 0x8040u /* flush to zero, denormals are zero */
#endif

/* A ray this near to full visibility is not dimmed, for `adaptive`. */
#define DIMMED_BELOW (1 - 0x1p-10f)

const char *const gather_kernel_names[4] = {"exponential", "linear", "hard", NULL};

struct gather_plan {
    struct directions directions;
    enum cranny_packet packet;
    enum cranny_kernel kernel;
    float distances[2];
    float reach; /* see struct ray_block */
};

enum cranny_status gather_plan_create(const struct cranny_gather_params *params, bool adaptive,
                                      struct gather_plan **plan, struct cranny_error *why)
{
    *plan = NULL;
    struct gather_plan *made = alloc_aligned(1, sizeof *made);
    if (!made)
        return fail_memory(why, "ray directions");
    *made = (struct gather_plan){.packet = params->packet,
                                 .kernel = params->kernel,
                                 .distances = {params->distances[0], params->distances[1]},
                                 .reach = INFINITY};
    const int first = adaptive && params->rays >= 8 ? params->rays / 4 : params->rays;
    if (!directions_create(&made->directions, params->sampler, params->rays, first, params->seed)) {
        free(made);
        return fail_memory(why, "ray directions");
    }
    *plan = made;
    return CRANNY_OK;
}

void gather_plan_shorten(struct gather_plan *plan)
{
    if (plan->kernel != CRANNY_KERNEL_EXPONENTIAL)
        plan->reach = fmaxf(plan->distances[0], plan->distances[1]);
}

void gather_plan_destroy(struct gather_plan **plan)
{
    if (!plan || !*plan)
        return;
    directions_destroy(&(*plan)->directions);
    free(*plan);
    *plan = NULL;
}

/* ρ of a block of distances (2013, §2: ρ(d) = 1 − exp(a d), a = ln(½) / r, that is 1 − 2^(−d/r)).
 */
static void kernel_block(enum cranny_kernel kernel, float r, const float *distance, int count,
                         float *value)
{
    const float scale = 1 / r;
    switch (kernel) {
    case CRANNY_KERNEL_EXPONENTIAL:
        for (int i = 0; i < count; i++)
            value[i] = 1 - exp2_negative(-scale * distance[i]);
        return;
    case CRANNY_KERNEL_LINEAR:
        for (int i = 0; i < count; i++)
            value[i] = fminf(scale * distance[i], 1);
        return;
    case CRANNY_KERNEL_HARD:
        for (int i = 0; i < count; i++)
            value[i] = distance[i] < r ? 0 : 1;
        return;
    }
}

struct tally {
    double sums[2];
    uint32_t back_faces;
    bool dimmed;
};

static void gather_rays(const struct cranny_tracer *tracer, const struct gather_plan *plan,
                        const struct direction_frame *frame, const float origin[3], int from,
                        int end, struct tally *tally)
{
    struct ray_block block;
    block.reach = plan->reach;
    for (int start = from; start < end; start += RAY_BLOCK) {
        const int count = min_int(RAY_BLOCK, end - start);
        directions_fill(&plan->directions, frame, start, count, &block);
        ray_block_trace(tracer, plan->packet, origin, &block, count);
        tally->back_faces += block.back_faces;
        for (int k = 0; k < 2; k++) {
            float value[RAY_BLOCK];
            kernel_block(plan->kernel, plan->distances[k], block.distance, count, value);
            for (int i = 0; i < count; i++) {
                tally->sums[k] += (double)value[i];
                tally->dimmed |= value[i] < DIMMED_BELOW;
            }
        }
    }
}

static struct gather_result gather_one(const struct cranny_tracer *tracer,
                                       const struct gather_plan *plan,
                                       const struct gather_point *point)
{
    const struct direction_frame frame = direction_frame(&plan->directions, point);
    const float offset = ray_offset(point->position, point->extent);
    float origin[3];
    for (int k = 0; k < 3; k++)
        origin[k] = point->position[k] + offset * point->face_normal[k];
    struct tally tally = {{0, 0}, 0, false};
    int rays = plan->directions.first;
    gather_rays(tracer, plan, &frame, origin, 0, rays, &tally);
    if (tally.dimmed && rays < plan->directions.count) {
        gather_rays(tracer, plan, &frame, origin, rays, plan->directions.count, &tally);
        rays = plan->directions.count;
    }
    return (struct gather_result){
        .visibility = {(float)(tally.sums[0] / rays), (float)(tally.sums[1] / rays)},
        .rays = (uint32_t)rays,
        .back_faces = tally.back_faces};
}

void gather_points(const struct cranny_tracer *tracer, const struct gather_plan *plan,
                   const struct gather_point *points, size_t count, struct gather_result *results)
{
    for (size_t i = 0; i < count; i++)
        results[i] = gather_one(tracer, plan, &points[i]);
}

unsigned gather_thread_begin(void)
{
#if defined(__SSE__)
    const unsigned saved = _mm_getcsr();
    _mm_setcsr(saved | MXCSR_FLUSH);
    return saved;
#else
    return 0;
#endif
}

void gather_thread_end(unsigned saved)
{
#if defined(__SSE__)
    _mm_setcsr(saved);
#else
    (void)saved;
#endif
}
