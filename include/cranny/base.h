/* Status codes, error texts, callbacks and parameter tables shared by every part of Cranny. */
#ifndef CRANNY_BASE_H
#define CRANNY_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#    define CRANNY_API __attribute__((visibility("default")))
#else
#    define CRANNY_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define CRANNY_VERSION_MAJOR 0
#define CRANNY_VERSION_MINOR 1
#define CRANNY_VERSION_PATCH 0
#define CRANNY_VERSION_TEXT "0.1.0"

/* What every fallible function returns. cranny_exit_status says what a
 * program exits with. */
enum cranny_status {
    CRANNY_OK = 0,
    CRANNY_FAILED,    /* the system refused something: disk full, device lost */
    CRANNY_USAGE,     /* an argument is out of range or makes no sense */
    CRANNY_INPUT,     /* a file, buffer or scene handed in is broken or not supported */
    CRANNY_MEMORY,    /* an allocation failed, or the input needs more than the limit given */
    CRANNY_CANCELLED, /* the progress callback asked to stop */
};

#define CRANNY_ERROR_TEXT_SIZE 1024

/* Filled on failure when passed. `message` is one line, UTF-8, zero-terminated, without a final
 * newline: what, where (file, JSON pointer, byte), and what to do. Untouched on success. */
struct cranny_error {
    enum cranny_status status;
    char message[CRANNY_ERROR_TEXT_SIZE];
};

/* How much a line of the log matters; warnings are worth showing to everyone. */
enum cranny_log_level { CRANNY_LOG_WARNING, CRANNY_LOG_INFO, CRANNY_LOG_DEBUG };

/* Callbacks of a caller; each may be NULL. They are called from the thread that called the
 * library, never from workers, and must not call back into the same object.
 * `log`: one line, no newline.
 * `progress`: `stage` is a short word ("trace"); `done` of `total` units, monotonic within a stage;
 * returning false cancels: the call in progress cleans up and returns CRANNY_CANCELLED. */
struct cranny_hooks {
    void *user;
    void (*log)(void *user, enum cranny_log_level level, const char *line);
    bool (*progress)(void *user, const char *stage, double done, double total);
};

/* What the field of a parameter holds. */
enum cranny_param_type {
    CRANNY_PARAM_FLOAT, /* field is float */
    CRANNY_PARAM_INT,   /* field is int */
    CRANNY_PARAM_BOOL,  /* field is bool; 0 or 1 in the table */
    CRANNY_PARAM_ENUM,  /* field is int; `choices` names its values from 0 on */
};

/* One parameter: the only place where its name, range and default are written. */
struct cranny_param {
    const char *name; /* as in --set NAME=VALUE and in preset files, snake_case */
    enum cranny_param_type type;
    size_t offset;    /* of the field in the parameter struct */
    const char *unit; /* "m", "rays", "" */
    double minimum, maximum, fallback;
    const char *const *choices; /* CRANNY_PARAM_ENUM: NULL-terminated names; else NULL */
    const char *help;           /* one sentence, lower case first letter, no full stop */
    double step; /* a change worth trying when the field is fitted to the truth (cranny/tune.h); 0:
                    it is fitted only where somebody names it */
};

/* All parameters of one params struct, in the order in which to show them. */
struct cranny_param_table {
    const char *name; /* "bake" */
    const struct cranny_param *rows;
    size_t row_count;
};

/* Set every field that the table describes to its default. `params` is the struct whose offsets
 * the rows hold; other fields are left alone. */
CRANNY_API void cranny_params_defaults(const struct cranny_param_table *table, void *params);

/* Set one field from text ("64", "true", "exponential"). CRANNY_USAGE when the name is not in the
 * table, the text does not parse, or the value is out of range; the field then keeps its value. */
CRANNY_API enum cranny_status cranny_params_set(const struct cranny_param_table *table,
                                                void *params, const char *name, const char *text,
                                                struct cranny_error *why);

/* Write a field as text that cranny_params_set reads back to the same value. Returns the length,
 * like snprintf; 0 when the name is not in the table. */
CRANNY_API size_t cranny_params_get(const struct cranny_param_table *table, const void *params,
                                    const char *name, char *text, size_t text_size);

/* CRANNY_USAGE, naming the first field that is NaN or outside its row's range. */
CRANNY_API enum cranny_status cranny_params_validate(const struct cranny_param_table *table,
                                                     const void *params, struct cranny_error *why);

/* Apply a preset file: a JSON object of name: value pairs; a member "method", when there is one,
 * must be the table's name. CRANNY_INPUT when it cannot be read. */
CRANNY_API enum cranny_status cranny_params_load(const struct cranny_param_table *table,
                                                 void *params, const char *path,
                                                 struct cranny_error *why);

/* The library's version, "major.minor.patch". */
CRANNY_API const char *cranny_version(void);

/* A word for a status: "ok", "failed", "usage", "input", "memory", "cancelled". */
CRANNY_API const char *cranny_status_name(enum cranny_status status);

/* What a program exits with for a status: 0 done, 1 failed or out of memory, 2 wrong usage, 3 bad
 * input, 130 cancelled. */
CRANNY_API int cranny_exit_status(enum cranny_status status);

/* Write 8-bit pixels as PNG; the file appears whole or not at all. `channels` 1 (grey), 3 (RGB) or
 * 4 (RGBA); rows top to bottom, `stride` bytes apart. CRANNY_FAILED when it cannot be written. */
CRANNY_API enum cranny_status cranny_png_write(const char *path, int width, int height,
                                               int channels, const uint8_t *pixels, size_t stride,
                                               struct cranny_error *why);

/* Write `size` bytes to `path`; the file appears whole or not at all (temporary file, then rename).
 * `data` may be NULL when `size` is 0. CRANNY_FAILED when it cannot be written. */
CRANNY_API enum cranny_status cranny_file_write(const char *path, const void *data, size_t size,
                                                struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
