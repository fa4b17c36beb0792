/* The kernels, 8 pixels at a time. */
#define LANES 8
#define KERNELS kernels_avx2
#define KERNELS_NAME "avx2"
#include "screen/kernels_body.h"
