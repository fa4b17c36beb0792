/* Drawing a G-buffer: one ray per sample, each by itself, so that a sample's bits depend on nothing
 * but its place. */
#include "frame/frame.h"

#include "base/sequence.h"
#include "base/srgb.h"
#include "base/vector.h"
#include "base/watch.h"
#include "trace/gather.h"
#include "trace/sight.h"
#include "trace/tracer.h"

/* Normals lean at least this much (a cosine) towards the viewer. */
#define FACING_MIN 1e-4

struct cranny_frame_params cranny_frame_params_default(void)
{
    return (struct cranny_frame_params){.width = 1280, .height = 720, .samples = 1};
}

static enum cranny_status validate(const struct cranny_frame_params *p, struct cranny_error *why)
{
    if (p->width < 1 || p->height < 1 || p->guard_band < 0 ||
        p->width > CRANNY_SIDE_MAX - 2 * (int64_t)p->guard_band ||
        p->height > CRANNY_SIDE_MAX - 2 * (int64_t)p->guard_band)
        return fail(why, CRANNY_USAGE,
                    "frame: %d x %d pixels and a guard band of %d; at most %d each way, guard band "
                    "included, are possible",
                    p->width, p->height, p->guard_band, CRANNY_SIDE_MAX);
    if (p->samples != 1 && p->samples != 2 && p->samples != 4 && p->samples != 8)
        return fail(why, CRANNY_USAGE, "frame: %d samples a pixel; pass 1, 2, 4 or 8", p->samples);
    if (p->normals != CRANNY_FRAME_FACE && p->normals != CRANNY_FRAME_SMOOTH)
        return fail(why, CRANNY_USAGE, "frame: normals is %d; pass CRANNY_FRAME_FACE or _SMOOTH",
                    p->normals);
    if (p->threads < 0)
        return fail(why, CRANNY_USAGE, "frame: threads is %d; pass 0 or more", p->threads);
    return CRANNY_OK;
}

/* The camera's pose without its scale and shear, which view space must not have. */
static enum cranny_status make_rigid(struct cranny_frame *frame, struct lens *lens,
                                     struct cranny_error *why)
{
    double up[3], right[3];
    cross3(lens->forward, lens->up, right);
    if (!normalise3(right))
        return fail(why, CRANNY_USAGE, "the camera's axes lie in a plane; give another one");
    cross3(right, lens->forward, up);
    for (int i = 0; i < 3; i++) {
        double *row = frame->world_from_view + 4 * i;
        row[0] = right[i];
        row[1] = up[i];
        row[2] = -lens->forward[i];
        row[3] = lens->eye[i];
    }
    frame->near_plane = (float)lens->near_plane;
    const float x = (float)lens->half_width, y = (float)lens->half_height;
    frame->projection = (struct cranny_projection){.kind = lens->parallel ? CRANNY_ORTHOGRAPHIC
                                                                          : CRANNY_PERSPECTIVE,
                                                   .left = -x,
                                                   .right = x,
                                                   .bottom = -y,
                                                   .top = y};
    if (!(x > 0 && y > 0 && isfinite(x) && isfinite(y)))
        return fail(why, CRANNY_USAGE, "the camera's picture is too narrow or too wide");
    return CRANNY_OK;
}

static enum cranny_status allocate(struct cranny_frame *frame, struct cranny_error *why)
{
    const size_t width = (size_t)(frame->width + 2 * frame->guard);
    const size_t height = (size_t)(frame->height + 2 * frame->guard);
    const size_t count = width * height * (size_t)frame->samples;
    frame->depth = alloc_array(count, sizeof *frame->depth);
    frame->normals = alloc_array(count, sizeof *frame->normals);
    frame->hits = alloc_array(count, sizeof *frame->hits);
    frame->colors = alloc_array(count, sizeof *frame->colors);
    return frame->depth && frame->normals && frame->hits && frame->colors
               ? CRANNY_OK
               : fail_memory(why, "frame");
}

/* Towards the viewer, as little changed as that takes. `view`: unit, from the viewer. */
static void face_viewer(const double view[3], double n[3])
{
    const double away = dot3(n, view) + FACING_MIN;
    if (away <= 0)
        return;
    for (int i = 0; i < 3; i++)
        n[i] -= away * view[i];
    normalise3(n);
}

static void view_normal(const struct cranny_frame *frame, const double n[3], float out[3])
{
    const double *m = frame->world_from_view;
    for (int i = 0; i < 3; i++)
        out[i] = (float)(m[i] * n[0] + m[4 + i] * n[1] + m[8 + i] * n[2]);
}

/* What the ray of a sample met goes into the buffers. */
static void keep_surface(struct cranny_frame *frame, size_t index, const struct frame_ray *ray,
                         const double unit[3], const struct cranny_hit *hit, double traced)
{
    struct frame_hit *kept = &frame->hits[index];
    *kept = (struct frame_hit){hit->instance, hit->triangle};
    struct frame_surface surface = frame_surface(frame, ray, kept, traced);
    if (frame->shading == CRANNY_FRAME_SMOOTH && hit->instance != UINT32_MAX) {
        const struct cranny_instance *instance = cranny_scene_instance(frame->scene, hit->instance);
        const float direction[3] = {(float)unit[0], (float)unit[1], (float)unit[2]};
        sight_normal(instance, cranny_scene_mesh(frame->scene, instance->mesh), hit, direction,
                     surface.normal);
    }
    face_viewer(unit, surface.normal);
    view_normal(frame, surface.normal, frame->normals[index]);
    frame->depth[index] = (float)surface.depth;
    frame_color(frame, hit, frame->colors[index]);
}

static void draw_sample(struct cranny_frame *frame, struct frame_pixel pixel)
{
    const size_t index = frame_index(frame, pixel);
    const struct frame_ray ray = frame_ray(frame, pixel);
    double unit[3] = {ray.direction[0], ray.direction[1], ray.direction[2]};
    const double length = sqrt(dot3(unit, unit));
    float origin[3], direction[3], distance;
    for (int i = 0; i < 3; i++) {
        unit[i] /= length;
        direction[i] = (float)unit[i];
        origin[i] = (float)(ray.origin[i] + (double)frame->near_plane * ray.direction[i]);
    }
    const uint32_t place = hash_combine((uint32_t)pixel.x, (uint32_t)pixel.y);
    struct cranny_hit hit;
    trace_ray(frame->tracer, origin, direction, INFINITY,
              hash_combine(place, (uint32_t)pixel.sample), &distance, &hit);
    if (isfinite(distance)) {
        keep_surface(frame, index, &ray, unit, &hit,
                     (double)frame->near_plane + (double)distance / length);
        return;
    }
    frame->depth[index] = INFINITY;
    frame->normals[index][2] = 1;
    frame->hits[index] = (struct frame_hit){FRAME_NOTHING, FRAME_NOTHING};
}

static enum cranny_status draw(struct cranny_frame *frame, const struct cranny_frame_params *params,
                               struct cranny_error *why)
{
    const int guard = frame->guard, columns = frame->width + guard, rows = frame->height + guard;
    struct watch watch;
    watch_begin(&watch, params->hooks, "frame", (size_t)(rows + guard));
    watch_goes_on(&watch);
#pragma omp parallel num_threads(thread_count(params->threads))
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 1)
        for (int y = -guard; y < rows; y++) {
            if (!watch_goes_on(&watch))
                continue;
            for (int sample = 0; sample < frame->samples; sample++)
                for (int x = -guard; x < columns; x++)
                    draw_sample(frame, (struct frame_pixel){x, y, sample});
            watch_advance(&watch, 1);
        }
        gather_thread_end(saved);
    }
    watch.next = 0;
    return watch_goes_on(&watch) ? CRANNY_OK : fail(why, CRANNY_CANCELLED, "frame: cancelled");
}

enum cranny_status cranny_frame_create(const struct cranny_scene *scene,
                                       const struct cranny_tracer *tracer,
                                       const struct cranny_camera *camera,
                                       const struct cranny_frame_params *params,
                                       struct cranny_frame **frame, struct cranny_error *why)
{
    const struct cranny_frame_params defaults = cranny_frame_params_default();
    params = params ? params : &defaults;
    *frame = NULL;
    if (!scene || !tracer || !camera)
        return fail(why, CRANNY_USAGE, "frame: a scene, its tracer and a camera are needed");
    enum cranny_status status = validate(params, why);
    struct lens lens;
    if (status == CRANNY_OK)
        status = lens_create(camera, (double)params->width / params->height, &lens, why);
    if (status != CRANNY_OK)
        return status;
    struct cranny_frame *made = alloc_array(1, sizeof *made);
    if (!made)
        return fail_memory(why, "frame");
    *made = (struct cranny_frame){.scene = scene,
                                  .tracer = tracer,
                                  .width = params->width,
                                  .height = params->height,
                                  .guard = params->guard_band,
                                  .samples = params->samples,
                                  .shading = (enum cranny_frame_normals)params->normals};
    for (int i = 0; i < 256; i++)
        made->decode[i] = srgb_decode((uint8_t)i);
    status = make_rigid(made, &lens, why);
    if (status == CRANNY_OK)
        status = allocate(made, why);
    if (status == CRANNY_OK)
        status = draw(made, params, why);
    if (status != CRANNY_OK)
        cranny_frame_destroy(&made);
    *frame = made;
    return status;
}

void cranny_frame_destroy(struct cranny_frame **frame)
{
    if (!frame || !*frame)
        return;
    free((*frame)->depth);
    free((*frame)->normals);
    free((*frame)->hits);
    free((*frame)->colors);
    free(*frame);
    *frame = NULL;
}

struct cranny_gbuffer cranny_frame_gbuffer(const struct cranny_frame *frame)
{
    const int guard = frame->guard;
    return (struct cranny_gbuffer){
        .width = frame->width + 2 * guard,
        .height = frame->height + 2 * guard,
        .depth = frame->depth,
        .normal = frame->normals,
        .normal_format = CRANNY_NORMAL_FLOAT3,
        .projection = frame->projection,
        .viewport = {guard, guard, frame->width, frame->height},
        .guard_band = guard,
        .sample_count = frame->samples > 1 ? frame->samples : 0,
        .sample_positions = frame->samples > 1 ? cranny_sample_positions(frame->samples) : NULL,
        .world_from_view = frame->world_from_view};
}
