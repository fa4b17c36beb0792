/* The truth's parameters: each number stands here once. */
#include "base/rows.h"
#include "trace/gather.h"

#include <cranny/frame.h>

#define ROW_STRUCT struct cranny_raytrace_params

static const struct cranny_param rows[] = {
    REAL(radius_world, "m", 1e-9, 1e9, 0.5, "where an occluder stops counting"),
    CHOICE(kernel, gather_kernel_names, CRANNY_KERNEL_LINEAR,
           "how the distance of the nearest occluder becomes visibility"),
    WHOLE(rays, "rays", 1, 65536, 256, "rays a pixel"),
    REAL(error_target, "", 0, 1, 0,
         "stop early once the mean standard error is below this; 0 never"),
    WHOLE(seed, "", 0, 2147483647, 0, "another seed gives other noise"),
    WHOLE(threads, "threads", 0, 1024, 0, "threads to use, 0 for all cores; same result"),
};

static const struct cranny_param_table table = {"raytrace", rows, COUNT_OF(rows)};

const struct cranny_param_table *cranny_raytrace_param_table(void)
{
    return &table;
}

struct cranny_raytrace_params cranny_raytrace_params_default(void)
{
    struct cranny_raytrace_params params = {0};
    cranny_params_defaults(&table, &params);
    return params;
}
