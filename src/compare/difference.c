/* Based on: Morgan McGuire, Ambient Occlusion Volumes, 2009, section 7 (eq. 31 and 32). */
#include "base/base.h"

#include <cranny/compare.h>

struct picture {
    int width, height;
    const float *pixels;
    size_t stride;
};

struct pair {
    struct picture test, reference;
};

static float value_at(const struct picture *picture, int x, int y)
{
    const float *row = (const float *)((const char *)picture->pixels + (size_t)y * picture->stride);
    return row[x] > 0 ? (row[x] < 1 ? row[x] : 1) : 0;
}

static enum cranny_status check_picture(const char *what, struct picture *picture,
                                        struct cranny_error *why)
{
    if (picture->width < 1 || picture->height < 1)
        return fail(why, CRANNY_USAGE, "%s: %d x %d pixels cannot be compared", what,
                    picture->width, picture->height);
    if (!picture->pixels)
        return fail(why, CRANNY_USAGE, "%s: the pixels are NULL", what);
    const size_t tight = (size_t)picture->width * sizeof(float);
    if (!picture->stride)
        picture->stride = tight;
    if (picture->stride < tight || picture->stride % sizeof(float))
        return fail(why, CRANNY_USAGE,
                    "%s: a stride of %zu bytes; it must be a multiple of 4, %zu or more", what,
                    picture->stride, tight);
    return CRANNY_OK;
}

static enum cranny_status check_pair(struct pair *pair, struct cranny_error *why)
{
    enum cranny_status status = check_picture("test", &pair->test, why);
    return status == CRANNY_OK ? check_picture("reference", &pair->reference, why) : status;
}

/* log† of every 8-bit value and every difference of two (eq. 32). */
struct log_table {
    double values[511];
};

static struct log_table log_table_make(void)
{
    struct log_table table;
    for (int i = -255; i <= 255; i++)
        table.values[i + 255] = copysign(log(fabs((double)i) + 1), i);
    return table;
}

/* log†(a) − log†(b), squared. */
static double square_of_logs(const struct log_table *table, int a, int b)
{
    const double d = table->values[a + 255] - table->values[b + 255];
    return d * d;
}

/* T and R of eq. 31: accessibility in 8 bits, rounded as cranny_image_write does. */
static void quantise_row(const struct picture *picture, int y, int *row)
{
    for (int x = 0; x < picture->width; x++)
        row[x] = (int)((double)value_at(picture, x, y) * 255 + 0.5);
}

/* The sums behind the three means of eq. 31. */
struct log_sums {
    double value, dx, dy;
};

/* `rows`: this row and the one below of T, then of R; the last row has none below. */
static void add_row(const struct log_table *table, int width, const int *rows[4], bool last,
                    struct log_sums *sums)
{
    const int *t = rows[0], *t_below = rows[1], *r = rows[2], *r_below = rows[3];
    struct log_sums row = {0};
    for (int x = 0; x < width; x++)
        row.value += square_of_logs(table, t[x], r[x]);
    for (int x = 0; x + 1 < width; x++)
        row.dx += square_of_logs(table, t[x + 1] - t[x], r[x + 1] - r[x]);
    for (int x = 0; x < width && !last; x++)
        row.dy += square_of_logs(table, t_below[x] - t[x], r_below[x] - r[x]);
    sums->value += row.value;
    sums->dx += row.dx;
    sums->dy += row.dy;
}

static double mean_of(double sum, int width, int height)
{
    return width > 0 && height > 0 ? sum / ((double)width * height) : 0;
}

/* Eq. 31. Gradients are forward differences; the last column and row have none and are left out
 * of those means. */
static double log_error(const struct pair *pair, int *rows)
{
    const int width = pair->test.width, height = pair->test.height;
    const struct log_table table = log_table_make();
    int *t = rows, *t_below = t + width, *r = t_below + width, *r_below = r + width;
    struct log_sums sums = {0};
    quantise_row(&pair->test, 0, t_below);
    quantise_row(&pair->reference, 0, r_below);
    for (int y = 0; y < height; y++) {
        const bool last = y + 1 == height;
        int *swap = t;
        t = t_below;
        t_below = swap;
        swap = r;
        r = r_below;
        r_below = swap;
        if (!last) {
            quantise_row(&pair->test, y + 1, t_below);
            quantise_row(&pair->reference, y + 1, r_below);
        }
        add_row(&table, width, (const int *[4]){t, t_below, r, r_below}, last, &sums);
    }
    return mean_of(sums.value, width, height) +
           0.5 * (mean_of(sums.dx, width - 1, height) + mean_of(sums.dy, width, height - 1));
}

static void measure_values(const struct pair *pair, struct cranny_difference *difference)
{
    const int width = pair->test.width, height = pair->test.height;
    double squares = 0, sum = 0;
    for (int y = 0; y < height; y++) {
        double row_squares = 0, row_sum = 0;
        for (int x = 0; x < width; x++) {
            const double d =
                (double)value_at(&pair->test, x, y) - (double)value_at(&pair->reference, x, y);
            row_squares += d * d;
            row_sum += d;
            difference->max_abs = fmax(difference->max_abs, fabs(d));
        }
        squares += row_squares;
        sum += row_sum;
    }
    difference->rmse = sqrt(mean_of(squares, width, height));
    difference->mean = mean_of(sum, width, height);
    difference->psnr = difference->rmse > 0 ? -20 * log10(difference->rmse) : INFINITY;
}

enum cranny_status cranny_difference_measure(int width, int height, const float *test,
                                             size_t test_stride, const float *reference,
                                             size_t reference_stride,
                                             struct cranny_difference *difference,
                                             struct cranny_error *why)
{
    struct pair pair = {{width, height, test, test_stride},
                        {width, height, reference, reference_stride}};
    *difference = (struct cranny_difference){0};
    enum cranny_status status = check_pair(&pair, why);
    if (status != CRANNY_OK)
        return status;
    int *rows = alloc_array((size_t)width * 4, sizeof *rows);
    if (!rows)
        return fail_memory(why, "comparison");
    difference->error = log_error(&pair, rows);
    measure_values(&pair, difference);
    free(rows);
    return CRANNY_OK;
}

enum cranny_status cranny_difference_map(int width, int height, const float *test,
                                         size_t test_stride, const float *reference,
                                         size_t reference_stride, float full_scale, uint8_t *rgb,
                                         struct cranny_error *why)
{
    struct pair pair = {{width, height, test, test_stride},
                        {width, height, reference, reference_stride}};
    enum cranny_status status = check_pair(&pair, why);
    if (status != CRANNY_OK)
        return status;
    if (!(full_scale > 0) || !rgb)
        return fail(why, CRANNY_USAGE, "error map: %s",
                    rgb ? "the scale must be above 0" : "the output is NULL");
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++, rgb += 3) {
            const float d = value_at(&pair.test, x, y) - value_at(&pair.reference, x, y);
            const float share = clamp_float(fabsf(d) / full_scale, 0, 1);
            const uint8_t rest = (uint8_t)lrintf((1 - share) * 255);
            rgb[0] = d < 0 ? rest : 255;
            rgb[1] = rest;
            rgb[2] = d > 0 ? rest : 255;
        }
    return CRANNY_OK;
}
