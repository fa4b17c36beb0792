/* The kernels' own elementary functions against libm. */
#define LANES 1
#include "screen/lanes.h"

#include "base/sequence.h"
#include "check.h"

enum { STEPS = 200000 };

static void test_inverse_cosine(void)
{
    double worst = 0;
    for (int i = 0; i <= STEPS; i++) {
        const float x = (float)(2.0 * i / STEPS - 1);
        worst = fmax(worst, fabs((double)acos_(x) - acos((double)x)));
    }
    CHECK_MSG(worst < 1e-5, "acos_ is off by %g", worst);
    CHECK_NEAR(acos_(1), 0, 0);
    CHECK_NEAR(acos_(-1), 3.14159265, 1e-6);
}

static void test_powers(void)
{
    double log_worst = 0, exp_worst = 0, pow_worst = 0;
    for (int i = 1; i <= STEPS; i++) {
        const float x = 256.0f * (float)i / STEPS;
        log_worst = fmax(log_worst, fabs((double)log2_(x) - log2((double)x)));
        const float y = 250.0f * (float)i / STEPS - 125;
        exp_worst = fmax(exp_worst, fabs((double)exp2_(y) / exp2((double)y) - 1));
        const float z = (float)i / STEPS;
        for (int k = 1; k < 6; k++)
            pow_worst =
                fmax(pow_worst, fabs((double)pow_(z, 0.5f * (float)k) - pow((double)z, 0.5 * k)));
    }
    CHECK_MSG(log_worst < 1e-6, "log2_ is off by %g", log_worst);
    CHECK_MSG(exp_worst < 3e-7, "exp2_ is off by a share of %g", exp_worst);
    CHECK_MSG(pow_worst < 1e-6, "pow_ is off by %g", pow_worst);
    CHECK_NEAR(pow_(0, 2), 0, 0);
    CHECK_NEAR(pow_(1, 3), 1, 1e-7);
}

static void test_turns(void)
{
    double worst = 0;
    for (int i = 0; i <= STEPS; i++) {
        const float t = (float)i / STEPS;
        lane_f c, s;
        turn_(t, &c, &s);
        const double a = 6.283185307179586 * (double)t;
        worst = fmax(worst, fmax(fabs((double)c - cos(a)), fabs((double)s - sin(a))));
    }
    CHECK_MSG(worst < 1e-6, "turn_ is off by %g", worst);
}

static void test_rounding(void)
{
    for (int i = -1000; i <= 1000; i++) {
        const float x = (float)i * 0.37f;
        CHECK_NEAR(floor_(x), floorf(x), 0);
    }
    CHECK_NEAR(saturate_(NAN), 0, 0);
    CHECK_NEAR(min_(NAN, 2), 2, 0);
    CHECK_NEAR(max_(NAN, 2), 2, 0);
}

static void test_hash(void)
{
    for (uint32_t i = 0; i < 1000; i++)
        CHECK_INT((uint32_t)hash_((int32_t)(i * 2654435761u)), hash_u32(i * 2654435761u));
    CHECK_NEAR(unit_(-1), 1 - 0x1p-24, 1e-9);
}

int main(void)
{
    test_inverse_cosine();
    test_powers();
    test_turns();
    test_rounding();
    test_hash();
    return check_end("lanes");
}
