/* Command lines to show, that a shell reads back as they were. */
#ifndef CLI_SHELL_H
#define CLI_SHELL_H

#include <stdio.h>

/* A word, in quotes where it needs them. */
void shell_word(FILE *out, const char *word);

/* A path: the same, and never taken for an option. */
void shell_path(FILE *out, const char *path);

/* printf into a malloced text; NULL without memory. */
char *text_of_format(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
