/* What is odd about a mesh's faces, for the doctor. */
#ifndef SCENE_TOPOLOGY_H
#define SCENE_TOPOLOGY_H

#include "scene/scene.h"

struct topology {
    uint64_t degenerate;    /* triangles without area */
    uint64_t duplicates;    /* triangles at the place of another one, wound the same way */
    uint64_t back_to_back;  /* places where triangles of both directions lie */
    uint64_t flipped_edges; /* edges that two faces run through in the same direction */
    uint64_t unused_vertices;
    bool closed;   /* every edge joins exactly two faces of opposite direction */
    double volume; /* signed, object space; positive when faces look outward */
};

/* Vertices at the same place count as one. */
enum cranny_status topology_measure(const struct cranny_mesh *mesh, struct topology *topology,
                                    struct cranny_error *why);

#endif
