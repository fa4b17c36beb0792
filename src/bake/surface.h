/* A mesh as the fit sees it: welded, with neighbours, measured in world metres. */
#ifndef BAKE_SURFACE_H
#define BAKE_SURFACE_H

#include "base/base.h"

#include <cranny/scene.h>

#define SURFACE_NONE UINT32_MAX

struct surface {
    uint32_t vertex_count, triangle_count, unknown_count;
    uint32_t *unknown_of;     /* per vertex; SURFACE_NONE: no triangle uses it */
    uint32_t (*triangles)[3]; /* unknowns; degenerate ones are all SURFACE_NONE */
    uint32_t (*across)[3];    /* beyond edge c → c+1: 3 × triangle + corner of the apex there;
                                 SURFACE_NONE: boundary, crowd, or the same winding */
    uint32_t *incident_start; /* unknown_count + 1 */
    uint32_t *incident;       /* 3 × triangle + corner */
    double (*position)[3];    /* unknown_count; metres, up to a translation */
};

/* Vertices with bitwise equal position and normal become one unknown (−0 counts as 0). `metric`:
 * rows of the 3×3 matrix that takes edges to the world. */
enum cranny_status surface_create(const struct cranny_mesh *mesh, const double metric[9],
                                  int threads, struct surface *surface, struct cranny_error *why);
void surface_free(struct surface *surface);
uint64_t surface_bytes(const struct surface *surface);

#endif
