#include "world.h"

#include <stdlib.h>

#define WALL 0.35   /* metres, thickness */
#define PITCH 0.80  /* radians */
#define EAVES 0.60  /* metres beyond the long walls */
#define VERGE 0.45  /* metres beyond the gables */
#define BOARDS 0.10 /* metres, thickness of the roof's boards */

/* Origin on the floor's middle; the ridge runs along z, the door is in the wall at +x. */
struct house {
    double half_x, half_z, height; /* metres; height of the walls */
    double ridge;                  /* height of the roof boards' underside at the ridge */
    bool timbered, loft, fine;
    enum material plaster;
};

/* Height of the loft's floor; the beams across end below it. */
static double deck(const struct house *h)
{
    return h->height - 0.24;
}

static void window_frame(struct builder *b, const struct wall *w, const struct hole *h)
{
    const struct vec up = vec(0, 1, 0), n = cross(w->u, up);
    struct vec base = along(along(w->corner, w->u, h->u0), n, -0.4 * w->thickness);
    double width = h->u1 - h->u0;
    struct vec right = scale(w->u, width), low = scale(up, h->v0), high = scale(up, h->v1);
    struct vec middle = scale(up, (h->v0 + h->v1) / 2);
    beam(b, MATERIAL_WOOD, add(base, low), add(add(base, low), right), up, 0.09, 0.09);
    beam(b, MATERIAL_WOOD, add(base, high), add(add(base, high), right), up, 0.09, 0.09);
    beam(b, MATERIAL_WOOD, add(base, low), add(base, high), n, 0.09, 0.09);
    beam(b, MATERIAL_WOOD, add(add(base, right), low), add(add(base, right), high), n, 0.09, 0.09);
    beam(b, MATERIAL_WOOD, add(base, middle), add(add(base, middle), right), up, 0.05, 0.05);
    struct vec half = scale(right, 0.5);
    beam(b, MATERIAL_WOOD, add(add(base, half), low), add(add(base, half), high), n, 0.05, 0.05);
}

/* Open shutters left and right of a window, a little sunk into the plaster, and a sill. */
static void shutters(struct builder *b, const struct wall *w, const struct hole *h)
{
    const struct vec up = vec(0, 1, 0), n = cross(w->u, up);
    double width = (h->u1 - h->u0) / 2, height = h->v1 - h->v0, middle = (h->v0 + h->v1) / 2;
    for (int side = 0; side < 2; side++) {
        double at = side ? h->u1 + width / 2 + 0.03 : h->u0 - width / 2 - 0.03;
        struct vec center = along(along(along(w->corner, w->u, at), up, middle), n, 0.02);
        block(b, MATERIAL_WOOD, center, scale(w->u, width / 2), scale(up, height / 2 + 0.04),
              scale(n, 0.03));
        for (int bar = -1; bar <= 1; bar += 2)
            block(b, MATERIAL_WOOD_DARK, along(along(center, n, 0.035), up, bar * height * 0.32),
                  scale(w->u, width / 2 - 0.03), scale(up, 0.05), scale(n, 0.015));
    }
    struct vec sill = along(along(along(w->corner, w->u, (h->u0 + h->u1) / 2), up, h->v0), n, 0.03);
    block(b, MATERIAL_STONE, sill, scale(w->u, width + 0.1), scale(up, 0.05), scale(n, 0.12));
}

static void door_frame(struct builder *b, const struct wall *w, const struct hole *h)
{
    const struct vec up = vec(0, 1, 0), n = cross(w->u, up);
    struct vec left = along(along(w->corner, w->u, h->u0), n, -0.1), right = left;
    right = along(right, w->u, h->u1 - h->u0);
    beam(b, MATERIAL_WOOD_DARK, left, along(left, up, h->v1), n, 0.16, 0.3);
    beam(b, MATERIAL_WOOD_DARK, right, along(right, up, h->v1), n, 0.16, 0.3);
    beam(b, MATERIAL_WOOD_DARK, along(along(left, up, h->v1), w->u, -0.25),
         along(along(right, up, h->v1), w->u, 0.25), up, 0.3, 0.18);
    struct vec hinge = along(along(right, n, -w->thickness + 0.05), w->u, -0.1);
    struct vec leaf = unit(add(scale(n, -0.94), scale(w->u, 0.2)));
    struct vec across = cross(leaf, up);
    double width = h->u1 - h->u0 - 0.2, height = h->v1 - 0.12;
    struct vec center = along(along(hinge, leaf, width / 2), up, height / 2 + 0.06);
    block(b, MATERIAL_WOOD, center, scale(leaf, width / 2), scale(up, height / 2),
          scale(across, 0.03));
    for (int bar = -1; bar <= 1; bar += 2)
        block(b, MATERIAL_IRON, along(center, up, bar * 0.6), scale(leaf, width / 2 - 0.08),
              scale(up, 0.04), scale(across, 0.04));
}

static void dress(struct builder *b, const struct house *house, const struct wall *w)
{
    if (!house->fine)
        return;
    for (size_t i = 0; i < w->opening_count; i++) {
        if (w->openings[i].v0 > 0) {
            window_frame(b, w, &w->openings[i]);
            shutters(b, w, &w->openings[i]);
        } else {
            door_frame(b, w, &w->openings[i]);
        }
    }
}

static struct hole window_at(double middle)
{
    return (struct hole){middle - 0.5, middle + 0.5, 0.95, 2.05};
}

static void long_walls(struct builder *b, const struct house *h)
{
    double l = 2 * h->half_z, marks[2] = {WALL, l - WALL};
    struct hole front[3] = {
        window_at(l * 0.21), {l / 2 - 0.55, l / 2 + 0.55, 0, 2.15}, window_at(l * 0.79)};
    struct hole back[2] = {window_at(l * 0.28), window_at(l * 0.72)};
    struct wall w = {.outside = h->plaster,
                     .inside = MATERIAL_PLASTER,
                     .reveal = h->plaster,
                     .corner = vec(h->half_x, 0, h->half_z),
                     .u = vec(0, 0, -1),
                     .width = l,
                     .height = h->height,
                     .thickness = WALL,
                     .openings = front,
                     .opening_count = 3,
                     .marks = marks,
                     .mark_count = 2,
                     .ends = true};
    wall(b, &w);
    dress(b, h, &w);
    w.corner = vec(-h->half_x, 0, -h->half_z);
    w.u = vec(0, 0, 1);
    w.openings = back;
    w.opening_count = 2;
    wall(b, &w);
    dress(b, h, &w);
}

static void gable_walls(struct builder *b, const struct house *h)
{
    double width = 2 * (h->half_x - WALL), apex = h->ridge + 0.03;
    struct hole window = window_at(width / 2);
    struct wall w = {.outside = h->plaster,
                     .inside = MATERIAL_PLASTER,
                     .reveal = h->plaster,
                     .corner = vec(WALL - h->half_x, 0, h->half_z),
                     .u = vec(1, 0, 0),
                     .width = width,
                     .height = h->height,
                     .thickness = WALL,
                     .openings = &window,
                     .opening_count = 1};
    wall(b, &w);
    dress(b, h, &w);
    w.corner = vec(h->half_x - WALL, 0, -h->half_z);
    w.u = vec(-1, 0, 0);
    w.opening_count = 0;
    wall(b, &w);
    for (int side = -1; side <= 1; side += 2) {
        double x = h->half_x * side, outer = h->half_z * side, inner = outer - WALL * side;
        triangle(b, h->plaster, vec(-x, h->height, outer), vec(x, h->height, outer),
                 vec(0, apex, outer));
        triangle(b, MATERIAL_PLASTER, vec(x, h->height, inner), vec(-x, h->height, inner),
                 vec(0, apex, inner));
    }
}

struct slope {
    struct vec down, up, z; /* along the roof, out of it, along the ridge: right-handed */
    struct vec ridge;
    double length;
};

static struct slope slope_of(const struct house *h, int side)
{
    double c = cos(PITCH), s = sin(PITCH);
    return (struct slope){vec(side * c, -s, 0), vec(side * s, c, 0), vec(0, 0, side),
                          vec(0, h->ridge, 0), (h->half_x + EAVES) / c};
}

static void tiles(struct builder *b, const struct house *h, const struct slope *s)
{
    struct builder coarse = *b;
    coarse.edge *= 2.5;
    int rows = (int)lround(s->length / (h->fine ? 0.42 : 1.6));
    double run = s->length / rows, tilt = asin(fmin(0.06 / run, 0.5));
    struct vec down = add(scale(s->down, cos(tilt)), scale(s->up, sin(tilt)));
    struct vec up = cross(s->z, down);
    for (int k = 0; k < rows; k++) {
        struct vec center =
            along(along(s->ridge, s->down, (k + 0.5) * run + 0.02), s->up, BOARDS + 0.035);
        block(&coarse, MATERIAL_TILE, center, scale(down, run / 2 + 0.05), scale(up, 0.025),
              scale(s->z, h->half_z + VERGE + 0.03));
    }
}

static void rafters(struct builder *b, const struct house *h, const struct slope *s)
{
    int count = (int)ceil(2 * h->half_z / 1.3);
    double first = -h->half_z - VERGE + 0.12, last = -first;
    for (int i = 0; i <= count; i++) {
        struct vec top = along(s->ridge, s->up, -0.05);
        top.z = mix(first, last, (double)i / count);
        beam(b, MATERIAL_WOOD_DARK, top, along(top, s->down, s->length - 0.08), s->up, 0.11, 0.16);
    }
}

static void roof(struct builder *fine, const struct house *h)
{
    struct builder wide = *fine, *b = &wide;
    wide.edge *= 1.8;
    for (int side = -1; side <= 1; side += 2) {
        struct slope s = slope_of(h, side);
        double lap = BOARDS;
        struct vec center = along(along(s.ridge, s.down, (s.length - lap) / 2), s.up, BOARDS / 2);
        block(b, MATERIAL_WOOD, center, scale(s.down, (s.length + lap) / 2),
              scale(s.up, BOARDS / 2), scale(s.z, h->half_z + VERGE));
        tiles(b, h, &s);
        if (h->fine)
            rafters(b, h, &s);
    }
    double top = h->ridge + BOARDS / cos(PITCH) + 0.08;
    beam(b, MATERIAL_TILE, vec(0, top, -h->half_z - VERGE - 0.06),
         vec(0, top, h->half_z + VERGE + 0.06), vec(0, 1, 0), 0.3, 0.14);
    beam(b, MATERIAL_WOOD_DARK, vec(0, h->ridge - 0.1, -h->half_z - VERGE + 0.05),
         vec(0, h->ridge - 0.1, h->half_z + VERGE - 0.05), vec(0, 1, 0), 0.18, 0.24);
}

/* Beams across, through both long walls and out on the other side. */
static void tie_beams(struct builder *b, const struct house *h)
{
    int count = (int)lround(2 * (h->half_z - 0.4) / 1.45);
    for (int i = 0; i <= count; i++) {
        double z = mix(0.4 - h->half_z, h->half_z - 0.4, (double)i / count);
        if (h->loft && z > 0.4 && z < h->half_z - 2)
            continue;
        beam(b, MATERIAL_WOOD_DARK, vec(-h->half_x - 0.25, deck(h) - 0.12, z),
             vec(h->half_x + 0.25, deck(h) - 0.12, z), vec(0, 1, 0), 0.16, 0.2);
    }
}

static void timber(struct builder *b, const struct house *h)
{
    const struct vec up = vec(0, 1, 0);
    const enum material wood = MATERIAL_WOOD_DARK;
    double x = h->half_x - 0.05, z = h->half_z - 0.05, top = h->height;
    for (int i = -1; i <= 1; i += 2) {
        for (int j = -1; j <= 1; j += 2) {
            beam(b, wood, vec(i * x, 0, j * z), vec(i * x, top, j * z), vec(1, 0, 0), 0.22, 0.22);
            if (h->timbered)
                beam(b, wood, vec(i * x, 0.1, j * (z - 0.1)),
                     vec(i * x, top - 0.2, j * (z - 0.1 - 0.12 * z)), vec(i, 0, 0), 0.15, 0.2);
        }
        if (h->timbered) {
            beam(b, wood, vec(i * x, top - 0.08, -z), vec(i * x, top - 0.08, z), up, 0.2, 0.2);
            beam(b, wood, vec(-x, top, i * z), vec(x, top, i * z), up, 0.2, 0.22);
            beam(b, wood, vec(0, top, i * z), vec(0, h->ridge, i * z), vec(0, 0, 1), 0.2, 0.2);
            for (int j = -1; j <= 1; j += 2)
                beam(b, wood, vec(j * x * 0.6, top, i * z), vec(0, top + x * 0.62, i * z),
                     vec(0, 0, 1), 0.18, 0.18);
        }
    }
}

static void chimney(struct builder *b, const struct house *h)
{
    double z = -h->half_z + WALL + 0.32, top = h->ridge + 0.9, x = 0.6;
    for (int side = -1; side <= 1; side += 2)
        box(b, MATERIAL_STONE, vec(x + side * 0.62, 0.55, z), vec(0.16, 0.6, 0.42));
    box(b, MATERIAL_STONE, vec(x, 1.25, z), vec(0.86, 0.14, 0.46));
    box(b, MATERIAL_STONE, vec(x, 0.06, z + 0.2), vec(0.86, 0.06, 0.6));
    double low = h->ridge - 1.12 * tan(PITCH), high = h->ridge + 0.2;
    struct builder fine = *b;
    fine.edge *= 0.35; /* where it goes through the roof: light must not bleed in along an edge */
    box(b, MATERIAL_STONE, vec(x, (1.3 + low) / 2, z), vec(0.48, (low - 1.3) / 2, 0.36));
    box(&fine, MATERIAL_STONE, vec(x, (low + high) / 2, z), vec(0.48, (high - low) / 2, 0.36));
    box(b, MATERIAL_STONE, vec(x, (high + top) / 2, z), vec(0.48, (top - high) / 2, 0.36));
    box(b, MATERIAL_STONE, vec(x, top - 0.12, z), vec(0.56, 0.09, 0.44));
    if (h->fine)
        for (int side = -1; side <= 1; side += 2)
            lathe(b, MATERIAL_CLAY, vec(x + side * 0.22, top - 0.05, z),
                  (const double[][2]){{0.15, 0}, {0.11, 0.4}, {0.08, 0.4}, {0.1, 0.06}, {0, 0.06}},
                  5, 10);
}

static void stairs(struct builder *b, const struct house *h)
{
    const int steps = 13;
    double rise = (deck(h) + 0.06) / steps, going = 0.25, x = WALL - h->half_x + 0.55;
    for (int i = 0; i < steps; i++)
        box(b, MATERIAL_WOOD, vec(x, rise * (i + 1) - 0.025, going * (steps - i) - 0.15),
            vec(0.5, 0.03, 0.15));
    for (int side = -1; side <= 1; side += 2) {
        beam(b, MATERIAL_WOOD_DARK, vec(x + side * 0.5, 0.0, going * steps + 0.1),
             vec(x + side * 0.5, deck(h), -0.05), vec(0, 1, 0), 0.06, 0.3);
    }
    for (int i = 0; i <= 3; i++)
        beam(b, MATERIAL_WOOD,
             vec(x + 0.5, mix(0, deck(h), i / 3.0), mix(going * steps, 0.05, i / 3.0)),
             vec(x + 0.5, mix(0, deck(h), i / 3.0) + 1, mix(going * steps, 0.05, i / 3.0)),
             vec(1, 0, 0), 0.06, 0.06);
    beam(b, MATERIAL_WOOD, vec(x + 0.5, 1, going * steps), vec(x + 0.5, deck(h) + 1, 0.05),
         vec(0, 1, 0), 0.07, 0.07);
}

static void loft(struct builder *b, const struct house *h)
{
    double back = WALL - 0.05 - h->half_z, half = -back / 2, wide = h->half_x - WALL + 0.05;
    box(b, MATERIAL_FLOOR, vec(0, deck(h) + 0.02, -half), vec(wide, 0.04, half));
    beam(b, MATERIAL_WOOD_DARK, vec(-wide, deck(h) - 0.1, -0.06), vec(wide, deck(h) - 0.1, -0.06),
         vec(0, 1, 0), 0.18, 0.24);
    double left = WALL - h->half_x + 1.15, right = h->half_x - 1.05; /* under the roof */
    for (int i = 0; i <= 5; i++) {
        double x = mix(left, right, i / 5.0);
        beam(b, MATERIAL_WOOD, vec(x, deck(h), -0.06), vec(x, deck(h) + 1, -0.06), vec(1, 0, 0),
             0.07, 0.07);
    }
    for (int i = 1; i <= 2; i++)
        beam(b, MATERIAL_WOOD, vec(left, deck(h) + 0.5 * i, -0.06),
             vec(right, deck(h) + 0.5 * i, -0.06), vec(0, 1, 0), 0.06, 0.08);
    stairs(b, h);
}

static void foundation(struct builder *b, const struct house *h)
{
    struct builder hidden = *b;
    hidden.edge *= 3;
    box(&hidden, MATERIAL_STONE, vec(0, -0.5, 0), vec(h->half_x + 0.14, 0.5, h->half_z + 0.14));
    box(b, MATERIAL_FLOOR, vec(0, 0, 0),
        vec(h->half_x - WALL + 0.05, 0.04, h->half_z - WALL + 0.05));
    for (int i = 0; i < 2; i++)
        box(b, MATERIAL_STONE, vec(h->half_x + 0.35 + 0.3 * i, -0.28 - 0.14 * i, 0),
            vec(0.35, 0.2, 0.9 - 0.1 * i));
}

static struct house house_design(const struct world *world, int number)
{
    const struct site *site = &world->terrain.sites[number];
    struct house h = {.half_x = site->half_x, .half_z = site->half_z};
    h.height = number == 0 ? 3.1 : 2.75;
    h.ridge = h.height - 0.05 + h.half_x * tan(PITCH);
    h.timbered = number % 2 == 1;
    h.loft = number < 2;
    h.fine = world->scale >= 0.08;
    h.plaster = number % 3 == 1 ? MATERIAL_PLASTER_WARM : MATERIAL_PLASTER;
    return h;
}

static void house_mesh(struct builder *b, const struct house *h)
{
    foundation(b, h);
    long_walls(b, h);
    gable_walls(b, h);
    roof(b, h);
    tie_beams(b, h);
    if (h->fine)
        timber(b, h);
    chimney(b, h);
    if (h->loft)
        loft(b, h);
}

/* The house from afar: a body without rooms under two slabs. */
static void simple_mesh(struct builder *b, const struct house *h)
{
    double top = h->ridge;
    box(b, h->plaster, vec(0, h->height / 2 - 0.4, 0),
        vec(h->half_x, h->height / 2 + 0.4, h->half_z));
    for (int side = -1; side <= 1; side += 2) {
        double x = h->half_x * side, z = h->half_z * side;
        triangle(b, h->plaster, vec(-x, h->height, z), vec(x, h->height, z), vec(0, top, z));
        struct slope s = slope_of(h, side);
        block(b, MATERIAL_TILE, along(along(s.ridge, s.down, s.length / 2), s.up, BOARDS / 2),
              scale(s.down, s.length / 2), scale(s.up, BOARDS), scale(s.z, h->half_z + VERGE));
    }
}

/* Without frames, shutters, timber and rafters, then without rooms. */
static void add_levels(struct world *world, const struct house *h, int node)
{
    struct mesh mesh = {0};
    struct house plain = *h;
    struct builder b = builder_at(&mesh, 1.2 * world->edge);
    plain.fine = false;
    house_mesh(&b, &plain);
    world_add_level(world, node, &mesh);
    mesh = (struct mesh){0};
    b = builder_at(&mesh, 100);
    simple_mesh(&b, h);
    world_add_level(world, node, &mesh);
}

static void furnish(struct world *world, const struct furniture *f, const struct house *h,
                    int number, int house)
{
    const double x = h->half_x - WALL, z = h->half_z - WALL, floor = 0.04;
    world_add_node(world, "Table_%d", number, f->table, house, vec(0.5, floor, 1.0), 0.12);
    world_add_node(world, "Bench_%d_A", number, f->bench, house, vec(-0.25, floor, 0.95), 0.12);
    world_add_node(world, "Bench_%d_B", number, f->bench, house, vec(1.25, floor, 1.1), 0.16);
    if (!h->fine)
        return;
    world_add_node(world, "Shelf_%d", number, f->shelf, house, vec(1.0, floor, z - 0.24), LEVEL_PI);
    world_add_node(world, "Bed_%d", number, f->bed, house, vec(-x + 0.6, floor, -z + 1.1), 0);
    world_add_node(world, "Crate_%d_A", number, f->crate, house, vec(x - 0.5, floor, -z + 0.5),
                   0.1);
    world_add_node(world, "Crate_%d_B", number, f->crate, house,
                   vec(x - 0.5, floor + 0.7, -z + 0.45), 0.5);
    world_add_node(world, "Crate_%d_C", number, f->crate, house, vec(x - 1.3, floor, -z + 0.5),
                   -0.2);
    world_add_node(world, "Barrel_%d", number, f->barrel, house, vec(x - 0.45, floor, z - 0.45), 0);
    world_add_node(world, "Lamp_%d", number, f->lamp, house, vec(0.4, deck(h) - 0.2, 0.2), 0);
    for (int i = 0; i < 3; i++)
        world_add_node(world, i ? i > 1 ? "Jar_%d_C" : "Jar_%d_B" : "Jar_%d_A", number, f->jar,
                       house, vec(0.2 + 0.28 * i, floor + 0.78, 0.8 + 0.5 * (i % 2)), i);
}

void houses_build(struct world *world)
{
    struct furniture furniture = furniture_build(world);
    int count = world->scale < 0.04 ? 3 : HOUSE_COUNT;
    int group = world_add_node(world, "Houses", 0, -1, -1, vec(0, 0, 0), 0);
    for (int i = 0; i < count; i++) {
        struct house h = house_design(world, i);
        struct mesh mesh = {0};
        struct builder b = builder_at(&mesh, world->edge);
        house_mesh(&b, &h);
        int index = world_add_mesh(world, &mesh);
        int node = world_add_node(world, "House_%d", i, index, group,
                                  site_point(&world->terrain, i, vec(0, 0.22, 0)),
                                  world->terrain.sites[i].angle);
        add_levels(world, &h, node);
        furnish(world, &furniture, &h, i, node);
    }
}
