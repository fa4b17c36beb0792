#include "render.h"

static bool is_truth(const struct render *render)
{
    return render->options.method == RENDER_RAYTRACE;
}

static json_t *milliseconds_json(const struct render *render)
{
    const struct cranny_screen_report *r = &render->screen_report;
    if (is_truth(render))
        return json_pack("{so}", "total", json_number(1e3 * render->raytrace_report.seconds));
    return json_pack("{so so so so}", "total", json_number(r->total_ms), "prepare",
                     json_number(r->prepare_ms), "estimate", json_number(r->estimate_ms), "filter",
                     json_number(r->filter_ms));
}

static json_t *seconds_json(const struct render *render)
{
    json_t *object = json_pack("{so}", "load", json_number(render->load_s));
    if (render->scene) {
        json_object_set_new(object, "bvh", json_number(render->bvh_s));
        json_object_set_new(object, "frame", json_number(render->frame_s));
    }
    json_object_set_new(object, "write", json_number(render->write_s));
    json_object_set_new(object, "total", json_number(render->total_s));
    return object;
}

static void add_truth(const struct render *render, json_t *object)
{
    const struct cranny_raytrace_report *r = &render->raytrace_report;
    json_object_set_new(object, "rays", json_integer((json_int_t)r->rays));
    json_object_set_new(object, "rays_per_pixel", json_integer(r->rays_per_pixel));
    json_object_set_new(object, "passes", json_integer(r->passes));
    json_object_set_new(object, "standard_error",
                        json_pack("{so so}", "mean", json_number(r->standard_error_mean), "max",
                                  json_number(r->standard_error_max)));
}

static json_t *result_json(const struct render *render)
{
    const struct interface *face = render->face;
    const bool truth = is_truth(render);
    const struct cranny_gbuffer *g = &render->gbuffer;
    json_t *object =
        json_pack("{ss so si si ss so so so so si so}", "method",
                  render_methods[render->options.method], "preset",
                  json_text(face->preset ? face->preset
                            : truth      ? "default"
                                         : "calibrated"),
                  "width", g->viewport.width, "height", g->viewport.height, "device", "cpu", "isa",
                  truth ? json_null()
                        : json_string(cranny_isa_name((enum cranny_isa)render->screen_report.isa)),
                  "milliseconds", milliseconds_json(render), "input", json_text(render->input),
                  "output", json_text(render->output), "repeat", render->options.repeat,
                  "mean_visibility", json_number(render->mean_visibility));
    json_object_set_new(object, "guard_band", json_integer(g->guard_band));
    json_object_set_new(object, "seconds", seconds_json(render));
    if (truth)
        add_truth(render, object);
    else
        json_object_set_new(object, "invalid_depths",
                            json_integer((json_int_t)render->screen_report.invalid_depths));
    if (render->gbuffer_files[0])
        json_object_set_new(object, "gbuffer",
                            json_pack("{so so so}", "depth", json_text(render->gbuffer_files[0]),
                                      "normal", json_text(render->gbuffer_files[1]), "description",
                                      json_text(render->gbuffer_files[2])));
    json_object_set_new(object, "parameters", json_parameters(face->table, face->params));
    json_object_set_new(object, "warnings", json_warnings(&render->ui));
    return object;
}

static void print_text(const struct render *render)
{
    const struct cranny_gbuffer *g = &render->gbuffer;
    const char *method = render_methods[render->options.method];
    char rays[32];
    printf("%s: %d x %d, ", render->output, g->viewport.width, g->viewport.height);
    if (is_truth(render))
        printf("%s %s rays, standard error %.2g, %.2f s", method,
               short_count((double)render->raytrace_report.rays, rays),
               render->raytrace_report.standard_error_mean, render->raytrace_report.seconds);
    else
        printf("%s %.1f ms on %s", method, render->screen_report.total_ms,
               cranny_isa_name((enum cranny_isa)render->screen_report.isa));
    printf("; mean visibility %.3f\n", render->mean_visibility);
    if (render->gbuffer_files[0])
        printf("%s, %s: described in %s\n", render->gbuffer_files[0], render->gbuffer_files[1],
               render->gbuffer_files[2]);
}

static void print_details(const struct render *render)
{
    const struct cranny_screen_report *r = &render->screen_report;
    fprintf(stderr, "cranny: seconds: load %.3f, bvh %.3f, frame %.3f, write %.3f, total %.3f\n",
            render->load_s, render->bvh_s, render->frame_s, render->write_s, render->total_s);
    if (!is_truth(render))
        fprintf(stderr, "cranny: milliseconds: prepare %.2f, estimate %.2f, filter %.2f\n",
                r->prepare_ms, r->estimate_ms, r->filter_ms);
}

int render_print(struct render *render)
{
    ui_erase(&render->ui);
    if (render->ui.json)
        return ui_print_json(&render->ui, result_json(render));
    if (!render->ui.quiet)
        print_text(render);
    if (render->ui.verbose)
        print_details(render);
    return ui_finish_output(&render->ui);
}
