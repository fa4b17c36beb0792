/* The samples' visibilities: traced once, kept small. */
#ifndef BAKE_COLLECT_H
#define BAKE_COLLECT_H

#include "bake/plan.h"

/* 65535 is 1. */
struct sample {
    uint16_t visibility[2];
};

struct samples {
    struct sample *values; /* plan->sample_count */
    uint8_t *valid;        /* plan->sample_count */
    uint64_t rays, invalid;
};

static inline double sample_value(const struct sample *sample, int channel)
{
    return sample->visibility[channel] * (1.0 / 65535);
}

/* Trace all samples of the plan and mark the buried ones. Progress stage "trace". */
enum cranny_status samples_collect(const struct plan *plan, const struct cranny_tracer *tracer,
                                   const struct cranny_bake_params *params, struct samples *samples,
                                   struct cranny_error *why);
void samples_free(struct samples *samples);

/* The gathering settings that a bake's parameters ask for. */
struct cranny_gather_params bake_gather_params(const struct cranny_bake_params *params);

#endif
