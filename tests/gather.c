/* Gathered obscurance against closed forms. */
#include "trace_scenes.h"

int main(void)
{
    struct cranny_scene *scene = new_scene();
    add_quad(scene, (double[3]){-1, 0, -1}, (double[3]){0, 0, 2}, (double[3]){2, 0, 0}, 0);
    struct cranny_tracer *tracer = new_tracer(scene);
    struct cranny_error why;
    float v[1][2];
    CHECK_OK(cranny_gather(tracer, 1, (const float[1][3]){{0, 0, 0}},
                           (const float[1][3]){{0, 1, 0}}, NULL, NULL, v, NULL, &why),
             why);
    CHECK_NEAR(v[0][0], 1, 0);
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
    return check_end("gather");
}
