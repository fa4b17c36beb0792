/* The doctor on depth: from what the values look like to what to pass. */
#include "screen/doctor.h"

#define DISTINCT_MIN 64 /* fewer values may be round by chance */
#define SKY_SHARE 0.002 /* of the pixels: fewer at the range's very end are no sky */

/* Enough pixels to mean something. */
static bool many(size_t count, const struct depth_values *values)
{
    return (double)count >= SKY_SHARE * (double)values->total;
}

static double percent(size_t count, const struct depth_values *values)
{
    return 100 * (double)count / (double)values->total;
}

/* Does the range's far end look like 0 (or −1) rather than 1? */
static bool looks_reversed(const struct depth_values *values)
{
    const bool gl = values->low < 0;
    const double median = (double)values->sorted[values->count / 2];
    const double place = gl ? 0.5 * (median + 1) : median;
    const double tilt = values->top_mean - values->bottom_mean;
    const double range = (double)values->high - (double)values->low;
    double standard = 0;
    if (many(values->one, values))
        standard += 3;
    if (many(gl ? values->minus_one : values->zero, values))
        standard -= 3;
    standard += place > 0.9 ? 2 : place < 0.1 ? -2 : place - 0.5;
    if (fabs(tilt) > 0.02 * range)
        standard += tilt > 0 ? 1 : -1;
    return standard < 0;
}

static const char *range_words(const struct depth_values *values)
{
    return values->low < 0 ? "-1 and 1" : "0 and 1";
}

/* `reason`: why it is sure; NULL: it is not. */
static void report_device(const struct depth_values *values, const char *reason,
                          struct depth_findings *findings)
{
    const bool reversed = looks_reversed(values);
    depth_found(findings, reason ? CRANNY_DEPTH_ERROR : CRANNY_DEPTH_WARNING,
                reversed ? "depth-reversed" : "depth-device",
                "all depths lie between %s%s, so this is %s device depth as it left the GPU, not "
                "metres; linearise it with kind CRANNY_DEPTH_DEVICE%s%s and the camera's near and "
                "far planes",
                range_words(values), reason ? reason : "", reversed ? "reversed" : "standard",
                reversed ? ", reversed" : "", values->low < 0 ? ", gl_range" : "");
}

static void report_logarithmic(const struct depth_values *values, bool reversed, double shape,
                               struct depth_findings *findings)
{
    depth_found(findings, CRANNY_DEPTH_ERROR, "depth-logarithmic",
                "all depths lie between %s and planes are straight in their exponential, so this "
                "is logarithmic depth; linearise it with kind CRANNY_DEPTH_LOGARITHMIC%s%s and the "
                "renderer's constant and far plane: log(c far + 1) is about %.3g",
                range_words(values), reversed ? ", reversed" : "",
                values->low < 0 ? ", gl_range" : "", shape);
}

static void report_normalized(enum cranny_depth_severity severity, double shape,
                              struct depth_findings *findings)
{
    char planes[80] = "";
    if (shape > 0)
        snprintf(planes, sizeof planes, "; near / (far - near) is about %.3g", shape);
    depth_found(findings, severity, "depth-normalized",
                "all depths lie between 0 and 1 and are proportional to metres%s; unless the scene "
                "is that small they were divided by the far plane: linearise with kind "
                "CRANNY_DEPTH_NORMALIZED and the near and far planes%s",
                severity == CRANNY_DEPTH_ERROR ? ", with the sky at exactly 1" : "", planes);
}

static void report_negative(const struct depth_values *values, struct depth_findings *findings)
{
    if (2 * values->negative > values->total - values->endless - values->zero - values->nan)
        depth_found(findings, CRANNY_DEPTH_ERROR, "depth-negative",
                    "%.3g %% of the depths are negative and so count as sky; this is view z, which "
                    "falls away from the camera: linearise it with kind CRANNY_DEPTH_VIEW_Z",
                    percent(values->negative, values));
    else
        depth_found(findings, CRANNY_DEPTH_WARNING, "depth-negative",
                    "%zu depths (%.3g %%) are negative and count as sky; depth is the distance "
                    "along -Z, so nothing visible has one",
                    values->negative, percent(values->negative, values));
}

/* Values within −1 … 1 that planes say are depth. False: they have to be converted first. */
static bool check_unit_linear(const struct frame *frame, const struct depth_values *values,
                              struct depth_findings *findings)
{
    const bool parallel = frame->projection.kind == CRANNY_ORTHOGRAPHIC;
    if (parallel && values->low < 0 && values->high > 0) {
        report_normalized(CRANNY_DEPTH_ERROR, 0, findings);
        return false;
    }
    if (values->endless || values->low < 0)
        return true;
    if (many(values->one, values)) {
        report_normalized(CRANNY_DEPTH_ERROR, 0, findings);
        return false;
    }
    if (parallel && many(values->zero, values)) {
        depth_found(findings, CRANNY_DEPTH_ERROR, "depth-reversed",
                    "all depths lie between 0 and 1 with the sky at exactly 0, so this is reversed "
                    "device depth of a parallel projection; linearise it with kind "
                    "CRANNY_DEPTH_NORMALIZED, reversed, and the near and far planes");
        return false;
    }
    report_normalized(parallel ? CRANNY_DEPTH_WARNING : CRANNY_DEPTH_NOTE, 0, findings);
    return !parallel;
}

static void check_unit_unknown(const struct depth_values *values, struct depth_findings *findings)
{
    const bool sky =
        many(values->one, values) || many(values->minus_one, values) || many(values->zero, values);
    const float median = values->sorted[values->count / 2];
    const bool far_end = many(values->minus_one, values) || median < -0.8f;
    if (values->low < 0 && values->high <= 0 && !far_end)
        report_negative(values, findings);
    else if (!values->endless && (sky || median > 0.8f || values->low < 0))
        report_device(values, sky && values->quantum > 0 ? " in 8 or 16 bits" : NULL, findings);
    else
        report_normalized(values->endless ? CRANNY_DEPTH_NOTE : CRANNY_DEPTH_WARNING, 0, findings);
}

/* False: not depth yet. */
static bool check_unit(const struct frame *frame, const struct depth_values *values,
                       enum depth_reading reading, double shape, struct depth_findings *findings)
{
    switch (reading) {
    case READING_DEVICE:
        report_device(values, " and planes are straight in them", findings);
        return false;
    case READING_LOGARITHMIC:
    case READING_LOGARITHMIC_REVERSED:
        report_logarithmic(values, reading == READING_LOGARITHMIC_REVERSED, shape, findings);
        return false;
    case READING_NORMALIZED:
        report_normalized(CRANNY_DEPTH_ERROR, shape, findings);
        return false;
    case READING_LINEAR:
    case READING_OTHER_PROJECTION:
        return check_unit_linear(frame, values, findings);
    case READING_UNKNOWN:
        break;
    }
    check_unit_unknown(values, findings);
    return findings->items[findings->count - 1].severity == CRANNY_DEPTH_NOTE;
}

static void check_projection(const struct frame *frame, enum depth_reading reading,
                             struct depth_findings *findings)
{
    if (reading != READING_OTHER_PROJECTION)
        return;
    const bool parallel = frame->projection.kind == CRANNY_ORTHOGRAPHIC;
    depth_found(findings, CRANNY_DEPTH_WARNING, "projection-kind",
                "planes are straight as in a %s projection, but a %s one was given; pass %s, or "
                "linearise the depth first",
                parallel ? "perspective" : "parallel", parallel ? "parallel" : "perspective",
                parallel ? "CRANNY_PERSPECTIVE" : "CRANNY_ORTHOGRAPHIC");
}

static bool whole_numbers(const struct depth_values *values)
{
    for (size_t i = 0; i < values->count; i++)
        if (values->sorted[i] != rintf(values->sorted[i]))
            return false;
    return true;
}

static void check_scale(const struct frame *frame, const struct depth_values *values,
                        struct depth_findings *findings)
{
    const double median = (double)depth_quantile(frame, values, 0.5);
    if (!(median > 0))
        return;
    if (median > 100 && values->distinct >= DISTINCT_MIN && whole_numbers(values))
        depth_found(findings, CRANNY_DEPTH_WARNING, "depth-scale",
                    "all depths are whole numbers around %.4g, as sensors and 16-bit pictures "
                    "store millimetres; multiply by 0.001, or by what one step stands for",
                    median);
    else if (median > 1e4)
        depth_found(findings, CRANNY_DEPTH_WARNING, "depth-scale",
                    "half of the picture lies beyond %.4g m; unless it is a view from the air, "
                    "depth is in %s: multiply it by %g, or scale radius and bias likewise",
                    median, median > 1e5 ? "millimetres" : "centimetres or millimetres",
                    median > 1e5 ? 0.001 : 0.01);
    else if (median < 1e-2)
        depth_found(findings, CRANNY_DEPTH_WARNING, "depth-scale",
                    "half of the picture lies within %.3g m of the camera; unless it is a view "
                    "through a microscope, depth is in kilometres or divided by the far plane: "
                    "multiply it by 1000, or by the far plane",
                    median);
}

/* A sky that is a large number and not infinity. */
static void check_sky(const struct depth_values *values, struct depth_findings *findings)
{
    size_t below = values->count;
    while (below > 0 && values->sorted[below - 1] == values->high)
        below--;
    if (below > 0 && many(values->count - below, values) && values->high > 0 &&
        values->sorted[below - 1] < 0.5f * values->high)
        depth_found(findings, CRANNY_DEPTH_NOTE, "depth-sky",
                    "%.3g %% of the pixels hold exactly %g, far beyond the rest; if that is the "
                    "sky, store +INFINITY there",
                    percent(values->count - below, values), (double)values->high);
}

static void report_steps(const struct frame *frame, const struct depth_values *values, double step,
                         struct depth_findings *findings)
{
    const double median = (double)depth_quantile(frame, values, 0.5);
    depth_found(findings, CRANNY_DEPTH_WARNING, "depth-steps",
                "depth comes in steps of about %.3g m at %.4g m, so slopes are stairs; store 24 "
                "bits or floats, or raise the bias as advised",
                step * median, median);
}

static void report_quantum(const struct depth_values *values, struct depth_findings *findings)
{
    const int bits = values->quantum > 0.002 ? 8 : 16;
    depth_found(findings, CRANNY_DEPTH_WARNING, "depth-steps",
                "the depths have no more than %d bits, so slopes become stairs once they are "
                "metres; store 24 bits or floats",
                bits);
}

/* False: there is nothing to look at. */
static bool check_content(const struct depth_values *values, struct depth_findings *findings)
{
    if (values->nan)
        depth_found(findings, CRANNY_DEPTH_WARNING, "depth-nan",
                    "%zu depths (%.3g %%) are NaN and count as sky; find the division by zero that "
                    "made them",
                    values->nan, percent(values->nan, values));
    if (!values->count || (values->low == 0 && values->high == 0)) {
        depth_found(findings, CRANNY_DEPTH_ERROR, "depth-empty",
                    "no pixel has a depth: %zu are infinite, %zu zero, %zu NaN; was the frame read "
                    "before it was drawn?",
                    values->endless, values->zero, values->nan);
        return false;
    }
    if (values->low == values->high && fabs((double)values->high) == 1 && !values->endless) {
        depth_found(findings, CRANNY_DEPTH_WARNING, "depth-empty",
                    "every pixel holds %g, which is what clearing a depth buffer leaves; was the "
                    "frame read before it was drawn?",
                    (double)values->high);
        return false;
    }
    return true;
}

enum cranny_status depth_check(struct frame *frame, const struct depth_values *values,
                               struct depth_findings *findings, double *step, bool *usable,
                               struct cranny_error *why)
{
    enum depth_reading reading;
    double shape;
    *step = 0;
    *usable = false;
    if (!check_content(values, findings))
        return CRANNY_OK;
    enum cranny_status status = depth_reading_find(frame, values, &reading, &shape, why);
    if (status != CRANNY_OK)
        return status;
    *usable =
        values->low < -1 || values->high > 1 || check_unit(frame, values, reading, shape, findings);
    if (!*usable) {
        if (values->quantum > 0 && values->distinct >= DISTINCT_MIN)
            report_quantum(values, findings);
        return CRANNY_OK;
    }
    if (values->negative)
        report_negative(values, findings);
    frame->sign = 2 * values->negative > values->count ? -1 : 1;
    check_projection(frame, reading, findings);
    check_scale(frame, values, findings);
    check_sky(values, findings);
    depth_steps_find(frame, values, step);
    if (values->half && values->distinct >= DISTINCT_MIN && !whole_numbers(values))
        *step = fmax(*step, 0x1p-11);
    if (*step > 0)
        report_steps(frame, values, *step, findings);
    return CRANNY_OK;
}
