/* A program as a user of the installed library writes one: the inside of a box is dark. */
#include <cranny/cranny.h>
#include <stdio.h>

int main(void)
{
    static const float corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                        {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
    static const uint32_t inward[12][3] = {{0, 1, 2}, {1, 3, 2}, {4, 6, 5}, {5, 6, 7},
                                           {0, 2, 4}, {2, 6, 4}, {1, 5, 3}, {3, 5, 7},
                                           {0, 4, 1}, {1, 4, 5}, {2, 3, 6}, {3, 7, 6}};
    struct cranny_mesh mesh = {.name = "box",
                               .vertex_count = 8,
                               .triangle_count = 12,
                               .positions = corners,
                               .triangles = inward};
    struct cranny_instance instance = {.name = "box",
                                       .world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    struct cranny_error why = {CRANNY_OK, ""};
    struct cranny_scene *scene;
    struct cranny_bake *baked = NULL;
    bool good = cranny_scene_create(&scene, &why) == CRANNY_OK &&
                cranny_scene_add_mesh(scene, &mesh, &instance.mesh, &why) == CRANNY_OK &&
                cranny_scene_add_instance(scene, &instance, NULL, &why) == CRANNY_OK &&
                cranny_bake_create(scene, NULL, &baked, &why) == CRANNY_OK;
    float value = good ? cranny_bake_values(baked, 0, CRANNY_CHANNEL_VISIBILITY)[0] : -1;
    printf("cranny %s: %g %s\n", cranny_version(), (double)value, why.message);
    cranny_bake_destroy(&baked);
    cranny_scene_destroy(&scene);
    return value < 0 || value > 0.1f;
}
