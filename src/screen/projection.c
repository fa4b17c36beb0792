/* How pixels lie in view space: from an angle, from an extent, from a matrix. */
#include "base/base.h"

#include <cranny/gbuffer.h>

struct cranny_projection cranny_perspective(float fov_y, float aspect)
{
    const float top = (float)tan(0.5 * (double)fov_y), right = top * aspect;
    return (struct cranny_projection){CRANNY_PERSPECTIVE, -right, right, -top, top};
}

struct cranny_projection cranny_orthographic(float half_height, float aspect)
{
    const float right = half_height * aspect;
    return (struct cranny_projection){CRANNY_ORTHOGRAPHIC, -right, right, -half_height,
                                      half_height};
}

/* The matrix in the terms that matter: clip x = scale[0] x + skew[0] d + shift[0], and so on, all
 * over the same w, for a point at (x, y) and depth d; w is d (perspective) or 1 (parallel). */
struct frustum {
    bool parallel;
    double scale[2], offset[2]; /* perspective: offset × d; parallel: constant */
    double depth_scale, depth_offset;
};

static bool near_zero(const float m[16], const int *entries, int count)
{
    double largest = 0;
    for (int i = 0; i < 16; i++)
        largest = fmax(largest, fabs((double)m[i]));
    for (int i = 0; i < count; i++)
        if (fabs((double)m[entries[i]]) > 1e-6 * largest)
            return false;
    return true;
}

static enum cranny_status read_perspective(const float m[16], struct frustum *f,
                                           struct cranny_error *why)
{
    const int none[] = {1, 2, 3, 4, 6, 7, 12, 13};
    if (!near_zero(m, none, COUNT_OF(none)))
        return fail(why, CRANNY_USAGE,
                    "matrix: is a perspective one with rotation, shear or an oblique near plane; "
                    "pass the one from view to clip space, column by column, without the camera's");
    if (fabsf(m[14]) == 1 && fabsf(m[11]) != 1)
        return fail(why, CRANNY_USAGE,
                    "matrix: is stored row by row; pass it column by column (m[11] is then -1 or "
                    "1)");
    /* w = −z: the camera looks down −Z; w = z: a left-handed view space, down +Z */
    const double side = m[11] < 0 ? -1 : 1, w = fabs((double)m[11]);
    *f = (struct frustum){.scale = {m[0] / w, m[5] / w},
                          .offset = {side * m[8] / w, side * m[9] / w},
                          .depth_scale = side * m[10] / w,
                          .depth_offset = m[14] / w};
    return CRANNY_OK;
}

static enum cranny_status read_parallel(const float m[16], struct frustum *f,
                                        struct cranny_error *why)
{
    const int none[] = {1, 2, 3, 4, 6, 7, 8, 9, 11};
    if (!near_zero(m, none, COUNT_OF(none)))
        return fail(why, CRANNY_USAGE,
                    "matrix: is a parallel projection with rotation or shear; pass the one from "
                    "view to clip space, column by column, without the camera's");
    const double w = m[15];
    *f = (struct frustum){.parallel = true,
                          .scale = {m[0] / w, m[5] / w},
                          .offset = {m[12] / w, m[13] / w},
                          .depth_scale = -m[10] / w,
                          .depth_offset = m[14] / w};
    return CRANNY_OK;
}

/* Vulkan's clip y runs down, so its matrices mirror y and the picture's top is still the top. */
static enum cranny_status borders(const struct frustum *f, struct cranny_projection *p,
                                  struct cranny_error *why)
{
    if (!(f->scale[0] > 0) || !(fabs(f->scale[1]) > 0))
        return fail(why, CRANNY_USAGE,
                    "matrix: x is mirrored or an axis has no extent, so it is no camera's");
    const double low = (-1 - f->offset[1]) / f->scale[1], high = (1 - f->offset[1]) / f->scale[1];
    *p = (struct cranny_projection){
        .kind = f->parallel ? CRANNY_ORTHOGRAPHIC : CRANNY_PERSPECTIVE,
        .left = (float)((-1 - f->offset[0]) / f->scale[0]),
        .right = (float)((1 - f->offset[0]) / f->scale[0]),
        .bottom = (float)fmin(low, high),
        .top = (float)fmax(low, high),
    };
    if (!isfinite(p->left) || !isfinite(p->right) || !isfinite(p->bottom) || !isfinite(p->top) ||
        !(p->left < p->right) || !(p->bottom < p->top))
        return fail(why, CRANNY_USAGE, "matrix: its field of view is empty or not finite");
    return CRANNY_OK;
}

/* Depth in 0 … 1 is a + b / d (perspective) or a + b d (parallel): where is it 0, where 1? */
static enum cranny_status planes(const struct frustum *f, bool gl_range,
                                 struct cranny_depth_layout *layout, struct cranny_error *why)
{
    const double half = gl_range ? 0.5 : 1;
    const double add = gl_range ? 0.5 : 0;
    const double scale = f->depth_scale * half, offset = f->depth_offset * half;
    double zero, one;
    if (f->parallel) {
        zero = -(offset + add) / scale;
        one = (1 - offset - add) / scale;
    } else {
        zero = -offset / (scale + add);
        one = offset / (1 - scale - add);
    }
    const bool reversed = f->parallel ? scale < 0 : offset > 0;
    const double near = reversed ? one : zero;
    double far = reversed ? zero : one;
    /* beyond what floats can tell, or past infinity as some infinite projections are nudged */
    if (!f->parallel && (!(far > 0) || !(far < near * 1e7)))
        far = INFINITY;
    if (!isfinite(near) || !(near < far) || (!f->parallel && !(near > 0)))
        return fail(why, CRANNY_USAGE,
                    "matrix: its near plane at %g and far plane at %g make no sense; does its "
                    "depth run %s?",
                    near, far, gl_range ? "0 … 1 (pass gl_range = false)" : "-1 … 1 (gl_range)");
    *layout = (struct cranny_depth_layout){
        .kind = f->parallel ? CRANNY_DEPTH_NORMALIZED : CRANNY_DEPTH_DEVICE,
        .gl_range = gl_range,
        .reversed = reversed,
        .near_plane = (float)near,
        .far_plane = (float)far,
    };
    return CRANNY_OK;
}

enum cranny_status cranny_projection_from_matrix(const float m[16], bool gl_range,
                                                 struct cranny_projection *projection,
                                                 struct cranny_depth_layout *layout,
                                                 struct cranny_error *why)
{
    *projection = (struct cranny_projection){0};
    if (layout)
        *layout = (struct cranny_depth_layout){0};
    for (int i = 0; i < 16; i++)
        if (!isfinite(m[i]))
            return fail(why, CRANNY_USAGE, "matrix: entry %d is not finite", i);
    const int w[] = {11}, one[] = {15};
    const bool has_w = !near_zero(m, w, 1), has_one = !near_zero(m, one, 1);
    if (has_w == has_one)
        return fail(why, CRANNY_USAGE,
                    "matrix: neither a perspective nor a parallel projection; its last row must be "
                    "0 0 -1 0 or 0 0 0 1 (is it stored row by row?)");
    struct frustum f = {0};
    struct cranny_projection p = {0};
    struct cranny_depth_layout l = {0};
    enum cranny_status status = has_w ? read_perspective(m, &f, why) : read_parallel(m, &f, why);
    if (status == CRANNY_OK)
        status = borders(&f, &p, why);
    if (status == CRANNY_OK)
        status = planes(&f, gl_range, &l, why);
    if (status != CRANNY_OK)
        return status;
    *projection = p;
    if (layout)
        *layout = l;
    return CRANNY_OK;
}
