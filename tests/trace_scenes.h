/* Small scenes from arrays, for the tests of rays. */
#ifndef TESTS_TRACE_SCENES_H
#define TESTS_TRACE_SCENES_H

#include "check.h"

#include <cranny/trace.h>

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

static inline struct cranny_scene *new_scene(void)
{
    struct cranny_error why;
    struct cranny_scene *scene;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    struct cranny_material plain = cranny_material_default();
    CHECK_OK(cranny_scene_add_material(scene, &plain, NULL, &why), why);
    return scene;
}

static inline uint32_t add_instance(struct cranny_scene *scene, uint32_t mesh, const double m[12])
{
    struct cranny_error why;
    struct cranny_instance instance = {.name = "", .mesh = mesh};
    memcpy(instance.world_from_object, m, sizeof instance.world_from_object);
    uint32_t index = 0;
    CHECK_OK(cranny_scene_add_instance(scene, &instance, &index, &why), why);
    return index;
}

/* A mesh of one material; texcoords may be NULL. */
static inline uint32_t add_mesh(struct cranny_scene *scene, uint32_t vertices,
                                const float (*positions)[3], const float (*texcoords)[2],
                                uint32_t triangles, const uint32_t (*corners)[3], uint32_t material)
{
    struct cranny_error why;
    uint32_t *materials = malloc((triangles + 1) * sizeof *materials);
    for (uint32_t t = 0; t < triangles; t++)
        materials[t] = material;
    struct cranny_mesh mesh = {.name = "",
                               .vertex_count = vertices,
                               .triangle_count = triangles,
                               .positions = positions,
                               .texcoords = texcoords,
                               .triangles = corners,
                               .triangle_materials = materials};
    uint32_t index = 0;
    CHECK_OK(cranny_scene_add_mesh(scene, &mesh, &index, &why), why);
    free(materials);
    return index;
}

/* Corners a, a+u, a+u+v, a+v: seen from the side of u × v. Texcoords run from 0 to `repeat`. */
static inline uint32_t quad_mesh(struct cranny_scene *scene, const double a[3], const double u[3],
                                 const double v[3], uint32_t material, float repeat)
{
    static const uint32_t corners[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const float texcoords[4][2] = {{0, 0}, {repeat, 0}, {repeat, repeat}, {0, repeat}};
    float positions[4][3];
    for (int k = 0; k < 3; k++) {
        positions[0][k] = (float)a[k];
        positions[1][k] = (float)(a[k] + u[k]);
        positions[2][k] = (float)(a[k] + u[k] + v[k]);
        positions[3][k] = (float)(a[k] + v[k]);
    }
    return add_mesh(scene, 4, positions, texcoords, 2, corners, material);
}

static inline void add_quad(struct cranny_scene *scene, const double a[3], const double u[3],
                            const double v[3], uint32_t material)
{
    add_instance(scene, quad_mesh(scene, a, u, v, material, 1), identity);
}

/* A box from `low` to `high`, seen from outside, or from inside when `inward`. */
static inline uint32_t box_mesh(struct cranny_scene *scene, const float low[3], const float high[3],
                                bool inward)
{
    static const uint32_t out[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                        {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                        {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    float positions[8][3];
    uint32_t corners[12][3];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            positions[i][k] = i >> k & 1 ? high[k] : low[k];
    for (int t = 0; t < 12; t++) {
        corners[t][0] = out[t][0];
        corners[t][1] = out[t][inward ? 2 : 1];
        corners[t][2] = out[t][inward ? 1 : 2];
    }
    return add_mesh(scene, 8, positions, NULL, 12, corners, 0);
}

/* A sphere of rings × 2 rings quads, seen from outside. */
static inline uint32_t sphere_mesh(struct cranny_scene *scene, const double centre[3],
                                   double radius, uint32_t rings)
{
    const uint32_t columns = 2 * rings, vertices = (rings + 1) * (columns + 1);
    float(*positions)[3] = malloc(vertices * sizeof *positions);
    uint32_t(*corners)[3] = malloc((size_t)rings * columns * 2 * sizeof *corners);
    uint32_t count = 0;
    const double pi = acos(-1);
    for (uint32_t i = 0; i <= rings; i++)
        for (uint32_t j = 0; j <= columns; j++) {
            const double theta = pi * i / rings, phi = 2 * pi * (j % columns) / columns;
            float *p = positions[i * (columns + 1) + j];
            p[0] = (float)(centre[0] + radius * sin(theta) * cos(phi));
            p[1] = (float)(centre[1] + radius * cos(theta));
            p[2] = (float)(centre[2] + radius * sin(theta) * sin(phi));
        }
    for (uint32_t i = 0; i < rings; i++)
        for (uint32_t j = 0; j < columns; j++) {
            const uint32_t a = i * (columns + 1) + j, b = a + columns + 1;
            memcpy(corners[count++], (uint32_t[3]){a, a + 1, b}, 12);
            memcpy(corners[count++], (uint32_t[3]){a + 1, b + 1, b}, 12);
        }
    const uint32_t mesh = add_mesh(scene, vertices, positions, NULL, count, corners, 0);
    free(positions);
    free(corners);
    return mesh;
}

static inline struct cranny_tracer *new_tracer(const struct cranny_scene *scene)
{
    struct cranny_error why;
    struct cranny_tracer *tracer;
    CHECK_OK(cranny_tracer_create(scene, NULL, &tracer, &why), why);
    return tracer;
}

#endif
