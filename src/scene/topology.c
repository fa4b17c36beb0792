#include "scene/topology.h"

static int compare_u64(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static uint64_t mix(uint64_t h)
{
    h = (h ^ h >> 31) * 0x7fb5d329728ea185ull;
    h = (h ^ h >> 27) * 0x81dadef4bc2dd44dull;
    return h ^ h >> 33;
}

static uint64_t hash_position(const float p[3])
{
    uint32_t bits[3];
    for (int k = 0; k < 3; k++) {
        const float value = p[k] + 0.0f; /* −0 and 0 are one place */
        memcpy(&bits[k], &value, sizeof value);
    }
    return mix(mix((uint64_t)bits[0] << 32 | bits[1]) + bits[2]);
}

/* For every vertex the first one at its place. */
static uint32_t *weld(const struct cranny_mesh *mesh)
{
    size_t size = 16;
    while (size < 2 * (size_t)mesh->vertex_count)
        size *= 2;
    uint32_t *table = malloc(size * sizeof *table);
    uint32_t *first = alloc_array(mesh->vertex_count, sizeof *first);
    if (!table || !first) {
        free(table);
        free(first);
        return NULL;
    }
    memset(table, 0xff, size * sizeof *table);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const float *p = mesh->positions[v];
        size_t slot = (size_t)hash_position(p) & (size - 1);
        for (; table[slot] != UINT32_MAX; slot = (slot + 1) & (size - 1)) {
            const float *q = mesh->positions[table[slot]];
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2])
                break;
        }
        if (table[slot] == UINT32_MAX)
            table[slot] = v;
        first[v] = table[slot];
    }
    free(table);
    return first;
}

/* Twice the area, squared, in double: exact enough to call a triangle empty. */
static bool empty(const struct cranny_mesh *mesh, uint32_t triangle)
{
    const uint32_t *v = mesh->triangles[triangle];
    double e[2][3], sum = 0, longest = 0;
    for (int k = 0; k < 3; k++) {
        e[0][k] = (double)mesh->positions[v[1]][k] - mesh->positions[v[0]][k];
        e[1][k] = (double)mesh->positions[v[2]][k] - mesh->positions[v[0]][k];
        longest = fmax(longest, fmax(fabs(e[0][k]), fabs(e[1][k])));
    }
    for (int k = 0; k < 3; k++) {
        const double n =
            e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        sum += n * n;
    }
    return !(sum > 1e-28 * longest * longest * longest * longest);
}

/* A key that does not depend on where the triangle begins; the lowest bit is its direction. */
static uint64_t face_key(uint32_t a, uint32_t b, uint32_t c)
{
    const uint32_t low = a < b ? (a < c ? a : c) : (b < c ? b : c);
    const uint32_t second = low == a ? b : low == b ? c : a;
    const uint32_t third = low == a ? c : low == b ? a : b;
    const bool turned = second > third;
    const uint32_t near = turned ? third : second, far = turned ? second : third;
    return (mix(mix((uint64_t)low << 32 | near) + far) & ~1ull) | turned;
}

static void count_duplicates(const uint64_t *keys, size_t count, struct topology *topology)
{
    for (size_t begin = 0, end; begin < count; begin = end) {
        size_t turned = 0;
        for (end = begin; end < count && keys[end] >> 1 == keys[begin] >> 1; end++)
            turned += keys[end] & 1;
        const size_t straight = end - begin - turned;
        topology->back_to_back += turned && straight ? 1 : 0;
        topology->duplicates += (turned ? turned - 1 : 0) + (straight ? straight - 1 : 0);
    }
}

/* Both ends take all 64 bits; hashed, there is room for the direction. */
static uint64_t edge_key(uint32_t a, uint32_t b)
{
    const bool turned = a > b;
    return (mix((uint64_t)(turned ? b : a) << 32 | (turned ? a : b)) & ~1ull) | turned;
}

static void count_edges(const uint64_t *keys, size_t count, struct topology *topology)
{
    topology->closed = count > 0;
    for (size_t begin = 0, end; begin < count; begin = end) {
        size_t turned = 0;
        for (end = begin; end < count && keys[end] >> 1 == keys[begin] >> 1; end++)
            turned += keys[end] & 1;
        const bool pair = end - begin == 2;
        topology->flipped_edges += pair && turned != 1;
        topology->closed = topology->closed && pair && turned == 1;
    }
}

static double corner_volume(const struct cranny_mesh *mesh, uint32_t t)
{
    const float *a = mesh->positions[mesh->triangles[t][0]];
    const float *b = mesh->positions[mesh->triangles[t][1]];
    const float *c = mesh->positions[mesh->triangles[t][2]];
    const float *o = mesh->positions[mesh->triangles[0][0]];
    double p[3], q[3], r[3];
    for (int k = 0; k < 3; k++) {
        p[k] = (double)a[k] - o[k];
        q[k] = (double)b[k] - o[k];
        r[k] = (double)c[k] - o[k];
    }
    return (p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
            p[2] * (q[0] * r[1] - q[1] * r[0])) /
           6;
}

static void measure_faces(const struct cranny_mesh *mesh, const uint32_t *first, uint64_t *faces,
                          uint64_t *edges, struct topology *topology)
{
    size_t face_count = 0, edge_count = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *v = mesh->triangles[t];
        const uint32_t w[3] = {first[v[0]], first[v[1]], first[v[2]]};
        topology->volume += corner_volume(mesh, t);
        topology->degenerate += empty(mesh, t);
        if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0])
            continue;
        faces[face_count++] = face_key(w[0], w[1], w[2]);
        for (int c = 0; c < 3; c++)
            edges[edge_count++] = edge_key(w[c], w[(c + 1) % 3]);
    }
    qsort(faces, face_count, sizeof *faces, compare_u64);
    qsort(edges, edge_count, sizeof *edges, compare_u64);
    count_duplicates(faces, face_count, topology);
    count_edges(edges, edge_count, topology);
}

static bool count_unused(const struct cranny_mesh *mesh, struct topology *topology)
{
    uint8_t *used = alloc_array(mesh->vertex_count, 1);
    if (!used)
        return false;
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        for (int c = 0; c < 3; c++)
            used[mesh->triangles[t][c]] = 1;
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        topology->unused_vertices += !used[v];
    free(used);
    return true;
}

enum cranny_status topology_measure(const struct cranny_mesh *mesh, struct topology *topology,
                                    struct cranny_error *why)
{
    const size_t triangles = mesh->triangle_count;
    *topology = (struct topology){0};
    uint32_t *first = weld(mesh);
    uint64_t *faces = malloc((triangles + 1) * sizeof *faces);
    uint64_t *edges = malloc((3 * triangles + 1) * sizeof *edges);
    const bool good = first && faces && edges && count_unused(mesh, topology);
    if (good)
        measure_faces(mesh, first, faces, edges, topology);
    free(first);
    free(faces);
    free(edges);
    return good ? CRANNY_OK : fail_memory(why, "check");
}
