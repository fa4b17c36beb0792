#include "render.h"

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

static json_t *result_json(const struct render *render)
{
    const struct interface *face = render->face;
    const struct cranny_gbuffer *g = &render->gbuffer;
    const int isa = render->report.isa;
    json_t *object =
        json_pack("{ss so si si ss so so so si so}", "method", render->method->name, "preset",
                  json_text(face->preset    ? face->preset
                            : face->presets ? face->presets[0]
                                            : "default"),
                  "width", g->viewport.width, "height", g->viewport.height, "device", "cpu", "isa",
                  isa < 0 ? json_null() : json_string(cranny_isa_name((enum cranny_isa)isa)),
                  "input", json_text(render->input), "output", json_text(render->output), "repeat",
                  render->options.repeat, "mean_visibility", json_number(render->mean_visibility));
    json_object_set_new(object, "guard_band", json_integer(g->guard_band));
    json_object_set_new(object, "seconds", seconds_json(render));
    render->method->kind->add_json(&render->report, object);
    if (render->gbuffer_files[0])
        json_object_set_new(object, "gbuffer",
                            json_pack("{so so so}", "depth", json_text(render->gbuffer_files[0]),
                                      "normal", json_text(render->gbuffer_files[1]), "description",
                                      json_text(render->gbuffer_files[2])));
    json_object_set_new(object, "parameters",
                        method_parameters_json(render->method, &render->params));
    json_object_set_new(object, "warnings", json_warnings(&render->ui));
    return object;
}

static void print_text(const struct render *render)
{
    const struct cranny_gbuffer *g = &render->gbuffer;
    const struct method_report *report = &render->report;
    char rays[32];
    printf("%s: %d x %d, ", render->output, g->viewport.width, g->viewport.height);
    if (render->method->kind->is_truth)
        printf("%s %s rays, standard error %.2g, %.2f s", render->method->name,
               short_count((double)report->raytrace.rays, rays),
               report->raytrace.standard_error_mean, report->raytrace.seconds);
    else
        printf("%s %.1f ms on %s", render->method->name, report->total_ms,
               cranny_isa_name((enum cranny_isa)report->isa));
    printf("; mean visibility %.3f\n", render->mean_visibility);
    if (render->gbuffer_files[0])
        printf("%s, %s: described in %s\n", render->gbuffer_files[0], render->gbuffer_files[1],
               render->gbuffer_files[2]);
}

static void print_details(const struct render *render)
{
    fprintf(stderr, "cranny: seconds: load %.3f, bvh %.3f, frame %.3f, write %.3f, total %.3f\n",
            render->load_s, render->bvh_s, render->frame_s, render->write_s, render->total_s);
    render->method->kind->print_details(&render->report);
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
