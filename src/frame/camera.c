/* Cameras by hand, and the one for scenes that have none. */
#include "base/vector.h"
#include "frame/frame.h"
#include "trace/view.h"

#define NEAR_SHARE 1e-4 /* of the distance to what is looked at */

enum cranny_status cranny_camera_look_at(const double eye[3], const double target[3],
                                         const double up[3], float fov_y,
                                         struct cranny_camera *camera, struct cranny_error *why)
{
    double back[3], right[3], above[3];
    for (int i = 0; i < 3; i++)
        back[i] = eye[i] - target[i];
    const double distance = sqrt(dot3(back, back));
    const float near_plane = (float)(NEAR_SHARE * distance);
    bool good = normalise3(back);
    cross3(up, back, right);
    good = good && normalise3(right);
    cross3(back, right, above);
    if (!good || !isfinite(dot3(eye, eye)) || !isfinite(near_plane))
        return fail(why, CRANNY_USAGE,
                    "the camera looks nowhere: eye and target must differ, and not along `up`");
    if (!(fov_y > 0 && fov_y < 3.14f))
        return fail(why, CRANNY_USAGE, "a field of view of %g radians; it must be in (0, 3.14)",
                    (double)fov_y);
    *camera = (struct cranny_camera){.name = "", .fov_y = fov_y, .near_plane = near_plane};
    for (int i = 0; i < 3; i++) {
        double *row = camera->world_from_view + 4 * i;
        row[0] = right[i];
        row[1] = above[i];
        row[2] = back[i];
        row[3] = eye[i];
    }
    return CRANNY_OK;
}

enum cranny_status cranny_camera_default(const struct cranny_scene *scene,
                                         const struct cranny_tracer *tracer, float aspect,
                                         struct cranny_camera *camera, struct cranny_error *why)
{
    if (!(aspect > 0) || !isfinite(aspect))
        return fail(why, CRANNY_USAGE, "the picture's aspect is %g; it must be above 0",
                    (double)aspect);
    return view_choose(scene, tracer, aspect, camera, why);
}
