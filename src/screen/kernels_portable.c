/* The kernels, a pixel at a time: the reference of the others. */
#define LANES 1
#define KERNELS kernels_portable
#define KERNELS_NAME "portable"
#include "screen/kernels_body.h"
