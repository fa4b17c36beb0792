#include "mesh.h"

#include <stdlib.h>

double chance(uint32_t seed, uint32_t a, uint32_t b)
{
    uint32_t h =
        seed * 0x9e3779b9u ^ (a + 0x7f4a7c15u) * 0x85ebca6bu ^ (b + 0x165667b1u) * 0xc2b2ae35u;
    for (int i = 0; i < 2; i++) {
        h ^= h >> 16;
        h *= 0x7feb352du;
        h ^= h >> 15;
        h *= 0x846ca68bu;
    }
    h ^= h >> 16;
    return h * (1.0 / 4294967296.0);
}

bool material_is_masked(enum material material)
{
    return material == MATERIAL_LEAVES || material == MATERIAL_GRASS || material == MATERIAL_FENCE;
}

void mesh_free(struct mesh *mesh)
{
    for (int i = 0; i < MATERIAL_COUNT; i++) {
        free(mesh->surfaces[i].positions);
        free(mesh->surfaces[i].normals);
        free(mesh->surfaces[i].uvs);
        free(mesh->surfaces[i].colors);
        free(mesh->surfaces[i].triangles);
    }
}

size_t mesh_vertex_count(const struct mesh *mesh)
{
    size_t count = 0;
    for (int i = 0; i < MATERIAL_COUNT; i++)
        count += mesh->surfaces[i].vertex_count;
    return count;
}

size_t mesh_triangle_count(const struct mesh *mesh)
{
    size_t count = 0;
    for (int i = 0; i < MATERIAL_COUNT; i++)
        count += mesh->surfaces[i].triangle_count;
    return count;
}

static bool resize(void **items, size_t count, size_t size)
{
    void *grown = realloc(*items, count * size);
    if (grown)
        *items = grown;
    return grown != NULL;
}

static bool grow_vertices(struct surface *s, enum material material)
{
    size_t capacity = s->vertex_capacity ? s->vertex_capacity * 2 : 256;
    bool good =
        resize((void **)&s->positions, capacity, sizeof *s->positions) &&
        resize((void **)&s->normals, capacity, sizeof *s->normals) &&
        resize((void **)&s->uvs, capacity, sizeof *s->uvs) &&
        (material != MATERIAL_GROUND || resize((void **)&s->colors, capacity, sizeof *s->colors));
    if (good)
        s->vertex_capacity = capacity;
    return good;
}

uint32_t mesh_vertex(struct mesh *mesh, enum material material, struct vec position,
                     struct vec normal, double u, double v)
{
    struct surface *s = &mesh->surfaces[material];
    if (s->vertex_count == s->vertex_capacity && !grow_vertices(s, material)) {
        mesh->failed = true;
        return 0;
    }
    float *p = s->positions[s->vertex_count], *n = s->normals[s->vertex_count];
    p[0] = (float)position.x, p[1] = (float)position.y, p[2] = (float)position.z;
    n[0] = (float)normal.x, n[1] = (float)normal.y, n[2] = (float)normal.z;
    s->uvs[s->vertex_count][0] = (float)u;
    s->uvs[s->vertex_count][1] = (float)v;
    if (s->colors)
        for (int i = 0; i < 4; i++)
            s->colors[s->vertex_count][i] = 255;
    return (uint32_t)s->vertex_count++;
}

void mesh_triangle(struct mesh *mesh, enum material material, uint32_t a, uint32_t b, uint32_t c)
{
    struct surface *s = &mesh->surfaces[material];
    if (s->triangle_count == s->triangle_capacity) {
        size_t capacity = s->triangle_capacity ? s->triangle_capacity * 2 : 256;
        if (!resize((void **)&s->triangles, capacity, sizeof *s->triangles)) {
            mesh->failed = true;
            return;
        }
        s->triangle_capacity = capacity;
    }
    uint32_t *t = s->triangles[s->triangle_count++];
    t[0] = a, t[1] = b, t[2] = c;
}

static struct vec position(const struct surface *s, uint32_t i)
{
    return vec(s->positions[i][0], s->positions[i][1], s->positions[i][2]);
}

void mesh_smooth(struct mesh *mesh, enum material material, size_t first, size_t first_triangle)
{
    struct surface *s = &mesh->surfaces[material];
    if (mesh->failed)
        return;
    struct vec *sums = calloc(s->vertex_count - first + 1, sizeof *sums);
    if (!sums) {
        mesh->failed = true;
        return;
    }
    for (size_t t = first_triangle; t < s->triangle_count; t++) {
        const uint32_t *c = s->triangles[t];
        struct vec a = position(s, c[0]);
        struct vec n = cross(sub(position(s, c[1]), a), sub(position(s, c[2]), a));
        for (int k = 0; k < 3; k++)
            sums[c[k] - first] = add(sums[c[k] - first], n);
    }
    for (size_t i = first; i < s->vertex_count; i++) {
        struct vec n = unit(sums[i - first]);
        s->normals[i][0] = (float)n.x;
        s->normals[i][1] = (float)n.y;
        s->normals[i][2] = (float)n.z;
    }
    free(sums);
}
