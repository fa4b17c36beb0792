/* Output paths: the default beside the input, and whether writing there can work. */
#ifndef CLI_PATHS_H
#define CLI_PATHS_H

#include <cranny/base.h>

/* The path's last part. */
const char *path_name(const char *path);

/* The file's extension with its dot, lower case, at most 7 letters; "" when it has none. */
void path_extension(const char *path, char extension[9]);

/* `input` with `ending` ("-ao.png") in its extension's place. Malloced; NULL without memory. */
char *path_default_output(const char *input, const char *ending);

/* CRANNY_USAGE unless `path` ends in one of the NULL-terminated extensions; `option` is what it was
 * given to. */
enum cranny_status path_check_extension(const char *path, const char *const *allowed,
                                        const char *option, struct cranny_error *why);

/* Do both exist and are one file? */
bool path_same_file(const char *a, const char *b);

/* CRANNY_FAILED when `path` cannot become a file: its folder is missing, is no folder, or does not
 * take new files. Asked before the work begins, so that nobody waits for nothing. */
enum cranny_status path_check_output(const char *path, struct cranny_error *why);

/* Make a folder unless there is one; `made`: there was none. CRANNY_FAILED, naming the option to
 * choose another with. */
enum cranny_status path_make_folder(const char *path, const char *option, bool *made,
                                    struct cranny_error *why);

#endif
