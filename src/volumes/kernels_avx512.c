/* The kernels, 16 pixels at a time. */
#define LANES 16
#define KERNELS volume_kernels_avx512
#include "volumes/kernels_body.h"
