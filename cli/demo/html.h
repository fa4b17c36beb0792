/* Pieces of a page. */
#ifndef DEMO_HTML_H
#define DEMO_HTML_H

#include <stdio.h>

/* `s` as text or as an attribute in double quotes. */
void html_text(FILE *out, const char *s);

/* A shell word, quoted when it has to be. */
void html_shell_word(FILE *out, const char *s);

/* Two pictures of one size under a bar that can be dragged. */
struct split {
    const char *left_file, *right_file; /* relative to the page */
    const char *left_word, *right_word; /* in the pictures' corners */
    const char *left_alt, *right_alt;
    const char *name; /* what is seen, for the bar's label */
    int width, height;
};

void html_split(FILE *out, const struct split *split);

#endif
