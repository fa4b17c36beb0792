#include "world.h"

#include <stdio.h>
#include <string.h>

/* A sheet of (columns + 1) × (rows + 1) points between a lower and an upper line. */
static void sheet(struct builder *b, enum material material, const struct vec *low,
                  const struct vec *high, const struct vec *normals, int columns, int rows,
                  bool flip)
{
    uint32_t first = 0, row = (uint32_t)columns + 1;
    for (int j = 0; j <= rows; j++) {
        for (int i = 0; i <= columns; i++) {
            struct vec p = builder_point(b, along(low[i], sub(high[i], low[i]), (double)j / rows));
            uint32_t index =
                mesh_vertex(b->mesh, material, p, builder_direction(b, normals[i]), i, j);
            first = i || j ? first : index;
        }
    }
    for (uint32_t j = 0; j < (uint32_t)rows; j++) {
        for (uint32_t i = 0; i < (uint32_t)columns; i++) {
            uint32_t a = first + j * row + i, c = a + row + 1;
            mesh_triangle(b->mesh, material, a, flip ? c : a + 1, flip ? a + 1 : c);
            mesh_triangle(b->mesh, material, a, flip ? a + row : c, flip ? c : a + row);
        }
    }
}

#define ARCH_MAX 256

/* The masonry over one round opening, from the springing line at `corner` up to `height`. */
static void arch(struct builder *b, struct vec corner, struct vec u, double width, double radius,
                 double height, double thickness)
{
    const struct vec up = vec(0, 1, 0), n = cross(u, up);
    struct vec low[ARCH_MAX + 1], high[ARCH_MAX + 1], faces[ARCH_MAX + 1], soffit[ARCH_MAX + 1];
    int columns = (int)fmin(ARCH_MAX, fmax(12, ceil(LEVEL_PI * radius / b->edge)));
    int rows = (int)fmax(1, ceil((height - radius) / b->edge));
    for (int i = 0; i <= columns; i++) {
        double angle = LEVEL_PI * (1 - (double)i / columns), at = width / 2 + radius * cos(angle);
        low[i] = along(along(corner, u, at), up, radius * sin(angle));
        high[i] = along(along(corner, u, at), up, height);
        faces[i] = n;
        soffit[i] = add(scale(u, -cos(angle)), scale(up, -sin(angle)));
    }
    sheet(b, MATERIAL_STONE, low, high, faces, columns, rows, false);
    struct vec back_low[ARCH_MAX + 1], back_high[ARCH_MAX + 1];
    for (int i = 0; i <= columns; i++) {
        back_low[i] = along(low[i], n, -thickness);
        back_high[i] = along(high[i], n, -thickness);
        faces[i] = scale(n, -1);
    }
    sheet(b, MATERIAL_STONE, back_low, back_high, faces, columns, rows, true);
    sheet(b, MATERIAL_STONE, back_low, low, soffit, columns, (int)ceil(thickness / b->edge), false);
}

/* Arches from `corner` along u, the outer face towards u × up; piers, and a cornice on top. */
static void arcade(struct builder *b, struct vec corner, struct vec u, int bays, double bay)
{
    const struct vec up = vec(0, 1, 0), n = cross(u, up);
    const double pier = 0.27, springing = 1.75, top = 3.1, thick = 0.46;
    for (int i = 0; i <= bays; i++) {
        struct vec foot = along(along(corner, u, i * bay), n, -thick / 2);
        block(b, MATERIAL_STONE, along(foot, up, top / 2 - 0.2), scale(u, pier),
              scale(up, top / 2 + 0.2), scale(n, thick / 2));
        block(b, MATERIAL_STONE, along(foot, up, 0.12), scale(u, pier + 0.07), scale(up, 0.22),
              scale(n, thick / 2 + 0.07));
        block(b, MATERIAL_STONE, along(foot, up, springing), scale(u, pier + 0.06), scale(up, 0.07),
              scale(n, thick / 2 + 0.06));
        if (i < bays)
            arch(b, along(along(corner, u, i * bay), up, springing), u, bay, bay / 2 - pier,
                 top - springing, thick);
    }
    struct vec middle =
        along(along(along(corner, u, bays * bay / 2), n, -thick / 2), up, top + 0.07);
    block(b, MATERIAL_STONE, middle, scale(u, bays * bay / 2 + pier + 0.1), scale(up, 0.1),
          scale(n, thick / 2 + 0.1));
}

/* A roof that leans against a wall: from `high` to `low`, along u. */
static void lean_to(struct builder *near, struct vec high, struct vec low, struct vec u,
                    double width, bool fine)
{
    struct builder wide = *near, *b = &wide;
    wide.edge *= 1.8;
    struct vec down = unit(sub(low, high)), up = cross(u, down);
    if (up.y < 0)
        up = scale(up, -1);
    struct vec side = cross(down, up);
    struct vec middle = along(scale(add(high, low), 0.5), u, width / 2);
    double run = length(sub(low, high));
    block(b, MATERIAL_WOOD, middle, scale(down, run / 2), scale(up, 0.05), scale(side, width / 2));
    int rows = (int)lround(run / (fine ? 0.42 : 1.6));
    for (int k = 0; k < rows; k++) {
        struct vec tilted = unit(add(down, scale(up, 0.12)));
        struct vec center = along(along(middle, down, run * ((k + 0.5) / rows - 0.5)), up, 0.085);
        block(b, MATERIAL_TILE, center, scale(tilted, run / rows / 2 + 0.05),
              scale(cross(side, tilted), 0.025), scale(side, width / 2 + 0.04));
    }
    int count = fine ? (int)lround(width / 1.2) : 0;
    for (int i = 0; i <= count && count; i++) {
        struct vec at = along(high, u, 0.15 + (width - 0.3) * i / count);
        at = along(at, up, -0.09);
        beam(b, MATERIAL_WOOD_DARK, at, along(at, down, run - 0.06), up, 0.1, 0.14);
    }
}

static struct mesh courtyard_mesh(struct world *world, double edge, bool fine)
{
    struct mesh mesh = {.name = "Courtyard"};
    struct builder b = builder_at(&mesh, edge);
    const double x = 10.8, z = 8.8, t = 0.4, high = 4.1;
    struct wall w = {.outside = MATERIAL_PLASTER_WARM,
                     .inside = MATERIAL_PLASTER_WARM,
                     .reveal = MATERIAL_STONE};
    w.height = high, w.thickness = t, w.ends = true;
    w.corner = vec(x, 0, -z), w.u = vec(-1, 0, 0), w.width = 2 * x;
    wall(&b, &w);
    w.ends = false;
    w.corner = vec(-x, 0, -z + t), w.u = vec(0, 0, 1), w.width = 2 * z - t;
    wall(&b, &w);
    struct hole gate = {6, 8, 0, 2.4};
    w.corner = vec(x, 0, z), w.u = vec(0, 0, -1), w.openings = &gate, w.opening_count = 1;
    w.height = 2.9;
    wall(&b, &w);
    for (int side = -1; side <= 1; side += 2) {
        w = (struct wall){
            .outside = MATERIAL_STONE, .inside = MATERIAL_STONE, .reveal = MATERIAL_STONE};
        w.corner = vec(side < 0 ? -x : 2.2, 0, z), w.u = vec(1, 0, 0), w.width = x - 2.2;
        w.height = 1.15, w.thickness = t, w.ends = true;
        wall(&b, &w);
        box(&b, MATERIAL_STONE, vec(side * 2.2, 0.9, z - 0.2), vec(0.38, 1.1, 0.38));
        box(&b, MATERIAL_STONE, vec(side * 2.2, 2.05, z - 0.2), vec(0.48, 0.09, 0.48));
        blob(&b, MATERIAL_STONE, vec(side * 2.2, 2.35, z - 0.2), vec(0.3, 0.3, 0.3), 0, 1,
             world_count(world, 16, 8));
    }
    box(&b, MATERIAL_STONE, vec(0, -0.42, 0), vec(x - t / 2, 0.45, z - t / 2));
    arcade(&b, vec(-x + 3.4, 0, -z + 3.4), vec(1, 0, 0), 6, (2 * x - 3.4 - t + 0.1) / 6);
    arcade(&b, vec(-x + 3.4, 0, z - 0.7), vec(0, 0, -1), 5, (2 * z - 4.1) / 5);
    lean_to(&b, vec(-x + 0.3, 4.05, -z + 0.3), vec(-x + 0.3, 3.2, -z + 3.9), vec(1, 0, 0),
            2 * x - 0.6, fine);
    lean_to(&b, vec(-x + 0.3, 4.05, z), vec(-x + 3.9, 3.2, z), vec(0, 0, -1), 2 * z - 0.6, fine);
    return mesh;
}

static void courtyard(struct world *world)
{
    struct mesh mesh = courtyard_mesh(world, world->edge, world->scale >= 0.08);
    int index = world_add_mesh(world, &mesh);
    int node = world_add_node(world, "Courtyard", 0, index, -1,
                              site_point(&world->terrain, COURTYARD, vec(0, 0.12, 0)),
                              world->terrain.sites[COURTYARD].angle);
    mesh = courtyard_mesh(world, 1.4 * world->edge, false);
    world_add_level(world, node, &mesh);
}

static void well(struct world *world)
{
    struct mesh mesh = {.name = "Well"};
    struct builder b = builder_at(&mesh, world->edge * 0.6);
    int sides = world_count(world, 28, 10);
    lathe(&b, MATERIAL_STONE, vec(0, 0, 0),
          (const double[][2]){{1.35, -0.4}, {1.35, 0.12}, {1.12, 0.12}, {1.05, 0.78}}, 4, sides);
    lathe(&b, MATERIAL_STONE, vec(0, 0, 0),
          (const double[][2]){{1.14, 0.78}, {1.14, 0.92}, {0.78, 0.92}, {0.78, 0.3}}, 4, sides);
    lathe(&b, MATERIAL_STONE, vec(0, 0, 0), (const double[][2]){{1.0, 0.78}, {1.14, 0.78}}, 2,
          sides);
    lathe(&b, MATERIAL_WATER, vec(0, 0, 0), (const double[][2]){{0.8, 0.34}, {0, 0.34}}, 2, sides);
    for (int side = -1; side <= 1; side += 2) {
        beam(&b, MATERIAL_WOOD_DARK, vec(side * 0.96, 0.1, 0), vec(side * 0.96, 2.75, 0),
             vec(0, 0, 1), 0.16, 0.16);
        struct vec down = unit(vec(0, -0.55, side));
        struct vec up = unit(vec(0, fabs(down.z), side * fabs(down.y)));
        block(&b, MATERIAL_TILE, add(vec(0, 2.95, 0), scale(down, 0.52)), scale(down, 0.62),
              scale(up, 0.04), cross(scale(down, 1.35), up));
        beam(&b, MATERIAL_WOOD_DARK, vec(side * 0.96, 2.3, -0.5), vec(side * 0.96, 2.3, 0.5),
             vec(0, 1, 0), 0.1, 0.12);
    }
    tube(&b, MATERIAL_WOOD, vec(-1.2, 1.75, 0), vec(1.2, 1.75, 0), 0.11, 0.11, 12,
         world_count(world, 6, 1));
    tube(&b, MATERIAL_IRON, vec(0.2, 1.2, 0.1), vec(0.2, 1.76, 0.1), 0.015, 0.015, 6, 1);
    lathe(
        &b, MATERIAL_WOOD, vec(0.2, 0.85, 0.1),
        (const double[][2]){{0, 0}, {0.15, 0}, {0.19, 0.34}, {0.16, 0.34}, {0.13, 0.05}, {0, 0.05}},
        6, 14);
    int index = world_add_mesh(world, &mesh);
    world_add_node(world, "Well", 0, index, -1, vec(0, terrain_height(&world->terrain, 0, 0), 0),
                   0.6);
}

static void picket_field(struct world *world, struct builder *b, const double from[2],
                         const double to[2], double start)
{
    double run = hypot(to[0] - from[0], to[1] - from[1]);
    struct vec n = unit(vec(from[1] - to[1], 0, to[0] - from[0]));
    int columns = (int)fmax(2, ceil(run / b->edge)), rows = (int)fmax(1, ceil(1.1 / b->edge));
    uint32_t first = 0, row = (uint32_t)columns + 1;
    for (int j = 0; j <= rows; j++) {
        for (int i = 0; i <= columns; i++) {
            double t = (double)i / columns, v = (double)j / rows;
            double x = mix(from[0], to[0], t), z = mix(from[1], to[1], t);
            double ground = mix(terrain_height(&world->terrain, from[0], from[1]),
                                terrain_height(&world->terrain, to[0], to[1]), t);
            uint32_t index = mesh_vertex(b->mesh, MATERIAL_FENCE, vec(x, ground + 1.1 * v, z), n,
                                         start + run * t, 1 - v);
            first = i || j ? first : index;
        }
    }
    for (uint32_t j = 0; j < (uint32_t)rows; j++) {
        for (uint32_t i = 0; i < (uint32_t)columns; i++) {
            uint32_t a = first + j * row + i, c = a + row + 1;
            mesh_triangle(b->mesh, MATERIAL_FENCE, a, a + 1, c);
            mesh_triangle(b->mesh, MATERIAL_FENCE, a, c, a + row);
        }
    }
}

static void fence(struct world *world, const char *name, const double (*points)[2], size_t count)
{
    struct mesh mesh = {0};
    struct builder b = builder_at(&mesh, world->edge * 1.3);
    double start = 0;
    for (size_t k = 0; k + 1 < count; k++) {
        double dx = points[k + 1][0] - points[k][0], dz = points[k + 1][1] - points[k][1];
        int fields = (int)ceil(hypot(dx, dz) / 2);
        for (int i = 0; i <= fields; i++) {
            double p[2] = {points[k][0] + dx * i / fields, points[k][1] + dz * i / fields};
            double q[2] = {p[0] + dx / fields, p[1] + dz / fields};
            if (i < fields || k + 2 == count)
                box(&b, MATERIAL_WOOD,
                    vec(p[0], terrain_height(&world->terrain, p[0], p[1]) + 0.5, p[1]),
                    vec(0.07, 0.75, 0.07));
            if (i < fields)
                picket_field(world, &b, p, q, start);
            start += hypot(dx, dz) / fields * (i < fields);
        }
    }
    int index = world_add_mesh(world, &mesh);
    world_add_node(world, name, 0, index, -1, vec(0, 0, 0), 0);
}

/* A log along the builder's x, its ends closed. */
static void log_at(struct builder *b, struct vec at, double radius, double half)
{
    struct builder lying = *b;
    lying.origin = builder_point(b, at);
    lying.x = b->y;
    lying.y = b->x;
    lying.z = scale(b->z, -1);
    double profile[][2] = {{0, -half}, {radius, -half}, {radius, half}, {0, half}};
    lathe(&lying, MATERIAL_BARK, vec(0, 0, 0), (const double(*)[2])profile, 4, 9);
}

static void woodpile(struct world *world, int number, struct vec place, double angle)
{
    struct mesh mesh = {0};
    struct builder b = builder_at(&mesh, world->edge);
    for (int row = 0; row < 6; row++) {
        for (int i = 0; i < 11 - row % 2; i++) {
            uint32_t id = (uint32_t)(row * 20 + i);
            double r = 0.125 - 0.02 * chance(9, id, 0);
            log_at(&b,
                   vec(0.08 * (chance(9, id, 1) - 0.5), 0.1 + 0.21 * row,
                       -1.2 + 0.245 * (i + 0.5 * (row % 2))),
                   r, 0.45);
        }
    }
    for (int side = -1; side <= 1; side += 2)
        box(&b, MATERIAL_WOOD, vec(0, 0.7, side * 1.42), vec(0.06, 0.9, 0.06));
    int index = world_add_mesh(world, &mesh);
    place.y = terrain_height(&world->terrain, place.x, place.z) - 0.02;
    world_add_node(world, "Woodpile_%d", number, index, -1, place, angle);
}

void yard_build(struct world *world)
{
    static const double garden[][2] = {
        {-9.3, 10.5}, {-9.3, 20}, {-26, 20}, {-26, 6.6}, {-13.5, 6.6}};
    static const double lane[][2] = {{15.5, 1.6}, {25, 1.6}, {25.5, 13}, {14.5, 13.5}};
    static const double road[][2] = {{13.6, 25}, {14.4, 34}, {11.6, 47}};
    courtyard(world);
    well(world);
    fence(world, "Fence_Garden", garden, sizeof garden / sizeof *garden);
    fence(world, "Fence_Lane", lane, sizeof lane / sizeof *lane);
    fence(world, "Fence_Road", road, sizeof road / sizeof *road);
    if (world->scale >= 0.08) {
        struct vec a = site_point(&world->terrain, 0, vec(-5.75, 0, 0.4));
        struct vec c = site_point(&world->terrain, 2, vec(-4.25, 0, -0.4));
        woodpile(world, 0, a, world->terrain.sites[0].angle);
        woodpile(world, 1, c, world->terrain.sites[2].angle);
    }
}
