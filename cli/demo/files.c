#include "files.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *path_in(const char *folder, const char *name)
{
    size_t size = strlen(folder) + strlen(name) + 2;
    char *path = malloc(size);
    if (path)
        snprintf(path, size, "%s/%s", folder, name);
    return path;
}

enum cranny_status no_memory(struct cranny_error *why)
{
    why->status = CRANNY_MEMORY;
    snprintf(why->message, sizeof why->message, "out of memory");
    return CRANNY_MEMORY;
}
