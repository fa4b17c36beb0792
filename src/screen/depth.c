/* Depth as graphics APIs store it, to linear view depth and back.
 *
 * Device depth is handled as its distance from the far plane's value, w: 1 − v, or what is stored
 * when reversed; depth = near far / (near + w (far − near)). No digits cancel then, and an infinite
 * far plane is the plain limit near / w. */
#include "base/base.h"

#include <cranny/gbuffer.h>

#define CHUNK 256 /* values taken through the steps at once; they stay in the nearest cache */

static size_t element_bytes(enum cranny_depth_format format)
{
    switch (format) {
    case CRANNY_DEPTH_FLOAT16:
    case CRANNY_DEPTH_UNORM16:
        return 2;
    case CRANNY_DEPTH_FLOAT32:
    case CRANNY_DEPTH_UNORM24:
    case CRANNY_DEPTH_UNORM24_HIGH:
    case CRANNY_DEPTH_UNORM32:
        return 4;
    }
    return 0;
}

static bool is_float(enum cranny_depth_format format)
{
    return format == CRANNY_DEPTH_FLOAT32 || format == CRANNY_DEPTH_FLOAT16;
}

/* IEEE 754 binary16; what a float of 32 bits holds exactly. */
static float from_half(uint16_t h)
{
    const uint32_t exponent = (h >> 10) & 31, mantissa = h & 1023;
    uint32_t bits = (uint32_t)(h & 0x8000) << 16;
    if (exponent == 0) {
        const float tiny = (float)mantissa * 0x1p-24f;
        return bits ? -tiny : tiny;
    }
    bits |= (exponent == 31 ? 255u : exponent + 112) << 23 | mantissa << 13;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void read_chunk(enum cranny_depth_format format, const uint8_t *input, int count,
                       double *values)
{
    uint32_t u32[CHUNK];
    uint16_t u16[CHUNK];
    float f32[CHUNK];
    const size_t bytes = (size_t)count * element_bytes(format);
    switch (format) {
    case CRANNY_DEPTH_FLOAT32:
        memcpy(f32, input, bytes);
        for (int i = 0; i < count; i++)
            values[i] = f32[i];
        break;
    case CRANNY_DEPTH_FLOAT16:
        memcpy(u16, input, bytes);
        for (int i = 0; i < count; i++)
            values[i] = from_half(u16[i]);
        break;
    case CRANNY_DEPTH_UNORM16:
        memcpy(u16, input, bytes);
        for (int i = 0; i < count; i++)
            values[i] = u16[i] / 65535.0;
        break;
    case CRANNY_DEPTH_UNORM24:
        memcpy(u32, input, bytes);
        for (int i = 0; i < count; i++)
            values[i] = (u32[i] & 0xffffff) / 16777215.0;
        break;
    case CRANNY_DEPTH_UNORM24_HIGH:
        memcpy(u32, input, bytes);
        for (int i = 0; i < count; i++)
            values[i] = (u32[i] >> 8) / 16777215.0;
        break;
    case CRANNY_DEPTH_UNORM32:
        memcpy(u32, input, bytes);
        for (int i = 0; i < count; i++)
            values[i] = u32[i] / 4294967295.0;
        break;
    }
}

/* Value to w = scale value + offset: 1 at the near plane, 0 at the far one. */
struct range {
    double scale, offset;
};

static struct range range_of(const struct cranny_depth_layout *layout)
{
    const bool gl = layout->gl_range && is_float(layout->format);
    const double scale = gl ? 0.5 : 1, offset = gl ? 0.5 : 0;
    return layout->reversed ? (struct range){scale, offset} : (struct range){-scale, 1 - offset};
}

static double to_depth(const struct cranny_depth_layout *layout, double w)
{
    const double n = layout->near_plane, f = layout->far_plane;
    switch (layout->kind) {
    case CRANNY_DEPTH_DEVICE:
        return isinf(f) ? n / w : n * f / (n + w * (f - n));
    case CRANNY_DEPTH_NORMALIZED:
        return f - w * (f - n);
    case CRANNY_DEPTH_LOGARITHMIC:
        return expm1((1 - w) * log1p((double)layout->log_constant * f)) / layout->log_constant;
    case CRANNY_DEPTH_LINEAR:
    case CRANNY_DEPTH_VIEW_Z:
        break;
    }
    return w;
}

static void convert_chunk(const struct cranny_depth_layout *layout, const double *values, int count,
                          float *depth)
{
    if (layout->kind == CRANNY_DEPTH_LINEAR || layout->kind == CRANNY_DEPTH_VIEW_Z) {
        const double sign = layout->kind == CRANNY_DEPTH_LINEAR ? 1 : -1;
        for (int i = 0; i < count; i++)
            depth[i] = sign * values[i] > 0 ? (float)(sign * values[i]) : INFINITY;
        return;
    }
    const struct range range = range_of(layout);
    for (int i = 0; i < count; i++) {
        const double w = range.scale * values[i] + range.offset;
        depth[i] = w > 0 ? (float)to_depth(layout, w) : INFINITY;
    }
}

static enum cranny_status check_planes(const struct cranny_depth_layout *layout,
                                       struct cranny_error *why)
{
    const double n = layout->near_plane, f = layout->far_plane, c = layout->log_constant;
    switch (layout->kind) {
    case CRANNY_DEPTH_LINEAR:
    case CRANNY_DEPTH_VIEW_Z:
        return CRANNY_OK;
    case CRANNY_DEPTH_DEVICE:
        if (n > 0 && f > n && isfinite(n))
            return CRANNY_OK;
        return fail(why, CRANNY_USAGE,
                    "near_plane %g, far_plane %g: device depth needs 0 < near < far; far may be "
                    "infinite",
                    n, f);
    case CRANNY_DEPTH_NORMALIZED:
        if (isfinite(n) && isfinite(f) && n < f)
            return CRANNY_OK;
        return fail(why, CRANNY_USAGE,
                    "near_plane %g, far_plane %g: normalized depth needs near < far, both finite",
                    n, f);
    case CRANNY_DEPTH_LOGARITHMIC:
        if (isfinite(c) && c > 0 && isfinite(f) && f > 0)
            return CRANNY_OK;
        return fail(why, CRANNY_USAGE,
                    "log_constant %g, far_plane %g: logarithmic depth needs both finite and above "
                    "0",
                    c, f);
    }
    return fail(why, CRANNY_USAGE, "kind: %d is no kind of depth", (int)layout->kind);
}

static enum cranny_status check_stride(const char *name, size_t stride, int width, size_t bytes,
                                       struct cranny_error *why)
{
    if (stride && (stride < (size_t)width * bytes || stride % bytes))
        return fail(why, CRANNY_USAGE,
                    "%s: %zu bytes; %d elements of %zu bytes need at least %zu, and a multiple of "
                    "an element",
                    name, stride, width, bytes, (size_t)width * bytes);
    return CRANNY_OK;
}

enum cranny_status cranny_depth_linearize(const struct cranny_depth_layout *layout, int width,
                                          int height, const void *input, size_t input_stride,
                                          float *depth, size_t depth_stride,
                                          struct cranny_error *why)
{
    const size_t bytes = element_bytes(layout->format);
    if (!bytes)
        return fail(why, CRANNY_USAGE, "format: %d is no format of depth", (int)layout->format);
    if (!input || !depth)
        return fail(why, CRANNY_USAGE, "%s: is NULL", input ? "depth" : "input");
    if (width < 1 || height < 1 || width > CRANNY_SIDE_MAX || height > CRANNY_SIDE_MAX)
        return fail(why, CRANNY_USAGE, "width, height: %d x %d; each must lie in [1, %d]", width,
                    height, CRANNY_SIDE_MAX);
    enum cranny_status status = check_planes(layout, why);
    if (status == CRANNY_OK)
        status = check_stride("input_stride", input_stride, width, bytes, why);
    if (status == CRANNY_OK)
        status = check_stride("depth_stride", depth_stride, width, sizeof(float), why);
    if (status != CRANNY_OK)
        return status;
    const size_t from = input_stride ? input_stride : (size_t)width * bytes;
    const size_t to = depth_stride ? depth_stride : (size_t)width * sizeof(float);
    if (input == depth && (bytes != sizeof(float) || from != to))
        return fail(why, CRANNY_USAGE,
                    "depth: may be the input itself only for 4-byte elements of one stride");
#pragma omp parallel for schedule(static) if (height >= 64)
    for (int y = 0; y < height; y++) {
        const uint8_t *row_in = (const uint8_t *)input + (size_t)y * from;
        float *row_out = (float *)((char *)depth + (size_t)y * to);
        for (int x = 0; x < width; x += CHUNK) {
            double values[CHUNK];
            const int count = min_int(CHUNK, width - x);
            read_chunk(layout->format, row_in + (size_t)x * bytes, count, values);
            convert_chunk(layout, values, count, row_out + x);
        }
    }
    return CRANNY_OK;
}

static double w_of(const struct cranny_depth_layout *layout, double d)
{
    const double n = layout->near_plane, f = layout->far_plane;
    switch (layout->kind) {
    case CRANNY_DEPTH_DEVICE:
        return isinf(f) ? n / d : n * (f - d) / (d * (f - n));
    case CRANNY_DEPTH_NORMALIZED:
        return (f - d) / (f - n);
    case CRANNY_DEPTH_LOGARITHMIC:
        return 1 - log1p(layout->log_constant * d) / log1p((double)layout->log_constant * f);
    case CRANNY_DEPTH_LINEAR:
    case CRANNY_DEPTH_VIEW_Z:
        break;
    }
    return d;
}

float cranny_depth_encode(const struct cranny_depth_layout *layout, float depth)
{
    const double d = isnan(depth) ? INFINITY : (double)depth;
    if (layout->kind == CRANNY_DEPTH_LINEAR)
        return (float)d;
    if (layout->kind == CRANNY_DEPTH_VIEW_Z)
        return (float)-d;
    double w = isinf(d) ? 0 : w_of(layout, d);
    w = !(w > 0) ? 0 : w > 1 ? 1 : w;
    const struct range range = range_of(layout);
    return (float)((w - range.offset) / range.scale);
}
