/* What a game needs of a bake, to drop into its own source: no library, no memory, no include but
 * the C library's. The same file is GLSL 4.5: include it in a shader (GL_GOOGLE_include_directive).
 *
 * Directions and normals are unit vectors, positions metres, visibility is in [0,1], 1 = open.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013 (§2.2–§3). */
#ifndef CRANNY_RUNTIME_H
#define CRANNY_RUNTIME_H

#if defined(__STDC__) || defined(__cplusplus) || defined(_MSC_VER)
#    include <math.h>
#    ifdef __cplusplus
extern "C" {
#    endif
#    define CRANNY_INLINE static inline
#    define CRANNY_OUT
#    define CRANNY_INT(x) ((int)(x))
#    define CRANNY_FLOAT(x) ((float)(x))
#    define CRANNY_FLOOR(x) floorf(x)
#else
#    define CRANNY_INLINE
#    define CRANNY_OUT out
#    define CRANNY_INT(x) int(x)
#    define CRANNY_FLOAT(x) float(x)
#    define CRANNY_FLOOR(x) floor(x)
#endif

/* Inside [0,1]; NaN is 0. */
CRANNY_INLINE float cranny_unit(float v)
{
    return v > 0.0f ? (v < 1.0f ? v : 1.0f) : 0.0f;
}

/* Real spherical harmonics up to l = 2 of a direction, in the order (0,0), (1,−1), (1,0), (1,1),
 * (2,−2) … (2,2), orthonormal over the sphere, without the Condon–Shortley phase: y x z of the
 * direction for l = 1 come as y, z, x. */
CRANNY_INLINE void cranny_sh_basis(const float d[3], CRANNY_OUT float basis[9])
{
    basis[0] = 0.28209479f;
    basis[1] = 0.48860251f * d[1];
    basis[2] = 0.48860251f * d[2];
    basis[3] = 0.48860251f * d[0];
    basis[4] = 1.09254843f * d[0] * d[1];
    basis[5] = 1.09254843f * d[1] * d[2];
    basis[6] = 0.31539157f * (3.0f * d[2] * d[2] - 1.0f);
    basis[7] = 1.09254843f * d[0] * d[2];
    basis[8] = 0.54627422f * (d[0] * d[0] - d[1] * d[1]);
}

/* From ρ over the sphere to visibility by normal: convolved with the clamped cosine over π, whose
 * factors are 1, 2/3 and 1/4 for l = 0, 1 and 2. */
CRANNY_INLINE void cranny_sh_convolve(const float sphere[9], CRANNY_OUT float visibility[9])
{
    for (int i = 0; i < 9; i++)
        visibility[i] = sphere[i] * (i == 0 ? 1.0f : i < 4 ? 2.0f / 3.0f : 0.25f);
}

/* Visibility for a normal, of nine convolved harmonics. */
CRANNY_INLINE float cranny_sh9_visibility(const float convolved[9], const float normal[3])
{
    float basis[9];
    float sum = 0.0f;
    cranny_sh_basis(normal, basis);
    for (int i = 0; i < 9; i++)
        sum += convolved[i] * basis[i];
    return cranny_unit(sum);
}

/* The same, of the first four. */
CRANNY_INLINE float cranny_sh4_visibility(const float convolved[4], const float normal[3])
{
    return cranny_unit(0.28209479f * convolved[0] +
                       0.48860251f * (convolved[1] * normal[1] + convolved[2] * normal[2] +
                                      convolved[3] * normal[0]));
}

/* A vertex of an instance: what its mesh has by itself (`local`, per vertex) times a linear
 * function of the position in the mesh's own space (`linear`: constant, then x, y, z per metre; per
 * instance). 2013, eq. 3. */
CRANNY_INLINE float cranny_linear_visibility(const float linear[4], const float position[3],
                                             float local)
{
    return cranny_unit(local * (linear[0] + linear[1] * position[0] + linear[2] * position[1] +
                                linear[3] * position[2]));
}

/* A 4 × 4 ordered dither by pixel, in (0,1), mean ½. */
CRANNY_INLINE float cranny_dither(int x, int y)
{
    int a = x ^ y;
    int rank = ((a & 1) << 3) | ((y & 1) << 2) | (a & 2) | ((y >> 1) & 1);
    return (CRANNY_FLOAT(rank) + 0.5f) / 16.0f;
}

/* Visibility in five bits, 0 to 31 (2013, §3): their mean over pixels is the value when `dither` is
 * cranny_dither's; 0.5 rounds to nearest. */
CRANNY_INLINE int cranny_pack5(float visibility, float dither)
{
    float v = CRANNY_FLOOR(cranny_unit(visibility) * 31.0f + cranny_unit(dither));
    return CRANNY_INT(v < 31.0f ? v : 31.0f);
}

CRANNY_INLINE float cranny_unpack5(int bits)
{
    return CRANNY_FLOAT(bits) / 31.0f;
}

#undef CRANNY_INLINE
#undef CRANNY_OUT
#undef CRANNY_INT
#undef CRANNY_FLOAT
#undef CRANNY_FLOOR
#if defined(__cplusplus)
}
#endif
#endif
