/* For the tests of the command: run it, look at what it said and what it left in its folder. */
#ifndef TESTS_COMMAND_H
#define TESTS_COMMAND_H

#include "check.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

struct result {
    int exit;
    char *out, *err;
    size_t out_size, err_size;
};

static inline char *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    char *text = calloc(1, 1);
    *size = 0;
    for (size_t got = 1; file && got;) {
        text = realloc(text, *size + 65537);
        got = fread(text + *size, 1, 65536, file);
        *size += got;
        text[*size] = 0;
    }
    if (file)
        fclose(file);
    return text;
}

static inline void write_file(const char *path, const void *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    CHECK(file && fwrite(data, 1, size, file) == size);
    if (file)
        fclose(file);
}

/* Starts the command with its arguments, the output in .out and .err of the folder it runs in. */
static inline pid_t start(rlim_t file_limit, int err, char **args)
{
    pid_t child = fork();
    if (child)
        return child;
    int out = open(".out", O_CREAT | O_TRUNC | O_WRONLY, 0600);
    if (err < 0)
        err = open(".err", O_CREAT | O_TRUNC | O_WRONLY, 0600);
    dup2(out, 1);
    dup2(err, 2);
    struct rlimit limit = {file_limit, file_limit};
    if (file_limit != RLIM_INFINITY)
        setrlimit(RLIMIT_FSIZE, &limit);
    execv(COMMAND, args);
    _exit(127);
}

static inline int wait_exit(pid_t child)
{
    int status;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

enum { ARGUMENT_LIMIT = 40 };

static inline struct result run_list(rlim_t file_limit, const char *first, va_list list)
{
    char *args[ARGUMENT_LIMIT] = {(char *)"cranny", (char *)first};
    int count = 2;
    while (first && count < ARGUMENT_LIMIT - 1 && (args[count] = va_arg(list, char *)))
        count++;
    struct result result = {.exit = wait_exit(start(file_limit, -1, args))};
    result.out = read_file(".out", &result.out_size);
    result.err = read_file(".err", &result.err_size);
    unlink(".out");
    unlink(".err");
    return result;
}

static inline struct result run(const char *first, ...)
{
    va_list list;
    va_start(list, first);
    struct result result = run_list(RLIM_INFINITY, first, list);
    va_end(list);
    return result;
}

/* As on a disk that is full after four kilobytes. */
static inline struct result run_full(const char *first, ...)
{
    va_list list;
    va_start(list, first);
    struct result result = run_list(4096, first, list);
    va_end(list);
    return result;
}

static inline void done(struct result *result)
{
    free(result->out);
    free(result->err);
}

static inline int line_count(const char *text)
{
    int count = 0;
    for (; *text; text++)
        count += *text == '\n';
    return count;
}

#define CHECK_EXIT(result, expected)                                                               \
    CHECK_MSG((result).exit == (expected), "exit %d, expected %d; stderr: %s", (result).exit,      \
              expected, (result).err)
#define CHECK_TEXT(text, part) CHECK_MSG(strstr(text, part), "no '%s' in: %s", part, text)

/* Fails with `expected`, nothing on stdout, one line on stderr that names `part`. */
static inline void check_failure(struct result result, int expected, const char *part)
{
    CHECK_EXIT(result, expected);
    CHECK_MSG(result.out_size == 0, "stdout: %s", result.out);
    CHECK_MSG(line_count(result.err) == 1, "stderr: %s", result.err);
    CHECK_TEXT(result.err, "cranny: ");
    CHECK_TEXT(result.err, part);
    done(&result);
}

static inline double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Started with `args` and interrupted after a while, it stops soon and says `words`. */
static inline void check_interrupt(char **args, long after_ms, const char *words)
{
    pid_t child = start(RLIM_INFINITY, -1, args);
    nanosleep(&(struct timespec){0, after_ms * 1000000}, NULL);
    const double sent_s = now_s();
    CHECK(waitpid(child, NULL, WNOHANG) == 0);
    kill(child, SIGINT);
    CHECK_INT(wait_exit(child), 130);
    CHECK_MSG(now_s() - sent_s < 5, "%.1f s to stop", now_s() - sent_s);
    size_t size;
    char *err = read_file(".err", &size);
    CHECK_TEXT(err, words);
    free(err);
    unlink(".out");
    unlink(".err");
}

/* Names in the current folder but the captured output's, each between slashes. */
static inline void list_folder(char *names, size_t size)
{
    DIR *folder = opendir(".");
    size_t count = 0;
    char *sorted[64];
    for (struct dirent *entry; (entry = readdir(folder)) && count < 64;)
        if (strcmp(entry->d_name, ".out") && strcmp(entry->d_name, ".err"))
            sorted[count++] = strdup(entry->d_name);
    closedir(folder);
    names[0] = 0;
    for (size_t i = 0; i < count; i++) {
        for (size_t j = i + 1; j < count; j++)
            if (strcmp(sorted[j], sorted[i]) < 0) {
                char *swapped = sorted[i];
                sorted[i] = sorted[j];
                sorted[j] = swapped;
            }
        snprintf(names + strlen(names), size - strlen(names), "/%s", sorted[i]);
        free(sorted[i]);
    }
}

static inline void clear_folder(void)
{
    DIR *folder = opendir(".");
    for (struct dirent *entry; (entry = readdir(folder));)
        if (entry->d_name[0] != '.' || entry->d_name[1] == 'c')
            remove(entry->d_name);
    closedir(folder);
}

static inline bool same_files(const char *a, const char *b)
{
    size_t a_size, b_size;
    char *a_data = read_file(a, &a_size), *b_data = read_file(b, &b_size);
    bool same = a_size == b_size && memcmp(a_data, b_data, a_size) == 0;
    free(a_data);
    free(b_data);
    return same;
}

#endif
