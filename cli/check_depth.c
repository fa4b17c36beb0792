#include "check.h"

#include <math.h>
#include <stdarg.h>

/* The scene's checks and the depth's have their severities in the same order. */
static enum cranny_severity severity_of(enum cranny_depth_severity severity)
{
    switch (severity) {
    case CRANNY_DEPTH_ERROR:
        return CRANNY_SEVERITY_ERROR;
    case CRANNY_DEPTH_WARNING:
        return CRANNY_SEVERITY_WARNING;
    case CRANNY_DEPTH_NOTE:
        return CRANNY_SEVERITY_NOTE;
    }
    return CRANNY_SEVERITY_NOTE;
}

static void on_finding(void *user, enum cranny_depth_severity severity, const char *code,
                       const char *text)
{
    char words[CRANNY_ERROR_TEXT_SIZE];
    depth_words(code, text, words, sizeof words);
    findings_add(user, severity_of(severity), code, words);
}

static void advise(struct findings *findings, const char *code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void advise(struct findings *findings, const char *code, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    findings_add(findings, CRANNY_SEVERITY_NOTE, code, text);
}

/* The parameter is a share of the picture's height, of which the radius is a tenth. */
static double bias_of(const struct cranny_depth_advice *advice)
{
    return (double)advice->bias / (10 * (double)advice->radius_world);
}

static void say_advice(struct findings *findings, const struct cranny_depth_advice *a)
{
    advise(findings, "advice-radius",
           "depth runs from %.4g to %.4g m, half of it nearer than %.4g m; --radius %.3g is a "
           "tenth of the picture's height there",
           (double)a->depth_near, (double)a->depth_far, (double)a->depth_median,
           (double)a->radius_world);
    advise(findings, "advice-bias",
           "--bias %.2g (of the picture's height) is twice what the depth's steps and noise need",
           bias_of(a));
    if (isfinite(a->fade_end))
        advise(findings, "advice-fade",
               "--fade-begin %.4g --fade-end %.4g: from where that radius covers 4 pixels to where "
               "it covers one",
               (double)a->fade_begin, (double)a->fade_end);
}

static json_t *advice_json(const struct cranny_depth_advice *a)
{
    return json_pack(
        "{so so so so so so so}", "radius_world", json_number((double)a->radius_world), "bias",
        json_number(bias_of(a)), "fade_begin", json_number((double)a->fade_begin), "fade_end",
        json_number((double)a->fade_end), "depth_near", json_number((double)a->depth_near),
        "depth_median", json_number((double)a->depth_median), "depth_far",
        json_number((double)a->depth_far));
}

enum cranny_status check_depth(const struct depth_options *options, const struct view_options *view,
                               struct findings *findings, json_t **advice, struct cranny_error *why)
{
    struct depth_frame frame;
    struct cranny_depth_advice found;
    struct cranny_error mismatch;
    *advice = json_null();
    enum cranny_status status = depth_frame_read(options, view, &frame, &mismatch);
    if (status != CRANNY_OK) {
        *why = mismatch;
        return status;
    }
    if (frame.mismatched)
        findings_add(findings, CRANNY_SEVERITY_ERROR, "size-mismatch", mismatch.message);
    status = cranny_gbuffer_check(&frame.gbuffer, on_finding, findings, &found, why);
    if (status == CRANNY_OK && frame.few_bits)
        findings_add(findings, CRANNY_SEVERITY_WARNING, "depth-bits",
                     "the file holds no more than 8 bits, so slopes are stairs; store 16 bits or "
                     "floats");
    if (status == CRANNY_OK && found.depth_median > 0) {
        say_advice(findings, &found);
        *advice = advice_json(&found);
    }
    depth_frame_free(&frame);
    return status;
}
