/* Vectors of LANES floats, one pixel a lane, and the functions that the equations are written in.
 *
 * The equations use the common subset of C and GLSL: + − × ÷ on lane_f, and functions for the rest;
 * in GLSL lane_f is float, lane_i int, lane_b bool and lane_3 vec3. LANES is 1, 8 (AVX2) or 16
 * (AVX-512): every function is one IEEE operation a lane, or a fixed sequence of them, so that all
 * widths agree bit for bit. min_ and max_ return their second argument when the first is NaN. */
#ifndef SCREEN_LANES_H
#define SCREEN_LANES_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if !defined(LANES)
#    error "define LANES as 1, 8 or 16"
#endif

#if LANES == 1

typedef float lane_f;
typedef int32_t lane_i;
typedef int32_t lane_b; /* 0 or 1 */

static inline lane_f splat(float x)
{
    return x;
}
static inline lane_f first_lanes(void)
{
    return 0;
}
static inline lane_f load(const float *p)
{
    return *p;
}
static inline void store(float *p, lane_f x)
{
    *p = x;
}
static inline lane_i load_bytes(const uint8_t *p)
{
    return *p;
}
/* Of values 0 … 255. */
static inline void store_bytes(uint8_t *p, lane_i x)
{
    *p = (uint8_t)x;
}
static inline lane_f gather(const float *base, lane_i index)
{
    return base[index];
}
static inline lane_f min_(lane_f a, lane_f b)
{
    return a < b ? a : b;
}
static inline lane_f max_(lane_f a, lane_f b)
{
    return a > b ? a : b;
}
static inline lane_f sqrt_(lane_f x)
{
    return sqrtf(x);
}
static inline lane_b less_(lane_f a, lane_f b)
{
    return a < b;
}
static inline lane_b and_(lane_b a, lane_b b)
{
    return a & b;
}
static inline lane_b or_(lane_b a, lane_b b)
{
    return a | b;
}
static inline lane_b not_(lane_b a)
{
    return !a;
}
static inline lane_f select_(lane_b m, lane_f a, lane_f b)
{
    return m ? a : b;
}
static inline int any_(lane_b m)
{
    return m;
}
/* Towards zero; |x| < 2^31. */
static inline lane_i to_int(lane_f x)
{
    return (int32_t)x;
}
static inline lane_f to_float(lane_i x)
{
    return (float)x;
}
static inline lane_i float_bits(lane_f x)
{
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
static inline lane_f bits_float(lane_i bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
static inline lane_i multiply_u32(lane_i a, uint32_t b)
{
    return (int32_t)((uint32_t)a * b);
}
static inline lane_i add_u32(lane_i a, lane_i b)
{
    return (int32_t)((uint32_t)a + (uint32_t)b);
}
static inline lane_i subtract_u32(lane_i a, lane_i b)
{
    return (int32_t)((uint32_t)a - (uint32_t)b);
}
static inline lane_i shift_right(lane_i a, int bits)
{
    return (int32_t)((uint32_t)a >> bits);
}
static inline lane_i shift_left(lane_i a, int bits)
{
    return (int32_t)((uint32_t)a << bits);
}
static inline lane_i xor_(lane_i a, lane_i b)
{
    return a ^ b;
}
static inline lane_i splat_int(int32_t x)
{
    return x;
}

#else

#    include <immintrin.h>

typedef float lane_f __attribute__((vector_size(4 * LANES)));
typedef int32_t lane_i __attribute__((vector_size(4 * LANES)));
typedef uint32_t lane_u __attribute__((vector_size(4 * LANES)));

static inline lane_f splat(float x)
{
#    if LANES == 16
    return (lane_f)_mm512_set1_ps(x);
#    else
    return (lane_f)_mm256_set1_ps(x);
#    endif
}
/* 0, 1, 2 … */
static inline lane_f first_lanes(void)
{
#    if LANES == 16
    return (lane_f){0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
#    else
    return (lane_f){0, 1, 2, 3, 4, 5, 6, 7};
#    endif
}
static inline lane_f load(const float *p)
{
#    if LANES == 16
    return (lane_f)_mm512_loadu_ps(p);
#    else
    return (lane_f)_mm256_loadu_ps(p);
#    endif
}
static inline void store(float *p, lane_f x)
{
#    if LANES == 16
    _mm512_storeu_ps(p, (__m512)x);
#    else
    _mm256_storeu_ps(p, (__m256)x);
#    endif
}
static inline lane_i load_bytes(const uint8_t *p)
{
#    if LANES == 16
    return (lane_i)_mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i *)(const void *)p));
#    else
    return (lane_i)_mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(const void *)p));
#    endif
}
static inline void store_bytes(uint8_t *p, lane_i x)
{
#    if LANES == 16
    _mm_storeu_si128((__m128i *)(void *)p, _mm512_cvtepi32_epi8((__m512i)x));
#    else
    for (int i = 0; i < LANES; i++)
        p[i] = (uint8_t)x[i];
#    endif
}
static inline lane_f gather(const float *base, lane_i index)
{
#    if LANES == 16
    return (lane_f)_mm512_i32gather_ps((__m512i)index, base, 4);
#    else
    return (lane_f)_mm256_i32gather_ps(base, (__m256i)index, 4);
#    endif
}
static inline lane_f min_(lane_f a, lane_f b)
{
#    if LANES == 16
    return (lane_f)_mm512_min_ps((__m512)a, (__m512)b);
#    else
    return (lane_f)_mm256_min_ps((__m256)a, (__m256)b);
#    endif
}
static inline lane_f max_(lane_f a, lane_f b)
{
#    if LANES == 16
    return (lane_f)_mm512_max_ps((__m512)a, (__m512)b);
#    else
    return (lane_f)_mm256_max_ps((__m256)a, (__m256)b);
#    endif
}
static inline lane_f sqrt_(lane_f x)
{
#    if LANES == 16
    return (lane_f)_mm512_sqrt_ps((__m512)x);
#    else
    return (lane_f)_mm256_sqrt_ps((__m256)x);
#    endif
}

#    if LANES == 16
typedef __mmask16 lane_b;
static inline lane_b less_(lane_f a, lane_f b)
{
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
}
static inline lane_b and_(lane_b a, lane_b b)
{
    return (lane_b)(a & b);
}
static inline lane_b or_(lane_b a, lane_b b)
{
    return (lane_b)(a | b);
}
static inline lane_b not_(lane_b a)
{
    return (lane_b)~a;
}
static inline lane_f select_(lane_b m, lane_f a, lane_f b)
{
    return (lane_f)_mm512_mask_blend_ps(m, (__m512)b, (__m512)a);
}
static inline int any_(lane_b m)
{
    return m != 0;
}
#    else
typedef lane_i lane_b; /* all bits or none */
static inline lane_b less_(lane_f a, lane_f b)
{
    return (lane_b)_mm256_castps_si256(_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LT_OQ));
}
static inline lane_b and_(lane_b a, lane_b b)
{
    return a & b;
}
static inline lane_b or_(lane_b a, lane_b b)
{
    return a | b;
}
static inline lane_b not_(lane_b a)
{
    return ~a;
}
static inline lane_f select_(lane_b m, lane_f a, lane_f b)
{
    return (lane_f)_mm256_blendv_ps((__m256)b, (__m256)a, _mm256_castsi256_ps((__m256i)m));
}
static inline int any_(lane_b m)
{
    return _mm256_movemask_ps(_mm256_castsi256_ps((__m256i)m)) != 0;
}
#    endif

static inline lane_i to_int(lane_f x)
{
#    if LANES == 16
    return (lane_i)_mm512_cvttps_epi32((__m512)x);
#    else
    return (lane_i)_mm256_cvttps_epi32((__m256)x);
#    endif
}
static inline lane_f to_float(lane_i x)
{
#    if LANES == 16
    return (lane_f)_mm512_cvtepi32_ps((__m512i)x);
#    else
    return (lane_f)_mm256_cvtepi32_ps((__m256i)x);
#    endif
}
static inline lane_i float_bits(lane_f x)
{
    return (lane_i)x;
}
static inline lane_f bits_float(lane_i bits)
{
    return (lane_f)bits;
}
static inline lane_i multiply_u32(lane_i a, uint32_t b)
{
    return (lane_i)((lane_u)a * b);
}
static inline lane_i add_u32(lane_i a, lane_i b)
{
    return (lane_i)((lane_u)a + (lane_u)b);
}
static inline lane_i subtract_u32(lane_i a, lane_i b)
{
    return (lane_i)((lane_u)a - (lane_u)b);
}
static inline lane_i shift_right(lane_i a, int bits)
{
    return (lane_i)((lane_u)a >> bits);
}
static inline lane_i shift_left(lane_i a, int bits)
{
    return (lane_i)((lane_u)a << bits);
}
static inline lane_i xor_(lane_i a, lane_i b)
{
    return a ^ b;
}
static inline lane_i splat_int(int32_t x)
{
    return (lane_i){0} + x;
}

#endif

typedef struct {
    lane_f x, y, z;
} lane_3;

static inline lane_3 vec3_(lane_f x, lane_f y, lane_f z)
{
    return (lane_3){x, y, z};
}
static inline lane_3 sub3(lane_3 a, lane_3 b)
{
    return (lane_3){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline lane_3 add3(lane_3 a, lane_3 b)
{
    return (lane_3){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline lane_3 scale3(lane_3 a, lane_f s)
{
    return (lane_3){a.x * s, a.y * s, a.z * s};
}
static inline lane_f dot3(lane_3 a, lane_3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline lane_f clamp_(lane_f x, float low, float high)
{
    return min_(max_(x, splat(low)), splat(high));
}
static inline lane_f saturate_(lane_f x)
{
    return clamp_(x, 0.0f, 1.0f);
}
static inline lane_f abs_(lane_f x)
{
    return max_(x, -x);
}

/* Towards −infinity; |x| < 2^31. */
static inline lane_f floor_(lane_f x)
{
    const lane_f t = to_float(to_int(x));
    return select_(less_(x, t), t - 1.0f, t);
}

/* Arc cosine of x in [−1, 1]; error below 1e-5 (checked by tests/lanes.c). */
static inline lane_f acos_(lane_f x)
{
    const lane_f a = abs_(x);
    lane_f p = splat(0.009730293559f);
    p = p * a - 0.03761404301f;
    p = p * a + 0.08563642486f;
    p = p * a - 0.2142803348f;
    p = p * a + 1.570791528f;
    p = p * sqrt_(max_(1.0f - a, splat(0.0f)));
    return select_(less_(x, splat(0.0f)), 3.14159265f - p, p);
}

/* Base-2 logarithm of x > 0 (not a denormal); absolute error below 1e-6 for x in [2^-8, 2^8]. */
static inline lane_f log2_(lane_f x)
{
    /* x = 2^whole × (1 + t), 1 + t in [√½, √2). */
    const lane_i shifted = add_u32(float_bits(x), splat_int(0x004afb0d));
    const lane_f whole = to_float(shift_right(shifted, 23)) - 127.0f;
    const lane_i exponent = shift_left(shift_right(shifted, 23), 23);
    const lane_f t =
        bits_float(add_u32(float_bits(x), subtract_u32(splat_int(0x3f800000), exponent))) - 1.0f;
    lane_f p = splat(-0.1497332784f);
    p = p * t + 0.2357096358f;
    p = p * t - 0.2483228079f;
    p = p * t + 0.2868688765f;
    p = p * t - 0.3602634621f;
    p = p * t + 0.4809311621f;
    p = p * t - 0.7213524874f;
    p = p * t + 1.442694922f;
    return whole + t * p;
}

/* 2^x for x in [−126, 127); relative error below 2e-7. */
static inline lane_f exp2_(lane_f x)
{
    const lane_f whole = floor_(x + 0.5f);
    const lane_f t = x - whole;
    lane_f p = splat(0.001341000527f);
    p = p * t + 0.009676036363f;
    p = p * t + 0.05550297298f;
    p = p * t + 0.2402210737f;
    p = p * t + 0.6931472254f;
    p = p * t + 1.0000000755f;
    return p * bits_float(shift_left(add_u32(to_int(whole), splat_int(127)), 23));
}

/* x^k for x in [0, 1], k > 0. 0 below 2^-100. */
static inline lane_f pow_(lane_f x, float k)
{
    const lane_f y = exp2_(max_(k * log2_(max_(x, splat(0x1p-100f))), splat(-126.0f)));
    return select_(less_(x, splat(0x1p-100f)), splat(0.0f), min_(y, splat(1.0f)));
}

/* Cosine and sine of `turns` full turns, in [0, 1]; error below 1e-6. */
static inline void turn_(lane_f turns, lane_f *cosine, lane_f *sine)
{
    /* Sine over [−¼, ¼] turns, odd; the cosine is the sine a quarter further. */
    const lane_f a = turns - floor_(turns + 0.5f); /* [−½, ½) */
    const lane_f b = turns + 0.25f - floor_(turns + 0.75f);
    const lane_f s = select_(less_(splat(0.25f), abs_(a)),
                             select_(less_(a, splat(0.0f)), -0.5f - a, 0.5f - a), a);
    const lane_f c = select_(less_(splat(0.25f), abs_(b)),
                             select_(less_(b, splat(0.0f)), -0.5f - b, 0.5f - b), b);
    const lane_f s2 = s * s, c2 = c * c;
    *sine = s * (6.28318528f +
                 s2 * (-41.3416807f + s2 * (81.6024851f + s2 * (-76.5813964f + s2 * 39.7616171f))));
    *cosine =
        c * (6.28318528f +
             c2 * (-41.3416807f + c2 * (81.6024851f + c2 * (-76.5813964f + c2 * 39.7616171f))));
}

/* A 32-bit mix with good avalanche; the same as hash_u32 (base/sequence.h). */
static inline lane_i hash_(lane_i x)
{
    x = xor_(x, shift_right(x, 16));
    x = multiply_u32(x, 0x21f0aaadu);
    x = xor_(x, shift_right(x, 15));
    x = multiply_u32(x, 0x735a2d97u);
    return xor_(x, shift_right(x, 15));
}

/* [0, 1) from 32 bits. */
static inline lane_f unit_(lane_i bits)
{
    return to_float(shift_right(bits, 8)) * 0x1p-24f;
}

#endif
