#include "paths.h"

#include "options.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

const char *path_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

void path_extension(const char *path, char extension[9])
{
    const char *name = path_name(path), *dot = strrchr(name, '.');
    extension[0] = 0;
    if (!dot || dot == name || strlen(dot) > 8)
        return;
    size_t i = 0;
    for (; dot[i]; i++)
        extension[i] = (char)tolower((unsigned char)dot[i]);
    extension[i] = 0;
}

char *path_default_output(const char *input, const char *ending)
{
    const char *dot = strrchr(path_name(input), '.');
    size_t stem = dot && dot != path_name(input) ? (size_t)(dot - input) : strlen(input);
    char *output = malloc(stem + strlen(ending) + 1);
    if (output) {
        memcpy(output, input, stem);
        strcpy(output + stem, ending);
    }
    return output;
}

enum cranny_status path_check_extension(const char *path, const char *const *allowed,
                                        const char *option, struct cranny_error *why)
{
    char extension[9], list[64] = "";
    path_extension(path, extension);
    for (size_t i = 0; allowed[i]; i++) {
        if (strcmp(extension, allowed[i]) == 0)
            return CRANNY_OK;
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? " or " : "", allowed[i]);
    }
    return refuse(why, CRANNY_USAGE, "%.900s: %s takes a name that ends in %s", path, option, list);
}

bool path_same_file(const char *a, const char *b)
{
    struct stat first, second;
    return stat(a, &first) == 0 && stat(b, &second) == 0 && first.st_dev == second.st_dev &&
           first.st_ino == second.st_ino;
}

/* Only creating a file tells: rights, read-only mounts and quotas all have their say. */
static enum cranny_status probe_folder(const char *path, size_t folder_length,
                                       struct cranny_error *why)
{
    static const char name[] = ".cranny-probe-XXXXXX";
    char *probe = malloc(folder_length + sizeof name);
    if (!probe)
        return refuse(why, CRANNY_MEMORY, "%.900s: out of memory", path);
    memcpy(probe, path, folder_length);
    memcpy(probe + folder_length, name, sizeof name);
    int file = mkstemp(probe);
    int problem = errno;
    if (file >= 0) {
        close(file);
        unlink(probe);
    }
    free(probe);
    if (file >= 0)
        return CRANNY_OK;
    return refuse(why, CRANNY_FAILED,
                  "%.900s: the folder takes no new file: %s; choose another with -o", path,
                  strerror(problem));
}

enum cranny_status path_check_output(const char *path, struct cranny_error *why)
{
    struct stat info;
    if (stat(path, &info) == 0 && S_ISDIR(info.st_mode))
        return refuse(why, CRANNY_FAILED, "%.900s: is a folder; name a file in it", path);
    size_t folder_length = (size_t)(path_name(path) - path);
    char *folder = folder_length ? strndup(path, folder_length) : strdup(".");
    if (!folder)
        return refuse(why, CRANNY_MEMORY, "%.900s: out of memory", path);
    bool is_folder = stat(folder, &info) == 0 && S_ISDIR(info.st_mode);
    free(folder);
    if (!is_folder)
        return refuse(why, CRANNY_FAILED, "%.900s: its folder does not exist; make it first", path);
    return probe_folder(path, folder_length, why);
}

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

enum cranny_status path_make_folder(const char *path, const char *option, bool *made,
                                    struct cranny_error *why)
{
    *made = mkdir(path, 0777) == 0;
    if (*made || is_folder(path))
        return CRANNY_OK;
    return refuse(why, CRANNY_FAILED, "%.800s: cannot be a folder: %s; choose another with %s",
                  path, strerror(errno), option);
}
