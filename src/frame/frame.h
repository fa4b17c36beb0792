/* Inside the frame layer: what a frame holds, and the surface behind each of its samples.
 *
 * Samples lie in planes of (height + 2 guard) rows of (width + 2 guard). Pixels are counted from
 * the viewport's corner, so that those of the guard band may be negative: whatever depends on a
 * pixel's place is then the same with and without a guard band. */
#ifndef FRAME_FRAME_H
#define FRAME_FRAME_H

#include "base/base.h"

#include <cranny/frame.h>

#define FRAME_NOTHING UINT32_MAX

struct frame_hit {
    uint32_t
        instance; /* FRAME_NOTHING: the tracer's ground plane, or sky where depth is infinite */
    uint32_t triangle;
};

struct cranny_frame {
    const struct cranny_scene *scene;
    const struct cranny_tracer *tracer;
    int width, height, guard, samples;
    enum cranny_frame_normals shading;
    double world_from_view[12]; /* rigid */
    float near_plane;
    struct cranny_projection projection;
    float *depth;
    float (*normals)[3];
    struct frame_hit *hits;
    uint16_t (*colors)[3]; /* linear base colour, 65535 is 1 */
    float decode[256];     /* sRGB bytes to linear */
};

/* A pixel's sample: x and y from the viewport's corner. */
struct frame_pixel {
    int x, y, sample;
};

static inline size_t frame_index(const struct cranny_frame *frame, struct frame_pixel pixel)
{
    const size_t width = (size_t)(frame->width + 2 * frame->guard);
    const size_t height = (size_t)(frame->height + 2 * frame->guard);
    return ((size_t)pixel.sample * height + (size_t)(pixel.y + frame->guard)) * width +
           (size_t)(pixel.x + frame->guard);
}

/* The ray through a sample's place: depth d is at origin + d × direction, which is not unit. */
struct frame_ray {
    double origin[3], direction[3];
};
struct frame_ray frame_ray(const struct cranny_frame *frame, struct frame_pixel pixel);

/* The face that a ray meets, in world space. */
struct frame_surface {
    double normal[3]; /* unit, of the face, on the viewer's side */
    double depth;
    float extent; /* metres: the face's longest edge; 0 for the ground */
};

/* Exact in double: where the ray meets the face's plane. `traced` is the depth in floats, to fall
 * back on when the face is too thin to have a plane, or seen along it. */
struct frame_surface frame_surface(const struct cranny_frame *frame, const struct frame_ray *ray,
                                   const struct frame_hit *hit, double traced);

/* The base colour at a hit: the material's factor times its texture. White for the ground. */
void frame_color(const struct cranny_frame *frame, const struct cranny_hit *hit, uint16_t color[3]);

/* A view-space vector in the world. */
void frame_to_world(const struct cranny_frame *frame, const float view[3], double world[3]);

#endif
