/* Walking the folder of real scenes, and throwaway folders. */
#ifndef TESTS_SCENE_FILES_H
#define TESTS_SCENE_FILES_H

#include "check.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

static inline char *join_path(const char *folder, const char *name)
{
    char *path;
    return asprintf(&path, "%s/%s", folder, name) < 0 ? NULL : path;
}

typedef void visit_file(const char *path, void *user);

static inline void visit_folder(const char *folder, visit_file *visit, void *user)
{
    struct dirent **entries;
    const int count = scandir(folder, &entries, NULL, alphasort);
    for (int i = 0; i < count; i++) {
        struct stat info;
        char *path = join_path(folder, entries[i]->d_name);
        const char *dot = strrchr(entries[i]->d_name, '.');
        if (entries[i]->d_name[0] != '.' && stat(path, &info) == 0 && S_ISDIR(info.st_mode))
            visit_folder(path, visit, user);
        else if (dot && (strcmp(dot, ".glb") == 0 || strcmp(dot, ".gltf") == 0))
            visit(path, user);
        free(path);
        free(entries[i]);
    }
    if (count >= 0)
        free(entries);
}

/* Every .glb and .gltf below a folder of the real scenes. */
static inline void walk_scenes(const char *below, visit_file *visit, void *user)
{
    char *folder = join_path(check_scenes(), below);
    visit_folder(folder, visit, user);
    free(folder);
}

static inline void make_folder(const char *path)
{
    CHECK_MSG(mkdir(path, 0777) == 0, "%s cannot be made", path);
}

/* An empty folder in memory where there is such a place: the tests write thousands of files. */
static inline char *scratch_folder(void)
{
    char *path = join_path(access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp", "cranny-XXXXXX");
    return path ? mkdtemp(path) : NULL;
}

static inline void remove_folder(const char *folder)
{
    DIR *open_folder = opendir(folder);
    for (struct dirent *entry; open_folder && (entry = readdir(open_folder));) {
        struct stat info;
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        char *path = join_path(folder, entry->d_name);
        if (lstat(path, &info) == 0 && S_ISDIR(info.st_mode))
            remove_folder(path);
        else
            unlink(path);
        free(path);
    }
    if (open_folder)
        closedir(open_folder);
    rmdir(folder);
}

#endif
