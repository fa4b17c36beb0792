#include "trace/sight.h"

#include "base/vector.h"
#include "scene/scene.h"

enum cranny_status lens_create(const struct cranny_camera *view, double aspect, struct lens *lens,
                               struct cranny_error *why)
{
    double half = view->orthographic ? view->half_height : tan(0.5 * view->fov_y);
    bool good = half > 0 && isfinite(half) && (view->orthographic || view->fov_y < 3.14f);
    for (int i = 0; i < 3; i++) {
        lens->right[i] = view->world_from_view[4 * i];
        lens->up[i] = view->world_from_view[4 * i + 1];
        lens->forward[i] = -view->world_from_view[4 * i + 2];
        lens->eye[i] = view->world_from_view[4 * i + 3];
        good = good && isfinite(lens->eye[i]);
    }
    good = good && normalise3(lens->right) && normalise3(lens->up) && normalise3(lens->forward);
    if (!good)
        return fail(why, CRANNY_USAGE,
                    "the camera has no extent or no direction; give another one");
    lens->half_height = half;
    lens->half_width = half * aspect;
    lens->near_plane = view->near_plane > 0 ? view->near_plane : 0;
    lens->parallel = view->orthographic;
    return CRANNY_OK;
}

void lens_ray(const struct lens *lens, double x, double y, float origin[3], float direction[3])
{
    double d[3], scale = 0;
    for (int i = 0; i < 3; i++) {
        double shift = x * lens->half_width * lens->right[i] + y * lens->half_height * lens->up[i];
        d[i] = lens->forward[i] + (lens->parallel ? 0 : shift);
        origin[i] = (float)(lens->eye[i] + (lens->parallel ? shift : 0) + lens->near_plane * d[i]);
        scale += d[i] * d[i];
    }
    for (int i = 0; i < 3; i++)
        direction[i] = (float)(d[i] / sqrt(scale));
}

void triangle_corners(const struct cranny_instance *instance, const struct cranny_mesh *mesh,
                      uint32_t triangle, double corners[3][3])
{
    for (int k = 0; k < 3; k++)
        transform_point(instance->world_from_object, mesh->positions[mesh->triangles[triangle][k]],
                        corners[k]);
}

/* In a mirrored instance the winding turns round, and so does this. */
bool triangle_normal(const double corners[3][3], double n[3])
{
    double e[3], f[3];
    for (int i = 0; i < 3; i++) {
        e[i] = corners[1][i] - corners[0][i];
        f[i] = corners[2][i] - corners[0][i];
    }
    cross3(e, f, n);
    if (normalise3(n))
        return true;
    n[0] = 0, n[1] = 1, n[2] = 0;
    return false;
}

/* Interpolated in object space, transformed by the inverse transposed; false without direction. */
static bool smooth_normal(const struct cranny_instance *instance, const struct cranny_mesh *mesh,
                          const struct cranny_hit *hit, double n[3])
{
    const uint32_t *c = mesh->triangles[hit->triangle];
    const float w[3] = {1 - hit->u - hit->v, hit->u, hit->v};
    double inverse[9];
    float local[3];
    if (!mesh->normals || !transform_inverse3(instance->world_from_object, inverse))
        return false;
    for (int i = 0; i < 3; i++)
        local[i] = w[0] * mesh->normals[c[0]][i] + w[1] * mesh->normals[c[1]][i] +
                   w[2] * mesh->normals[c[2]][i];
    for (int i = 0; i < 3; i++)
        n[i] = inverse[i] * local[0] + inverse[3 + i] * local[1] + inverse[6 + i] * local[2];
    return normalise3(n);
}

void sight_normal(const struct cranny_instance *instance, const struct cranny_mesh *mesh,
                  const struct cranny_hit *hit, const float direction[3], double n[3])
{
    const bool smooth = smooth_normal(instance, mesh, hit, n);
    if (!smooth) {
        double corners[3][3];
        triangle_corners(instance, mesh, hit->triangle, corners);
        triangle_normal((const double(*)[3])corners, n);
    }
    const bool turn = smooth ? hit->back_face
                             : n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2] > 0;
    for (int i = 0; turn && i < 3; i++)
        n[i] = -n[i];
}

void sight_sky(const float direction[3], float color[3])
{
    static const float zenith[3] = {0.30f, 0.48f, 0.78f}, horizon[3] = {0.80f, 0.87f, 0.94f};
    float t = sqrtf(clamp_float(direction[1] * 1.4f + 0.1f, 0, 1));
    for (int i = 0; i < 3; i++)
        color[i] = horizon[i] + (zenith[i] - horizon[i]) * t;
}
