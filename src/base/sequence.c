#include "base/sequence.h"

/* Direction numbers of the first two Sobol dimensions follow from their polynomials: the first is
 * the bit reversal, the second the Pascal triangle modulo 2. */
static uint32_t reverse_bits(uint32_t x)
{
    x = (x >> 16) | (x << 16);
    x = ((x & 0xff00ff00u) >> 8) | ((x & 0x00ff00ffu) << 8);
    x = ((x & 0xf0f0f0f0u) >> 4) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x & 0xccccccccu) >> 2) | ((x & 0x33333333u) << 2);
    return ((x & 0xaaaaaaaau) >> 1) | ((x & 0x55555555u) << 1);
}

uint32_t sobol_u32(uint32_t index, int dimension)
{
    if (dimension == 0)
        return reverse_bits(index);
    uint32_t direction = 1u << 31, value = 0;
    for (; index; index >>= 1, direction ^= direction >> 1)
        if (index & 1)
            value ^= direction;
    return value;
}

uint32_t owen_scramble(uint32_t x, uint32_t seed)
{
    x = reverse_bits(x);
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return reverse_bits(x);
}

void r2_point(uint32_t index, const double shift[2], double point[2])
{
    const double plastic = 1.32471795724474602596; /* root of x³ = x + 1 */
    point[0] = fraction(shift[0] + (double)index * (1.0 / plastic));
    point[1] = fraction(shift[1] + (double)index * (1.0 / (plastic * plastic)));
}
