#include "base/base.h"

#include <jansson.h>
#include <strings.h>

const struct cranny_param *param_find(const struct cranny_param_table *table, const char *name)
{
    for (size_t i = 0; i < table->row_count; i++)
        if (strcmp(table->rows[i].name, name) == 0)
            return &table->rows[i];
    return NULL;
}

void param_store(const struct cranny_param *row, void *params, double value)
{
    char *field = (char *)params + row->offset;
    switch (row->type) {
    case CRANNY_PARAM_FLOAT:
        *(float *)field = (float)value;
        break;
    case CRANNY_PARAM_INT:
    case CRANNY_PARAM_ENUM:
        *(int *)field = (int)value;
        break;
    case CRANNY_PARAM_BOOL:
        *(bool *)field = value != 0;
        break;
    }
}

double param_load(const struct cranny_param *row, const void *params)
{
    const char *field = (const char *)params + row->offset;
    switch (row->type) {
    case CRANNY_PARAM_FLOAT:
        return *(const float *)field;
    case CRANNY_PARAM_INT:
    case CRANNY_PARAM_ENUM:
        return *(const int *)field;
    case CRANNY_PARAM_BOOL:
        return *(const bool *)field;
    }
    return 0;
}

void cranny_params_defaults(const struct cranny_param_table *table, void *params)
{
    for (size_t i = 0; i < table->row_count; i++)
        param_store(&table->rows[i], params, table->rows[i].fallback);
}

/* A NaN default means "not set" (chosen by the program); NaN is then a legal value of the row. */
static bool in_range(const struct cranny_param *row, double value)
{
    if (isnan(value))
        return isnan(row->fallback);
    /* A bound such as 1e-9 is no float: what a float field can hold of it is in range, too. */
    if (row->type == CRANNY_PARAM_FLOAT)
        return (float)value >= (float)row->minimum && (float)value <= (float)row->maximum;
    return value >= row->minimum && value <= row->maximum;
}

static int choice_count(const struct cranny_param *row)
{
    int count = 0;
    while (row->choices[count])
        count++;
    return count;
}

static void list_choices(const struct cranny_param *row, char *text, size_t size)
{
    size_t used = 0;
    text[0] = 0;
    for (int i = 0; row->choices[i] && used < size; i++)
        used += (size_t)snprintf(text + used, size - used, "%s%s", i ? ", " : "", row->choices[i]);
}

static enum cranny_status parse(const struct cranny_param *row, const char *text, double *value,
                                struct cranny_error *why)
{
    if (row->type == CRANNY_PARAM_ENUM) {
        for (int i = 0; row->choices[i]; i++) {
            if (strcmp(row->choices[i], text) == 0) {
                *value = i;
                return CRANNY_OK;
            }
        }
        char list[256];
        list_choices(row, list, sizeof list);
        return fail(why, CRANNY_USAGE, "%s: '%s' is none of: %s", row->name, text, list);
    }
    if (row->type == CRANNY_PARAM_BOOL) {
        bool yes = !strcasecmp(text, "true") || !strcasecmp(text, "yes") ||
                   !strcasecmp(text, "on") || !strcmp(text, "1");
        bool no = !strcasecmp(text, "false") || !strcasecmp(text, "no") ||
                  !strcasecmp(text, "off") || !strcmp(text, "0");
        *value = yes;
        return yes || no
                   ? CRANNY_OK
                   : fail(why, CRANNY_USAGE, "%s: '%s' is neither true nor false", row->name, text);
    }
    char *end;
    *value = strtod(text, &end);
    if (end == text || *end)
        return fail(why, CRANNY_USAGE, "%s: '%s' is not a number", row->name, text);
    if (row->type == CRANNY_PARAM_INT && *value != floor(*value))
        return fail(why, CRANNY_USAGE, "%s: '%s' is not a whole number", row->name, text);
    return CRANNY_OK;
}

static enum cranny_status fail_range(const struct cranny_param *row, double value,
                                     struct cranny_error *why)
{
    return fail(why, CRANNY_USAGE, "%s: %g is out of range; it must lie in [%g, %g]%s%s", row->name,
                value, row->minimum, row->maximum, row->unit[0] ? " " : "", row->unit);
}

enum cranny_status cranny_params_set(const struct cranny_param_table *table, void *params,
                                     const char *name, const char *text, struct cranny_error *why)
{
    const struct cranny_param *row = param_find(table, name);
    if (!row)
        return fail(why, CRANNY_USAGE, "%s: no such parameter of '%s'; see --help", name,
                    table->name);
    double value;
    enum cranny_status status = parse(row, text, &value, why);
    if (status != CRANNY_OK)
        return status;
    if (row->type != CRANNY_PARAM_ENUM && !in_range(row, value))
        return fail_range(row, value, why);
    param_store(row, params, value);
    return CRANNY_OK;
}

size_t cranny_params_get(const struct cranny_param_table *table, const void *params,
                         const char *name, char *text, size_t text_size)
{
    const struct cranny_param *row = param_find(table, name);
    if (!row)
        return 0;
    double value = param_load(row, params);
    switch (row->type) {
    case CRANNY_PARAM_ENUM:
        return (size_t)snprintf(text, text_size, "%s",
                                value >= 0 && value < choice_count(row) ? row->choices[(int)value]
                                                                        : "?");
    case CRANNY_PARAM_BOOL:
        return (size_t)snprintf(text, text_size, "%s", value != 0 ? "true" : "false");
    case CRANNY_PARAM_INT:
        return (size_t)snprintf(text, text_size, "%.0f", value);
    case CRANNY_PARAM_FLOAT:
        break;
    }
    int digits = 6;
    do
        snprintf(text, text_size, "%.*g", digits, value);
    while (strtof(text, NULL) != (float)value && !isnan(value) && ++digits < 10);
    return strlen(text);
}

enum cranny_status cranny_params_validate(const struct cranny_param_table *table,
                                          const void *params, struct cranny_error *why)
{
    for (size_t i = 0; i < table->row_count; i++) {
        const struct cranny_param *row = &table->rows[i];
        double value = param_load(row, params);
        bool good = row->type == CRANNY_PARAM_ENUM ? value >= 0 && value < choice_count(row)
                                                   : in_range(row, value);
        if (!good)
            return fail_range(row, value, why);
    }
    return CRANNY_OK;
}

static enum cranny_status set_from_json(const struct cranny_param_table *table, void *params,
                                        const char *name, const json_t *value,
                                        struct cranny_error *why)
{
    char number[40];
    if (json_is_string(value))
        return cranny_params_set(table, params, name, json_string_value(value), why);
    if (json_is_boolean(value))
        return cranny_params_set(table, params, name, json_is_true(value) ? "true" : "false", why);
    if (json_is_null(value))
        return cranny_params_set(table, params, name, "nan", why);
    if (!json_is_number(value))
        return fail(why, CRANNY_USAGE, "%s: must be a number, a string or true/false", name);
    snprintf(number, sizeof number, "%.17g", json_number_value(value));
    return cranny_params_set(table, params, name, number, why);
}

/* A file for several tables in turn would be read wrong without a word: same names, other meanings.
 */
static enum cranny_status check_method(const struct cranny_param_table *table, const json_t *value,
                                       struct cranny_error *why)
{
    const char *name = json_string_value(value);
    if (name && strcmp(name, table->name) == 0)
        return CRANNY_OK;
    return fail(why, CRANNY_USAGE, "is a preset of '%.100s', not of '%s'", name ? name : "?",
                table->name);
}

enum cranny_status cranny_params_load(const struct cranny_param_table *table, void *params,
                                      const char *path, struct cranny_error *why)
{
    json_error_t problem;
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &problem);
    if (!root)
        return fail(why, CRANNY_INPUT, "%s: line %d: %s", path, problem.line, problem.text);
    enum cranny_status status = CRANNY_OK;
    const char *name;
    json_t *value;
    if (!json_is_object(root))
        status = fail(why, CRANNY_INPUT, "%s: a preset is a JSON object of name: value", path);
    else
        json_object_foreach(root, name, value)
        {
            struct cranny_error inner;
            status = strcmp(name, "method") == 0
                         ? check_method(table, value, &inner)
                         : set_from_json(table, params, name, value, &inner);
            if (status != CRANNY_OK) {
                fail(why, CRANNY_INPUT, "%s: %.900s", path, inner.message);
                status = CRANNY_INPUT;
                break;
            }
        }
    json_decref(root);
    return status;
}
