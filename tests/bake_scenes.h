/* Scenes from arrays, and bakes of them that must succeed. */
#ifndef TESTS_BAKE_SCENES_H
#define TESTS_BAKE_SCENES_H

#include "check.h"

#include <cranny/bake.h>

static inline struct cranny_scene *empty_scene(void)
{
    struct cranny_error why = {0};
    struct cranny_scene *scene = NULL;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    return scene;
}

static inline uint32_t add_mesh(struct cranny_scene *scene, const struct cranny_mesh *mesh)
{
    struct cranny_error why = {0};
    uint32_t index = 0;
    CHECK_OK(cranny_scene_add_mesh(scene, mesh, &index, &why), why);
    return index;
}

static inline struct cranny_bake *bake_scene(const struct cranny_scene *scene,
                                             const struct cranny_bake_params *params)
{
    struct cranny_error why = {0};
    struct cranny_bake *bake = NULL;
    CHECK_OK(cranny_bake_create(scene, params, &bake, &why), why);
    return bake;
}

#endif
