#include "check.h"

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

void findings_add(void *user, enum cranny_severity severity, const char *code, const char *text)
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

int findings_print(struct findings *findings, json_t *advice)
{
    struct ui *ui = findings->ui;
    const int *counts = findings->counts;
    int exit;
    if (ui->json) {
        json_t *object =
            json_pack("{so sO si si si}", "input", json_text(findings->path), "findings",
                      findings->list, "errors", counts[CRANNY_SEVERITY_ERROR], "warnings",
                      counts[CRANNY_SEVERITY_WARNING], "notes", counts[CRANNY_SEVERITY_NOTE]);
        if (advice)
            json_object_set_new(object, "advice", advice);
        exit = ui_print_json(ui, object);
    } else {
        json_decref(advice);
        if (!ui->quiet)
            printf("%s: %d errors, %d warnings, %d notes\n", findings->path,
                   counts[CRANNY_SEVERITY_ERROR], counts[CRANNY_SEVERITY_WARNING],
                   counts[CRANNY_SEVERITY_NOTE]);
        exit = ui_finish_output(ui);
    }
    return exit == 0 && counts[CRANNY_SEVERITY_ERROR] ? cranny_exit_status(CRANNY_INPUT) : exit;
}

static enum cranny_status check_scene(const char *path, const struct load_options *load,
                                      struct findings *findings, struct cranny_error *why)
{
    struct cranny_scene *scene;
    enum cranny_status status = load_scene(findings->ui, path, load, &scene, why);
    ui_erase(findings->ui);
    if (status == CRANNY_OK)
        status = cranny_scene_check(scene, findings_add, findings, why);
    cranny_scene_destroy(&scene);
    return status;
}

static const char summary[] =
    "Looks a scene over before it is baked: what is broken, what may spoil the outcome, and\n"
    "which distances fit when the file's unit is not the metre. Or a depth image before it is\n"
    "rendered: what its numbers look like, whether the normals fit them, and which radius, bias\n"
    "and fade fit its scale. One finding a line: severity, code, text. Exit status 3 when there\n"
    "is an error among them.";

static const char examples[] =
    "  cranny check level.glb\n"
    "  cranny check --json level.glb | jq '.findings[].code'\n"
    "  cranny check --depth depth.exr --normal normal.exr --fov 60\n"
    "  cranny check --depth depth.png --depth-kind device --near 0.1 --far 500\n"
    "  cranny check --depth depth.exr --fov 45 --json | jq .advice.radius_world\n";

int command_check(int argc, char **argv)
{
    struct ui ui = {0};
    struct load_options load = load_options_default();
    struct depth_options depth = depth_options_default();
    struct view_options view = view_options_default();
    struct option_group groups[] = {load_options, depth_options, view_options, ui_options};
    groups[0].target = &load;
    groups[1].target = &depth;
    groups[2].target = &view;
    groups[3].target = &ui;
    const char *path = NULL;
    struct interface face = {
        .command = "check",
        .usage = "SCENE | --depth FILE [--normal FILE]",
        .summary = summary,
        .examples = examples,
        .groups = groups,
        .group_count = sizeof groups / sizeof *groups,
        .operands = &path,
        .operand_limit = 1,
        .lacking = "no scene and no --depth given",
        .instead = &depth.depth,
    };
    int exit = begin_command(&face, &ui, argc, argv);
    if (exit < 0) {
        struct cranny_error why;
        struct findings findings = {
            .ui = &ui, .path = depth.depth ? depth.depth : path, .list = json_array()};
        json_t *advice = NULL;
        enum cranny_status status = depth_options_check(&face, &depth, &view, &why);
        if (status == CRANNY_OK && !depth.depth)
            status = options_refuse(&face, &view_options, 0, "--depth FILE", &why);
        if (status == CRANNY_OK)
            status = depth.depth ? check_depth(&depth, &view, &findings, &advice, &why)
                                 : check_scene(path, &load, &findings, &why);
        exit = status == CRANNY_OK ? findings_print(&findings, advice) : ui_fail(&ui, &why);
        json_decref(findings.list);
    }
    ui_end(&ui);
    return exit;
}
