#include "world.h"

#include <stdlib.h>

#define PATH_HALF_WIDTH 1.5

static const struct site village[SITE_COUNT] = {
    {-15, -8, -0.49, 5.0, 6.5},  {13.5, -11.5, -2.44, 4.0, 5.0}, {18, 6.5, 2.8, 3.5, 4.5},
    {-17, 12, 0.61, 3.75, 4.75}, {0, 22.5, 0.4, 3.25, 4.25},     {31.5, -17.5, -0.785, 3.0, 3.75},
    {-5, -29, 0.08, 11.5, 9.5},
};

static double lattice(uint32_t seed, double x, double z)
{
    return chance(seed, (uint32_t)(int32_t)x, (uint32_t)(int32_t)z);
}

static double noise(uint32_t seed, double x, double z)
{
    double fx = floor(x), fz = floor(z), u = smooth(0, 1, x - fx), v = smooth(0, 1, z - fz);
    double low = mix(lattice(seed, fx, fz), lattice(seed, fx + 1, fz), u);
    double high = mix(lattice(seed, fx, fz + 1), lattice(seed, fx + 1, fz + 1), u);
    return mix(low, high, v) - 0.5;
}

static double waves(uint32_t seed, double x, double z)
{
    double sum = 0, height = 1, step = 1 / 26.0;
    for (uint32_t octave = 0; octave < 5; octave++) {
        sum += height * noise(seed + octave, x * step, z * step);
        height *= 0.45;
        step *= 2.1;
    }
    return sum;
}

static double bare_height(uint32_t seed, double x, double z)
{
    double far = hypot(x - 2, z + 2);
    double hills = smooth(34, 88, far);
    return 1.6 * waves(seed, x, z) * (0.25 + 0.75 * smooth(20, 50, far)) +
           hills * (9 + 9 * waves(seed + 100, x * 0.7, z * 0.7)) - 2.5 * smooth(30, 60, z) * hills;
}

static double segment_distance(double x, double z, const double a[2], const double b[2])
{
    double dx = b[0] - a[0], dz = b[1] - a[1];
    double t = clamp01(((x - a[0]) * dx + (z - a[1]) * dz) / (dx * dx + dz * dz));
    return hypot(x - a[0] - t * dx, z - a[1] - t * dz);
}

double terrain_path(const struct terrain *terrain, double x, double z)
{
    static const double points[][2] = {{6, 84}, {11, 64}, {7, 48},  {10, 34},   {9, 24},
                                       {6, 13}, {0, 3},   {-1, -6}, {-4, -19.5}};
    static const double lane[][2] = {{4, 4}, {14, -2}, {25, -2}, {38, -15}, {55, -17}, {84, -26}};
    static const double west[][2] = {{-2, 3}, {-10, 3}, {-20, 2}, {-34, 6}};
    double nearest = fmax(hypot(x, z) - 3.2, -1); /* the place around the well */
    for (size_t i = 0; i + 1 < sizeof points / sizeof *points; i++)
        nearest = fmin(nearest, segment_distance(x, z, points[i], points[i + 1]));
    for (size_t i = 0; i + 1 < sizeof lane / sizeof *lane; i++)
        nearest = fmin(nearest, segment_distance(x, z, lane[i], lane[i + 1]));
    for (size_t i = 0; i + 1 < sizeof west / sizeof *west; i++)
        nearest = fmin(nearest, segment_distance(x, z, west[i], west[i + 1]) + 0.3);
    double ragged = 0.5 * noise(terrain->seed + 31, x * 0.5, z * 0.5);
    return 1 - smooth(PATH_HALF_WIDTH - 0.4, PATH_HALF_WIDTH + 0.5, nearest + ragged);
}

static double site_distance(const struct site *site, double x, double z)
{
    double c = cos(site->angle), s = sin(site->angle);
    double dx = x - site->x, dz = z - site->z;
    double px = fabs(c * dx - s * dz) - site->half_x, pz = fabs(s * dx + c * dz) - site->half_z;
    return hypot(fmax(px, 0), fmax(pz, 0)) + fmin(fmax(px, pz), 0);
}

double terrain_clearance(const struct terrain *terrain, double x, double z)
{
    double nearest = 1e9;
    for (int i = 0; i < SITE_COUNT; i++)
        nearest = fmin(nearest, site_distance(&terrain->sites[i], x, z));
    return nearest;
}

double terrain_height(const struct terrain *terrain, double x, double z)
{
    double height = bare_height(terrain->seed, x, z);
    height = mix(height, bare_height(terrain->seed, 0, 0), 1 - smooth(3, 7, hypot(x, z)));
    height -= 0.14 * terrain_path(terrain, x, z);
    for (int i = 0; i < SITE_COUNT; i++)
        height = mix(terrain->heights[i], height,
                     smooth(0.8, 5, site_distance(&terrain->sites[i], x, z)));
    return height;
}

void terrain_create(struct terrain *terrain, uint32_t seed)
{
    terrain->seed = seed;
    for (int i = 0; i < SITE_COUNT; i++) {
        terrain->sites[i] = village[i];
        terrain->heights[i] = bare_height(seed, village[i].x, village[i].z);
    }
}

struct vec site_point(const struct terrain *terrain, int site, struct vec local)
{
    const struct site *s = &terrain->sites[site];
    double c = cos(s->angle), n = sin(s->angle);
    return vec(s->x + c * local.x + n * local.z, terrain->heights[site] + local.y,
               s->z - n * local.x + c * local.z);
}

/* Grid lines lie closer in the village than on the hills. */
static double grid_line(int i, int cells)
{
    double t = 2.0 * i / cells - 1;
    return LEVEL_HALF_SIZE * (0.48 * t + 0.52 * t * t * t);
}

static void ground_color(const struct terrain *terrain, double x, double z, double steep,
                         uint8_t color[4])
{
    static const double grass[3] = {0.20, 0.27, 0.085}, dry[3] = {0.33, 0.30, 0.13};
    static const double sand[3] = {0.52, 0.41, 0.26}, rock[3] = {0.34, 0.31, 0.27};
    double patches = smooth(-0.35, 0.35, waves(terrain->seed + 50, x * 2.2, z * 2.2));
    double path = fmax(terrain_path(terrain, x, z),
                       0.8 * (1 - smooth(0.2, 1.6, terrain_clearance(terrain, x, z))));
    for (int i = 0; i < 3; i++) {
        double c = mix(mix(grass[i], dry[i], patches), rock[i], smooth(0.45, 0.8, steep));
        color[i] = (uint8_t)lround(255 * mix(c, sand[i], path));
    }
    color[3] = 255;
}

static void ground_grid(struct world *world, struct mesh *mesh, int cells)
{
    const struct terrain *terrain = &world->terrain;
    for (int j = 0; j <= cells; j++) {
        for (int i = 0; i <= cells; i++) {
            double x = grid_line(i, cells), z = grid_line(j, cells);
            struct vec p = vec(x, terrain_height(terrain, x, z), z);
            mesh_vertex(mesh, MATERIAL_GROUND, p, vec(0, 1, 0), x / 4, z / 4);
        }
    }
    uint32_t row = (uint32_t)cells + 1;
    for (uint32_t j = 0; j < (uint32_t)cells; j++) {
        for (uint32_t i = 0; i < (uint32_t)cells; i++) {
            uint32_t a = j * row + i, d = a + row;
            mesh_triangle(mesh, MATERIAL_GROUND, a, d, (i + j) % 2 ? a + 1 : d + 1);
            if ((i + j) % 2)
                mesh_triangle(mesh, MATERIAL_GROUND, a + 1, d, d + 1);
            else
                mesh_triangle(mesh, MATERIAL_GROUND, a, d + 1, a + 1);
        }
    }
    mesh_smooth(mesh, MATERIAL_GROUND, 0, 0);
}

static void ground_colors(const struct world *world, struct surface *s)
{
    for (size_t i = 0; i < s->vertex_count; i++) {
        double up = s->normals[i][1];
        ground_color(&world->terrain, s->positions[i][0], s->positions[i][2], 1 - up * up,
                     s->colors[i]);
    }
}

/* The cut through the earth along one edge of the terrain, so that it looks like a model. */
static void skirt(struct world *world, struct mesh *mesh, int cells, int side)
{
    const double c = side % 2 ? 0 : 1, s = side % 2 ? 1 : 0, sign = side < 2 ? 1 : -1;
    struct vec n = vec(s * sign, 0, c * sign);
    uint32_t first = 0;
    for (int i = 0; i <= cells; i++) {
        double t = grid_line(i, cells) * (side == 0 || side == 3 ? 1 : -1),
               f = LEVEL_HALF_SIZE * sign;
        double x = side % 2 ? f : t, z = side % 2 ? t : f;
        double top = terrain_height(&world->terrain, x, z);
        uint32_t a = mesh_vertex(mesh, MATERIAL_STONE, vec(x, -6, z), n, t / 4, 0);
        mesh_vertex(mesh, MATERIAL_STONE, vec(x, top, z), n, t / 4, top);
        first = i ? first : a;
    }
    for (uint32_t i = 0; i < (uint32_t)cells; i++) {
        uint32_t a = first + 2 * i;
        mesh_triangle(mesh, MATERIAL_STONE, a, a + 2, a + 3);
        mesh_triangle(mesh, MATERIAL_STONE, a, a + 3, a + 1);
    }
}

static struct mesh ground_mesh(struct world *world, int cells)
{
    struct mesh mesh = {.name = "Terrain"};
    ground_grid(world, &mesh, cells);
    if (!mesh.failed)
        ground_colors(world, &mesh.surfaces[MATERIAL_GROUND]);
    for (int side = 0; side < 4; side++)
        skirt(world, &mesh, cells, side);
    struct builder b = builder_at(&mesh, 20);
    quad(&b, MATERIAL_STONE, vec(-LEVEL_HALF_SIZE, -6, -LEVEL_HALF_SIZE),
         vec(2 * LEVEL_HALF_SIZE, 0, 0), vec(0, 0, 2 * LEVEL_HALF_SIZE));
    return mesh;
}

void terrain_build(struct world *world)
{
    struct mesh mesh = ground_mesh(world, world_count(world, 132, 12));
    int index = world_add_mesh(world, &mesh);
    int node = world_add_node(world, "Terrain", 0, index, -1, vec(0, 0, 0), 0);
    for (int level = 1; level <= 2; level++) {
        mesh = ground_mesh(world, world_count(world, level == 1 ? 84 : 42, 6));
        world_add_level(world, node, &mesh);
    }
}
