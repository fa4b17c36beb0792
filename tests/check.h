/* The tests' macros: each failed check prints both values and counts. A program that checked
 * nothing fails; 77 means skipped. Usage: CHECK…; return check_end("name"); */
#ifndef TESTS_CHECK_H
#define TESTS_CHECK_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int check_count, check_failures;

#define CHECK(condition)                                                                           \
    do {                                                                                           \
        check_count++;                                                                             \
        if (!(condition)) {                                                                        \
            check_failures++;                                                                      \
            fprintf(stderr, "%s:%d: not true: %s\n", __FILE__, __LINE__, #condition);              \
        }                                                                                          \
    } while (0)

/* With a printf message that gives the values. */
#define CHECK_MSG(condition, ...)                                                                  \
    do {                                                                                           \
        check_count++;                                                                             \
        if (!(condition)) {                                                                        \
            check_failures++;                                                                      \
            fprintf(stderr, "%s:%d: not true: %s: ", __FILE__, __LINE__, #condition);              \
            fprintf(stderr, __VA_ARGS__);                                                          \
            fputc('\n', stderr);                                                                   \
        }                                                                                          \
    } while (0)

#define CHECK_INT(actual, expected)                                                                \
    do {                                                                                           \
        long long check_a = (long long)(actual), check_e = (long long)(expected);                  \
        check_count++;                                                                             \
        if (check_a != check_e) {                                                                  \
            check_failures++;                                                                      \
            fprintf(stderr, "%s:%d: %s is %lld, expected %lld\n", __FILE__, __LINE__, #actual,     \
                    check_a, check_e);                                                             \
        }                                                                                          \
    } while (0)

#define CHECK_NEAR(actual, expected, tolerance)                                                    \
    do {                                                                                           \
        double check_a = (actual), check_e = (expected), check_t = (tolerance);                    \
        check_count++;                                                                             \
        if (!(fabs(check_a - check_e) <= check_t)) {                                               \
            check_failures++;                                                                      \
            fprintf(stderr, "%s:%d: %s is %.9g, expected %.9g +- %.3g\n", __FILE__, __LINE__,      \
                    #actual, check_a, check_e, check_t);                                           \
        }                                                                                          \
    } while (0)

/* status must be CRANNY_OK, else the error's text is shown. */
#define CHECK_OK(call, why)                                                                        \
    do {                                                                                           \
        check_count++;                                                                             \
        if ((call) != CRANNY_OK) {                                                                 \
            check_failures++;                                                                      \
            fprintf(stderr, "%s:%d: %s failed: %s\n", __FILE__, __LINE__, #call, (why).message);   \
        }                                                                                          \
    } while (0)

/* A refusal of what this build was made without is right; it is said, and the file left out. */
static inline int check_left_out(const char *message)
{
    const int lacking =
        (!CRANNY_HAVE_DRACO && strstr(message, "build Cranny with draco")) ||
        (!CRANNY_HAVE_MESHOPT && strstr(message, "build Cranny with meshoptimizer"));
    if (lacking)
        printf("SKIPPED: %s\n", message);
    return lacking;
}

static inline int check_end(const char *name)
{
    printf("%s: %d checks, %d failed\n", name, check_count, check_failures);
    return check_failures || !check_count;
}

static inline int check_skip(const char *name, const char *reason)
{
    printf("%s: SKIPPED: %s\n", name, reason);
    return 77;
}

/* The folder of real scenes, or NULL when there is none (skip then). */
static inline const char *check_scenes(void)
{
    const char *folder = getenv("CRANNY_SCENES");
    return folder && *folder ? folder : NULL;
}

#endif
