/* What every command shares: common options, messages, progress, interruption, JSON on stdout. */
#ifndef CLI_UI_H
#define CLI_UI_H

#include "options.h"

#include <jansson.h>

struct ui {
    bool json, quiet, verbose, help;
    struct cranny_hooks hooks; /* user is this struct */
    json_t *warnings;          /* every warning so far, NULL until there is one */
    bool draws;                /* stderr is a terminal that can erase a line */
    bool drawn;                /* a progress line is on the screen */
    char heading[96];          /* goes before the stage in the progress line */
    const char *stage;
    double stage_begin_s, drawn_s;
    const char *written;    /* an output that an interruption leaves whole, NULL: none */
    double rays_per_sample; /* of the stage "trace", which counts samples; 0: not known */
};

/* The options of struct ui. */
extern const struct option_group ui_options;

/* After the options are read. */
void ui_begin(struct ui *ui);
void ui_end(struct ui *ui);

/* Ctrl-C or a termination signal came; a second one kills. */
bool ui_interrupted(void);
void ui_catch_signals(void);

/* A progress callback that shows nothing: it only stops after an interruption. */
bool ui_goes_on(void *user, const char *stage, double done, double total);

/* What the stages from here on belong to, as in "view 2: "; their clock starts anew. */
void ui_head(struct ui *ui, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Erase the progress line, as before any other output. */
void ui_erase(struct ui *ui);

void ui_warn(struct ui *ui, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Print the error's line, as ui_fail does. */
void ui_complain(struct ui *ui, const struct cranny_error *why);

/* Print the error's line, return the exit status that belongs to it. */
int ui_fail(struct ui *ui, const struct cranny_error *why);

/* A JSON string of any bytes: what is not UTF-8 becomes '?'. */
json_t *json_text(const char *text);

/* A number, or null where JSON has none. */
json_t *json_number(double value);

/* The fields of a table as a preset file holds them, so that `.parameters` of a result is one. */
json_t *json_parameters(const struct cranny_param_table *table, const void *params);

/* The warnings so far, as an array of its own. */
json_t *json_warnings(const struct ui *ui);

/* Print one JSON object on stdout (taking the reference), or report why that failed. */
int ui_print_json(struct ui *ui, json_t *object);

/* Flush stdout; 1 with a message when it could not be written. */
int ui_finish_output(struct ui *ui);

/* "1.5 M", "12.3 k" into `text`, which is returned. */
const char *short_count(double count, char text[32]);
double clock_s(void);

#endif
