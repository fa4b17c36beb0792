/* ρ, and its mean over fog. */
#ifndef TRACE_KERNEL_H
#define TRACE_KERNEL_H

#include "base/portable.h"

#include <cranny/trace.h>

/* ρ(d) (2013, §2: 1 − exp(a d), a = ln(½) / r, that is 1 − 2^(−d/r)). */
static inline float kernel_value(enum cranny_kernel kernel, float r, float distance)
{
    switch (kernel) {
    case CRANNY_KERNEL_EXPONENTIAL:
        return 1 - exp2_negative(-(1 / r) * distance);
    case CRANNY_KERNEL_LINEAR:
        return 1 / r * distance < 1 ? 1 / r * distance : 1;
    case CRANNY_KERNEL_HARD:
        return distance < r ? 0 : 1;
    }
    return 1;
}

/* What fog of `rate` (per metre) leaves over a length. */
static inline float fog_rest(float rate, float length)
{
    return exp2_negative(-1.44269504f * rate * length);
}

/* ∫ rate exp(−rate (t − from)) ρ(t) dt from `from` to `to`, finite: what the fog between takes of a
 * ray, each share at its distance. */
float kernel_over_fog(enum cranny_kernel kernel, float r, float from, float to, float rate);

#endif
