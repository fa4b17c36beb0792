/* Inside the library: errors, memory, hooks, parallel loops. */
#ifndef BASE_BASE_H
#define BASE_BASE_H

#include <cranny/base.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNT_OF(array) (sizeof(array) / sizeof((array)[0]))

/* Fill `why` (when not NULL) and return `status`, so that a caller can `return fail(...)`. */
enum cranny_status fail(struct cranny_error *why, enum cranny_status status, const char *format,
                        ...) __attribute__((format(printf, 3, 4)));

/* fail() with CRANNY_MEMORY: `what` could not be allocated. */
enum cranny_status fail_memory(struct cranny_error *why, const char *what);

/* One line to the log hook; `hooks` may be NULL. */
void hook_log(const struct cranny_hooks *hooks, enum cranny_log_level level, const char *format,
              ...) __attribute__((format(printf, 3, 4)));
#define hook_warn(hooks, ...) hook_log(hooks, CRANNY_LOG_WARNING, __VA_ARGS__)

/* Report progress; false: the caller asked to stop. */
bool hook_progress(const struct cranny_hooks *hooks, const char *stage, double done, double total);

/* Control characters become spaces, so that a message stays on its line. */
void one_line(char *text);

/* Zeroed array of `count` items of `size` bytes; NULL when it does not fit (overflow included).
 * A count of 0 gives a valid pointer. Free with free(). */
void *alloc_array(size_t count, size_t size);

/* 64-byte aligned, uninitialised; free with free(). */
void *alloc_aligned(size_t count, size_t size);

/* Grow *items (of `size` bytes each) to hold at least `need`; doubles. False when it does not fit;
 * *items stays valid. New items are zeroed. */
bool grow_array(void **items, size_t *capacity, size_t need, size_t size);

/* strdup that takes NULL as "". */
char *copy_text(const char *text);

/* The whole file. `limit`: refuse more bytes than this. *data is malloced, with a 0 after the end.
 */
enum cranny_status file_read(const char *path, uint64_t limit, uint8_t **data, size_t *size,
                             struct cranny_error *why);

/* Write to a temporary file beside `path`, flush, rename. Nothing is left behind on failure, and
 * an older file at `path` stays as it was. Parts are written one after the other. */
struct file_part {
    const void *data;
    size_t size;
};
enum cranny_status file_write(const char *path, const struct file_part *parts, size_t part_count,
                              struct cranny_error *why);

/* Seconds of a monotonic clock, for reports only. */
double seconds_now(void);

/* Threads to use for a `threads` parameter: 0 means all cores. */
int thread_count(int threads);

/* The row of that name; NULL: there is none. */
const struct cranny_param *param_find(const struct cranny_param_table *table, const char *name);

/* A field's value; a choice's number from 0 on. Storing checks no range. */
double param_load(const struct cranny_param *row, const void *params);
void param_store(const struct cranny_param *row, void *params, double value);

static inline int min_int(int a, int b)
{
    return a < b ? a : b;
}
static inline int max_int(int a, int b)
{
    return a > b ? a : b;
}
static inline float clamp_float(float x, float low, float high)
{
    return x < low ? low : x > high ? high : x;
}

#endif
