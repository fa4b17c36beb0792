#include "options.h"

#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { NAME_SIZE = 64, NAME_LIMIT = 128 };

struct assignment {
    const struct cranny_param *row;
    const char *name; /* as typed, for messages */
    const char *text;
};

struct parser {
    struct interface *face;
    char **argv;
    int argc, at;
    struct assignment *assignments;
    const char **presets;
    size_t assignment_count, preset_count;
};

enum cranny_status refuse(struct cranny_error *why, enum cranny_status status, const char *format,
                          ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(why->message, sizeof why->message, format, args);
    va_end(args);
    why->status = status;
    return status;
}

/* Option names have dashes where parameter names have underscores. */
static void spell(const char *name, char from, char to, char *text)
{
    size_t i = 0;
    for (; name[i] && i + 1 < NAME_SIZE; i++)
        text[i] = name[i] == from ? to : name[i];
    text[i] = 0;
}

static const struct {
    const char *name, *alias;
} aliases[] = {{"radius_world", "radius"}, {"isa", "cpu_mask"}};

const char *option_alias(const char *name)
{
    for (size_t i = 0; i < sizeof aliases / sizeof *aliases; i++)
        if (strcmp(aliases[i].name, name) == 0)
            return aliases[i].alias;
    return NULL;
}

static bool names_row(const struct cranny_param *row, const char *name)
{
    const char *alias = option_alias(row->name);
    return strcmp(row->name, name) == 0 || (alias && strcmp(alias, name) == 0);
}

bool option_given(const struct interface *face, const char *name)
{
    for (size_t i = 0; i < face->given_count; i++)
        if (strcmp(face->given[i], name) == 0)
            return true;
    return false;
}

enum cranny_status options_refuse(const struct interface *face, const struct option_group *group,
                                  size_t first, const char *goes_with, struct cranny_error *why)
{
    for (size_t i = first; i < group->row_count; i++)
        if (option_given(face, group->rows[i].name))
            return refuse(why, CRANNY_USAGE, "--%s goes with %s", group->rows[i].name, goes_with);
    return CRANNY_OK;
}

static void note_given(struct interface *face, const char *name)
{
    if (face->given_count < OPTION_GIVEN_LIMIT && !option_given(face, name))
        face->given[face->given_count++] = name;
}

static const struct cranny_param *find_row(const struct cranny_param_table *table, const char *name)
{
    char spelled[NAME_SIZE];
    spell(name, '-', '_', spelled);
    for (size_t i = 0; table && i < table->row_count; i++)
        if (names_row(&table->rows[i], spelled))
            return &table->rows[i];
    return NULL;
}

static const struct option *find_option(const struct interface *face, const char *name, char letter,
                                        void **target)
{
    for (size_t g = 0; g < face->group_count; g++) {
        const struct option_group *group = &face->groups[g];
        for (size_t i = 0; i < group->row_count; i++) {
            const struct option *row = &group->rows[i];
            if (name ? strcmp(row->name, name) == 0 : letter && row->letter == letter) {
                *target = (char *)group->target + row->offset;
                return row;
            }
        }
    }
    return NULL;
}

/* Edits (insert, delete, replace) from a to b. */
static size_t edit_distance(const char *a, const char *b)
{
    size_t row[NAME_SIZE + 1], b_length = strnlen(b, NAME_SIZE);
    for (size_t j = 0; j <= b_length; j++)
        row[j] = j;
    for (size_t i = 1; a[i - 1]; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            size_t shifted = (row[j - 1] < row[j] ? row[j - 1] : row[j]) + 1;
            row[j] = replaced < shifted ? replaced : shifted;
        }
    }
    return row[b_length];
}

const char *nearest_name(const char *word, const char *const *names, size_t count)
{
    const char *nearest = NULL;
    size_t length = strnlen(word, NAME_SIZE + 1);
    size_t best = length > NAME_SIZE ? 0 : 2 + length / 4;
    for (size_t i = 0; i < count && best; i++) {
        size_t distance = edit_distance(word, names[i]);
        if (length >= 3 && strncmp(word, names[i], length) == 0)
            distance = 0;
        if (distance < best && distance < strlen(names[i])) {
            best = distance;
            nearest = names[i];
        }
    }
    return nearest;
}

static enum cranny_status refuse_unknown(const struct interface *face, const char *name,
                                         struct cranny_error *why)
{
    static const char *const fixed[] = {"help", "preset", "set"};
    char spelled[NAME_LIMIT][NAME_SIZE];
    const char *names[NAME_LIMIT];
    size_t count = 0;
    for (size_t i = 0; i < (face->table ? 3 : 1); i++)
        names[count++] = fixed[i];
    for (size_t g = 0; g < face->group_count; g++)
        for (size_t i = 0; i < face->groups[g].row_count && count < NAME_LIMIT; i++)
            names[count++] = face->groups[g].rows[i].name;
    for (size_t i = 0; face->table && i < face->table->row_count && count < NAME_LIMIT; i++) {
        const char *row = face->table->rows[i].name, *alias = option_alias(row);
        spell(alias ? alias : row, '_', '-', spelled[count]);
        names[count] = spelled[count];
        count++;
    }
    const char *near = nearest_name(name, names, count);
    if (near)
        return refuse(why, CRANNY_USAGE, "unknown option '--%.200s'; did you mean '--%s'?", name,
                      near);
    return refuse(why, CRANNY_USAGE, "unknown option '--%.200s'; see 'cranny %s --help'", name,
                  face->command);
}

static enum cranny_status parse_int(const struct option *row, const char *text, int *out,
                                    struct cranny_error *why)
{
    char *end;
    long value = strtol(text, &end, 10);
    if (end == text || *end || value < row->minimum || value > row->maximum)
        return refuse(why, CRANNY_USAGE, "--%s: '%.200s' is not a whole number in [%d, %d]",
                      row->name, text, row->minimum, row->maximum);
    *out = (int)value;
    return CRANNY_OK;
}

static enum cranny_status parse_number(const struct option *row, const char *text, double *out,
                                       struct cranny_error *why)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end || !(value >= row->minimum && value <= row->maximum))
        return refuse(why, CRANNY_USAGE, "--%s: '%.200s' is not a number in [%d, %d]", row->name,
                      text, row->minimum, row->maximum);
    *out = value;
    return CRANNY_OK;
}

static enum cranny_status parse_positive(const struct option *row, const char *text, double *out,
                                         struct cranny_error *why)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end || !(value > 0))
        return refuse(why, CRANNY_USAGE, "--%s: '%.200s' is not a number above 0", row->name, text);
    *out = value;
    return CRANNY_OK;
}

static enum cranny_status parse_vector(const struct option *row, const char *text, double out[3],
                                       struct cranny_error *why)
{
    double values[3];
    const char *at = text;
    for (int i = 0; i < 3; i++) {
        char *end;
        values[i] = strtod(at, &end);
        if (end == at || *end != (i < 2 ? ',' : 0) || !isfinite(values[i]))
            return refuse(why, CRANNY_USAGE, "--%s: '%.200s' is not X,Y,Z; as in 1.5,0,-2",
                          row->name, text);
        at = end + 1;
    }
    memcpy(out, values, sizeof values);
    return CRANNY_OK;
}

static enum cranny_status parse_rect(const struct option *row, const char *text,
                                     struct cranny_rect *out, struct cranny_error *why)
{
    long values[4];
    const char *at = text;
    for (int i = 0; i < 4; i++) {
        char *end;
        values[i] = strtol(at, &end, 10);
        if (end == at || *end != (i < 3 ? ',' : 0) || values[i] < (i < 2 ? 0 : 1) ||
            values[i] > CRANNY_SIDE_MAX)
            return refuse(why, CRANNY_USAGE,
                          "--%s: '%.200s' is not X,Y,WIDTH,HEIGHT in pixels; as in 0,0,640,480",
                          row->name, text);
        at = end + 1;
    }
    *out = (struct cranny_rect){(int)values[0], (int)values[1], (int)values[2], (int)values[3]};
    return CRANNY_OK;
}

static enum cranny_status parse_size(const struct option *row, const char *text, int out[2],
                                     struct cranny_error *why)
{
    char *end;
    long width = strtol(text, &end, 10), height = 0;
    if (*end == 'x')
        height = strtol(end + 1, &end, 10);
    if (*end || width < row->minimum || width > row->maximum || height < row->minimum ||
        height > row->maximum)
        return refuse(why, CRANNY_USAGE,
                      "--%s: '%.200s' is not WIDTHxHEIGHT with sides in [%d, %d]; as in 1280x720",
                      row->name, text, row->minimum, row->maximum);
    out[0] = (int)width;
    out[1] = (int)height;
    return CRANNY_OK;
}

static enum cranny_status parse_bytes(const struct option *row, const char *text, uint64_t *out,
                                      struct cranny_error *why)
{
    static const char units[] = "KMGT";
    char *end;
    double value = strtod(text, &end);
    const char *unit = *end && end != text ? strchr(units, *end) : NULL;
    if (unit) {
        value *= ldexp(1, 10 * (int)(unit - units + 1));
        end++;
    }
    if (end == text || *end || !(value >= 1 && value < 0x1p63))
        return refuse(why, CRANNY_USAGE,
                      "--%s: '%.200s' is not a size in bytes; as in 800M, 8G or 1073741824",
                      row->name, text);
    *out = (uint64_t)value;
    return CRANNY_OK;
}

static enum cranny_status parse_choice(const struct option *row, const char *text, int *out,
                                       struct cranny_error *why)
{
    char list[256] = "";
    for (int i = 0; row->choices[i]; i++) {
        if (strcmp(row->choices[i], text) == 0) {
            *out = i;
            return CRANNY_OK;
        }
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", row->choices[i]);
    }
    return refuse(why, CRANNY_USAGE, "--%s: '%.200s' is none of: %s", row->name, text, list);
}

static enum cranny_status store(const struct option *row, void *field, const char *text,
                                struct cranny_error *why)
{
    switch (row->type) {
    case OPTION_FLAG:
        *(bool *)field = true;
        return CRANNY_OK;
    case OPTION_TEXT:
    case OPTION_OPTIONAL:
        *(const char **)field = text ? text : "";
        return CRANNY_OK;
    case OPTION_INT:
        return parse_int(row, text, field, why);
    case OPTION_NUMBER:
        return parse_number(row, text, field, why);
    case OPTION_CHOICE:
        return parse_choice(row, text, field, why);
    case OPTION_BYTES:
        return parse_bytes(row, text, field, why);
    case OPTION_SIZE:
        return parse_size(row, text, field, why);
    case OPTION_POSITIVE:
        return parse_positive(row, text, field, why);
    case OPTION_VECTOR:
        return parse_vector(row, text, field, why);
    case OPTION_RECT:
        return parse_rect(row, text, field, why);
    case OPTION_LIST:
        break;
    }
    return CRANNY_OK;
}

static enum cranny_status append(const struct option *row, struct option_list *list,
                                 const char *text, size_t operands, struct cranny_error *why)
{
    if (list->count == OPTION_LIST_LIMIT)
        return refuse(why, CRANNY_USAGE, "--%s: given more than %d times", row->name,
                      OPTION_LIST_LIMIT);
    list->items[list->count].text = text;
    list->items[list->count++].operands = operands;
    return CRANNY_OK;
}

/* The value of an option: after its '=', else the next argument. */
static enum cranny_status take_value(struct parser *parser, const char *option,
                                     const char *attached, const char **text,
                                     struct cranny_error *why)
{
    *text = attached;
    if (attached)
        return CRANNY_OK;
    const char *next = parser->at < parser->argc ? parser->argv[parser->at] : NULL;
    if (!next || strncmp(next, "--", 2) == 0)
        return refuse(why, CRANNY_USAGE, "%.200s needs a value; see 'cranny %s --help'", option,
                      parser->face->command);
    *text = next;
    parser->at++;
    return CRANNY_OK;
}

static enum cranny_status parse_known(struct parser *parser, const struct option *row, void *field,
                                      const char *option, const char *attached,
                                      struct cranny_error *why)
{
    const char *text = attached;
    if (row->type == OPTION_FLAG && attached)
        return refuse(why, CRANNY_USAGE, "--%s takes no value", row->name);
    if (row->type != OPTION_FLAG && row->type != OPTION_OPTIONAL) {
        enum cranny_status status = take_value(parser, option, attached, &text, why);
        if (status != CRANNY_OK)
            return status;
    }
    note_given(parser->face, row->name);
    if (row->type == OPTION_LIST)
        return append(row, field, text, parser->face->operand_count, why);
    return store(row, field, text, why);
}

static void assign(struct parser *parser, const struct cranny_param *row, const char *name,
                   const char *text)
{
    note_given(parser->face, row->name);
    parser->assignments[parser->assignment_count++] = (struct assignment){row, name, text};
}

static enum cranny_status parse_set(struct parser *parser, char *pair, struct cranny_error *why)
{
    char *equals = strchr(pair, '=');
    if (!equals)
        return refuse(why, CRANNY_USAGE, "--set: '%.200s' is not NAME=VALUE", pair);
    *equals = 0;
    const struct cranny_param *row = find_row(parser->face->table, pair);
    if (!row)
        return refuse_unknown(parser->face, pair, why);
    assign(parser, row, pair, equals + 1);
    return CRANNY_OK;
}

static enum cranny_status parse_row(struct parser *parser, const struct cranny_param *row,
                                    const char *option, const char *attached,
                                    struct cranny_error *why)
{
    const char *text = attached;
    enum cranny_status status = CRANNY_OK;
    if (row->type == CRANNY_PARAM_BOOL)
        text = attached ? attached : "true";
    else
        status = take_value(parser, option, attached, &text, why);
    if (status == CRANNY_OK)
        assign(parser, row, option, text);
    return status;
}

static enum cranny_status parse_long(struct parser *parser, char *argument,
                                     struct cranny_error *why)
{
    char *name = argument + 2, *attached = strchr(name, '=');
    if (attached)
        *attached++ = 0;
    void *field;
    const struct option *option = find_option(parser->face, name, 0, &field);
    if (option)
        return parse_known(parser, option, field, argument, attached, why);
    const struct cranny_param_table *table = parser->face->table;
    if (table && (strcmp(name, "set") == 0 || strcmp(name, "preset") == 0)) {
        const char *text;
        enum cranny_status status = take_value(parser, argument, attached, &text, why);
        if (status != CRANNY_OK)
            return status;
        if (*name == 's')
            return parse_set(parser, (char *)text, why);
        parser->presets[parser->preset_count++] = text;
        return CRANNY_OK;
    }
    const struct cranny_param *row = find_row(table, name);
    if (row)
        return parse_row(parser, row, argument, attached, why);
    row = strncmp(name, "no-", 3) == 0 && !attached ? find_row(table, name + 3) : NULL;
    if (row && row->type == CRANNY_PARAM_BOOL) {
        assign(parser, row, argument, "false");
        return CRANNY_OK;
    }
    return refuse_unknown(parser->face, name, why);
}

static enum cranny_status parse_short(struct parser *parser, char *argument,
                                      struct cranny_error *why)
{
    void *field;
    const struct option *row = find_option(parser->face, NULL, argument[1], &field);
    if (!row)
        return refuse(why, CRANNY_USAGE, "unknown option '%.200s'; see 'cranny %s --help'",
                      argument, parser->face->command);
    const char *attached = argument[2] ? argument + 2 : NULL;
    if (row->type == OPTION_FLAG && attached)
        return refuse(why, CRANNY_USAGE, "unknown option '%.200s'; give short options one by one",
                      argument);
    return parse_known(parser, row, field, argument, attached, why);
}

static enum cranny_status parse_arguments(struct parser *parser, struct cranny_error *why)
{
    struct interface *face = parser->face;
    bool only_operands = false;
    enum cranny_status status = CRANNY_OK;
    while (parser->at < parser->argc && status == CRANNY_OK) {
        char *argument = parser->argv[parser->at++];
        if (only_operands || argument[0] != '-' || !argument[1]) {
            if (face->operand_count == face->operand_limit)
                return refuse(why, CRANNY_USAGE,
                              "one file too many: '%.200s'; see 'cranny %s --help'", argument,
                              face->command);
            face->operands[face->operand_count++] = argument;
        } else if (strcmp(argument, "--") == 0)
            only_operands = true;
        else if (argument[1] == '-')
            status = parse_long(parser, argument, why);
        else
            status = parse_short(parser, argument, why);
    }
    return status;
}

static enum cranny_status apply_assignment(const struct interface *face,
                                           const struct assignment *assignment,
                                           struct cranny_error *why)
{
    char text[NAME_SIZE];
    const struct cranny_param *row = assignment->row;
    spell(assignment->text, '-', '_', text);
    bool choice = row->type == CRANNY_PARAM_ENUM;
    struct cranny_error inner;
    enum cranny_status status = cranny_params_set(face->table, face->params, row->name,
                                                  choice ? text : assignment->text, &inner);
    size_t prefix = strlen(row->name);
    if (status != CRANNY_OK && strncmp(inner.message, row->name, prefix) == 0)
        return refuse(why, status, "%s%.900s", assignment->name, inner.message + prefix);
    if (status != CRANNY_OK)
        *why = inner;
    return status;
}

static enum cranny_status apply_preset(struct interface *face, const char *preset,
                                       struct cranny_error *why)
{
    char names[160] = "";
    face->preset = preset;
    for (size_t i = 0; face->presets && face->presets[i]; i++) {
        if (strcmp(face->presets[i], preset) == 0)
            return face->apply_preset(face->params, preset, why);
        const size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", face->presets[i]);
    }
    /* A word without a dot or slash was hardly meant as a file, unless there is one. */
    if (face->presets && !strpbrk(preset, "./") && access(preset, F_OK) != 0)
        return refuse(why, CRANNY_USAGE, "--preset: '%.200s' is no file and none of: %s", preset,
                      names);
    return cranny_params_load(face->table, face->params, preset, why);
}

enum cranny_status options_parse(struct interface *face, int argc, char **argv,
                                 struct cranny_error *why)
{
    size_t room = (size_t)argc + 1;
    struct parser parser = {.face = face, .argv = argv, .argc = argc};
    parser.assignments = calloc(room, sizeof *parser.assignments);
    parser.presets = calloc(room, sizeof *parser.presets);
    enum cranny_status status =
        parser.assignments && parser.presets
            ? parse_arguments(&parser, why)
            : refuse(why, CRANNY_MEMORY, "out of memory for the command line");
    for (size_t i = 0; i < parser.preset_count && status == CRANNY_OK; i++)
        status = apply_preset(face, parser.presets[i], why);
    for (size_t i = 0; i < parser.assignment_count && status == CRANNY_OK; i++)
        status = apply_assignment(face, &parser.assignments[i], why);
    free(parser.assignments);
    free(parser.presets);
    return status;
}
