#include "frame.h"

#include "files.h"
#include "view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PIXELS ((size_t)FRAME_WIDTH * FRAME_HEIGHT)

const int frame_methods[FRAME_METHOD_COUNT] = {METHOD_SSAO, METHOD_HBAO, METHOD_CREASE,
                                               METHOD_ALCHEMY, METHOD_VOLUMES};

struct studio {
    const struct frame_job *job;
    struct frame *result;
    struct view view;
    struct cranny_tracer *tracer; /* owned, as are the others */
    struct cranny_frame *frame;
    struct method_state state;
    float *truth, *estimate;
    uint8_t *rgb;
};

/* To so many significant digits, so that the command is short; what a reader of the words gets. */
static double round_to(double value, int digits, char words[32])
{
    snprintf(words, 32, "%.*e", digits - 1, value);
    const double rounded = strtod(words, NULL);
    snprintf(words, 32, "%g", rounded);
    return rounded;
}

static enum cranny_status write_values(const struct studio *studio, const char *stem,
                                       const float *values, struct cranny_error *why)
{
    char name[80];
    snprintf(name, sizeof name, "frame-%s.png", stem);
    char *path = path_in(studio->job->folder, name);
    enum cranny_status status =
        path ? cranny_image_write(path, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_AUTO, FRAME_WIDTH,
                                  FRAME_HEIGHT, 1, values, 0, why)
             : no_memory(why);
    free(path);
    return status;
}

static enum cranny_status write_rgb(const struct studio *studio, const char *stem,
                                    struct cranny_error *why)
{
    char name[80];
    snprintf(name, sizeof name, "frame-%s.png", stem);
    char *path = path_in(studio->job->folder, name);
    enum cranny_status status = path ? cranny_png_write(path, FRAME_WIDTH, FRAME_HEIGHT, 3,
                                                        studio->rgb, 3 * FRAME_WIDTH, why)
                                     : no_memory(why);
    free(path);
    return status;
}

static enum cranny_status choose_view(struct studio *studio, struct cranny_error *why)
{
    const struct frame_job *job = studio->job;
    struct cranny_tracer_params params = cranny_tracer_params_default();
    params.hooks = job->hooks;
    enum cranny_status status = cranny_tracer_create(job->scene, &params, &studio->tracer, why);
    if (status == CRANNY_OK)
        status =
            view_pick(job->scene, studio->tracer, job->views, job->view_count, &studio->view, why);
    struct frame *result = studio->result;
    struct view *view = &studio->view;
    if (status != CRANNY_OK || !(view->score > 0))
        return status;
    result->made = true;
    result->view = view->index;
    result->depth_median = view->depth_median;
    view->radius_world = round_to(view->radius_world, 2, result->radius);
    snprintf(result->view_words, sizeof result->view_words, "%s", view->words);
    return CRANNY_OK;
}

/* The guard band is that of cranny render: a tenth of the height. */
static enum cranny_status draw(struct studio *studio, struct cranny_error *why)
{
    struct cranny_frame_params params = cranny_frame_params_default();
    params.width = FRAME_WIDTH;
    params.height = FRAME_HEIGHT;
    params.guard_band = FRAME_HEIGHT / 10;
    params.hooks = studio->job->hooks;
    studio->truth = malloc(PIXELS * sizeof *studio->truth);
    studio->estimate = malloc(PIXELS * sizeof *studio->estimate);
    studio->rgb = malloc(PIXELS * 3);
    if (!studio->truth || !studio->estimate || !studio->rgb)
        return no_memory(why);
    return cranny_frame_create(studio->job->scene, studio->tracer, &studio->view.camera, &params,
                               &studio->frame, why);
}

static enum cranny_status trace_truth(struct studio *studio, struct cranny_error *why)
{
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    params.radius_world = (float)studio->view.radius_world;
    params.rays = studio->job->rays;
    params.hooks = studio->job->hooks;
    studio->result->rays = params.rays;
    enum cranny_status status = cranny_frame_raytrace(studio->frame, &params, studio->truth, 0,
                                                      NULL, &studio->result->truth, why);
    return status == CRANNY_OK ? write_values(studio, "truth", studio->truth, why) : status;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* After one run that does not count: it makes what is kept. */
static enum cranny_status estimate(struct studio *studio, const struct method *method,
                                   struct frame_score *score, struct cranny_error *why)
{
    const struct method_input input = {studio->job->scene, studio->frame,
                                       cranny_frame_gbuffer(studio->frame)};
    union method_params params;
    struct method_report report = {0};
    double times[FRAME_RUNS + 1] = {0};
    enum cranny_status status = CRANNY_OK;
    method_params_preset(method, NULL, &params);
    *method_fields(method, &params).radius_world = (float)studio->view.radius_world;
    *method_fields(method, &params).hooks = studio->job->hooks;
    for (int i = 0; i <= FRAME_RUNS && status == CRANNY_OK; i++) {
        status =
            method_run(method, &input, &params, &studio->state, studio->estimate, &report, why);
        times[i] = report.total_ms;
    }
    qsort(times + 1, FRAME_RUNS, sizeof *times, compare_doubles);
    score->milliseconds = times[1 + FRAME_RUNS / 2];
    score->setup_s = report.setup_s;
    studio->result->isa = cranny_isa_name((enum cranny_isa)report.isa);
    return status;
}

static enum cranny_status judge(struct studio *studio, int index, struct cranny_error *why)
{
    struct frame_score *score = &studio->result->scores[index];
    const struct method *method = &methods[frame_methods[index]];
    const char *name = method->name;
    char map[64];
    snprintf(map, sizeof map, "%s-map", name);
    enum cranny_status status = estimate(studio, method, score, why);
    if (status == CRANNY_OK)
        status = write_values(studio, name, studio->estimate, why);
    if (status == CRANNY_OK)
        status = cranny_difference_measure(FRAME_WIDTH, FRAME_HEIGHT, studio->estimate, 0,
                                           studio->truth, 0, &score->difference, why);
    if (status == CRANNY_OK)
        status = cranny_difference_map(FRAME_WIDTH, FRAME_HEIGHT, studio->estimate, 0,
                                       studio->truth, 0, (float)FRAME_MAP_SCALE, studio->rgb, why);
    return status == CRANNY_OK ? write_rgb(studio, map, why) : status;
}

/* With this estimate and without any, under one exposure. */
static enum cranny_status light(struct studio *studio, struct cranny_error *why)
{
    struct cranny_light light = cranny_light_default();
    enum cranny_status status =
        cranny_frame_exposure(studio->frame, studio->estimate, 0, &light, &light.exposure, why);
    light.exposure = (float)round_to((double)light.exposure, 3, studio->result->exposure);
    if (status == CRANNY_OK)
        status =
            cranny_frame_shade(studio->frame, studio->estimate, 0, &light, 0, studio->rgb, why);
    if (status == CRANNY_OK)
        status = write_rgb(studio, "lit", why);
    if (status == CRANNY_OK)
        status = cranny_frame_shade(studio->frame, NULL, 0, &light, 0, studio->rgb, why);
    return status == CRANNY_OK ? write_rgb(studio, "open", why) : status;
}

static enum cranny_status shoot(struct studio *studio, struct cranny_error *why)
{
    enum cranny_status status = draw(studio, why);
    if (status == CRANNY_OK)
        status = trace_truth(studio, why);
    for (int i = 0; i < FRAME_METHOD_COUNT && status == CRANNY_OK; i++) {
        status = judge(studio, i, why);
        if (status == CRANNY_OK && i == FRAME_LIT)
            status = light(studio, why);
    }
    return status;
}

enum cranny_status frame_make(const struct frame_job *job, struct frame *frame,
                              struct cranny_error *why)
{
    struct studio studio = {.job = job, .result = frame};
    *frame = (struct frame){.made = false};
    enum cranny_status status = choose_view(&studio, why);
    if (status == CRANNY_OK && frame->made)
        status = shoot(&studio, why);
    method_state_free(&studio.state);
    cranny_frame_destroy(&studio.frame);
    cranny_tracer_destroy(&studio.tracer);
    free(studio.truth);
    free(studio.estimate);
    free(studio.rgb);
    return status;
}
