/* Vectors of three doubles. */
#ifndef BASE_VECTOR_H
#define BASE_VECTOR_H

#include <math.h>
#include <stdbool.h>

static inline double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross3(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* To unit length; false, and `v` as it was, when it has no direction. */
static inline bool normalise3(double v[3])
{
    const double length = sqrt(dot3(v, v));
    if (!(length > 0) || !isfinite(length))
        return false;
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return true;
}

#endif
