/* The sRGB transfer curve (IEC 61966-2-1). */
#ifndef BASE_SRGB_H
#define BASE_SRGB_H

#include "base/base.h"

/* Linear to 8 bits, clamped to [0,1]. */
static inline uint8_t srgb_encode(float x)
{
    x = clamp_float(x, 0, 1);
    float y = x <= 0.0031308f ? 12.92f * x : 1.055f * powf(x, 1 / 2.4f) - 0.055f;
    return (uint8_t)(255 * y + 0.5f);
}

static inline float srgb_decode(uint8_t byte)
{
    const float y = (float)byte * (1.0f / 255);
    return y <= 0.04045f ? y / 12.92f : powf((y + 0.055f) / 1.055f, 2.4f);
}

#endif
