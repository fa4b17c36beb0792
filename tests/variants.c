/* One model in seventeen encodings: all must load to the same triangles in the world. */
#include "check.h"

#include "scene/draco.h"
#include "scene/scene.h"

#include <cranny/scene.h>

/* Integrals over the surface that do not depend on how it is stored. */
struct integrals {
    uint64_t triangles, with_area;
    double area[3];   /* oriented */
    double total;     /* unoriented */
    double first[3];  /* ∫ x */
    double second[6]; /* ∫ x xᵀ */
    double volume;
};

static void add_triangle(struct integrals *sum, double p[3][3])
{
    double e[2][3], n[3], middle[3], length = 0;
    for (int k = 0; k < 3; k++) {
        e[0][k] = p[1][k] - p[0][k];
        e[1][k] = p[2][k] - p[0][k];
        middle[k] = (p[0][k] + p[1][k] + p[2][k]) / 3;
    }
    for (int k = 0; k < 3; k++) {
        n[k] = (e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3]) / 2;
        length += n[k] * n[k];
    }
    length = sqrt(length);
    sum->triangles++;
    sum->with_area += length > 0;
    sum->total += length;
    for (int k = 0; k < 3; k++) {
        sum->area[k] += n[k];
        sum->first[k] += length * middle[k];
        sum->volume += n[k] * middle[k] / 3;
    }
    for (int i = 0, m = 0; i < 3; i++)
        for (int j = i; j < 3; j++, m++)
            for (int c = 0; c < 3; c++) /* edge midpoints integrate squares exactly */
                sum->second[m] += length / 3 * (p[c][i] + p[(c + 1) % 3][i]) / 2 *
                                  (p[c][j] + p[(c + 1) % 3][j]) / 2;
}

/* Mirrored instances keep their front faces, so that their order has to be turned here. */
static struct integrals integrate(const struct cranny_scene *scene)
{
    struct integrals sum = {0};
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const struct cranny_instance *instance = cranny_scene_instance(scene, i);
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, instance->mesh);
        const bool mirrored = transform_determinant(instance->world_from_object) < 0;
        for (uint32_t t = 0; t < mesh->triangle_count; t++) {
            double p[3][3];
            for (int c = 0; c < 3; c++)
                transform_point(instance->world_from_object, mesh->positions[mesh->triangles[t][c]],
                                p[mirrored ? 2 - c : c]);
            add_triangle(&sum, p);
        }
    }
    return sum;
}

static bool load(const char *folder, const char *file, struct integrals *sum)
{
    char path[1024];
    struct cranny_error why = {0};
    struct cranny_scene *scene;
    snprintf(path, sizeof path, "%s/variants_camp/%s", folder, file);
    enum cranny_status status = cranny_scene_load(path, NULL, &scene, &why);
    if (check_left_out(why.message))
        return false;
    CHECK_MSG(status == CRANNY_OK, "%s", why.message);
    if (status != CRANNY_OK)
        return false;
    *sum = integrate(scene);
    for (uint32_t m = 0; m < cranny_scene_mesh_count(scene); m++) {
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, m);
        CHECK(mesh->normals != NULL);
        for (uint32_t v = 0; mesh->normals && v < mesh->vertex_count; v += 97) {
            const float *n = mesh->normals[v];
            CHECK_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-5);
        }
    }
    cranny_scene_destroy(&scene);
    return true;
}

static void compare(const char *file, const struct integrals *a, const struct integrals *b,
                    double tolerance)
{
    const double *x = a->area, *y = b->area;
    CHECK_MSG(a->with_area == b->with_area, "%s: %llu triangles with area, not %llu", file,
              (unsigned long long)a->with_area, (unsigned long long)b->with_area);
    /* oriented integrals cancel, so that each is compared on the scale of area times extent */
    const size_t count = sizeof(struct integrals) / sizeof(double) - 2;
    for (size_t i = 0; i < count; i++) {
        const double extent = 10, scale = b->total * (i < 4    ? 1
                                                      : i < 7  ? extent
                                                      : i < 13 ? extent * extent
                                                               : extent);
        CHECK_MSG(fabs(x[i] - y[i]) <= tolerance * scale, "%s: integral %zu is %.9g, not %.9g",
                  file, i, x[i], y[i]);
    }
}

#if CRANNY_HAVE_DRACO
/* The counts that are checked before decoding must be those that come out of it. */
static void test_draco_claims(const char *folder)
{
    struct cranny_error why = {0};
    char path[1024], message[256];
    uint8_t *data;
    size_t size, found = 0;
    snprintf(path, sizeof path, "%s/variants_camp/draco.glb", folder);
    CHECK_OK(file_read(path, 1 << 24, &data, &size, &why), why);
    for (size_t at = 0; at + 11 < size; at++) {
        uint64_t triangles = 0, points = 0;
        if (memcmp(data + at, "DRACO", 5) || data[at + 5] != 2)
            continue;
        struct draco_geometry *geometry =
            draco_decode(data + at, size - at, message, sizeof message);
        CHECK(draco_claims(data + at, size - at, &triangles, &points));
        CHECK(geometry != NULL);
        if (geometry) {
            CHECK_INT(triangles, draco_triangles(geometry));
            /* edgebreaker counts vertices before seams split them */
            CHECK(points > 0 && points <= draco_points(geometry));
            draco_free(geometry);
        }
        found++;
    }
    CHECK_INT(found, 12);
    free(data);
}
#endif

int main(void)
{
    static const struct {
        const char *file;
        double tolerance; /* relative to area and extent */
        int dropped;      /* triangles without area that the encoding leaves out */
        bool rounded;     /* quantisation may make or close tiny triangles */
    } variants[] = {
        {"unindexed.glb", 1e-12, 0, false},
        {"indices_u32.glb", 1e-12, 0, false},
        {"indices_u8_many_primitives.glb", 1e-12, 0, false},
        {"interleaved.glb", 1e-12, 0, false},
        {"sparse.glb", 1e-12, 0, false},
        {"triangle_strips.glb", 1e-12, 16, false},
        {"triangle_fans.glb", 1e-12, 16, false},
        {"nested_trs.glb", 1e-7, 0, false},
        {"negative_scale.glb", 1e-7, 0, false},
        {"skinned_bind_pose.glb", 1e-7, 0, false},
        {"morph_half.glb", 1e-7, 0, false},
        {"data_uri.gltf", 1e-12, 0, false},
        {"many_buffers/many_buffers.gltf", 1e-12, 0, false},
        {"cämp ♻ 野営地.gltf", 1e-12, 0, false},
        {"quantized.glb", 1e-4, 0, true},
        {"meshopt.glb", 1e-4, 0, true},
        {"draco.glb", 1e-4, 16, true},
    };
    const char *folder = check_scenes();
    struct integrals reference, sum;
    if (!folder)
        return check_skip("variants", "no real scenes");
    if (!load(folder, "ref.glb", &reference))
        return check_end("variants");
    CHECK_INT(reference.triangles, 6285);
#if CRANNY_HAVE_DRACO
    test_draco_claims(folder);
#endif
    for (size_t i = 0; i < sizeof variants / sizeof *variants; i++) {
        if (!load(folder, variants[i].file, &sum))
            continue;
        CHECK_MSG(sum.triangles == 6285u - (unsigned)variants[i].dropped, "%s has %llu triangles",
                  variants[i].file, (unsigned long long)sum.triangles);
        if (variants[i].rounded)
            sum.with_area = reference.with_area;
        compare(variants[i].file, &sum, &reference, variants[i].tolerance);
    }
    return check_end("variants");
}
