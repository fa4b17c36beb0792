#include "page.h"

#include "html.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static const char head[] =
    "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
    "<style>\n"
    ":root{color-scheme:light "
    "dark;--ink:#1d2125;--soft:#5d666f;--paper:#fbfaf8;--line:#d9d6cf;--mark:#b3541e}\n"
    "@media(prefers-color-scheme:dark){:root{--ink:#e8e6e1;--soft:#a3a8ad;--paper:#17191b;--line:#"
    "383c40;"
    "--mark:#e58b52}}\n"
    "*{box-sizing:border-box}\n"
    "body{margin:0;background:var(--paper);color:var(--ink);font:17px/1.55 system-ui,sans-serif}\n"
    "main{max-width:70rem;margin:0 auto;padding:2.5rem 1.25rem 4rem}\n"
    "h1{font-size:2rem;line-height:1.15;margin:0 0 .4em;letter-spacing:-.015em}\n"
    "h2{font-size:1.2rem;margin:2.6em 0 .5em}\n"
    "p{max-width:44rem}\n"
    "figure{margin:2rem 0}\nfigcaption{color:var(--soft);font-size:.92rem;margin-top:.5rem}\n"
    ".split{position:relative;overflow:hidden;border-radius:6px;line-height:0;--at:50%;"
    "border:1px solid var(--line)}\n"
    ".split img{width:100%;height:auto;display:block}\n"
    ".split .after{position:absolute;inset:0;clip-path:inset(0 0 0 var(--at))}\n"
    ".split .bar{position:absolute;top:0;bottom:0;left:var(--at);width:2px;margin-left:-1px;"
    "background:#fff;box-shadow:0 0 6px #0008;pointer-events:none}\n"
    ".split "
    ".bar::after{content:'\\2194';position:absolute;left:50%;top:50%;width:2.2rem;height:2.2rem;"
    "margin:-1.1rem;border-radius:50%;background:#fff;color:#222;font:1.2rem/2.2rem "
    "system-ui,sans-serif;"
    "text-align:center;box-shadow:0 1px 6px #0006}\n"
    ".split "
    "input{position:absolute;inset:0;width:100%;height:100%;margin:0;opacity:0;cursor:ew-resize;"
    "touch-action:pan-y}\n"
    ".split:focus-within{outline:3px solid var(--mark);outline-offset:3px}\n"
    ".split .word{position:absolute;bottom:.7rem;padding:.25rem "
    ".6rem;border-radius:4px;background:#000a;"
    "color:#fff;font:.8rem/1.3 system-ui,sans-serif;pointer-events:none}\n"
    ".word.left{left:.7rem}.word.right{right:.7rem}\n"
    ".pairs,.maps{display:grid;gap:1.6rem 1.25rem;margin:1.6rem 0}\n"
    ".pairs{grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr))}\n"
    ".maps{grid-template-columns:repeat(auto-fit,minmax(min(45%,13rem),1fr))}\n"
    ".pairs figure,.maps figure{margin:0}\n.lit{max-width:60rem}\n"
    ".maps img{width:100%;height:auto;display:block;border-radius:4px;border:1px solid "
    "var(--line)}\n"
    ".legend{max-width:26rem;margin:0 0 1.6rem;color:var(--soft);font-size:.92rem}\n"
    ".legend i{display:block;height:.8rem;border-radius:4px;border:1px solid var(--line);"
    "background:linear-gradient(90deg,#00f,#fff,#f00);print-color-adjust:exact;"
    "-webkit-print-color-adjust:exact}\n"
    ".legend div{display:flex;justify-content:space-between}\n"
    "h3{font-size:1rem;margin:2.2em 0 .4em}\n"
    "thead th{border-bottom-color:var(--soft)}\n"
    ".scores th:not(:first-child){text-align:right}\n"
    "table{border-collapse:collapse;font-variant-numeric:tabular-nums;width:100%;max-width:34rem}\n"
    "th,td{text-align:left;font-weight:400;padding:.3rem .2rem;border-bottom:1px solid "
    "var(--line)}\n"
    "td{text-align:right}th{color:var(--soft)}\n"
    "pre{overflow-x:auto;padding:.9rem 1rem;border:1px solid "
    "var(--line);border-radius:6px;font-size:.9rem}\n"
    "@media print{:root{--ink:#000;--soft:#444;--paper:#fff}body{font-size:10pt}"
    ".split{display:grid;grid-template-columns:1fr 1fr;gap:4px;overflow:visible}"
    ".split .after{position:static;clip-path:none}.split .bar,.split input{display:none}"
    ".word.right{right:.7rem}.word.left{left:.7rem}figure,table,.maps,.legend{break-inside:avoid}"
    "h2,h3{break-after:avoid}.pairs{display:block}.pairs figure{margin:0 0 1rem}"
    ".maps{grid-template-columns:1fr 1fr}pre{white-space:pre-wrap}}\n"
    "</style>\n";

static const char tail[] = "<script>\n"
                           "for (const slider of document.querySelectorAll('.split input')) {\n"
                           "  const move = () =>\n"
                           "    slider.parentNode.style.setProperty('--at', slider.value + '%');\n"
                           "  slider.addEventListener('input', move);\n"
                           "  move();\n"
                           "}\n"
                           "</script>\n</main>\n</html>\n";

static void figure(FILE *out, const struct page *page, int number)
{
    const char *name = page->view_names[number - 1];
    char before[32], after[32];
    snprintf(before, sizeof before, "before-%d.png", number);
    snprintf(after, sizeof after, "after-%d.png", number);
    const struct split split = {before,
                                after,
                                "before",
                                "after",
                                "Before: clay without occlusion",
                                "After: the same with baked visibility",
                                name,
                                page->width,
                                page->height};
    fputs("<figure>\n", out);
    html_split(out, &split);
    fputs("<figcaption>", out);
    html_text(out, name);
    fputs(". Drag, or use the arrow keys.</figcaption>\n</figure>\n", out);
}

static void grouped(char line[32], uint64_t value)
{
    char digits[24];
    int count = snprintf(digits, sizeof digits, "%" PRIu64, value), used = 0;
    for (int i = 0; i < count; i++) {
        if (i && (count - i) % 3 == 0)
            line[used++] = ' ';
        line[used++] = digits[i];
    }
    line[used] = 0;
}

static void count_row(FILE *out, const char *name, uint64_t value)
{
    char line[32];
    grouped(line, value);
    fprintf(out, "<tr><th scope=\"row\">%s</th><td>%s</td></tr>\n", name, line);
}

static void number_row(FILE *out, const char *name, const char *format, double value)
{
    fprintf(out, "<tr><th scope=\"row\">%s</th><td>", name);
    fprintf(out, format, value);
    fputs("</td></tr>\n", out);
}

static void tables(FILE *out, const struct page *page)
{
    const struct cranny_bake_report *r = &page->report;
    fputs("<h2>The bake in numbers</h2>\n<table>\n", out);
    count_row(out, "instances in the world", r->instances);
    count_row(out, "vertices in the world", r->vertices);
    count_row(out, "triangles in the world", r->triangles);
    count_row(out, "triangles stored", page->info.unique_triangles);
    count_row(out, "sets of values", r->meshes);
    count_row(out, "samples on surfaces", r->samples);
    count_row(out, "of these buried, left out", r->invalid_samples);
    count_row(out, "rays", r->rays);
    number_row(out, "million rays per second", "%.1f", r->mrays_per_s);
    number_row(out, "fit, rms between samples and vertices", "%.4f", r->fit_rms);
    fputs("</table>\n<h2>Where the time went</h2>\n<table>\n", out);
    number_row(out, "read the file", "%.2f s", page->seconds_load);
    number_row(out, "ray structure", "%.2f s", r->seconds_bvh);
    number_row(out, "place samples", "%.2f s", r->seconds_sample);
    number_row(out, "trace", "%.2f s", r->seconds_trace);
    number_row(out, "fit to vertices", "%.2f s", r->seconds_solve);
    number_row(out, "instances, shrubs and grass", "%.2f s",
               r->seconds_local + r->seconds_volume + r->seconds_linear + r->seconds_scalar);
    number_row(out, "coarser levels of detail", "%.2f s", r->seconds_resample + r->seconds_lod);
    number_row(out, "write the file", "%.2f s", page->seconds_write);
    number_row(out, "in all, without the pictures", "%.2f s", page->seconds_total);
    fputs("</table>\n", out);
}

static void commands(FILE *out, const struct page *page)
{
    fputs("<h2>Bake it yourself</h2>\n<pre>cranny bake ", out);
    html_shell_word(out, page->scene_path);
    fprintf(out, " --set rays=%d -o ", page->params.rays);
    html_shell_word(out, page->output_name);
    fputs("\ncranny-demo ", out);
    html_shell_word(out, page->scene_path);
    fprintf(out, " --rays %d -o ", page->params.rays);
    html_shell_word(out, page->folder);
    fputs("   # this page</pre>\n<p>The baked file is <a href=\"", out);
    html_text(out, page->output_name);
    fputs("\">", out);
    html_text(out, page->output_name);
    fputs("</a>: drop it into any glTF viewer.</p>\n", out);
}

static void body(FILE *out, const struct page *page)
{
    fputs("<title>Baked: ", out);
    html_text(out, page->scene_name);
    fputs("</title>\n<main>\n<h1>", out);
    html_text(out, page->scene_name);
    fputs(", before and after</h1>\n"
          "<p>Grey clay under an even sky. On the left every surface gets the whole sky; on the "
          "right "
          "each vertex carries the share of the sky that it can see",
          out);
    fprintf(
        out,
        ", from %d rays a sample. Corners, the undersides of eaves and the ground under trees "
        "turn darker, rooms much darker, and things stand on the ground instead of floating over "
        "it. No light is placed anywhere. Pictures of dark rooms are brightened as a whole, as "
        "eyes would do. Further down: the same scene <a href=\"#frame\">in a frame</a>, where "
        "nothing is baked.</p>\n",
        page->params.rays);
    for (int i = 1; i <= page->view_count; i++)
        figure(out, page, i);
    tables(out, page);
    commands(out, page);
    page_frame(out, page);
}

enum cranny_status page_write(const struct page *page, const char *path, struct cranny_error *why)
{
    char *html = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&html, &size);
    if (out) {
        fputs(head, out);
        body(out, page);
        fputs(tail, out);
    }
    bool good = out && !ferror(out);
    good = out && fclose(out) == 0 && good;
    enum cranny_status status = CRANNY_MEMORY;
    if (good)
        status = cranny_file_write(path, html, size, why);
    else
        snprintf(why->message, sizeof why->message, "%s: out of memory", path);
    free(html);
    return status;
}
