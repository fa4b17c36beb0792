#include "html.h"

#include <stdbool.h>

void html_text(FILE *out, const char *s)
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

void html_shell_word(FILE *out, const char *s)
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
        html_text(out, *s == '\'' ? "'\\''" : one);
    }
    if (!plain)
        fputc('\'', out);
}

static void picture(FILE *out, const char *class, const char *file, const char *alt,
                    const struct split *split)
{
    fprintf(out, "<img%s src=\"", class);
    html_text(out, file);
    fprintf(out, "\" width=\"%d\" height=\"%d\" alt=\"", split->width, split->height);
    html_text(out, alt);
    fputs("\">\n", out);
}

void html_split(FILE *out, const struct split *split)
{
    fputs("<div class=\"split\">\n", out);
    picture(out, "", split->left_file, split->left_alt, split);
    picture(out, " class=\"after\"", split->right_file, split->right_alt, split);
    fprintf(out,
            "<span class=\"word left\">%s</span><span class=\"word right\">%s</span>"
            "<span class=\"bar\"></span>\n"
            "<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" step=\"1\" "
            "aria-label=\"Where %s ends and %s begins: ",
            split->left_word, split->right_word, split->left_word, split->right_word);
    html_text(out, split->name);
    fputs("\">\n</div>\n", out);
}
