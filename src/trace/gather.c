/* Obscurance at a point: (1/N) Σ ρ(d) over cosine-distributed rays.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, eq. 1. */
#include "trace/gather.h"

#include "trace/directions.h"
#include "trace/kernel.h"

#include <cranny/runtime.h>

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

static enum cranny_status plan_create(const struct cranny_gather_params *params, bool sphere,
                                      bool adaptive, struct gather_plan **plan,
                                      struct cranny_error *why)
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
    if (!directions_create(&made->directions, params->sampler, sphere, params->rays, first,
                           params->seed)) {
        free(made);
        return fail_memory(why, "ray directions");
    }
    *plan = made;
    return CRANNY_OK;
}

enum cranny_status gather_plan_create(const struct cranny_gather_params *params, bool adaptive,
                                      struct gather_plan **plan, struct cranny_error *why)
{
    return plan_create(params, false, adaptive, plan, why);
}

enum cranny_status gather_plan_create_sphere(const struct cranny_gather_params *params,
                                             struct gather_plan **plan, struct cranny_error *why)
{
    return plan_create(params, true, false, plan, why);
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

/* One loop for each kernel, so that they vectorise. */
static void kernel_block(enum cranny_kernel kernel, float r, const float *distance, int count,
                         float *value)
{
    switch (kernel) {
    case CRANNY_KERNEL_EXPONENTIAL:
        for (int i = 0; i < count; i++)
            value[i] = kernel_value(CRANNY_KERNEL_EXPONENTIAL, r, distance[i]);
        return;
    case CRANNY_KERNEL_LINEAR:
        for (int i = 0; i < count; i++)
            value[i] = kernel_value(CRANNY_KERNEL_LINEAR, r, distance[i]);
        return;
    case CRANNY_KERNEL_HARD:
        for (int i = 0; i < count; i++)
            value[i] = kernel_value(CRANNY_KERNEL_HARD, r, distance[i]);
        return;
    }
}

/* Trace a block's rays and weigh their distances. */
static void block_values(const struct cranny_tracer *tracer, const struct gather_plan *plan,
                         const float origin[3], struct ray_block *block, int count,
                         float values[2][RAY_BLOCK])
{
    /* What dims plainly counts at any distance, up to the hit. */
    const bool plain = tracer_dims(tracer) && tracer->dimming == CRANNY_DIMMING_PLAIN;
    block->reach = plain ? INFINITY : plan->reach;
    ray_block_trace(tracer, plan->packet, origin, block, count);
    for (int k = 0; k < 2; k++)
        kernel_block(plan->kernel, plan->distances[k], block->distance, count, values[k]);
    if (tracer_dims(tracer))
        ray_block_dim(tracer, plan->packet, plan->kernel, plan->distances, origin, block, count,
                      values);
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
    float values[2][RAY_BLOCK];
    for (int start = from; start < end; start += RAY_BLOCK) {
        const int count = min_int(RAY_BLOCK, end - start);
        directions_fill(&plan->directions, frame, start, count, &block);
        block_values(tracer, plan, origin, &block, count, values);
        tally->back_faces += block.back_faces;
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < count; i++) {
                tally->sums[k] += (double)values[k][i];
                tally->dimmed |= values[k][i] < DIMMED_BELOW;
            }
    }
}

static void ray_origin(const struct gather_point *point, float origin[3])
{
    const float offset = ray_offset(point->position, point->extent);
    for (int k = 0; k < 3; k++)
        origin[k] = point->position[k] + offset * point->face_normal[k];
}

static struct gather_result gather_one(const struct cranny_tracer *tracer,
                                       const struct gather_plan *plan,
                                       const struct gather_point *point)
{
    const struct direction_frame frame = direction_frame(&plan->directions, point);
    float origin[3];
    ray_origin(point, origin);
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

/* Where each ray enters the box, if that is nearer than what `enter` has. */
static void enter_box(const float box[6], const float origin[3], const struct ray_block *block,
                      int count, float *enter)
{
    const float *axes[3] = {block->x, block->y, block->z};
    for (int i = 0; i < count; i++) {
        float near = 0, far = INFINITY;
        for (int k = 0; k < 3; k++) {
            if (axes[k][i] == 0) {
                near = origin[k] < box[k] || origin[k] > box[3 + k] ? INFINITY : near;
                continue;
            }
            const float inverse = 1 / axes[k][i];
            const float a = (box[k] - origin[k]) * inverse;
            const float b = (box[3 + k] - origin[k]) * inverse;
            const float low = a < b ? a : b, high = a < b ? b : a;
            near = low > near ? low : near;
            far = high < far ? high : far;
        }
        if (near <= far && near < INFINITY)
            enter[i] = near < enter[i] ? near : enter[i];
    }
}

/* Rays keep to the side of the face. */
static bool box_above(const float box[6], const float origin[3], const float face_normal[3])
{
    float highest = 0;
    for (int k = 0; k < 3; k++)
        highest += face_normal[k] * ((face_normal[k] > 0 ? box[3 + k] : box[k]) - origin[k]);
    return highest >= 0;
}

/* Σ of what the rays at `enter` may change. Any ray that enters counts a little. */
static double sum_reach(const struct gather_plan *plan, const float *enter, int count, bool plain)
{
    const float r = fmaxf(plan->distances[0], plan->distances[1]);
    double sum = 0;
    for (int i = 0; i < count; i++)
        if (enter[i] < INFINITY)
            sum += plain ? 1 : fmax(1 - (double)kernel_value(plan->kernel, r, enter[i]), 1e-9);
    return sum;
}

float gather_reach(const struct gather_plan *plan, const struct gather_point *point,
                   const float (*boxes)[6], size_t box_count, bool plain)
{
    const int total = plan->directions.count;
    float origin[3], enter[RAY_BLOCK];
    size_t first = 0;
    ray_origin(point, origin);
    while (first < box_count && !box_above(boxes[first], origin, point->face_normal))
        first++;
    if (first == box_count)
        return 0;
    const struct direction_frame frame = direction_frame(&plan->directions, point);
    double sum = 0;
    for (int start = 0; start < total; start += RAY_BLOCK) {
        struct ray_block block;
        const int count = min_int(RAY_BLOCK, total - start);
        directions_fill(&plan->directions, &frame, start, count, &block);
        for (int i = 0; i < count; i++)
            enter[i] = INFINITY;
        for (size_t b = first; b < box_count; b++)
            enter_box(boxes[b], origin, &block, count, enter);
        /* One of the rays that decide whether the others are traced. */
        for (int i = 0; i < min_int(plan->directions.first - start, count); i++)
            if (plan->directions.first < total && enter[i] < INFINITY)
                return 1;
        sum += sum_reach(plan, enter, count, plain);
    }
    return (float)(sum / total * (1 + 0x1p-20));
}

/* Fixed: spherical harmonics are of the world, and the spiral's turn is by the point's id. */
static const float sphere_axis[3] = {0, 1, 0};

/* What is taken is summed, and 1 is exact: so the open is, and errors shrink with what is taken. */
static void gather_sphere(const struct cranny_tracer *tracer, const struct gather_plan *plan,
                          const float position[3], uint32_t id, struct gather_sphere *result)
{
    struct gather_point point = {.id = id};
    memcpy(point.normal, sphere_axis, sizeof point.normal);
    const struct direction_frame frame = direction_frame(&plan->directions, &point);
    const int rays = plan->directions.count;
    double sums[2][9] = {{0}};
    struct ray_block block;
    float values[2][RAY_BLOCK];
    *result = (struct gather_sphere){.rays = (uint32_t)rays};
    for (int start = 0; start < rays; start += RAY_BLOCK) {
        const int count = min_int(RAY_BLOCK, rays - start);
        directions_fill(&plan->directions, &frame, start, count, &block);
        block_values(tracer, plan, position, &block, count, values);
        result->back_faces += block.back_faces;
        for (int i = 0; i < count; i++) {
            const float direction[3] = {block.x[i], block.y[i], block.z[i]};
            float basis[9];
            cranny_sh_basis(direction, basis);
            for (int k = 0; k < 2; k++)
                for (int b = 0; b < 9; b++)
                    sums[k][b] += (double)((1 - values[k][i]) * basis[b]);
        }
    }
    const double sphere = 12.566370614359173, constant = 3.5449077018110318; /* 4π, √(4π) */
    for (int k = 0; k < 2; k++)
        for (int b = 0; b < 9; b++)
            result->harmonics[k][b] = (float)((b == 0 ? constant : 0) - sphere / rays * sums[k][b]);
}

void gather_spheres(const struct cranny_tracer *tracer, const struct gather_plan *plan,
                    const float (*positions)[3], size_t count, uint32_t first_id,
                    struct gather_sphere *results)
{
    for (size_t i = 0; i < count; i++)
        gather_sphere(tracer, plan, positions[i], first_id + (uint32_t)i, &results[i]);
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
