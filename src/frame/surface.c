/* From samples to surfaces, in double: a float's distance along the ray would put points off their
 * faces by more than rays are lifted above them. */
#include "frame/frame.h"

#include "base/vector.h"
#include "trace/sight.h"
#include "trace/tracer.h"

struct frame_ray frame_ray(const struct cranny_frame *frame, struct frame_pixel pixel)
{
    const struct cranny_projection *p = &frame->projection;
    const float *place = cranny_sample_positions(frame->samples)[pixel.sample];
    const double across = (pixel.x + (double)place[0]) / frame->width;
    const double down = (pixel.y + (double)place[1]) / frame->height;
    const double x = p->left + ((double)p->right - p->left) * across;
    const double y = p->top - ((double)p->top - p->bottom) * down;
    const bool parallel = p->kind == CRANNY_ORTHOGRAPHIC;
    struct frame_ray ray;
    for (int i = 0; i < 3; i++) {
        const double *row = frame->world_from_view + 4 * i;
        const double shift = x * row[0] + y * row[1];
        ray.origin[i] = row[3] + (parallel ? shift : 0);
        ray.direction[i] = -row[2] + (parallel ? 0 : shift);
    }
    return ray;
}

static float longest_edge(const double corners[3][3])
{
    double longest = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = corners[k], *b = corners[(k + 1) % 3];
        longest = fmax(longest, hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]));
    }
    return (float)longest;
}

/* Where the ray meets the plane through `point`; `fallback` when that is nowhere near it. */
static double plane_depth(const struct frame_ray *ray, const double point[3],
                          const double normal[3], double fallback)
{
    double offset[3];
    for (int i = 0; i < 3; i++)
        offset[i] = point[i] - ray->origin[i];
    const double depth = dot3(normal, offset) / dot3(normal, ray->direction);
    return fabs(depth - fallback) <= 1e-3 * fabs(fallback) ? depth : fallback;
}

static struct frame_surface ground_surface(const struct cranny_frame *frame,
                                           const struct frame_ray *ray)
{
    const double height = frame->tracer->ground_height;
    return (struct frame_surface){.normal = {0, 1, 0},
                                  .depth = (height - ray->origin[1]) / ray->direction[1]};
}

struct frame_surface frame_surface(const struct cranny_frame *frame, const struct frame_ray *ray,
                                   const struct frame_hit *hit, double traced)
{
    if (hit->instance == FRAME_NOTHING)
        return ground_surface(frame, ray);
    const struct cranny_instance *instance = cranny_scene_instance(frame->scene, hit->instance);
    const struct cranny_mesh *mesh = cranny_scene_mesh(frame->scene, instance->mesh);
    struct frame_surface surface;
    double corners[3][3];
    triangle_corners(instance, mesh, hit->triangle, corners);
    const bool flat = triangle_normal((const double(*)[3])corners, surface.normal);
    surface.depth = flat ? plane_depth(ray, corners[0], surface.normal, traced) : traced;
    surface.extent = longest_edge((const double(*)[3])corners);
    if (dot3(surface.normal, ray->direction) > 0)
        for (int i = 0; i < 3; i++)
            surface.normal[i] = -surface.normal[i];
    return surface;
}

void frame_to_world(const struct cranny_frame *frame, const float view[3], double world[3])
{
    for (int i = 0; i < 3; i++) {
        const double *row = frame->world_from_view + 4 * i;
        world[i] = row[0] * view[0] + row[1] * view[1] + row[2] * view[2];
    }
}
