/* cranny: the command. */
#include "commands.h"
#include "method.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct command {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *usage, *help;
};

static const struct command commands[] = {
    {"bake", command_bake, "bake  SCENE [-o OUT]", "ambient obscurance onto the scene's vertices"},
    {"render", command_render, "render SCENE | --depth FILE", "ambient visibility of a picture"},
    {"info", command_info, "info  SCENE", "what is in the scene"},
    {"check", command_check, "check SCENE | --depth FILE",
     "what is wrong with it, and what to pass for its size"},
    {"compare", command_compare, "compare SCENE... -o DIR",
     "every method beside the truth: times, errors, a page"},
    {"tune", command_tune, "tune  SCENE... --method M", "fit a method's parameters to the truth"},
    {"diff", command_diff, "diff  A B", "how far image A is from image B, the reference"},
};
enum { COMMAND_COUNT = sizeof commands / sizeof *commands };

static int print_help(void)
{
    struct ui ui = {0};
    printf("Cranny %s: ambient obscurance for 3D scenes\n\n", cranny_version());
    for (int i = 0; i < COMMAND_COUNT; i++)
        printf("  cranny %-27s %s\n", commands[i].usage, commands[i].help);
    printf("\n'cranny COMMAND --help' lists a command's options and shows examples.\n"
           "Scenes: glTF 2.0 (.glb, .gltf), kept whole; OBJ, PLY, STL, FBX, DAE and others are "
           "read\nand come out as .glb.\n\n"
           "Exit status: 0 done, 1 failed while running, 2 wrong usage, 3 bad input, "
           "130 interrupted\n\n"
           "Start here:\n"
           "  cranny check level.glb          is the file sound, and is its unit the metre?\n"
           "  cranny bake level.glb           writes level-ao.glb, which any viewer shows\n"
           "  cranny bake level.glb --preview level.png\n"
           "  cranny render level.glb         writes level-ao.png, a picture of the visibility\n"
           "  cranny render --depth depth.exr --fov 60\n"
           "  cranny compare level.glb -o out which method is best here: out/index.html\n");
    return ui_finish_output(&ui);
}

static int print_version(void)
{
    struct ui ui = {0};
    printf("cranny %s\n", cranny_version());
    return ui_finish_output(&ui);
}

static int refuse_command(const char *word)
{
    const char *names[COMMAND_COUNT];
    for (int i = 0; i < COMMAND_COUNT; i++)
        names[i] = commands[i].name;
    const char *near = nearest_name(word, names, COMMAND_COUNT);
    if (word[0] == '-')
        fprintf(stderr, "cranny: unknown option '%s' before a command; see 'cranny --help'\n",
                word);
    else if (near)
        fprintf(stderr, "cranny: unknown command '%s'; did you mean '%s'?\n", word, near);
    else if (access(word, F_OK) == 0)
        fprintf(stderr, "cranny: '%s' is no command; did you mean 'cranny bake %s'?\n", word, word);
    else
        fprintf(stderr, "cranny: unknown command '%s'; see 'cranny --help'\n", word);
    return cranny_exit_status(CRANNY_USAGE);
}

static void print_method(const struct method *method)
{
    static const char *const plain[] = {"default", NULL};
    const char *const *names = method_presets(method) ? method_presets(method) : plain;
    union method_params presets[4];
    struct option_column columns[4];
    size_t count = 0;
    for (; names[count] && count < 4; count++) {
        method_params_preset(method, names[count], &presets[count]);
        columns[count] = (struct option_column){names[count], &presets[count]};
    }
    printf("\n## render --method %s\n\n", method->name);
    options_markdown(method_table(method), columns, count, stdout);
}

/* For docs/parameters.md, which a test compares with this text. */
static int print_parameters(void)
{
    struct ui ui = {0};
    const struct cranny_bake_params bake = cranny_bake_params_default();
    printf(
        "# Parameters\n\n"
        "Made from the parameter tables by `cranny --dump-parameters`; do not edit.\n"
        "Each is an option of the command (`distance_long` is `--distance-long`), a member of a\n"
        "preset file, and a field of the library's parameter struct. A default of `nan` means\n"
        "\"chosen from the scene\" and is `null` in a preset. `render` also takes `--radius` for\n"
        "`radius_world` and `--cpu-mask` for `isa`; its methods have a column for each preset, of\n"
        "which `calibrated` is the default.\n\n"
        "## bake\n\n");
    options_markdown(cranny_bake_param_table(), &(struct option_column){"default", &bake}, 1,
                     stdout);
    for (int m = 0; m < METHOD_COUNT; m++)
        print_method(&methods[m]);
    return ui_finish_output(&ui);
}

int main(int argc, char **argv)
{
    ui_catch_signals();
    const char *word = argc > 1 ? argv[1] : "";
    if (argc < 2) {
        fprintf(stderr, "cranny: no command given; see 'cranny --help'\n");
        return cranny_exit_status(CRANNY_USAGE);
    }
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0)
        return print_help();
    if (strcmp(word, "--version") == 0)
        return print_version();
    if (strcmp(word, "--dump-parameters") == 0)
        return print_parameters();
    for (int i = 0; i < COMMAND_COUNT; i++)
        if (strcmp(word, commands[i].name) == 0)
            return commands[i].run(argc - 2, argv + 2);
    return refuse_command(word);
}
