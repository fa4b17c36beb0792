/* The kernels, one pixel at a time. */
#define LANES 1
#define KERNELS volume_kernels_portable
#include "volumes/kernels_body.h"
