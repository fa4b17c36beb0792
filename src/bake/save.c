#include "scene/scene.h"

#include <cranny/bake.h>

static const float **channel_pointers(const struct cranny_bake *bake, size_t count,
                                      enum cranny_channel channel)
{
    const float **pointers = alloc_array(count, sizeof *pointers);
    for (uint32_t i = 0; pointers && i < count; i++)
        pointers[i] = cranny_bake_values(bake, i, channel);
    return pointers;
}

enum cranny_status cranny_scene_save(const struct cranny_scene *scene,
                                     const struct cranny_bake *bake, const char *path,
                                     const struct cranny_save_params *params,
                                     struct cranny_error *why)
{
    const struct cranny_save_params defaults = cranny_save_params_default();
    params = params ? params : &defaults;
    if (!bake)
        return scene_write(scene, NULL, path, params, why);
    const size_t count = scene->instance_count;
    const float **visibility = channel_pointers(bake, count, CRANNY_CHANNEL_VISIBILITY);
    const float **raw_long = channel_pointers(bake, count, CRANNY_CHANNEL_LONG);
    const float **raw_short = channel_pointers(bake, count, CRANNY_CHANNEL_SHORT);
    const struct scene_values values = {visibility, raw_long, raw_short};
    enum cranny_status status = visibility && raw_long && raw_short
                                    ? scene_write(scene, &values, path, params, why)
                                    : fail_memory(why, path);
    free(visibility);
    free(raw_long);
    free(raw_short);
    return status;
}
