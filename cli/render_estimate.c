/* From a G-buffer to visibility, as often as wanted, and what may be wrong with the input. */
#include "render.h"

#include <math.h>
#include <stdlib.h>

enum { MEDIAN_SIDE = 256 };

struct timing {
    double total_ms;
    struct cranny_screen_report screen;
    struct cranny_raytrace_report raytrace;
};

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static int compare_timings(const void *a, const void *b)
{
    const double x = ((const struct timing *)a)->total_ms, y = ((const struct timing *)b)->total_ms;
    return (x > y) - (x < y);
}

/* Of a grid of the viewport's pixels; 0: all is sky. */
static float median_depth(const struct cranny_gbuffer *g)
{
    float *depths = malloc(sizeof *depths * MEDIAN_SIDE * MEDIAN_SIDE);
    const struct cranny_rect *view = &g->viewport;
    size_t count = 0;
    for (int j = 0; depths && j < MEDIAN_SIDE && j < view->height; j++)
        for (int i = 0; i < MEDIAN_SIDE && i < view->width; i++) {
            const int wide = view->width < MEDIAN_SIDE ? view->width : MEDIAN_SIDE;
            const int high = view->height < MEDIAN_SIDE ? view->height : MEDIAN_SIDE;
            const size_t x = (size_t)(view->x + (int)((int64_t)i * view->width / wide));
            const size_t y = (size_t)(view->y + (int)((int64_t)j * view->height / high));
            const float depth = g->depth[y * (size_t)g->width + x];
            if (depth > 0 && isfinite(depth))
                depths[count++] = depth;
        }
    if (count)
        qsort(depths, count, sizeof *depths, compare_floats);
    const float median = count ? depths[count / 2] : 0;
    free(depths);
    return median;
}

static double radius_of(const struct render *render)
{
    return render->options.method == RENDER_RAYTRACE ? (double)render->raytrace.radius_world
                                                     : (double)render->screen.radius_world;
}

void warn_about_radius(struct ui *ui, const char *input, const struct cranny_gbuffer *g,
                       double radius)
{
    const float median = median_depth(g), extent = g->projection.top - g->projection.bottom;
    const bool parallel = g->projection.kind == CRANNY_ORTHOGRAPHIC;
    const double height_world = (double)extent * (parallel ? 1 : (double)median);
    const double share = radius / height_world;
    if (!(height_world > 0))
        return;
    if (share * g->viewport.height < 2)
        ui_warn(ui,
                "%.400s: the radius of %g m covers %.2g pixels at the median depth, %.4g m: little "
                "will show; --radius %.2g covers a tenth of the picture's height",
                input, radius, share * g->viewport.height, (double)median, 0.1 * height_world);
    else if (share > 1.0 / 3)
        ui_warn(ui,
                "%.400s: the radius of %g m covers %.2g of the picture's height at the median "
                "depth, %.4g m: occluders out of sight will be missed; --radius %.2g covers a "
                "tenth",
                input, radius, share, (double)median, 0.1 * height_world);
}

static void on_finding(void *user, enum cranny_depth_severity severity, const char *code,
                       const char *text)
{
    struct render *render = user;
    char words[CRANNY_ERROR_TEXT_SIZE];
    depth_words(code, text, words, sizeof words);
    if (severity == CRANNY_DEPTH_ERROR)
        ui_warn(&render->ui, "%.300s: %.700s", render->input, words);
}

enum cranny_status render_read(struct render *render, struct cranny_error *why)
{
    const double begin_s = clock_s();
    enum cranny_status status =
        depth_frame_read(&render->depth, &render->view, &render->image, why);
    if (status == CRANNY_OK && render->image.mismatched)
        status = CRANNY_INPUT;
    if (status != CRANNY_OK)
        return status;
    render->gbuffer = render->image.gbuffer;
    if (render->image.few_bits)
        ui_warn(&render->ui,
                "%.800s: holds no more than 8 bits, so slopes are stairs; store 16 bits or floats",
                render->input);
    if (render->gbuffer.projection.top <= render->gbuffer.projection.bottom) {
        render->gbuffer.projection = depth_projection_assumed(&render->gbuffer);
        ui_warn(&render->ui, "neither --fov nor --ortho was given: 60 degrees are assumed");
    }
    status = cranny_gbuffer_check(&render->gbuffer, on_finding, render, NULL, why);
    render->load_s = clock_s() - begin_s;
    return status;
}

static enum cranny_status estimate_once(struct render *render, struct timing *timing,
                                        struct cranny_error *why)
{
    const double begin_s = clock_s();
    enum cranny_status status;
    if (render->options.method == RENDER_RAYTRACE) {
        status = cranny_frame_raytrace(render->frame, &render->raytrace, render->visibility, 0,
                                       NULL, &timing->raytrace, why);
        timing->total_ms = 1e3 * (clock_s() - begin_s);
    } else {
        render->screen.report = &timing->screen;
        status =
            cranny_screen_render(&render->gbuffer, &render->screen, render->visibility, 0, why);
        timing->total_ms = timing->screen.total_ms;
    }
    return status;
}

static enum cranny_status estimate_all(struct render *render, struct cranny_error *why)
{
    const int count = render->options.repeat;
    struct timing *timings = calloc((size_t)count, sizeof *timings);
    if (!timings)
        return refuse(why, CRANNY_MEMORY, "--repeat: out of memory");
    enum cranny_status status = CRANNY_OK;
    for (int i = 0; i < count && status == CRANNY_OK; i++)
        status = estimate_once(render, &timings[i], why);
    if (status == CRANNY_OK) {
        qsort(timings, (size_t)count, sizeof *timings, compare_timings);
        render->screen_report = timings[count / 2].screen;
        render->raytrace_report = timings[count / 2].raytrace;
    }
    free(timings);
    return status;
}

static double mean_of(const float *values, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += (double)values[i];
    return sum / (double)count;
}

enum cranny_status render_estimate(struct render *render, struct cranny_error *why)
{
    const size_t width = (size_t)render->gbuffer.viewport.width;
    const size_t height = (size_t)render->gbuffer.viewport.height;
    warn_about_radius(&render->ui, render->input, &render->gbuffer, radius_of(render));
    render->visibility = calloc(width * height, sizeof *render->visibility);
    if (!render->visibility)
        return refuse(why, CRANNY_MEMORY, "%zu x %zu pixels do not fit in memory", width, height);
    render->screen.hooks = render->raytrace.hooks = &render->ui.hooks;
    enum cranny_status status = cranny_workspace_create(&render->screen.workspace, why);
    struct cranny_error own = {0};
    if (status == CRANNY_OK && (status = estimate_all(render, &own)) == CRANNY_INPUT)
        refuse(why, status, "%.200s: %.800s", render->input, own.message);
    else if (status != CRANNY_OK && own.message[0])
        *why = own;
    cranny_workspace_destroy(&render->screen.workspace);
    if (status == CRANNY_OK)
        render->mean_visibility = mean_of(render->visibility, width * height);
    return status;
}
