#include "trace/kernel.h"

/* Where in the fog the mean of what it takes lies, as a share of its length: 1/x − 1/(e^x − 1) for
 * an optical depth of x, ½ for thin fog. `rest` is e^−x. */
static float taken_place(float x, float rest)
{
    if (x > 1)
        return 1 / x - rest / (1 - rest);
    const float x2 = x * x; /* the next term is below 1e-6 */
    return 0.5f - x * (1.0f / 12 - x2 * (1.0f / 720 - x2 * (1.0f / 30240 - x2 * (1.0f / 1209600))));
}

static float exponential_over_fog(float r, float from, float to, float rate)
{
    const float fall = 0.69314718f / r; /* ρ = 1 − exp(−fall t) */
    const float length = to - from;
    return 1 - fog_rest(rate, length) -
           rate / (rate + fall) * exp2_negative(-from / r) * (1 - fog_rest(rate + fall, length));
}

static float linear_over_fog(float r, float from, float to, float rate)
{
    if (from >= r)
        return 1 - fog_rest(rate, to - from);
    const float end = to < r ? to : r, length = end - from;
    const float rest = fog_rest(rate, length);
    const float below = (1 - rest) * (from + length * taken_place(rate * length, rest)) / r;
    return below + (to > r ? rest * (1 - fog_rest(rate, to - r)) : 0);
}

static float hard_over_fog(float r, float from, float to, float rate)
{
    if (to <= r)
        return 0;
    const float start = from > r ? from : r;
    return fog_rest(rate, start - from) * (1 - fog_rest(rate, to - start));
}

float kernel_over_fog(enum cranny_kernel kernel, float r, float from, float to, float rate)
{
    if (!(rate > 0) || !(to > from))
        return 0;
    switch (kernel) {
    case CRANNY_KERNEL_EXPONENTIAL:
        return exponential_over_fog(r, from, to, rate);
    case CRANNY_KERNEL_LINEAR:
        return linear_over_fog(r, from, to, rate);
    case CRANNY_KERNEL_HARD:
        return hard_over_fog(r, from, to, rate);
    }
    return 0;
}
