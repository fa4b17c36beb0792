#include "shell.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

void shell_word(FILE *out, const char *word)
{
    if (*word && !word[strcspn(word, " \t\r\n'\"\\$`&|;<>()*?[]#~!{}^%")]) {
        fputs(word, out);
        return;
    }
    fputc('\'', out);
    for (; *word; word++)
        if (*word == '\'')
            fputs("'\\''", out);
        else
            fputc(*word, out);
    fputc('\'', out);
}

void shell_path(FILE *out, const char *path)
{
    if (*path == '-')
        fputs("./", out);
    shell_word(out, path);
}

char *text_of_format(const char *format, ...)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    va_list args;
    va_start(args, format);
    vfprintf(out, format, args);
    va_end(args);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}
