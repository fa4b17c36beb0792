/* The kernels, 8 pixels at a time. */
#define LANES 8
#define KERNELS volume_kernels_avx2
#include "volumes/kernels_body.h"
