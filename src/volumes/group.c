/* A k-d tree's order by selection: split at the middle of the widest axis, whole tiles first, then
 * whole blocks. */
#include "volumes/group.h"

#define TASK_LEAST 2048 /* points worth a task */

static int widest_axis(const struct group_point *points, int count)
{
    float low[GROUP_AXES], high[GROUP_AXES];
    int widest = 0;
    memcpy(low, points[0].at, sizeof low);
    memcpy(high, points[0].at, sizeof high);
    for (int i = 1; i < count; i++)
        for (int k = 0; k < GROUP_AXES; k++) {
            const float x = points[i].at[k];
            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
        }
    for (int k = 1; k < GROUP_AXES; k++)
        if (high[k] - low[k] > high[widest] - low[widest])
            widest = k;
    return widest;
}

static void swap_points(struct group_point *a, struct group_point *b)
{
    const struct group_point kept = *a;
    *a = *b;
    *b = kept;
}

static float median(float a, float b, float c)
{
    const float low = a < b ? a : b, high = a < b ? b : a;
    return c < low ? low : c > high ? high : c;
}

/* Hoare's selection: afterwards none of the first `middle` points is above any of the others. */
static void select_points(struct group_point *points, int count, int middle, int axis)
{
    int first = 0, last = count - 1;
    while (first < last) {
        const float pivot =
            median(points[first].at[axis], points[first + (last - first) / 2].at[axis],
                   points[last].at[axis]);
        int i = first, j = last;
        while (i <= j) {
            while (points[i].at[axis] < pivot)
                i++;
            while (pivot < points[j].at[axis])
                j--;
            if (i <= j)
                swap_points(&points[i++], &points[j--]);
        }
        if (middle <= j)
            last = j;
        else if (middle >= i)
            first = i;
        else
            return;
    }
}

static void sort(struct group_point *points, int count)
{
    if (count <= BLOCK)
        return;
    const int unit = count > TILE ? TILE : BLOCK, half = (count / 2 + unit - 1) / unit * unit;
    select_points(points, count, half, widest_axis(points, count));
#pragma omp task if (count >= TASK_LEAST)
    sort(points, half);
    sort(points + half, count - half);
}

void group_points(struct group_point *points, int count, int threads)
{
#pragma omp parallel num_threads(threads)
#pragma omp single
    sort(points, count);
}
