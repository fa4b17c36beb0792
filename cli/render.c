#include "render.h"

#include "paths.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const bit_names[] = {"8", "16", NULL};

static const struct option render_rows[] = {
    {.name = "method",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct render_options, method),
     .choices = method_names,
     .help = "how visibility is estimated (default alchemy); raytrace is the truth that the others "
             "approximate; it and volumes are for scenes. Each has parameters of its own: 'cranny "
             "render --method "
             "hbao --help' lists hbao's"},
    {.name = "output",
     .letter = 'o',
     .type = OPTION_TEXT,
     .offset = offsetof(struct render_options, output),
     .value = "OUT",
     .help = "picture to write, white is open: .png, .pfm or .exr (default: NAME-ao.png beside the "
             "input, NAME-lit.png with --lit)"},
    {.name = "bits",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct render_options, bits),
     .choices = bit_names,
     .help = "bits of a value: 8 (default) or 16 in a .png, 16 in an .exr (default there: 32)"},
    {.name = "lit",
     .type = OPTION_FLAG,
     .offset = offsetof(struct render_options, lit),
     .help = "write the scene's colours under ambient light times visibility instead, as .png"},
    {.name = "exposure",
     .type = OPTION_POSITIVE,
     .offset = offsetof(struct render_options, exposure),
     .value = "X",
     .help = "factor on the light of a --lit picture (default: from the picture's mean); for "
             "pictures to compare"},
    {.name = "gbuffer",
     .type = OPTION_TEXT,
     .offset = offsetof(struct render_options, gbuffer),
     .value = "PREFIX",
     .help = "also write what the method saw of the scene: PREFIX-depth.exr, PREFIX-normal.exr "
             "(.pfm in a build without OpenEXR), and PREFIX.json with the projection and the "
             "command that reads them back"},
    {.name = "repeat",
     .type = OPTION_INT,
     .offset = offsetof(struct render_options, repeat),
     .value = "N",
     .minimum = 1,
     .maximum = 10000,
     .help = "render N times in the same memory and report the times of the median run"},
};

static const char summary[] =
    "How much ambient light reaches what a picture shows: visibility from 0 to 1, 1 = open. The\n"
    "picture is of a scene, or a depth buffer that another renderer wrote. Distances are metres;\n"
    "--radius, where an occluder stops counting, is the parameter that matters most. The output\n"
    "appears whole or not at all. --cpu-mask and --threads never change a bit of it.\n"
    "The options below 'Parameters' are those of the method given with --method.";

static const char examples[] =
    "  cranny render level.glb                                writes level-ao.png\n"
    "  cranny render level.glb --method raytrace --rays 1024 -o truth.exr\n"
    "  cranny render level.glb --method volumes --spacing 5   analytic; one pixel in 25\n"
    "  cranny render level.glb --eye 3,2,5 --target 0,1,0 --radius 1 --lit -o view.png\n"
    "  cranny render --depth depth.exr --normal normal.exr --fov 60 -o ao.png\n"
    "  cranny render --depth depth.png --depth-kind device --reversed --near 0.1 --fov 70\n"
    "  cranny render level.glb --gbuffer frame && cat frame.json    depth and normals to keep\n"
    "  cranny render level.glb --preset paper --set samples=24 --json | jq .milliseconds\n"
    "  cranny render --method hbao --help                     hbao's parameters\n";

static enum cranny_status check_combinations(const struct render *render, struct cranny_error *why)
{
    const struct render_options *options = &render->options;
    if (!render->depth.depth)
        return CRANNY_OK;
    if (render->method->kind->needs_scene)
        return refuse(why, CRANNY_USAGE,
                      "--method %s needs a scene: a depth image holds nothing behind what it "
                      "shows; raymarch is the nearest",
                      render->method->name);
    if (options->lit || options->gbuffer)
        return refuse(why, CRANNY_USAGE, "--%s goes with a scene, not with --depth",
                      options->lit ? "lit" : "gbuffer");
    return CRANNY_OK;
}

/* Someone who names a picture as the scene forgot an option, and hardly mistook the file. */
static enum cranny_status check_scene_name(const struct render *render, struct cranny_error *why)
{
    static const char *const pictures[] = {".exr", ".pfm", ".png"};
    char extension[9];
    if (render->depth.depth)
        return CRANNY_OK;
    path_extension(render->input, extension);
    for (size_t i = 0; i < sizeof pictures / sizeof *pictures; i++)
        if (strcmp(extension, pictures[i]) == 0)
            return refuse(why, CRANNY_USAGE,
                          "%.400s: is a picture, not a scene; did you mean "
                          "'cranny render --depth %.400s'?",
                          render->input, render->input);
    return CRANNY_OK;
}

static enum cranny_status check_picture(const struct render *render, struct cranny_error *why)
{
    static const char *const pictures[] = {".png", ".pfm", ".exr", NULL};
    const struct render_options *options = &render->options;
    const char *path = render->output;
    char extension[9];
    path_extension(path, extension);
    const bool png = strcmp(extension, ".png") == 0, exr = strcmp(extension, ".exr") == 0;
    if (options->lit && options->bits == 1)
        return refuse(why, CRANNY_USAGE, "--bits 16: a --lit picture has 8");
    if (!options->lit && option_given(render->face, "exposure"))
        return refuse(why, CRANNY_USAGE, "--exposure goes with --lit");
    if (options->lit && !png)
        return refuse(why, CRANNY_USAGE, "%.900s: --lit takes a name that ends in .png", path);
    const enum cranny_status status = path_check_extension(path, pictures, "-o", why);
    if (status != CRANNY_OK)
        return status;
    if (exr && !cranny_image_has_exr())
        return refuse(why, CRANNY_USAGE,
                      "%.900s: this build is without OpenEXR; write .pfm, or build Cranny with it",
                      path);
    if (options->bits >= 0 && !(png || (exr && options->bits == 1)))
        return refuse(why, CRANNY_USAGE, "%.800s: --bits %s is not for %s", path,
                      bit_names[options->bits], extension);
    return CRANNY_OK;
}

/* What can be refused before anything is read. */
static enum cranny_status check_options(struct render *render, struct cranny_error *why)
{
    enum cranny_status status = check_scene_name(render, why);
    if (status == CRANNY_OK)
        status = check_combinations(render, why);
    if (status == CRANNY_OK)
        status = depth_options_check(render->face, &render->depth, &render->view, why);
    if (status == CRANNY_OK)
        status = scene_options_check(render, why);
    if (status != CRANNY_OK)
        return status;
    render->input = render->depth.depth ? render->depth.depth : render->input;
    render->output =
        render->options.output
            ? strdup(render->options.output)
            : path_default_output(render->input, render->options.lit ? "-lit.png" : "-ao.png");
    if (!render->output)
        return refuse(why, CRANNY_MEMORY, "out of memory for the output's name");
    status = check_picture(render, why);
    return status == CRANNY_OK ? gbuffer_name_files(render, why) : status;
}

static enum cranny_status check_outputs(const struct render *render, struct cranny_error *why)
{
    const char *normal = render->depth.normal;
    /* Without an input there is more to say than that the folder beside it is missing, too. */
    if (access(render->input, F_OK) != 0)
        return CRANNY_OK;
    if (path_same_file(render->output, render->input) ||
        (normal && path_same_file(render->output, normal)))
        return refuse(why, CRANNY_USAGE, "%.900s: is the input; choose another name with -o",
                      render->output);
    const enum cranny_status status = path_check_output(render->output, why);
    return status == CRANNY_OK ? gbuffer_check_files(render, why) : status;
}

static enum cranny_status write_lit(const struct render *render, struct cranny_error *why)
{
    const size_t width = (size_t)render->gbuffer.viewport.width;
    const size_t height = (size_t)render->gbuffer.viewport.height;
    struct cranny_light light = cranny_light_default();
    light.exposure = (float)render->options.exposure;
    uint8_t *rgb = calloc(width * height, 3);
    if (!rgb)
        return refuse(why, CRANNY_MEMORY, "%.900s: out of memory", render->output);
    enum cranny_status status = cranny_frame_shade(render->frame, render->visibility, 0, &light,
                                                   *render->fields.threads, rgb, why);
    if (status == CRANNY_OK)
        status = cranny_png_write(render->output, (int)width, (int)height, 3, rgb, 3 * width, why);
    free(rgb);
    return status;
}

static enum cranny_status write_files(struct render *render, struct cranny_error *why)
{
    const double begin_s = clock_s();
    enum cranny_status status;
    if (ui_interrupted())
        return refuse(why, CRANNY_CANCELLED, "interrupted");
    if (render->options.lit)
        status = write_lit(render, why);
    else
        status = cranny_image_write(render->output, CRANNY_IMAGE_VALUE,
                                    (enum cranny_image_bits)(render->options.bits + 1),
                                    render->gbuffer.viewport.width, render->gbuffer.viewport.height,
                                    1, render->visibility, 0, why);
    if (status == CRANNY_OK) {
        render->ui.written = render->output;
        status = gbuffer_write(render, why);
    }
    render->write_s = clock_s() - begin_s;
    return status;
}

static enum cranny_status run(struct render *render, struct cranny_error *why)
{
    const double begin_s = clock_s();
    enum cranny_status status = check_outputs(render, why);
    if (status == CRANNY_OK)
        status = render->depth.depth ? render_read(render, why) : render_draw(render, why);
    if (status == CRANNY_OK)
        status = render_estimate(render, why);
    if (status == CRANNY_OK)
        status = write_files(render, why);
    render->total_s = clock_s() - begin_s;
    return status;
}

static void destroy(struct render *render)
{
    cranny_frame_destroy(&render->frame);
    cranny_tracer_destroy(&render->tracer);
    cranny_scene_destroy(&render->scene);
    depth_frame_free(&render->image);
    free(render->visibility);
    free(render->output);
    for (int i = 0; i < 3; i++)
        free(render->gbuffer_files[i]);
    ui_end(&render->ui);
}

static void choose_parameters(struct render *render, struct interface *face)
{
    const struct method *method = &methods[render->options.method];
    render->method = method;
    render->fields = method_fields(method, &render->params);
    method_params_preset(method, NULL, &render->params);
    face->table = method_table(method);
    face->params = &render->params;
    face->presets = method_presets(method);
    face->apply_preset = method->kind->apply;
    if (method->kind->needs_scene)
        face->usage = "SCENE [-o OUT] [OPTION...]";
}

int command_render(int argc, char **argv)
{
    struct render render = {
        .load = load_options_default(),
        .options = {.method = (int)(method_named(argc, argv, &methods[METHOD_ALCHEMY]) - methods),
                    .bits = -1,
                    .repeat = 1},
        .view_scene = scene_options_default(),
        .depth = depth_options_default(),
        .view = view_options_default(),
    };
    struct option_group groups[] = {
        {"Output", render_rows, sizeof render_rows / sizeof *render_rows, &render.options},
        scene_options,
        load_options,
        depth_options,
        view_options,
        ui_options};
    void *const targets[] = {&render.options, &render.view_scene, &render.load,
                             &render.depth,   &render.view,       &render.ui};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
        groups[i].target = targets[i];
    struct interface face = {
        .command = "render",
        .usage = "SCENE | --depth FILE [--normal FILE] [-o OUT] [OPTION...]",
        .summary = summary,
        .examples = examples,
        .groups = groups,
        .group_count = sizeof groups / sizeof *groups,
        .operands = &render.input,
        .operand_limit = 1,
        .lacking = "no scene and no --depth given",
        .instead = &render.depth.depth,
    };
    char command[64];
    choose_parameters(&render, &face);
    snprintf(command, sizeof command, "render --method %s", render.method->name);
    if (render.options.method != METHOD_ALCHEMY)
        face.command = command;
    render.face = &face;
    int exit = begin_command(&face, &render.ui, argc, argv);
    if (exit < 0) {
        struct cranny_error why;
        enum cranny_status status = check_options(&render, &why);
        if (status == CRANNY_OK)
            status = run(&render, &why);
        exit = status == CRANNY_OK ? render_print(&render) : ui_fail(&render.ui, &why);
    }
    destroy(&render);
    return exit;
}
