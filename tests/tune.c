/* Fits: constants that are known come back, bounds hold, threads do not matter, held-out views only
 * judge, and what is wrong is said. */
#include "check.h"

#include <cranny/screen.h>
#include <cranny/tune.h>

enum { WIDTH = 96, HEIGHT = 64, PIXELS = WIDTH * HEIGHT, VIEWS = 4 };

/* A made-up method: a picture of a few lines, with every type of field. */
struct toy {
    float gain, power, offset;
    int count;
    bool inverted;
    int shape;
    float unset;
};

static const char *const shape_names[] = {"line", "square", "down", NULL};

#define TOY(FIELD, TYPE, LOW, HIGH, DEFAULT, CHOICES, STEP)                                        \
    {                                                                                              \
        .name = #FIELD, .type = TYPE, .offset = offsetof(struct toy, FIELD), .unit = "",           \
        .minimum = LOW, .maximum = HIGH, .fallback = DEFAULT, .choices = CHOICES, .help = "a toy", \
        .step = STEP                                                                               \
    }

static const struct cranny_param toy_rows[] = {
    TOY(gain, CRANNY_PARAM_FLOAT, 0, 100, 1, NULL, 0.2),
    TOY(power, CRANNY_PARAM_FLOAT, 0.05, 20, 1, NULL, 0.2),
    TOY(offset, CRANNY_PARAM_FLOAT, 0, 1, 0, NULL, 0),
    TOY(count, CRANNY_PARAM_INT, 1, 64, 4, NULL, 0),
    TOY(inverted, CRANNY_PARAM_BOOL, 0, 1, 0, NULL, 0),
    TOY(shape, CRANNY_PARAM_ENUM, 0, 2, 0, shape_names, 0),
    TOY(unset, CRANNY_PARAM_FLOAT, 0, 1, NAN, NULL, 0),
};
static const struct cranny_param_table toy_table = {"toy", toy_rows, 7};

static struct toy toy_default(void)
{
    struct toy toy = {0};
    cranny_params_defaults(&toy_table, &toy);
    return toy;
}

/* A texture, darkened on one side by `offset` and in the lower half by `count`. */
static float toy_value(const struct toy *toy, size_t view, int x, int y)
{
    const uint32_t hash = ((uint32_t)(x + 131 * y) * 2654435761u + (uint32_t)view) * 2246822519u;
    const float h = (float)(hash >> 8) / 16777216.f;
    const float bent = toy->shape == 0 ? h : toy->shape == 1 ? h * h : 1 - h;
    const bool marked = (x < WIDTH / 3) != toy->inverted;
    const float dark =
        (marked ? toy->offset : 0) + (y > HEIGHT / 2 ? 0.01f * (float)toy->count : 0);
    const float open = 1 - toy->gain * 0.4f * bent - dark;
    return powf(fminf(fmaxf(open, 0), 1), toy->power);
}

/* No method draws the truth itself: what it cannot draw, the same for all. */
static float flawed(float value, int pixel)
{
    const uint32_t hash = ((uint32_t)pixel + 77) * 2654435761u;
    return fminf(fmaxf(value + ((float)(hash >> 8) / 16777216.f - 0.5f) * 0.1f, 0), 1);
}

/* What the drawing counts and does. */
struct desk {
    float truths[VIEWS][PIXELS];
    struct cranny_tune_view views[VIEWS];
    int drawn[VIEWS];
    float least_gain, greatest_gain;
    int stop_after; /* drawings; 0: never */
    enum cranny_status refusal;
    int warnings, infos;
    bool finite;
};

static enum cranny_status draw_toy(void *user, size_t view, const void *params, float *visibility,
                                   struct cranny_error *why)
{
    struct desk *desk = user;
    const struct toy *toy = params;
    desk->drawn[view]++;
    desk->least_gain = fminf(desk->least_gain, toy->gain);
    desk->greatest_gain = fmaxf(desk->greatest_gain, toy->gain);
    if (desk->refusal != CRANNY_OK) {
        why->status = desk->refusal;
        snprintf(why->message, sizeof why->message, "no ink");
        return desk->refusal;
    }
    for (int i = 0; i < PIXELS; i++)
        visibility[i] = toy_value(toy, view, i % WIDTH, i / WIDTH);
    return CRANNY_OK;
}

static void set_desk(struct desk *desk, const struct toy *truth)
{
    memset(desk, 0, sizeof *desk);
    desk->least_gain = INFINITY;
    for (size_t v = 0; v < VIEWS; v++) {
        for (int i = 0; i < PIXELS; i++)
            desk->truths[v][i] = flawed(toy_value(truth, v, i % WIDTH, i / WIDTH), i);
        desk->views[v] = (struct cranny_tune_view){WIDTH, HEIGHT, desk->truths[v], 1, v % 2 == 1};
    }
}

static void on_log(void *user, enum cranny_log_level level, const char *line)
{
    struct desk *desk = user;
    desk->warnings += level == CRANNY_LOG_WARNING;
    desk->infos += level == CRANNY_LOG_INFO;
    CHECK_MSG(*line && !strchr(line, '\n'), "'%s'", line);
}

static bool on_progress(void *user, const char *stage, double done, double total)
{
    struct desk *desk = user;
    CHECK_MSG(done <= total, "%s: %g of %g", stage, done, total);
    return !desk->stop_after || --desk->stop_after > 0;
}

static struct cranny_tune_problem problem_of(struct desk *desk, const struct toy *begin,
                                             const char *const *names, size_t name_count)
{
    return (struct cranny_tune_problem){.table = &toy_table,
                                        .params_size = sizeof *begin,
                                        .params = begin,
                                        .names = names,
                                        .name_count = name_count,
                                        .views = desk->views,
                                        .view_count = VIEWS,
                                        .draw = draw_toy,
                                        .user = desk};
}

static enum cranny_status tune_toy(struct desk *desk, const struct toy *begin,
                                   const char *const *names, size_t name_count, int evaluations,
                                   struct toy *fitted, struct cranny_tune_report *report,
                                   struct cranny_error *why)
{
    const struct cranny_tune_problem problem = problem_of(desk, begin, names, name_count);
    const struct cranny_hooks hooks = {desk, on_log, on_progress};
    const struct cranny_tune_params params = {evaluations, &hooks};
    return cranny_tune(&problem, &params, fitted, report, NULL, why);
}

static struct desk desk;

/* Two reals that pull against each other, from far away. */
static void test_recovers_reals(void)
{
    struct toy truth = toy_default(), fitted;
    struct cranny_tune_report report;
    struct cranny_error why;
    truth.gain = 1.7f;
    truth.power = 0.6f;
    const struct toy begin = toy_default();
    set_desk(&desk, &truth);
    CHECK_OK(tune_toy(&desk, &begin, NULL, 0, 300, &fitted, &report, &why), why);
    CHECK_NEAR(fitted.gain, 1.7, 0.03);
    CHECK_NEAR(fitted.power, 0.6, 0.02);
    CHECK(fitted.offset == 0 && fitted.count == 4 && fitted.shape == 0 && isnan(fitted.unset));
    CHECK(report.converged && !report.flat);
    CHECK_MSG(report.evaluations < 150, "%d evaluations", report.evaluations);
    CHECK(report.fit_after.cost < 0.9 * report.fit_before.cost);
    CHECK(report.held_after.cost < 0.9 * report.held_before.cost);
    CHECK_NEAR(report.fit_before.cost, sqrt(report.fit_before.error * report.fit_before.rmse),
               1e-12);
    CHECK_INT(desk.warnings, 0);
    CHECK(desk.infos > 3);
    /* Held-out views are drawn before and after. */
    CHECK_INT(desk.drawn[1], 2);
    CHECK_INT(desk.drawn[0], report.evaluations + 2);
}

static void test_recovers_every_type(void)
{
    static const char *const names[] = {"offset", "count", "inverted", "shape"};
    struct toy truth = toy_default(), fitted;
    struct cranny_tune_report report;
    struct cranny_error why;
    truth.offset = 0.1f;
    truth.count = 9;
    truth.inverted = true;
    truth.shape = 1;
    struct toy begin = toy_default();
    begin.offset = 0.05f;
    begin.shape = 2;
    set_desk(&desk, &truth);
    CHECK_OK(tune_toy(&desk, &begin, names, 4, 1000, &fitted, &report, &why), why);
    CHECK_INT(fitted.shape, 1);
    CHECK_INT(fitted.inverted, 1);
    CHECK_INT(fitted.count, 9);
    CHECK_NEAR(fitted.offset, 0.1, 0.00101);
    CHECK(fitted.gain == 1 && fitted.power == 1);
}

/* The best gain lies beyond the range; on it is where the fit ends. */
static void test_bounds(void)
{
    static struct cranny_param rows[7];
    static const struct cranny_param_table narrow = {"toy", rows, 7};
    struct toy truth = toy_default(), fitted;
    struct cranny_error why;
    memcpy(rows, toy_rows, sizeof rows);
    rows[0].minimum = 0.9;
    rows[0].maximum = 1.3;
    truth.gain = 1.9f;
    const struct toy begin = toy_default();
    for (int side = 0; side < 2; side++) {
        set_desk(&desk, &truth);
        struct cranny_tune_problem problem = problem_of(&desk, &begin, NULL, 0);
        problem.table = &narrow;
        CHECK_OK(cranny_tune(&problem, NULL, &fitted, NULL, NULL, &why), why);
        CHECK(desk.least_gain >= 0.9f && desk.greatest_gain <= 1.3f);
        CHECK(fitted.gain == (side ? 0.9f : 1.3f));
        truth.gain = 0.3f;
        rows[1].minimum = rows[1].maximum = 1;
    }
}

static void test_limit(void)
{
    struct toy truth = toy_default(), fitted;
    struct cranny_tune_report report;
    struct cranny_error why;
    truth.gain = 2;
    const struct toy begin = toy_default();
    for (int limit = 1; limit < 12; limit++) {
        set_desk(&desk, &truth);
        CHECK_OK(tune_toy(&desk, &begin, NULL, 0, limit, &fitted, &report, &why), why);
        CHECK_INT(report.evaluations, limit);
        CHECK_INT(desk.drawn[0], limit + 2);
        CHECK(!report.converged && !report.flat);
        CHECK(report.fit_after.cost <= report.fit_before.cost);
        CHECK(limit > 1 || memcmp(&fitted, &begin, sizeof begin) == 0);
    }
}

/* All sky: whatever is tried, nothing changes. */
static void test_flat(void)
{
    static const char *const names[] = {"inverted", "shape"};
    struct toy begin = toy_default(), fitted;
    struct cranny_tune_report report;
    struct cranny_error why;
    begin.gain = 0;
    set_desk(&desk, &begin);
    desk.truths[0][7] = 0.5f;
    CHECK_OK(tune_toy(&desk, &begin, names, 2, 300, &fitted, &report, &why), why);
    CHECK(report.flat && report.fit_after.cost == report.fit_before.cost);
    CHECK(memcmp(&fitted, &begin, sizeof begin) == 0);
    CHECK_INT(desk.warnings, 1);
}

static void test_broken_truth(void)
{
    struct toy truth = toy_default(), fitted;
    struct cranny_tune_report report;
    struct cranny_error why;
    truth.gain = 1.5f;
    const struct toy begin = toy_default();
    set_desk(&desk, &truth);
    for (int i = 0; i < PIXELS; i++)
        desk.truths[0][i] = NAN;
    for (int i = 0; i < PIXELS; i += 7)
        desk.truths[2][i] = INFINITY;
    CHECK_OK(tune_toy(&desk, &begin, NULL, 0, 300, &fitted, &report, &why), why);
    CHECK(isfinite(report.fit_after.cost) && report.fit_after.cost <= report.fit_before.cost);
    CHECK(fitted.gain >= 0 && fitted.gain <= 100 && fitted.power >= 0.05f);
}

/* A fit to views that lie: the ones held out get worse, and that is said. */
static void test_held_out(void)
{
    struct toy truth = toy_default(), lie = truth, fitted;
    struct cranny_tune_report report;
    struct cranny_tune_change changes[VIEWS];
    struct cranny_error why;
    truth.gain = 1.1f;
    lie.gain = 1.9f;
    const struct toy begin = toy_default();
    set_desk(&desk, &truth);
    for (size_t v = 0; v < VIEWS; v += 2)
        for (int i = 0; i < PIXELS; i++)
            desk.truths[v][i] = flawed(toy_value(&lie, v, i % WIDTH, i / WIDTH), i);
    const struct cranny_hooks hooks = {&desk, on_log, NULL};
    const struct cranny_tune_params params = {300, &hooks};
    const struct cranny_tune_problem problem = problem_of(&desk, &begin, NULL, 0);
    CHECK_OK(cranny_tune(&problem, &params, &fitted, &report, changes, &why), why);
    CHECK_NEAR(fitted.gain, 1.9, 0.08);
    CHECK(report.held_after.cost > report.held_before.cost);
    CHECK(report.fit_after.cost < report.fit_before.cost);
    CHECK_INT(desk.warnings, 1);
    CHECK_NEAR((changes[1].before.error + changes[3].before.error) / 2, report.held_before.error,
               1e-12);
    CHECK_NEAR((changes[1].after.rmse + changes[3].after.rmse) / 2, report.held_after.rmse, 1e-12);
    CHECK_NEAR((changes[0].after.mean + changes[2].after.mean) / 2, report.fit_after.mean, 1e-12);
    /* A view that weighs nearly all is the one that is fitted. */
    for (int i = 0; i < PIXELS; i++)
        desk.truths[2][i] = flawed(toy_value(&truth, 2, i % WIDTH, i / WIDTH), i);
    desk.views[2].weight = 1e6;
    CHECK_OK(cranny_tune(&problem, &params, &fitted, NULL, NULL, &why), why);
    CHECK_NEAR(fitted.gain, 1.1, 0.02);
}

/* Whenever it is asked to stop, it does. */
static void test_cancel(void)
{
    struct toy truth = toy_default(), fitted = {.gain = 7};
    struct cranny_tune_report report;
    struct cranny_error why;
    truth.gain = 1.5f;
    const struct toy begin = toy_default();
    for (int after = 1; after < 40; after += 3) {
        set_desk(&desk, &truth);
        desk.stop_after = after;
        CHECK_INT(tune_toy(&desk, &begin, NULL, 0, 20, &fitted, &report, &why), CRANNY_CANCELLED);
        CHECK(fitted.gain == 7);
    }
    set_desk(&desk, &truth);
    desk.refusal = CRANNY_INPUT;
    CHECK_INT(tune_toy(&desk, &begin, NULL, 0, 20, &fitted, &report, &why), CRANNY_INPUT);
    CHECK_MSG(strcmp(why.message, "no ink") == 0, "%s", why.message);
}

static void check_refused(const struct cranny_tune_problem *problem, int evaluations,
                          const char *part)
{
    struct toy fitted;
    struct cranny_error why = {0};
    const struct cranny_tune_params params = {evaluations, NULL};
    CHECK_INT(cranny_tune(problem, &params, &fitted, NULL, NULL, &why), CRANNY_USAGE);
    CHECK_MSG(strstr(why.message, part), "no '%s' in '%s'", part, why.message);
}

static void test_refusals(void)
{
    static const char *const lists[][2] = {{"gain", "gone"}, {"gain", "gain"}, {"unset", "gain"}};
    struct toy begin = toy_default();
    set_desk(&desk, &begin);
    const struct cranny_tune_problem good = problem_of(&desk, &begin, NULL, 0);
    check_refused(&good, 0, "0 evaluations");
    check_refused(&good, 100001, "100001 evaluations");
    static const char *const parts[] = {"gone: no such", "gain: named twice",
                                        "unset: has no value"};
    for (size_t i = 0; i < 3; i++) {
        const struct cranny_tune_problem problem = problem_of(&desk, &begin, lists[i], 2);
        check_refused(&problem, 9, parts[i]);
    }
    struct cranny_tune_problem problem = good;
    problem.draw = NULL;
    check_refused(&problem, 9, "who draws");
    problem = good;
    problem.view_count = 0;
    check_refused(&problem, 9, "no view to fit");
    const struct cranny_tune_view view = desk.views[0];
    desk.views[0].width = 0;
    check_refused(&good, 9, "view 0: 0 x 64");
    desk.views[0] = view;
    desk.views[0].weight = NAN;
    check_refused(&good, 9, "weight");
    desk.views[0] = view;
    desk.views[0].truth = NULL;
    check_refused(&good, 9, "no truth");
    desk.views[0] = view;
    for (size_t v = 0; v < VIEWS; v++)
        desk.views[v].held_out = true;
    check_refused(&good, 9, "all are held out");
    for (size_t v = 0; v < VIEWS; v++)
        desk.views[v].held_out = false;
    begin.gain = -1;
    check_refused(&good, 9, "gain: -1 is out of range");
}

/* A floor with boxes: real methods find their own constants again. */
struct studio {
    float depth[PIXELS];
    struct cranny_gbuffer gbuffer;
    float truth[PIXELS];
};

static void set_studio(struct studio *studio)
{
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const float down = ((float)y + 0.5f) / HEIGHT - 0.45f;
            const float floor_at = down > 0 ? 0.8f / down : INFINITY;
            const float box = x / 12 % 2 && y > 12 ? 3 + 0.4f * (float)(x / 24) : 6;
            studio->depth[y * WIDTH + x] = y < 4 ? INFINITY : fminf(floor_at, box);
        }
    studio->gbuffer =
        (struct cranny_gbuffer){.width = WIDTH,
                                .height = HEIGHT,
                                .depth = studio->depth,
                                .projection = cranny_perspective(1, (float)WIDTH / HEIGHT)};
}

static enum cranny_status draw_screen(void *user, size_t view, const void *params,
                                      float *visibility, struct cranny_error *why)
{
    struct studio *studio = user;
    (void)view;
    return cranny_screen_render(&studio->gbuffer, params, visibility, 0, why);
}

static void tune_screen(struct studio *studio, enum cranny_method method, int threads,
                        struct cranny_screen_params *fitted, struct cranny_tune_report *report)
{
    static const char *const names[] = {"radius_scale", "intensity", "contrast"};
    const struct cranny_tune_view view = {WIDTH, HEIGHT, studio->truth, 1, false};
    struct cranny_screen_params begin = cranny_screen_params_preset(method, NULL);
    struct cranny_error why;
    begin.radius_world = 2;
    begin.threads = threads;
    struct cranny_screen_params truth = begin;
    truth.radius_scale *= 0.8f;
    truth.intensity *= 1.3f;
    truth.contrast *= 1.2f;
    CHECK_OK(cranny_screen_render(&studio->gbuffer, &truth, studio->truth, 0, &why), why);
    static float drawn[PIXELS];
    struct cranny_difference flaws;
    memcpy(drawn, studio->truth, sizeof drawn);
    for (int i = 0; i < PIXELS; i++)
        studio->truth[i] = flawed(studio->truth[i], i);
    CHECK_OK(cranny_difference_measure(WIDTH, HEIGHT, drawn, 0, studio->truth, 0, &flaws, &why),
             why);
    const double least = sqrt(flaws.error * flaws.rmse);
    const struct cranny_tune_problem problem = {.table = cranny_screen_param_table(method),
                                                .params_size = sizeof begin,
                                                .params = &begin,
                                                .names = names,
                                                .name_count = 3,
                                                .views = &view,
                                                .view_count = 1,
                                                .draw = draw_screen,
                                                .user = studio};
    CHECK_OK(cranny_tune(&problem, NULL, fitted, report, NULL, &why), why);
    const char *name = cranny_method_name(method);
    CHECK_MSG(report->fit_after.cost < 1.02 * least, "%s: cost %g, could be %g", name,
              report->fit_after.cost, least);
    CHECK_MSG(fabsf(fitted->radius_scale - truth.radius_scale) < 0.06f, "%s: scale %g, not %g",
              name, (double)fitted->radius_scale, (double)truth.radius_scale);
    CHECK_MSG(fabsf(fitted->intensity * fitted->contrast - truth.intensity * truth.contrast) <
                  0.1f * truth.intensity * truth.contrast,
              "%s: intensity %g, contrast %g", name, (double)fitted->intensity,
              (double)fitted->contrast);
}

static void test_methods(void)
{
    static struct studio studio;
    set_studio(&studio);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++) {
        struct cranny_screen_params one, many;
        struct cranny_tune_report reports[2];
        tune_screen(&studio, (enum cranny_method)m, 1, &one, &reports[0]);
        tune_screen(&studio, (enum cranny_method)m, 3, &many, &reports[1]);
        many.threads = 1;
        CHECK_MSG(memcmp(&one, &many, sizeof one) == 0, "method %d: threads change the fit", m);
        CHECK(memcmp(&reports[0], &reports[1], sizeof reports[0]) == 0);
    }
}

int main(void)
{
    test_recovers_reals();
    test_recovers_every_type();
    test_bounds();
    test_limit();
    test_flat();
    test_broken_truth();
    test_held_out();
    test_cancel();
    test_refusals();
    test_methods();
    return check_end("tune");
}
