#include "ui.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const struct option common_rows[] = {
    {.name = "json",
     .type = OPTION_FLAG,
     .offset = offsetof(struct ui, json),
     .help = "print one JSON object on stdout and nothing else there"},
    {.name = "quiet",
     .letter = 'q',
     .type = OPTION_FLAG,
     .offset = offsetof(struct ui, quiet),
     .help = "no progress, no warnings, no summary; errors remain"},
    {.name = "verbose",
     .letter = 'v',
     .type = OPTION_FLAG,
     .offset = offsetof(struct ui, verbose),
     .help = "say more on stderr"},
    {.name = "help",
     .letter = 'h',
     .type = OPTION_FLAG,
     .offset = offsetof(struct ui, help),
     .help = "this text"},
};

/* `target` is set by each command. */
const struct option_group ui_options = {"Common", common_rows,
                                        sizeof common_rows / sizeof *common_rows, NULL};

static volatile sig_atomic_t interrupted;

static void on_signal(int number)
{
    (void)number;
    interrupted = 1;
}

void ui_catch_signals(void)
{
    struct sigaction stop = {.sa_handler = on_signal, .sa_flags = (int)SA_RESETHAND};
    struct sigaction ignore = {.sa_handler = SIG_IGN};
    struct sigaction old;
    /* A job started with '&' by a script ignores SIGINT; that choice is kept. */
    if (sigaction(SIGINT, NULL, &old) == 0 && old.sa_handler != SIG_IGN)
        sigaction(SIGINT, &stop, NULL);
    sigaction(SIGTERM, &stop, NULL);
    sigaction(SIGHUP, &stop, NULL);
    sigaction(SIGPIPE, &ignore, NULL);
    /* Then a file above the size limit is a failed write, with its message and clean-up. */
    sigaction(SIGXFSZ, &ignore, NULL);
}

bool ui_interrupted(void)
{
    return interrupted;
}

bool ui_goes_on(void *user, const char *stage, double done, double total)
{
    (void)user;
    (void)stage;
    (void)done;
    (void)total;
    return !ui_interrupted();
}

double clock_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

const char *short_count(double count, char text[32])
{
    if (count < 1e4)
        snprintf(text, 32, "%.0f", count);
    else if (count < 1e6)
        snprintf(text, 32, "%.1f k", count * 1e-3);
    else if (count < 1e9)
        snprintf(text, 32, "%.2f M", count * 1e-6);
    else
        snprintf(text, 32, "%.2f G", count * 1e-9);
    return text;
}

void ui_erase(struct ui *ui)
{
    if (ui->drawn)
        fputs("\r\x1b[K", stderr);
    ui->drawn = false;
}

json_t *json_text(const char *text)
{
    json_t *string = json_string(text);
    char *ascii = string ? NULL : strdup(text);
    if (string || !ascii)
        return string;
    for (char *c = ascii; *c; c++)
        if ((unsigned char)*c >= 0x80)
            *c = '?';
    string = json_string(ascii);
    free(ascii);
    return string;
}

json_t *json_number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static json_t *parameter_json(const struct cranny_param_table *table,
                              const struct cranny_param *row, const void *params)
{
    char text[64];
    cranny_params_get(table, params, row->name, text, sizeof text);
    switch (row->type) {
    case CRANNY_PARAM_FLOAT:
        return json_number(strtod(text, NULL));
    case CRANNY_PARAM_INT:
        return json_integer(atoll(text));
    case CRANNY_PARAM_BOOL:
        return json_boolean(strcmp(text, "true") == 0);
    case CRANNY_PARAM_ENUM:
        return json_string(text);
    }
    return json_null();
}

json_t *json_parameters(const struct cranny_param_table *table, const void *params)
{
    json_t *object = json_object();
    for (size_t i = 0; i < table->row_count; i++)
        json_object_set_new(object, table->rows[i].name,
                            parameter_json(table, &table->rows[i], params));
    return object;
}

json_t *json_warnings(const struct ui *ui)
{
    return ui->warnings ? json_copy(ui->warnings) : json_array();
}

static void on_log(void *user, enum cranny_log_level level, const char *line)
{
    struct ui *ui = user;
    switch (level) {
    case CRANNY_LOG_WARNING:
        if (!ui->warnings)
            ui->warnings = json_array();
        json_array_append_new(ui->warnings, json_text(line));
        if (ui->quiet)
            return;
        ui_erase(ui);
        fprintf(stderr, "cranny: warning: %s\n", line);
        return;
    case CRANNY_LOG_INFO:
    case CRANNY_LOG_DEBUG:
        if (!ui->verbose)
            return;
        ui_erase(ui);
        fprintf(stderr, "cranny: %s\n", line);
        return;
    }
}

void ui_warn(struct ui *ui, const char *format, ...)
{
    char line[CRANNY_ERROR_TEXT_SIZE];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    on_log(ui, CRANNY_LOG_WARNING, line);
}

static void draw(struct ui *ui, const char *stage, double done, double total, double now_s)
{
    double share = total > 0 ? done / total : 0;
    double spent_s = now_s - ui->stage_begin_s;
    char rate[32] = "", left[48] = "";
    if (ui->rays_per_sample > 0 && strcmp(stage, "trace") == 0 && spent_s > 0)
        snprintf(rate, sizeof rate, "  %.1f Mrays/s", done * ui->rays_per_sample / spent_s * 1e-6);
    else if (strcmp(stage, "fit") == 0 && spent_s > 0)
        snprintf(rate, sizeof rate, "  %.1f views/s", done / spent_s);
    double left_s = share > 0 ? spent_s * (1 - share) / share : 0;
    if (spent_s > 0.5 && share > 0)
        snprintf(left, sizeof left, left_s < 90 ? "  %.0f s left" : "  %.0f min left",
                 left_s < 90 ? ceil(left_s) : ceil(left_s / 60));
    fprintf(stderr, "\rcranny: %s%-8s %3.0f %%%s%s\x1b[K", ui->heading, stage, floor(share * 100),
            rate, left);
    fflush(stderr);
    ui->drawn = true;
    ui->drawn_s = now_s;
}

static bool on_progress(void *user, const char *stage, double done, double total)
{
    struct ui *ui = user;
    if (ui_interrupted())
        return false;
    if (!ui->draws)
        return true;
    double now_s = clock_s();
    if (!ui->stage || strcmp(ui->stage, stage) != 0) {
        ui->stage = stage;
        ui->stage_begin_s = now_s;
        ui->drawn_s = 0;
    }
    if (now_s - ui->drawn_s >= 0.1)
        draw(ui, stage, done, total, now_s);
    return true;
}

void ui_begin(struct ui *ui)
{
    const char *terminal = getenv("TERM");
    ui->draws = !ui->quiet && isatty(2) && terminal && strcmp(terminal, "dumb") != 0;
    ui->hooks = (struct cranny_hooks){ui, on_log, on_progress};
}

void ui_end(struct ui *ui)
{
    ui_erase(ui);
    json_decref(ui->warnings);
    ui->warnings = NULL;
}

void ui_head(struct ui *ui, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(ui->heading, sizeof ui->heading, format, args);
    va_end(args);
    for (char *c = ui->heading; *c; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f)
            *c = ' ';
    ui->stage = NULL;
}

void ui_complain(struct ui *ui, const struct cranny_error *why)
{
    ui_erase(ui);
    if (why->status == CRANNY_CANCELLED && ui->written)
        fprintf(stderr, "cranny: interrupted; only %s was written\n", ui->written);
    else if (why->status == CRANNY_CANCELLED)
        fprintf(stderr, "cranny: interrupted; nothing was written\n");
    else
        fprintf(stderr, "cranny: %s\n", why->message);
}

int ui_fail(struct ui *ui, const struct cranny_error *why)
{
    ui_complain(ui, why);
    return cranny_exit_status(why->status);
}

int ui_finish_output(struct ui *ui)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return 0;
    if (errno == EPIPE)
        return 1;
    struct cranny_error why;
    refuse(&why, CRANNY_FAILED, "standard output: cannot be written: %s", strerror(errno));
    return ui_fail(ui, &why);
}

int ui_print_json(struct ui *ui, json_t *object)
{
    ui_erase(ui);
    if (!object) {
        struct cranny_error why;
        refuse(&why, CRANNY_MEMORY, "out of memory for the JSON result");
        return ui_fail(ui, &why);
    }
    json_dumpf(object, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    fputc('\n', stdout);
    json_decref(object);
    return ui_finish_output(ui);
}
