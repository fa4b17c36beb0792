/* Inside the doctor: a frame to look at, and what has been found in it. */
#ifndef SCREEN_DOCTOR_H
#define SCREEN_DOCTOR_H

#include "base/base.h"

#include <cranny/gbuffer.h>

#define DOCTOR_PIXELS 1000000 /* at most that many are looked at, on a regular grid */

struct frame {
    const struct cranny_gbuffer *gbuffer;
    struct cranny_projection projection;
    struct cranny_rect view;
    size_t depth_stride, normal_stride; /* bytes */
    int step;                           /* pixels between the grid's points */
    float sign;                         /* -1 when the depth turned out to be view z */
};

/* Depth as it is stored; (x, y) in the viewport. */
static inline float frame_depth(const struct frame *frame, int x, int y)
{
    const char *row =
        (const char *)frame->gbuffer->depth + (size_t)(frame->view.y + y) * frame->depth_stride;
    return ((const float *)row)[frame->view.x + x];
}

struct depth_finding {
    enum cranny_depth_severity severity;
    const char *code;
    char text[512];
};

struct depth_findings {
    struct depth_finding items[16];
    size_t count;
};

void depth_found(struct depth_findings *findings, enum cranny_depth_severity severity,
                 const char *code, const char *format, ...) __attribute__((format(printf, 4, 5)));

/* What the values are, whatever they mean. */
struct depth_values {
    float *sorted; /* finite ones, ascending */
    size_t count;  /* of them */
    size_t distinct;
    size_t total, nan, endless, negative, zero, one, minus_one;
    float low, high;
    double top_mean, bottom_mean; /* of the picture's upper and lower half */
    double quantum;               /* values are multiples of it (8 or 16 bits); 0: none found */
    bool half;                    /* all fit into half floats */
};

/* CRANNY_MEMORY; free values->sorted. */
enum cranny_status depth_values_gather(const struct frame *frame, struct depth_values *values,
                                       struct cranny_error *why);

/* Depth at a fraction of the positive, finite values; 0 when there are none. */
float depth_quantile(const struct frame *frame, const struct depth_values *values, double q);

/* Which reading of the values makes planes plane. */
enum depth_reading {
    READING_UNKNOWN, /* no planes, or too few for a verdict */
    READING_LINEAR,  /* depth, up to a scale */
    READING_DEVICE,  /* 1 / depth, up to scale and offset (perspective only) */
    READING_LOGARITHMIC,
    READING_LOGARITHMIC_REVERSED,
    READING_NORMALIZED,       /* depth with an offset that shows (perspective only) */
    READING_OTHER_PROJECTION, /* depth of a parallel projection where perspective was said, or the
                                  other way round */
};

/* `shape`: the fitted log(c far + 1), or near / (far − near); else 0. CRANNY_MEMORY. */
enum cranny_status depth_reading_find(const struct frame *frame, const struct depth_values *values,
                                      enum depth_reading *reading, double *shape,
                                      struct cranny_error *why);

/* Plateaus as few bits leave them. `relative`: the median step over its depth, 0 for none. */
void depth_steps_find(const struct frame *frame, const struct depth_values *values,
                      double *relative);

/* Everything about depth; false: it is not linear view depth, so that nothing else can be said. */
enum cranny_status depth_check(struct frame *frame, const struct depth_values *values,
                               struct depth_findings *findings, double *step, bool *usable,
                               struct cranny_error *why);

/* `usable`: depth can be compared with. `step`: of depth, at depth 1 (perspective) or at the
 * median depth (parallel), in metres; 0: none. */
enum cranny_status normal_check(const struct frame *frame, bool usable, double step,
                                struct depth_findings *findings, struct cranny_error *why);

#endif
