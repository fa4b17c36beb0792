#include "scene/mesh.h"

/* Sums of the adjacent faces' normals, each as long as twice its area. */
static void sum_faces(const struct builder *b, double (*sums)[3])
{
    for (uint32_t t = 0; t < b->triangle_count; t++) {
        const uint32_t *v = b->triangles[t];
        double e[2][3], n[3];
        for (int k = 0; k < 3; k++) {
            e[0][k] = (double)b->positions[v[1]][k] - b->positions[v[0]][k];
            e[1][k] = (double)b->positions[v[2]][k] - b->positions[v[0]][k];
        }
        for (int k = 0; k < 3; k++)
            n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                sums[v[c]][k] += n[k];
    }
}

/* False for a vector without a direction. */
static bool normalize(float v[3])
{
    const double x = v[0], y = v[1], z = v[2], length = sqrt(x * x + y * y + z * z);
    if (!(length > 1e-30) || !isfinite(length))
        return false;
    v[0] = (float)(x / length);
    v[1] = (float)(y / length);
    v[2] = (float)(z / length);
    return true;
}

static void face_normal(const double sum[3], float normal[3])
{
    const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    const bool valid = length > 0 && isfinite(length);
    for (int k = 0; k < 3; k++)
        normal[k] = valid ? (float)(sum[k] / length) : k == 1;
}

enum cranny_status normals_complete(struct builder *builder, struct cranny_error *why)
{
    const size_t count = (size_t)builder->vertex_count;
    double(*sums)[3] = NULL;
    if (!builder->normals)
        return CRANNY_OK;
    for (size_t v = 0; v < count; v++) {
        if (normalize(builder->normals[v]))
            continue;
        if (!sums) {
            enum cranny_status status =
                document_reserve(builder->gltf->document, count * sizeof *sums, "normals", why);
            if (status != CRANNY_OK)
                return status;
            sums = alloc_array(count, sizeof *sums);
            if (!sums)
                return fail_memory(why, "normals");
            sum_faces(builder, sums);
        }
        face_normal(sums[v], builder->normals[v]);
    }
    free(sums);
    return CRANNY_OK;
}
