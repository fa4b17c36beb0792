/* Trees and shrubs by what they take of rays, against tracing their triangles: what structures
 * cost, how fast rays are, how far off the ground's visibility is. Usage: bench-fog [--points N]
 * [--rays N] [--ground PATTERN] SCENE; the scene's file says roles. */
#include "base/sequence.h"
#include "scene/scene.h"
#include "trace/gather.h"
#include "trace/tracer.h"

#include <fnmatch.h>
#include <omp.h>
#include <time.h>

struct bench {
    struct cranny_scene *scene;
    enum cranny_role *roles; /* the file's */
    struct gather_point *points;
    struct gather_result *truth, *results;
    size_t count;
    struct cranny_gather_params params;
};

/* Processor seconds over all cores, so that other programs disturb less. */
static double busy_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return ((double)t.tv_sec + (double)t.tv_nsec * 1e-9) / omp_get_num_procs();
}

static void stop(const struct cranny_error *why)
{
    fprintf(stderr, "bench-fog: %s\n", why->message);
    exit(1);
}

/* What each of the file's roles is for one measurement. */
struct cast {
    enum cranny_role of[CRANNY_ROLE_IGNORED + 1];
};
#define CAST(SOLID, TREE, SHRUB, GRASS)                                                            \
    (struct cast)                                                                                  \
    {                                                                                              \
        {                                                                                          \
            CRANNY_ROLE_##SOLID, CRANNY_ROLE_##TREE, CRANNY_ROLE_##SHRUB, CRANNY_ROLE_##GRASS,     \
                CRANNY_ROLE_IGNORED                                                                \
        }                                                                                          \
    }

static struct cranny_tracer *build(struct bench *b, struct cast cast,
                                   struct cranny_tracer_params params, double *seconds)
{
    struct cranny_error why;
    struct cranny_tracer *tracer;
    for (size_t i = 0; i < b->scene->instance_count; i++)
        b->scene->instances[i].view.role = cast.of[b->roles[i]];
    const double start = busy_seconds();
    params.roles = true;
    if (cranny_tracer_create(b->scene, &params, &tracer, &why) != CRANNY_OK)
        stop(&why);
    if (seconds)
        *seconds = busy_seconds() - start;
    return tracer;
}

/* Returns Mrays/s. */
static double gather(const struct bench *b, const struct cranny_tracer *tracer, int rays,
                     struct gather_result *results)
{
    struct cranny_error why;
    struct gather_plan *plan;
    struct cranny_gather_params params = b->params;
    params.rays = rays;
    if (gather_plan_create(&params, false, &plan, &why) != CRANNY_OK)
        stop(&why);
    const double start = busy_seconds();
#pragma omp parallel
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 1)
        for (size_t i = 0; i < b->count; i++)
            gather_points(tracer, plan, b->points + i, 1, results + i);
        gather_thread_end(saved);
    }
    const double seconds = busy_seconds() - start;
    gather_plan_destroy(&plan);
    return (double)b->count * rays / seconds * 1e-6;
}

/* One triangle of the ground in the world: corner, edges, normal times twice the area. */
struct piece {
    double corner[3], edges[2][3], normal[3], area;
};

static struct piece piece_of(const struct cranny_instance *instance, const struct cranny_mesh *mesh,
                             uint32_t triangle)
{
    struct piece p;
    double corners[3][3];
    for (int c = 0; c < 3; c++)
        transform_point(instance->world_from_object, mesh->positions[mesh->triangles[triangle][c]],
                        corners[c]);
    for (int k = 0; k < 3; k++) {
        p.corner[k] = corners[0][k];
        for (int e = 0; e < 2; e++)
            p.edges[e][k] = corners[e + 1][k] - corners[0][k];
    }
    const double *u = p.edges[0], *v = p.edges[1];
    for (int k = 0; k < 3; k++)
        p.normal[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    p.area =
        sqrt(p.normal[0] * p.normal[0] + p.normal[1] * p.normal[1] + p.normal[2] * p.normal[2]);
    return p;
}

static bool is_ground(const struct bench *b, uint32_t index, const char *pattern)
{
    const struct cranny_instance *instance = cranny_scene_instance(b->scene, index);
    return cranny_instance_exists(instance) && fnmatch(pattern, instance->name, 0) == 0;
}

/* Points even over the ground's area. */
static void place_points(struct bench *b, const char *pattern, size_t wanted)
{
    double total = 0, before = 0;
    b->count = 0;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t i = 0; i < cranny_scene_instance_count(b->scene); i++) {
            const struct cranny_instance *instance = cranny_scene_instance(b->scene, i);
            const struct cranny_mesh *mesh = cranny_scene_mesh(b->scene, instance->mesh);
            for (uint32_t t = 0; is_ground(b, i, pattern) && t < mesh->triangle_count; t++) {
                const struct piece p = piece_of(instance, mesh, t);
                total += pass ? 0 : p.area;
                before += pass ? p.area : 0;
                while (pass && b->count < wanted &&
                       before > ((double)b->count + 0.5) * total / (double)wanted) {
                    struct gather_point *point = &b->points[b->count];
                    const uint32_t id = (uint32_t)b->count++;
                    const double u = sqrt((double)unit_from_u32(hash_u32(2 * id)));
                    const double v = u * (double)unit_from_u32(hash_u32(2 * id + 1));
                    *point = (struct gather_point){.id = id, .extent = 1};
                    for (int k = 0; k < 3; k++) {
                        point->position[k] =
                            (float)(p.corner[k] + (1 - u) * p.edges[0][k] + v * p.edges[1][k]);
                        point->normal[k] = point->face_normal[k] = (float)(p.normal[k] / p.area);
                    }
                }
            }
        }
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Mean, rms and 95th percentile of what is off, for both distances; points that see mostly backs
 * are under houses and do not count. */
static void print_errors(const struct bench *b, const char *name, double rate)
{
    float *absolute = alloc_array(b->count, sizeof *absolute);
    printf("%-46s %6.2f", name, rate);
    for (int k = 0; k < 2 && absolute; k++) {
        double sum = 0, squares = 0;
        size_t n = 0;
        for (size_t i = 0; i < b->count; i++) {
            if (4 * b->truth[i].back_faces > b->truth[i].rays)
                continue;
            const float off = b->results[i].visibility[k] - b->truth[i].visibility[k];
            sum += (double)off;
            squares += (double)off * (double)off;
            absolute[n++] = fabsf(off);
        }
        qsort(absolute, n, sizeof *absolute, compare_floats);
        printf("  %+.4f %.4f %.4f", sum / (double)n, sqrt(squares / (double)n),
               (double)absolute[n * 95 / 100]);
    }
    printf("\n");
    free(absolute);
}

static void compare(struct bench *b, const char *name, struct cast cast,
                    struct cranny_tracer_params params, int rays)
{
    struct cranny_tracer *tracer = build(b, cast, params, NULL);
    const double rate = gather(b, tracer, rays, b->results);
    print_errors(b, name, rate);
    cranny_tracer_destroy(&tracer);
}

/* All instances that are cast as solids, as one mesh of triangles: what replicating them costs. */
static struct cranny_scene *replicate(struct bench *b, enum cranny_role role)
{
    struct cranny_error why;
    struct cranny_scene *copy;
    size_t vertices = 0, triangles = 0, v = 0, t = 0;
    for (uint32_t i = 0; i < cranny_scene_instance_count(b->scene); i++) {
        const struct cranny_mesh *mesh =
            cranny_scene_mesh(b->scene, cranny_scene_instance(b->scene, i)->mesh);
        vertices += b->roles[i] == role ? mesh->vertex_count : 0;
        triangles += b->roles[i] == role ? mesh->triangle_count : 0;
    }
    float(*positions)[3] = alloc_array(vertices, sizeof *positions);
    uint32_t(*corners)[3] = alloc_array(triangles, sizeof *corners);
    for (uint32_t i = 0; positions && corners && i < cranny_scene_instance_count(b->scene); i++) {
        const struct cranny_instance *instance = cranny_scene_instance(b->scene, i);
        const struct cranny_mesh *mesh = cranny_scene_mesh(b->scene, instance->mesh);
        if (b->roles[i] != role)
            continue;
        for (uint32_t k = 0; k < mesh->triangle_count; k++, t++)
            for (int c = 0; c < 3; c++)
                corners[t][c] = (uint32_t)v + mesh->triangles[k][c];
        for (uint32_t k = 0; k < mesh->vertex_count; k++, v++) {
            double p[3];
            transform_point(instance->world_from_object, mesh->positions[k], p);
            for (int a = 0; a < 3; a++)
                positions[v][a] = (float)p[a];
        }
    }
    const struct cranny_mesh mesh = {.name = "",
                                     .vertex_count = (uint32_t)vertices,
                                     .triangle_count = (uint32_t)triangles,
                                     .positions = positions,
                                     .triangles = corners};
    const struct cranny_instance instance = {
        .name = "", .world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    if (!positions || !corners || cranny_scene_create(&copy, &why) != CRANNY_OK)
        exit(1);
    if (cranny_scene_add_mesh(copy, &mesh, NULL, &why) != CRANNY_OK ||
        cranny_scene_add_instance(copy, &instance, NULL, &why) != CRANNY_OK)
        stop(&why);
    free(positions);
    free(corners);
    return copy;
}

/* Best of several builds, in processor seconds over all cores. */
static void build_row(struct bench *b, const char *name, struct cast cast)
{
    double best = INFINITY, wall = INFINITY, fog = INFINITY;
    struct cranny_tracer_info info;
    for (int i = 0; i < 7; i++) {
        double seconds;
        struct cranny_tracer *tracer = build(b, cast, cranny_tracer_params_default(), &seconds);
        cranny_tracer_get_info(tracer, &info);
        best = fmin(best, seconds);
        wall = fmin(wall, info.seconds);
        fog = fmin(fog, info.fog_seconds);
        cranny_tracer_destroy(&tracer);
    }
    printf("%-46s %8.2f ms  %8.2f ms wall (%.2f ms fog)  %9.3f MB\n", name, best * 1e3, wall * 1e3,
           fog * 1e3, (double)info.bytes * 1e-6);
}

static void bench_builds(struct bench *b)
{
    printf("\nshrubs alone: processor time over all cores, best of 7\n");
    build_row(b, "fog boxes", CAST(IGNORED, IGNORED, SHRUB, IGNORED));
    build_row(b, "Embree instances", CAST(IGNORED, IGNORED, SOLID, IGNORED));
    struct cranny_scene *scene = b->scene;
    struct cranny_scene *copy = replicate(b, CRANNY_ROLE_SHRUB);
    enum cranny_role *roles = b->roles;
    enum cranny_role solid = CRANNY_ROLE_SOLID;
    b->scene = copy;
    b->roles = &solid;
    build_row(b, "triangles replicated", CAST(SOLID, SOLID, SOLID, SOLID));
    b->scene = scene;
    b->roles = roles;
    cranny_scene_destroy(&copy);
    printf("\nthe whole scene\n");
    build_row(b, "roles", CAST(SOLID, TREE, SHRUB, GRASS));
    build_row(b, "all solid but grass", CAST(SOLID, SOLID, SOLID, GRASS));
}

static void bench_errors(struct bench *b, int rays)
{
    struct cranny_tracer_params kernel = cranny_tracer_params_default(), plain = kernel;
    plain.dimming = CRANNY_DIMMING_PLAIN;
    struct cranny_tracer *truth = build(b, CAST(SOLID, SOLID, SOLID, GRASS), kernel, NULL);
    const double rate = gather(b, truth, 4 * rays, b->truth);
    cranny_tracer_destroy(&truth);
    printf(
        "\nground, %zu points: Mrays/s; visibility less the truth's at %g m, then %g m: mean, rms,"
        " 95th percentile\n",
        b->count, (double)b->params.distances[0], (double)b->params.distances[1]);
    printf("%-46s %6.2f\n", "truth: all triangles but grass", rate);
    compare(b, "the same, fewer rays", CAST(SOLID, SOLID, SOLID, GRASS), kernel, rays);
    compare(b, "with grass", CAST(SOLID, SOLID, SOLID, SOLID), kernel, rays);
    compare(b, "no trees, no shrubs", CAST(SOLID, IGNORED, IGNORED, GRASS), kernel, rays);
    compare(b, "no shrubs, trees solid", CAST(SOLID, SOLID, IGNORED, GRASS), kernel, rays);
    compare(b, "shrubs fog, trees solid, kernel", CAST(SOLID, SOLID, SHRUB, GRASS), kernel, rays);
    compare(b, "shrubs fog, trees solid, plain", CAST(SOLID, SOLID, SHRUB, GRASS), plain, rays);
    compare(b, "shrubs solid, trees dim, kernel", CAST(SOLID, TREE, SOLID, GRASS), kernel, rays);
    compare(b, "shrubs solid, trees dim, plain", CAST(SOLID, TREE, SOLID, GRASS), plain, rays);
    compare(b, "shrubs fog, trees dim, kernel", CAST(SOLID, TREE, SHRUB, GRASS), kernel, rays);
    compare(b, "shrubs fog, trees dim, plain", CAST(SOLID, TREE, SHRUB, GRASS), plain, rays);
    for (int i = 0; i < 4; i++) {
        char name[64];
        struct cranny_tracer_params other = kernel;
        other.fog_density = (const float[]){0.5f, 0.7f, 1.4f, 2}[i];
        snprintf(name, sizeof name, "shrubs fog × %g, trees solid, kernel",
                 (double)other.fog_density);
        compare(b, name, CAST(SOLID, SOLID, SHRUB, GRASS), other, rays);
        other = kernel;
        other.tree_opacity = (const float[]){0.35f, 0.7f, 0.85f, 1}[i];
        snprintf(name, sizeof name, "shrubs solid, trees dim %g, kernel",
                 (double)other.tree_opacity);
        compare(b, name, CAST(SOLID, TREE, SOLID, GRASS), other, rays);
    }
}

int main(int count, char **arguments)
{
    struct bench b = {.params = cranny_gather_params_default()};
    const char *pattern = "Terrain*", *path = NULL;
    size_t points = 4000;
    int rays = 512;
    for (int i = 1; i < count; i++) {
        if (strcmp(arguments[i], "--points") == 0 && i + 1 < count)
            points = strtoull(arguments[++i], NULL, 10);
        else if (strcmp(arguments[i], "--rays") == 0 && i + 1 < count)
            rays = atoi(arguments[++i]);
        else if (strcmp(arguments[i], "--ground") == 0 && i + 1 < count)
            pattern = arguments[++i];
        else
            path = arguments[i];
    }
    struct cranny_error why;
    if (!path) {
        fprintf(stderr, "bench-fog: name a scene whose file says roles, as cranny-level writes\n");
        return 2;
    }
    if (cranny_scene_load(path, NULL, &b.scene, &why) != CRANNY_OK)
        stop(&why);
    b.roles = alloc_array(b.scene->instance_count, sizeof *b.roles);
    b.points = alloc_array(points, sizeof *b.points);
    b.truth = alloc_array(points, sizeof *b.truth);
    b.results = alloc_array(points, sizeof *b.results);
    if (!b.roles || !b.points || !b.truth || !b.results)
        return 1;
    for (size_t i = 0; i < b.scene->instance_count; i++)
        b.roles[i] = b.scene->instances[i].view.role;
    place_points(&b, pattern, points);
    printf("%s\n", path);
    bench_builds(&b);
    bench_errors(&b, rays);
    free(b.roles);
    free(b.points);
    free(b.truth);
    free(b.results);
    cranny_scene_destroy(&b.scene);
    return 0;
}
