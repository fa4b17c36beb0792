/* Frames of planes, spheres and boxes, seen by rays in double: inputs of the screen-space tests
 * whose visibility is known, or is integrated here by rays that share no code with the library. */
#ifndef TESTS_ANALYTIC_H
#define TESTS_ANALYTIC_H

#include "check.h"

#include <cranny/screen.h>
#include <stdbool.h>

enum { ANALYTIC_SHAPES = 8 };

/* View space. A sphere where radius > 0, a box of half sizes `half` along unit `axes` where half[0]
 * > 0, else the plane through `point` with unit `normal`. */
struct shape {
    double point[3], normal[3], radius;
    double half[3], axes[3][3];
};

struct analytic {
    struct shape shapes[ANALYTIC_SHAPES];
    int count;
};

struct analytic_hit {
    double distance, normal[3];
};

static inline double dot_of(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* From outside; `normal` may be NULL. */
static inline double box_distance(const struct shape *s, const double v[3], const double d[3],
                                  double normal[3])
{
    double enter = -INFINITY, leave = INFINITY;
    for (int i = 0; i < 3; i++) {
        const double along = dot_of(d, s->axes[i]), from = dot_of(v, s->axes[i]);
        if (fabs(along) < 1e-12) {
            if (fabs(from) > s->half[i])
                return INFINITY;
            continue;
        }
        const double side = along < 0 ? 1 : -1;
        const double in = (side * s->half[i] - from) / along;
        leave = fmin(leave, (-side * s->half[i] - from) / along);
        if (in <= enter)
            continue;
        enter = in;
        for (int k = 0; normal && k < 3; k++)
            normal[k] = side * s->axes[i][k];
    }
    return enter > 1e-9 && enter < leave ? enter : INFINITY;
}

static inline double shape_distance(const struct shape *s, const double o[3], const double d[3])
{
    double v[3];
    for (int i = 0; i < 3; i++)
        v[i] = o[i] - s->point[i];
    if (s->half[0] > 0)
        return box_distance(s, v, d, NULL);
    if (s->radius <= 0) {
        const double facing = dot_of(d, s->normal);
        const double t = -dot_of(v, s->normal) / facing;
        return fabs(facing) > 1e-12 && t > 1e-9 ? t : INFINITY;
    }
    const double a = dot_of(d, d), b = dot_of(v, d), c = dot_of(v, v) - s->radius * s->radius;
    const double q = b * b - a * c;
    if (q <= 0)
        return INFINITY;
    const double t = (-b - sqrt(q)) / a;
    return t > 1e-9 ? t : INFINITY;
}

static inline void shape_normal(const struct shape *s, const double o[3], const double d[3],
                                double distance, double normal[3])
{
    double v[3];
    for (int k = 0; k < 3; k++) {
        v[k] = o[k] - s->point[k];
        normal[k] = s->radius > 0 ? (v[k] + distance * d[k]) / s->radius : s->normal[k];
    }
    if (s->half[0] > 0)
        box_distance(s, v, d, normal);
}

static inline struct analytic_hit analytic_trace(const struct analytic *scene, const double o[3],
                                                 const double d[3])
{
    struct analytic_hit hit = {.distance = INFINITY};
    const struct shape *nearest = NULL;
    for (int i = 0; i < scene->count; i++) {
        const struct shape *s = &scene->shapes[i];
        const double t = shape_distance(s, o, d);
        if (!(t < hit.distance))
            continue;
        hit.distance = t;
        nearest = s;
    }
    if (nearest)
        shape_normal(nearest, o, d, hit.distance, hit.normal);
    const double side = dot_of(hit.normal, d);
    for (int k = 0; k < 3 && side > 0; k++)
        hit.normal[k] = -hit.normal[k];
    return hit;
}

static inline void add_plane(struct analytic *scene, double x, double y, double z, double nx,
                             double ny, double nz)
{
    const double length = sqrt(nx * nx + ny * ny + nz * nz);
    scene->shapes[scene->count++] =
        (struct shape){.point = {x, y, z}, .normal = {nx / length, ny / length, nz / length}};
}

static inline void add_sphere(struct analytic *scene, double x, double y, double z, double radius)
{
    scene->shapes[scene->count++] = (struct shape){.point = {x, y, z}, .radius = radius};
}

/* Half sizes `hx`, `hy`, `hz` along the axes of space. */
static inline void add_box(struct analytic *scene, double x, double y, double z, double hx,
                           double hy, double hz)
{
    scene->shapes[scene->count++] = (struct shape){
        .point = {x, y, z}, .half = {hx, hy, hz}, .axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

/* Depth and float normals of a picture; `depth` and `normals` are the caller's, width × height. */
static inline struct cranny_gbuffer analytic_frame(const struct analytic *scene, int width,
                                                   int height, struct cranny_projection projection,
                                                   float *depth, float (*normals)[3])
{
    const bool parallel = projection.kind == CRANNY_ORTHOGRAPHIC;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const double u =
                projection.left + (x + 0.5) / width * ((double)projection.right - projection.left);
            const double v =
                projection.top + (y + 0.5) / height * ((double)projection.bottom - projection.top);
            const double o[3] = {parallel ? u : 0, parallel ? v : 0, 0};
            const double d[3] = {parallel ? 0 : u, parallel ? 0 : v, -1};
            const struct analytic_hit hit = analytic_trace(scene, o, d);
            const size_t at = (size_t)y * (size_t)width + (size_t)x;
            depth[at] = (float)hit.distance;
            for (int k = 0; k < 3; k++)
                normals[at][k] = isfinite(hit.distance) ? (float)hit.normal[k] : k == 2;
        }
    return (struct cranny_gbuffer){.width = width,
                                   .height = height,
                                   .depth = depth,
                                   .normal = normals,
                                   .projection = projection};
}

/* The truth at a view-space point: obscurance with linear falloff over `radius`, by `side`²
 * stratified cosine-distributed rays. */
static inline double analytic_visibility(const struct analytic *scene, const double p[3],
                                         const double n[3], double radius, int side)
{
    const double sign = n[2] < 0 ? -1 : 1, a = -1 / (sign + n[2]), c = n[0] * n[1] * a;
    const double t[3] = {1 + sign * n[0] * n[0] * a, sign * c, -sign * n[0]};
    const double b[3] = {c, sign + n[1] * n[1] * a, -n[1]};
    double sum = 0;
    for (int i = 0; i < side * side; i++) {
        const double ring = sqrt((i % side + 0.5) / side);
        const double angle = 6.283185307179586 * (i / side + 0.5) / side;
        const double x = ring * cos(angle), y = ring * sin(angle), z = sqrt(1 - ring * ring);
        double d[3], o[3];
        for (int k = 0; k < 3; k++) {
            d[k] = x * t[k] + y * b[k] + z * n[k];
            o[k] = p[k] + 1e-7 * n[k];
        }
        sum += fmin(analytic_trace(scene, o, d).distance / radius, 1);
    }
    return sum / (side * side);
}

#endif
