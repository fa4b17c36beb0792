#include "world.h"

static int finish(struct world *world, struct mesh *mesh)
{
    return world_add_mesh(world, mesh);
}

static void legs(struct builder *b, double x, double z, double height, double thick)
{
    for (int i = -1; i <= 1; i += 2)
        for (int j = -1; j <= 1; j += 2)
            box(b, MATERIAL_WOOD_DARK, vec(i * x, height / 2, j * z),
                vec(thick, height / 2, thick));
}

static int table(struct world *world)
{
    struct mesh mesh = {.name = "Table"};
    struct builder b = builder_at(&mesh, world->edge * 0.7);
    for (int i = -1; i <= 1; i++)
        box(&b, MATERIAL_WOOD, vec(i * 0.285, 0.755, 0), vec(0.14, 0.025, 1.05));
    legs(&b, 0.34, 0.85, 0.74, 0.045);
    for (int i = -1; i <= 1; i += 2)
        box(&b, MATERIAL_WOOD_DARK, vec(0, 0.68, i * 0.85), vec(0.36, 0.05, 0.03));
    box(&b, MATERIAL_WOOD_DARK, vec(0, 0.25, 0), vec(0.03, 0.04, 0.85));
    return finish(world, &mesh);
}

static int bench(struct world *world)
{
    struct mesh mesh = {.name = "Bench"};
    struct builder b = builder_at(&mesh, world->edge * 0.7);
    box(&b, MATERIAL_WOOD, vec(0, 0.44, 0), vec(0.17, 0.025, 0.9));
    legs(&b, 0.11, 0.72, 0.43, 0.035);
    return finish(world, &mesh);
}

static int shelf(struct world *world)
{
    struct mesh mesh = {.name = "Shelf"};
    struct builder b = builder_at(&mesh, world->edge * 0.7);
    for (int i = -1; i <= 1; i += 2)
        box(&b, MATERIAL_WOOD, vec(i * 0.78, 1, 0), vec(0.025, 1, 0.2));
    for (int i = 0; i < 5; i++)
        box(&b, MATERIAL_WOOD, vec(0, 0.1 + 0.46 * i, 0), vec(0.77, 0.02, 0.19));
    box(&b, MATERIAL_WOOD_DARK, vec(0, 1, -0.2), vec(0.78, 0.98, 0.012));
    for (uint32_t i = 0; i < 11 && world->scale >= 0.08; i++) {
        double x = -0.6 + 0.4 * (i % 4) + 0.1 * chance(3, i, 0), r = 0.07 + 0.05 * chance(3, i, 1);
        double profile[][2] = {{r * 0.7, 0},    {r, 0.09},       {r, 0.15},
                               {r * 0.5, 0.22}, {r * 0.6, 0.25}, {0, 0.25}};
        lathe(&b, MATERIAL_CLAY, vec(x, 0.12 + 0.46 * (i / 4), 0.02), profile, 6, 8);
    }
    return finish(world, &mesh);
}

static int crate(struct world *world)
{
    struct mesh mesh = {.name = "Crate"};
    struct builder b = builder_at(&mesh, world->edge * 0.7);
    box(&b, MATERIAL_WOOD, vec(0, 0.35, 0), vec(0.31, 0.33, 0.31));
    for (int i = -1; i <= 1; i += 2) {
        for (int j = -1; j <= 1; j += 2) {
            box(&b, MATERIAL_WOOD_DARK, vec(i * 0.3, 0.35, j * 0.3), vec(0.05, 0.35, 0.05));
            box(&b, MATERIAL_WOOD_DARK, vec(0, 0.35 + i * 0.3, j * 0.31), vec(0.27, 0.05, 0.035));
            box(&b, MATERIAL_WOOD_DARK, vec(j * 0.31, 0.35 + i * 0.3, 0), vec(0.035, 0.05, 0.27));
        }
    }
    return finish(world, &mesh);
}

static int barrel(struct world *world)
{
    struct mesh mesh = {.name = "Barrel"};
    struct builder b = builder_at(&mesh, world->edge * 0.7);
    int sides = world_count(world, 18, 8);
    lathe(&b, MATERIAL_WOOD, vec(0, 0, 0),
          (const double[][2]){{0, 0.02},
                              {0.27, 0},
                              {0.33, 0.25},
                              {0.35, 0.45},
                              {0.33, 0.65},
                              {0.27, 0.9},
                              {0.24, 0.9},
                              {0.24, 0.85},
                              {0, 0.85}},
          9, sides);
    static const double hoops[3][2] = {{0.16, 0.315}, {0.45, 0.355}, {0.74, 0.315}};
    for (int i = 0; i < 3; i++) {
        double y = hoops[i][0], r = hoops[i][1];
        double hoop[][2] = {{r - 0.06, y - 0.035},
                            {r + 0.01, y - 0.03},
                            {r + 0.01, y + 0.03},
                            {r - 0.06, y + 0.035}};
        lathe(&b, MATERIAL_IRON, vec(0, 0, 0), (const double(*)[2])hoop, 4, sides);
    }
    return finish(world, &mesh);
}

static int jar(struct world *world)
{
    struct mesh mesh = {.name = "Jar"};
    struct builder b = builder_at(&mesh, world->edge * 0.5);
    lathe(&b, MATERIAL_CLAY, vec(0, 0, 0),
          (const double[][2]){{0, 0.004},
                              {0.06, 0},
                              {0.1, 0.09},
                              {0.095, 0.16},
                              {0.05, 0.23},
                              {0.065, 0.27},
                              {0.05, 0.27},
                              {0.04, 0.23},
                              {0.08, 0.15},
                              {0.05, 0.02},
                              {0, 0.02}},
          11, world_count(world, 12, 6));
    return finish(world, &mesh);
}

static int bed(struct world *world)
{
    struct mesh mesh = {.name = "Bed"};
    struct builder b = builder_at(&mesh, world->edge * 0.7);
    box(&b, MATERIAL_WOOD_DARK, vec(0, 0.3, 0), vec(0.5, 0.08, 1.0));
    legs(&b, 0.46, 0.96, 0.6, 0.045);
    box(&b, MATERIAL_WOOD, vec(0, 0.6, -0.98), vec(0.5, 0.35, 0.03));
    box(&b, MATERIAL_PLASTER, vec(0, 0.44, 0.03), vec(0.46, 0.08, 0.92));
    blob(&b, MATERIAL_PLASTER_WARM, vec(0, 0.54, -0.68), vec(0.34, 0.09, 0.2), 0.05, 5,
         world_count(world, 12, 6));
    return finish(world, &mesh);
}

/* Hangs from its origin. */
static int lamp(struct world *world)
{
    struct mesh mesh = {.name = "Lamp"};
    struct builder b = builder_at(&mesh, world->edge);
    tube(&b, MATERIAL_IRON, vec(0, -0.5, 0), vec(0, 0.1, 0), 0.012, 0.012, 6, 1);
    lathe(&b, MATERIAL_IRON, vec(0, -0.62, 0),
          (const double[][2]){{0.02, 0.11}, {0.2, 0.0}, {0.22, 0.0}, {0.03, 0.13}}, 4,
          world_count(world, 14, 6));
    blob(&b, MATERIAL_PLASTER, vec(0, -0.6, 0), vec(0.07, 0.08, 0.07), 0, 1,
         world_count(world, 10, 6));
    return finish(world, &mesh);
}

struct furniture furniture_build(struct world *world)
{
    return (struct furniture){.table = table(world),
                              .bench = bench(world),
                              .shelf = shelf(world),
                              .crate = crate(world),
                              .barrel = barrel(world),
                              .jar = jar(world),
                              .bed = bed(world),
                              .lamp = lamp(world)};
}
