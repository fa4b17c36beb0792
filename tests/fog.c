/* What lies on a ray's way: trees, shrubs as fog, levels of detail. */
#include "trace_scenes.h"

#include "base/sequence.h"
#include "scene/scene.h"
#include "trace/gather.h"
#include "trace/kernel.h"
#include "trace/passage.h"
#include "trace/tracer.h"

#define POINTS 256
typedef float vec3[3];

static const char *const kernels[] = {"exponential", "linear", "hard"};

static uint32_t add_role(struct cranny_scene *scene, uint32_t mesh, const double m[12],
                         enum cranny_role role, uint32_t lod)
{
    struct cranny_error why;
    struct cranny_instance instance = {
        .name = "", .mesh = mesh, .role = role, .lod = lod, .lod_group = lod ? 1 : 0};
    memcpy(instance.world_from_object, m, sizeof instance.world_from_object);
    uint32_t index = 0;
    CHECK_OK(cranny_scene_add_instance(scene, &instance, &index, &why), why);
    return index;
}

static struct cranny_tracer *role_tracer(const struct cranny_scene *scene,
                                         enum cranny_dimming dimming, float opacity)
{
    struct cranny_error why;
    struct cranny_tracer *tracer;
    struct cranny_tracer_params params = cranny_tracer_params_default();
    params.roles = true;
    params.dimming = dimming;
    params.tree_opacity = opacity;
    CHECK_OK(cranny_tracer_create(scene, &params, &tracer, &why), why);
    return tracer;
}

static void finish(struct cranny_tracer **tracer, struct cranny_scene **scene)
{
    cranny_tracer_destroy(tracer);
    cranny_scene_destroy(scene);
}

/* Both values at one point that looks along +y. */
static void look_up(const struct cranny_tracer *tracer, const vec3 position,
                    const struct cranny_gather_params *params, float values[2])
{
    struct cranny_error why;
    const vec3 up = {0, 1, 0};
    CHECK_OK(cranny_gather(tracer, 1, (const vec3 *)position, (const vec3 *)up, NULL, params,
                           (float(*)[2])values, NULL, &why),
             why);
}

static struct cranny_gather_params kernel_params(enum cranny_kernel kernel, float r0, float r1,
                                                 int rays)
{
    struct cranny_gather_params params = cranny_gather_params_default();
    params.kernel = kernel;
    params.distances[0] = r0;
    params.distances[1] = r1;
    params.rays = rays;
    return params;
}

/* ρ, in double and from its definition. */
static double rho(int kernel, double r, double d)
{
    return kernel == 0 ? 1 - exp(log(0.5) * d / r) : kernel == 1 ? fmin(d / r, 1) : d < r ? 0 : 1;
}

/* What is left of a ray through fog, by many thin slices. */
static double over_fog(int kernel, double r, double from, double to, double rate)
{
    const int slices = 200000; /* the hard kernel jumps in one */
    double sum = 0;
    for (int i = 0; i < slices; i++) {
        const double t = from + (to - from) * (i + 0.5) / slices;
        sum += rate * exp(-rate * (t - from)) * rho(kernel, r, t);
    }
    return sum * (to - from) / slices;
}

static void test_fog_kernel(void)
{
    for (uint32_t i = 0; i < 60; i++) {
        const int kernel = (int)(i % 3);
        const float from = 5 * unit_from_u32(hash_u32(3 * i));
        const float to = from + 8 * unit_from_u32(hash_u32(3 * i + 1));
        const float rate = exp2f(10 * unit_from_u32(hash_u32(3 * i + 2)) - 7);
        const float got = kernel_over_fog((enum cranny_kernel)kernel, 4, from, to, rate);
        const double want = over_fog(kernel, 4, (double)from, (double)to, (double)rate);
        CHECK_MSG(fabs((double)got - want) < 4e-5, "%s, %g to %g, rate %g: %.7g, expected %.7g",
                  kernels[kernel], (double)from, (double)to, (double)rate, (double)got, want);
    }
}

/* A ray by itself through boxes and crossings, against slices of it. */
static void test_passage(void)
{
    for (uint32_t i = 0; i < 30; i++) {
        struct passage passage;
        passage_clear(&passage);
        double edges[40], rates[20], crossings[8];
        const uint32_t boxes = i % 12, trees = i % 7;
        for (uint32_t b = 0; b < boxes; b++) {
            edges[2 * b] = 8 * (double)unit_from_u32(hash_u32(100 * i + 3 * b));
            edges[2 * b + 1] =
                edges[2 * b] + 3 * (double)unit_from_u32(hash_u32(100 * i + 3 * b + 1));
            rates[b] = 0.4 * (double)unit_from_u32(hash_u32(100 * i + 3 * b + 2));
            passage_enter(&passage, (float)edges[2 * b], (float)edges[2 * b + 1], (float)rates[b]);
        }
        for (uint32_t t = 0; t < trees; t++) {
            crossings[t] = 12 * (double)unit_from_u32(hash_u32(100 * i + 50 + t));
            passage_cross(&passage, (float)crossings[t], t, 0);
        }
        const int kernel = (int)(i % 3), slices = 60000;
        const double end = 12, step = end / slices;
        double left = 1, seen = 0;
        for (int s = 0; s < slices; s++) {
            const double t = (s + 0.5) * step;
            double rate = 0, rest = 1;
            for (uint32_t b = 0; b < boxes; b++)
                rate += t > edges[2 * b] && t < edges[2 * b + 1] ? rates[b] : 0;
            for (uint32_t c = 0; c < trees; c++)
                rest *= fabs(crossings[c] - t) <= 0.5 * step ? 0.7 : 1;
            rest *= exp(-rate * step);
            seen += left * (1 - rest) * rho(kernel, 5, t);
            left *= rest;
        }
        const struct passage_rules rules = {
            CRANNY_DIMMING_KERNEL, (enum cranny_kernel)kernel, {5, 5}, 0.3f};
        float values[2] = {(float)rho(kernel, 5, end), 1};
        passage_apply(&passage, &rules, values);
        CHECK_NEAR(values[0], seen + left * rho(kernel, 5, end), 2e-4);
        CHECK_NEAR(values[1], seen + left, 2e-4);
        const struct passage_rules plain = {
            CRANNY_DIMMING_PLAIN, (enum cranny_kernel)kernel, {5, 5}, 0.3f};
        values[0] = values[1] = 0.5f;
        passage_apply(&passage, &plain, values);
        CHECK_NEAR(values[0], 0.5 * left, 1e-4);
    }
}

/* More on the way than is kept in order: nothing is lost of what is taken. */
static void test_long_queues(void)
{
    struct passage passage;
    passage_clear(&passage);
    enum { COUNT = 3 * PASSAGE_MAX };
    for (uint32_t i = 0; i < COUNT; i++) {
        const uint32_t place = i * 77 % COUNT;
        passage_cross(&passage, (float)place, place, 0);
        passage_enter(&passage, (float)place, (float)place + 1, 0.01f);
    }
    CHECK_INT(passage.crossing_count, PASSAGE_MAX);
    CHECK_INT(passage.further_crossings, COUNT - PASSAGE_MAX);
    CHECK_NEAR(passage.further_crossing, PASSAGE_MAX, 0);
    CHECK_NEAR(passage.further_fog, PASSAGE_MAX, 0);
    CHECK_NEAR(passage.crossings[PASSAGE_MAX - 1].distance, PASSAGE_MAX - 1, 0);
    for (int dimming = 0; dimming < 2; dimming++) {
        const struct passage_rules rules = {
            (enum cranny_dimming)dimming, CRANNY_KERNEL_HARD, {1e6f, 1e6f}, 0.01f};
        float values[2] = {1, 1};
        passage_apply(&passage, &rules, values);
        CHECK_NEAR(values[0], pow(0.99, COUNT) * exp(-0.01 * COUNT), 1e-5);
    }
    /* Two reports of one crossing, and leaves with two faces. */
    passage_clear(&passage);
    passage_cross(&passage, 1, 5, 1e-6f);
    passage_cross(&passage, 1, 5, 1e-6f);
    passage_cross(&passage, 1.0000005f, 5, 1e-6f);
    passage_cross(&passage, 1, 6, 1e-6f);
    CHECK_INT(passage.crossing_count, 2);
}

/* Sheets over a point, all trees: 0.5^k, whatever the packet. */
static void test_crossings(void)
{
    for (int sheets = 0; sheets < 24; sheets += sheets < 6 ? 1 : 6)
        for (int packet = 0; packet < 3; packet++) {
            struct cranny_scene *scene = new_scene();
            for (int s = 0; s < sheets; s++)
                add_role(scene,
                         quad_mesh(scene, (double[3]){-5e3, 1 + s, -5e3}, (double[3]){1e4, 0, 0},
                                   (double[3]){0, 0, 1e4}, 0, 1),
                         identity, CRANNY_ROLE_TREE, 0);
            struct cranny_gather_params params = kernel_params(CRANNY_KERNEL_HARD, 1e9f, 1e9f, 256);
            params.packet = (enum cranny_packet)packet;
            for (int dimming = 0; dimming < 2; dimming++) {
                struct cranny_tracer *tracer =
                    role_tracer(scene, (enum cranny_dimming)dimming, 0.5f);
                float values[2];
                look_up(tracer, (vec3){0, 0, 0}, &params, values);
                CHECK_MSG(fabs((double)values[0] - pow(0.5, sheets)) < 2e-3,
                          "%d sheets, packet %d, dimming %d: %g", sheets, packet, dimming,
                          (double)values[0]);
                cranny_tracer_destroy(&tracer);
            }
            cranny_scene_destroy(&scene);
        }
}

/* A turned, stretched and moved place. */
static void slanted(double scale, double shift, double m[12])
{
    const double c = cos(0.7), s = sin(0.7);
    const double rows[12] = {scale * c, -scale * s,        0,           shift,
                             scale * s, scale * c,         0,           shift,
                             0,         0.5 * scale * 0.2, 1.5 * scale, -shift};
    memcpy(m, rows, sizeof rows);
}

/* Random small triangles in a box: a shrub. */
static uint32_t shrub_mesh(struct cranny_scene *scene, uint32_t leaves, float size, uint32_t seed)
{
    vec3 *positions = malloc(3 * leaves * sizeof *positions);
    uint32_t(*corners)[3] = malloc(leaves * sizeof *corners);
    for (uint32_t i = 0; i < 3 * leaves; i++)
        for (uint32_t k = 0; k < 3; k++) {
            const uint32_t base = hash_combine(seed, 3 * (i / 3) + k);
            positions[i][k] = (float)(k + 1) * 0.5f * unit_from_u32(base) +
                              size * unit_from_u32(hash_combine(seed + 1, 3 * i + k));
        }
    for (uint32_t i = 0; i < leaves; i++)
        memcpy(corners[i], (uint32_t[3]){3 * i, 3 * i + 1, 3 * i + 2}, 12);
    const uint32_t mesh = add_mesh(scene, 3 * leaves, positions, NULL, leaves, corners, 0);
    free(positions);
    free(corners);
    return mesh;
}

/* Rays from one point at places within a radius of another. */
static void aim(const vec3 origin, const vec3 target, float radius, struct ray_block *block)
{
    for (uint32_t i = 0; i < RAY_BLOCK; i++) {
        double d[3], length = 0;
        for (uint32_t k = 0; k < 3; k++) {
            d[k] = (double)target[k] - (double)origin[k] +
                   (2 * (double)unit_from_u32(hash_u32(3 * i + k)) - 1) * (double)radius;
            length += d[k] * d[k];
        }
        block->x[i] = (float)(d[0] / sqrt(length));
        block->y[i] = (float)(d[1] / sqrt(length));
        block->z[i] = (float)(d[2] / sqrt(length));
        block->distance[i] = INFINITY;
    }
    block->reach = INFINITY;
    block->ids = 17;
}

/* What the tracer lets through of a block's rays. */
static void rests(const struct cranny_tracer *tracer, enum cranny_packet packet, const vec3 origin,
                  const struct ray_block *block, float rest[RAY_BLOCK])
{
    float values[2][RAY_BLOCK];
    for (int i = 0; i < RAY_BLOCK; i++)
        values[0][i] = values[1][i] = 1;
    ray_block_dim(tracer, packet, CRANNY_KERNEL_HARD, (float[2]){1e9f, 1e9f}, origin, block,
                  RAY_BLOCK, values);
    memcpy(rest, values[0], sizeof values[0]);
}

/* Length of a ray in a mesh's box, measured in the mesh's space, in double. */
static double length_in_box(const double m[12], const double low[3], const double high[3],
                            const vec3 origin, const struct ray_block *block, int ray)
{
    double inverse[9], enter = 0, leave = INFINITY, square = 0;
    CHECK(transform_inverse3(m, inverse));
    for (int k = 0; k < 3; k++) {
        const double *row = inverse + 3 * k;
        const double step = row[0] * (double)block->x[ray] + row[1] * (double)block->y[ray] +
                            row[2] * (double)block->z[ray];
        const double start = row[0] * (origin[0] - m[3]) + row[1] * (origin[1] - m[7]) +
                             row[2] * (origin[2] - m[11]);
        enter = fmax(enter, fmin((low[k] - start) / step, (high[k] - start) / step));
        leave = fmin(leave, fmax((low[k] - start) / step, (high[k] - start) / step));
        square += step * step;
    }
    return leave > enter ? (leave - enter) * sqrt(square) : 0;
}

static void mesh_bounds(const struct cranny_scene *scene, uint32_t mesh, double low[3],
                        double high[3])
{
    const struct cranny_mesh *view = cranny_scene_mesh(scene, mesh);
    for (int k = 0; k < 3; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
        for (uint32_t v = 0; v < view->vertex_count; v++) {
            low[k] = fmin(low[k], (double)view->positions[v][k]);
            high[k] = fmax(high[k], (double)view->positions[v][k]);
        }
    }
}

/* One box: exp(−σ s); many in one place: the same. */
static void test_boxes(void)
{
    const vec3 origin = {3, 2, -9}, target = {4, 6, -1};
    struct ray_block block;
    aim(origin, target, 2, &block);
    float one[RAY_BLOCK], many[RAY_BLOCK];
    for (int copies = 1; copies <= 400; copies = copies * 3 + 1) {
        struct cranny_scene *scene = new_scene();
        const uint32_t shrub = shrub_mesh(scene, 60, 0.4f, 5);
        double place[12], low[3], high[3];
        slanted(2, 4, place);
        for (int i = 0; i < copies; i++)
            add_role(scene, shrub, place, CRANNY_ROLE_SHRUB, 0);
        struct cranny_tracer *tracer = role_tracer(scene, CRANNY_DIMMING_PLAIN, 0.5f);
        struct cranny_tracer_info info;
        cranny_tracer_get_info(tracer, &info);
        CHECK_INT(info.fog_boxes, copies);
        CHECK(info.fog_bytes > 0 && info.fog_bytes <= info.bytes && info.trees == 0);
        mesh_bounds(scene, shrub, low, high);
        const double density = (double)tracer->boxes[0].weight[0] * 2 / (high[0] - low[0]) * copies;
        CHECK(density > 0.1);
        int met = 0;
        for (int packet = 0; packet < 3; packet++) {
            rests(tracer, (enum cranny_packet)packet, origin, &block, many);
            for (int i = 0; i < RAY_BLOCK; i++) {
                const double s = length_in_box(place, low, high, origin, &block, i);
                CHECK_NEAR(many[i], exp(-density * s), 2e-5);
                met += s > 0;
            }
            if (copies == 1)
                memcpy(one, many, sizeof one);
            for (int i = 0; i < RAY_BLOCK; i++)
                CHECK_NEAR(many[i], one[i], 2e-5);
        }
        CHECK_MSG(met > 60 && met < 180, "%d of 192 rays meet the box", met);
        finish(&tracer, &scene);
    }
}

/* A row of boxes, each half over the next: as dark as one that is as long as the row, or less than
 * 15 % off in depth. */
static void test_overlap(void)
{
    enum { ROW = 24 };
    struct cranny_scene *scene = new_scene();
    const uint32_t shrub = shrub_mesh(scene, 60, 0.4f, 5);
    double low[3], high[3];
    mesh_bounds(scene, shrub, low, high);
    for (int i = 0; i < ROW; i++) {
        double place[12];
        memcpy(place, identity, sizeof place);
        place[3] = 0.5 * (high[0] - low[0]) * i;
        add_role(scene, shrub, place, CRANNY_ROLE_SHRUB, 0);
    }
    struct cranny_tracer *tracer = role_tracer(scene, CRANNY_DIMMING_PLAIN, 0.5f);
    const double half = tracer->boxes[ROW / 2].weight[0], end = tracer->boxes[0].weight[0];
    const double side = 0.5 * (high[0] - low[0]);
    struct ray_block block = {.x = {1}, .distance = {INFINITY}};
    float values[2][RAY_BLOCK] = {{1}, {1}};
    const vec3 origin = {-5, (float)(0.5 * (low[1] + high[1])), (float)(0.5 * (low[2] + high[2]))};
    ray_block_dim(tracer, CRANNY_PACKET_1, CRANNY_KERNEL_HARD, (float[2]){1e9f, 1e9f}, origin,
                  &block, 1, values);
    /* An end box is alone over half its length: 1 / 1.5; the others everywhere with one more. */
    CHECK_NEAR(half / end, 1.5 / 2, 0.03);
    const double single = half / side * 2; /* density of one alone */
    CHECK_NEAR(-log((double)values[0][0]) / (single * side * (ROW + 1)), 1, 0.15);
    finish(&tracer, &scene);
}

/* The box of a shrub lets as much through as its leaves, over lines that are even in the box. */
static void test_density(void)
{
    for (uint32_t kind = 0; kind < 4; kind++) {
        struct cranny_error why;
        struct cranny_scene *scene = new_scene();
        struct cranny_material half = cranny_material_default();
        half.alpha_mode = CRANNY_ALPHA_BLEND;
        half.opacity = 0.4f;
        uint32_t blended;
        CHECK_OK(cranny_scene_add_material(scene, &half, &blended, &why), why);
        const uint32_t mesh = kind == 3
                                  ? quad_mesh(scene, (double[3]){0, 0, 0}, (double[3]){1, 0, 0},
                                              (double[3]){0, 1, 0}, blended, 1)
                                  : shrub_mesh(scene, 10u << (2 * kind), 0.3f, 11 + kind);
        add_role(scene, mesh, identity, CRANNY_ROLE_SHRUB, 0);
        struct cranny_tracer *fog = role_tracer(scene, CRANNY_DIMMING_PLAIN, 0.5f);
        struct cranny_tracer *leaves = new_tracer(scene);
        double low[3], high[3], centre[3], open = 0, rest = 0;
        int lines = 0;
        mesh_bounds(scene, mesh, low, high);
        low[2] -= kind == 3 ? 0.03125 : 0; /* the card's box */
        high[2] += kind == 3 ? 0.03125 : 0;
        double radius = 0;
        for (int k = 0; k < 3; k++) {
            centre[k] = 0.5 * (low[k] + high[k]);
            radius += pow(0.5 * (high[k] - low[k]), 2);
        }
        radius = sqrt(radius);
        /* Chords of the sphere around the box between two even points on it are even lines. */
        for (uint32_t i = 0; i < 20000; i++) {
            double ends[2][3], length = 0;
            for (uint32_t e = 0; e < 2; e++) {
                const double z = 2 * (double)unit_from_u32(hash_u32(4 * i + 2 * e)) - 1;
                const double a = 2 * acos(-1) * (double)unit_from_u32(hash_u32(4 * i + 2 * e + 1));
                ends[e][0] = centre[0] + radius * sqrt(1 - z * z) * cos(a);
                ends[e][1] = centre[1] + radius * sqrt(1 - z * z) * sin(a);
                ends[e][2] = centre[2] + radius * z;
            }
            struct ray_block block = {.ids = i, .distance = {INFINITY}};
            vec3 origin, d;
            for (int k = 0; k < 3; k++)
                length += pow(ends[1][k] - ends[0][k], 2);
            for (int k = 0; k < 3; k++) {
                origin[k] = (float)ends[0][k];
                d[k] = (float)((ends[1][k] - ends[0][k]) / sqrt(length));
            }
            block.x[0] = d[0];
            block.y[0] = d[1];
            block.z[0] = d[2];
            if (length_in_box(identity, low, high, origin, &block, 0) <= 0)
                continue;
            float values[2][RAY_BLOCK] = {{1}, {1}}, distance;
            ray_block_dim(fog, CRANNY_PACKET_1, CRANNY_KERNEL_HARD, (float[2]){1e9f, 1e9f}, origin,
                          &block, 1, values);
            trace_ray(leaves, origin, d, INFINITY, i, &distance, NULL);
            rest += (double)values[0][0];
            open += isinf(distance);
            lines++;
        }
        CHECK_MSG(fabs(rest - open) < 0.015 * lines && open < lines,
                  "kind %u: fog lets %g through, leaves %g, of %d", kind, rest, open, lines);
        cranny_tracer_destroy(&leaves);
        finish(&fog, &scene);
    }
}

/* Balls around a point, as trees: a shared mesh, nested; every ray crosses each once, and its
 * edges, too. */
static void test_shared_trees(void)
{
    for (int dimming = 0; dimming < 2; dimming++)
        for (int packet = 0; packet < 3; packet++) {
            struct cranny_scene *scene = new_scene();
            const uint32_t ball = sphere_mesh(scene, (double[3]){0, 0, 0}, 1, 24);
            for (int b = 0; b < 4; b++) { /* two in one place are two */
                const int i = b ? b : 1;
                const double place[12] = {i, 0, 0, 0, 0, -i, 0, 0, 0, 0, i, 0};
                add_role(scene, ball, place, CRANNY_ROLE_TREE, 0);
            }
            const double around[12] = {10, 0, 0, 0, 0, 10, 0, 0, 0, 0, 10, 0};
            const uint32_t solid = add_role(scene, ball, around, CRANNY_ROLE_SOLID, 0);
            struct cranny_tracer *tracer = role_tracer(scene, (enum cranny_dimming)dimming, 0.5f);
            struct cranny_tracer_info info;
            cranny_tracer_get_info(tracer, &info);
            CHECK_INT(info.trees, 4);
            CHECK_INT(info.solids, 1);
            CHECK(info.tree_bytes > 0 && info.seconds > 0);
            struct cranny_gather_params params = kernel_params(CRANNY_KERNEL_HARD, 20, 2.5f, 4096);
            params.packet = (enum cranny_packet)packet;
            struct cranny_error why;
            float values[1][2], back;
            CHECK_OK(cranny_gather(tracer, 1, (const vec3[]){{0, 0, 0}}, (const vec3[]){{0, 1, 0}},
                                   NULL, &params, values, &back, &why),
                     why);
            CHECK_NEAR(back, 1, 0); /* of the solid ball alone, which all rays see from within */
            CHECK_NEAR(values[0][0], 0, 0);
            /* Beyond 2.5 m the last ball's share, and the rest, are free; plainly, they dim. */
            CHECK_NEAR(values[0][1], dimming == CRANNY_DIMMING_KERNEL ? 0.125 : 0.0625, 1e-4);
            struct cranny_hit hit;
            float distance;
            CHECK_OK(cranny_trace(tracer, 1, (const vec3[]){{0, 0, 0}}, (const vec3[]){{0, 0, 1}},
                                  &distance, &hit, 1, &why),
                     why);
            CHECK_NEAR(distance, 10, 0.1);
            CHECK_INT(hit.instance, solid);
            finish(&tracer, &scene);
        }
}

/* A chequered leaf stops half of what meets it, and of that a tree takes half. */
static void test_tree_alpha(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    uint8_t checker[64];
    for (int i = 0; i < 64; i++)
        checker[i] = (i % 8 / 4 + i / 32) % 2 ? 255 : 0;
    struct cranny_alpha_texture texture = {8, 8, CRANNY_WRAP_REPEAT, CRANNY_WRAP_REPEAT, checker};
    CHECK_OK(cranny_scene_add_texture(scene, &texture, NULL, &why), why);
    struct cranny_material leaf = cranny_material_default();
    leaf.alpha_mode = CRANNY_ALPHA_MASK;
    leaf.alpha_cutoff = 0.5f;
    leaf.alpha_texture = 0;
    uint32_t masked;
    CHECK_OK(cranny_scene_add_material(scene, &leaf, &masked, &why), why);
    add_role(scene,
             quad_mesh(scene, (double[3]){-500, 1, -500}, (double[3]){1000, 0, 0},
                       (double[3]){0, 0, 1000}, masked, 10000),
             identity, CRANNY_ROLE_TREE, 0);
    const struct cranny_gather_params params = kernel_params(CRANNY_KERNEL_HARD, 1e6f, 0.5f, 16384);
    struct cranny_tracer *tracer = role_tracer(scene, CRANNY_DIMMING_KERNEL, 0.5f);
    float values[2];
    look_up(tracer, (vec3){0, 0, 0}, &params, values);
    CHECK_NEAR(values[0], 0.75, 0.01);
    CHECK_NEAR(values[1], 1, 0);
    finish(&tracer, &scene);
}

/* Sheets that stop each ray by chance, as solids: what kernel dimming is the mean of. */
static void test_stochastic_truth(void)
{
    struct cranny_error why;
    const float opacities[] = {0.2f, 0.5f, 0.8f};
    for (int o = 0; o < 3; o++) {
        struct cranny_scene *scenes[2] = {new_scene(), new_scene()};
        struct cranny_material sheer = cranny_material_default();
        sheer.alpha_mode = CRANNY_ALPHA_BLEND;
        sheer.opacity = opacities[o];
        for (int s = 0; s < 2; s++) {
            uint32_t material = 0;
            if (s == 0)
                CHECK_OK(cranny_scene_add_material(scenes[s], &sheer, &material, &why), why);
            for (int i = 0; i < 7; i++)
                add_role(scenes[s],
                         quad_mesh(scenes[s], (double[3]){-30, 0.5 + i, -20}, (double[3]){50, 0, i},
                                   (double[3]){i, 0, 60}, material, 1),
                         identity, s == 0 ? CRANNY_ROLE_SOLID : CRANNY_ROLE_TREE, 0);
            add_role(scenes[s],
                     quad_mesh(scenes[s], (double[3]){-40, 9, -40}, (double[3]){80, 0, 0},
                               (double[3]){0, 0, 80}, 0, 1),
                     identity, CRANNY_ROLE_SOLID, 0);
        }
        struct cranny_tracer *truth = new_tracer(scenes[0]);
        struct cranny_tracer *trees = role_tracer(scenes[1], CRANNY_DIMMING_KERNEL, opacities[o]);
        for (int kernel = 0; kernel < 3; kernel++) {
            const struct cranny_gather_params many =
                kernel_params((enum cranny_kernel)kernel, 4, 30, 65536);
            const struct cranny_gather_params few =
                kernel_params((enum cranny_kernel)kernel, 4, 30, 8192);
            float want[2], got[2];
            look_up(truth, (vec3){0, 0, 0}, &many, want);
            look_up(trees, (vec3){0, 0, 0}, &few, got);
            for (int k = 0; k < 2; k++)
                CHECK_MSG(fabs((double)(got[k] - want[k])) < 0.006,
                          "%s, opacity %g: %g, stochastic %g", kernels[kernel],
                          (double)opacities[o], (double)got[k], (double)want[k]);
        }
        finish(&truth, &scenes[0]);
        finish(&trees, &scenes[1]);
    }
}

/* A wood: trees, shrubs, a floor; a roof, and what is above it and must not count. */
static struct cranny_scene *wood(void)
{
    struct cranny_scene *scene = new_scene();
    const uint32_t floor = quad_mesh(scene, (double[3]){-50, 0, -50}, (double[3]){0, 0, 100},
                                     (double[3]){100, 0, 0}, 0, 1);
    const uint32_t meshes[2] = {shrub_mesh(scene, 300, 0.5f, 1), shrub_mesh(scene, 80, 0.5f, 2)};
    add_role(scene, floor, identity, CRANNY_ROLE_SOLID, 0);
    for (int i = 0; i < 2; i++)
        add_role(scene,
                 quad_mesh(scene, (double[3]){-900, 15 + 5 * i, -900}, (double[3]){1800, 0, 0},
                           (double[3]){0, 0, 1800}, 0, 1),
                 identity, i ? CRANNY_ROLE_TREE : CRANNY_ROLE_SOLID, 0);
    for (uint32_t i = 0; i < 600; i++) {
        const double x = 40 * (double)unit_from_u32(hash_u32(2 * i)) - 20;
        const double z = 40 * (double)unit_from_u32(hash_u32(2 * i + 1)) - 20, s = i % 3 ? 1 : 4;
        const double place[12] = {s, 0, 0, x, 0, s, 0, 0, 0, 0, s, z};
        add_role(scene, meshes[i % 2], place, i % 3 ? CRANNY_ROLE_SHRUB : CRANNY_ROLE_TREE, 0);
    }
    return scene;
}

static void wood_values(const struct cranny_tracer *tracer,
                        const struct cranny_gather_params *params, bool back, bool sphere,
                        float out[POINTS][18])
{
    struct cranny_error why;
    static vec3 positions[POINTS], normals[POINTS];
    static float backs[POINTS], visibility[POINTS][2], harmonics[POINTS][2][9];
    for (uint32_t i = 0; i < POINTS; i++) {
        positions[i][0] = 30 * unit_from_u32(hash_u32(2 * i)) - 15;
        positions[i][1] = 0.01f;
        positions[i][2] = 30 * unit_from_u32(hash_u32(2 * i + 1)) - 15;
        memcpy(normals[i], (vec3){0, 1, 0}, sizeof normals[i]);
    }
    if (sphere)
        CHECK_OK(cranny_gather_sphere(tracer, POINTS, positions, params, harmonics,
                                      back ? backs : NULL, &why),
                 why);
    else
        CHECK_OK(cranny_gather(tracer, POINTS, positions, normals, NULL, params, visibility,
                               back ? backs : NULL, &why),
                 why);
    memset(out, 0, POINTS * sizeof *out);
    for (int i = 0; i < POINTS; i++)
        memcpy(out[i], sphere ? harmonics[i][0] : visibility[i], sphere ? 72 : 8);
}

static double largest_difference(float a[POINTS][18], float b[POINTS][18])
{
    double largest = 0;
    for (int i = 0; i < POINTS; i++)
        for (int k = 0; k < 18; k++)
            largest = fmax(largest, fabs((double)a[i][k] - (double)b[i][k]));
    return largest;
}

/* Threads and shortened rays never change a bit; packets hardly anything. */
static void test_invariance(void)
{
    static float base[POINTS][18], other[POINTS][18];
    struct cranny_scene *scene = wood();
    for (int kernel = 0; kernel < 3; kernel++)
        for (int dimming = 0; dimming < 2; dimming++)
            for (int sphere = 0; sphere < 2; sphere++) {
                struct cranny_tracer *tracer =
                    role_tracer(scene, (enum cranny_dimming)dimming, 0.5f);
                struct cranny_gather_params params =
                    kernel_params((enum cranny_kernel)kernel, 12, 2, 100);
                params.threads = 1;
                wood_values(tracer, &params, true, sphere, base);
                params.threads = 3;
                wood_values(tracer, &params, false, sphere, other);
                CHECK_MSG(memcmp(base, other, sizeof base) == 0,
                          "%s, dimming %d, sphere %d: threads or reach change %g", kernels[kernel],
                          dimming, sphere, largest_difference(base, other));
                double mean = 0;
                for (int i = 0; i < POINTS; i++)
                    mean += (double)base[i][0] / POINTS / (sphere ? 3.5449 : 1);
                CHECK_MSG(mean > 0.02 && mean < 0.9, "mean %g: the test sees nothing", mean);
                for (int packet = 0; packet < 3; packet++) {
                    params.packet = (enum cranny_packet)packet;
                    wood_values(tracer, &params, false, sphere, other);
                    const double difference = largest_difference(base, other);
                    CHECK_MSG(difference < (sphere ? 0.13 : 0.011), "packet %d: %g", packet,
                              difference);
                }
                cranny_tracer_destroy(&tracer);
            }
    cranny_scene_destroy(&scene);
}

/* Nothing dimming in reach: the same bits as without roles. */
static void test_no_cost(void)
{
    static float base[POINTS][18], other[POINTS][18];
    struct cranny_scene *scene = new_scene();
    add_role(scene, sphere_mesh(scene, (double[3]){0, 3, 0}, 2, 24), identity, CRANNY_ROLE_SOLID,
             0);
    struct cranny_tracer *plain = new_tracer(scene);
    struct cranny_tracer *roles = role_tracer(scene, CRANNY_DIMMING_KERNEL, 0.5f);
    CHECK(!tracer_dims(roles));
    const struct cranny_gather_params params = cranny_gather_params_default();
    wood_values(plain, &params, true, false, base);
    wood_values(roles, &params, true, false, other);
    CHECK(memcmp(base, other, sizeof base) == 0);
    CHECK_INT(cranny_tracer_bytes(plain), cranny_tracer_bytes(roles));
    cranny_tracer_destroy(&plain);
    finish(&roles, &scene);
}

/* The first quarter of the rays decides on the rest, by what fog makes of them, too. */
static void test_adaptive(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = wood();
    struct cranny_tracer *tracer = role_tracer(scene, CRANNY_DIMMING_KERNEL, 0.5f);
    const struct cranny_gather_params params = kernel_params(CRANNY_KERNEL_HARD, 100, 2, 256);
    struct gather_plan *plan;
    CHECK_OK(gather_plan_create(&params, true, &plan, &why), why);
    const struct gather_point points[2] = {{{0, 0.01f, 0}, {0, 1, 0}, {0, 1, 0}, 0, 0},
                                           {{0, 90, 0}, {0, 1, 0}, {0, 1, 0}, 0, 1}};
    struct gather_result results[2];
    gather_points(tracer, plan, points, 2, results);
    CHECK_INT(results[0].rays, 256);
    CHECK(results[1].rays < 80 && results[1].visibility[0] == 1);
    gather_plan_destroy(&plan);
    finish(&tracer, &scene);
}

/* What is not there is in no structure, whether roles count or not. */
static void test_absent(void)
{
    const struct cranny_gather_params params = kernel_params(CRANNY_KERNEL_HARD, 100, 1, 256);
    for (int roles = 0; roles < 2; roles++)
        for (int what = 0; what < 5; what++) {
            struct cranny_error why;
            struct cranny_scene *scene = new_scene();
            const uint32_t ball = sphere_mesh(scene, (double[3]){0, 2, 0}, 1, 8);
            const enum cranny_role role = what == 0   ? CRANNY_ROLE_IGNORED
                                          : what == 1 ? CRANNY_ROLE_GRASS
                                          : what == 2 ? CRANNY_ROLE_SOLID
                                          : what == 3 ? CRANNY_ROLE_TREE
                                                      : CRANNY_ROLE_SHRUB;
            add_role(scene, ball, identity, role, what >= 2);
            struct cranny_tracer_params with = cranny_tracer_params_default();
            struct cranny_tracer *tracer;
            with.roles = roles;
            CHECK_OK(cranny_tracer_create(scene, &with, &tracer, &why), why);
            float values[2];
            look_up(tracer, (vec3){0, 0, 0}, &params, values);
            CHECK_MSG((values[0] < 1) == (what == 1 && !roles), "roles %d, %d: %g", roles, what,
                      (double)values[0]);
            /* And the ground lies under what is there. */
            cranny_tracer_destroy(&tracer);
            add_quad(scene, (double[3]){-1, -3, -1}, (double[3]){0, 0, 2}, (double[3]){2, 0, 0}, 0);
            const double deep[12] = {1, 0, 0, 0, 0, 1, 0, -50, 0, 0, 1, 0};
            add_role(scene, ball, deep, CRANNY_ROLE_IGNORED, 0);
            with.ground = true;
            CHECK_OK(cranny_tracer_create(scene, &with, &tracer, &why), why);
            float distance;
            CHECK_OK(cranny_trace(tracer, 1, (const vec3[]){{9, 0, 0}}, (const vec3[]){{0, -1, 0}},
                                  &distance, NULL, 1, &why),
                     why);
            CHECK_NEAR(distance, 3, 1e-6);
            finish(&tracer, &scene);
        }
}

/* Flat, empty, transparent and singular shrubs; none of them stops anything or breaks. */
static void test_hostile(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    struct cranny_material gone = cranny_material_default();
    gone.alpha_mode = CRANNY_ALPHA_BLEND;
    gone.opacity = 0;
    uint32_t clear;
    CHECK_OK(cranny_scene_add_material(scene, &gone, &clear, &why), why);
    const vec3 same[3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
    const uint32_t corners[1][3] = {{0, 1, 2}};
    const uint32_t meshes[] = {add_mesh(scene, 3, same, NULL, 1, corners, 0),
                               add_mesh(scene, 3, same, NULL, 0, corners, 0),
                               quad_mesh(scene, (double[3]){-9, 1, -9}, (double[3]){20, 0, 0},
                                         (double[3]){0, 0, 20}, clear, 1),
                               shrub_mesh(scene, 20, 1, 3)};
    const double flat[12] = {1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0};
    const double huge[12] = {1e30, 0, 0, 1e30, 0, 1e30, 0, 1e30, 0, 0, 1e30, 1e30};
    for (int m = 0; m < 4; m++)
        for (int role = 1; role < 3; role++) {
            add_role(scene, meshes[m], flat, (enum cranny_role)role, 0);
            if (m != 2)
                add_role(scene, meshes[m], huge, (enum cranny_role)role, 0);
        }
    struct cranny_tracer *tracer = role_tracer(scene, CRANNY_DIMMING_KERNEL, 0.5f);
    const struct cranny_gather_params params = kernel_params(CRANNY_KERNEL_HARD, 100, 1, 64);
    float values[2];
    look_up(tracer, (vec3){0, 2, 0}, &params, values);
    CHECK_NEAR(values[0], 1, 0);
    cranny_tracer_destroy(&tracer);
    struct cranny_tracer_params wrong = cranny_tracer_params_default();
    wrong.tree_opacity = 1.5f;
    CHECK_INT(cranny_tracer_create(scene, &wrong, &tracer, &why), CRANNY_USAGE);
    CHECK(strstr(why.message, "tree_opacity is 1.5") && !tracer);
    wrong.tree_opacity = NAN;
    CHECK_INT(cranny_tracer_create(scene, &wrong, &tracer, &why), CRANNY_USAGE);
    wrong = cranny_tracer_params_default();
    wrong.fog_density = -1;
    CHECK_INT(cranny_tracer_create(scene, &wrong, &tracer, &why), CRANNY_USAGE);
    CHECK(strstr(why.message, "fog_density is -1") != NULL);
    CHECK_INT(cranny_gather_sphere(NULL, 0, NULL, NULL, NULL, NULL, &why), CRANNY_USAGE);
    cranny_scene_destroy(&scene);
}

int main(void)
{
    test_fog_kernel();
    test_passage();
    test_long_queues();
    test_crossings();
    test_boxes();
    test_overlap();
    test_density();
    test_shared_trees();
    test_tree_alpha();
    test_stochastic_truth();
    test_invariance();
    test_no_cost();
    test_adaptive();
    test_absent();
    test_hostile();
    return check_end("fog");
}
