/* Low-discrepancy sequences and hashes: everything that stands where others use random numbers. */
#ifndef BASE_SEQUENCE_H
#define BASE_SEQUENCE_H

#include <math.h>
#include <stdint.h>

#define GOLDEN_RATIO_FRACTION 0.6180339887498949 /* φ − 1 */

/* A bijective 32-bit mix with good avalanche (two xor-shift-multiply rounds). */
static inline uint32_t hash_u32(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x21f0aaadu;
    x ^= x >> 15;
    x *= 0x735a2d97u;
    x ^= x >> 15;
    return x;
}

static inline uint32_t hash_combine(uint32_t a, uint32_t b)
{
    return hash_u32(a ^ (hash_u32(b) + 0x9e3779b9u + (a << 6) + (a >> 2)));
}

/* [0,1), 24 bits: exact in float. */
static inline float unit_from_u32(uint32_t x)
{
    return (float)(x >> 8) * 0x1p-24f;
}

/* Fractional part for x ≥ 0. */
static inline double fraction(double x)
{
    return x - floor(x);
}

/* Dimension 0 or 1 of the Sobol sequence, as 32 bits. */
uint32_t sobol_u32(uint32_t index, int dimension);

/* Nested uniform (Owen) scramble by a hash of the reversed bits (Laine, Karras 2011). */
uint32_t owen_scramble(uint32_t x, uint32_t seed);

/* The R2 sequence (generalised golden ratio in the plane), point `index` shifted by `shift`. */
void r2_point(uint32_t index, const double shift[2], double point[2]);

#endif
