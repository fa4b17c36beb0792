/* Quads out of pairs of triangles: one volume in place of two (McGuire 2009, §6: about 35 %
 * faster).
 *
 * Vertices at one place count as one, so that seams of texture coordinates do not matter. */
#include "base/sequence.h"
#include "base/vector.h"
#include "volumes/volumes.h"

#define FLATNESS 1e-4   /* of the fourth corner's distance from the plane, in diagonals */
#define LEAST_SINE 1e-3 /* of a corner: no three corners in a line */
#define SEARCH_MAX 64   /* triangles looked at around a vertex */

/* What a triangle could be joined to, found for all at once. */
struct seams {
    uint32_t partner[3]; /* over the edge from `corner`: makes a quad with it; or FACE_NONE */
    uint8_t corner[3];   /* longest edge first: of a rectangle's halves, that is the diagonal */
    bool closed;         /* every edge has a partner that runs the other way */
};

struct quilt {
    const struct cranny_mesh *mesh;
    uint32_t *places; /* of vertices: the first one there */
    uint32_t *begin;  /* of a place's triangles in `around`; vertex_count + 1 */
    uint32_t *around; /* triangles */
    struct seams *seams;
    uint8_t *taken; /* triangles that are part of a face */
    int threads;
};

static uint32_t hash_place(const float p[3])
{
    uint32_t bits[3], hash = 0;
    for (int k = 0; k < 3; k++) {
        const float x = p[k] + 0.0f; /* −0 is 0 */
        memcpy(&bits[k], &x, sizeof x);
        hash = hash_combine(hash, bits[k]);
    }
    return hash;
}

static bool find_places(struct quilt *q)
{
    const struct cranny_mesh *mesh = q->mesh;
    size_t size = 16;
    while (size < 2 * (size_t)mesh->vertex_count)
        size *= 2;
    uint32_t *table = alloc_array(size, sizeof *table);
    if (!table)
        return false;
    memset(table, 0xff, size * sizeof *table);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const float *p = mesh->positions[v];
        size_t at = hash_place(p) & (size - 1);
        while (table[at] != FACE_NONE) {
            const float *o = mesh->positions[table[at]];
            if (o[0] == p[0] && o[1] == p[1] && o[2] == p[2])
                break;
            at = (at + 1) & (size - 1);
        }
        if (table[at] == FACE_NONE)
            table[at] = v;
        q->places[v] = table[at];
    }
    free(table);
    return true;
}

static uint32_t place_of(const struct quilt *q, uint32_t triangle, int corner)
{
    return q->places[q->mesh->triangles[triangle][corner % 3]];
}

static void find_neighbours(struct quilt *q)
{
    const struct cranny_mesh *mesh = q->mesh;
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        for (int c = 0; c < 3; c++)
            q->begin[place_of(q, t, c) + 1]++;
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        q->begin[v + 1] += q->begin[v];
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        for (int c = 0; c < 3; c++)
            q->around[q->begin[place_of(q, t, c)]++] = t;
    memmove(q->begin + 1, q->begin, mesh->vertex_count * sizeof *q->begin);
    q->begin[0] = 0;
}

static void corner_of(const struct quilt *q, uint32_t vertex, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = (double)q->mesh->positions[vertex][k];
}

/* Whether the four make a flat, convex quad that winds one way. */
static bool is_quad(const struct quilt *q, const uint32_t corners[4])
{
    double p[4][3], d[2][3], n[3], e[4][3], across[3];
    for (int i = 0; i < 4; i++)
        corner_of(q, corners[i], p[i]);
    for (int k = 0; k < 3; k++) {
        d[0][k] = p[2][k] - p[0][k];
        d[1][k] = p[3][k] - p[1][k];
        across[k] = p[1][k] - p[0][k];
    }
    const double size = sqrt(fmax(dot3(d[0], d[0]), dot3(d[1], d[1])));
    cross3(d[0], d[1], n);
    if (!normalise3(n) || !(fabs(dot3(across, n)) <= FLATNESS * size))
        return false;
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 3; k++)
            e[i][k] = p[(i + 1) % 4][k] - p[i][k];
        if (!normalise3(e[i]))
            return false;
    }
    for (int i = 0; i < 4; i++) {
        double turn[3];
        cross3(e[i], e[(i + 1) % 4], turn);
        if (!(dot3(turn, n) > LEAST_SINE))
            return false;
    }
    return true;
}

static double edge_length2(const struct quilt *q, uint32_t triangle, int corner)
{
    double a[3], b[3], sum = 0;
    corner_of(q, place_of(q, triangle, corner), a);
    corner_of(q, place_of(q, triangle, corner + 1), b);
    for (int k = 0; k < 3; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

/* Corners of the quad that `t` makes with `other` over its edge from `corner`; false: none. */
static bool quad_of(const struct quilt *q, uint32_t t, int corner, uint32_t other,
                    uint32_t corners[4])
{
    const uint32_t a = place_of(q, t, corner), b = place_of(q, t, corner + 1);
    for (int c = 0; c < 3; c++) {
        if (place_of(q, other, c) != b || place_of(q, other, c + 1) != a)
            continue;
        corners[0] = place_of(q, t, corner + 2);
        corners[1] = a;
        corners[2] = place_of(q, other, c + 2);
        corners[3] = b;
        if (is_quad(q, corners))
            return true;
    }
    return false;
}

/* The first triangle on the other side of the edge from `corner` with which `t` makes a quad. */
static uint32_t partner_over(const struct quilt *q, uint32_t t, int corner)
{
    const uint32_t *materials = q->mesh->triangle_materials;
    const uint32_t a = place_of(q, t, corner);
    const uint32_t begin = q->begin[a], end = q->begin[a + 1];
    uint32_t corners[4];
    for (uint32_t i = begin; i < end && i < begin + SEARCH_MAX; i++) {
        const uint32_t other = q->around[i];
        if (other != t && materials[other] == materials[t] && quad_of(q, t, corner, other, corners))
            return other;
    }
    return FACE_NONE;
}

static void order_edges(const struct quilt *q, uint32_t t, uint8_t order[3])
{
    double length[3];
    for (int c = 0; c < 3; c++) {
        order[c] = (uint8_t)c;
        length[c] = edge_length2(q, t, c);
    }
    for (int i = 1; i < 3; i++)
        for (int j = i; j > 0 && length[order[j]] > length[order[j - 1]]; j--) {
            const uint8_t swap = order[j];
            order[j] = order[j - 1];
            order[j - 1] = swap;
        }
}

static bool is_closed(const struct quilt *q, uint32_t t)
{
    for (int c = 0; c < 3; c++) {
        const uint32_t a = place_of(q, t, c), b = place_of(q, t, c + 1);
        const uint32_t begin = q->begin[a], end = q->begin[a + 1];
        bool found = a == b;
        for (uint32_t i = begin; i < end && i < begin + SEARCH_MAX && !found; i++)
            for (int k = 0; k < 3; k++)
                found |= place_of(q, q->around[i], k) == b && place_of(q, q->around[i], k + 1) == a;
        if (!found)
            return false;
    }
    return true;
}

static void find_seams(struct quilt *q, bool quads)
{
    const uint32_t count = q->mesh->triangle_count;
#pragma omp parallel for schedule(dynamic, 4096)                                                   \
    num_threads(q->threads) if (count >= PARALLEL_LEAST)
    for (uint32_t t = 0; t < count; t++) {
        struct seams *seams = &q->seams[t];
        order_edges(q, t, seams->corner);
        seams->closed = is_closed(q, t);
        for (int i = 0; i < 3; i++)
            seams->partner[i] = quads ? partner_over(q, t, seams->corner[i]) : FACE_NONE;
    }
}

/* In the order of triangles, each with the first of its partners that is still free. */
static bool join(struct quilt *q, uint32_t t, struct volume_face *face)
{
    const struct seams *seams = &q->seams[t];
    for (int i = 0; i < 3; i++) {
        const uint32_t other = seams->partner[i];
        if (other == FACE_NONE || q->taken[other] ||
            !quad_of(q, t, seams->corner[i], other, face->corner))
            continue;
        face->triangles[0] = t;
        face->triangles[1] = other;
        face->closed = false;
        q->taken[other] = 1;
        return true;
    }
    return false;
}

static void collect(struct quilt *q, struct volume_face *faces, uint32_t *count)
{
    for (uint32_t t = 0; t < q->mesh->triangle_count; t++) {
        const uint32_t *c = q->mesh->triangles[t];
        if (q->taken[t])
            continue;
        struct volume_face *face = &faces[(*count)++];
        q->taken[t] = 1;
        if (!join(q, t, face))
            *face = (struct volume_face){{c[0], c[1], c[2], c[0]}, {t, FACE_NONE}, false};
    }
}

static uint32_t root_of(uint32_t *parents, uint32_t v)
{
    while (parents[v] != v)
        v = parents[v] = parents[parents[v]];
    return v;
}

/* Triangles of surfaces without a border: nobody sees their backs. */
static bool find_closed(const struct quilt *q, struct volume_face *faces, uint32_t count)
{
    const struct cranny_mesh *mesh = q->mesh;
    uint32_t *parents = alloc_array(mesh->vertex_count, sizeof *parents);
    uint8_t *open = alloc_array(mesh->vertex_count, 1);
    for (uint32_t v = 0; parents && v < mesh->vertex_count; v++)
        parents[v] = v;
    for (uint32_t t = 0; parents && t < mesh->triangle_count; t++)
        for (int c = 1; c < 3; c++)
            parents[root_of(parents, place_of(q, t, c))] = root_of(parents, place_of(q, t, 0));
    for (uint32_t t = 0; parents && open && t < mesh->triangle_count; t++)
        if (!q->seams[t].closed)
            open[root_of(parents, place_of(q, t, 0))] = 1;
    const bool ready = parents && open;
    for (uint32_t f = 0; ready && f < count; f++)
        faces[f].closed = !open[root_of(parents, place_of(q, faces[f].triangles[0], 0))];
    free(parents);
    free(open);
    return ready;
}

static bool stitch(struct quilt *q, bool quads)
{
    const size_t vertices = q->mesh->vertex_count, triangles = q->mesh->triangle_count;
    q->places = alloc_array(vertices, sizeof *q->places);
    q->begin = alloc_array(vertices + 1, sizeof *q->begin);
    q->around = alloc_array(3 * triangles, sizeof *q->around);
    q->seams = alloc_array(triangles, sizeof *q->seams);
    q->taken = alloc_array(triangles, sizeof *q->taken);
    if (!q->places || !q->begin || !q->around || !q->seams || !q->taken || !find_places(q))
        return false;
    find_neighbours(q);
    find_seams(q, quads);
    return true;
}

enum cranny_status faces_find(const struct cranny_mesh *mesh, bool quads, int threads,
                              struct volume_face **faces, uint32_t *count, struct cranny_error *why)
{
    struct quilt q = {.mesh = mesh, .threads = threads};
    *count = 0;
    *faces = alloc_array(mesh->triangle_count, sizeof **faces);
    bool ready = *faces && stitch(&q, quads);
    if (ready) {
        collect(&q, *faces, count);
        ready = find_closed(&q, *faces, *count);
    }
    free(q.places);
    free(q.begin);
    free(q.around);
    free(q.seams);
    free(q.taken);
    if (ready)
        return CRANNY_OK;
    free(*faces);
    *faces = NULL;
    return fail_memory(why, "volumes' quads");
}
