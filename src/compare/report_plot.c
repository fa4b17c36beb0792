/* Based on: Morgan McGuire, Ambient Occlusion Volumes, 2009, Figure 10: time against error. Both
 * axes are logarithmic here, and the Pareto front is drawn. */
#include "compare/report_parts.h"

enum { WIDTH = 760, HEIGHT = 440, LEFT = 58, RIGHT = 14, TOP = 16, BOTTOM = 46, COLORS = 8 };

#define LETTER_WIDTH 6.9 /* of the labels, on average and generously */
#define LABEL_HEIGHT 14.0
#define ERROR_FLOOR 1e-3 /* stands for 0, which a logarithm has no place for */

struct box {
    double x0, y0, x1, y1;
};

struct point {
    const struct cranny_report_trial *trial;
    double x, y;
    int color;
    struct box label;
    bool front;
};

struct axis {
    double low, high;  /* logarithms, base 10 */
    double begin, end; /* in the picture */
};

struct plot {
    FILE *out;
    struct point *points;
    size_t count;
    struct axis time, error;
};

static double place(const struct axis *axis, double value)
{
    const double share = (log10(value) - axis->low) / (axis->high - axis->low);
    return axis->begin + share * (axis->end - axis->begin);
}

static double error_of(const struct cranny_report_trial *trial)
{
    return trial->error > ERROR_FLOOR ? trial->error : ERROR_FLOOR;
}

static double time_of(const struct cranny_report_trial *trial)
{
    return trial->milliseconds > 1e-3 ? trial->milliseconds : 1e-3;
}

/* Some room around all values. */
static void fit_axis(struct axis *axis, const struct plot *plot,
                     double (*value)(const struct cranny_report_trial *))
{
    axis->low = INFINITY;
    axis->high = -INFINITY;
    for (size_t i = 0; i < plot->count; i++) {
        axis->low = fmin(axis->low, log10(value(plot->points[i].trial)));
        axis->high = fmax(axis->high, log10(value(plot->points[i].trial)));
    }
    const double room = fmax(0.1, 0.1 * (axis->high - axis->low));
    axis->low -= room;
    axis->high += room;
}

static int compare_times(const void *a, const void *b)
{
    const struct cranny_report_trial *x = ((const struct point *)a)->trial;
    const struct cranny_report_trial *y = ((const struct point *)b)->trial;
    if (x->milliseconds != y->milliseconds)
        return x->milliseconds < y->milliseconds ? -1 : 1;
    return (x->error > y->error) - (x->error < y->error);
}

/* Colours go to methods in the order in which they come. */
static int color_of(const struct cranny_report_trial *trials, size_t index)
{
    int color = 0;
    for (size_t i = 0; i < index; i++) {
        if (strcmp(trials[i].method, trials[index].method) == 0)
            return color_of(trials, i);
        bool first = true;
        for (size_t j = 0; j < i && first; j++)
            first = strcmp(trials[j].method, trials[i].method) != 0;
        color += first;
    }
    return trials[index].is_truth ? COLORS - 1 : color % (COLORS - 1);
}

static void place_points(struct plot *plot, const struct cranny_report_trial *trials)
{
    for (size_t i = 0; i < plot->count; i++)
        plot->points[i] = (struct point){.trial = &trials[i],
                                         .color = color_of(trials, i),
                                         .front = report_on_front(trials, plot->count, i)};
    fit_axis(&plot->time, plot, time_of);
    fit_axis(&plot->error, plot, error_of);
    for (size_t i = 0; i < plot->count; i++) {
        plot->points[i].x = place(&plot->time, time_of(plot->points[i].trial));
        plot->points[i].y = place(&plot->error, error_of(plot->points[i].trial));
    }
    qsort(plot->points, plot->count, sizeof *plot->points, compare_times);
}

static size_t letters(const char *text)
{
    size_t count = 0;
    for (; *text; text++)
        count += ((unsigned char)*text & 0xc0) != 0x80;
    return count;
}

static double label_width(const struct cranny_report_trial *trial)
{
    const bool cpu = strcmp(trial->device, "cpu") == 0;
    return LETTER_WIDTH * (double)(letters(trial->method) + 1 + letters(trial->preset) +
                                   (cpu ? 0 : 2 + letters(trial->device)));
}

static double overlap(const struct box *a, const struct box *b)
{
    const double x = fmin(a->x1, b->x1) - fmax(a->x0, b->x0);
    const double y = fmin(a->y1, b->y1) - fmax(a->y0, b->y0);
    return x > 0 && y > 0 ? x * y : 0;
}

/* How much of the front a label would cover; points are sorted by time. */
static double front_cost(const struct plot *plot, const struct box *box)
{
    double sum = 0, y = TOP;
    const struct point *last = NULL;
    for (size_t i = 0; i <= plot->count; i++) {
        const struct point *p = i < plot->count ? &plot->points[i] : NULL;
        if (p && !p->front)
            continue;
        const double x = p ? p->x : WIDTH - RIGHT;
        const struct box step = {last ? last->x : x, y - 2, x, y + 2};
        const struct box drop = {x - 2, y, x + 2, p ? p->y : y};
        sum += overlap(box, &step) + overlap(box, &drop);
        y = p ? p->y : y;
        last = p;
    }
    return sum;
}

/* How much of other labels, markers, the front and the border a label would cover. */
static double cost(const struct plot *plot, size_t index, const struct box *box)
{
    const struct box frame = {LEFT, TOP, WIDTH - RIGHT, HEIGHT - BOTTOM};
    double sum = (box->x1 - box->x0) * (box->y1 - box->y0) - overlap(box, &frame);
    sum = 4 * sum + front_cost(plot, box);
    for (size_t i = 0; i < plot->count; i++) {
        const struct point *p = &plot->points[i];
        const struct box marker = {p->x - 7, p->y - 7, p->x + 7, p->y + 7};
        sum += 3 * overlap(box, &marker);
        if (i < index)
            sum += 2 * overlap(box, &p->label);
    }
    return sum;
}

/* The nearest place around the marker where the label covers nothing; else the one where it covers
 * least. */
static void place_label(struct plot *plot, size_t index)
{
    struct point *point = &plot->points[index];
    const double width = label_width(point->trial);
    double best = INFINITY;
    for (int ring = 0; ring < 14; ring++)
        for (int turn = 0; turn < 16; turn++) {
            const double angle = 0.39269908169872414 * (turn / 2 * (turn % 2 ? -1 : 1) + turn % 2);
            const double away = 10 + 9.0 * ring;
            const double x = point->x + away * cos(angle) + (cos(angle) - 1) * width / 2;
            const double y = point->y - away * sin(angle) - LABEL_HEIGHT / 2;
            const struct box box = {x, y, x + width, y + LABEL_HEIGHT};
            const double worth = cost(plot, index, &box) + 0.05 * ring * ring + 0.01 * turn;
            if (worth < best - 1e-9) {
                best = worth;
                point->label = box;
            }
        }
}

static void tick(const struct plot *plot, bool is_time, double value)
{
    const struct axis *axis = is_time ? &plot->time : &plot->error;
    const double at = place(axis, value);
    if (is_time)
        fprintf(plot->out,
                "<path class=\"grid\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
                "text-anchor=\"middle\">%g</text>\n",
                at, TOP, HEIGHT - BOTTOM, at, HEIGHT - BOTTOM + 17, value);
    else
        fprintf(plot->out,
                "<path class=\"grid\" d=\"M%d %.1fH%d\"/><text x=\"%d\" y=\"%.1f\" "
                "text-anchor=\"end\">%g</text>\n",
                LEFT, at, WIDTH - RIGHT, LEFT - 7, at + 4.5, value);
}

/* 1, 2, 5 of every decade; fewer where that would be too many, more where it would be too few. */
static void ticks(const struct plot *plot, bool is_time)
{
    static const double steps[] = {1, 2, 5, 1.5, 3, 4, 7};
    const struct axis *axis = is_time ? &plot->time : &plot->error;
    const double decades = axis->high - axis->low;
    const size_t count = decades > 3.5 ? 1 : decades > 0.9 ? 3 : COUNT_OF(steps);
    for (int decade = (int)floor(axis->low); decade <= (int)ceil(axis->high); decade++)
        for (size_t i = 0; i < count; i++) {
            const double value = steps[i] * pow(10, decade), log_value = log10(value);
            if (log_value > axis->low && log_value < axis->high)
                tick(plot, is_time, value);
        }
}

static void axes(const struct plot *plot)
{
    ticks(plot, true);
    ticks(plot, false);
    fprintf(plot->out,
            "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">time of a picture in ms, logarithmic: "
            "further left is faster</text>\n"
            "<text transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">error (σ², "
            "eq. 31), logarithmic</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 8, (TOP + HEIGHT - BOTTOM) / 2);
}

/* Steps from the top over the best of each time to the right end; points are sorted by time. */
static void front(const struct plot *plot)
{
    for (int pass = 0; pass < 2; pass++) {
        bool begun = false;
        fprintf(plot->out, "<path class=\"%s\" d=\"", pass ? "front" : "behind");
        for (size_t i = 0; i < plot->count; i++) {
            const struct point *p = &plot->points[i];
            if (!p->front)
                continue;
            fprintf(plot->out, begun ? "H%.1f" : "M%.1f %d", p->x, TOP);
            fprintf(plot->out, "V%.1f", p->y);
            begun = true;
        }
        fprintf(plot->out, "H%d", WIDTH - RIGHT);
        fprintf(plot->out, pass ? "\"/>\n" : "V%dZ\"/>\n", TOP);
    }
}

/* Points of one method that are steps of one quality, joined in the order of their times. */
static void one_series(const struct plot *plot, const char *method)
{
    bool begun = false;
    for (size_t i = 0; i < plot->count; i++) {
        const struct point *p = &plot->points[i];
        if (!p->trial->series || strcmp(p->trial->method, method) != 0)
            continue;
        if (!begun)
            fprintf(plot->out, "<g class=\"c%d\"><path class=\"series\" d=\"", p->color);
        fprintf(plot->out, "%s%.1f %.1f", begun ? "L" : "M", p->x, p->y);
        begun = true;
    }
    if (begun)
        fputs("\"/></g>\n", plot->out);
}

static void series(const struct plot *plot)
{
    for (size_t i = 0; i < plot->count; i++) {
        const char *method = plot->points[i].trial->method;
        bool first = plot->points[i].trial->series;
        for (size_t j = 0; j < i && first; j++)
            first = !plot->points[j].trial->series ||
                    strcmp(plot->points[j].trial->method, method) != 0;
        if (first)
            one_series(plot, method);
    }
}

static void marker(const struct plot *plot, const struct point *p)
{
    static const char *const shapes[COLORS] = {
        "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z", /* circle */
        "M-4.5-4.5h9v9h-9z",                     /* square */
        "M0-6L5.5 4H-5.5z",                      /* triangle */
        "M0-6.3L6.3 0L0 6.3L-6.3 0z",            /* diamond */
        "M0 6L5.5-4H-5.5z",                      /* triangle, down */
        "M-6-2H-2V-6H2V-2H6V2H2V6H-2V2H-6z",     /* cross */
        "M-6 0L-3-5.2H3L6 0L3 5.2H-3z",          /* hexagon */
        "M-4.6-4.6L4.6 4.6M-4.6 4.6L4.6-4.6",    /* x */
    };
    const bool full = strcmp(p->trial->preset, "paper") != 0;
    fprintf(plot->out, "<path class=\"m%s\" transform=\"translate(%.1f %.1f)\" d=\"%s\"><title>",
            full ? " full" : "", p->x, p->y, shapes[p->color]);
    report_trial_name(plot->out, p->trial);
    fputs(": ", plot->out);
    report_milliseconds(plot->out, p->trial->milliseconds);
    fprintf(plot->out, " ms, error %.3f</title></path>", p->trial->error);
}

static void labelled(const struct plot *plot, const struct point *p)
{
    const double x = fmin(fmax(p->x, p->label.x0), p->label.x1);
    const double y = fmin(fmax(p->y, p->label.y0), p->label.y1);
    fprintf(plot->out, "<g class=\"c%d\">", p->color);
    if (hypot(x - p->x, y - p->y) > 14)
        fprintf(plot->out, "<path class=\"leader\" d=\"M%.1f %.1fL%.1f %.1f\"/>", p->x, p->y, x, y);
    marker(plot, p);
    fprintf(plot->out, "<text class=\"label\" x=\"%.1f\" y=\"%.1f\">", p->label.x0,
            p->label.y1 - 3.2);
    report_trial_name(plot->out, p->trial);
    fputs("</text></g>\n", plot->out);
}

static void draw(struct plot *plot, const char *title)
{
    for (size_t i = 0; i < plot->count; i++)
        place_label(plot, i);
    fprintf(plot->out,
            "<figure class=\"plot\"><div class=\"scroll\" tabindex=\"0\" role=\"region\" "
            "aria-label=\"Plot\"><svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"",
            WIDTH, HEIGHT);
    report_text(plot->out, title);
    fputs("\">\n", plot->out);
    axes(plot);
    front(plot);
    series(plot);
    for (size_t i = 0; i < plot->count; i++)
        labelled(plot, &plot->points[i]);
    fputs("</svg></div>\n<figcaption>", plot->out);
    report_text(plot->out, title);
    fputs(
        ". Nearer to the lower left is better; the solid line is the Pareto front, and what lies "
        "in the shade is beaten in both. Hollow markers: the constants of the papers.</figcaption>"
        "</figure>\n",
        plot->out);
}

enum cranny_status report_plot(FILE *out, const struct cranny_report_trial *trials, size_t count,
                               const char *title, struct cranny_error *why)
{
    if (!count)
        return CRANNY_OK;
    struct plot plot = {.out = out,
                        .count = count,
                        .points = alloc_array(count, sizeof *plot.points),
                        .time = {.begin = LEFT, .end = WIDTH - RIGHT},
                        .error = {.begin = HEIGHT - BOTTOM, .end = TOP}};
    if (!plot.points)
        return fail_memory(why, "the report's plot");
    place_points(&plot, trials);
    draw(&plot, title);
    free(plot.points);
    return CRANNY_OK;
}
