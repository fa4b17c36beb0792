#include "compare/report_parts.h"

#include <errno.h>

static const char head[] =
    "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data: "
    "blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
    "<link rel=\"icon\" href=\"data:,\">\n"
    "<title>Ambient occlusion against the truth</title>\n<style>\n";

static const char intro[] =
    "<p>Every method of Cranny at every preset, beside visibility traced with many rays. Pictures "
    "show visibility: white is open. The error is equation 31 of McGuire, <cite>Ambient Occlusion "
    "Volumes</cite> (2009), on 8-bit values, where 0 is equal; times are medians of several runs, "
    "without reading or drawing the scene, and without what a method makes once of a scene that "
    "stands still: the captions of its pictures state that.</p>\n";

static const char controls[] =
    "<form class=\"bar\" hidden aria-label=\"How pictures are shown\">\n"
    "<fieldset><legend>Show</legend>\n"
    "<label><input type=\"radio\" name=\"mode\" value=\"split\" checked> split against the "
    "truth</label>\n"
    "<label><input type=\"radio\" name=\"mode\" value=\"picture\"> picture</label>\n"
    "<label><input type=\"radio\" name=\"mode\" value=\"error\"> signed error</label>\n"
    "</fieldset>\n"
    "<label>Magnify <select name=\"magnify\"><option value=\"0\">off</option><option value=\"4\">"
    "4×</option><option value=\"8\" selected>8×</option><option value=\"16\">16×</option></select>"
    "</label>\n"
    "<label><input type=\"checkbox\" name=\"linked\"> move all splits together</label>\n"
    "<span class=\"keys\"><kbd>←</kbd> <kbd>→</kbd> split &ensp; <kbd>Shift</kbd>+arrows, "
    "<kbd>↑</kbd> <kbd>↓</kbd> move the magnified place &ensp; <kbd>+</kbd> <kbd>−</kbd> "
    "magnify</span>\n"
    "</form>\n"
    "<p class=\"key\">Bias is the mean of picture − truth: below 0 is too dark. Signed error: blue "
    "is "
    "too dark, red too bright, full colour from 0.25 on, "
    "white equal. The place under the pointer is magnified in all pictures of a view.</p>\n";

static double mean_of(const struct cranny_report *report, const struct cranny_report_trial *row,
                      size_t offset)
{
    double sum = 0;
    size_t count = 0;
    for (size_t v = 0; v < report->view_count; v++)
        for (size_t t = 0; t < report->views[v].trial_count; t++)
            if (report_same_row(&report->views[v].trials[t], row)) {
                sum += *(const double *)(const void *)((const char *)&report->views[v].trials[t] +
                                                       offset);
                count++;
                break;
            }
    return count == report->view_count ? sum / (double)count : NAN;
}

/* Trials that all views have, with their means. */
static size_t average(const struct cranny_report *report, struct cranny_report_trial *means)
{
    const struct cranny_report_view *first = &report->views[0];
    size_t count = 0;
    for (size_t t = 0; t < first->trial_count; t++) {
        struct cranny_report_trial mean = first->trials[t];
        mean.milliseconds =
            mean_of(report, &mean, offsetof(struct cranny_report_trial, milliseconds));
        mean.error = mean_of(report, &mean, offsetof(struct cranny_report_trial, error));
        if (isfinite(mean.error) && isfinite(mean.milliseconds))
            means[count++] = mean;
    }
    return count;
}

static void introduce(FILE *out, const struct cranny_report *report)
{
    fputs("<main>\n<h1>Ambient occlusion against the truth</h1>\n", out);
    fputs(intro, out);
    fputs("<p class=\"facts\">Measured on ", out);
    report_text(out, report->machine);
    fprintf(out, ", with Cranny %s.</p>\n", cranny_version());
    for (size_t i = 0; i < report->failure_count; i++) {
        fputs("<p class=\"failures\">Not shown: ", out);
        report_text(out, report->failures[i]);
        fputs("</p>\n", out);
    }
}

static enum cranny_status summarise(FILE *out, const struct cranny_report *report,
                                    struct cranny_error *why)
{
    struct cranny_report_trial *means = alloc_array(report->views[0].trial_count, sizeof *means);
    if (!means)
        return fail_memory(why, "the report's table");
    const size_t count = average(report, means);
    enum cranny_status status = CRANNY_OK;
    fputs("<h2 id=\"table\">Times and errors</h2>\n", out);
    report_table(out, report, means, count);
    if (report->view_count > 1)
        status = report_plot(out, means, count, "Time and error, means of all views", why);
    free(means);
    return status;
}

static enum cranny_status write_page(FILE *out, const struct cranny_report *report,
                                     struct cranny_error *why)
{
    fputs(head, out);
    fputs(report_css, out);
    fputs("</style>\n</head>\n<body>\n", out);
    introduce(out, report);
    enum cranny_status status = summarise(out, report, why);
    fputs(controls, out);
    for (size_t v = 0; v < report->view_count && status == CRANNY_OK; v++)
        status = report_view(out, &report->views[v], v + 1, why);
    fputs("<h2>This page</h2>\n<pre>", out);
    report_text(out, report->command);
    fputs("</pre>\n</main>\n<script>\n", out);
    fputs(report_js, out);
    fputs("</script>\n</body>\n</html>\n", out);
    return status;
}

enum cranny_status cranny_report_write(const struct cranny_report *report, const char *path,
                                       struct cranny_error *why)
{
    if (!report || !path || !report->view_count)
        return fail(why, CRANNY_USAGE, "report: needs a path and at least one view");
    FILE *out = fopen(path, "wb");
    if (!out)
        return fail(why, CRANNY_FAILED, "%.800s: cannot be written: %s", path, strerror(errno));
    enum cranny_status status = write_page(out, report, why);
    const bool bad = ferror(out) != 0;
    const bool closed = fclose(out) == 0;
    if (status == CRANNY_OK && (bad || !closed))
        status = fail(why, CRANNY_FAILED, "%.800s: cannot be written: %s", path, strerror(errno));
    return status;
}
