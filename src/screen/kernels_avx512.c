/* The kernels, 16 pixels at a time. */
#define LANES 16
#define KERNELS kernels_avx512
#define KERNELS_NAME "avx512"
#include "screen/kernels_body.h"
