/* The error between two images, against sums done by hand (eq. 31 of the volumes paper). */
#include "check.h"

#include <cranny/compare.h>
#include <stdbool.h>
#include <stdint.h>

static struct cranny_difference measure(int width, int height, const float *a, const float *b)
{
    struct cranny_error why;
    struct cranny_difference result;
    CHECK_OK(cranny_difference_measure(width, height, a, 0, b, 0, &result, &why), why);
    return result;
}

static float noise(uint32_t *state)
{
    *state = *state * 1664525 + 1013904223;
    return (float)(*state >> 8) / 16777216.f;
}

static void test_one_pixel(void)
{
    const float a = 1, b = 0.2f;
    struct cranny_difference d = measure(1, 1, &a, &b);
    const double logs = log(256) - log(52);
    CHECK_NEAR(d.error, logs * logs, 1e-12);
    CHECK_NEAR(d.rmse, 0.8, 1e-7);
    CHECK_NEAR(d.psnr, -20 * log10(0.8), 1e-6);
    CHECK_NEAR(d.max_abs, 0.8, 1e-7);
    CHECK_NEAR(d.mean, 0.8, 1e-7);
}

/* Two rows: T = 0 51 / 255 102, R = 0 0 / 51 153 in 255ths. */
static void test_by_hand(void)
{
    const float t[4] = {0, 0.2f, 1, 0.4f}, r[4] = {0, 0, 0.2f, 0.6f};
    struct cranny_difference d = measure(2, 2, t, r);
    const double value =
        (pow(log(52), 2) + pow(log(256) - log(52), 2) + pow(log(103) - log(154), 2)) / 4;
    /* Rightwards T: 51, −153; R: 0, 102. Downwards T: 255, 51; R: 51, 153. */
    const double dx = (pow(log(52), 2) + pow(-log(154) - log(103), 2)) / 2;
    const double dy = (pow(log(256) - log(52), 2) + pow(log(52) - log(154), 2)) / 2;
    CHECK_NEAR(d.error, value + (dx + dy) / 2, 1e-12);
    CHECK_NEAR(d.rmse, sqrt((0.04 + 0.64 + 0.04) / 4), 1e-7);
    CHECK_NEAR(d.max_abs, 0.8, 1e-7);
    CHECK_NEAR(d.mean, (0.2 + 0.8 - 0.2) / 4, 1e-7);
}

static void test_lines(void)
{
    const float t[3] = {0, 1, 0}, r[3] = {0, 0, 0};
    const double value = pow(log(256), 2) / 3, gradient = pow(log(256), 2);
    CHECK_NEAR(measure(3, 1, t, r).error, value + gradient / 2, 1e-12);
    CHECK_NEAR(measure(1, 3, t, r).error, value + gradient / 2, 1e-12);
}

static void test_equal(void)
{
    float a[35];
    uint32_t state = 7;
    for (int i = 0; i < 35; i++)
        a[i] = noise(&state);
    struct cranny_difference d = measure(7, 5, a, a);
    CHECK_NEAR(d.error, 0, 0);
    CHECK_NEAR(d.rmse, 0, 0);
    CHECK_NEAR(d.max_abs, 0, 0);
    CHECK_NEAR(d.mean, 0, 0);
    CHECK(isinf(d.psnr) && d.psnr > 0);
    float b[35];
    memcpy(b, a, sizeof b);
    b[12] = 1 - b[12];
    CHECK(measure(7, 5, a, b).error > 0);
}

static void test_symmetry(void)
{
    float a[63], b[63], a_turned[63], b_turned[63];
    uint32_t state = 3;
    for (int i = 0; i < 63; i++) {
        a[i] = noise(&state);
        b[i] = noise(&state);
        a_turned[i % 9 * 7 + i / 9] = a[i];
        b_turned[i % 9 * 7 + i / 9] = b[i];
    }
    struct cranny_difference ab = measure(9, 7, a, b), ba = measure(9, 7, b, a);
    CHECK_NEAR(ab.error, ba.error, 0);
    CHECK_NEAR(ab.rmse, ba.rmse, 0);
    CHECK_NEAR(ab.mean, -ba.mean, 0);
    CHECK_NEAR(measure(7, 9, a_turned, b_turned).error, ab.error, 1e-12);
}

/* The error is that of 8-bit images, whatever lies between the steps; the rest is not. */
static void test_quantised(void)
{
    float a[24], b[24], a8[24], b8[24];
    uint32_t state = 11;
    for (int i = 0; i < 24; i++) {
        a[i] = noise(&state);
        b[i] = noise(&state);
        a8[i] = floorf(a[i] * 255 + 0.5f) / 255;
        b8[i] = floorf(b[i] * 255 + 0.5f) / 255;
    }
    CHECK_NEAR(measure(6, 4, a, b).error, measure(6, 4, a8, b8).error, 0);
    CHECK(measure(6, 4, a, b).rmse != measure(6, 4, a8, b8).rmse);
}

static void test_range(void)
{
    const float wild[4] = {NAN, -3, INFINITY, 7}, tame[4] = {0, 0, 1, 1};
    struct cranny_difference d = measure(2, 2, wild, tame);
    CHECK_NEAR(d.error, 0, 0);
    CHECK_NEAR(d.max_abs, 0, 0);
}

static void test_stride(void)
{
    const float wide[2][5] = {{0, 1, 0.5f, 9, 9}, {1, 0.3f, 0, 9, 9}};
    const float tight[6] = {0, 1, 0.5f, 1, 0.3f, 0};
    struct cranny_error why;
    struct cranny_difference d;
    CHECK_OK(cranny_difference_measure(3, 2, wide[0], sizeof wide[0], tight, 0, &d, &why), why);
    CHECK_NEAR(d.error, 0, 0);
    CHECK_NEAR(d.max_abs, 0, 0);
    uint8_t rgb[18];
    CHECK_OK(cranny_difference_map(3, 2, wide[0], sizeof wide[0], tight, 0, 1, rgb, &why), why);
    for (int i = 0; i < 18; i++)
        CHECK_INT(rgb[i], 255);
}

static void test_map(void)
{
    const float test[5] = {0.5f, 0.3f, 0.8f, 0, 1}, reference[5] = {0.5f, 0.5f, 0.5f, 1, NAN};
    const uint8_t expected[15] = {255, 255, 255, 128, 128, 255, 255, 64, 64, 0, 0, 255, 255, 0, 0};
    uint8_t rgb[15];
    struct cranny_error why;
    CHECK_OK(cranny_difference_map(5, 1, test, 0, reference, 0, 0.4f, rgb, &why), why);
    for (int i = 0; i < 15; i++)
        CHECK_NEAR(rgb[i], expected[i], 1);
}

static void test_refused(void)
{
    const float a[4] = {0};
    uint8_t rgb[12];
    struct cranny_error why;
    struct cranny_difference d;
    CHECK_INT(cranny_difference_measure(0, 2, a, 0, a, 0, &d, &why), CRANNY_USAGE);
    CHECK_INT(cranny_difference_measure(2, -1, a, 0, a, 0, &d, &why), CRANNY_USAGE);
    CHECK_INT(cranny_difference_measure(2, 2, NULL, 0, a, 0, &d, &why), CRANNY_USAGE);
    CHECK(strstr(why.message, "test"));
    CHECK_INT(cranny_difference_measure(2, 2, a, 0, a, 4, &d, NULL), CRANNY_USAGE);
    CHECK_INT(cranny_difference_measure(2, 1, a, 9, a, 0, &d, NULL), CRANNY_USAGE);
    CHECK_INT(cranny_difference_map(2, 2, a, 0, a, 0, 0, rgb, &why), CRANNY_USAGE);
    CHECK_INT(cranny_difference_map(2, 2, a, 0, a, 0, NAN, rgb, &why), CRANNY_USAGE);
    CHECK_INT(cranny_difference_map(2, 2, a, 0, a, 0, 1, NULL, &why), CRANNY_USAGE);
}

int main(void)
{
    test_one_pixel();
    test_by_hand();
    test_lines();
    test_equal();
    test_symmetry();
    test_quantised();
    test_range();
    test_stride();
    test_map();
    test_refused();
    return check_end("compare");
}
