/* Writing baked values into a copy of a glTF document: what the outputs share. */
#ifndef SCENE_WRITE_H
#define SCENE_WRITE_H

#include "scene/document.h"
#include "scene/scene.h"

/* A hash map from pairs of numbers to a number. */
struct pair_entry {
    uint64_t a, b;
    size_t value;
    bool used;
};
struct pair_map {
    struct pair_entry *entries;
    size_t count, capacity; /* capacity: a power of two */
};

/* The entry for (a, b), made with value SIZE_MAX when there was none. NULL: out of memory. */
struct pair_entry *pair_map_at(struct pair_map *map, uint64_t a, uint64_t b);
void pair_map_free(struct pair_map *map);

/* Instances that show the same mesh with the same values: one glTF mesh in the output. */
struct write_group {
    uint32_t mesh; /* of the scene */
    const float *visibility, *raw_long, *raw_short;
    json_t *primitives; /* of its glTF mesh in the output; borrowed */
    size_t gltf_mesh;   /* in the output */
    uint32_t *part_of;  /* per primitive: its part + 1; 0: it gets no values */
    size_t primitive_count;
};

struct write {
    const struct cranny_scene *scene;
    const struct scene_values *values;
    const struct cranny_save_params *params;
    struct document *document;
    struct document_edit edit;
    struct write_group *groups;
    size_t group_count, group_capacity;
    struct pair_map accessors; /* (group, first vertex) to an appended accessor */
    bool said_draco;
};

/* plan.c: find the groups, and give each its glTF mesh. */
enum cranny_status write_plan(struct write *write, struct cranny_error *why);

/* Append bytes with an accessor on them, or (data NULL) an accessor of zeros. */
struct write_accessor {
    const void *data;
    size_t size;
    int stride; /* bytes; 0: closely packed */
    int component_type;
    bool normalized;
    size_t count;
    const char *type; /* "VEC2" */
};
enum cranny_status write_accessor(struct write *write, const struct write_accessor *what,
                                  size_t *index, struct cranny_error *why);

/* Point attribute `name` of a primitive to an accessor. */
enum cranny_status write_attribute(struct write *write, json_t *primitive, const char *name,
                                   size_t accessor, struct cranny_error *why);

/* A list of the tree, made when it is not there. NULL: out of memory. */
json_t *write_list(struct write *write, const char *name);
/* Append a new object (taken over) to a list. */
enum cranny_status write_append(struct write *write, const char *list, json_t *object,
                                size_t *index, struct cranny_error *why);

/* How many values the primitives of `part` get: its vertices, or what POSITION declares when that
 * is more, as for Draco streams with fewer points than their accessors say. */
size_t write_count(const struct write *write, const json_t *primitive,
                   const struct mesh_part *part);

/* Value i of a part; those that are only declared are open. */
static inline float part_value(const float *values, const struct mesh_part *part, size_t i)
{
    return i < part->vertex_count ? values[part->vertex_first + i] : 1;
}

/* A visibility as a normalised 16-bit integer; anything that is no number counts as open. */
static inline uint16_t visibility_u16(float value)
{
    return (uint16_t)(value >= 0 && value < 1 ? value * 65535.0f + 0.5f : value < 0 ? 0 : 65535);
}

/* export.c: the scene again, with a glTF document made of its arrays; *stand_in borrows them. */
enum cranny_status export_begin(const struct cranny_scene *scene, struct cranny_scene *stand_in,
                                struct cranny_error *why);
void export_end(struct cranny_scene *stand_in);

/* write_linear.c: the instances' own numbers, of whatever output. */
enum cranny_status write_factors(struct write *write, struct cranny_error *why);

/* The outputs. */
enum cranny_status write_occlusion(struct write *write, struct cranny_error *why);
enum cranny_status write_color(struct write *write, struct cranny_error *why);
enum cranny_status write_scalar(struct write *write, struct cranny_error *why);

#endif
