/* --gbuffer: depth, normals, and how to read them back. */
#include "paths.h"
#include "render.h"
#include "shell.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { FILE_DEPTH, FILE_NORMAL, FILE_DESCRIPTION, FILE_COUNT };

static char *join(const char *prefix, const char *suffix)
{
    const size_t length = strlen(prefix) + strlen(suffix) + 1;
    char *path = malloc(length);
    if (path)
        snprintf(path, length, "%s%s", prefix, suffix);
    return path;
}

enum cranny_status gbuffer_name_files(struct render *render, struct cranny_error *why)
{
    const bool exr = cranny_image_has_exr();
    const char *const endings[FILE_COUNT] = {exr ? "-depth.exr" : "-depth.pfm",
                                             exr ? "-normal.exr" : "-normal.pfm", ".json"};
    if (!render->options.gbuffer)
        return CRANNY_OK;
    if (!render->options.gbuffer[0])
        return refuse(why, CRANNY_USAGE, "--gbuffer: the prefix is empty");
    for (int i = 0; i < FILE_COUNT; i++) {
        render->gbuffer_files[i] = join(render->options.gbuffer, endings[i]);
        if (!render->gbuffer_files[i])
            return refuse(why, CRANNY_MEMORY, "out of memory for the names of --gbuffer");
        if (strcmp(render->gbuffer_files[i], render->output) == 0)
            return refuse(why, CRANNY_USAGE, "%.900s: -o and --gbuffer would both write it",
                          render->output);
    }
    return CRANNY_OK;
}

enum cranny_status gbuffer_check_files(const struct render *render, struct cranny_error *why)
{
    for (int i = 0; i < FILE_COUNT && render->gbuffer_files[i]; i++) {
        if (path_same_file(render->gbuffer_files[i], render->input))
            return refuse(why, CRANNY_USAGE, "%.900s: is the input; give --gbuffer another prefix",
                          render->input);
        const enum cranny_status status = path_check_output(render->gbuffer_files[i], why);
        if (status != CRANNY_OK)
            return status;
    }
    return CRANNY_OK;
}

static double view_value(const struct cranny_projection *projection)
{
    const double top = (double)projection->top;
    return projection->kind == CRANNY_ORTHOGRAPHIC ? top : 2 * atan(top) * 180 / PI;
}

static json_t *command_json(const struct render *render)
{
    const struct cranny_gbuffer *g = &render->gbuffer;
    char *command = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&command, &size);
    if (!out)
        return NULL;
    fputs("cranny render --depth ", out);
    shell_path(out, render->gbuffer_files[FILE_DEPTH]);
    fputs(" --normal ", out);
    shell_path(out, render->gbuffer_files[FILE_NORMAL]);
    fprintf(out, " --%s %.9g --viewport %d,%d,%d,%d --guard %d",
            g->projection.kind == CRANNY_ORTHOGRAPHIC ? "ortho" : "fov", view_value(&g->projection),
            g->viewport.x, g->viewport.y, g->viewport.width, g->viewport.height, g->guard_band);
    json_t *text = fclose(out) == 0 ? json_text(command) : NULL;
    free(command);
    return text;
}

static json_t *description(const struct render *render)
{
    const struct cranny_gbuffer *g = &render->gbuffer;
    const bool parallel = g->projection.kind == CRANNY_ORTHOGRAPHIC;
    json_t *matrix = json_array();
    for (int i = 0; i < 12; i++)
        json_array_append_new(matrix, json_real(g->world_from_view[i]));
    json_t *projection =
        json_pack("{ss sf sf sf sf sf}", "kind", parallel ? "orthographic" : "perspective", "left",
                  (double)g->projection.left, "right", (double)g->projection.right, "bottom",
                  (double)g->projection.bottom, "top", (double)g->projection.top,
                  parallel ? "half_height" : "fov_degrees", view_value(&g->projection));
    return json_pack("{so so ss si si s[iiii] si so so so so}", "depth",
                     json_text(render->gbuffer_files[FILE_DEPTH]), "normal",
                     json_text(render->gbuffer_files[FILE_NORMAL]), "depth_kind", "linear", "width",
                     g->width, "height", g->height, "viewport", g->viewport.x, g->viewport.y,
                     g->viewport.width, g->viewport.height, "guard_band", g->guard_band,
                     "projection", projection, "world_from_view", matrix, "input",
                     json_text(render->input), "command", command_json(render));
}

static enum cranny_status write_description(const struct render *render, struct cranny_error *why)
{
    const char *path = render->gbuffer_files[FILE_DESCRIPTION];
    json_t *object = description(render);
    char *text = object ? json_dumps(object, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) : NULL;
    char *lines = text ? join(text, "\n") : NULL;
    json_decref(object);
    free(text);
    if (!lines)
        return refuse(why, CRANNY_MEMORY, "%.900s: out of memory", path);
    const enum cranny_status status = cranny_file_write(path, lines, strlen(lines), why);
    free(lines);
    return status;
}

enum cranny_status gbuffer_write(const struct render *render, struct cranny_error *why)
{
    const struct cranny_gbuffer *g = &render->gbuffer;
    char *const *files = render->gbuffer_files;
    if (!files[FILE_DEPTH])
        return CRANNY_OK;
    enum cranny_status status =
        cranny_image_write(files[FILE_DEPTH], CRANNY_IMAGE_DEPTH, CRANNY_IMAGE_AUTO, g->width,
                           g->height, 1, g->depth, g->depth_stride, why);
    if (status == CRANNY_OK)
        status = cranny_image_write(files[FILE_NORMAL], CRANNY_IMAGE_NORMAL, CRANNY_IMAGE_AUTO,
                                    g->width, g->height, 3, g->normal, g->normal_stride, why);
    return status == CRANNY_OK ? write_description(render, why) : status;
}
