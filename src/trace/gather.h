/* Gathering obscurance, for one thread: the kernel that cranny_gather and the baker share. */
#ifndef TRACE_GATHER_H
#define TRACE_GATHER_H

#include "base/base.h"

#include <cranny/trace.h>

/* What stays the same for all points: the direction set, the kernel's constants. Immutable. */
struct gather_plan;

/* `adaptive`: trace the first quarter of a point's rays and stop when none of them is dimmed by a
 * hit. Parameters are checked by the caller. */
enum cranny_status gather_plan_create(const struct cranny_gather_params *params, bool adaptive,
                                      struct gather_plan **plan, struct cranny_error *why);

/* For gather_spheres: directions all round. */
enum cranny_status gather_plan_create_sphere(const struct cranny_gather_params *params,
                                             struct gather_plan **plan, struct cranny_error *why);

/* Rays only as long as the kernel can tell apart: visibilities stay the same bits, faster, but back
 * faces beyond are not counted. Nothing for the exponential kernel, which has no end. */
void gather_plan_shorten(struct gather_plan *plan);

void gather_plan_destroy(struct gather_plan **plan);

/* Of enum cranny_kernel, for parameter tables. */
extern const char *const gather_kernel_names[4];

struct gather_point {
    float position[3];
    float normal[3];      /* unit, shading */
    float face_normal[3]; /* unit, geometric: rays keep to its side, the origin moves along it */
    float extent;         /* metres: longest edge of the face, for the offset; 0 when unknown */
    uint32_t id;          /* decides the rotation of the directions; points near each other should
                             have consecutive ids, so that their rays complement one another */
};

struct gather_result {
    float visibility[2];
    uint32_t rays, back_faces; /* traced, and of these on back faces of single-sided materials */
};

/* Trace `count` points from the calling thread. */
void gather_points(const struct cranny_tracer *tracer, const struct gather_plan *plan,
                   const struct gather_point *points, size_t count, struct gather_result *results);

/* How much a point's visibilities can change at most when anything changes within the boxes (min
 * xyz, max xyz): its rays that enter one count with 1 − ρ where they do, the larger of the two, and
 * share of all rays. 0: none enters one, and nothing changes. `plain`: rays are dimmed as
 * CRANNY_DIMMING_PLAIN has it, at any distance. Of back faces, only 0 says anything. */
float gather_reach(const struct gather_plan *plan, const struct gather_point *point,
                   const float (*boxes)[6], size_t box_count, bool plain);

struct gather_sphere {
    float harmonics[2][9]; /* as of cranny_gather_sphere */
    uint32_t rays, back_faces;
};

/* The same for points in the open, whose ids count on from `first_id`; with a plan of
 * gather_plan_create_sphere. */
void gather_spheres(const struct cranny_tracer *tracer, const struct gather_plan *plan,
                    const float (*positions)[3], size_t count, uint32_t first_id,
                    struct gather_sphere *results);

/* Flush-to-zero for the calling thread while it traces (Embree asks for it in every thread). */
unsigned gather_thread_begin(void);
void gather_thread_end(unsigned saved);

#endif
