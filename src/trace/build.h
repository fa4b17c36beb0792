/* Inside the trace layer: a tracer under construction. */
#ifndef TRACE_BUILD_H
#define TRACE_BUILD_H

#include "trace/tracer.h"

#include <pthread.h>

struct build {
    struct cranny_tracer *tracer;
    const struct cranny_tracer_params *params;
    const struct cranny_hooks *hooks;
    int threads;
    pthread_t caller;
    double done, weight, total, reported; /* triangles: before this commit, in it, in all */
    atomic_bool cancelled;
    atomic_flag failed;
    enum RTCError error;
    char text[256];
};

/* What Embree's callbacks have noted so far. */
enum cranny_status build_status(struct build *build, struct cranny_error *why);

/* A mesh's triangles into an Embree scene, as geometries first_id + class; `world_from_object` NULL
 * leaves them in the mesh's own space. */
void build_add_mesh(struct build *build, RTCScene scene, uint32_t mesh_index,
                    const double *world_from_object, bool mirrored, uint32_t first_id);

/* The boxes of all instances that are fog. Nothing when there are none. (fog.c) */
enum cranny_status build_fog(struct build *build, struct cranny_error *why);

#endif
