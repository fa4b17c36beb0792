#include "shapes.h"

#include <stdlib.h>

struct builder builder_at(struct mesh *mesh, double edge)
{
    return (struct builder){mesh, edge, vec(0, 0, 0), vec(1, 0, 0), vec(0, 1, 0), vec(0, 0, 1)};
}

struct vec builder_direction(const struct builder *b, struct vec d)
{
    return add(add(scale(b->x, d.x), scale(b->y, d.y)), scale(b->z, d.z));
}

struct vec builder_point(const struct builder *b, struct vec p)
{
    return add(b->origin, builder_direction(b, p));
}

struct builder builder_turned(const struct builder *b, struct vec offset, double angle)
{
    double c = cos(angle), s = sin(angle);
    struct builder turned = *b;
    turned.origin = builder_point(b, offset);
    turned.x = builder_direction(b, vec(c, 0, -s));
    turned.z = builder_direction(b, vec(s, 0, c));
    return turned;
}

static uint32_t put(struct builder *b, enum material material, struct vec p, struct vec n, double u,
                    double v)
{
    return mesh_vertex(b->mesh, material, builder_point(b, p), builder_direction(b, n), u, v);
}

static int compare_lines(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Lines from 0 to `size` through all marks, no further apart than `edge`. Frees nothing: the caller
 * frees *lines. The marks array is sorted in place. */
static size_t make_lines(double *marks, size_t mark_count, double size, double edge, double **lines)
{
    qsort(marks, mark_count, sizeof *marks, compare_lines);
    *lines = malloc(((size_t)ceil(size / edge) + 2 * mark_count + 4) * sizeof **lines);
    if (!*lines)
        return 0;
    size_t count = 0;
    double last = 0;
    (*lines)[count++] = 0;
    for (size_t i = 0; i <= mark_count; i++) {
        double next = i < mark_count ? fmin(marks[i], size) : size;
        if (next - last < 1e-6)
            continue;
        int pieces = (int)ceil((next - last) / edge - 1e-9);
        for (int k = 1; k <= pieces; k++)
            (*lines)[count++] = k == pieces ? next : mix(last, next, (double)k / pieces);
        last = next;
    }
    return count;
}

static bool in_hole(const struct panel *p, double u, double v)
{
    for (size_t i = 0; i < p->hole_count; i++) {
        const struct hole *h = &p->holes[i];
        if (u > h->u0 && u < h->u1 && v > h->v0 && v < h->v1)
            return true;
    }
    return false;
}

struct lines {
    double *u, *v;
    size_t u_count, v_count;
};

static bool panel_lines(const struct builder *b, const struct panel *p, struct lines *lines)
{
    size_t room = 2 * p->hole_count + p->mark_count + 1, u_count = 0, v_count = 0;
    double *marks = malloc(2 * room * sizeof *marks);
    if (!marks)
        return false;
    double *v_marks = marks + room;
    for (size_t i = 0; i < p->hole_count; i++) {
        marks[u_count++] = p->holes[i].u0;
        marks[u_count++] = p->holes[i].u1;
        v_marks[v_count++] = p->holes[i].v0;
        v_marks[v_count++] = p->holes[i].v1;
    }
    for (size_t i = 0; i < p->mark_count; i++)
        marks[u_count++] = p->marks[i];
    lines->u_count = make_lines(marks, u_count, p->width, b->edge, &lines->u);
    lines->v_count = make_lines(v_marks, v_count, p->height, b->edge, &lines->v);
    free(marks);
    return lines->u && lines->v;
}

/* Vertices on demand: those inside a hole are never made. */
static uint32_t grid_vertex(struct builder *b, const struct panel *p, const struct lines *lines,
                            size_t i, size_t j, uint32_t *known)
{
    uint32_t *slot = &known[j * lines->u_count + i];
    if (!*slot) {
        double u = lines->u[i], v = lines->v[j];
        struct vec at = along(along(p->corner, p->u, u), p->v, v);
        *slot = put(b, p->material, at, cross(p->u, p->v), u, p->height - v) + 1;
    }
    return *slot - 1;
}

static void panel_cells(struct builder *b, const struct panel *p, const struct lines *lines,
                        uint32_t *known)
{
    for (size_t j = 0; j + 1 < lines->v_count; j++) {
        for (size_t i = 0; i + 1 < lines->u_count; i++) {
            if (in_hole(p, (lines->u[i] + lines->u[i + 1]) / 2,
                        (lines->v[j] + lines->v[j + 1]) / 2))
                continue;
            uint32_t c00 = grid_vertex(b, p, lines, i, j, known);
            uint32_t c10 = grid_vertex(b, p, lines, i + 1, j, known);
            uint32_t c11 = grid_vertex(b, p, lines, i + 1, j + 1, known);
            uint32_t c01 = grid_vertex(b, p, lines, i, j + 1, known);
            if ((i + j) % 2) {
                mesh_triangle(b->mesh, p->material, c00, c10, c11);
                mesh_triangle(b->mesh, p->material, c00, c11, c01);
            } else {
                mesh_triangle(b->mesh, p->material, c00, c10, c01);
                mesh_triangle(b->mesh, p->material, c10, c11, c01);
            }
        }
    }
}

void panel(struct builder *b, const struct panel *p)
{
    struct lines lines = {0};
    uint32_t *known = NULL;
    bool good = panel_lines(b, p, &lines);
    if (good)
        known = calloc(lines.u_count * lines.v_count, sizeof *known);
    if (known)
        panel_cells(b, p, &lines, known);
    else
        b->mesh->failed = true;
    free(known);
    free(lines.u);
    free(lines.v);
}

void quad(struct builder *b, enum material material, struct vec corner, struct vec u, struct vec v)
{
    panel(b, &(struct panel){.material = material,
                             .corner = corner,
                             .u = unit(u),
                             .v = unit(v),
                             .width = length(u),
                             .height = length(v)});
}

void triangle(struct builder *b, enum material material, struct vec p, struct vec q, struct vec r)
{
    struct vec u = sub(q, p), v = sub(r, p), n = unit(cross(u, v));
    double longest = fmax(fmax(length(u), length(v)), length(sub(r, q)));
    uint32_t rows = (uint32_t)fmax(1, ceil(longest / b->edge)), first = 0;
    for (uint32_t j = 0; j <= rows; j++) {
        for (uint32_t i = 0; i + j <= rows; i++) {
            struct vec at = along(along(p, u, (double)i / rows), v, (double)j / rows);
            uint32_t index = put(b, material, at, n, at.x + at.z, -at.y);
            first = i + j ? first : index;
        }
    }
    uint32_t row = first;
    for (uint32_t j = 0; j < rows; j++) {
        uint32_t next = row + rows - j + 1;
        for (uint32_t i = 0; i + j < rows; i++) {
            mesh_triangle(b->mesh, material, row + i, row + i + 1, next + i);
            if (i + j + 1 < rows)
                mesh_triangle(b->mesh, material, row + i + 1, next + i + 1, next + i);
        }
        row = next;
    }
}

void block(struct builder *b, enum material material, struct vec center, struct vec x, struct vec y,
           struct vec z)
{
    const struct vec axes[3] = {x, y, z};
    for (int a = 0; a < 3; a++) {
        for (int side = -1; side <= 1; side += 2) {
            struct vec n = scale(axes[a], side);
            struct vec u = scale(axes[(a + 1) % 3], side), v = axes[(a + 2) % 3];
            struct vec corner = sub(sub(add(center, n), u), v);
            quad(b, material, corner, scale(u, 2), scale(v, 2));
        }
    }
}

void box(struct builder *b, enum material material, struct vec center, struct vec half)
{
    block(b, material, center, vec(half.x, 0, 0), vec(0, half.y, 0), vec(0, 0, half.z));
}

void beam(struct builder *b, enum material material, struct vec from, struct vec to, struct vec up,
          double width, double depth)
{
    struct vec axis = unit(sub(to, from));
    struct vec across = unit(cross(axis, up)), above = cross(across, axis);
    block(b, material, scale(add(from, to), 0.5), scale(axis, length(sub(to, from)) / 2),
          scale(above, depth / 2), scale(across, width / 2));
}

static void reveal(struct builder *b, const struct wall *w, const struct hole *h)
{
    const struct vec up = vec(0, 1, 0), n = cross(w->u, up);
    struct vec depth = scale(n, w->thickness);
    struct vec low = along(along(w->corner, w->u, h->u0), up, h->v0);
    struct vec width = scale(w->u, h->u1 - h->u0), height = scale(up, h->v1 - h->v0);
    struct vec inner = sub(low, depth);
    quad(b, w->reveal, inner, height, depth);
    quad(b, w->reveal, add(inner, width), depth, height);
    quad(b, w->reveal, add(inner, height), width, depth);
    if (h->v0 > 0)
        quad(b, w->reveal, inner, depth, width);
}

static void wall_ends(struct builder *b, const struct wall *w, struct vec depth)
{
    struct vec up = vec(0, w->height, 0), inner = sub(w->corner, depth);
    quad(b, w->reveal, inner, depth, up);
    quad(b, w->reveal, along(inner, w->u, w->width), up, depth);
}

void wall(struct builder *b, const struct wall *w)
{
    const struct vec up = vec(0, 1, 0), depth = scale(cross(w->u, up), w->thickness);
    struct panel face = {w->outside,  w->corner,        w->u,     up,           w->width, w->height,
                         w->openings, w->opening_count, w->marks, w->mark_count};
    panel(b, &face);
    struct hole turned[16];
    double marks[16];
    for (size_t i = 0; i < w->opening_count && i < 16; i++) {
        const struct hole *h = &w->openings[i];
        turned[i] = (struct hole){w->width - h->u1, w->width - h->u0, h->v0, h->v1};
        reveal(b, w, h);
    }
    for (size_t i = 0; i < w->mark_count && i < 16; i++)
        marks[i] = w->width - w->marks[i];
    face.material = w->inside;
    face.corner = along(sub(w->corner, depth), w->u, w->width);
    face.u = scale(w->u, -1);
    face.holes = turned;
    face.marks = marks;
    panel(b, &face);
    quad(b, w->reveal, along(sub(w->corner, depth), up, w->height), depth, scale(w->u, w->width));
    if (w->ends)
        wall_ends(b, w, depth);
}

static struct vec around(double radius, double height, int side, int sides)
{
    double angle = 2 * LEVEL_PI * side / sides;
    return vec(radius * cos(angle), height, radius * sin(angle));
}

static void lathe_ring(struct builder *b, enum material material, struct vec base,
                       const double from[2], const double to[2], int sides)
{
    double dr = to[0] - from[0], dy = to[1] - from[1], l = hypot(dr, dy);
    int pieces = (int)fmax(1, ceil(l / b->edge));
    uint32_t first = 0;
    for (int j = 0; j <= pieces; j++) {
        double t = (double)j / pieces, r = mix(from[0], to[0], t), y = mix(from[1], to[1], t);
        for (int i = 0; i <= sides; i++) {
            struct vec n = add(scale(around(1, 0, i % sides, sides), dy / l), vec(0, -dr / l, 0));
            uint32_t index = put(b, material, add(base, around(r, y, i % sides, sides)), n,
                                 (double)i / sides, t);
            first = i || j ? first : index;
        }
    }
    uint32_t row = (uint32_t)sides + 1;
    for (uint32_t j = 0; j < (uint32_t)pieces; j++) {
        for (uint32_t i = 0; i < (uint32_t)sides; i++) {
            uint32_t a = first + j * row + i, d = a + row;
            if (from[0] > 1e-9 || j > 0)
                mesh_triangle(b->mesh, material, a, d, a + 1);
            if (to[0] > 1e-9 || j + 1 < (uint32_t)pieces)
                mesh_triangle(b->mesh, material, a + 1, d, d + 1);
        }
    }
}

void lathe(struct builder *b, enum material material, struct vec base, const double (*profile)[2],
           size_t count, int sides)
{
    for (size_t i = 0; i + 1 < count; i++)
        lathe_ring(b, material, base, profile[i], profile[i + 1], sides);
}

void tube(struct builder *b, enum material material, struct vec from, struct vec to, double radius0,
          double radius1, int sides, int pieces)
{
    struct vec axis = unit(sub(to, from));
    struct vec u = unit(cross(axis, fabs(axis.x) < 0.7 ? vec(1, 0, 0) : vec(0, 0, 1)));
    struct vec v = cross(axis, u);
    uint32_t first = 0, row = (uint32_t)sides + 1;
    for (int j = 0; j <= pieces; j++) {
        double t = (double)j / pieces, r = mix(radius0, radius1, t);
        struct vec middle = along(from, sub(to, from), t);
        for (int i = 0; i <= sides; i++) {
            double angle = 2 * LEVEL_PI * (i % sides) / sides;
            struct vec n = add(scale(u, cos(angle)), scale(v, sin(angle)));
            uint32_t index = put(b, material, along(middle, n, r), n, (double)i / sides, t);
            first = i || j ? first : index;
        }
    }
    for (uint32_t j = 0; j < (uint32_t)pieces; j++) {
        for (uint32_t i = 0; i < (uint32_t)sides; i++) {
            uint32_t a = first + j * row + i, d = a + row;
            mesh_triangle(b->mesh, material, a, a + 1, d);
            mesh_triangle(b->mesh, material, a + 1, d + 1, d);
        }
    }
}

/* Swelling of a blob in direction d: a few waves with phases from the seed, equal at any detail. */
static double swelling(struct vec d, double roughness, uint32_t seed)
{
    double sum = 0;
    for (uint32_t k = 0; k < 4; k++) {
        struct vec wave =
            vec(chance(seed, k, 0) - 0.5, chance(seed, k, 1) - 0.5, chance(seed, k, 2) - 0.5);
        sum += sin(dot(unit(wave), d) * (2.5 + 1.5 * k) + 6.28 * chance(seed, k, 3));
    }
    return 1 + roughness * sum / 2;
}

void blob(struct builder *b, enum material material, struct vec center, struct vec radii,
          double roughness, uint32_t seed, int sides)
{
    const struct surface *s = &b->mesh->surfaces[material];
    const size_t first_triangle = s->triangle_count;
    uint32_t first = (uint32_t)s->vertex_count, n = (uint32_t)sides;
    uint32_t rings = n / 2 + 1; /* counting both poles */
    for (uint32_t j = 0; j < rings; j++) {
        double polar = LEVEL_PI * j / (rings - 1);
        for (uint32_t i = 0; i < (j == 0 || j == rings - 1 ? 1 : n); i++) {
            double turn = 2 * LEVEL_PI * (i + 0.5 * (j % 2)) / n;
            struct vec d = vec(sin(polar) * cos(turn), cos(polar), sin(polar) * sin(turn));
            double r = swelling(d, roughness, seed);
            put(b, material,
                add(center, vec(d.x * radii.x * r, d.y * radii.y * r, d.z * radii.z * r)), d,
                (double)i / n, (double)j / rings);
        }
    }
    uint32_t last = first + 1 + (rings - 2) * n;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t next = (i + 1) % n;
        mesh_triangle(b->mesh, material, first, first + 1 + next, first + 1 + i);
        mesh_triangle(b->mesh, material, last, last - n + i, last - n + next);
        for (uint32_t j = 0; j + 3 < rings; j++) {
            uint32_t a = first + 1 + j * n + i, a1 = first + 1 + j * n + next;
            if (j % 2) {
                mesh_triangle(b->mesh, material, a, a1, a + n);
                mesh_triangle(b->mesh, material, a1, a1 + n, a + n);
            } else {
                mesh_triangle(b->mesh, material, a, a1, a1 + n);
                mesh_triangle(b->mesh, material, a, a1 + n, a + n);
            }
        }
    }
    mesh_smooth(b->mesh, material, first, first_triangle);
}

void card(struct builder *b, enum material material, struct vec center, struct vec half_u,
          struct vec half_v, struct vec normal, int pieces)
{
    uint32_t first = 0, row = (uint32_t)pieces + 1;
    for (int j = 0; j <= pieces; j++) {
        for (int i = 0; i <= pieces; i++) {
            double u = (double)i / pieces, v = (double)j / pieces;
            struct vec at = along(along(center, half_u, 2 * u - 1), half_v, 2 * v - 1);
            uint32_t index = put(b, material, at, normal, u, 1 - v);
            first = i || j ? first : index;
        }
    }
    for (uint32_t j = 0; j < (uint32_t)pieces; j++) {
        for (uint32_t i = 0; i < (uint32_t)pieces; i++) {
            uint32_t a = first + j * row + i;
            mesh_triangle(b->mesh, material, a, a + 1, a + row + 1);
            mesh_triangle(b->mesh, material, a, a + row + 1, a + row);
        }
    }
}
