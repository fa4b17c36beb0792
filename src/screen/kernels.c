/* The one place that asks which processor this is. */
#include "screen/kernels.h"

static bool has(enum cranny_isa isa)
{
    switch (isa) {
    case CRANNY_ISA_AUTO:
    case CRANNY_ISA_PORTABLE:
        return true;
    case CRANNY_ISA_AVX2:
#if CRANNY_X86
        return __builtin_cpu_supports("avx2");
#else
        return false;
#endif
    case CRANNY_ISA_AVX512:
#if CRANNY_X86
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
               __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
#else
        return false;
#endif
    }
    return false;
}

enum cranny_isa cranny_isa_best(void)
{
    if (has(CRANNY_ISA_AVX512))
        return CRANNY_ISA_AVX512;
    return has(CRANNY_ISA_AVX2) ? CRANNY_ISA_AVX2 : CRANNY_ISA_PORTABLE;
}

const char *cranny_isa_name(enum cranny_isa isa)
{
    static const char *const names[] = {"auto", "portable", "avx2", "avx512"};
    return (unsigned)isa < sizeof names / sizeof *names ? names[isa] : "unknown";
}

const struct kernels *kernels_choose(enum cranny_isa wish, enum cranny_isa *chosen)
{
    *chosen = wish == CRANNY_ISA_AUTO || !has(wish) ? cranny_isa_best() : wish;
#if CRANNY_X86
    if (*chosen == CRANNY_ISA_AVX512)
        return &kernels_avx512;
    if (*chosen == CRANNY_ISA_AVX2)
        return &kernels_avx2;
#endif
    return &kernels_portable;
}
