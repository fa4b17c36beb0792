#include "base/base.h"

#include <stdarg.h>

void hook_log(const struct cranny_hooks *hooks, enum cranny_log_level level, const char *format,
              ...)
{
    if (!hooks || !hooks->log)
        return;
    char line[CRANNY_ERROR_TEXT_SIZE];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    one_line(line);
    hooks->log(hooks->user, level, line);
}

bool hook_progress(const struct cranny_hooks *hooks, const char *stage, double done, double total)
{
    if (!hooks || !hooks->progress)
        return true;
    return hooks->progress(hooks->user, stage, done, total);
}
