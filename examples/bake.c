/* Bake a scene with the library: bake IN OUT. */
#include <cranny/cranny.h>
#include <stdio.h>

static int complain(const struct cranny_error *why)
{
    fprintf(stderr, "bake: %s\n", why->message);
    return 1;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: bake IN OUT\n");
        return 2;
    }
    struct cranny_error why;
    struct cranny_scene *scene;
    if (cranny_scene_load(argv[1], NULL, &scene, &why) != CRANNY_OK)
        return complain(&why);

    struct cranny_bake_params params = cranny_bake_params_default();
    params.rays = 64;
    struct cranny_bake *baked = NULL;
    enum cranny_status status = cranny_bake_create(scene, &params, &baked, &why);
    if (status == CRANNY_OK)
        status = cranny_scene_save(scene, baked, argv[2], NULL, &why);

    cranny_bake_destroy(&baked);
    cranny_scene_destroy(&scene);
    return status == CRANNY_OK ? 0 : complain(&why);
}
