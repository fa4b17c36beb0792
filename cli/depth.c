#include "depth.h"

#include "commands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static const char *const kind_names[] = {"linear", "view-z",      "normalized",
                                         "device", "logarithmic", NULL};
static const char *const range_names[] = {"d3d", "gl", NULL};
static const char *const normal_range_names[] = {"auto", "signed", "unsigned", NULL};

#define DEPTH_ROW(FIELD) .offset = offsetof(struct depth_options, FIELD)

static const struct option depth_rows[] = {
    {.name = "depth",
     .type = OPTION_TEXT,
     DEPTH_ROW(depth),
     .value = "FILE",
     .help = "depth image instead of a scene: OpenEXR (Z, depth.Z or one channel), PFM, or PNG of "
             "16 bits"},
    {.name = "normal",
     .type = OPTION_TEXT,
     DEPTH_ROW(normal),
     .value = "FILE",
     .help = "its normals, in view space (x right, y up, z towards the camera); without them they "
             "are reconstructed from depth"},
    {.name = "depth-kind",
     .type = OPTION_CHOICE,
     DEPTH_ROW(kind),
     .choices = kind_names,
     .help = "what depth holds: metres along the view (default), negative view z, the share from "
             "near to far, what a perspective projection leaves in the depth buffer, or "
             "log(c depth + 1) / log(c far + 1)"},
    {.name = "depth-range",
     .type = OPTION_CHOICE,
     DEPTH_ROW(range),
     .choices = range_names,
     .help =
         "values of normalized, device and logarithmic depth run 0 to 1 (d3d, default; also what "
         "is read back from OpenGL) or -1 to 1 (gl: z over w in a shader of OpenGL's)"},
    {.name = "reversed",
     .type = OPTION_FLAG,
     DEPTH_ROW(reversed),
     .help = "1 is near and 0 (or -1) far"},
    {.name = "near",
     .type = OPTION_POSITIVE,
     DEPTH_ROW(near_plane),
     .value = "X",
     .help = "near plane, metres; for normalized and device depth"},
    {.name = "far",
     .type = OPTION_POSITIVE,
     DEPTH_ROW(far_plane),
     .value = "X",
     .help =
         "far plane, metres or inf; what lies there is sky. Reversed device depth does without"},
    {.name = "log-c",
     .type = OPTION_POSITIVE,
     DEPTH_ROW(log_constant),
     .value = "C",
     .help = "the c of logarithmic depth (default 1)"},
    {.name = "depth-scale",
     .type = OPTION_POSITIVE,
     DEPTH_ROW(scale),
     .value = "X",
     .help = "metres that a value of 1 stands for in linear and view-z depth; 65.535 for a PNG of "
             "16 bits in millimetres"},
    {.name = "viewport",
     .type = OPTION_RECT,
     DEPTH_ROW(viewport),
     .value = "X,Y,W,H",
     .help = "the part of the image that is wanted and that the projection spans (default: all)"},
    {.name = "normal-range",
     .type = OPTION_CHOICE,
     DEPTH_ROW(normal_range),
     .choices = normal_range_names,
     .help = "normals run -1 to 1 (signed) or 0 to 1 (unsigned: 2 c - 1 is taken); auto: PNG is "
             "unsigned"},
    {.name = "normal-flip",
     .type = OPTION_TEXT,
     DEPTH_ROW(normal_flip),
     .value = "AXES",
     .help = "negate these axes of the normals: x, y, z, or several as in xyz"},
};

const struct option_group depth_options = {"Depth image", depth_rows,
                                           sizeof depth_rows / sizeof *depth_rows, NULL};

static const struct option view_rows[] = {
    {.name = "fov",
     .type = OPTION_POSITIVE,
     .offset = offsetof(struct view_options, fov_degrees),
     .value = "DEG",
     .help = "field of view from bottom to top, degrees, below 180 (default: 60 for depth and "
             "--eye, else the camera's)"},
    {.name = "ortho",
     .type = OPTION_POSITIVE,
     .offset = offsetof(struct view_options, half_height),
     .value = "H",
     .help = "parallel projection; H metres from the picture's middle to its top"},
    {.name = "guard",
     .type = OPTION_INT,
     .offset = offsetof(struct view_options, guard),
     .value = "PX",
     .maximum = CRANNY_SIDE_MAX / 2,
     .help = "pixels around the picture that hold the scene, too, so that it does not fade at its "
             "border: drawn around a scene's (default: a tenth of the height; 0 for raytrace), "
             "inside a depth image or around its viewport (default 0)"},
};

const struct option_group view_options = {"View", view_rows, sizeof view_rows / sizeof *view_rows,
                                          NULL};

struct depth_options depth_options_default(void)
{
    return (struct depth_options){0};
}

struct view_options view_options_default(void)
{
    return (struct view_options){.guard = -1};
}

static bool is_stored_in_metres(const struct depth_options *options)
{
    return options->kind == CRANNY_DEPTH_LINEAR || options->kind == CRANNY_DEPTH_VIEW_Z;
}

static enum cranny_status check_kind(const struct interface *face,
                                     const struct depth_options *options, struct cranny_error *why)
{
    static const char *const converting[] = {"near", "depth-range", "reversed"};
    const char *kind = kind_names[options->kind];
    for (size_t i = 0; i < 3; i++)
        if (is_stored_in_metres(options) && option_given(face, converting[i]))
            return refuse(why, CRANNY_USAGE,
                          "--%s: %s depth has none; say --depth-kind device (or normalized, or "
                          "logarithmic) if that is what the file holds",
                          converting[i], kind);
    if (!is_stored_in_metres(options) && options->scale != 0)
        return refuse(why, CRANNY_USAGE, "--depth-scale goes with linear and view-z depth only");
    if (options->kind != CRANNY_DEPTH_LOGARITHMIC && options->log_constant != 0)
        return refuse(why, CRANNY_USAGE, "--log-c goes with --depth-kind logarithmic only");
    return CRANNY_OK;
}

/* What each kind cannot be converted without. */
static enum cranny_status check_planes(const struct depth_options *options,
                                       struct cranny_error *why)
{
    const char *kind = kind_names[options->kind];
    const bool device = options->kind == CRANNY_DEPTH_DEVICE;
    if (is_stored_in_metres(options))
        return CRANNY_OK;
    if (options->kind != CRANNY_DEPTH_LOGARITHMIC && options->near_plane == 0)
        return refuse(why, CRANNY_USAGE, "--depth-kind %s needs the camera's --near", kind);
    if (options->far_plane == 0 && !(device && options->reversed))
        return refuse(why, CRANNY_USAGE, "--depth-kind %s needs the camera's --far%s", kind,
                      device ? ", inf when it has none" : "");
    if (!isfinite(options->near_plane) || (!device && !isfinite(options->far_plane)))
        return refuse(why, CRANNY_USAGE, "--%s: must be finite for %s depth",
                      isfinite(options->near_plane) ? "far" : "near", kind);
    if (options->far_plane != 0 && options->far_plane <= options->near_plane)
        return refuse(why, CRANNY_USAGE, "--far: %g is not beyond --near, %g", options->far_plane,
                      options->near_plane);
    return CRANNY_OK;
}

static enum cranny_status check_flip(const char *axes, struct cranny_error *why)
{
    const size_t length = axes ? strlen(axes) : 0;
    bool good = !axes || (length >= 1 && strspn(axes, "xyz") == length);
    for (size_t i = 0; i < length; i++)
        good = good && !strchr(axes + i + 1, axes[i]);
    return good ? CRANNY_OK
                : refuse(why, CRANNY_USAGE,
                         "--normal-flip: '%.200s' is not some of x, y and z; as in yz", axes);
}

enum cranny_status view_options_check(const struct view_options *view, struct cranny_error *why)
{
    if (view->fov_degrees != 0 && view->half_height != 0)
        return refuse(why, CRANNY_USAGE, "--fov and --ortho: give one of them");
    if (view->fov_degrees >= 179.9)
        return refuse(why, CRANNY_USAGE, "--fov: %g degrees; it must be below 179.9",
                      view->fov_degrees);
    if (!isfinite(view->half_height))
        return refuse(why, CRANNY_USAGE, "--ortho: must be finite");
    return CRANNY_OK;
}

enum cranny_status depth_options_check(const struct interface *face,
                                       const struct depth_options *options,
                                       const struct view_options *view, struct cranny_error *why)
{
    enum cranny_status status =
        options->depth ? options_refuse(face, &load_options, 0, "a scene, not with --depth", why)
                       : options_refuse(face, &depth_options, 1, "--depth FILE", why);
    if (status == CRANNY_OK)
        status = view_options_check(view, why);
    if (status == CRANNY_OK)
        status = check_kind(face, options, why);
    if (status == CRANNY_OK)
        status = check_planes(options, why);
    if (status == CRANNY_OK && !isfinite(options->scale + options->log_constant))
        status = refuse(why, CRANNY_USAGE, "--%s: must be finite",
                        isfinite(options->scale) ? "log-c" : "depth-scale");
    return status == CRANNY_OK ? check_flip(options->normal_flip, why) : status;
}

static bool has_few_bits(const struct cranny_image *image)
{
    const size_t count = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < count; i++) {
        const float level = image->pixels[i] * 255;
        if (fabsf(level - nearbyintf(level)) > 1e-3f)
            return false;
    }
    return true;
}

/* Integers hold shares of something: metres only when it is said of what. */
static enum cranny_status check_integers(const struct depth_options *options,
                                         const struct cranny_image *image, struct cranny_error *why)
{
    if (image->integers && options->range == 1)
        return refuse(why, CRANNY_INPUT,
                      "%.900s: holds integers, which run 0 to 1; leave out --depth-range gl",
                      options->depth);
    if (!image->integers || !is_stored_in_metres(options) || options->scale != 0)
        return CRANNY_OK;
    return refuse(why, CRANNY_INPUT,
                  "%.400s: holds integers, not metres; pass --depth-scale 65.535 if they are "
                  "millimetres in 16 bits, or --depth-kind device (or normalized) with --near and "
                  "--far",
                  options->depth);
}

static enum cranny_status make_linear(const struct depth_options *options,
                                      struct cranny_image *image, struct cranny_error *why)
{
    const struct cranny_depth_layout layout = {
        .kind = (enum cranny_depth_kind)options->kind,
        .gl_range = options->range == 1,
        .reversed = options->reversed,
        .near_plane = (float)options->near_plane,
        .far_plane = options->far_plane != 0 ? (float)options->far_plane : INFINITY,
        .log_constant = options->log_constant != 0 ? (float)options->log_constant : 1,
    };
    const size_t count = (size_t)image->width * (size_t)image->height;
    for (size_t i = 0; i < count && options->scale != 0; i++)
        image->pixels[i] *= (float)options->scale;
    if (layout.kind != CRANNY_DEPTH_LINEAR) {
        const enum cranny_status status = cranny_depth_linearize(
            &layout, image->width, image->height, image->pixels, 0, image->pixels, 0, why);
        if (status != CRANNY_OK)
            return status;
    }
    for (size_t i = 0; i < count && is_stored_in_metres(options); i++)
        if (image->pixels[i] >= layout.far_plane)
            image->pixels[i] = INFINITY;
    return CRANNY_OK;
}

static enum cranny_status read_normals(const struct depth_options *options,
                                       struct cranny_image *image, struct cranny_error *why)
{
    if (!options->normal)
        return CRANNY_OK;
    const enum cranny_status status =
        cranny_image_read(options->normal, CRANNY_IMAGE_NORMAL, image, why);
    if (status != CRANNY_OK)
        return status;
    const bool doubled = options->normal_range ? options->normal_range == 2 : image->integers;
    const size_t count = (size_t)image->width * (size_t)image->height;
    for (int axis = 0; axis < 3; axis++) {
        const char *flip = options->normal_flip ? options->normal_flip : "";
        const float sign = strchr(flip, "xyz"[axis]) ? -1 : 1;
        for (size_t i = 0; i < count; i++) {
            float *value = &image->pixels[3 * i + (size_t)axis];
            *value = sign * (doubled ? 2 * *value - 1 : *value);
        }
    }
    return CRANNY_OK;
}

static enum cranny_status place_viewport(const struct depth_options *options,
                                         const struct view_options *view,
                                         struct cranny_gbuffer *gbuffer, struct cranny_error *why)
{
    const int guard = view->guard > 0 ? view->guard : 0;
    struct cranny_rect rect = options->viewport;
    if (!rect.width && guard)
        rect = (struct cranny_rect){guard, guard, gbuffer->width - 2 * guard,
                                    gbuffer->height - 2 * guard};
    if (!rect.width && !guard)
        rect = (struct cranny_rect){0, 0, gbuffer->width, gbuffer->height};
    if (rect.width < 1 || rect.height < 1)
        return refuse(why, CRANNY_USAGE, "--guard: %d pixels leave nothing of %.400s, %d x %d",
                      guard, options->depth, gbuffer->width, gbuffer->height);
    if (rect.x + rect.width > gbuffer->width || rect.y + rect.height > gbuffer->height)
        return refuse(why, CRANNY_USAGE, "--viewport: reaches beyond %.400s, %d x %d",
                      options->depth, gbuffer->width, gbuffer->height);
    gbuffer->viewport = rect;
    gbuffer->guard_band = guard;
    return CRANNY_OK;
}

static struct cranny_projection projection_of(const struct view_options *view, float aspect)
{
    if (view->half_height != 0)
        return cranny_orthographic((float)view->half_height, aspect);
    if (view->fov_degrees != 0)
        return cranny_perspective((float)(view->fov_degrees * PI / 180), aspect);
    return (struct cranny_projection){0};
}

static float aspect_of(const struct cranny_gbuffer *gbuffer)
{
    return (float)gbuffer->viewport.width / (float)gbuffer->viewport.height;
}

struct cranny_projection depth_projection_assumed(const struct cranny_gbuffer *gbuffer)
{
    return cranny_perspective((float)(60 * PI / 180), aspect_of(gbuffer));
}

static enum cranny_status assemble(const struct depth_options *options,
                                   const struct view_options *view, struct depth_frame *frame,
                                   struct cranny_error *why)
{
    const struct cranny_image *depth = &frame->depth, *normal = &frame->normal;
    frame->gbuffer = (struct cranny_gbuffer){.width = depth->width,
                                             .height = depth->height,
                                             .depth = depth->pixels,
                                             .normal = normal->pixels,
                                             .normal_format = CRANNY_NORMAL_FLOAT3};
    const enum cranny_status status = place_viewport(options, view, &frame->gbuffer, why);
    if (status != CRANNY_OK)
        return status;
    frame->gbuffer.projection = projection_of(view, aspect_of(&frame->gbuffer));
    if (!normal->pixels || (normal->width == depth->width && normal->height == depth->height))
        return CRANNY_OK;
    frame->mismatched = true;
    frame->gbuffer.normal = NULL;
    refuse(why, CRANNY_INPUT,
           "%.400s: %d x %d pixels, but %.400s has %d x %d; give depth and normals of one frame",
           options->normal, normal->width, normal->height, options->depth, depth->width,
           depth->height);
    return CRANNY_OK;
}

enum cranny_status depth_frame_read(const struct depth_options *options,
                                    const struct view_options *view, struct depth_frame *frame,
                                    struct cranny_error *why)
{
    *frame = (struct depth_frame){0};
    enum cranny_status status =
        cranny_image_read(options->depth, CRANNY_IMAGE_DEPTH, &frame->depth, why);
    if (status == CRANNY_OK)
        status = check_integers(options, &frame->depth, why);
    if (status == CRANNY_OK) {
        frame->few_bits = frame->depth.integers && has_few_bits(&frame->depth);
        status = make_linear(options, &frame->depth, why);
    }
    if (status == CRANNY_OK)
        status = read_normals(options, &frame->normal, why);
    if (status == CRANNY_OK)
        status = assemble(options, view, frame, why);
    if (status == CRANNY_OK && ui_interrupted())
        status = refuse(why, CRANNY_CANCELLED, "interrupted");
    if (status != CRANNY_OK)
        depth_frame_free(frame);
    return status;
}

void depth_frame_free(struct depth_frame *frame)
{
    cranny_image_free(&frame->depth);
    cranny_image_free(&frame->normal);
    *frame = (struct depth_frame){0};
}
