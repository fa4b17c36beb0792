/* What a camera sees: rays through its picture, normals on the viewer's side, a sky. */
#ifndef TRACE_SIGHT_H
#define TRACE_SIGHT_H

#include "base/base.h"

#include <cranny/trace.h>

/* World axes of a camera, with the extent of its picture at distance 1 (or anywhere: parallel). */
struct lens {
    double eye[3], right[3], up[3], forward[3];
    double half_width, half_height, near_plane;
    bool parallel;
};

/* `aspect`: width over height. CRANNY_USAGE when the camera's numbers make no picture. */
enum cranny_status lens_create(const struct cranny_camera *view, double aspect, struct lens *lens,
                               struct cranny_error *why);

/* The ray through (x, y), [-1, 1] in the picture, y upwards, from the near plane on. */
void lens_ray(const struct lens *lens, double x, double y, float origin[3], float direction[3]);

/* World corners of a triangle, in double. */
void triangle_corners(const struct cranny_instance *instance, const struct cranny_mesh *mesh,
                      uint32_t triangle, double corners[3][3]);

/* The face's unit normal in world space by its winding, y where it has none; whether it has one. */
bool triangle_normal(const double corners[3][3], double n[3]);

/* The shading normal at a hit, in world space and on the viewer's side; the face's own where the
 * mesh has no normals. */
void sight_normal(const struct cranny_instance *instance, const struct cranny_mesh *mesh,
                  const struct cranny_hit *hit, const float direction[3], double n[3]);

/* Linear colour of the sky, white-blue. */
void sight_sky(const float direction[3], float color[3]);

#endif
