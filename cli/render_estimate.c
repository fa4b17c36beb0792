/* From a G-buffer to visibility, as often as wanted, and what may be wrong with the input. */
#include "render.h"

#include <math.h>
#include <stdlib.h>

enum { MEDIAN_SIDE = 256 };

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static int compare_reports(const void *a, const void *b)
{
    const double x = ((const struct method_report *)a)->total_ms;
    const double y = ((const struct method_report *)b)->total_ms;
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

void warn_about_radius(struct ui *ui, const char *input, const struct cranny_gbuffer *g,
                       double radius, bool sees_all)
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
    else if (share > 1.0 / 3 && !sees_all)
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

static enum cranny_status estimate_all(struct render *render, struct cranny_error *why)
{
    const int count = render->options.repeat;
    const struct method_input input = {render->scene, render->frame, render->gbuffer};
    struct method_report *reports = calloc((size_t)count, sizeof *reports);
    struct method_state state = {0};
    enum cranny_status status =
        reports ? method_prepare(render->method, &input, &render->params, &state, why)
                : refuse(why, CRANNY_MEMORY, "--repeat: out of memory");
    for (int i = 0; i < count && status == CRANNY_OK; i++)
        status = method_run(render->method, &input, &render->params, &state, render->visibility,
                            &reports[i], why);
    if (status == CRANNY_OK) {
        qsort(reports, (size_t)count, sizeof *reports, compare_reports);
        render->report = reports[count / 2];
    }
    method_state_free(&state);
    free(reports);
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
    warn_about_radius(&render->ui, render->input, &render->gbuffer,
                      (double)*render->fields.radius_world, render->method->kind->needs_scene);
    render->visibility = calloc(width * height, sizeof *render->visibility);
    if (!render->visibility)
        return refuse(why, CRANNY_MEMORY, "%zu x %zu pixels do not fit in memory", width, height);
    *render->fields.hooks = &render->ui.hooks;
    struct cranny_error own = {0};
    const enum cranny_status status = estimate_all(render, &own);
    if (status == CRANNY_INPUT)
        refuse(why, status, "%.200s: %.800s", render->input, own.message);
    else if (status != CRANNY_OK)
        *why = own;
    if (status == CRANNY_OK)
        render->mean_visibility = mean_of(render->visibility, width * height);
    return status;
}
