#include "options.h"

#include <math.h>
#include <string.h>

enum { HELP_INDENT = 28, HELP_WIDTH = 96 };

/* `text` from column HELP_INDENT on, broken at spaces. */
static void print_wrapped(FILE *out, const char *text)
{
    int column = HELP_INDENT;
    while (*text) {
        int length = (int)strcspn(text, " ");
        if (column > HELP_INDENT && column + 1 + length > HELP_WIDTH) {
            fprintf(out, "\n%*s", HELP_INDENT, "");
            column = HELP_INDENT;
        } else if (column > HELP_INDENT) {
            fputc(' ', out);
            column++;
        }
        fwrite(text, 1, (size_t)length, out);
        column += length;
        text += length + (text[length] == ' ');
    }
    fputc('\n', out);
}

static void print_entry(FILE *out, const char *left, const char *text)
{
    int length = (int)strlen(left);
    if (length + 2 > HELP_INDENT)
        fprintf(out, "%s\n%*s", left, HELP_INDENT, "");
    else
        fprintf(out, "%-*s", HELP_INDENT, left);
    print_wrapped(out, text);
}

static void join_choices(const char *const *choices, char *text, size_t size)
{
    size_t used = 0;
    text[0] = 0;
    for (int i = 0; choices[i] && used < size; i++)
        used += (size_t)snprintf(text + used, size - used, "%s%s", i ? "|" : "", choices[i]);
}

static void print_option(FILE *out, const struct option *row)
{
    char left[128], choices[80] = "", letter[8] = "    ";
    if (row->letter)
        snprintf(letter, sizeof letter, "-%c, ", row->letter);
    if (row->choices)
        join_choices(row->choices, choices, sizeof choices);
    const char *value = row->choices ? choices : row->value;
    if (row->type == OPTION_OPTIONAL)
        snprintf(left, sizeof left, "  %s--%s[=%s]", letter, row->name, value);
    else
        snprintf(left, sizeof left, "  %s--%s%s%s", letter, row->name, value ? " " : "",
                 value ? value : "");
    print_entry(out, left, row->help);
}

static void option_name(const char *name, char *text, size_t size)
{
    snprintf(text, size, "%s", name);
    for (char *c = text; *c; c++)
        if (*c == '_')
            *c = '-';
}

/* The default as --set would take it. */
static void default_text(const struct cranny_param *row, char *text, size_t size)
{
    if (row->type == CRANNY_PARAM_ENUM)
        snprintf(text, size, "%s", row->choices[(int)row->fallback]);
    else if (row->type == CRANNY_PARAM_BOOL)
        snprintf(text, size, "%s", row->fallback != 0 ? "true" : "false");
    else
        snprintf(text, size, "%.9g", row->fallback);
}

static void range_text(const struct cranny_param *row, const char *separator, char *text,
                       size_t size)
{
    text[0] = 0;
    if (row->type == CRANNY_PARAM_INT || row->type == CRANNY_PARAM_FLOAT)
        snprintf(text, size, "%.10g%s%.10g", row->minimum, separator, row->maximum);
}

static void print_row(FILE *out, const struct cranny_param *row)
{
    char left[128], name[64], fallback[64], range[80], choices[80] = "", text[512];
    char also[80] = "", alias[64] = "";
    option_name(row->name, name, sizeof name);
    if (option_alias(row->name)) {
        option_name(option_alias(row->name), alias, sizeof alias);
        snprintf(also, sizeof also, "; also --%s", alias);
    }
    if (row->choices)
        join_choices(row->choices, choices, sizeof choices);
    const char *value = row->type == CRANNY_PARAM_BOOL  ? ""
                        : row->choices                  ? choices
                        : row->type == CRANNY_PARAM_INT ? "N"
                                                        : "X";
    snprintf(left, sizeof left, "      --%s%s%s", name, *value ? " " : "", value);
    default_text(row, fallback, sizeof fallback);
    range_text(row, " to ", range, sizeof range);
    snprintf(text, sizeof text, "%s (%s%s%s%sdefault %s%s)", row->help, range,
             *range && row->unit[0] ? " " : "", *range ? row->unit : "", *range ? "; " : "",
             fallback, also);
    print_entry(out, left, text);
}

static bool is_shadowed(const struct interface *face, const char *name)
{
    for (size_t g = 0; g < face->group_count; g++)
        for (size_t i = 0; i < face->groups[g].row_count; i++)
            if (strcmp(face->groups[g].rows[i].name, name) == 0)
                return true;
    return false;
}

static void print_table(FILE *out, const struct interface *face)
{
    if (!face->table)
        return;
    fprintf(out, "\nParameters (switches also take the form --no-NAME):\n");
    for (size_t i = 0; i < face->table->row_count; i++)
        if (!is_shadowed(face, face->table->rows[i].name))
            print_row(out, &face->table->rows[i]);
    print_entry(out, "      --set NAME=VALUE", "the same parameters under their preset names");
    char left[128], names[80];
    if (face->presets)
        join_choices(face->presets, names, sizeof names);
    snprintf(left, sizeof left, "      --preset %s%sFILE.json", face->presets ? names : "",
             face->presets ? "|" : "");
    print_entry(out, left,
                "parameters from a JSON object of NAME: VALUE; other options override it, and the "
                "'parameters' of a --json result are such an object");
}

void options_help(const struct interface *face, FILE *out)
{
    fprintf(out, "Usage: cranny %s %s\n\n%s\n", face->command, face->usage, face->summary);
    for (size_t g = 0; g < face->group_count; g++) {
        fprintf(out, "\n%s:\n", face->groups[g].title);
        for (size_t i = 0; i < face->groups[g].row_count; i++)
            print_option(out, &face->groups[g].rows[i]);
    }
    print_table(out, face);
    fprintf(out, "\nExamples:\n%s", face->examples);
}

static void values_text(const struct cranny_param *row, char *text, size_t size)
{
    range_text(row, " … ", text, size);
    if (row->type == CRANNY_PARAM_BOOL)
        snprintf(text, size, "true, false");
    size_t used = 0;
    for (int c = 0; row->choices && row->choices[c] && used < size; c++)
        used += (size_t)snprintf(text + used, size - used, "%s%s", c ? ", " : "", row->choices[c]);
}

void options_markdown(const struct cranny_param_table *table, const struct option_column *columns,
                      size_t column_count, FILE *out)
{
    fprintf(out, "| parameter | values | unit |");
    for (size_t c = 0; c < column_count; c++)
        fprintf(out, " %s |", columns[c].title);
    fprintf(out, " meaning |\n|---|---|---|");
    for (size_t c = 0; c < column_count; c++)
        fprintf(out, "---|");
    fprintf(out, "---|\n");
    for (size_t i = 0; i < table->row_count; i++) {
        const struct cranny_param *row = &table->rows[i];
        char value[64], values[160];
        values_text(row, values, sizeof values);
        fprintf(out, "| `%s` | %s | %s |", row->name, values, row->unit);
        for (size_t c = 0; c < column_count; c++) {
            cranny_params_get(table, columns[c].params, row->name, value, sizeof value);
            fprintf(out, " %s |", value);
        }
        fprintf(out, " %s |\n", row->help);
    }
}
