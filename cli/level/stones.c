/* Rubble: blocks half sunk into ground, kerbs and each other. Soup, as levels are made of. */
#include "world.h"

#include <stdio.h>

#define QUARTERS 4

/* Along the kerbs, at the feet of the houses, scattered over the slopes. */
static bool stone_lies(const struct world *world, double x, double z, double luck)
{
    double path = terrain_path(&world->terrain, x, z);
    double clear = terrain_clearance(&world->terrain, x, z);
    if (clear < 0.25 || path > 0.75)
        return false;
    return path > 0.15 || clear < 0.9 || luck < 0.04;
}

static void stone(const struct world *world, struct builder *b, double x, double z, uint32_t seed,
                  uint32_t id)
{
    double size = 0.05 + 0.13 * chance(seed, id, 3) * chance(seed, id, 4);
    struct vec up =
        unit(vec(0.5 * (chance(seed, id, 5) - 0.5), 1, 0.5 * (chance(seed, id, 6) - 0.5)));
    double turn = 2 * LEVEL_PI * chance(seed, id, 7);
    struct vec side = unit(cross(up, vec(cos(turn), 0, sin(turn)))), front = cross(side, up);
    struct vec at = vec(x, terrain_height(&world->terrain, x, z) + 0.2 * size, z);
    block(b, MATERIAL_STONE, at, scale(side, size * (0.8 + 0.6 * chance(seed, id, 8))),
          scale(up, size * 0.7), scale(front, size));
}

/* The stones of one quarter of the village; the simple level keeps one of `every`. */
static struct mesh stones_mesh(const struct world *world, int quarter, uint32_t every)
{
    struct mesh mesh = {0};
    snprintf(mesh.name, sizeof mesh.name, "Stones_%c", 'A' + quarter);
    struct builder b = builder_at(&mesh, 10);
    const uint32_t seed = world->seed + 4000 + (uint32_t)quarter;
    const int wanted = world_crowd(world, 466, 20);
    int count = 0;
    for (uint32_t i = 0; i < 60 * (uint32_t)wanted && count < wanted && !mesh.failed; i++) {
        double x = (quarter % 2 ? 44 : -44) * chance(seed, i, 0);
        double z = (quarter / 2 ? 44 : -44) * chance(seed, i, 1);
        if (!stone_lies(world, x, z, chance(seed, i, 2)))
            continue;
        if (count++ % (int)every == 0)
            stone(world, &b, x, z, seed, i);
    }
    return mesh;
}

void stones_build(struct world *world)
{
    for (int quarter = 0; quarter < QUARTERS; quarter++) {
        struct mesh mesh = stones_mesh(world, quarter, 1);
        const int index = world_add_mesh(world, &mesh);
        const int node = world_add_node(world, "Stones_%d", quarter, index, -1, vec(0, 0, 0), 0);
        mesh = stones_mesh(world, quarter, 3);
        world_add_level(world, node, &mesh);
    }
}
