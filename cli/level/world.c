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

int world_crowd(const struct world *world, double at_scale_1, int minimum)
{
    double count = at_scale_1 * world->scale;
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

void world_add_level(struct world *world, int node, struct mesh *mesh)
{
    int level = 1, last = node;
    while (last >= 0 && world->nodes[last].lod >= 0) {
        last = world->nodes[last].lod;
        level++;
    }
    char name[48];
    snprintf(name, sizeof name, "%.30s_LOD%d", node < 0 ? "" : world->nodes[node].name, level);
    memcpy(mesh->name, name, sizeof name);
    int index = world_add_mesh(world, mesh);
    int lod = world_add_node(world, "%d", level, index, -1, vec(0, 0, 0), 0);
    if (lod < 0 || node < 0)
        return;
    struct node *simple = &world->nodes[lod];
    const struct node *full = &world->nodes[node];
    memcpy(simple->name, name, sizeof name);
    memcpy(simple->translation, full->translation, sizeof full->translation);
    memcpy(simple->rotation, full->rotation, sizeof full->rotation);
    memcpy(simple->scale, full->scale, sizeof full->scale);
    simple->hidden = true;
    world->nodes[last].lod = lod;
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
    stones_build(world);
    plants_build(world);
    add_views(world);
    return !world->failed;
}

void world_free(struct world *world)
{
    for (size_t i = 0; i < world->mesh_count; i++)
        mesh_free(&world->meshes[i]);
    for (size_t i = 0; i < world->node_count; i++) {
        free(world->nodes[i].scatter.translations);
        free(world->nodes[i].scatter.rotations);
        free(world->nodes[i].scatter.scales);
    }
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
        const uint64_t copies = node->scatter.count ? node->scatter.count : 1;
        const uint64_t triangles = copies * mesh_triangle_count(mesh);
        const uint64_t vertices = copies * mesh_vertex_count(mesh);
        totals.unique_triangles += shown[node->mesh] ? 0 : mesh_triangle_count(mesh);
        totals.unique_vertices += shown[node->mesh] ? 0 : mesh_vertex_count(mesh);
        shown[node->mesh] = true;
        totals.lod_triangles += node->hidden ? triangles : 0;
        totals.lod_vertices += node->hidden ? vertices : 0;
        totals.triangles += node->hidden ? 0 : triangles;
        totals.vertices += node->hidden ? 0 : vertices;
        totals.solid_triangles += node->hidden || node->role ? 0 : triangles;
        totals.solid_vertices += node->hidden || node->role ? 0 : vertices;
    }
    free(shown);
    return totals;
}
