#include "base/base.h"

#include <stdarg.h>

void one_line(char *text)
{
    for (char *c = text; *c; c++)
        if ((unsigned char)*c < 0x20)
            *c = ' ';
}

enum cranny_status fail(struct cranny_error *why, enum cranny_status status, const char *format,
                        ...)
{
    if (!why)
        return status;
    va_list args;
    va_start(args, format);
    vsnprintf(why->message, sizeof why->message, format, args);
    va_end(args);
    one_line(why->message);
    why->status = status;
    return status;
}

enum cranny_status fail_memory(struct cranny_error *why, const char *what)
{
    return fail(why, CRANNY_MEMORY, "%s: out of memory", what);
}

const char *cranny_version(void)
{
    return CRANNY_VERSION_TEXT;
}

const char *cranny_status_name(enum cranny_status status)
{
    switch (status) {
    case CRANNY_OK:
        return "ok";
    case CRANNY_FAILED:
        return "failed";
    case CRANNY_USAGE:
        return "usage";
    case CRANNY_INPUT:
        return "input";
    case CRANNY_MEMORY:
        return "memory";
    case CRANNY_CANCELLED:
        return "cancelled";
    }
    return "unknown";
}

int cranny_exit_status(enum cranny_status status)
{
    switch (status) {
    case CRANNY_OK:
        return 0;
    case CRANNY_FAILED:
    case CRANNY_MEMORY:
        return 1;
    case CRANNY_USAGE:
        return 2;
    case CRANNY_INPUT:
        return 3;
    case CRANNY_CANCELLED:
        return 130;
    }
    return 1;
}
