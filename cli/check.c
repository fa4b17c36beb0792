#include "commands.h"

static const char *severity_name(enum cranny_severity severity)
{
    switch (severity) {
    case CRANNY_SEVERITY_ERROR:
        return "error";
    case CRANNY_SEVERITY_WARNING:
        return "warning";
    case CRANNY_SEVERITY_NOTE:
        return "note";
    }
    return "note";
}

struct findings {
    struct ui *ui;
    json_t *list;
    int counts[3]; /* by severity */
};

static void on_finding(void *user, enum cranny_severity severity, const char *code,
                       const char *text)
{
    struct findings *findings = user;
    findings->counts[severity]++;
    if (findings->ui->json)
        json_array_append_new(findings->list,
                              json_pack("{ss ss so}", "severity", severity_name(severity), "code",
                                        code, "text", json_text(text)));
    else if (severity != CRANNY_SEVERITY_NOTE || !findings->ui->quiet)
        printf("%s: %s: %s\n", severity_name(severity), code, text);
}

static int print_result(struct ui *ui, const char *path, struct findings *findings)
{
    const int *counts = findings->counts;
    if (ui->json) {
        json_t *object =
            json_pack("{so sO si si si}", "input", json_text(path), "findings", findings->list,
                      "errors", counts[CRANNY_SEVERITY_ERROR], "warnings",
                      counts[CRANNY_SEVERITY_WARNING], "notes", counts[CRANNY_SEVERITY_NOTE]);
        return ui_print_json(ui, object);
    }
    if (!ui->quiet)
        printf("%s: %d errors, %d warnings, %d notes\n", path, counts[CRANNY_SEVERITY_ERROR],
               counts[CRANNY_SEVERITY_WARNING], counts[CRANNY_SEVERITY_NOTE]);
    return ui_finish_output(ui);
}

static int check_scene(struct ui *ui, const char *path, const struct load_options *load)
{
    struct cranny_error why;
    struct cranny_scene *scene;
    struct findings findings = {.ui = ui, .list = json_array()};
    enum cranny_status status = load_scene(ui, path, load, &scene, &why);
    ui_erase(ui);
    if (status == CRANNY_OK)
        status = cranny_scene_check(scene, on_finding, &findings, &why);
    int exit = status == CRANNY_OK ? print_result(ui, path, &findings) : ui_fail(ui, &why);
    if (exit == 0 && findings.counts[CRANNY_SEVERITY_ERROR])
        exit = cranny_exit_status(CRANNY_INPUT);
    json_decref(findings.list);
    cranny_scene_destroy(&scene);
    return exit;
}

int command_check(int argc, char **argv)
{
    struct ui ui = {0};
    struct load_options load = load_options_default();
    struct option_group groups[] = {load_options, ui_options};
    groups[0].target = &load;
    groups[1].target = &ui;
    const char *path = NULL;
    struct interface face = {
        .command = "check",
        .usage = "SCENE",
        .summary =
            "Looks a scene over before it is baked: what is broken, what may spoil the outcome, "
            "and\n"
            "which distances fit when the file's unit is not the metre. One finding a line:\n"
            "severity, code, text. Exit status 3 when there is an error among them.",
        .examples = "  cranny check level.glb\n"
                    "  cranny check --json level.glb | jq '.findings[].code'\n",
        .groups = groups,
        .group_count = 2,
        .operands = &path,
        .operand_limit = 1,
    };
    int status = begin_command(&face, &ui, argc, argv);
    if (status < 0)
        status = check_scene(&ui, path, &load);
    ui_end(&ui);
    return status;
}
