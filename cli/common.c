#include "commands.h"

#include <limits.h>
#include <stdio.h>
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

enum cranny_status load_scene(struct ui *ui, const char *path, const struct load_options *options,
                              struct cranny_scene **scene, struct cranny_error *why)
{
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    params.allow_outside = options->allow_outside;
    params.scene = options->scene;
    params.memory_limit_bytes = options->memory_limit_bytes;
    params.colors = options->colors;
    params.hooks = &ui->hooks;
    enum cranny_status status = cranny_scene_load(path, &params, scene, why);
    if (status == CRANNY_OK && ui_interrupted()) {
        cranny_scene_destroy(scene);
        return refuse(why, CRANNY_CANCELLED, "interrupted");
    }
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
