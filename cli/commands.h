/* The subcommands. Each gets the arguments after its name and returns the exit status. */
#ifndef CLI_COMMANDS_H
#define CLI_COMMANDS_H

#include "ui.h"

#include <cranny/cranny.h>

int command_bake(int argc, char **argv);
int command_info(int argc, char **argv);
int command_check(int argc, char **argv);
int command_compare(int argc, char **argv);
int command_diff(int argc, char **argv);
int command_render(int argc, char **argv);
int command_tune(int argc, char **argv);

/* How scenes are read: the options of every command that takes one. */
struct load_options {
    bool allow_outside;
    int scene;
    uint64_t memory_limit_bytes;
    struct option_list roles; /* ROLE=PATTERN */
    bool colors;              /* no option: for commands that show base colour textures */
};
extern const struct option_group load_options;
struct load_options load_options_default(void);
enum cranny_status load_scene(struct ui *ui, const char *path, const struct load_options *options,
                              struct cranny_scene **scene, struct cranny_error *why);

/* Read the command line of a command. -1: go on; else the exit status, all said. */
int begin_command(struct interface *face, struct ui *ui, int argc, char **argv);

#endif
