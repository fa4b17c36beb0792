/* Pieces of the report's page. */
#ifndef COMPARE_REPORT_PARTS_H
#define COMPARE_REPORT_PARTS_H

#include "base/base.h"

#include <cranny/report.h>

/* The files beside this one; zero-terminated. */
extern const char report_css[], report_js[];

/* Text of any bytes as HTML: for elements and attributes in double quotes. */
void report_text(FILE *out, const char *text);

/* The same for an element, with places where a line may break. */
void report_breaking(FILE *out, const char *text);

/* "method preset", and the device where it is not the CPU. */
void report_trial_name(FILE *out, const struct cranny_report_trial *trial);

/* Three significant digits, so that columns compare; with thousands apart. */
void report_milliseconds(FILE *out, double milliseconds);
void report_count(FILE *out, uint64_t count);

/* A file's bytes as a data URI. */
enum cranny_status report_image(FILE *out, const char *path, struct cranny_error *why);

/* Do both stand in one row? */
bool report_same_row(const struct cranny_report_trial *a, const struct cranny_report_trial *b);

/* Is no other trial both quicker and nearer to the truth? */
bool report_on_front(const struct cranny_report_trial *trials, size_t count, size_t index);

/* Figure 9, and its mean over the views: the trials that all views have. */
void report_table(FILE *out, const struct cranny_report *report,
                  const struct cranny_report_trial *means, size_t mean_count);

/* Figure 10. `id` makes the ids of its elements unique; `title` says of what. */
enum cranny_status report_plot(FILE *out, const struct cranny_report_trial *trials, size_t count,
                               const char *title, struct cranny_error *why);

/* Figure 11: heading, facts, plot and pictures of a view; `number` from 1. */
enum cranny_status report_view(FILE *out, const struct cranny_report_view *view, size_t number,
                               struct cranny_error *why);

#endif
