#include "page.h"

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
    ".split{position:relative;overflow:hidden;border-radius:6px;line-height:0;--at:50%}\n"
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
    "table{border-collapse:collapse;font-variant-numeric:tabular-nums;width:100%;max-width:34rem}\n"
    "th,td{text-align:left;font-weight:400;padding:.3rem .2rem;border-bottom:1px solid "
    "var(--line)}\n"
    "td{text-align:right}th{color:var(--soft)}\n"
    "pre{overflow-x:auto;padding:.9rem 1rem;border:1px solid "
    "var(--line);border-radius:6px;font-size:.9rem}\n"
    "@media print{:root{--ink:#000;--soft:#444;--paper:#fff}body{font-size:10pt}"
    ".split{display:grid;grid-template-columns:1fr 1fr;gap:4px;overflow:visible}"
    ".split .after{position:static;clip-path:none}.split .bar,.split input{display:none}"
    ".word.right{right:.7rem}.word.left{left:.7rem}figure{break-inside:avoid}}\n"
    "</style>\n";

static const char tail[] = "<script>\n"
                           "for (const slider of document.querySelectorAll('.split input'))\n"
                           "  slider.addEventListener('input', () =>\n"
                           "    slider.parentNode.style.setProperty('--at', slider.value + '%'));\n"
                           "</script>\n</main>\n</html>\n";

static void text(FILE *out, const char *s)
{
    for (; *s; s++) {
        if (*s == '<')
            fputs("&lt;", out);
        else if (*s == '&')
            fputs("&amp;", out);
        else if (*s == '"')
            fputs("&quot;", out);
        else
            fputc(*s, out);
    }
}

/* A shell word, quoted when it has to be. */
static void shell_word(FILE *out, const char *s)
{
    bool plain = *s != 0;
    for (const char *c = s; *c; c++)
        plain = plain &&
                (*c == '/' || *c == '.' || *c == '-' || *c == '_' || (*c >= '0' && *c <= '9') ||
                 (*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z'));
    if (!plain)
        fputc('\'', out);
    for (; *s; s++) {
        const char one[2] = {*s, 0};
        text(out, *s == '\'' ? "'\\''" : one);
    }
    if (!plain)
        fputc('\'', out);
}

static void figure(FILE *out, const struct page *page, int number)
{
    const char *name = page->view_names[number - 1];
    fprintf(out,
            "<figure>\n<div class=\"split\">\n"
            "<img src=\"before-%d.png\" width=\"%d\" height=\"%d\" alt=\"Before: clay without "
            "occlusion\">\n"
            "<img class=\"after\" src=\"after-%d.png\" width=\"%d\" height=\"%d\" alt=\"After: the "
            "same "
            "with baked visibility\">\n"
            "<span class=\"word left\">before</span><span class=\"word right\">after</span>"
            "<span class=\"bar\"></span>\n"
            "<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" step=\"1\" "
            "aria-label=\"Where before "
            "ends and after begins: ",
            number, page->width, page->height, number, page->width, page->height);
    text(out, name);
    fputs("\">\n</div>\n<figcaption>", out);
    text(out, name);
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
    number_row(out, "write the file", "%.2f s", page->seconds_write);
    number_row(out, "in all, without the pictures", "%.2f s", page->seconds_total);
    fputs("</table>\n", out);
}

static void commands(FILE *out, const struct page *page)
{
    fputs("<h2>Do it yourself</h2>\n<pre>cranny bake ", out);
    shell_word(out, page->scene_path);
    fprintf(out, " --set rays=%d -o ", page->params.rays);
    shell_word(out, page->output_name);
    fputs("\ncranny-demo ", out);
    shell_word(out, page->scene_path);
    fprintf(out, " --rays %d -o ", page->params.rays);
    shell_word(out, page->folder);
    fputs("   # this page</pre>\n<p>The baked file is <a href=\"", out);
    text(out, page->output_name);
    fputs("\">", out);
    text(out, page->output_name);
    fputs("</a>: drop it into any glTF viewer.</p>\n", out);
}

static void body(FILE *out, const struct page *page)
{
    fputs("<title>Baked: ", out);
    text(out, page->scene_name);
    fputs("</title>\n<main>\n<h1>", out);
    text(out, page->scene_name);
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
        "eyes would do.</p>\n",
        page->params.rays);
    for (int i = 1; i <= page->view_count; i++)
        figure(out, page, i);
    tables(out, page);
    commands(out, page);
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
