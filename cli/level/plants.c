#include "world.h"

#include <stdio.h>
#include <stdlib.h>

#define SHRUBS 3
enum { MODEL_LIMIT = 64 }; /* of a species */
enum { OAK, PINE, BIRCH, SPECIES };

static struct vec in_ball(uint32_t seed, uint32_t id)
{
    double y = 2 * chance(seed, id, 10) - 1, turn = 2 * LEVEL_PI * chance(seed, id, 11);
    double r = sqrt(fmax(0, 1 - y * y)), far = cbrt(chance(seed, id, 12));
    return scale(vec(r * cos(turn), y, r * sin(turn)), far);
}

/* Cards of leaves on the outside of an ellipsoid, facing outwards more or less. */
static void leaves(const struct world *world, struct builder *b, struct vec center,
                   struct vec radii, int count, double size, int pieces, uint32_t seed)
{
    count = world->scale < 0.08 ? count / 3 : count;
    for (int i = 0; i < count; i++) {
        uint32_t id = (uint32_t)i;
        double y = 1 - 1.75 * (i + 0.5) / count, ring = sqrt(fmax(0, 1 - y * y)),
               turn = 2.39996 * i;
        struct vec d = vec(ring * cos(turn), y, ring * sin(turn));
        struct vec facing = unit(add(scale(d, 1.3), in_ball(seed, id)));
        struct vec u = unit(cross(vec(0.1, 1, 0.05), facing)), v = cross(facing, u);
        struct vec at = add(center, vec(d.x * radii.x, d.y * radii.y, d.z * radii.z));
        double half = size * (0.8 + 0.4 * chance(seed, id, 4));
        card(b, MATERIAL_LEAVES, at, scale(u, half), scale(v, half), d, pieces);
    }
}

/* Oak_A to Oak_Z, then Oak_A1. */
static void name_model(struct mesh *mesh, const char *species, uint32_t model)
{
    if (model < 26)
        snprintf(mesh->name, sizeof mesh->name, "%s_%c", species, (int)('A' + model));
    else
        snprintf(mesh->name, sizeof mesh->name, "%s_%c%u", species, (int)('A' + model % 26),
                 model / 26);
}

static int oak(struct world *world, uint32_t model)
{
    struct mesh mesh = {0};
    name_model(&mesh, "Oak", model);
    struct builder b = builder_at(&mesh, world->edge);
    const uint32_t seed = 40 + model * (model < 2 ? 1 : 1000);
    int sides = world_detail(world, 8, 4), bark = world_detail(world, 6, 3);
    int pieces = world_detail(world, 1, 1);
    struct vec fork = vec(0.15, 2.1, -0.1);
    tube(&b, MATERIAL_BARK, vec(0, -0.4, 0), fork, 0.34, 0.24, bark, world_detail(world, 3, 1));
    blob(&b, MATERIAL_OAK, vec(0.1, 4.4, 0), vec(1.7, 1.35, 1.7), 0.22, seed, sides);
    leaves(world, &b, vec(0.1, 4.4, 0), vec(1.6, 1.3, 1.6), 16, 0.5, pieces, seed + 90);
    for (uint32_t i = 0; i < 4; i++) {
        double turn = 2 * LEVEL_PI * (i + 0.6 * chance(seed, i, 0)) / 4;
        double reach = 1.35 + 0.5 * chance(seed, i, 1), size = 1.05 + 0.4 * chance(seed, i, 2);
        struct vec at = vec(reach * cos(turn), 3.3 + 0.9 * chance(seed, i, 3), reach * sin(turn));
        tube(&b, MATERIAL_BARK, along(fork, vec(0, 1, 0), -0.25), at, 0.15, 0.07, bark, 2);
        blob(&b, MATERIAL_OAK, at, vec(size, size * 0.8, size), 0.24, seed + 7 * i + 1, sides);
        leaves(world, &b, at, vec(size * 0.95, size * 0.78, size * 0.95), 9, 0.46, pieces,
               seed + i);
    }
    return world_add_mesh(world, &mesh);
}

/* One tier of a fir: points hang around a cone; closed below. */
static void tier(struct world *world, struct builder *b, double low, double high, double radius,
                 double turn)
{
    int points = world_detail(world, 7, 4);
    uint32_t n = 2 * (uint32_t)points;
    const size_t first_triangle = b->mesh->surfaces[MATERIAL_PINE].triangle_count;
    uint32_t first = mesh_vertex(b->mesh, MATERIAL_PINE, vec(0, high, 0), vec(0, 1, 0), 0, 0);
    for (int ring = 1; ring <= 3; ring++) {
        for (uint32_t i = 0; i < n; i++) {
            double angle = turn + 2 * LEVEL_PI * i / n, tip = i % 2 ? 0.72 : 1;
            double r = radius * (ring == 1 ? 0.5 : ring == 2 ? tip : 0.3);
            double y = ring == 1   ? mix(high, low, 0.56)
                       : ring == 2 ? low + (1 - tip) * 0.9
                                   : low + 0.35;
            mesh_vertex(b->mesh, MATERIAL_PINE, vec(r * cos(angle), y, r * sin(angle)),
                        vec(0, 1, 0), 0, ring);
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t a = first + 1 + i, c = first + 1 + (i + 1) % n;
        mesh_triangle(b->mesh, MATERIAL_PINE, first, c, a);
        for (uint32_t ring = 0; ring < 2; ring++, a += n, c += n) {
            mesh_triangle(b->mesh, MATERIAL_PINE, a, c, c + n);
            mesh_triangle(b->mesh, MATERIAL_PINE, a, c + n, a + n);
        }
    }
    mesh_smooth(b->mesh, MATERIAL_PINE, first, first_triangle);
}

static int pine(struct world *world, uint32_t model)
{
    struct mesh mesh = {0};
    name_model(&mesh, "Pine", model);
    struct builder b = builder_at(&mesh, world->edge);
    int tiers = 5 + (int)(model < 2 ? model : model % 3);
    double wide = model < 2 ? 1.75 : 1.5 + 0.6 * chance(77, model, 0);
    tube(&b, MATERIAL_BARK, vec(0, -0.4, 0), vec(0, 5.2, 0), 0.22, 0.06, world_detail(world, 7, 4),
         world_detail(world, 4, 1));
    for (int i = 0; i < tiers; i++) {
        double t = (double)i / tiers, low = 0.9 + 4.6 * t;
        tier(world, &b, low, low + 1.75 - 0.45 * t, wide * (1 - t) + 0.35,
             0.9 * i + 0.3 * (model / 2));
    }
    return world_add_mesh(world, &mesh);
}

static int birch(struct world *world, uint32_t model)
{
    struct mesh mesh = {0};
    name_model(&mesh, "Birch", model);
    struct builder b = builder_at(&mesh, world->edge);
    const uint32_t seed = 60 + model * (model < 2 ? 1 : 1000);
    int sides = world_detail(world, 6, 3), pieces = world_detail(world, 1, 1);
    struct vec top = vec(0.25, 5.4, 0.1);
    tube(&b, MATERIAL_BARK, vec(0, -0.4, 0), top, 0.17, 0.04, sides, world_detail(world, 5, 1));
    for (uint32_t i = 0; i < 6; i++) {
        double turn = 2.4 * i + 0.7 * (model / 2), y = 2.2 + 0.5 * i;
        struct vec root = vec(0.05 * y, y, 0.02 * y);
        tube(&b, MATERIAL_BARK, root, add(root, vec(1.1 * cos(turn), 0.8, 1.1 * sin(turn))), 0.06,
             0.02, sides, 1);
    }
    struct vec crown = vec(0.2, 4.3, 0.1);
    leaves(world, &b, crown, vec(1.3, 1.9, 1.3), 26, 0.62, pieces, seed);
    leaves(world, &b, crown, vec(0.7, 1.1, 0.7), 10, 0.55, pieces, seed + 5);
    return world_add_mesh(world, &mesh);
}

static int shrub(struct world *world, uint32_t model)
{
    struct mesh mesh = {0};
    snprintf(mesh.name, sizeof mesh.name, "Shrub_%c", (int)('A' + model));
    struct builder b = builder_at(&mesh, world->edge);
    int pieces = world_detail(world, 1, 1);
    if (model < 2) {
        blob(&b, MATERIAL_SHRUB, vec(0, 0.28, 0), vec(0.46, 0.36 + 0.1 * model, 0.42), 0.2,
             80 + model, world_detail(world, 6, 4));
        leaves(world, &b, vec(0, 0.28, 0), vec(0.46, 0.36 + 0.12 * model, 0.42), 9 + 2 * (int)model,
               0.26, pieces, 83 + model);
        return world_add_mesh(world, &mesh);
    }
    for (int i = 0; i < 3; i++) {
        double turn = LEVEL_PI * i / 3;
        card(&b, MATERIAL_GRASS, vec(0, 0.24, 0), vec(0.36 * cos(turn), 0, 0.36 * sin(turn)),
             vec(0, 0.28, 0), vec(-sin(turn), 0, cos(turn)), pieces);
    }
    return world_add_mesh(world, &mesh);
}

/* Turn, size and sometimes mirror the plant that was just added. */
static void vary(struct world *world, int node, uint32_t seed, uint32_t id, double size,
                 const char *role)
{
    if (node < 0)
        return;
    struct node *n = &world->nodes[node];
    n->role = role;
    double across = size * (0.9 + 0.2 * chance(seed, id, 21));
    n->scale[0] = chance(seed, id, 22) < 0.2 ? -across : across;
    n->scale[1] = size * (0.9 + 0.3 * chance(seed, id, 23));
    n->scale[2] = across;
}

static bool too_near(const double (*others)[2], size_t count, double x, double z, double least)
{
    for (size_t i = 0; i < count; i++)
        if (hypot(others[i][0] - x, others[i][1] - z) < least)
            return true;
    return false;
}

/* Forest on the hills, single trees in the village; none where a camera of the file looks. */
static bool tree_fits(const struct world *world, double x, double z, double luck)
{
    double clear = terrain_clearance(&world->terrain, x, z), far = hypot(x, z);
    if (clear < 3.2 || terrain_path(&world->terrain, x, z) > 0 || far < 9)
        return false;
    double ahead = (33 - x) * 0.562 + (47 - z) * 0.827, aside = (33 - x) * 0.827 - (47 - z) * 0.562;
    if (ahead > -4 && ahead < 44 && fabs(aside) < 0.75 * ahead + 4)
        return false;
    double grove = sin(x * 0.09 + 1) * sin(z * 0.08 - 0.5) * 0.5 + 0.5;
    return luck < smooth(16, 46, far) * (0.25 + 0.75 * grove) + 0.05;
}

/* Models of each species; with the copies of them more and more at larger scales. */
static size_t tree_models(struct world *world, int models[SPECIES][MODEL_LIMIT])
{
    const double wanted = 5.63 * sqrt(world->scale / 0.65) * sqrt(sqrt(world->scale / 0.65));
    const size_t count = wanted < 6                 ? 6
                         : wanted > 3 * MODEL_LIMIT ? 3 * MODEL_LIMIT
                                                    : (size_t)wanted;
    static int (*const grow[SPECIES])(struct world *, uint32_t) = {oak, pine, birch};
    for (size_t i = 0; i < count; i++)
        models[i % SPECIES][i / SPECIES] = grow[i % SPECIES](world, (uint32_t)(i / SPECIES));
    return count;
}

static void place_trees(struct world *world)
{
    int models[SPECIES][MODEL_LIMIT];
    world->tree_models = tree_models(world, models);
    static const char *const names[] = {"Tree_Oak_%03d", "Tree_Pine_%03d", "Tree_Birch_%03d"};
    int group = world_add_node(world, "Trees", 0, -1, -1, vec(0, 0, 0), 0);
    size_t wanted = (size_t)world_count(world, 300, 20), tries = wanted * 60;
    double(*places)[2] = calloc(wanted, sizeof *places),
    apart = fmin(3.2, 50 / sqrt((double)wanted));
    if (!places)
        world->failed = true;
    for (uint32_t i = 0; i < tries && world->trees < wanted && !world->failed; i++) {
        uint32_t seed = world->seed + 1000;
        double x = 156 * (chance(seed, i, 0) - 0.5), z = 156 * (chance(seed, i, 1) - 0.5);
        if (!tree_fits(world, x, z, chance(seed, i, 2)) ||
            too_near((const double(*)[2])places, world->trees, x, z, apart))
            continue;
        double y = terrain_height(&world->terrain, x, z);
        double hill = smooth(1, 9, y) + 0.5 * (chance(seed, i, 3) - 0.5), kind = chance(seed, i, 4);
        int species = hill > 0.45 ? PINE : kind < 0.62 ? OAK : BIRCH;
        size_t variants = (world->tree_models + SPECIES - 1 - (size_t)species) / SPECIES;
        int model =
            models[species][(size_t)((1 - chance(seed, i, 5)) * (double)variants * 0.999999)];
        int node = world_add_node(world, names[species], (int)world->trees, model, group,
                                  vec(x, y - 0.1, z), 2 * LEVEL_PI * chance(seed, i, 6));
        vary(world, node, seed, i, 0.8 + 0.5 * chance(seed, i, 7), "tree");
        places[world->trees][0] = x;
        places[world->trees++][1] = z;
    }
    free(places);
}

static void place_shrubs(struct world *world)
{
    int models[SHRUBS];
    for (uint32_t i = 0; i < SHRUBS; i++)
        models[i] = shrub(world, i);
    int group = world_add_node(world, "Shrubs", 0, -1, -1, vec(0, 0, 0), 0);
    size_t wanted = (size_t)world_count(world, 2399, 60), tries = wanted * 20;
    for (uint32_t i = 0; i < tries && world->shrubs < wanted && !world->failed; i++) {
        uint32_t seed = world->seed + 2000;
        double reach = 154 * mix(0.45, 1, chance(seed, i, 8));
        double x = reach * (chance(seed, i, 0) - 0.5), z = reach * (chance(seed, i, 1) - 0.5);
        double clear = terrain_clearance(&world->terrain, x, z);
        double patch = sin(x * 0.23) * sin(z * 0.19 + 1) + sin(x * 0.07 + z * 0.11);
        if (clear < 0.9 || terrain_path(&world->terrain, x, z) > 0.02 || hypot(x, z) < 6 ||
            hypot(x - 7.5, z - 8) < 4.5 || chance(seed, i, 2) > 0.35 + 0.5 * patch)
            continue;
        double kind = chance(seed, i, 3);
        int model = kind < 0.18 ? 0 : kind < 0.34 ? 1 : 2;
        int node = world_add_node(world, "Shrub_%03d", (int)world->shrubs++, models[model], group,
                                  vec(x, terrain_height(&world->terrain, x, z) - 0.03, z),
                                  2 * LEVEL_PI * chance(seed, i, 4));
        vary(world, node, seed, i, 0.7 + 0.7 * chance(seed, i, 5), "shrub");
    }
}

/* A tuft of two cards, a hand high. */
static int clump(struct world *world, uint32_t model)
{
    struct mesh mesh = {0};
    name_model(&mesh, "Grass", model);
    struct builder b = builder_at(&mesh, world->edge);
    for (int i = 0; i < 2; i++) {
        double turn = LEVEL_PI * (0.5 * i + 0.2 * model), high = 0.09 + 0.03 * model;
        card(&b, MATERIAL_GRASS, vec(0, high - 0.01, 0), vec(0.1 * cos(turn), 0, 0.1 * sin(turn)),
             vec(0, high, 0), vec(-sin(turn), 0, cos(turn)), 1);
    }
    return world_add_mesh(world, &mesh);
}

/* Along the paths and around the houses, where one looks at the ground. */
static bool grass_grows(const struct world *world, double x, double z)
{
    double path = terrain_path(&world->terrain, x, z);
    return terrain_clearance(&world->terrain, x, z) > 0.3 && path < 0.3 && hypot(x, z) > 3.4;
}

static void place_clumps(struct world *world, uint32_t model)
{
    const uint32_t seed = world->seed + 3000 + model;
    const size_t wanted = (size_t)world_count(world, 1800, 50);
    struct scatter s = {.translations = calloc(wanted, sizeof *s.translations),
                        .rotations = calloc(wanted, sizeof *s.rotations),
                        .scales = calloc(wanted, sizeof *s.scales)};
    if (!s.translations || !s.rotations || !s.scales)
        world->failed = true;
    for (uint32_t i = 0; i < 30 * wanted && s.count < wanted && !world->failed; i++) {
        double x = 90 * (chance(seed, i, 0) - 0.5), z = 90 * (chance(seed, i, 1) - 0.5);
        if (!grass_grows(world, x, z))
            continue;
        double turn = LEVEL_PI * chance(seed, i, 2), size = 0.7 + 0.6 * chance(seed, i, 3);
        float *t = s.translations[s.count], *r = s.rotations[s.count];
        t[0] = (float)x, t[1] = (float)terrain_height(&world->terrain, x, z), t[2] = (float)z;
        r[1] = (float)sin(turn), r[3] = (float)cos(turn);
        for (int k = 0; k < 3; k++)
            s.scales[s.count][k] = (float)size;
        s.count++;
    }
    const int mesh = clump(world, model);
    const int node = world_add_node(world, "Grass_%d", (int)model, mesh, -1, vec(0, 0, 0), 0);
    world->clumps += s.count;
    if (node < 0) {
        free(s.translations);
        free(s.rotations);
        free(s.scales);
        return;
    }
    world->nodes[node].scatter = s;
    world->nodes[node].role = "grass";
}

void plants_build(struct world *world)
{
    place_trees(world);
    place_shrubs(world);
    for (uint32_t model = 0; model < 2; model++)
        place_clumps(world, model);
}
