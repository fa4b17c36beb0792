/* Building one scene mesh from a glTF mesh: vertex runs, then triangles, then normals. */
#ifndef SCENE_MESH_H
#define SCENE_MESH_H

#include "scene/gltf.h"

struct draco_geometry;

/* Where a primitive's vertex values come from. */
struct vertex_source {
    size_t mesh, primitive;
    const json_t *attributes;
    const json_t *draco_ids; /* attribute → id in `draco`; NULL: not compressed */
    struct draco_geometry *draco;
    size_t count; /* vertices */
};

/* Vertices that one primitive, or several with the same accessors, use. */
struct vertex_run {
    struct vertex_source source;
    const json_t *targets;
    int position, normal; /* accessors; normal -1: none */
    int texcoord;         /* TEXCOORD_n to decode, -1: none so far */
    int texcoord_accessor;
    uint32_t first;
    size_t next; /* in the chain of runs with the same hash; NO_INDEX: last */
};

struct primitive {
    size_t index; /* in the glTF mesh */
    const json_t *object;
    size_t run;
    int mode;    /* 4 triangles, 5 strip, 6 fan */
    int indices; /* accessor, -1: none */
    uint32_t material;
    uint64_t triangle_bound;
};

struct builder {
    struct gltf *gltf;
    size_t index; /* of the glTF mesh */
    const json_t *object;
    const struct pose *pose;
    const json_t *weights; /* of the morph targets */
    struct vertex_run *runs;
    size_t run_count;
    size_t *buckets; /* heads of the chains of runs */
    size_t bucket_count;
    struct primitive *primitives;
    size_t primitive_count;
    uint64_t vertex_count, triangle_bound;
    uint32_t triangle_count;
    float (*positions)[3];
    float (*normals)[3];   /* NULL: no run has any */
    float (*texcoords)[2]; /* NULL: no material needs them */
    uint32_t (*triangles)[3];
    uint32_t *triangle_materials;
    struct mesh_part *parts; /* one per primitive */
};

/* source.c */
/* Draco's part of a primitive, decoded; source->draco stays NULL without one. */
enum cranny_status source_open(struct views *views, const json_t *primitive,
                               struct vertex_source *source, struct cranny_error *why);
void source_close(struct vertex_source *source);
/* source->count × components floats of attribute `name`, which must exist. */
enum cranny_status source_floats(struct views *views, const struct vertex_source *source,
                                 const char *name, int components, float *out,
                                 struct cranny_error *why);
/* The accessor's values for a vertex attribute or morph target; its count must be `count`. */
enum cranny_status counted_accessor(struct views *views, const struct place *place, int index,
                                    size_t count, int components, struct accessor *accessor,
                                    struct cranny_error *why);

/* vertices.c: positions, normals and texture coordinates of all runs, posed. */
enum cranny_status vertices_read(struct builder *builder, struct cranny_error *why);
/* After the triangles: refuse broken positions that are used, zero those that are not. */
enum cranny_status positions_check(struct builder *builder, struct cranny_error *why);

/* triangles.c: all primitives as triangle lists, every index checked. */
enum cranny_status triangles_read(struct builder *builder, struct cranny_error *why);

/* normals.c: unit normals everywhere; faces' area-weighted ones where there is none. */
enum cranny_status normals_complete(struct builder *builder, struct cranny_error *why);

#endif
