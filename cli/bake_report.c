/* What a bake did, as JSON and as a page. */
#include "bake.h"
#include "demo/html.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

/* Departures of the model (rms of visibility) up to which nobody sees anything, and above which
 * finer vertices are the longer way. */
#define SEEN_RMS 0.02
#define TEXTURE_RMS 0.05

static const char *const treatment_names[] = {"none", "surface", "linear", "scalar", "lod"};

uint64_t bake_peak_bytes(void)
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? (uint64_t)usage.ru_maxrss * 1024 : 0;
}

/* A stage: its key in JSON, and what the page says of it beside the paper's Table 1. */
struct stage {
    const char *key, *words;
    double seconds;
    uint64_t bytes;
};

enum { STAGE_COUNT = 14 };

static void list_stages(const struct job *job, struct stage stages[STAGE_COUNT])
{
    const struct cranny_bake_report *r = &job->report;
    const struct stage list[STAGE_COUNT] = {
        {"load", "read the scene", job->load_s, 0},
        {"sample", "place samples", r->seconds_sample, r->bytes_samples},
        {"fog", "flatten trees, boxes of fog for shrubs", r->seconds_fog, 0},
        {"bvh", "build the structure for rays", r->seconds_bvh - r->seconds_fog, r->bytes_bvh},
        {"trace", "trace samples", r->seconds_trace, 0},
        {"solve", "least-squares fit", r->seconds_solve, r->bytes_solve},
        {"local", "meshes by themselves", r->seconds_local, 0},
        {"volume", "sparse volume around instances", r->seconds_volume, r->bytes_volume},
        {"linear", "coefficients of instances", r->seconds_linear, 0},
        {"scalar", "shrubs and grass", r->seconds_scalar, 0},
        {"resample", "resample lower levels of detail", r->seconds_resample, 0},
        {"lod", "least-squares fit of these", r->seconds_lod, 0},
        {"cache", "read, compare and keep for the next bake", r->seconds_cache, r->bytes_cache},
        {"write", "write the file", job->write_s, 0},
    };
    memcpy(stages, list, sizeof list);
}

static json_t *seconds_json(const struct job *job)
{
    struct stage stages[STAGE_COUNT];
    json_t *seconds = json_object();
    list_stages(job, stages);
    for (int i = 0; i < STAGE_COUNT; i++)
        json_object_set_new(seconds, stages[i].key, json_number(stages[i].seconds));
    /* The structure for rays as a whole, as it was before fog came to it. */
    json_object_set_new(seconds, "bvh", json_number(job->report.seconds_bvh));
    json_object_set_new(seconds, "preview", json_number(job->preview_s));
    json_object_set_new(seconds, "total", json_number(job->total_s));
    return seconds;
}

static json_t *bytes_json(const struct cranny_bake_report *r)
{
    return json_pack("{sI sI sI sI sI sI sI}", "bvh", (json_int_t)r->bytes_bvh, "samples",
                     (json_int_t)r->bytes_samples, "solve", (json_int_t)r->bytes_solve, "volume",
                     (json_int_t)r->bytes_volume, "values", (json_int_t)r->bytes_values, "vertices",
                     (json_int_t)r->bytes_vertices, "peak", (json_int_t)bake_peak_bytes());
}

/* Of enum cranny_reuse: the word in JSON, and what it means. */
static const struct {
    const char *word, *text;
} reuses[] = {
    {"off", NULL},
    {"done", NULL},
    {"first", "nothing was kept yet"},
    {"parameters", "what was kept is for other parameters or another version"},
    {"damaged", "what was kept could not be read"},
    {"density", "the scene's faces call for another density of samples (set density to fix it)"},
    {"ground", "the ground plane is elsewhere"},
    {"vertex", "fit=vertex keeps nothing"},
};

const char *bake_reuse_text(const struct cranny_bake_report *r, char text[160])
{
    const uint64_t changes =
        r->added_occluders > r->removed_occluders ? r->added_occluders : r->removed_occluders;
    if (r->reuse == CRANNY_REUSE_OFF)
        return NULL;
    if (r->reuse != CRANNY_REUSE_DONE)
        snprintf(text, 160, "everything baked anew: %s", reuses[r->reuse].text);
    else if (changes && !r->reused_samples)
        snprintf(text, 160, "everything baked anew: all is within reach of %" PRIu64 " changes",
                 changes);
    else
        snprintf(text, 160,
                 "%" PRIu64 " changed; taken over: %.2f %% of the samples, %" PRIu64 " of %" PRIu64
                 " meshes",
                 changes, r->samples ? 100.0 * (double)r->reused_samples / (double)r->samples : 0.0,
                 r->reused_sets, r->meshes);
    return text;
}

static json_t *cache_json(const struct job *job)
{
    const struct cranny_bake_report *r = &job->report;
    if (r->reuse == CRANNY_REUSE_OFF)
        return json_null();
    return json_pack("{so ss sI sI so sI}", "folder", json_text(job->options.cache), "outcome",
                     reuses[r->reuse].word, "added", (json_int_t)r->added_occluders, "removed",
                     (json_int_t)r->removed_occluders, "seconds", json_number(r->seconds_cache),
                     "bytes", (json_int_t)r->bytes_cache);
}

static json_t *sets_json(const struct cranny_bake *bake)
{
    json_t *sets = json_array();
    for (size_t i = 0; i < cranny_bake_set_count(bake); i++) {
        struct cranny_bake_set s;
        cranny_bake_get_set(bake, i, &s);
        json_array_append_new(
            sets, json_pack("{so sI sI ss sI sI sI sI sI so so so sI}", "mesh", json_text(s.mesh),
                            "instance", (json_int_t)s.instance_first, "instances",
                            (json_int_t)s.instance_count, "treatment", treatment_names[s.treatment],
                            "vertices", (json_int_t)s.vertices, "triangles",
                            (json_int_t)s.triangles, "samples", (json_int_t)s.samples,
                            "invalid_samples", (json_int_t)s.invalid_samples, "unsampled_vertices",
                            (json_int_t)s.unsampled_vertices, "area", json_number(s.area),
                            "fit_rms", json_number(s.fit_rms), "model_rms",
                            json_number(s.model_rms), "bytes", (json_int_t)s.bytes));
    }
    return sets;
}

json_t *bake_json(const struct job *job, const char *to)
{
    const struct cranny_bake_report *r = &job->report;
    json_t *object = json_pack(
        "{so so sI sI sI sI sI sI sI sI sI so so so so so so}", "input", json_text(job->input),
        "output", json_text(job->output), "meshes", (json_int_t)r->meshes, "instances",
        (json_int_t)r->instances, "vertices", (json_int_t)r->vertices, "triangles",
        (json_int_t)r->triangles, "samples", (json_int_t)r->samples, "invalid_samples",
        (json_int_t)r->invalid_samples, "rays", (json_int_t)r->rays, "unsampled_vertices",
        (json_int_t)r->unsampled_vertices, "lost_components", (json_int_t)r->lost_components,
        "mrays_per_s", json_number(r->mrays_per_s), "fit_rms", json_number(r->fit_rms),
        "mean_visibility", json_number(r->mean_visibility), "solver_iterations",
        json_number(r->solver_iterations_max), "seconds", seconds_json(job), "bytes",
        bytes_json(r));
    json_object_set_new(
        object, "level",
        json_pack("{sI sI sI sI sI sI sI sI sI}", "trees", (json_int_t)r->trees, "fog_boxes",
                  (json_int_t)r->fog_boxes, "linear_instances", (json_int_t)r->linear_instances,
                  "scalar_instances", (json_int_t)r->scalar_instances, "lod_instances",
                  (json_int_t)r->lod_instances, "lod_samples", (json_int_t)r->lod_samples,
                  "lod_missed", (json_int_t)r->lod_missed, "volume_points",
                  (json_int_t)r->volume_points, "volume_buried", (json_int_t)r->volume_buried));
    json_object_set_new(object, "reused_samples", json_integer((json_int_t)r->reused_samples));
    json_object_set_new(object, "reused_sets", json_integer((json_int_t)r->reused_sets));
    json_object_set_new(object, "cache", cache_json(job));
    json_object_set_new(object, "sets", sets_json(job->bake));
    json_object_set_new(object, "to", json_string(to));
    json_object_set_new(object, "parameters",
                        json_parameters(cranny_bake_param_table(), &job->params));
    json_object_set_new(object, "warnings", json_warnings(&job->ui));
    return object;
}

static const char style[] =
    "<style>:root{color-scheme:light dark}body{font:16px/1.45 system-ui,sans-serif;margin:2rem "
    "auto;max-width:70rem;padding:0 1rem}table{border-collapse:collapse;margin:1rem "
    "0;font-variant-numeric:tabular-nums}td,th{padding:.2rem .7rem;text-align:right;border-bottom:"
    "1px solid #8884}td:first-child,th:first-child,td:last-child,th:last-child{text-align:left}"
    ".wide{overflow-x:auto}.bar{display:inline-block;height:.7em;background:#5b8def}"
    "@media print{body{margin:0}}</style>\n";

static void print_bytes(FILE *out, uint64_t bytes)
{
    if (bytes)
        fprintf(out, "%.1f MiB", (double)bytes / 1048576);
}

static void print_stages(FILE *out, const struct job *job)
{
    struct stage stages[STAGE_COUNT];
    double longest = 1e-9;
    list_stages(job, stages);
    for (int i = 0; i < STAGE_COUNT; i++)
        longest = fmax(longest, stages[i].seconds);
    fputs("<h2>Stages</h2>\n<div class=\"wide\"><table><tr><th>stage</th><th>seconds</th>"
          "<th>memory</th><th></th></tr>\n",
          out);
    for (int i = 0; i < STAGE_COUNT; i++) {
        if (stages[i].seconds <= 0)
            continue;
        fprintf(out, "<tr><td>%s</td><td>%.3f</td><td>", stages[i].words, stages[i].seconds);
        print_bytes(out, stages[i].bytes);
        fprintf(out, "</td><td><span class=\"bar\" style=\"width:%.1frem\"></span></td></tr>\n",
                12 * stages[i].seconds / longest);
    }
    fprintf(out, "<tr><th>total</th><th>%.3f</th><th>", job->total_s);
    print_bytes(out, bake_peak_bytes());
    fputs("</th><th></th></tr></table></div>\n", out);
}

static void print_summary(FILE *out, const struct job *job)
{
    const struct cranny_bake_report *r = &job->report;
    fputs("<p>", out);
    html_text(out, job->input);
    fprintf(out,
            ": %" PRIu64 " vertices and %" PRIu64 " triangles in %" PRIu64 " instances; %" PRIu64
            " samples, of which %" PRIu64 " were buried; %.1f million rays at %.1f million a "
            "second.</p>\n",
            r->vertices, r->triangles, r->instances, r->samples, r->invalid_samples,
            (double)r->rays * 1e-6, r->mrays_per_s);
    if (r->linear_instances || r->scalar_instances || r->lod_instances)
        fprintf(out,
                "<p>%" PRIu64 " instances have four coefficients each, %" PRIu64
                " shrubs and clumps of grass one number each, %" PRIu64
                " at lower levels of detail take their values over (%" PRIu64 " of %" PRIu64
                " samples found nothing near). %" PRIu64
                " trees are half transparent to rays, %" PRIu64 " shrubs are boxes of fog.</p>\n",
                r->linear_instances, r->scalar_instances, r->lod_instances, r->lod_missed,
                r->lod_samples, r->trees, r->fog_boxes);
    char text[160];
    if (bake_reuse_text(r, text)) {
        fputs("<p>Cache ", out);
        html_text(out, job->options.cache);
        fputs(": ", out);
        html_text(out, text);
        fprintf(out, ". It keeps %.1f MiB.</p>\n", (double)r->bytes_cache / 1048576);
    }
    fprintf(out,
            "<p>A game keeps %.2f MiB of floats; values on every vertex of every instance would be "
            "%.2f MiB.</p>\n",
            (double)r->bytes_values / 1048576, (double)r->bytes_vertices / 1048576);
}

/* What the departure that no noise explains asks for. */
static const char *verdict(const struct cranny_bake_set *s)
{
    if (s->treatment == CRANNY_TREATMENT_SCALAR)
        return "one number an instance";
    if (isnan(s->model_rms))
        return "too few samples to say";
    if (s->model_rms < SEEN_RMS)
        return "vertices suffice";
    return s->model_rms < TEXTURE_RMS ? "finer vertices would show more"
                                      : "a texture would pay here";
}

static double weight(const struct cranny_bake_set *s)
{
    return isnan(s->model_rms) ? 0 : s->model_rms * sqrt(s->area);
}

static int compare_sets(const void *a, const void *b)
{
    const double x = weight(a), y = weight(b);
    return (x < y) - (x > y);
}

static void print_set(FILE *out, const struct cranny_bake_set *s)
{
    fputs("<tr><td>", out);
    html_text(out, *s->mesh ? s->mesh : "(no name)");
    fprintf(out,
            "</td><td>%" PRIu32 "</td><td>%s</td><td>%" PRIu64 "</td><td>%" PRIu64
            "</td><td>%.1f %%</td><td>%" PRIu64 "</td><td>%.4f</td><td>",
            s->instance_count, treatment_names[s->treatment], s->vertices, s->samples,
            s->samples ? 100.0 * (double)s->invalid_samples / (double)s->samples : 0.0,
            s->unsampled_vertices, s->fit_rms);
    if (!isnan(s->model_rms))
        fprintf(out, "%.4f", s->model_rms);
    fprintf(out, "</td><td>%s</td></tr>\n", verdict(s));
}

static bool print_sets(FILE *out, const struct cranny_bake *bake)
{
    const size_t count = cranny_bake_set_count(bake);
    struct cranny_bake_set *sets = calloc(count + 1, sizeof *sets);
    if (!sets)
        return false;
    for (size_t i = 0; i < count; i++)
        cranny_bake_get_set(bake, i, &sets[i]);
    qsort(sets, count, sizeof *sets, compare_sets);
    fputs("<h2>Meshes</h2>\n<p>Worst first: by what the vertices cannot hold (model rms: the "
          "departure from the samples that both halves of them agree on, so that noise is no part "
          "of it), times the root of the area. Below 0.02 nobody sees it.</p>\n"
          "<div class=\"wide\"><table><tr><th>mesh</th><th>instances</th><th>treatment</th>"
          "<th>vertices</th><th>samples</th><th>buried</th><th>extrapolated</th><th>fit rms</th>"
          "<th>model rms</th><th>verdict</th></tr>\n",
          out);
    for (size_t i = 0; i < count; i++)
        print_set(out, &sets[i]);
    fputs("</table></div>\n", out);
    free(sets);
    return true;
}

static bool print_page(FILE *out, const struct job *job)
{
    fputs("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta "
          "name=\"viewport\" content=\"width=device-width\">\n<title>",
          out);
    html_text(out, job->output);
    fputs("</title>\n", out);
    fputs(style, out);
    fputs("</head><body><h1>Bake of ", out);
    html_text(out, job->output);
    fputs("</h1>\n", out);
    print_summary(out, job);
    print_stages(out, job);
    const bool complete = print_sets(out, job->bake);
    fputs("</body></html>\n", out);
    return complete;
}

enum cranny_status bake_write_report(const struct job *job, struct cranny_error *why)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    const bool complete = out && print_page(out, job);
    if (!out || fclose(out) != 0 || !complete) {
        free(text);
        return refuse(why, CRANNY_MEMORY, "--report: out of memory");
    }
    const enum cranny_status status = cranny_file_write(job->options.report, text, size, why);
    free(text);
    return status;
}
