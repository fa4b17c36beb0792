#include "truth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void to_world(const double m[12], const float p[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
}

/* Cofactors of the 3×3 part: they turn normals, mirrors included, up to a positive scale. */
static void cofactors(const double m[12], double c[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3, d = (j + 1) % 3, e = (j + 2) % 3;
            c[3 * i + j] = m[4 * a + d] * m[4 * b + e] - m[4 * a + e] * m[4 * b + d];
        }
    const double determinant = m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
    for (int i = 0; i < 9 && determinant < 0; i++)
        c[i] = -c[i];
}

static void turn(const double c[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = c[3 * i] * v[0] + c[3 * i + 1] * v[1] + c[3 * i + 2] * v[2];
}

static double normalise(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3 && length > 0; k++)
        v[k] /= length;
    return length;
}

/* Twice the area times the unit normal, object space. */
static void face_vector(const struct cranny_mesh *mesh, uint32_t triangle, double n[3])
{
    const uint32_t *corner = mesh->triangles[triangle];
    double e[2][3];
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < 3; k++)
            e[c][k] = (double)mesh->positions[corner[c + 1]][k] - mesh->positions[corner[0]][k];
    for (int k = 0; k < 3; k++)
        n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
}

/* A mixer of 64 bits (splitmix), for points that do not share Cranny's own sequences. */
static double next_unit(uint64_t *state)
{
    uint64_t x = *state += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return (double)((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

static void place_point(const struct cranny_scene *scene, const struct truth_point *point,
                        size_t index, struct truth *truth)
{
    const struct cranny_instance *instance = cranny_scene_instance(scene, point->instance);
    const struct cranny_mesh *mesh = cranny_scene_mesh(scene, instance->mesh);
    const uint32_t *corner = mesh->triangles[point->triangle];
    double c[9], position[3] = {0}, face[3], flat[3], normal[3], smooth[3] = {0}, side = 0;
    cofactors(instance->world_from_object, c);
    face_vector(mesh, point->triangle, flat);
    turn(c, flat, face);
    normalise(face);
    for (int v = 0; v < 3; v++) {
        double p[3];
        to_world(instance->world_from_object, mesh->positions[corner[v]], p);
        for (int k = 0; k < 3; k++) {
            position[k] += point->l[v] * p[k];
            smooth[k] += mesh->normals ? point->l[v] * mesh->normals[corner[v]][k] : 0;
        }
    }
    turn(c, smooth, normal);
    if (!mesh->normals || !(normalise(normal) > 0))
        memcpy(normal, face, sizeof normal);
    for (int k = 0; k < 3; k++)
        side += normal[k] * face[k];
    for (int k = 0; k < 3; k++) {
        truth->positions[index][k] = (float)position[k];
        truth->normals[index][k] = (float)(side < 0 ? -normal[k] : normal[k]);
        truth->face_normals[index][k] = (float)face[k];
    }
}

static double world_area(const struct cranny_scene *scene, uint32_t instance, uint32_t triangle)
{
    const struct cranny_instance *view = cranny_scene_instance(scene, instance);
    double c[9], n[3], world[3];
    cofactors(view->world_from_object, c);
    face_vector(cranny_scene_mesh(scene, view->mesh), triangle, n);
    turn(c, n, world);
    return 0.5 * normalise(world);
}

static double total_area(const struct cranny_scene *scene)
{
    double sum = 0;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const uint32_t mesh = cranny_scene_instance(scene, i)->mesh;
        for (uint32_t t = 0; t < cranny_scene_mesh(scene, mesh)->triangle_count; t++)
            sum += world_area(scene, i, t);
    }
    return sum;
}

/* One point in each of `count` equal shares of the area, in the order of the triangles. */
static void spread_points(const struct cranny_scene *scene, struct truth *truth)
{
    uint64_t state = 20130101;
    const double share = total_area(scene) / (double)truth->count;
    double passed = 0;
    size_t made = 0;
    double next = next_unit(&state) * share;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const uint32_t mesh = cranny_scene_instance(scene, i)->mesh;
        for (uint32_t t = 0; t < cranny_scene_mesh(scene, mesh)->triangle_count; t++) {
            passed += world_area(scene, i, t);
            while (made < truth->count && next < passed) {
                const double root = sqrt(next_unit(&state)), v = next_unit(&state);
                truth->points[made] =
                    (struct truth_point){i, t, {1 - root, v * root, root - v * root}};
                place_point(scene, &truth->points[made], made, truth);
                made++;
                next = ((double)made + next_unit(&state)) * share;
            }
        }
    }
    truth->count = made;
}

enum cranny_status truth_create(const struct cranny_scene *scene,
                                const struct cranny_tracer *tracer,
                                const struct cranny_bake_params *bake, size_t count, int rays,
                                struct truth *truth, struct cranny_error *why)
{
    *truth = (struct truth){.count = count};
    truth->points = calloc(count, sizeof *truth->points);
    truth->positions = calloc(count, sizeof *truth->positions);
    truth->normals = calloc(count, sizeof *truth->normals);
    truth->face_normals = calloc(count, sizeof *truth->face_normals);
    truth->visibility = calloc(count, sizeof *truth->visibility);
    truth->buried = calloc(count, 1);
    float(*both)[2] = calloc(count, sizeof *both), *back = calloc(count, sizeof *back);
    spread_points(scene, truth);
    struct cranny_gather_params params = cranny_gather_params_default();
    params.rays = rays;
    params.distances[0] = bake->distance_long;
    params.distances[1] = bake->distance_short;
    params.kernel = (enum cranny_kernel)bake->kernel;
    params.seed = 4711;
    params.threads = bake->threads;
    enum cranny_status status =
        cranny_gather(tracer, truth->count, (const float(*)[3])truth->positions,
                      (const float(*)[3])truth->normals, (const float(*)[3])truth->face_normals,
                      &params, both, back, why);
    for (size_t i = 0; i < truth->count; i++) {
        truth->visibility[i] =
            (1 - bake->short_weight) * both[i][0] + bake->short_weight * both[i][1];
        truth->buried[i] = back[i] > 0.25f;
    }
    free(both);
    free(back);
    if (status != CRANNY_OK)
        truth_free(truth);
    return status;
}

void truth_free(struct truth *truth)
{
    free(truth->points);
    free(truth->positions);
    free(truth->normals);
    free(truth->face_normals);
    free(truth->visibility);
    free(truth->buried);
    *truth = (struct truth){0};
}

double truth_rms(const struct truth *truth, const struct cranny_scene *scene,
                 const float *const *values)
{
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < truth->count; i++) {
        const struct truth_point *point = &truth->points[i];
        if (truth->buried[i])
            continue;
        const uint32_t mesh = cranny_scene_instance(scene, point->instance)->mesh;
        const uint32_t *corner = cranny_scene_mesh(scene, mesh)->triangles[point->triangle];
        double value = 0;
        for (int c = 0; c < 3; c++)
            value += point->l[c] * values[point->instance][corner[c]];
        sum += (value - truth->visibility[i]) * (value - truth->visibility[i]);
        count++;
    }
    return count ? sqrt(sum / (double)count) : 0;
}

static void add_face_normals(const struct cranny_mesh *mesh, double (*normals)[3])
{
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double n[3];
        face_vector(mesh, t, n);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                normals[mesh->triangles[t][c]][k] += n[k];
    }
}

void world_vertices(const struct cranny_scene *scene, uint32_t instance, float (*positions)[3],
                    float (*normals)[3])
{
    const struct cranny_instance *view = cranny_scene_instance(scene, instance);
    const struct cranny_mesh *mesh = cranny_scene_mesh(scene, view->mesh);
    double c[9], (*sums)[3] = calloc(mesh->vertex_count + 1, sizeof *sums);
    cofactors(view->world_from_object, c);
    if (!mesh->normals)
        add_face_normals(mesh, sums);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        double p[3], n[3];
        for (int k = 0; k < 3 && mesh->normals; k++)
            sums[v][k] = mesh->normals[v][k];
        to_world(view->world_from_object, mesh->positions[v], p);
        turn(c, sums[v], n);
        if (!(normalise(n) > 0))
            n[1] = 1;
        for (int k = 0; k < 3; k++) {
            positions[v][k] = (float)p[k];
            normals[v][k] = (float)n[k];
        }
    }
    free(sums);
}
