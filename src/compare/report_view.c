/* Based on: Morgan McGuire, Ambient Occlusion Volumes, 2009, Figure 11: pictures beside the truth.
 */
#include "compare/report_parts.h"

static const char lens[] =
    "<span class=\"spot\"></span><div class=\"loupe\"><canvas class=\"lens\" width=\"9\" "
    "height=\"9\" aria-hidden=\"true\"></canvas><output></output></div>";

static void heading(FILE *out, const struct cranny_report_view *view, size_t number)
{
    fprintf(out, "<section class=\"view\" id=\"view-%zu\">\n<h2>", number);
    report_text(out, view->scene);
    fputs(" <small>", out);
    report_text(out, view->camera);
    fprintf(out, "</small></h2>\n<p class=\"facts\">%d × %d pixels · radius %.4g m · ", view->width,
            view->height, view->radius_world);
    report_count(out, view->triangles);
    fputs(" triangles · truth: ", out);
    report_count(out, (uint64_t)view->rays);
    fprintf(out, " rays a pixel, %.3g s, standard error %.2g</p>\n", view->seconds,
            view->standard_error);
}

static void command(FILE *out, const char *text)
{
    fputs("<div class=\"command\"><code tabindex=\"0\">", out);
    report_text(out, text);
    fputs("</code><button type=\"button\">copy</button></div></figcaption>\n</figure>\n", out);
}

static enum cranny_status picture(FILE *out, const struct cranny_report_view *view,
                                  const char *path, struct cranny_error *why)
{
    fprintf(out, "<img class=\"test\" width=\"%d\" height=\"%d\" decoding=\"async\" src=\"",
            view->width, view->height);
    const enum cranny_status status = report_image(out, path, why);
    fputs("\" alt=\"Visibility: ", out);
    return status;
}

static enum cranny_status truth_tile(FILE *out, const struct cranny_report_view *view,
                                     struct cranny_error *why)
{
    fputs("<figure class=\"tile truth\">\n<div class=\"split\">", out);
    const enum cranny_status status = picture(out, view, view->image, why);
    fprintf(out,
            "the ray-traced truth\">%s<input type=\"range\" min=\"0\" max=\"100\" step=\"1\" "
            "aria-label=\"The truth; the arrow keys move the magnified place\"></div>\n"
            "<figcaption><b>truth</b>, %d rays a pixel",
            lens, view->rays);
    command(out, view->command);
    return status;
}

static void split_parts(FILE *out, const struct cranny_report_trial *trial)
{
    fputs("\"><img class=\"over\" alt=\"\"><canvas class=\"map\" width=\"1\" height=\"1\" "
          "role=\"img\" aria-label=\"Signed error: blue too dark, red too bright\"></canvas>"
          "<span class=\"word left\">",
          out);
    report_trial_name(out, trial);
    fprintf(out,
            "</span><span class=\"word right\">truth</span><span class=\"edge\"></span>%s"
            "<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" step=\"1\" aria-label=\""
            "Where the method ends and the truth begins: ",
            lens);
    report_trial_name(out, trial);
    fputs("\"></div>\n", out);
}

static enum cranny_status tile(FILE *out, const struct cranny_report_view *view,
                               const struct cranny_report_trial *trial, struct cranny_error *why)
{
    fputs("<figure class=\"tile\">\n<div class=\"split\">", out);
    const enum cranny_status status = picture(out, view, trial->image, why);
    report_trial_name(out, trial);
    split_parts(out, trial);
    fputs("<figcaption><b>", out);
    report_trial_name(out, trial);
    fputs("</b>: ", out);
    report_milliseconds(out, trial->milliseconds);
    fprintf(out, " ms, error %.3f, RMSE %.3f, bias %s%.3f", trial->error, trial->rmse,
            trial->mean < 0 ? "−" : "+", fabs(trial->mean));
    if (trial->setup_seconds > 0)
        fprintf(out, "; once a scene: %.2g s", trial->setup_seconds);
    command(out, trial->command);
    return status;
}

enum cranny_status report_view(FILE *out, const struct cranny_report_view *view, size_t number,
                               struct cranny_error *why)
{
    char title[64];
    snprintf(title, sizeof title, "Time and error, view %zu", number);
    heading(out, view, number);
    enum cranny_status status = report_plot(out, view->trials, view->trial_count, title, why);
    fputs("<div class=\"tiles\">\n", out);
    if (status == CRANNY_OK)
        status = truth_tile(out, view, why);
    for (size_t t = 0; t < view->trial_count && status == CRANNY_OK; t++)
        status = tile(out, view, &view->trials[t], why);
    fputs("</div>\n</section>\n", out);
    return status;
}
