#include "method.h"

#include <string.h>

static enum cranny_status prepare_nothing(const struct method_input *input,
                                          const union method_params *params,
                                          struct method_state *state, struct cranny_error *why)
{
    (void)input;
    (void)params;
    (void)state;
    (void)why;
    return CRANNY_OK;
}

static json_t *stages_json(double total, double prepare, double estimate, double filter)
{
    return json_pack("{so so so so}", "total", json_number(total), "prepare", json_number(prepare),
                     "estimate", json_number(estimate), "filter", json_number(filter));
}

static const struct cranny_param_table *screen_table(const struct method *method)
{
    return cranny_screen_param_table(method->screen);
}

static const char *const *screen_presets(const struct method *method)
{
    return cranny_screen_preset_names(method->screen);
}

static void screen_defaults(const struct method *method, union method_params *params)
{
    params->screen = cranny_screen_params_preset(method->screen, NULL);
}

static enum cranny_status screen_apply(void *params, const char *preset, struct cranny_error *why)
{
    return cranny_screen_params_apply(params, preset, why);
}

static struct method_fields screen_fields(union method_params *params)
{
    struct cranny_screen_params *p = &params->screen;
    return (struct method_fields){&p->radius_world, &p->threads, &p->isa, &p->hooks};
}

static enum cranny_status screen_prepare(const struct method_input *input,
                                         const union method_params *params,
                                         struct method_state *state, struct cranny_error *why)
{
    (void)input;
    (void)params;
    return state->workspace ? CRANNY_OK : cranny_workspace_create(&state->workspace, why);
}

static enum cranny_status screen_run(const struct method_input *input,
                                     const union method_params *params, struct method_state *state,
                                     float *visibility, struct method_report *report,
                                     struct cranny_error *why)
{
    struct cranny_screen_params own = params->screen;
    own.workspace = state->workspace;
    own.report = &report->screen;
    const enum cranny_status status =
        cranny_screen_render(&input->gbuffer, &own, visibility, 0, why);
    report->total_ms = report->screen.total_ms;
    report->isa = report->screen.isa;
    return status;
}

static void screen_json(const struct method_report *report, json_t *object)
{
    const struct cranny_screen_report *r = &report->screen;
    json_object_set_new(object, "milliseconds",
                        stages_json(r->total_ms, r->prepare_ms, r->estimate_ms, r->filter_ms));
    json_object_set_new(object, "invalid_depths", json_integer((json_int_t)r->invalid_depths));
}

static void print_stages(double prepare, double estimate, double filter)
{
    fprintf(stderr, "cranny: milliseconds: prepare %.2f, estimate %.2f, filter %.2f\n", prepare,
            estimate, filter);
}

static void screen_details(const struct method_report *report)
{
    const struct cranny_screen_report *r = &report->screen;
    print_stages(r->prepare_ms, r->estimate_ms, r->filter_ms);
}

static const struct cranny_param_table *volumes_table(const struct method *method)
{
    (void)method;
    return cranny_volumes_param_table();
}

static const char *const *volumes_presets(const struct method *method)
{
    (void)method;
    return cranny_volumes_preset_names();
}

static void volumes_defaults(const struct method *method, union method_params *params)
{
    (void)method;
    params->volumes = cranny_volumes_params_preset(NULL);
}

static enum cranny_status volumes_apply(void *params, const char *preset, struct cranny_error *why)
{
    return cranny_volumes_params_apply(params, preset, why);
}

static struct method_fields volumes_fields(union method_params *params)
{
    struct cranny_volumes_params *p = &params->volumes;
    return (struct method_fields){&p->radius_world, &p->threads, &p->isa, &p->hooks};
}

static enum cranny_status volumes_prepare(const struct method_input *input,
                                          const union method_params *params,
                                          struct method_state *state, struct cranny_error *why)
{
    if (state->volumes && state->quads == params->volumes.quads)
        return CRANNY_OK;
    cranny_volumes_destroy(&state->volumes);
    state->quads = params->volumes.quads;
    return cranny_volumes_create(input->scene, &params->volumes, &state->volumes, why);
}

static enum cranny_status volumes_run(const struct method_input *input,
                                      const union method_params *params, struct method_state *state,
                                      float *visibility, struct method_report *report,
                                      struct cranny_error *why)
{
    struct cranny_volumes_params own = params->volumes;
    own.report = &report->volumes;
    const enum cranny_status status =
        cranny_volumes_render(state->volumes, &input->gbuffer, &own, visibility, 0, why);
    report->made = cranny_volumes_info(state->volumes);
    report->setup_s = report->made.seconds;
    report->total_ms = report->volumes.total_ms;
    report->isa = report->volumes.isa;
    return status;
}

static void volumes_json(const struct method_report *report, json_t *object)
{
    const struct cranny_volumes_report *r = &report->volumes;
    const struct cranny_volumes_info *made = &report->made;
    json_object_set_new(object, "milliseconds",
                        stages_json(r->total_ms, r->prepare_ms, r->estimate_ms, r->filter_ms));
    json_object_set_new(object, "volumes",
                        json_pack("{sI sI sI sI so}", "polygons", (json_int_t)made->polygons,
                                  "quads", (json_int_t)made->quads, "dropped",
                                  (json_int_t)made->dropped, "bytes", (json_int_t)made->size_bytes,
                                  "seconds", json_number(made->seconds)));
    json_object_set_new(object, "pixels", json_integer((json_int_t)r->pixels));
    json_object_set_new(object, "refined_pixels", json_integer((json_int_t)r->refined));
    json_object_set_new(object, "pairs",
                        json_pack("{sI sI sI}", "candidates", (json_int_t)r->candidates, "tested",
                                  (json_int_t)r->tested, "evaluated", (json_int_t)r->evaluated));
}

static void volumes_details(const struct method_report *report)
{
    const struct cranny_volumes_report *r = &report->volumes;
    const struct cranny_volumes_info *made = &report->made;
    char polygons[32], tested[32], evaluated[32];
    print_stages(r->prepare_ms, r->estimate_ms, r->filter_ms);
    fprintf(stderr,
            "cranny: volumes: %s polygons, %.1f MB, made in %.3f s; pairs of 16 pixels and "
            "a volume: %s tested, %s evaluated\n",
            short_count((double)made->polygons, polygons), (double)made->size_bytes * 1e-6,
            made->seconds, short_count((double)r->tested, tested),
            short_count((double)r->evaluated, evaluated));
}

static const struct cranny_param_table *raytrace_table(const struct method *method)
{
    (void)method;
    return cranny_raytrace_param_table();
}

static void raytrace_defaults(const struct method *method, union method_params *params)
{
    (void)method;
    params->raytrace = cranny_raytrace_params_default();
}

static struct method_fields raytrace_fields(union method_params *params)
{
    struct cranny_raytrace_params *p = &params->raytrace;
    return (struct method_fields){&p->radius_world, &p->threads, NULL, &p->hooks};
}

static enum cranny_status raytrace_run(const struct method_input *input,
                                       const union method_params *params,
                                       struct method_state *state, float *visibility,
                                       struct method_report *report, struct cranny_error *why)
{
    (void)state;
    const enum cranny_status status = cranny_frame_raytrace(
        input->frame, &params->raytrace, visibility, 0, NULL, &report->raytrace, why);
    report->total_ms = 1e3 * report->raytrace.seconds;
    report->isa = -1;
    return status;
}

static void raytrace_json(const struct method_report *report, json_t *object)
{
    const struct cranny_raytrace_report *r = &report->raytrace;
    json_object_set_new(object, "milliseconds",
                        json_pack("{so}", "total", json_number(1e3 * r->seconds)));
    json_object_set_new(object, "rays", json_integer((json_int_t)r->rays));
    json_object_set_new(object, "rays_per_pixel", json_integer(r->rays_per_pixel));
    json_object_set_new(object, "passes", json_integer(r->passes));
    json_object_set_new(object, "standard_error",
                        json_pack("{so so}", "mean", json_number(r->standard_error_mean), "max",
                                  json_number(r->standard_error_max)));
}

static void raytrace_details(const struct method_report *report)
{
    (void)report;
}

static const struct method_kind screen = {
    .reads_guard = true,
    .table = screen_table,
    .presets = screen_presets,
    .defaults = screen_defaults,
    .apply = screen_apply,
    .fields = screen_fields,
    .prepare = screen_prepare,
    .run = screen_run,
    .add_json = screen_json,
    .print_details = screen_details,
};

static const struct method_kind volumes = {
    .needs_scene = true,
    .table = volumes_table,
    .presets = volumes_presets,
    .defaults = volumes_defaults,
    .apply = volumes_apply,
    .fields = volumes_fields,
    .prepare = volumes_prepare,
    .run = volumes_run,
    .add_json = volumes_json,
    .print_details = volumes_details,
};

static const struct method_kind raytrace = {
    .needs_scene = true,
    .is_truth = true,
    .table = raytrace_table,
    .defaults = raytrace_defaults,
    .fields = raytrace_fields,
    .prepare = prepare_nothing,
    .run = raytrace_run,
    .add_json = raytrace_json,
    .print_details = raytrace_details,
};

/* The order in which to show them: from the picture's depth alone to all of the scene. */
#define METHODS(ROW)                                                                               \
    ROW(SSAO, "ssao", screen, CRANNY_SSAO)                                                         \
    ROW(HBAO, "hbao", screen, CRANNY_HBAO)                                                         \
    ROW(CREASE, "crease", screen, CRANNY_CREASE)                                                   \
    ROW(ALCHEMY, "alchemy", screen, CRANNY_ALCHEMY)                                                \
    ROW(VOLUMES, "volumes", volumes, CRANNY_METHOD_COUNT)                                          \
    ROW(RAYMARCH, "raymarch", screen, CRANNY_RAYMARCH)                                             \
    ROW(RAYTRACE, "raytrace", raytrace, CRANNY_METHOD_COUNT)

#define METHOD(ID, NAME, KIND, SCREEN) [METHOD_##ID] = {NAME, &(KIND), SCREEN},
const struct method methods[METHOD_COUNT] = {METHODS(METHOD)};

#define NAME_OF(ID, NAME, KIND, SCREEN) [METHOD_##ID] = NAME,
const char *const method_names[METHOD_COUNT + 1] = {METHODS(NAME_OF)};

const struct method *method_find(const char *name)
{
    for (int m = 0; m < METHOD_COUNT; m++)
        if (strcmp(methods[m].name, name) == 0)
            return &methods[m];
    return NULL;
}

const struct method *method_named(int argc, char **argv, const struct method *fallback)
{
    const struct method *method = fallback;
    for (int i = 0; i < argc && strcmp(argv[i], "--") != 0; i++) {
        const char *name = "";
        if (strncmp(argv[i], "--method=", 9) == 0)
            name = argv[i] + 9;
        else if (strcmp(argv[i], "--method") == 0 && i + 1 < argc)
            name = argv[i + 1];
        const struct method *named = method_find(name);
        method = named ? named : method;
    }
    return method;
}

const struct cranny_param_table *method_table(const struct method *method)
{
    return method->kind->table(method);
}

const char *const *method_presets(const struct method *method)
{
    return method->kind->presets ? method->kind->presets(method) : NULL;
}

void method_params_preset(const struct method *method, const char *preset,
                          union method_params *params)
{
    method->kind->defaults(method, params);
    if (preset && method->kind->apply)
        method->kind->apply(params, preset, NULL);
}

struct method_fields method_fields(const struct method *method, union method_params *params)
{
    return method->kind->fields(params);
}

enum cranny_status method_preset_load(const char *path, const struct method **method,
                                      union method_params *params, struct cranny_error *why)
{
    json_error_t problem;
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &problem);
    const char *name = json_string_value(json_object_get(root, "method"));
    *method = name ? method_find(name) : NULL;
    enum cranny_status status = CRANNY_OK;
    if (!root)
        status = refuse(why, CRANNY_INPUT, "%.600s: line %d: %s", path, problem.line, problem.text);
    else if (!name)
        status = refuse(why, CRANNY_INPUT,
                        "%.600s: does not say whose preset it is, as in {\"method\": \"volumes\", "
                        "...}",
                        path);
    else if (!*method)
        status = refuse(why, CRANNY_INPUT, "%.600s: there is no method '%.100s'", path, name);
    json_decref(root);
    if (status != CRANNY_OK)
        return status;
    method_params_preset(*method, NULL, params);
    return cranny_params_load(method_table(*method), params, path, why);
}

json_t *method_parameters_json(const struct method *method, const union method_params *params)
{
    json_t *object = json_pack("{ss}", "method", method->name);
    json_t *fields = json_parameters(method_table(method), params);
    json_object_update(object, fields);
    json_decref(fields);
    return object;
}

enum cranny_status method_prepare(const struct method *method, const struct method_input *input,
                                  const union method_params *params, struct method_state *state,
                                  struct cranny_error *why)
{
    return method->kind->prepare(input, params, state, why);
}

enum cranny_status method_run(const struct method *method, const struct method_input *input,
                              const union method_params *params, struct method_state *state,
                              float *visibility, struct method_report *report,
                              struct cranny_error *why)
{
    *report = (struct method_report){0};
    const enum cranny_status status = method_prepare(method, input, params, state, why);
    return status == CRANNY_OK ? method->kind->run(input, params, state, visibility, report, why)
                               : status;
}

void method_state_leave_scene(struct method_state *state)
{
    cranny_volumes_destroy(&state->volumes);
}

void method_state_free(struct method_state *state)
{
    method_state_leave_scene(state);
    cranny_workspace_destroy(&state->workspace);
}
