#include "world.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int world_count(const struct world *world, double at_scale_1, int minimum)
{
    double count = at_scale_1 * sqrt(world->scale);
    return count < minimum ? minimum : (int)lround(count);
}

int world_detail(const struct world *world, double at_scale_1, int minimum)
{
    double count = at_scale_1 * sqrt(sqrt(world->scale));
    return count < minimum ? minimum : (int)lround(count);
}

static bool make_room(void **items, size_t *capacity, size_t count, size_t size)
{
    if (count < *capacity)
        return true;
    size_t wanted = *capacity ? *capacity * 2 : 64;
    void *grown = realloc(*items, wanted * size);
    if (!grown)
        return false;
    *items = grown;
    *capacity = wanted;
    return true;
}

int world_add_mesh(struct world *world, struct mesh *mesh)
{
    if (mesh->failed || !make_room((void **)&world->meshes, &world->mesh_capacity,
                                   world->mesh_count, sizeof *world->meshes)) {
        mesh_free(mesh);
        world->failed = true;
        return -1;
    }
    world->meshes[world->mesh_count] = *mesh;
    return (int)world->mesh_count++;
}

int world_add_node(struct world *world, const char *format, int number, int mesh, int parent,
                   struct vec position, double angle)
{
    if (!make_room((void **)&world->nodes, &world->node_capacity, world->node_count,
                   sizeof *world->nodes)) {
        world->failed = true;
        return -1;
    }
    struct node *node = &world->nodes[world->node_count];
    *node = (struct node){.mesh = mesh, .parent = parent, .lod = -1, .scale = {1, 1, 1}};
    snprintf(node->name, sizeof node->name, format, number);
    node->translation[0] = position.x;
    node->translation[1] = position.y;
    node->translation[2] = position.z;
    node->rotation[1] = sin(angle / 2);
    node->rotation[3] = cos(angle / 2);
    if (mesh >= 0 && !world->meshes[mesh].name[0])
        memcpy(world->meshes[mesh].name, node->name, sizeof node->name);
    return (int)world->node_count++;
}

static void add_views(struct world *world)
{
    const struct terrain *t = &world->terrain;
    double middle = terrain_height(t, 0, 0);
    world->views[0] = (struct view){"Overview", vec(33, middle + 26, 47), vec(-1, middle, -3), 40};
    world->views[1] = (struct view){"Interior", site_point(t, 0, vec(3.4, 2.0, 4.9)),
                                    site_point(t, 0, vec(-1.6, 1.6, -2.2)), 68};
    world->views[2] =
        (struct view){"Well", vec(9.5, middle + 2.3, 9.5), vec(-4, middle + 1.5, -8), 52};
}

bool world_build(struct world *world, double scale, uint32_t seed)
{
    *world = (struct world){.scale = 0.65 * scale, .seed = seed};
    world->edge = 0.39 / sqrt(world->scale);
    terrain_create(&world->terrain, seed);
    terrain_build(world);
    houses_build(world);
    yard_build(world);
    plants_build(world);
    add_views(world);
    return !world->failed;
}

void world_free(struct world *world)
{
    for (size_t i = 0; i < world->mesh_count; i++)
        mesh_free(&world->meshes[i]);
    free(world->meshes);
    free(world->nodes);
    *world = (struct world){0};
}

struct totals world_totals(const struct world *world)
{
    struct totals totals = {0};
    bool *shown = calloc(world->mesh_count + 1, sizeof *shown);
    if (!shown)
        return totals;
    for (size_t i = 0; i < world->node_count; i++) {
        const struct node *node = &world->nodes[i];
        if (node->mesh < 0)
            continue;
        const struct mesh *mesh = &world->meshes[node->mesh];
        if (node->hidden) {
            totals.lod_triangles += mesh_triangle_count(mesh);
            continue;
        }
        totals.triangles += mesh_triangle_count(mesh);
        totals.vertices += mesh_vertex_count(mesh);
        totals.unique_triangles += shown[node->mesh] ? 0 : mesh_triangle_count(mesh);
        totals.unique_vertices += shown[node->mesh] ? 0 : mesh_vertex_count(mesh);
        shown[node->mesh] = true;
    }
    free(shown);
    return totals;
}
