/* Plateaus: slopes that few bits turned into stairs.
 *
 * On a stair neighbours are equal and then differ by one step, and no other value of the picture
 * lies within that step. Walls seen head-on have equal neighbours, too, but no stairs; edges
 * between two of them jump over other values or by more than a tenth. */
#include "screen/doctor.h"

#define STEP_LEAST 1e-4 /* of the depth: 24 bits stay below it where they do no harm */
#define STEP_MOST 0.1   /* of the depth: beyond, it is an edge */
#define STEPS_KEPT 65536
#define STEPS_MIN 30
#define STEPS_APART 24     /* different depths with a step: a few are edges between walls */
#define STAIRS_SHARE 0.015 /* of the slopes; whole buffers of 16 bits come to 0.04 and more */

static size_t lower_bound(const float *sorted, size_t count, float value)
{
    size_t low = 0;
    while (count > 0) {
        const size_t half = count / 2;
        if (sorted[low + half] < value) {
            low += half + 1;
            count -= half + 1;
        } else
            count = half;
    }
    return low;
}

/* Is no value seen strictly between the two? */
static bool adjacent(const struct depth_values *values, float a, float b)
{
    const float low = fminf(a, b), high = fmaxf(a, b);
    const size_t end = lower_bound(values->sorted, values->count, high);
    return end == 0 || values->sorted[end - 1] <= low;
}

enum triple_kind { TRIPLE_NONE, TRIPLE_STAIR, TRIPLE_SLOPE };

static enum triple_kind classify(const struct frame *frame, const struct depth_values *values,
                                 int x, int y, int dx, int dy, double *relative)
{
    const float a = frame->sign * frame_depth(frame, x - dx, y - dy);
    const float b = frame->sign * frame_depth(frame, x, y);
    const float c = frame->sign * frame_depth(frame, x + dx, y + dy);
    if (!(a > 0 && b > 0 && c > 0) || isinf(a) || isinf(b) || isinf(c))
        return TRIPLE_NONE;
    const double before = fabs((double)a - b) / b, after = fabs((double)c - b) / b;
    if (before > STEP_MOST || after > STEP_MOST || (a == b && b == c))
        return TRIPLE_NONE;
    *relative = fmax(before, after);
    if (a != b && b != c)
        return TRIPLE_SLOPE;
    if (*relative < STEP_LEAST)
        return TRIPLE_NONE;
    const float other = frame->sign * (a == b ? c : a);
    return adjacent(values, frame->sign * b, other) ? TRIPLE_STAIR : TRIPLE_NONE;
}

struct stair {
    float depth, size;
};

static int compare_depths(const void *a, const void *b)
{
    const struct stair *x = a, *y = b;
    return (x->depth > y->depth) - (x->depth < y->depth);
}

static int compare_sizes(const void *a, const void *b)
{
    const struct stair *x = a, *y = b;
    return (x->size > y->size) - (x->size < y->size);
}

static size_t depths_apart(struct stair *stairs, size_t count)
{
    size_t apart = count > 0;
    qsort(stairs, count, sizeof *stairs, compare_depths);
    for (size_t i = 1; i < count; i++)
        apart += stairs[i].depth != stairs[i - 1].depth;
    return apart;
}

void depth_steps_find(const struct frame *frame, const struct depth_values *values,
                      double *relative)
{
    struct stair *stairs = alloc_array(STEPS_KEPT, sizeof *stairs);
    size_t kept = 0, slopes = 0;
    *relative = 0;
    if (!stairs)
        return;
    const int width = frame->view.width, height = frame->view.height, step = 2 * frame->step;
    for (int y = 1; y < height - 1; y += step)
        for (int x = 1; x < width - 1; x += step)
            for (int k = 0; k < 2; k++) {
                double size = 0;
                const enum triple_kind kind = classify(frame, values, x, y, !k, k, &size);
                slopes += kind == TRIPLE_SLOPE;
                if (kind == TRIPLE_STAIR && kept < STEPS_KEPT)
                    stairs[kept++] = (struct stair){frame_depth(frame, x, y), (float)size};
            }
    if (kept >= STEPS_MIN && (double)kept > STAIRS_SHARE * (double)slopes &&
        depths_apart(stairs, kept) >= STEPS_APART) {
        qsort(stairs, kept, sizeof *stairs, compare_sizes);
        *relative = (double)stairs[kept / 2].size;
    }
    free(stairs);
}
