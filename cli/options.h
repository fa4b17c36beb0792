/* Command-line options as tables: parsing, help texts and hints all come from the same rows. */
#ifndef CLI_OPTIONS_H
#define CLI_OPTIONS_H

#include <cranny/gbuffer.h>
#include <stdio.h>

enum option_type {
    OPTION_FLAG,     /* field is bool */
    OPTION_TEXT,     /* field is const char * */
    OPTION_OPTIONAL, /* field is const char *; "" when the option came without =VALUE */
    OPTION_INT,      /* field is int */
    OPTION_NUMBER,   /* field is double */
    OPTION_CHOICE,   /* field is int; `choices` names its values from 0 on */
    OPTION_BYTES,    /* field is uint64_t; takes K, M, G, T (powers of 1024) */
    OPTION_SIZE,     /* field is int[2]; WIDTHxHEIGHT */
    OPTION_POSITIVE, /* field is double; above 0, "inf" too */
    OPTION_VECTOR,   /* field is double[3]; X,Y,Z */
    OPTION_RECT,     /* field is struct cranny_rect; X,Y,WIDTH,HEIGHT in pixels */
    OPTION_LIST,     /* field is struct option_list; may be given again and again */
};

enum { OPTION_LIST_LIMIT = 128 };

/* Texts as given, each with the number of operands before it. */
struct option_list {
    struct {
        const char *text;
        size_t operands;
    } items[OPTION_LIST_LIMIT];
    size_t count;
};

struct option {
    const char *name; /* without the dashes */
    char letter;      /* 0: none */
    enum option_type type;
    size_t offset;     /* of the field in the group's target */
    const char *value; /* its name in the help; NULL for flags and choices */
    int minimum, maximum;
    const char *const *choices;
    const char *help; /* one sentence, lower case first letter, no full stop */
};

struct option_group {
    const char *title;
    const struct option *rows;
    size_t row_count;
    void *target;
};

enum { OPTION_GIVEN_LIMIT = 96 };

/* A command's whole interface. Each row of `table` is an option too (--rays N, --no-adaptive), and
 * with it come --set NAME=VALUE and --preset FILE. */
struct interface {
    const char *command; /* "bake" */
    const char *usage;   /* "SCENE [-o OUT]" */
    const char *summary; /* paragraphs of the help; newlines are kept */
    const char *examples;
    const struct option_group *groups;
    size_t group_count;
    const struct cranny_param_table *table; /* NULL: none */
    void *params;                           /* set to the defaults by the caller */
    const char *const *presets;             /* names that --preset takes, too; NULL: none */
    enum cranny_status (*apply_preset)(void *params, const char *name, struct cranny_error *why);
    const char **operands;
    size_t operand_limit;
    size_t operand_minimum;     /* 0 is 1 */
    const char *lacking;        /* said when there are fewer; NULL: "no scene given" */
    const char *const *instead; /* a text option that takes the operands' place when it is given;
                                   NULL: none */
    /* filled by options_parse */
    size_t operand_count;
    const char *preset;                    /* the last one given, NULL: none */
    const char *given[OPTION_GIVEN_LIMIT]; /* names of options and rows, each once */
    size_t given_count;
};

/* Read the arguments after the command's name. Preset files are applied first, then everything else
 * in its order. CRANNY_USAGE with one line that hints at the nearest option; CRANNY_INPUT for a
 * preset file that cannot be read. */
enum cranny_status options_parse(struct interface *face, int argc, char **argv,
                                 struct cranny_error *why);

/* Was the option, or the row of the table, on the command line? */
bool option_given(const struct interface *face, const char *name);

/* CRANNY_USAGE when an option of the group, from row `first` on, is on the command line;
 * `goes_with` says what it would need. */
enum cranny_status options_refuse(const struct interface *face, const struct option_group *group,
                                  size_t first, const char *goes_with, struct cranny_error *why);

/* The shorter name that a row of a table has as an option; NULL: none. */
const char *option_alias(const char *name);

void options_help(const struct interface *face, FILE *out);

/* A column of docs/parameters.md: what `params` holds. */
struct option_column {
    const char *title;
    const void *params;
};

/* docs/parameters.md's table for the rows of `table`. */
void options_markdown(const struct cranny_param_table *table, const struct option_column *columns,
                      size_t column_count, FILE *out);

/* The nearest of `names` to a mistyped word; NULL when none is near. */
const char *nearest_name(const char *word, const char *const *names, size_t count);

/* Fill `why` and return `status`. */
enum cranny_status refuse(struct cranny_error *why, enum cranny_status status, const char *format,
                          ...) __attribute__((format(printf, 3, 4)));

#endif
