/* What every fuzzer has: a check that ends the run, and without an engine a program that replays
 * files. Included once, by the fuzzer's source. */
#ifndef FUZZ_REPLAY_H
#define FUZZ_REPLAY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void demand(bool condition, const char *what)
{
    if (!condition) {
        fprintf(stderr, "not true: %s\n", what);
        abort();
    }
}

#ifndef FUZZ_ENGINE
#    define FUZZ_ENGINE 0
#endif
#if !FUZZ_ENGINE
#    include <dirent.h>
#    include <sys/stat.h>

static int replayed, unreadable;

/* An exact malloc, so that a sanitizer sees the first byte beyond the end. */
static void replay_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    struct stat info;
    if (!file || fstat(fileno(file), &info) != 0) {
        fprintf(stderr, "%s: cannot be opened\n", path);
        unreadable++;
        if (file)
            fclose(file);
        return;
    }
    size_t size = (size_t)info.st_size;
    uint8_t *data = malloc(size ? size : 1);
    if (data && fread(data, 1, size, file) == size) {
        printf("%s\n", path);
        fflush(stdout);
        LLVMFuzzerTestOneInput(data, size);
        replayed++;
    } else {
        unreadable++;
    }
    free(data);
    fclose(file);
}

static void replay_folder(DIR *folder, const char *path)
{
    char name[4096];
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        if (entry->d_name[0] == '.')
            continue;
        if (snprintf(name, sizeof name, "%s/%s", path, entry->d_name) < (int)sizeof name)
            replay_file(name);
        else
            unreadable++;
    }
}

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) {
        DIR *folder = opendir(argv[i]);
        if (folder) {
            replay_folder(folder, argv[i]);
            closedir(folder);
        } else {
            replay_file(argv[i]);
        }
    }
    printf("fuzz_replay: %d files, %d unreadable\n", replayed, unreadable);
    return unreadable || !replayed;
}
#endif
#endif
