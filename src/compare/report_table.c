/* Based on: Morgan McGuire, Ambient Occlusion Volumes, 2009, Figure 9: times and errors of every
 * method on every scene, darker where they are lower. */
#include "compare/report_parts.h"

enum { STEPS = 5, ROW_LIMIT = 256 };

/* Upper ends of the colours, darkest first; beyond the last: the lightest. The times are the
 * paper's. */
static const double time_steps[STEPS - 1] = {10, 33, 100, 200};
static const double error_steps[STEPS - 1] = {0.25, 0.5, 1, 2};

bool report_same_row(const struct cranny_report_trial *a, const struct cranny_report_trial *b)
{
    return strcmp(a->method, b->method) == 0 && strcmp(a->preset, b->preset) == 0 &&
           strcmp(a->device, b->device) == 0;
}

bool report_on_front(const struct cranny_report_trial *trials, size_t count, size_t index)
{
    const struct cranny_report_trial *one = &trials[index];
    for (size_t i = 0; i < count; i++) {
        const struct cranny_report_trial *other = &trials[i];
        const bool no_worse =
            other->milliseconds <= one->milliseconds && other->error <= one->error;
        const bool equal = other->milliseconds >= one->milliseconds && other->error >= one->error;
        if (i != index && no_worse && (!equal || i < index))
            return false;
    }
    return true;
}

static int step_of(const double steps[STEPS - 1], double value)
{
    int step = 0;
    while (step < STEPS - 1 && value > steps[step])
        step++;
    return step;
}

static const struct cranny_report_trial *find(const struct cranny_report_trial *trials,
                                              size_t count, const struct cranny_report_trial *row)
{
    for (size_t i = 0; i < count; i++)
        if (report_same_row(&trials[i], row))
            return &trials[i];
    return NULL;
}

/* Time and error of one row in one group of columns. */
static void cells(FILE *out, const struct cranny_report_trial *trials, size_t count,
                  const struct cranny_report_trial *row)
{
    const struct cranny_report_trial *trial = find(trials, count, row);
    if (!trial) {
        fputs("<td class=\"none\">–</td><td class=\"none\">–</td>", out);
        return;
    }
    const bool front = report_on_front(trials, count, (size_t)(trial - trials));
    fprintf(out, "<td class=\"k%d\">", step_of(time_steps, trial->milliseconds));
    report_milliseconds(out, trial->milliseconds);
    fprintf(out, "</td><td class=\"k%d\">%s%.3f%s</td>", step_of(error_steps, trial->error),
            front ? "<b title=\"on the Pareto front\">◆ " : "", trial->error, front ? "</b>" : "");
}

static void head(FILE *out, const struct cranny_report *report, bool has_means)
{
    fputs("<thead><tr><th rowspan=\"2\" scope=\"col\">method, preset</th>", out);
    if (has_means)
        fprintf(out, "<th colspan=\"2\" scope=\"colgroup\">mean of %zu views</th>",
                report->view_count);
    for (size_t v = 0; v < report->view_count; v++) {
        const struct cranny_report_view *view = &report->views[v];
        fprintf(out, "<th colspan=\"2\" scope=\"colgroup\"><a href=\"#view-%zu\">", v + 1);
        report_breaking(out, view->scene);
        fputs("</a><br>", out);
        report_breaking(out, view->camera);
        fputs("<br>", out);
        report_count(out, view->triangles);
        fputs(" tris</th>", out);
    }
    fputs("</tr>\n<tr>", out);
    for (size_t v = 0; v < report->view_count + has_means; v++)
        fputs("<th scope=\"col\">time (ms)</th><th scope=\"col\">error (σ²)</th>", out);
    fputs("</tr></thead>\n", out);
}

static void reference_row(FILE *out, const struct cranny_report *report, bool has_means)
{
    double seconds = 0;
    for (size_t v = 0; v < report->view_count; v++)
        seconds += report->views[v].seconds / (double)report->view_count;
    fprintf(out, "<tr><th scope=\"row\">ray trace, truth (%d rays)</th>", report->views[0].rays);
    for (size_t v = has_means ? 0 : 1; v <= report->view_count; v++) {
        const double ms = 1e3 * (v ? report->views[v - 1].seconds : seconds);
        fprintf(out, "<td class=\"k%d\">", step_of(time_steps, ms));
        report_milliseconds(out, ms);
        fputs("</td><td class=\"k0\">0</td>", out);
    }
    fputs("</tr>\n", out);
}

/* Rows in the order in which the views bring them. */
static size_t collect_rows(const struct cranny_report *report,
                           const struct cranny_report_trial *rows[ROW_LIMIT])
{
    size_t count = 0;
    for (size_t v = 0; v < report->view_count; v++)
        for (size_t t = 0; t < report->views[v].trial_count; t++) {
            const struct cranny_report_trial *trial = &report->views[v].trials[t];
            bool known = false;
            for (size_t r = 0; r < count && !known; r++)
                known = report_same_row(rows[r], trial);
            if (!known && count < ROW_LIMIT)
                rows[count++] = trial;
        }
    return count;
}

static void key_steps(FILE *out, const char *name, const double steps[STEPS - 1])
{
    fprintf(out, "%s ", name);
    for (int i = 0; i < STEPS; i++)
        fprintf(out, "<span class=\"k%d\">%s %g</span>", i, i < STEPS - 1 ? "≤" : "&gt;",
                steps[i < STEPS - 1 ? i : STEPS - 2]);
}

static void key(FILE *out)
{
    fputs("<p class=\"key\">Darker is better. ", out);
    key_steps(out, "Time in ms", time_steps);
    fputs(" &ensp; ", out);
    key_steps(out, "Error", error_steps);
    fputs(" &ensp; <b>◆</b> on the Pareto front: nothing is both quicker and nearer to the "
          "truth.</p>\n",
          out);
}

void report_table(FILE *out, const struct cranny_report *report,
                  const struct cranny_report_trial *means, size_t mean_count)
{
    const struct cranny_report_trial *rows[ROW_LIMIT];
    const size_t count = collect_rows(report, rows);
    const bool has_means = report->view_count > 1;
    fprintf(
        out,
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Times and errors\">\n"
        "<table style=\"--columns:%zu\">\n",
        2 * (report->view_count + has_means));
    head(out, report, has_means);
    fputs("<tbody>\n", out);
    reference_row(out, report, has_means);
    for (size_t r = 0; r < count; r++) {
        const bool first = r == 0 || strcmp(rows[r]->method, rows[r - 1]->method) != 0;
        fprintf(out, "<tr%s><th scope=\"row\">", first ? " class=\"first\"" : "");
        report_trial_name(out, rows[r]);
        fputs("</th>", out);
        if (has_means)
            cells(out, means, mean_count, rows[r]);
        for (size_t v = 0; v < report->view_count; v++)
            cells(out, report->views[v].trials, report->views[v].trial_count, rows[r]);
        fputs("</tr>\n", out);
    }
    fputs("</tbody></table></div>\n", out);
    key(out);
}
