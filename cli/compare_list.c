/* What is tried on each view: one list, from which times, errors and pictures come. */
#include "compare.h"

#include <stdlib.h>
#include <string.h>

/* Beside the presets: cheaper steps of one quality. */
static const struct step {
    int method;
    const char *preset, *setting, *label;
} steps[] = {
    {METHOD_RAYTRACE, NULL, "rays=64", "rays=64"},
    {METHOD_RAYTRACE, NULL, "rays=16", "rays=16"},
    {METHOD_RAYTRACE, NULL, "rays=1", "rays=1"},
    {METHOD_VOLUMES, "calibrated", "spacing=3", "1/9"},
    {METHOD_VOLUMES, "calibrated", "spacing=5", "1/25"},
    {METHOD_VOLUMES, "calibrated", "spacing=15", "1/225"},
};
enum { STEP_COUNT = sizeof steps / sizeof *steps };

static bool is_word_of(const char *list, const char *word)
{
    const size_t length = strlen(word);
    for (const char *at = list; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL)
        if (strncmp(at, word, length) == 0 && (at[length] == ',' || !at[length]))
            return true;
    return false;
}

/* Every word must be a method; one that is mistyped would only be missed. */
static enum cranny_status check_names(const char *list, struct cranny_error *why)
{
    char names[256] = "", word[64];
    for (int m = 0; m < METHOD_COUNT; m++) {
        const size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, "%s%s", m ? ", " : "", method_names[m]);
    }
    for (const char *at = list; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL) {
        snprintf(word, sizeof word, "%.*s", (int)strcspn(at, ","), at);
        if (!method_find(word))
            return refuse(why, CRANNY_USAGE, "--methods: '%s' is none of: %s", word, names);
    }
    return CRANNY_OK;
}

/* A new row; NULL when there is no room. */
static struct compare_method *append(struct compare *compare, const struct method *method,
                                     const char *label)
{
    if (compare->method_count == COMPARE_METHOD_LIMIT)
        return NULL;
    struct compare_method *row = &compare->methods[compare->method_count++];
    *row = (struct compare_method){.method = method, .device = "cpu"};
    snprintf(row->label, sizeof row->label, "%s", label);
    return row;
}

static bool has_steps(int method)
{
    for (int i = 0; i < STEP_COUNT; i++)
        if (steps[i].method == method)
            return true;
    return false;
}

static void list_presets(struct compare *compare, int method)
{
    const char *const *presets = method_presets(&methods[method]);
    for (int p = 0; presets && presets[p]; p++) {
        struct compare_method *row = append(compare, &methods[method], presets[p]);
        if (!row)
            return;
        row->preset = presets[p];
        row->series = p == 0 && has_steps(method);
        method_params_preset(row->method, row->preset, &row->params);
    }
}

static void list_step(struct compare *compare, const struct step *step)
{
    char name[64];
    const struct method *method = &methods[step->method];
    const char *equals = strchr(step->setting, '=');
    /* As good as the truth, and no news. */
    if (method->kind->is_truth && atoi(equals + 1) >= compare->options.rays)
        return;
    struct compare_method *row = append(compare, method, step->label);
    if (!row)
        return;
    row->preset = step->preset;
    row->setting = step->setting;
    row->series = true;
    method_params_preset(method, step->preset, &row->params);
    snprintf(name, sizeof name, "%.*s", (int)(equals - step->setting), step->setting);
    cranny_params_set(method_table(method), &row->params, name, equals + 1, NULL);
}

static void list_method(struct compare *compare, int method)
{
    const char *wanted = compare->options.methods;
    if (wanted && !is_word_of(wanted, methods[method].name))
        return;
    list_presets(compare, method);
    for (int i = 0; i < STEP_COUNT; i++)
        if (steps[i].method == method)
            list_step(compare, &steps[i]);
}

/* The file's name without folder and extension. */
static void stem_of(const char *path, char stem[64])
{
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path, *dot = strrchr(name, '.');
    const int length = (int)(dot && dot != name ? dot - name : (long)strlen(name));
    snprintf(stem, 64, "%.*s", length < 63 ? length : 63, name);
}

static enum cranny_status list_file(struct compare *compare, const char *path,
                                    struct cranny_error *why)
{
    const struct method *method;
    union method_params params;
    char stem[64];
    const enum cranny_status status = method_preset_load(path, &method, &params, why);
    if (status != CRANNY_OK)
        return status;
    stem_of(path, stem);
    for (size_t i = 0; i < compare->method_count; i++)
        if (compare->methods[i].method == method && strcmp(compare->methods[i].label, stem) == 0)
            return refuse(why, CRANNY_USAGE,
                          "--preset: %.600s: there is a row '%s %s'; rename the file", path,
                          method->name, stem);
    struct compare_method *row = append(compare, method, stem);
    if (!row)
        return refuse(why, CRANNY_USAGE, "--preset: more than %d rows", COMPARE_METHOD_LIMIT);
    row->preset = path;
    row->file = ++compare->file_count;
    row->params = params;
    return CRANNY_OK;
}

enum cranny_status compare_list_methods(struct compare *compare, struct cranny_error *why)
{
    const struct option_list *files = &compare->options.presets;
    enum cranny_status status = check_names(compare->options.methods, why);
    if (status != CRANNY_OK)
        return status;
    list_method(compare, METHOD_RAYTRACE);
    for (int m = 0; m < METHOD_COUNT; m++)
        if (m != METHOD_RAYTRACE)
            list_method(compare, m);
    for (size_t i = 0; i < files->count && status == CRANNY_OK; i++)
        status = list_file(compare, files->items[i].text, why);
    if (status == CRANNY_OK && !compare->method_count)
        return refuse(why, CRANNY_USAGE, "--methods: fewer rays than the truth's %d are not tried",
                      compare->options.rays);
    return status;
}
