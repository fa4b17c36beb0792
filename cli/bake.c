#include "bake.h"

#include "commands.h"
#include "paths.h"

#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *const output_names[] = {"occlusion", "color", "attribute", NULL};

static const struct option bake_rows[] = {
    {.name = "output",
     .letter = 'o',
     .type = OPTION_TEXT,
     .offset = offsetof(struct bake_options, output),
     .value = "OUT",
     .help = "file to write, .glb or .gltf (default: NAME-ao.glb beside SCENE, NAME-ao.gltf for a "
             ".gltf); it may be SCENE itself"},
    {.name = "to",
     .type = OPTION_CHOICE,
     .offset = offsetof(struct bake_options, to),
     .choices = output_names,
     .help = "where the values go: an occlusion texture through a new TEXCOORD_n (default; "
             "dims ambient light only), multiplied into COLOR_0 (dims all light), or an _AO "
             "attribute (for your own shader)"},
    {.name = "raw",
     .type = OPTION_FLAG,
     .offset = offsetof(struct bake_options, raw),
     .help = "with --to attribute: both distances, unblended, as VEC2 (long, short)"},
    {.name = "replace",
     .type = OPTION_FLAG,
     .offset = offsetof(struct bake_options, replace),
     .help = "with --to occlusion: displace occlusion textures that are already there"},
    {.name = "expand",
     .type = OPTION_FLAG,
     .offset = offsetof(struct bake_options, expand),
     .help = "give linear instances, shrubs and grass copies of their mesh with final values, for "
             "viewers that do not multiply by the coefficients beside it"},
    {.name = "report",
     .type = OPTION_TEXT,
     .offset = offsetof(struct bake_options, report),
     .value = "OUT.html",
     .help = "also write a page: seconds and bytes per stage, and for each mesh what was buried, "
             "how well its vertices hold the signal, and what would mend it"},
    {.name = "cache",
     .type = OPTION_TEXT,
     .offset = offsetof(struct bake_options, cache),
     .value = "DIR",
     .help =
         "folder that keeps what the next bake of SCENE with the same parameters can take over: "
         "all that no change reaches by more than reuse_limit (6 bytes a sample, 8 a vertex; made "
         "when missing, may be deleted at any time)"},
    {.name = "ground",
     .type = OPTION_OPTIONAL,
     .offset = offsetof(struct bake_options, ground),
     .value = "HEIGHT",
     .help = "add an occluding plane, which is not written, under everything or at y = HEIGHT "
             "metres"},
    {.name = "preview",
     .type = OPTION_TEXT,
     .offset = offsetof(struct bake_options, preview),
     .value = "OUT.png",
     .help = "also write a picture of the baked values"},
    {.name = "preview-size",
     .type = OPTION_SIZE,
     .offset = offsetof(struct bake_options, preview_size),
     .value = "WxH",
     .minimum = 1,
     .maximum = 16384,
     .help = "its size in pixels (default 1280x720)"},
    {.name = "preview-camera",
     .type = OPTION_INT,
     .offset = offsetof(struct bake_options, preview_camera),
     .value = "N",
     .maximum = INT_MAX,
     .help = "which of the file's cameras, from 0 (default: the first, else a fitting view)"},
};

static const char summary[] =
    "Gives back the scene with ambient obscurance on its vertices. Everything else in a glTF file\n"
    "stays as it was; other formats come out as .glb. Distances are metres: 'cranny check SCENE'\n"
    "tells when the file's unit is another. The output appears whole or not at all.";

static const char examples[] =
    "  cranny bake level.glb                            writes level-ao.glb\n"
    "  cranny bake level.glb --preview level.png        and a picture to look at\n"
    "  cranny bake car.obj -o car.glb --ground          an object, standing on something\n"
    "  cranny bake room.glb --to color --rays 64        for viewers without occlusion textures\n"
    "  cranny bake map.gltf --to attribute --raw        both distances, for your own shader\n"
    "  cranny bake part.glb --distance-long 0.3 --distance-short 0.002      a small thing\n"
    "  cranny bake level.glb --json | jq .seconds\n"
    "  cranny bake level.glb --cache ~/.cranny          the next time, only what changed\n"
    "  cranny bake level.glb --role tree='Tree_*' --role shrub='Bush*' --report level.html\n"
    "  cranny bake a.glb --json | jq .parameters > p.json; cranny bake b.glb --preset p.json\n";

static void print_result(const struct job *job)
{
    const struct cranny_bake_report *r = &job->report;
    char vertices[32], triangles[32], samples[32], rays[32];
    printf("%s: %s vertices, %s triangles; %s samples, %s rays at %.1f Mrays/s; %.2f s\n",
           job->output, short_count((double)r->vertices, vertices),
           short_count((double)r->triangles, triangles), short_count((double)r->samples, samples),
           short_count((double)r->rays, rays), r->mrays_per_s, job->total_s);
    char text[160];
    if (bake_reuse_text(r, text))
        printf("%s: %s\n", job->options.cache, text);
    if (!job->ui.verbose)
        return;
    fprintf(stderr,
            "cranny: seconds: load %.3f, bvh %.3f, sample %.3f, trace %.3f, solve %.3f, instances "
            "%.3f, levels %.3f, write %.3f\n"
            "cranny: %" PRIu64 " buried samples dropped; fit rms %.4f; %" PRIu64
            " vertices extrapolated; peak %.0f MiB\n",
            job->load_s, r->seconds_bvh, r->seconds_sample, r->seconds_trace, r->seconds_solve,
            r->seconds_local + r->seconds_volume + r->seconds_linear + r->seconds_scalar,
            r->seconds_resample + r->seconds_lod, job->write_s, r->invalid_samples, r->fit_rms,
            r->unsampled_vertices, (double)bake_peak_bytes() / 1048576);
}

static enum cranny_status apply_ground(struct job *job, struct cranny_error *why)
{
    const char *height = job->options.ground;
    if (!height)
        return CRANNY_OK;
    job->params.ground = true;
    if (!*height)
        return CRANNY_OK;
    struct cranny_error inner;
    if (cranny_params_set(cranny_bake_param_table(), &job->params, "ground_height", height,
                          &inner) == CRANNY_OK)
        return CRANNY_OK;
    return refuse(why, CRANNY_USAGE, "--ground: %.900s", inner.message);
}

static const char *scene_ending(const char *input)
{
    char extension[9];
    path_extension(input, extension);
    return strcmp(extension, ".gltf") == 0 ? "-ao.gltf" : "-ao.glb";
}

/* What can be refused before anything is read. */
static enum cranny_status check_options(struct job *job, struct cranny_error *why)
{
    static const char *const scenes[] = {".glb", ".gltf", NULL}, *const pictures[] = {".png", NULL},
                             *const pages[] = {".html", NULL};
    const struct bake_options *options = &job->options;
    if (options->raw && options->to != CRANNY_OUTPUT_ATTRIBUTE)
        return refuse(why, CRANNY_USAGE, "--raw goes with --to attribute only");
    if (options->replace && options->to != CRANNY_OUTPUT_OCCLUSION)
        return refuse(why, CRANNY_USAGE, "--replace goes with --to occlusion only");
    enum cranny_status status = apply_ground(job, why);
    if (status != CRANNY_OK)
        return status;
    job->output = options->output ? strdup(options->output)
                                  : path_default_output(job->input, scene_ending(job->input));
    if (!job->output)
        return refuse(why, CRANNY_MEMORY, "out of memory for the output's name");
    status = path_check_extension(job->output, scenes, "-o", why);
    if (status == CRANNY_OK && options->preview)
        status = path_check_extension(options->preview, pictures, "--preview", why);
    if (status == CRANNY_OK && options->report)
        status = path_check_extension(options->report, pages, "--report", why);
    return status;
}

/* Whether the folder takes files, or can be made. */
static enum cranny_status check_cache(const char *folder, struct cranny_error *why)
{
    static const char name[] = "/state";
    struct stat info;
    if (stat(folder, &info) != 0)
        return path_check_output(folder, why);
    if (!S_ISDIR(info.st_mode))
        return refuse(why, CRANNY_FAILED, "--cache: %.900s: is a file, not a folder", folder);
    char *inside = malloc(strlen(folder) + sizeof name);
    if (!inside)
        return refuse(why, CRANNY_MEMORY, "--cache: out of memory");
    strcat(strcpy(inside, folder), name);
    const enum cranny_status status = path_check_output(inside, why);
    free(inside);
    return status;
}

static enum cranny_status check_outputs(const struct job *job, struct cranny_error *why)
{
    /* Without an input there is more to say than that the folder beside it is missing, too. */
    if (access(job->input, F_OK) != 0)
        return CRANNY_OK;
    enum cranny_status status = path_check_output(job->output, why);
    if (status == CRANNY_OK && job->options.preview)
        status = path_check_output(job->options.preview, why);
    if (status == CRANNY_OK && job->options.report)
        status = path_check_output(job->options.report, why);
    if (status == CRANNY_OK && job->options.cache)
        status = check_cache(job->options.cache, why);
    return status;
}

static enum cranny_status read_scene(struct job *job, struct cranny_error *why)
{
    double begin_s = clock_s();
    enum cranny_status status = load_scene(&job->ui, job->input, &job->load, &job->scene, why);
    job->load_s = clock_s() - begin_s;
    if (status != CRANNY_OK)
        return status;
    uint32_t cameras = cranny_scene_camera_count(job->scene);
    if (job->options.preview_camera >= 0 && (uint32_t)job->options.preview_camera >= cameras)
        return refuse(why, CRANNY_USAGE, "--preview-camera: %.800s has %" PRIu32 " cameras",
                      job->input, cameras);
    return CRANNY_OK;
}

static enum cranny_status write_scene(struct job *job, struct cranny_error *why)
{
    if (ui_interrupted())
        return refuse(why, CRANNY_CANCELLED, "interrupted");
    struct cranny_save_params save = cranny_save_params_default();
    save.to = (enum cranny_output)job->options.to;
    save.raw = job->options.raw;
    save.replace = job->options.replace;
    save.expand = job->options.expand;
    save.hooks = &job->ui.hooks;
    double begin_s = clock_s();
    enum cranny_status status = cranny_scene_save(job->scene, job->bake, job->output, &save, why);
    job->write_s = clock_s() - begin_s;
    return status;
}

static enum cranny_status write_preview(struct job *job, struct cranny_error *why)
{
    if (!job->options.preview)
        return CRANNY_OK;
    size_t width = (size_t)job->options.preview_size[0];
    size_t height = (size_t)job->options.preview_size[1];
    uint8_t *pixels = calloc(width * height, 3);
    if (!pixels)
        return refuse(why, CRANNY_MEMORY, "--preview-size: %zux%zu does not fit in memory", width,
                      height);
    struct cranny_preview_params preview = cranny_preview_params_default();
    preview.threads = job->params.threads;
    preview.hooks = &job->ui.hooks;
    enum cranny_status status =
        cranny_preview_render(job->scene, job->bake, job->options.preview_camera, (int)width,
                              (int)height, &preview, pixels, why);
    if (status == CRANNY_OK)
        status = cranny_png_write(job->options.preview, (int)width, (int)height, 3, pixels,
                                  3 * width, why);
    free(pixels);
    return status;
}

static enum cranny_status run(struct job *job, struct cranny_error *why)
{
    double begin_s = clock_s();
    enum cranny_status status = check_outputs(job, why);
    if (status == CRANNY_OK)
        status = read_scene(job, why);
    if (status == CRANNY_OK) {
        struct cranny_error own = {0};
        job->params.hooks = &job->ui.hooks;
        job->params.cache_folder = job->options.cache;
        job->params.cache_name = path_name(job->input);
        job->ui.rays_per_sample = job->params.adaptive ? 0 : job->params.rays;
        status = cranny_bake_create(job->scene, &job->params, &job->bake, &own);
        if (status == CRANNY_INPUT)
            refuse(why, status, "%s: %s", job->input, own.message);
        else if (status != CRANNY_OK)
            *why = own;
    }
    if (status == CRANNY_OK) {
        cranny_bake_get_report(job->bake, &job->report);
        status = write_scene(job, why);
    }
    if (status == CRANNY_OK)
        job->ui.written = job->output;
    double preview_s = clock_s();
    if (status == CRANNY_OK)
        status = write_preview(job, why);
    job->preview_s = clock_s() - preview_s;
    job->total_s = clock_s() - begin_s;
    if (status == CRANNY_OK && job->options.report)
        status = bake_write_report(job, why);
    return status;
}

static int finish(struct job *job, enum cranny_status status, const struct cranny_error *why)
{
    if (status != CRANNY_OK)
        return ui_fail(&job->ui, why);
    ui_erase(&job->ui);
    if (job->ui.json)
        return ui_print_json(&job->ui, bake_json(job, output_names[job->options.to]));
    if (!job->ui.quiet)
        print_result(job);
    return ui_finish_output(&job->ui);
}

int command_bake(int argc, char **argv)
{
    struct job job = {
        .load = load_options_default(),
        .params = cranny_bake_params_default(),
        .options = {.preview_size = {1280, 720}, .preview_camera = -1},
    };
    struct option_group groups[] = {
        {"Output", bake_rows, sizeof bake_rows / sizeof *bake_rows, &job.options},
        load_options,
        ui_options};
    groups[1].target = &job.load;
    groups[2].target = &job.ui;
    struct interface face = {
        .command = "bake",
        .usage = "SCENE [-o OUT] [OPTION...]",
        .summary = summary,
        .examples = examples,
        .groups = groups,
        .group_count = sizeof groups / sizeof *groups,
        .table = cranny_bake_param_table(),
        .params = &job.params,
        .operands = &job.input,
        .operand_limit = 1,
    };
    int exit = begin_command(&face, &job.ui, argc, argv);
    if (exit < 0) {
        struct cranny_error why;
        enum cranny_status status = check_options(&job, &why);
        if (status == CRANNY_OK)
            status = run(&job, &why);
        exit = finish(&job, status, &why);
    }
    cranny_bake_destroy(&job.bake);
    cranny_scene_destroy(&job.scene);
    free(job.output);
    ui_end(&job.ui);
    return exit;
}
