#include "bake/surface.h"

#include "base/sequence.h"

/* What is welded: position and, when there is one, normal. */
struct key {
    uint32_t words[6];
};

static uint32_t float_bits(float value)
{
    uint32_t bits;
    const float positive_zero = value + 0.0f;
    memcpy(&bits, &positive_zero, sizeof bits);
    return bits;
}

static struct key key_of(const struct cranny_mesh *mesh, uint32_t vertex)
{
    struct key key = {{0}};
    for (int k = 0; k < 3; k++) {
        key.words[k] = float_bits(mesh->positions[vertex][k]);
        if (mesh->normals)
            key.words[3 + k] = float_bits(mesh->normals[vertex][k]);
    }
    return key;
}

static uint32_t hash_key(const struct key *key)
{
    uint64_t h = 0;
    for (int i = 0; i < 6; i++)
        h = (h ^ key->words[i]) * 0x9e3779b97f4a7c15ull;
    return hash_u32((uint32_t)(h >> 32));
}

static void mark_used(const struct cranny_mesh *mesh, struct surface *surface)
{
    memset(surface->unknown_of, 0xff, (size_t)mesh->vertex_count * sizeof(uint32_t));
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        for (int c = 0; c < 3; c++)
            surface->unknown_of[mesh->triangles[t][c]] = 0;
}

/* Gives every used vertex its unknown, in the order of first appearance; `first` receives each
 * unknown's first vertex. */
static void weld(const struct cranny_mesh *mesh, struct surface *surface, uint32_t *slots,
                 uint32_t mask, uint32_t *first)
{
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        if (surface->unknown_of[v] == SURFACE_NONE)
            continue;
        const struct key key = key_of(mesh, v);
        uint32_t slot = hash_key(&key) & mask;
        for (; slots[slot] != SURFACE_NONE; slot = (slot + 1) & mask) {
            const struct key other = key_of(mesh, first[slots[slot]]);
            if (memcmp(&key, &other, sizeof key) == 0)
                break;
        }
        if (slots[slot] == SURFACE_NONE) {
            slots[slot] = surface->unknown_count;
            first[surface->unknown_count++] = v;
        }
        surface->unknown_of[v] = slots[slot];
    }
}

static void place_unknowns(const struct cranny_mesh *mesh, const double m[9], const uint32_t *first,
                           struct surface *surface)
{
    for (uint32_t u = 0; u < surface->unknown_count; u++) {
        const float *p = mesh->positions[first[u]];
        for (int i = 0; i < 3; i++)
            surface->position[u][i] = m[3 * i] * p[0] + m[3 * i + 1] * p[1] + m[3 * i + 2] * p[2];
    }
}

static enum cranny_status weld_vertices(const struct cranny_mesh *mesh, const double metric[9],
                                        struct surface *surface, struct cranny_error *why)
{
    size_t slot_count = 16;
    while (slot_count < (size_t)mesh->vertex_count * 2)
        slot_count *= 2;
    surface->unknown_of = alloc_array(mesh->vertex_count, sizeof(uint32_t));
    uint32_t *slots = alloc_array(slot_count, sizeof *slots);
    uint32_t *first = alloc_array(mesh->vertex_count, sizeof *first);
    bool complete = surface->unknown_of && slots && first && slot_count <= 1ull << 32;
    if (complete) {
        memset(slots, 0xff, slot_count * sizeof *slots);
        mark_used(mesh, surface);
        weld(mesh, surface, slots, (uint32_t)(slot_count - 1), first);
        surface->position = alloc_array(surface->unknown_count, sizeof *surface->position);
        complete = surface->position;
    }
    if (complete)
        place_unknowns(mesh, metric, first, surface);
    free(slots);
    free(first);
    return complete ? CRANNY_OK : fail_memory(why, "fit");
}

static void weld_triangles(const struct cranny_mesh *mesh, struct surface *surface)
{
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        uint32_t *corner = surface->triangles[t];
        for (int c = 0; c < 3; c++)
            corner[c] = surface->unknown_of[mesh->triangles[t][c]];
        if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0])
            corner[0] = corner[1] = corner[2] = SURFACE_NONE;
    }
}

static void list_incidents(struct surface *surface)
{
    uint32_t *start = surface->incident_start;
    for (uint32_t t = 0; t < surface->triangle_count; t++)
        for (int c = 0; c < 3 && surface->triangles[t][c] != SURFACE_NONE; c++)
            start[surface->triangles[t][c] + 1]++;
    for (uint32_t u = 0; u < surface->unknown_count; u++)
        start[u + 1] += start[u];
    for (uint32_t t = 0; t < surface->triangle_count; t++)
        for (uint32_t c = 0; c < 3 && surface->triangles[t][c] != SURFACE_NONE; c++)
            surface->incident[start[surface->triangles[t][c]]++] = 3 * t + c;
    for (uint32_t u = surface->unknown_count; u > 0; u--)
        start[u] = start[u - 1];
    start[0] = 0;
}

/* The apex beyond the edge from corner `c` of triangle `t`: there must be exactly one other
 * triangle on it, and it must run along the edge the other way. */
static uint32_t find_across(const struct surface *surface, uint32_t t, int c)
{
    const uint32_t a = surface->triangles[t][c], b = surface->triangles[t][(c + 1) % 3];
    const uint32_t *start = surface->incident_start;
    const uint32_t shorter = start[a + 1] - start[a] <= start[b + 1] - start[b] ? a : b;
    const uint32_t other = shorter == a ? b : a;
    uint32_t found = SURFACE_NONE;
    bool met = false;
    for (uint32_t i = start[shorter]; i < start[shorter + 1]; i++) {
        const uint32_t near = surface->incident[i] / 3, corner = surface->incident[i] % 3;
        const uint32_t *v = surface->triangles[near];
        const uint32_t next = v[(corner + 1) % 3], last = v[(corner + 2) % 3];
        if (near == t || (next != other && last != other))
            continue;
        if (met)
            return SURFACE_NONE;
        met = true;
        const bool opposite = shorter == b ? next == a : last == b;
        found = opposite ? 3 * near + (corner + (next == other ? 2 : 1)) % 3 : SURFACE_NONE;
    }
    /* Back to back on the same three vertices: one row would meet the edge twice. */
    const bool folded =
        met && found != SURFACE_NONE &&
        surface->triangles[found / 3][found % 3] == surface->triangles[t][(c + 2) % 3];
    return folded ? SURFACE_NONE : found;
}

static void find_neighbours(struct surface *surface, int threads)
{
#pragma omp parallel for num_threads(threads) schedule(static) if (threads > 1)
    for (uint32_t t = 0; t < surface->triangle_count; t++)
        for (int c = 0; c < 3; c++)
            surface->across[t][c] = surface->triangles[t][0] == SURFACE_NONE
                                        ? SURFACE_NONE
                                        : find_across(surface, t, c);
}

enum cranny_status surface_create(const struct cranny_mesh *mesh, const double metric[9],
                                  int threads, struct surface *surface, struct cranny_error *why)
{
    *surface = (struct surface){.vertex_count = mesh->vertex_count,
                                .triangle_count = mesh->triangle_count};
    const size_t triangles = mesh->triangle_count;
    if (triangles > UINT32_MAX / 3)
        return fail(why, CRANNY_MEMORY, "mesh '%s': too many triangles to fit in one piece",
                    mesh->name ? mesh->name : "");
    enum cranny_status status = weld_vertices(mesh, metric, surface, why);
    if (status == CRANNY_OK) {
        surface->triangles = alloc_array(triangles, sizeof *surface->triangles);
        surface->across = alloc_array(triangles, sizeof *surface->across);
        surface->incident_start = alloc_array((size_t)surface->unknown_count + 1, sizeof(uint32_t));
        surface->incident = alloc_array(triangles, 3 * sizeof(uint32_t));
        if (!surface->triangles || !surface->across || !surface->incident_start ||
            !surface->incident)
            status = fail_memory(why, "fit");
    }
    if (status != CRANNY_OK) {
        surface_free(surface);
        return status;
    }
    weld_triangles(mesh, surface);
    list_incidents(surface);
    find_neighbours(surface, threads);
    return CRANNY_OK;
}

void surface_free(struct surface *surface)
{
    free(surface->unknown_of);
    free(surface->triangles);
    free(surface->across);
    free(surface->incident_start);
    free(surface->incident);
    free(surface->position);
    *surface = (struct surface){0};
}

uint64_t surface_bytes(const struct surface *surface)
{
    return (uint64_t)surface->vertex_count * 4 + (uint64_t)surface->triangle_count * 36 +
           (uint64_t)surface->unknown_count * 28;
}
