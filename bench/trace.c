/* What a ray costs, and how many are needed: packets, samplers, order, an any-hit estimator.
 * Usage: bench-trace [--json] [--points N] SCENE...; without a scene, a generated one. */
#include "base/sequence.h"
#include "trace/directions.h"
#include "trace/gather.h"
#include "trace/tracer.h"

#include <omp.h>
#include <time.h>

#define GROUP 8 /* points near one another, as the fit sees them */
#define ERROR_RAYS_MAX 256

static const char *const sampler_names[] = {"spiral", "sobol", "random"};

/* Processor seconds over all cores, so that other programs disturb less. */
static double busy_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return ((double)t.tv_sec + (double)t.tv_nsec * 1e-9) / omp_get_num_procs();
}

/* Boxes on a floor: some hundred thousand triangles would only make the file longer. */
static enum cranny_status generate(struct cranny_scene **scene, struct cranny_error *why)
{
    static const uint32_t faces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                          {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                          {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    float positions[8][3];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            positions[i][k] = (float)(i >> k & 1);
    enum cranny_status status = cranny_scene_create(scene, why);
    struct cranny_mesh mesh = {.name = "box",
                               .vertex_count = 8,
                               .triangle_count = 12,
                               .positions = positions,
                               .triangles = faces};
    if (status == CRANNY_OK)
        status = cranny_scene_add_mesh(*scene, &mesh, NULL, why);
    for (uint32_t i = 0; i < 5000 && status == CRANNY_OK; i++) {
        const double s = 0.2 + 2 * (double)unit_from_u32(hash_u32(3 * i));
        const double x = 50 * (double)unit_from_u32(hash_u32(3 * i + 1));
        const double z = 50 * (double)unit_from_u32(hash_u32(3 * i + 2));
        struct cranny_instance box = {
            .name = "", .world_from_object = {s, 0, 0, x, 0, 2 * s, 0, 0, 0, 0, s, z}};
        status = cranny_scene_add_instance(*scene, &box, NULL, why);
    }
    return status;
}

struct face {
    double corner[3], edge[2][3], normal[3], weight;
    float extent;
};

static struct face world_face(const struct cranny_scene *scene, uint32_t instance,
                              uint32_t triangle)
{
    const struct cranny_instance *placed = cranny_scene_instance(scene, instance);
    const struct cranny_mesh *mesh = cranny_scene_mesh(scene, placed->mesh);
    const double *m = placed->world_from_object;
    double corners[3][3];
    struct face face;
    for (int c = 0; c < 3; c++) {
        const float *p = mesh->positions[mesh->triangles[triangle][c]];
        for (int k = 0; k < 3; k++)
            corners[c][k] =
                m[4 * k] * p[0] + m[4 * k + 1] * p[1] + m[4 * k + 2] * p[2] + m[4 * k + 3];
    }
    double length[2] = {0, 0};
    for (int k = 0; k < 3; k++) {
        face.corner[k] = corners[0][k];
        for (int e = 0; e < 2; e++) {
            face.edge[e][k] = corners[e + 1][k] - corners[0][k];
            length[e] += face.edge[e][k] * face.edge[e][k];
        }
    }
    double *n = face.normal, *u = face.edge[0], *v = face.edge[1];
    for (int k = 0; k < 3; k++)
        n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
    const double area = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++)
        n[k] /= area > 0 ? area : 1;
    face.weight = sqrt(area); /* between one per face and one per square metre */
    face.extent = (float)(sqrt(fmax(length[0], length[1])) * 1.5);
    return face;
}

static void place_group(const struct face *face, uint32_t group, struct gather_point *points)
{
    const double shift[2] = {(double)unit_from_u32(hash_u32(2 * group)),
                             (double)unit_from_u32(hash_u32(2 * group + 1))};
    for (uint32_t j = 0; j < GROUP; j++) {
        double r[2];
        r2_point(j, shift, r);
        const double a = 1.0 / 6 + 0.5 * (1 - sqrt(r[0])), b = 1.0 / 6 + 0.5 * r[1] * sqrt(r[0]);
        points[j] = (struct gather_point){.extent = face->extent, .id = group * GROUP + j};
        for (int k = 0; k < 3; k++) {
            points[j].position[k] =
                (float)(face->corner[k] + a * face->edge[0][k] + b * face->edge[1][k]);
            points[j].normal[k] = points[j].face_normal[k] = (float)face->normal[k];
        }
    }
}

/* Groups of points spread over the faces; returns the number of points made. */
static size_t make_points(const struct cranny_scene *scene, struct gather_point *points,
                          size_t count)
{
    const size_t groups = count / GROUP;
    double total = 0, before = 0;
    size_t made = 0;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
            const uint32_t mesh = cranny_scene_instance(scene, i)->mesh;
            for (uint32_t t = 0; t < cranny_scene_mesh(scene, mesh)->triangle_count; t++) {
                const struct face face = world_face(scene, i, t);
                total += pass ? 0 : face.weight;
                before += pass ? face.weight : 0;
                while (pass && made < groups &&
                       before > ((double)made + 0.5) * total / (double)groups) {
                    place_group(&face, (uint32_t)made, points + made * GROUP);
                    made++;
                }
            }
        }
    return made * GROUP;
}

struct bench {
    struct cranny_scene *scene;
    struct cranny_tracer *tracer;
    struct cranny_gather_params params;
    struct gather_point *points;
    struct gather_result *results, *truth;
    size_t count;
    bool json;
};

/* Gather with the bench's parameters; returns Mrays/s. */
static double gather(struct bench *b, const struct cranny_gather_params *params, bool adaptive,
                     struct gather_result *results)
{
    struct gather_plan *plan;
    if (gather_plan_create(params, adaptive, &plan, NULL) != CRANNY_OK)
        exit(1);
    const double start = busy_seconds();
#pragma omp parallel
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 4)
        for (size_t i = 0; i < b->count; i += GROUP)
            gather_points(b->tracer, plan, b->points + i, GROUP, results + i);
        gather_thread_end(saved);
    }
    const double seconds = busy_seconds() - start;
    gather_plan_destroy(&plan);
    double rays = 0;
    for (size_t i = 0; i < b->count; i++)
        rays += results[i].rays;
    return rays / seconds * 1e-6;
}

/* Any hit within a length drawn from the kernel: 1 − exp(ln ½ d/r) is the chance that it is shorter
 * than d. Random directions and lengths on Sobol's two dimensions and a hash. */
static double any_hit_point(const struct bench *b, const struct directions *d,
                            const struct gather_point *point, int rays)
{
    const struct direction_frame frame = direction_frame(d, point);
    const float offset = ray_offset(point->position, point->extent);
    int open = 0;
    for (int from = 0; from < rays; from += RAY_BLOCK) {
        const int count = min_int(RAY_BLOCK, rays - from);
        struct ray_block block;
        directions_fill(d, &frame, from, count, &block);
        for (int first = 0; first < count; first += 8) {
            struct RTCRay8 r;
            _Alignas(32) int valid[8];
            for (int i = 0; i < 8; i++) {
                const int ray = min_int(first + i, count - 1);
                valid[i] = first + i < count ? -1 : 0;
                r.org_x[i] = point->position[0] + offset * point->face_normal[0];
                r.org_y[i] = point->position[1] + offset * point->face_normal[1];
                r.org_z[i] = point->position[2] + offset * point->face_normal[2];
                r.dir_x[i] = block.x[ray];
                r.dir_y[i] = block.y[ray];
                r.dir_z[i] = block.z[ray];
                r.tnear[i] = r.time[i] = 0;
                r.mask[i] = UINT32_MAX;
                r.id[i] = block.ids + (uint32_t)ray;
                r.flags[i] = 0;
                /* Stratified over the rays, in shuffled order by a large odd step. */
                const double u = fraction(
                    ((double)((uint32_t)(from + ray) * 0x9e3779b1u) + (double)hash_u32(point->id)) *
                    0x1p-32);
                r.tfar[i] = (float)(-log2(1 - u) * (double)b->params.distances[0]);
            }
            embree_any8(b->tracer->world, valid, &r);
            for (int i = 0; i < 8; i++)
                open += valid[i] && r.tfar[i] >= 0;
        }
    }
    return (double)open / rays;
}

static double any_hit(struct bench *b, int rays, double *rate)
{
    struct directions d;
    if (!directions_create(&d, CRANNY_SAMPLER_SPIRAL, false, rays, rays, 1))
        exit(1);
    const double start = busy_seconds();
    double sum = 0;
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t i = 0; i < b->count; i++) {
        const unsigned saved = gather_thread_begin();
        b->results[i].visibility[0] = (float)any_hit_point(b, &d, &b->points[i], rays);
        gather_thread_end(saved);
    }
    *rate = (double)b->count * rays / (busy_seconds() - start) * 1e-6;
    for (size_t i = 0; i < b->count; i++)
        sum += pow((double)b->results[i].visibility[0] - (double)b->truth[i].visibility[0], 2);
    directions_destroy(&d);
    return sqrt(sum / (double)b->count);
}

struct errors {
    double point, group, rays;
};

static struct errors measure(struct bench *b, enum cranny_sampler sampler, int rays, bool adaptive)
{
    struct errors e = {0, 0, 0};
    struct cranny_gather_params params = b->params;
    params.sampler = sampler;
    params.rays = rays;
    enum { SEEDS = 4 };
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        params.seed = seed;
        gather(b, &params, adaptive, b->results);
        double group = 0;
        for (size_t i = 0; i < b->count; i++) {
            const double d =
                (double)b->results[i].visibility[0] - (double)b->truth[i].visibility[0];
            e.point += d * d;
            e.rays += b->results[i].rays;
            group = i % GROUP ? group + d : d;
            e.group += i % GROUP == GROUP - 1 ? group * group / (GROUP * GROUP) : 0;
        }
    }
    const double n = (double)b->count * SEEDS;
    return (struct errors){sqrt(e.point / n), sqrt(e.group / n * GROUP), e.rays / n};
}

static void bench_speed(struct bench *b)
{
    printf(b->json ? ",\"mrays_per_s\":{" : "| sampler | 1 wide | 8 | 16 | Mrays/s, 64 rays\n");
    for (int sampler = 0; sampler < 3; sampler++) {
        double best[3] = {0, 0, 0};
        for (int repeat = 0; repeat < 9; repeat++) {
            struct cranny_gather_params params = b->params;
            params.sampler = (enum cranny_sampler)sampler;
            params.packet = (enum cranny_packet)(repeat % 3);
            best[repeat % 3] = fmax(best[repeat % 3], gather(b, &params, false, b->results));
        }
        printf(b->json ? "%s\"%s\":[%.2f,%.2f,%.2f]" : "%s| %s | %.2f | %.2f | %.2f |\n",
               b->json && sampler ? "," : "", sampler_names[sampler], best[0], best[1], best[2]);
    }
    printf(b->json ? "}" : "");
}

static void bench_errors(struct bench *b)
{
    printf(b->json ? ",\"rms\":[" : "| sampler | rays | rms | rms of the mean of 8 neighbours |\n");
    for (int sampler = 0; sampler < 4; sampler++)
        for (int rays = 4; rays <= ERROR_RAYS_MAX; rays *= 2) {
            const bool adaptive = sampler == 3;
            const struct errors e = measure(b, (enum cranny_sampler)(sampler % 3), rays, adaptive);
            printf(b->json
                       ? "%s{\"sampler\":\"%s%s\",\"rays\":%.1f,\"rms\":%.5f,\"group_rms\":%.5f}"
                       : "%s| %s%s | %.1f | %.4f | %.4f |\n",
                   b->json && (sampler || rays > 4) ? "," : "", sampler_names[sampler % 3],
                   adaptive ? " adaptive" : "", e.rays, e.point, e.group);
        }
    printf(b->json ? "],\"any_hit\":[" : "| any hit | rays | rms | Mrays/s |\n");
    for (int rays = 16; rays <= 1024; rays *= 4) {
        double rate;
        const double rms = any_hit(b, rays, &rate);
        printf(b->json ? "%s{\"rays\":%d,\"rms\":%.5f,\"mrays_per_s\":%.2f}"
                       : "%s| any hit | %d | %.4f | %.2f |\n",
               b->json && rays > 16 ? "," : "", rays, rms, rate);
    }
    printf(b->json ? "]" : "");
}

static enum cranny_status bench_scene(struct bench *b, const char *path, size_t wanted,
                                      struct cranny_error *why)
{
    enum cranny_status status =
        path ? cranny_scene_load(path, NULL, &b->scene, why) : generate(&b->scene, why);
    if (status != CRANNY_OK)
        return status;
    const double start = seconds_now();
    status = cranny_tracer_create(b->scene, NULL, &b->tracer, why);
    if (status != CRANNY_OK)
        return status;
    const double seconds = seconds_now() - start;
    double bounds[6];
    cranny_scene_bounds(b->scene, bounds);
    const double diagonal = sqrt(pow(bounds[3] - bounds[0], 2) + pow(bounds[4] - bounds[1], 2) +
                                 pow(bounds[5] - bounds[2], 2));
    b->params = cranny_gather_params_default();
    b->params.distances[0] = (float)(0.3 * diagonal);
    b->params.distances[1] = (float)(0.03 * diagonal);
    b->points = alloc_array(wanted, sizeof *b->points);
    b->results = alloc_array(wanted, sizeof *b->results);
    b->truth = alloc_array(wanted, sizeof *b->truth);
    if (!b->points || !b->results || !b->truth)
        return fail_memory(why, "points");
    b->count = make_points(b->scene, b->points, wanted);
    printf(b->json ? "{\"scene\":\"%s\",\"triangles\":%llu,\"build_seconds\":%.3f,\"bytes\":%llu"
                   : "\n%s: %llu triangles, built in %.3f s, %llu bytes\n",
           path ? path : "generated", (unsigned long long)cranny_scene_triangle_count(b->scene),
           seconds, (unsigned long long)cranny_tracer_bytes(b->tracer));
    bench_speed(b);
    struct cranny_gather_params truth = b->params;
    truth.rays = 16384;
    truth.seed = 99;
    b->count = make_points(b->scene, b->points, b->count / 8);
    gather(b, &truth, false, b->truth);
    bench_errors(b);
    printf(b->json ? "}" : "");
    return CRANNY_OK;
}

static void bench_free(struct bench *b)
{
    cranny_tracer_destroy(&b->tracer);
    cranny_scene_destroy(&b->scene);
    free(b->points);
    free(b->results);
    free(b->truth);
}

int main(int count, char **arguments)
{
    bool json = false;
    size_t points = 8192;
    int first = 1;
    for (; first < count && strncmp(arguments[first], "--", 2) == 0; first++) {
        json |= strcmp(arguments[first], "--json") == 0;
        if (strcmp(arguments[first], "--points") == 0 && first + 1 < count)
            points = strtoull(arguments[++first], NULL, 10);
    }
    printf(json ? "{\"scenes\":[" : "");
    for (int i = first; i == first || i < count; i++) {
        struct bench b = {.json = json};
        struct cranny_error why;
        printf(json && i > first ? "," : "");
        const enum cranny_status status =
            bench_scene(&b, i < count ? arguments[i] : NULL, points, &why);
        bench_free(&b);
        if (status != CRANNY_OK) {
            fprintf(stderr, "bench-trace: %s\n", why.message);
            return 1;
        }
        fflush(stdout);
    }
    printf(json ? "]}\n" : "");
    return 0;
}
