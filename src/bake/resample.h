/* Values of the surfaces around a place. */
#ifndef BAKE_RESAMPLE_H
#define BAKE_RESAMPLE_H

#include "bake/bake.h"

struct cranny_tracer;

struct resampler {
    const struct cranny_bake *bake;
    const struct cranny_scene *scene;
    const struct cranny_tracer *tracer; /* of the surfaces to take values from */
    uint32_t lod_group;                 /* take them from this group only; 0: from all */
};

/* Mean over what rays from the boundary of a sphere toward its centre meet within it, weighted by
 * its distance from the boundary (2013, §2.2.1). `facing` (unit) NULL: from all around; else from
 * its side, and surfaces weigh by how far they face the same way. Only fronts count, and both sides
 * of two-sided materials. `id` turns the rays. For one thread, between gather_thread_begin and
 * _end. False: nothing is there. */
bool resample_sphere(const struct resampler *resampler, const double center[3],
                     const double *facing, double radius, uint32_t id, int rays,
                     double values[CHANNELS]);

/* The same, with the radius doubled up to `doublings` times until something is there: how often it
 * was; −1: nothing is. */
int resample_widening(const struct resampler *resampler, const double center[3],
                      const double *facing, double radius, int doublings, uint32_t id, int rays,
                      double values[CHANNELS]);

#endif
