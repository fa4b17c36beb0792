#include "compare/model.h"

#include <math.h>
#include <string.h>

void model_line(double p, double over_p, double q, double over_q, double *slope, double *bend)
{
    *bend = 2 * (over_p / p - over_q / q) / (p - q);
    *slope = over_p / p - 0.5 * *bend * p;
}

/* Cholesky's factor of H + damping of the rows that are not held; false when that is not positive
 * definite. */
static bool factorise(const struct model *m, double damping)
{
    const size_t n = m->count;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = m->bend[i * n + j] + (i == j ? damping : 0);
            for (size_t k = 0; k < j; k++)
                sum -= m->factor[i * n + k] * m->factor[j * n + k];
            if (m->held[i] || m->held[j])
                sum = i == j;
            if (i == j && !(sum > 1e-3 * damping))
                return false;
            m->factor[i * n + j] = i == j ? sqrt(sum) : sum / m->factor[j * n + j];
        }
    }
    return true;
}

/* The rows that are not held: their step, given that of the others. */
static void solve(const struct model *m)
{
    const size_t n = m->count;
    for (size_t i = 0; i < n; i++) {
        double sum = -m->slope[i];
        if (m->held[i])
            continue;
        for (size_t j = 0; j < n; j++)
            sum -= m->held[j] ? m->bend[i * n + j] * m->step[j] : 0;
        for (size_t j = 0; j < i; j++)
            sum -= m->held[j] ? 0 : m->factor[i * n + j] * m->step[j];
        m->step[i] = sum / m->factor[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        if (m->held[i])
            continue;
        for (size_t j = i + 1; j < n; j++)
            m->step[i] -= m->held[j] ? 0 : m->factor[j * n + i] * m->step[j];
        m->step[i] /= m->factor[i * n + i];
    }
}

static double largest_bend(const struct model *m)
{
    double largest = 0;
    for (size_t i = 0; i < m->count * m->count; i++)
        largest = fmax(largest, fabs(m->bend[i]));
    return largest;
}

/* The row that leaves the box by most is held at it; false: none does. */
static bool hold_worst(const struct model *m, const double *low, const double *high)
{
    size_t worst = m->count;
    double most = 0;
    for (size_t i = 0; i < m->count; i++) {
        const double out = fmax(low[i] - m->step[i], m->step[i] - high[i]) / (high[i] - low[i]);
        if (!m->held[i] && !(out <= most)) {
            most = out;
            worst = i;
        }
    }
    if (worst == m->count)
        return false;
    m->held[worst] = true;
    m->step[worst] = m->step[worst] < low[worst] ? low[worst] : high[worst];
    return true;
}

void model_minimum(const struct model *m, const double *low, const double *high)
{
    const double largest = largest_bend(m);
    memset(m->held, 0, m->count * sizeof *m->held);
    memset(m->step, 0, m->count * sizeof *m->step);
    if (!isfinite(largest) || largest == 0)
        return;
    for (size_t i = 0; i < m->count; i++)
        m->held[i] = !(high[i] > low[i]);
    do {
        double damping = 1e-6 * largest;
        while (!factorise(m, damping) && damping < 1e6 * largest)
            damping *= 4;
        solve(m);
    } while (hold_worst(m, low, high));
}
