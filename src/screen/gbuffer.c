/* What a frame must be like before anyone reads its pixels. */
#include "base/base.h"

#include <cranny/gbuffer.h>

static size_t normal_alignment(enum cranny_normal_format format)
{
    switch (format) {
    case CRANNY_NORMAL_FLOAT3:
    case CRANNY_NORMAL_FLOAT4:
        return sizeof(float);
    case CRANNY_NORMAL_OCT16:
        return sizeof(int16_t);
    case CRANNY_NORMAL_SNORM8:
    case CRANNY_NORMAL_UNORM8:
    case CRANNY_NORMAL_OCT8:
        break;
    }
    return 1;
}

static enum cranny_status check_projection(const struct cranny_projection *p,
                                           struct cranny_error *why)
{
    if (p->kind != CRANNY_PERSPECTIVE && p->kind != CRANNY_ORTHOGRAPHIC)
        return fail(why, CRANNY_USAGE, "projection.kind: %d is no kind of projection",
                    (int)p->kind);
    if (!isfinite(p->left) || !isfinite(p->right) || !(p->left < p->right))
        return fail(why, CRANNY_USAGE,
                    "projection: left %g must be less than right %g, and both finite; "
                    "cranny_perspective or cranny_projection_from_matrix fill them in",
                    p->left, p->right);
    if (!isfinite(p->bottom) || !isfinite(p->top) || !(p->bottom < p->top))
        return fail(why, CRANNY_USAGE,
                    "projection: bottom %g must be less than top %g, and both finite; "
                    "cranny_perspective or cranny_projection_from_matrix fill them in",
                    p->bottom, p->top);
    return CRANNY_OK;
}

static enum cranny_status check_viewport(const struct cranny_gbuffer *g, struct cranny_error *why)
{
    const struct cranny_rect *v = &g->viewport;
    if (g->guard_band < 0)
        return fail(why, CRANNY_USAGE, "guard_band: %d is negative", g->guard_band);
    if (!v->x && !v->y && !v->width && !v->height)
        return CRANNY_OK;
    if (v->width < 1 || v->height < 1)
        return fail(why, CRANNY_USAGE,
                    "viewport: %d x %d pixels are none; leave all four fields zero for the whole "
                    "buffer",
                    v->width, v->height);
    if (v->x < 0 || v->y < 0 || v->width > g->width || v->height > g->height ||
        v->x > g->width - v->width || v->y > g->height - v->height)
        return fail(why, CRANNY_USAGE,
                    "viewport: %d x %d pixels at (%d, %d) reach beyond the buffer of %d x %d",
                    v->width, v->height, v->x, v->y, g->width, g->height);
    return CRANNY_OK;
}

/* A stride of 0 is tight, so it fits. */
static enum cranny_status check_stride(const char *field, size_t stride, size_t least,
                                       size_t alignment, struct cranny_error *why)
{
    if (stride && stride < least)
        return fail(why, CRANNY_USAGE, "%s: %zu bytes are less than the %zu that it spans", field,
                    stride, least);
    if (stride % alignment)
        return fail(why, CRANNY_USAGE, "%s: %zu is no multiple of the %zu bytes of an element",
                    field, stride, alignment);
    return CRANNY_OK;
}

static enum cranny_status check_pointer(const char *field, const void *pointer, size_t alignment,
                                        struct cranny_error *why)
{
    if ((uintptr_t)pointer % alignment)
        return fail(why, CRANNY_USAGE, "%s: the address %p is not aligned to %zu bytes", field,
                    pointer, alignment);
    return CRANNY_OK;
}

static enum cranny_status check_depth(const struct cranny_gbuffer *g, struct cranny_error *why)
{
    if (!g->depth)
        return fail(why, CRANNY_USAGE, "depth: is NULL; a frame without depth has no occlusion");
    const size_t row = (size_t)g->width * sizeof(float);
    enum cranny_status status = check_pointer("depth", g->depth, sizeof(float), why);
    if (status == CRANNY_OK)
        status = check_stride("depth_stride", g->depth_stride, row, sizeof(float), why);
    if (status == CRANNY_OK && g->sample_count > 1)
        status = check_stride("depth_sample_stride", g->depth_sample_stride,
                              (size_t)g->height * (g->depth_stride ? g->depth_stride : row),
                              sizeof(float), why);
    return status;
}

static enum cranny_status check_normal(const struct cranny_gbuffer *g, struct cranny_error *why)
{
    if (!g->normal)
        return CRANNY_OK;
    const size_t bytes = cranny_normal_bytes(g->normal_format);
    if (!bytes)
        return fail(why, CRANNY_USAGE, "normal_format: %d is no format of normals",
                    (int)g->normal_format);
    const size_t alignment = normal_alignment(g->normal_format), row = (size_t)g->width * bytes;
    enum cranny_status status = check_pointer("normal", g->normal, alignment, why);
    if (status == CRANNY_OK)
        status = check_stride("normal_stride", g->normal_stride, row, alignment, why);
    if (status == CRANNY_OK && g->sample_count > 1)
        status = check_stride("normal_sample_stride", g->normal_sample_stride,
                              (size_t)g->height * (g->normal_stride ? g->normal_stride : row),
                              alignment, why);
    return status;
}

static enum cranny_status check_samples(const struct cranny_gbuffer *g, struct cranny_error *why)
{
    if (g->sample_count < 0 || g->sample_count > CRANNY_SAMPLES_MAX)
        return fail(why, CRANNY_USAGE, "sample_count: %d is out of range; it must lie in [0, %d]",
                    g->sample_count, CRANNY_SAMPLES_MAX);
    for (int i = 0; g->sample_positions && g->sample_count > 1 && i < g->sample_count; i++)
        for (int k = 0; k < 2; k++)
            if (!(g->sample_positions[i][k] >= 0 && g->sample_positions[i][k] < 1))
                return fail(why, CRANNY_USAGE,
                            "sample_positions[%d]: %g is outside of the pixel, [0, 1)", i,
                            g->sample_positions[i][k]);
    return CRANNY_OK;
}

static enum cranny_status check_camera(const struct cranny_gbuffer *g, struct cranny_error *why)
{
    for (int i = 0; g->world_from_view && i < 12; i++)
        if (!isfinite(g->world_from_view[i]))
            return fail(why, CRANNY_USAGE, "world_from_view[%d]: is not finite", i);
    return CRANNY_OK;
}

enum cranny_status cranny_gbuffer_validate(const struct cranny_gbuffer *g, struct cranny_error *why)
{
    if (g->width < 1 || g->height < 1 || g->width > CRANNY_SIDE_MAX || g->height > CRANNY_SIDE_MAX)
        return fail(why, CRANNY_USAGE, "width, height: %d x %d; each must lie in [1, %d]", g->width,
                    g->height, CRANNY_SIDE_MAX);
    enum cranny_status status = check_samples(g, why);
    if (status == CRANNY_OK)
        status = check_depth(g, why);
    if (status == CRANNY_OK)
        status = check_normal(g, why);
    if (status == CRANNY_OK)
        status = check_projection(&g->projection, why);
    if (status == CRANNY_OK)
        status = check_viewport(g, why);
    if (status == CRANNY_OK)
        status = check_camera(g, why);
    return status;
}
