/* Which reading of a depth buffer makes planes plane.
 *
 * Along any line of the picture the reciprocal depth of a plane is an affine function (parallel
 * projection: the depth itself). So take triples of equally spaced pixels and see which reading of
 * the stored values has no second difference there. Edges and curved surfaces favour none; planes
 * favour one. Triples in which the readings cannot be told apart, given the values' precision, have
 * no vote. */
#include "screen/doctor.h"

#define TRIPLES_MAX 60000
#define TOLERANCE 0.1 /* of what linear and device depth differ by */
#define VOTES_MIN 60
#define SHARE_MIN 0.08    /* of the triples: curved surfaces alone come to 0.02 */
#define SHARE_FITTED 0.15 /* for a reading with a parameter to fit */

struct triple {
    double a, b, c;
    double tolerance; /* of the second difference over the first one */
};

/* A reading and its one parameter. */
struct reading {
    enum depth_reading kind;
    double shape;
};

/* −1 … 1: straight at 0. */
static double bend(double a, double b, double c)
{
    const double span = c - a;
    return span != 0 ? (a - 2 * b + c) / span : INFINITY;
}

/* Reciprocals of one sign only: across zero there is no surface. */
static double bend_reciprocal(double a, double b, double c)
{
    if (!(a * b > 0) || !(b * c > 0))
        return INFINITY;
    return bend(1 / a, 1 / b, 1 / c);
}

static double bend_of(const struct reading *r, bool parallel, bool signed_range,
                      const struct triple *t)
{
    double v[3] = {t->a, t->b, t->c};
    switch (r->kind) {
    case READING_UNKNOWN:
        return INFINITY;
    case READING_LINEAR:
        return parallel ? bend(v[0], v[1], v[2]) : bend_reciprocal(v[0], v[1], v[2]);
    case READING_DEVICE:
        return bend(v[0], v[1], v[2]);
    case READING_OTHER_PROJECTION:
        return parallel ? bend_reciprocal(v[0], v[1], v[2]) : bend(v[0], v[1], v[2]);
    case READING_NORMALIZED:
        return bend_reciprocal(v[0] + r->shape, v[1] + r->shape, v[2] + r->shape);
    case READING_LOGARITHMIC:
    case READING_LOGARITHMIC_REVERSED:
        break;
    }
    for (int k = 0; k < 3; k++) {
        const double u = signed_range ? 0.5 * (v[k] + 1) : v[k];
        v[k] = expm1(r->shape * (r->kind == READING_LOGARITHMIC ? u : 1 - u));
    }
    return parallel ? bend(v[0], v[1], v[2]) : bend_reciprocal(v[0], v[1], v[2]);
}

static double precision(const struct depth_values *values, double v)
{
    const double relative = values->half ? 0x1p-12 : 0x1p-24;
    return fmax(0.5 * values->quantum, relative * fabs(v));
}

/* Sky as buffers hold it: exactly at the range's ends. */
static bool is_surface(const struct depth_values *values, double v)
{
    if (!isfinite(v) || v == 0)
        return false;
    return !(values->low >= -1 && values->high <= 1 && fabs(v) == 1);
}

static bool make_triple(const struct depth_values *values, double a, double b, double c,
                        struct triple *t)
{
    if (!is_surface(values, a) || !is_surface(values, b) || !is_surface(values, c) || a == c)
        return false;
    const double straight = bend(a, b, c), reciprocal = bend_reciprocal(a, b, c);
    if (fabs(straight) > 0.9)
        return false; /* a jump at one side only */
    const double apart = isfinite(reciprocal) ? fabs(straight - reciprocal) : 1;
    const double noise = 4 * precision(values, b) / fabs(c - a);
    *t = (struct triple){a, b, c, TOLERANCE * apart};
    return noise < t->tolerance;
}

static size_t gather(const struct frame *frame, const struct depth_values *values,
                     struct triple *triples)
{
    const int width = frame->view.width, height = frame->view.height;
    const int side = max_int(width, height);
    const int step = max_int(1, (int)ceil(sqrt((double)width * height / (TRIPLES_MAX / 6))));
    size_t count = 0;
    for (int y = 0; y < height; y += step)
        for (int x = 0; x < width; x += step)
            for (int k = 0; k < 6; k++) {
                const int reach = max_int(1 + k / 2, side / (k < 2 ? 64 : k < 4 ? 24 : 10));
                const int dx = k % 2 ? 0 : reach, dy = k % 2 ? reach : 0;
                if (x < dx || y < dy || x + dx >= width || y + dy >= height)
                    continue;
                if (count < TRIPLES_MAX &&
                    make_triple(values, frame_depth(frame, x - dx, y - dy),
                                frame_depth(frame, x, y), frame_depth(frame, x + dx, y + dy),
                                &triples[count]))
                    count++;
            }
    return count;
}

static size_t votes(const struct triple *triples, size_t count, size_t stride,
                    const struct reading *r, bool parallel, bool signed_range)
{
    size_t sum = 0;
    for (size_t i = 0; i < count; i += stride)
        sum += fabs(bend_of(r, parallel, signed_range, &triples[i])) < triples[i].tolerance;
    return sum;
}

/* The best of a family over `steps` values of its parameter, each `factor` times the last. */
static struct reading fit(const struct triple *triples, size_t count, struct reading first,
                          double factor, int steps, bool parallel, bool signed_range)
{
    const size_t stride = 1 + count / 8000;
    size_t most = 0;
    struct reading best = first;
    for (int i = 0; i < steps; i++, first.shape *= factor) {
        const size_t sum = votes(triples, count, stride, &first, parallel, signed_range);
        if (sum > most) {
            most = sum;
            best = first;
        }
    }
    return best;
}

/* Readings with a parameter contain the ones without as limits, so they must be clearly better. */
static void decide(const struct triple *triples, size_t count, bool unit, bool parallel,
                   bool signed_range, struct reading *verdict)
{
    struct reading readings[5] = {{READING_LINEAR, 0}};
    int kinds = 1;
    readings[kinds++] =
        (struct reading){unit && !parallel ? READING_DEVICE : READING_OTHER_PROJECTION, 0};
    if (unit) {
        readings[kinds++] = fit(triples, count, (struct reading){READING_LOGARITHMIC, 1.0}, 1.05,
                                76, parallel, signed_range);
        readings[kinds++] = fit(triples, count, (struct reading){READING_LOGARITHMIC_REVERSED, 1.0},
                                1.05, 76, parallel, signed_range);
    }
    if (unit && !parallel)
        readings[kinds++] = fit(triples, count, (struct reading){READING_NORMALIZED, 0.005}, 1.15,
                                38, parallel, signed_range);
    size_t sums[5], most = 0, second = 0;
    int best = 0;
    for (int i = 0; i < kinds; i++) {
        sums[i] = votes(triples, count, 1, &readings[i], parallel, signed_range);
        if (i < 2 ? sums[i] > most : (double)sums[i] > 1.3 * (double)most + VOTES_MIN) {
            most = sums[i];
            best = i;
        }
    }
    for (int i = 0; i < 2; i++)
        if (i != best && sums[i] > second)
            second = sums[i];
    const bool ahead = best >= 2 || most > 2 * second;
    const double share = best >= 2 ? SHARE_FITTED : SHARE_MIN;
    const bool clear = most >= VOTES_MIN && (double)most >= share * (double)count && ahead;
    *verdict = clear ? readings[best] : (struct reading){READING_UNKNOWN, 0};
}

enum cranny_status depth_reading_find(const struct frame *frame, const struct depth_values *values,
                                      enum depth_reading *reading, double *shape,
                                      struct cranny_error *why)
{
    struct triple *triples = alloc_array(TRIPLES_MAX, sizeof *triples);
    if (!triples)
        return fail_memory(why, "the depth's triples");
    const size_t count = gather(frame, values, triples);
    struct reading verdict;
    decide(triples, count, values->low >= -1 && values->high <= 1,
           frame->projection.kind == CRANNY_ORTHOGRAPHIC, values->low < 0, &verdict);
    free(triples);
    *reading = verdict.kind;
    *shape = verdict.shape;
    return CRANNY_OK;
}
