/* Two-sided pieces that are modelled inside out are seen from outside; everything else keeps its
 * front, however dark it is there. */
#include "check.h"

#include <cranny/bake.h>

/* A box from `low` to `high`; `inward`: wound so that its faces look inside. */
static uint32_t add_box(struct cranny_scene *scene, const float low[3], const float high[3],
                        bool inward, uint32_t material)
{
    static const uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    float positions[8][3];
    uint32_t triangles[12][3], materials[12], mesh, instance;
    for (int v = 0; v < 8; v++)
        for (int k = 0; k < 3; k++)
            positions[v][k] = v >> k & 1 ? high[k] : low[k];
    for (int q = 0; q < 6; q++)
        for (int h = 0; h < 2; h++) {
            uint32_t *t = triangles[2 * q + h];
            t[0] = quads[q][0];
            t[inward ? 2 : 1] = quads[q][1 + h];
            t[inward ? 1 : 2] = quads[q][2 + h];
            materials[2 * q + h] = material;
        }
    struct cranny_error why = {0};
    const struct cranny_mesh box = {.name = "box",
                                    .vertex_count = 8,
                                    .triangle_count = 12,
                                    .positions = (const float(*)[3])positions,
                                    .triangles = (const uint32_t(*)[3])triangles,
                                    .triangle_materials = materials};
    CHECK_OK(cranny_scene_add_mesh(scene, &box, &mesh, &why), why);
    const struct cranny_instance at = {
        .name = "box", .mesh = mesh, .world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    CHECK_OK(cranny_scene_add_instance(scene, &at, &instance, &why), why);
    return instance;
}

/* Mean visibility of a lone box's vertices. */
static double mean_of_box(float size, bool inward, bool two_sided)
{
    struct cranny_error why = {0};
    struct cranny_scene *scene;
    struct cranny_bake *bake = NULL;
    struct cranny_material material = cranny_material_default();
    const float low[3] = {0, 0, 0}, high[3] = {size, size, size};
    uint32_t index;
    material.double_sided = two_sided;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    CHECK_OK(cranny_scene_add_material(scene, &material, &index, &why), why);
    const uint32_t instance = add_box(scene, low, high, inward, index);
    CHECK_OK(cranny_bake_create(scene, NULL, &bake, &why), why);
    const float *values = cranny_bake_values(bake, instance, CRANNY_CHANNEL_VISIBILITY);
    double sum = 0;
    for (int v = 0; v < 8; v++)
        sum += values[v];
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
    return sum / 8;
}

int main(void)
{
    /* A stone of 40 cm: its inside is nowhere a metre across. */
    CHECK_NEAR(mean_of_box(0.4f, false, true), 1, 0.01);
    CHECK_NEAR(mean_of_box(0.4f, true, true), 1, 0.01);
    /* One side only: the inside is all there is. */
    CHECK(mean_of_box(0.4f, true, false) < 0.05);
    /* A room is looked at from inside. */
    CHECK(mean_of_box(4, true, true) < 0.1);
    return check_end("sheets");
}
