#include "commands.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const struct option load_rows[] = {
    {.name = "scene",
     .type = OPTION_INT,
     .offset = offsetof(struct load_options, scene),
     .value = "N",
     .minimum = -1,
     .maximum = INT_MAX,
     .help = "which of a glTF file's scenes, from 0 (default: the file's own default)"},
    {.name = "allow-outside",
     .type = OPTION_FLAG,
     .offset = offsetof(struct load_options, allow_outside),
     .help = "read files that the scene names outside its own folder"},
    {.name = "memory-limit",
     .type = OPTION_BYTES,
     .offset = offsetof(struct load_options, memory_limit_bytes),
     .value = "SIZE",
     .help = "refuse a scene whose decoded geometry and images need more, as in 800M or 8G "
             "(default: three quarters of the machine's memory)"},
    {.name = "role",
     .type = OPTION_LIST,
     .offset = offsetof(struct load_options, roles),
     .value = "ROLE=PATTERN",
     .help = "make everything whose name, or a name above it, matches PATTERN (* and ?, in "
             "quotes) a tree, shrub, grass, solid or ignored; may be given again, the last one "
             "that matches counts"},
};

const struct option_group load_options = {"Reading", load_rows,
                                          sizeof load_rows / sizeof *load_rows, NULL};

struct load_options load_options_default(void)
{
    struct cranny_scene_load_params defaults = cranny_scene_load_params_default();
    long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGE_SIZE);
    uint64_t limit = defaults.memory_limit_bytes;
    if (pages > 0 && page_bytes > 0)
        limit = (uint64_t)pages * (uint64_t)page_bytes / 4 * 3;
    return (struct load_options){
        .allow_outside = defaults.allow_outside,
        .scene = defaults.scene,
        .memory_limit_bytes = limit,
    };
}

/* The rule that one --role states. */
static enum cranny_status parse_rule(const char *text, struct cranny_role_rule *rule,
                                     struct cranny_error *why)
{
    const char *const *names = cranny_role_names(), *equals = strchr(text, '=');
    const size_t length = equals ? (size_t)(equals - text) : 0;
    for (int role = 0; length && names[role]; role++)
        if (strlen(names[role]) == length && strncmp(names[role], text, length) == 0 && equals[1]) {
            *rule = (struct cranny_role_rule){equals + 1, (enum cranny_role)role};
            return CRANNY_OK;
        }
    return refuse(why, CRANNY_USAGE,
                  "--role: '%.200s' is not ROLE=PATTERN with one of solid, tree, shrub, grass, "
                  "ignored; as in tree='Tree_*'",
                  text);
}

static enum cranny_status assign_roles(struct ui *ui, const struct cranny_role_rule *rules,
                                       size_t count, struct cranny_scene *scene,
                                       struct cranny_error *why)
{
    uint32_t matched[OPTION_LIST_LIMIT];
    enum cranny_status status = cranny_scene_assign_roles(scene, rules, count, matched, why);
    for (size_t i = 0; status == CRANNY_OK && i < count; i++)
        if (!matched[i])
            ui_warn(ui, "--role: nothing in the scene has a name that matches '%.200s'",
                    rules[i].pattern);
    return status;
}

enum cranny_status load_scene(struct ui *ui, const char *path, const struct load_options *options,
                              struct cranny_scene **scene, struct cranny_error *why)
{
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    struct cranny_role_rule rules[OPTION_LIST_LIMIT];
    enum cranny_status status = CRANNY_OK;
    *scene = NULL;
    params.allow_outside = options->allow_outside;
    params.scene = options->scene;
    params.memory_limit_bytes = options->memory_limit_bytes;
    params.colors = options->colors;
    params.hooks = &ui->hooks;
    for (size_t i = 0; status == CRANNY_OK && i < options->roles.count; i++)
        status = parse_rule(options->roles.items[i].text, &rules[i], why);
    if (status == CRANNY_OK)
        status = cranny_scene_load(path, &params, scene, why);
    if (status == CRANNY_OK && options->roles.count)
        status = assign_roles(ui, rules, options->roles.count, *scene, why);
    if (status == CRANNY_OK && ui_interrupted())
        status = refuse(why, CRANNY_CANCELLED, "interrupted");
    if (status != CRANNY_OK)
        cranny_scene_destroy(scene);
    return status;
}

int begin_command(struct interface *face, struct ui *ui, int argc, char **argv)
{
    struct cranny_error why;
    enum cranny_status status = options_parse(face, argc, argv, &why);
    if (status == CRANNY_OK && ui->help) {
        options_help(face, stdout);
        return ui_finish_output(ui);
    }
    const bool replaced = face->instead && *face->instead;
    const size_t minimum = replaced ? 0 : face->operand_minimum ? face->operand_minimum : 1;
    if (status == CRANNY_OK && replaced && face->operand_count)
        status = refuse(&why, CRANNY_USAGE,
                        "'%.200s' and '%.200s': one input at a time; see 'cranny %s --help'",
                        face->operands[0], *face->instead, face->command);
    if (status == CRANNY_OK && face->operand_count < minimum)
        status = refuse(&why, CRANNY_USAGE, "%s: cranny %s %s; see 'cranny %s --help'",
                        face->lacking ? face->lacking : "no scene given", face->command,
                        face->usage, face->command);
    if (status != CRANNY_OK)
        return ui_fail(ui, &why);
    ui_begin(ui);
    return -1;
}
