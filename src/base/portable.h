/* Elementary functions that give the same bits on every machine, which libm's do not. */
#ifndef BASE_PORTABLE_H
#define BASE_PORTABLE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* 2^x for x ≤ 0 (−∞ included), as float; absolute error below 1.5e-7, checked by tests/trace.c.
 * Below −126 it stays at 2^-126, which no visibility can tell from 0. Vectorises. */
static inline float exp2_negative(float x)
{
    x = x < -126.0f ? -126.0f : x;
    const int32_t whole = (int32_t)(x - 0.5f); /* towards zero: to nearest, for x ≤ 0 */
    const float f = x - (float)whole;
    /* Taylor in f ln 2, |f| ≤ ½: the next term is below 2e-8. */
    float p = 1.5403530e-4f;
    p = p * f + 1.3333558e-3f;
    p = p * f + 9.6181291e-3f;
    p = p * f + 5.5504109e-2f;
    p = p * f + 2.4022651e-1f;
    p = p * f + 6.9314718e-1f;
    p = p * f + 1.0f;
    const int32_t bits = (whole + 127) * (1 << 23);
    float scale;
    memcpy(&scale, &bits, sizeof scale);
    return p * scale;
}

/* Sine and cosine of `turns` full turns; error below 1e-11 before rounding to float. */
static inline void turn_vector(double turns, float *cosine, float *sine)
{
    const double quarters = floor(4 * turns + 0.5);
    const double a = (turns - 0.25 * quarters) * 6.283185307179586476925;
    const double a2 = a * a;
    double s = -1.0 / 39916800;
    s = s * a2 + 1.0 / 362880;
    s = s * a2 - 1.0 / 5040;
    s = s * a2 + 1.0 / 120;
    s = s * a2 - 1.0 / 6;
    s = (s * a2 + 1) * a;
    double c = 1.0 / 479001600;
    c = c * a2 - 1.0 / 3628800;
    c = c * a2 + 1.0 / 40320;
    c = c * a2 - 1.0 / 720;
    c = c * a2 + 1.0 / 24;
    c = c * a2 - 0.5;
    c = c * a2 + 1;
    const int quadrant = (int)((int64_t)quarters & 3);
    const double x = quadrant & 1 ? -s : c, y = quadrant & 1 ? c : s;
    *cosine = (float)(quadrant & 2 ? -x : x);
    *sine = (float)(quadrant & 2 ? -y : y);
}

#endif
