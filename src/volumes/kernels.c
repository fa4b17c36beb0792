#include "volumes/kernels.h"

#include "screen/kernels.h"

const struct volume_kernels *volume_kernels_choose(enum cranny_isa wish, enum cranny_isa *chosen)
{
    kernels_choose(wish, chosen);
#if CRANNY_X86
    if (*chosen == CRANNY_ISA_AVX512)
        return &volume_kernels_avx512;
    if (*chosen == CRANNY_ISA_AVX2)
        return &volume_kernels_avx2;
#endif
    return &volume_kernels_portable;
}
