/* How normals are stored.
 * Octahedral ones after: Meyer, Süßmuth, Sußner, Stamminger, Greiner, On Floating-Point Normal
 * Vectors, 2010 (§3.2): project on the octahedron |x| + |y| + |z| = 1, fold its lower half outside
 * of the upper one's square. */
#include "base/base.h"

#include <cranny/gbuffer.h>

size_t cranny_normal_bytes(enum cranny_normal_format format)
{
    switch (format) {
    case CRANNY_NORMAL_FLOAT3:
        return 12;
    case CRANNY_NORMAL_FLOAT4:
        return 16;
    case CRANNY_NORMAL_SNORM8:
    case CRANNY_NORMAL_UNORM8:
    case CRANNY_NORMAL_OCT16:
        return 4;
    case CRANNY_NORMAL_OCT8:
        return 2;
    }
    return 0;
}

/* The most negative integer and the one above it both mean -1. */
static float from_snorm(int c, int top)
{
    return c < -top ? -1 : (float)c / (float)top;
}

static int to_snorm(float x, int top)
{
    return (int)lrintf(clamp_float(x, -1, 1) * (float)top);
}

/* The two halves' fold is its own inverse. */
static void octahedron_fold(float *x, float *y)
{
    const float fx = copysignf(1 - fabsf(*y), *x), fy = copysignf(1 - fabsf(*x), *y);
    *x = fx;
    *y = fy;
}

static void octahedron_decode(float x, float y, float normal[3])
{
    const float z = 1 - fabsf(x) - fabsf(y);
    if (z < 0)
        octahedron_fold(&x, &y);
    const float length = sqrtf(x * x + y * y + z * z);
    normal[0] = x / length;
    normal[1] = y / length;
    normal[2] = z / length;
}

static void octahedron_encode(const float normal[3], float *x, float *y)
{
    const float sum = fabsf(normal[0]) + fabsf(normal[1]) + fabsf(normal[2]);
    *x = sum > 0 ? normal[0] / sum : 0;
    *y = sum > 0 ? normal[1] / sum : 0;
    if (normal[2] < 0)
        octahedron_fold(x, y);
}

void cranny_normal_decode(enum cranny_normal_format format, const void *stored, float normal[3])
{
    int8_t s8[4];
    uint8_t u8[4];
    int16_t s16[2];
    switch (format) {
    case CRANNY_NORMAL_FLOAT3:
    case CRANNY_NORMAL_FLOAT4:
        memcpy(normal, stored, 3 * sizeof(float));
        break;
    case CRANNY_NORMAL_SNORM8:
        memcpy(s8, stored, sizeof s8);
        for (int k = 0; k < 3; k++)
            normal[k] = from_snorm(s8[k], 127);
        break;
    case CRANNY_NORMAL_UNORM8:
        memcpy(u8, stored, sizeof u8);
        for (int k = 0; k < 3; k++)
            normal[k] = 2 * ((float)u8[k] / 255) - 1;
        break;
    case CRANNY_NORMAL_OCT16:
        memcpy(s16, stored, sizeof s16);
        octahedron_decode(from_snorm(s16[0], 32767), from_snorm(s16[1], 32767), normal);
        break;
    case CRANNY_NORMAL_OCT8:
        memcpy(s8, stored, 2);
        octahedron_decode(from_snorm(s8[0], 127), from_snorm(s8[1], 127), normal);
        break;
    }
}

void cranny_normal_encode(enum cranny_normal_format format, const float normal[3], void *stored)
{
    int8_t s8[4] = {0};
    uint8_t u8[4] = {0};
    int16_t s16[2];
    float x, y;
    memset(stored, 0, cranny_normal_bytes(format));
    switch (format) {
    case CRANNY_NORMAL_FLOAT3:
    case CRANNY_NORMAL_FLOAT4:
        memcpy(stored, normal, 3 * sizeof(float));
        break;
    case CRANNY_NORMAL_SNORM8:
        for (int k = 0; k < 3; k++)
            s8[k] = (int8_t)to_snorm(normal[k], 127);
        memcpy(stored, s8, sizeof s8);
        break;
    case CRANNY_NORMAL_UNORM8:
        for (int k = 0; k < 3; k++)
            u8[k] = (uint8_t)lrintf((clamp_float(normal[k], -1, 1) + 1) * 127.5f);
        memcpy(stored, u8, sizeof u8);
        break;
    case CRANNY_NORMAL_OCT16:
        octahedron_encode(normal, &x, &y);
        s16[0] = (int16_t)to_snorm(x, 32767);
        s16[1] = (int16_t)to_snorm(y, 32767);
        memcpy(stored, s16, sizeof s16);
        break;
    case CRANNY_NORMAL_OCT8:
        octahedron_encode(normal, &x, &y);
        s8[0] = (int8_t)to_snorm(x, 127);
        s8[1] = (int8_t)to_snorm(y, 127);
        memcpy(stored, s8, 2);
        break;
    }
}
