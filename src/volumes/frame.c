/* From pixels to points of the world, in double. */
#include "volumes/frame.h"

bool frame_point(const struct volume_frame *f, int x, int y, struct volume_point *point)
{
    const struct canvas *c = &f->canvas;
    const ptrdiff_t at = canvas_index(c, f->viewport.x + x, f->viewport.y + y);
    const double depth = (double)c->depth[at], w = c->orthographic ? 1 : depth;
    if (c->depth[at] > SKY_LIMIT)
        return false;
    const double view[3] = {(f->scale_x * x + f->shift_x) * w, (f->scale_y * y + f->shift_y) * w,
                            -depth};
    double n[3], length = 0;
    for (int i = 0; i < 3; i++) {
        const double *row = f->world_from_view + 4 * i;
        point->position[i] =
            row[0] * view[0] + row[1] * view[1] + row[2] * view[2] + row[3] - f->volumes->centre[i];
        n[i] = row[0] * (double)c->normal[0][at] + row[1] * (double)c->normal[1][at] +
               row[2] * (double)c->normal[2][at];
        length += n[i] * n[i];
    }
    if (!(length > 0) || !isfinite(length))
        return false;
    for (int i = 0; i < 3; i++) {
        point->normal[i] = (float)(n[i] / sqrt(length));
        if (!(fabs(point->position[i]) < 1e30))
            return false;
    }
    point->w = (float)w;
    return true;
}
