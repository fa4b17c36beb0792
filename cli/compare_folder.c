/* The folder that `compare` fills: worked at in a folder within it, moved into place at the end. */
#include "compare.h"
#include "paths.h"
#include "shell.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

char *compare_path(const struct compare *compare, const char *name)
{
    return text_of_format("%s/%s", compare->work, name);
}

enum cranny_status compare_open_folder(struct compare *compare, struct cranny_error *why)
{
    const char *cache = compare->options.cache;
    compare->folder = strdup(compare->options.output);
    compare->cache = cache ? strdup(cache) : text_of_format("%s/cache", compare->options.output);
    char *work = text_of_format("%s/.cranny-compare-XXXXXX", compare->options.output);
    enum cranny_status status = compare->folder && compare->cache && work
                                    ? CRANNY_OK
                                    : refuse(why, CRANNY_MEMORY, "out of memory for file names");
    if (status == CRANNY_OK)
        status = path_make_folder(compare->folder, "-o", &compare->made_folder, why);
    if (status == CRANNY_OK && mkdtemp(work)) {
        compare->work = work;
        return CRANNY_OK;
    }
    if (status == CRANNY_OK)
        status = refuse(why, CRANNY_FAILED,
                        "%.800s: the folder takes no new file: %s; choose another with -o",
                        compare->folder, strerror(errno));
    free(work);
    return status;
}

enum cranny_status compare_need_cache(struct compare *compare, struct cranny_error *why)
{
    bool made;
    const enum cranny_status status = path_make_folder(compare->cache, "--cache", &made, why);
    compare->made_cache |= made;
    return status;
}

static enum cranny_status move(const char *from, const char *to, struct cranny_error *why)
{
    if (!from || !to)
        return refuse(why, CRANNY_MEMORY, "out of memory for file names");
    if (rename(from, to) == 0)
        return CRANNY_OK;
    return refuse(why, CRANNY_FAILED, "%.800s: cannot be written: %s", to, strerror(errno));
}

static enum cranny_status move_into(const struct compare *compare, const char *name,
                                    const char *subfolder, struct cranny_error *why)
{
    char *from = compare_path(compare, name);
    char *to = text_of_format("%s/%s%s", compare->folder, subfolder, name);
    const enum cranny_status status = move(from, to, why);
    free(from);
    free(to);
    return status;
}

static enum cranny_status move_images(const struct compare *compare, struct cranny_error *why)
{
    DIR *work = opendir(compare->work);
    enum cranny_status status =
        work ? CRANNY_OK : refuse(why, CRANNY_FAILED, "%.800s: %s", compare->work, strerror(errno));
    for (struct dirent *entry; status == CRANNY_OK && (entry = readdir(work));) {
        char extension[9];
        path_extension(entry->d_name, extension);
        if (strcmp(extension, ".png") == 0)
            status = move_into(compare, entry->d_name, "images/", why);
    }
    if (work)
        closedir(work);
    return status;
}

/* Pictures that a results.json names, as keys; one that is missing or not ours names none. */
static json_t *pictures_of(const json_t *results)
{
    json_t *names = json_object();
    const json_t *view, *trial;
    size_t v, t;
    json_array_foreach(json_object_get(results, "views"), v, view)
    {
        const json_t *rows = json_object_get(view, "methods");
        const char *name =
            json_string_value(json_object_get(json_object_get(view, "reference"), "image"));
        json_object_set_new(names, name ? name : "", json_true());
        json_array_foreach(rows, t, trial) for (int map = 0; map < 2; map++)
        {
            name = json_string_value(json_object_get(trial, map ? "error_map" : "image"));
            json_object_set_new(names, name ? name : "", json_true());
        }
    }
    return names;
}

/* "images/001-….png": a name that picture_name gives, and no way out of the folder. */
static bool is_picture_name(const char *name)
{
    char extension[9];
    path_extension(name, extension);
    return strncmp(name, "images/", 7) == 0 && strspn(name + 7, "0123456789") >= 3 &&
           !strchr(name + 7, '/') && strcmp(extension, ".png") == 0;
}

/* What an earlier run wrote and this one has no more: by its own list, and nothing else. */
static void remove_stale(const struct compare *compare, const json_t *before, const json_t *now)
{
    json_t *old = pictures_of(before), *new = pictures_of(now), *value;
    const char *name;
    json_object_foreach(old, name, value)
    {
        char *path = is_picture_name(name) && !json_object_get(new, name)
                         ? text_of_format("%s/%s", compare->folder, name)
                         : NULL;
        if (path)
            unlink(path);
        free(path);
    }
    json_decref(old);
    json_decref(new);
}

/* The page last: it needs nothing else, and what it says is then true of the other files. */
enum cranny_status compare_fill_folder(struct compare *compare, const json_t *results,
                                       struct cranny_error *why)
{
    char *images = text_of_format("%s/images", compare->folder);
    char *earlier = text_of_format("%s/results.json", compare->folder);
    bool made;
    enum cranny_status status = images && earlier ? path_make_folder(images, "-o", &made, why)
                                                  : refuse(why, CRANNY_MEMORY, "out of memory");
    json_t *before = status == CRANNY_OK ? json_load_file(earlier, 0, NULL) : NULL;
    if (status == CRANNY_OK)
        status = move_images(compare, why);
    if (status == CRANNY_OK)
        status = move_into(compare, "results.json", "", why);
    if (status == CRANNY_OK)
        status = move_into(compare, "index.html", "", why);
    if (status == CRANNY_OK)
        remove_stale(compare, before, results);
    json_decref(before);
    free(earlier);
    free(images);
    return status;
}

static void empty_work(const struct compare *compare)
{
    DIR *work = opendir(compare->work);
    for (struct dirent *entry; work && (entry = readdir(work));) {
        char *path = compare_path(compare, entry->d_name);
        if (path && entry->d_name[0] != '.')
            unlink(path);
        free(path);
    }
    if (work)
        closedir(work);
}

void compare_close_folder(struct compare *compare)
{
    if (compare->work) {
        empty_work(compare);
        rmdir(compare->work);
    }
    /* These stay when there is something in them. */
    if (compare->made_cache)
        rmdir(compare->cache);
    if (compare->made_folder)
        rmdir(compare->folder);
    free(compare->work);
    free(compare->cache);
    free(compare->folder);
}
