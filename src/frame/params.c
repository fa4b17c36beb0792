/* The truth's parameters: each number stands here once. */
#include "base/base.h"

#include <cranny/frame.h>

static const char *const kernel_names[] = {"exponential", "linear", "hard", NULL};

#define FIELD(name) #name, .offset = offsetof(struct cranny_raytrace_params, name)

static const struct cranny_param rows[] = {
    {.name = FIELD(radius_world),
     .type = CRANNY_PARAM_FLOAT,
     .unit = "m",
     .minimum = 1e-9,
     .maximum = 1e9,
     .fallback = 0.5,
     .help = "where an occluder stops counting"},
    {.name = FIELD(kernel),
     .type = CRANNY_PARAM_ENUM,
     .maximum = COUNT_OF(kernel_names) - 2,
     .unit = "",
     .fallback = CRANNY_KERNEL_LINEAR,
     .choices = kernel_names,
     .help = "how the distance of the nearest occluder becomes visibility"},
    {.name = FIELD(rays),
     .type = CRANNY_PARAM_INT,
     .unit = "rays",
     .minimum = 1,
     .maximum = 65536,
     .fallback = 256,
     .help = "rays a pixel"},
    {.name = FIELD(error_target),
     .type = CRANNY_PARAM_FLOAT,
     .unit = "",
     .minimum = 0,
     .maximum = 1,
     .fallback = 0,
     .help = "stop early once the mean standard error is below this; 0 never"},
    {.name = FIELD(seed),
     .type = CRANNY_PARAM_INT,
     .unit = "",
     .minimum = 0,
     .maximum = 2147483647,
     .fallback = 0,
     .help = "another seed gives other noise"},
    {.name = FIELD(threads),
     .type = CRANNY_PARAM_INT,
     .unit = "threads",
     .minimum = 0,
     .maximum = 1024,
     .fallback = 0,
     .help = "threads to use, 0 for all cores; same result"},
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
