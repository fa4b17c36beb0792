/* The doctor of G-buffers: what in a frame spoils occlusion, and which parameters fit its scale. */
#include "screen/doctor.h"

#include <stdarg.h>

void depth_found(struct depth_findings *findings, enum cranny_depth_severity severity,
                 const char *code, const char *format, ...)
{
    if (findings->count == COUNT_OF(findings->items))
        return;
    struct depth_finding *finding = &findings->items[findings->count++];
    finding->severity = severity;
    finding->code = code;
    va_list args;
    va_start(args, format);
    vsnprintf(finding->text, sizeof finding->text, format, args);
    va_end(args);
    one_line(finding->text);
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static bool all_multiples(const struct depth_values *values, double levels)
{
    for (size_t i = 0; i < values->count; i++) {
        const double scaled = (double)values->sorted[i] * levels;
        if (fabs(scaled - nearbyint(scaled)) > 0.01)
            return false;
    }
    return values->count > 0;
}

static bool all_halves(const struct depth_values *values)
{
    for (size_t i = 0; i < values->count; i++) {
        uint32_t bits;
        memcpy(&bits, &values->sorted[i], sizeof bits);
        if (bits & 0x1fff)
            return false;
    }
    return values->count > 0;
}

static void count_value(struct depth_values *values, float v)
{
    values->total++;
    values->nan += isnan(v) != 0;
    values->endless += isinf(v) && v > 0;
    values->negative += v < 0;
    values->zero += v == 0;
    values->one += v == 1;
    values->minus_one += v == -1;
    if (isfinite(v))
        values->sorted[values->count++] = v;
}

/* Near things lie low in most pictures: the halves' means tell which end of the range is near. */
static void measure_halves(const struct frame *frame, struct depth_values *values)
{
    double sums[2] = {0}, counts[2] = {0};
    for (int y = 0; y < frame->view.height; y += frame->step)
        for (int x = 0; x < frame->view.width; x += frame->step) {
            const float v = frame_depth(frame, x, y);
            const int half = 2 * y >= frame->view.height;
            if (isfinite(v)) {
                sums[half] += v;
                counts[half]++;
            }
        }
    values->top_mean = counts[0] > 0 ? sums[0] / counts[0] : 0;
    values->bottom_mean = counts[1] > 0 ? sums[1] / counts[1] : 0;
}

enum cranny_status depth_values_gather(const struct frame *frame, struct depth_values *values,
                                       struct cranny_error *why)
{
    *values = (struct depth_values){0};
    const int step = frame->step;
    const size_t columns = (size_t)((frame->view.width + step - 1) / step);
    const size_t rows = (size_t)((frame->view.height + step - 1) / step);
    values->sorted = alloc_array(columns * rows, sizeof *values->sorted);
    if (!values->sorted)
        return fail_memory(why, "the depth values");
    for (int y = 0; y < frame->view.height; y += step)
        for (int x = 0; x < frame->view.width; x += step)
            count_value(values, frame_depth(frame, x, y));
    qsort(values->sorted, values->count, sizeof *values->sorted, compare_floats);
    for (size_t i = 0; i < values->count; i++)
        values->distinct += i == 0 || values->sorted[i] != values->sorted[i - 1];
    if (values->count) {
        values->low = values->sorted[0];
        values->high = values->sorted[values->count - 1];
    }
    values->half = all_halves(values);
    values->quantum = all_multiples(values, 1)       ? 1
                      : all_multiples(values, 255)   ? 1.0 / 255
                      : all_multiples(values, 65535) ? 1.0 / 65535
                                                     : 0;
    measure_halves(frame, values);
    return CRANNY_OK;
}

float depth_quantile(const struct frame *frame, const struct depth_values *values, double q)
{
    const float *sorted = values->sorted;
    size_t first = 0, end = values->count;
    if (frame->sign > 0)
        while (first < end && !(sorted[first] > 0))
            first++;
    else
        while (end > first && !(sorted[end - 1] < 0))
            end--;
    if (first == end)
        return 0;
    const double place = (frame->sign > 0 ? q : 1 - q) * (double)(end - first - 1);
    return frame->sign * sorted[first + (size_t)(place + 0.5)];
}

/* How far depth strays from a straight line between neighbours, over the depth: the median of its
 * second differences, on surfaces. */
static double measure_noise(const struct frame *frame)
{
    size_t bins[96] = {0}, count = 0, below = 0;
    for (int y = 0; y < frame->view.height; y += 2 * frame->step)
        for (int x = 1; x < frame->view.width - 1; x += 2 * frame->step) {
            const double a = frame->sign * frame_depth(frame, x - 1, y);
            const double b = frame->sign * frame_depth(frame, x, y);
            const double c = frame->sign * frame_depth(frame, x + 1, y);
            const double stray = fabs(0.5 * (a + c) / b - 1);
            if (!(a > 0 && b > 0 && c > 0) || !(stray < 0.1))
                continue;
            bins[stray > 0 ? max_int(0, min_int(95, 96 + (int)floor(4 * log2(stray)))) : 0]++;
            count++;
        }
    for (int i = 0; i < 96; i++)
        if ((below += bins[i]) * 2 > count)
            return exp2((i + 1 - 96) / 4.0);
    return 0;
}

static void advise(const struct frame *frame, const struct depth_values *values, double step,
                   struct cranny_depth_advice *advice)
{
    const struct cranny_projection *p = &frame->projection;
    const float extent = p->top - p->bottom;
    const bool parallel = p->kind == CRANNY_ORTHOGRAPHIC;
    advice->depth_near = depth_quantile(frame, values, 0.01);
    advice->depth_median = depth_quantile(frame, values, 0.5);
    advice->depth_far = depth_quantile(frame, values, 0.99);
    advice->radius_world = 0.1f * extent * (parallel ? 1 : advice->depth_median);
    const double noise = fmax(fmax(step, measure_noise(frame)), 0x1p-20);
    advice->bias = (float)(2 * noise * advice->depth_median);
    /* a radius covers as many pixels at any depth of a parallel projection */
    const float pixel = extent / (float)frame->view.height;
    advice->fade_begin = parallel ? INFINITY : advice->radius_world / (4 * pixel);
    advice->fade_end = parallel ? INFINITY : advice->radius_world / pixel;
}

/* Worst first; equal ones stay in the order in which they were found. */
static void report_all(const struct depth_findings *findings, cranny_depth_finding_fn *report,
                       void *user)
{
    for (int severity = CRANNY_DEPTH_ERROR; severity <= CRANNY_DEPTH_NOTE; severity++)
        for (size_t i = 0; i < findings->count; i++)
            if ((int)findings->items[i].severity == severity)
                report(user, findings->items[i].severity, findings->items[i].code,
                       findings->items[i].text);
}

static bool no_projection(const struct cranny_projection *p)
{
    return p->kind == CRANNY_PERSPECTIVE && p->left == 0 && p->right == 0 && p->bottom == 0 &&
           p->top == 0;
}

static struct frame frame_of(const struct cranny_gbuffer *g)
{
    struct frame frame = {.gbuffer = g, .projection = g->projection, .view = g->viewport};
    frame.sign = 1;
    if (!frame.view.width)
        frame.view = (struct cranny_rect){0, 0, g->width, g->height};
    frame.depth_stride = g->depth_stride ? g->depth_stride : (size_t)g->width * sizeof(float);
    frame.normal_stride = g->normal_stride
                              ? g->normal_stride
                              : (size_t)g->width * cranny_normal_bytes(g->normal_format);
    frame.step =
        max_int(1, (int)ceil(sqrt((double)frame.view.width * frame.view.height / DOCTOR_PIXELS)));
    return frame;
}

static enum cranny_status find_all(struct frame *frame, struct depth_findings *findings,
                                   struct cranny_depth_advice *advice, struct cranny_error *why)
{
    struct depth_values values;
    bool usable = false;
    double step = 0;
    enum cranny_status status = depth_values_gather(frame, &values, why);
    if (status == CRANNY_OK)
        status = depth_check(frame, &values, findings, &step, &usable, why);
    if (status == CRANNY_OK && frame->gbuffer->normal)
        status = normal_check(frame, usable,
                              frame->projection.kind == CRANNY_ORTHOGRAPHIC
                                  ? step * (double)depth_quantile(frame, &values, 0.5)
                                  : step,
                              findings, why);
    if (status == CRANNY_OK && usable && advice)
        advise(frame, &values, step, advice);
    free(values.sorted);
    return status;
}

enum cranny_status cranny_gbuffer_check(const struct cranny_gbuffer *gbuffer,
                                        cranny_depth_finding_fn *report, void *user,
                                        struct cranny_depth_advice *advice,
                                        struct cranny_error *why)
{
    struct cranny_gbuffer g = *gbuffer;
    if (advice)
        *advice = (struct cranny_depth_advice){0};
    const bool assumed = no_projection(&g.projection);
    if (assumed)
        g.projection =
            cranny_perspective(1, 1); /* stands in until the sizes are known to be good */
    enum cranny_status status = cranny_gbuffer_validate(&g, why);
    if (status != CRANNY_OK)
        return status;
    struct frame frame = frame_of(&g);
    if (assumed)
        frame.projection =
            cranny_perspective(1.04719755f, (float)frame.view.width / (float)frame.view.height);
    struct depth_findings findings = {0};
    status = find_all(&frame, &findings, advice, why);
    if (status != CRANNY_OK)
        return status;
    if (assumed)
        depth_found(&findings, CRANNY_DEPTH_NOTE, "projection-assumed",
                    "no projection was given, so 60 degrees from bottom to top are assumed; "
                    "distances and normals are only as good as that");
    if (report)
        report_all(&findings, report, user);
    return CRANNY_OK;
}
