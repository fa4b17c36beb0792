/* results.json and index.html. */
#include "compare.h"
#include "shell.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int threads_of(const struct compare *compare)
{
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return compare->options.threads ? compare->options.threads : (int)(cores > 0 ? cores : 1);
}

static const char *isa_of(const struct compare *compare)
{
    const int isa = compare->options.isa;
    return cranny_isa_name(isa ? (enum cranny_isa)isa : cranny_isa_best());
}

/* As the kernel names it. */
static void processor_name(char *name, size_t size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    snprintf(name, size, "unnamed processor");
    while (file && fgets(line, sizeof line, file)) {
        const char *colon = strncmp(line, "model name", 10) == 0 ? strchr(line, ':') : NULL;
        if (!colon)
            continue;
        snprintf(name, size, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
        break;
    }
    if (file)
        fclose(file);
}

static json_t *file_json(const char *name)
{
    char *path = text_of_format("images/%s", name);
    json_t *text = json_text(path ? path : name);
    free(path);
    return text;
}

static json_t *trial_json(const struct compare_trial *trial)
{
    const struct cranny_difference *d = &trial->difference;
    const struct compare_method *row = trial->method;
    const int isa = trial->report.isa;
    json_t *object = json_pack(
        "{ss so ss so so so so so so so si so}", "name", row->method->name, "preset",
        json_text(row->label), "device", row->device, "milliseconds",
        json_number(trial->milliseconds), "setup_seconds", json_number(trial->report.setup_s),
        "error", json_number(d->error), "rmse", json_number(d->rmse), "mean", json_number(d->mean),
        "psnr", json_number(d->psnr), "max_abs", json_number(d->max_abs), "runs", trial->runs,
        "isa", isa < 0 ? json_null() : json_string(cranny_isa_name((enum cranny_isa)isa)));
    if (row->method->kind->is_truth)
        json_object_set_new(object, "standard_error",
                            json_number(trial->report.raytrace.standard_error_mean));
    json_object_set_new(object, "image", file_json(trial->image));
    json_object_set_new(object, "error_map", file_json(trial->map));
    json_object_set_new(object, "command", json_text(trial->command ? trial->command : ""));
    json_object_set(object, "parameters", trial->parameters);
    return object;
}

/* `seconds` is what this run took; `trace_seconds` what tracing took when it was done. */
static json_t *reference_json(const struct compare *compare, const struct compare_view *view)
{
    json_t *object =
        json_pack("{si so so sb so}", "rays", compare->options.rays, "seconds",
                  json_number(view->truth_s), "trace_seconds", json_number(view->truth.seconds),
                  "cached", view->truth_kept, "standard_error",
                  json_pack("{so so}", "mean", json_number(view->truth.standard_error_mean), "max",
                            json_number(view->truth.standard_error_max)));
    json_object_set_new(object, "image", file_json(view->image));
    json_object_set_new(object, "command", json_text(view->command ? view->command : ""));
    return object;
}

static json_t *view_json(const struct compare *compare, const struct compare_view *view)
{
    json_t *rows = json_array();
    for (size_t t = 0; t < view->trial_count; t++)
        json_array_append_new(rows, trial_json(&view->trials[t]));
    return json_pack("{so so si si so sI si so so}", "scene", json_text(view->scene), "camera",
                     json_text(view->sight.camera), "width", compare->view_scene.size[0], "height",
                     compare->view_scene.size[1], "radius_world",
                     json_number(view->sight.radius_world), "triangles",
                     (json_int_t)view->triangles, "guard_band", view->sight.guard, "reference",
                     reference_json(compare, view), "methods", rows);
}

json_t *compare_json(const struct compare *compare)
{
    char processor[200];
    json_t *views = json_array(), *failures = json_array();
    processor_name(processor, sizeof processor);
    for (size_t v = 0; v < compare->view_count; v++)
        json_array_append_new(views, view_json(compare, &compare->views[v]));
    for (size_t i = 0; i < compare->failure_count; i++)
        json_array_append_new(failures, json_text(compare->failures[i]));
    return json_pack("{ss so s{so si ss} so so so}", "version", cranny_version(), "command",
                     json_text(compare->command), "machine", "processor", json_text(processor),
                     "threads", threads_of(compare), "isa", isa_of(compare), "views", views,
                     "failures", failures, "warnings", json_warnings(&compare->ui));
}

static enum cranny_status write_results(const struct compare *compare, json_t *results,
                                        struct cranny_error *why)
{
    char *path = compare_path(compare, "results.json");
    char *text = results ? json_dumps(results, JSON_INDENT(2) | JSON_REAL_PRECISION(9)) : NULL;
    char *lines = text ? text_of_format("%s\n", text) : NULL;
    const enum cranny_status status =
        path && lines ? cranny_file_write(path, lines, strlen(lines), why)
                      : refuse(why, CRANNY_MEMORY, "out of memory for results.json");
    free(path);
    free(text);
    free(lines);
    return status;
}

/* The report's structs over ours; its paths are owned, since images lie in the work folder. */
struct page {
    struct cranny_report report;
    struct cranny_report_view *views;
    struct cranny_report_trial *trials; /* of all views, COMPARE_METHOD_LIMIT for each */
    char machine[256];
    bool lacking;
};

static const char *path_of(struct page *page, const struct compare *compare, const char *name)
{
    const char *path = compare_path(compare, name);
    page->lacking = page->lacking || !path;
    return path;
}

static void fill_trial(struct page *page, const struct compare *compare,
                       const struct compare_trial *from, struct cranny_report_trial *to)
{
    *to = (struct cranny_report_trial){.method = from->method->method->name,
                                       .preset = from->method->label,
                                       .device = from->method->device,
                                       .milliseconds = from->milliseconds,
                                       .error = from->difference.error,
                                       .rmse = from->difference.rmse,
                                       .mean = from->difference.mean,
                                       .setup_seconds = from->report.setup_s,
                                       .series = from->method->series,
                                       .is_truth = from->method->method->kind->is_truth,
                                       .image = path_of(page, compare, from->image),
                                       .command = from->command};
}

static void fill_view(struct page *page, const struct compare *compare, size_t number)
{
    const struct compare_view *from = &compare->views[number];
    const char *slash = strrchr(from->scene, '/');
    struct cranny_report_trial *trials = page->trials + number * COMPARE_METHOD_LIMIT;
    page->views[number] =
        (struct cranny_report_view){.scene = slash && slash[1] ? slash + 1 : from->scene,
                                    .camera = from->sight.camera,
                                    .triangles = from->triangles,
                                    .width = compare->view_scene.size[0],
                                    .height = compare->view_scene.size[1],
                                    .radius_world = from->sight.radius_world,
                                    .rays = compare->options.rays,
                                    .seconds = from->truth.seconds,
                                    .standard_error = from->truth.standard_error_mean,
                                    .image = path_of(page, compare, from->image),
                                    .command = from->command,
                                    .trials = trials,
                                    .trial_count = from->trial_count};
    for (size_t t = 0; t < from->trial_count; t++)
        fill_trial(page, compare, &from->trials[t], &trials[t]);
}

static void fill_page(struct page *page, const struct compare *compare)
{
    char processor[200];
    processor_name(processor, sizeof processor);
    snprintf(page->machine, sizeof page->machine, "%s, %d thread%s, %s", processor,
             threads_of(compare), threads_of(compare) == 1 ? "" : "s", isa_of(compare));
    for (size_t v = 0; v < compare->view_count; v++)
        fill_view(page, compare, v);
    page->report = (struct cranny_report){.machine = page->machine,
                                          .command = compare->command,
                                          .views = page->views,
                                          .view_count = compare->view_count,
                                          .failures = (const char *const *)compare->failures,
                                          .failure_count = compare->failure_count};
}

static void free_page(struct page *page, size_t view_count)
{
    for (size_t v = 0; page->views && page->trials && v < view_count; v++) {
        free((char *)page->views[v].image);
        for (size_t t = 0; t < page->views[v].trial_count; t++)
            free((char *)page->views[v].trials[t].image);
    }
    free(page->views);
    free(page->trials);
}

static enum cranny_status write_page(const struct compare *compare, struct cranny_error *why)
{
    struct page page = {
        .views = calloc(compare->view_count, sizeof *page.views),
        .trials = calloc(compare->view_count * COMPARE_METHOD_LIMIT, sizeof *page.trials)};
    char *path = compare_path(compare, "index.html");
    page.lacking = !page.views || !page.trials || !path;
    if (!page.lacking)
        fill_page(&page, compare);
    const enum cranny_status status = page.lacking
                                          ? refuse(why, CRANNY_MEMORY, "out of memory for the page")
                                          : cranny_report_write(&page.report, path, why);
    free_page(&page, compare->view_count);
    free(path);
    return status;
}

enum cranny_status compare_write(const struct compare *compare, json_t *results,
                                 struct cranny_error *why)
{
    const enum cranny_status status = write_results(compare, results, why);
    return status == CRANNY_OK ? write_page(compare, why) : status;
}
