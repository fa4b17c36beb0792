#include "commands.h"
#include "paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct diff_options {
    const char *map;
    double scale, fail_above;
};

struct diff {
    struct ui ui;
    struct diff_options options;
    const char *paths[2];
    struct cranny_image images[2];
    struct cranny_difference result;
};

static const struct option diff_rows[] = {
    {.name = "map",
     .type = OPTION_TEXT,
     .offset = offsetof(struct diff_options, map),
     .value = "OUT.png",
     .help = "also write a picture of A's error: white where equal, blue where A is too dark, red "
             "where it is too bright"},
    {.name = "scale",
     .type = OPTION_NUMBER,
     .offset = offsetof(struct diff_options, scale),
     .value = "S",
     .maximum = 1,
     .help = "the difference that gets the map's full colour, above 0 to 1 (default 0.25)"},
    {.name = "fail-above",
     .type = OPTION_NUMBER,
     .offset = offsetof(struct diff_options, fail_above),
     .value = "E",
     .maximum = 1000,
     .help = "exit with status 1 when the error (eq. 31) is above E; for tests"},
};

static enum cranny_status read_images(struct diff *diff, struct cranny_error *why)
{
    for (int i = 0; i < 2; i++) {
        enum cranny_status status =
            cranny_image_read(diff->paths[i], CRANNY_IMAGE_VALUE, &diff->images[i], why);
        if (status == CRANNY_OK && ui_interrupted())
            status = refuse(why, CRANNY_CANCELLED, "interrupted");
        if (status != CRANNY_OK)
            return status;
    }
    const struct cranny_image *a = &diff->images[0], *b = &diff->images[1];
    if (a->width != b->width || a->height != b->height)
        return refuse(why, CRANNY_INPUT,
                      "%.400s: %d x %d pixels, but %.400s has %d x %d; give two of one size",
                      diff->paths[0], a->width, a->height, diff->paths[1], b->width, b->height);
    return CRANNY_OK;
}

static enum cranny_status write_map(const struct diff *diff, struct cranny_error *why)
{
    const struct cranny_image *a = &diff->images[0], *b = &diff->images[1];
    if (!diff->options.map)
        return CRANNY_OK;
    uint8_t *rgb = calloc((size_t)a->width * (size_t)a->height, 3);
    if (!rgb)
        return refuse(why, CRANNY_MEMORY, "%.900s: out of memory", diff->options.map);
    enum cranny_status status = cranny_difference_map(a->width, a->height, a->pixels, 0, b->pixels,
                                                      0, (float)diff->options.scale, rgb, why);
    if (status == CRANNY_OK)
        status = cranny_png_write(diff->options.map, a->width, a->height, 3, rgb,
                                  (size_t)a->width * 3, why);
    free(rgb);
    return status;
}

static enum cranny_status check_map(const struct diff_options *options, struct cranny_error *why)
{
    char extension[9];
    if (!(options->scale > 0))
        return refuse(why, CRANNY_USAGE, "--scale: must be above 0");
    if (!options->map)
        return CRANNY_OK;
    path_extension(options->map, extension);
    if (strcmp(extension, ".png") != 0)
        return refuse(why, CRANNY_USAGE, "%.900s: --map takes a name that ends in .png",
                      options->map);
    return path_check_output(options->map, why);
}

static enum cranny_status run(struct diff *diff, struct cranny_error *why)
{
    enum cranny_status status = check_map(&diff->options, why);
    if (status == CRANNY_OK)
        status = read_images(diff, why);
    const struct cranny_image *a = &diff->images[0], *b = &diff->images[1];
    if (status == CRANNY_OK)
        status = cranny_difference_measure(a->width, a->height, a->pixels, 0, b->pixels, 0,
                                           &diff->result, why);
    return status == CRANNY_OK ? write_map(diff, why) : status;
}

static int print_result(struct diff *diff)
{
    const struct cranny_difference *d = &diff->result;
    const struct cranny_image *a = &diff->images[0];
    if (diff->ui.json)
        return ui_print_json(
            &diff->ui,
            json_pack("{sf sf so sf sf so so si si}", "error", d->error, "rmse", d->rmse, "psnr",
                      isfinite(d->psnr) ? json_real(d->psnr) : json_null(), "max_abs", d->max_abs,
                      "mean", d->mean, "a", json_text(diff->paths[0]), "b",
                      json_text(diff->paths[1]), "width", a->width, "height", a->height));
    if (!diff->ui.quiet)
        printf("error %.4f (eq. 31), rmse %.5f, psnr %.2f dB, largest %.4f, mean %+.5f; "
               "%d x %d pixels\n",
               d->error, d->rmse, d->psnr, d->max_abs, d->mean, a->width, a->height);
    return ui_finish_output(&diff->ui);
}

static int finish(struct diff *diff, enum cranny_status status, struct cranny_error *why)
{
    if (status != CRANNY_OK)
        return ui_fail(&diff->ui, why);
    int exit = print_result(diff);
    if (exit == 0 && diff->result.error > diff->options.fail_above) {
        refuse(why, CRANNY_FAILED, "%.400s: its error %.6g against %.400s is above %g",
               diff->paths[0], diff->result.error, diff->paths[1], diff->options.fail_above);
        exit = ui_fail(&diff->ui, why);
    }
    return exit;
}

int command_diff(int argc, char **argv)
{
    struct diff diff = {.options = {.scale = 0.25, .fail_above = INFINITY}};
    struct option_group groups[] = {
        {"Comparing", diff_rows, sizeof diff_rows / sizeof *diff_rows, &diff.options}, ui_options};
    groups[1].target = &diff.ui;
    struct interface face = {
        .command = "diff",
        .usage = "A B",
        .summary =
            "The error of visibility image A against image B, the reference: the perceptual error\n"
            "of the ambient occlusion volumes paper (eq. 31; 0 is equal, its methods had 0.3 to "
            "7),\n"
            "root mean square, PSNR, the largest and the mean difference (below 0: A is too "
            "dark).\n"
            "PNG, PFM and, where the build has it, OpenEXR; one channel is compared (Y, V or R).",
        .examples = "  cranny diff ssao.png truth.exr\n"
                    "  cranny diff ssao.png truth.exr --map error.png --scale 0.1\n"
                    "  cranny diff new.pfm old.pfm --fail-above 0.01 --quiet || echo changed\n"
                    "  cranny diff ssao.png truth.exr --json | jq .error\n",
        .groups = groups,
        .group_count = 2,
        .operands = diff.paths,
        .operand_limit = 2,
        .operand_minimum = 2,
        .lacking = "two images are due",
    };
    int exit = begin_command(&face, &diff.ui, argc, argv);
    if (exit < 0) {
        struct cranny_error why;
        enum cranny_status status = run(&diff, &why);
        exit = finish(&diff, status, &why);
    }
    for (int i = 0; i < 2; i++)
        cranny_image_free(&diff.images[i]);
    ui_end(&diff.ui);
    return exit;
}
