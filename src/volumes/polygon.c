/* The occlusion of a point by one polygon, in double, in the paper's two forms: what the kernels
 * are tested against.
 *
 * Based on: McGuire, Ambient Occlusion Volumes, 2009, §4. */
#include "base/vector.h"

#include <cranny/volumes.h>
#include <string.h>

#define CORNERS_MAX 8
#define PI 3.14159265358979323846

struct polygon {
    double corners[2 * CORNERS_MAX][3]; /* clipping adds at most one an edge */
    int count;
};

/* Relative to the point, in units of the farthest corner, so that no square over- or underflows. */
static bool move_polygon(const double (*corners)[3], int count, const double point[3],
                         struct polygon *polygon)
{
    double largest = 0;
    polygon->count = count;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            const double x = corners[i][k] / 2 - point[k] / 2;
            polygon->corners[i][k] = x;
            largest = fmax(largest, fabs(x));
        }
    if (!(largest > 0) || !isfinite(largest))
        return false;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            polygon->corners[i][k] /= largest;
    return true;
}

/* The part above the tangent plane (§5, step iv.a). */
static void clip_polygon(const struct polygon *in, const double normal[3], struct polygon *out)
{
    out->count = 0;
    for (int i = 0; i < in->count; i++) {
        const double *a = in->corners[i], *b = in->corners[(i + 1) % in->count];
        const double ha = dot3(a, normal), hb = dot3(b, normal);
        if (ha >= 0)
            memcpy(out->corners[out->count++], a, sizeof out->corners[0]);
        if ((ha < 0) == (hb < 0))
            continue;
        const double t = ha / (ha - hb);
        for (int k = 0; k < 3; k++)
            out->corners[out->count][k] = a[k] + t * (b[k] - a[k]);
        out->count++;
    }
}

/* One summand of eq. 9, with the angle from sine and cosine: an arc cosine alone loses the small
 * ones. Corners at the point itself span no arc. */
static double arc_angle(const double a[3], const double b[3], const double normal[3])
{
    double c[3];
    cross3(a, b, c);
    const double sine = sqrt(dot3(c, c));
    return sine > 0 ? atan2(sine, dot3(a, b)) * dot3(normal, c) / sine : 0;
}

/* Twice eq. 16 by way of eq. 19: the angle by the law of cosines, with the half-angle's sine in
 * place of cos⁻¹(1 − ½d²), which is the same and keeps small angles. */
static double arc_segment(const double a[3], const double b[3], const double normal[3])
{
    double u[3], v[3], m[3], chord = 0;
    memcpy(u, a, sizeof u);
    memcpy(v, b, sizeof v);
    if (!normalise3(u) || !normalise3(v))
        return 0;
    for (int k = 0; k < 3; k++)
        chord += (u[k] - v[k]) * (u[k] - v[k]);
    cross3(u, v, m);
    if (!normalise3(m))
        return 0;
    return 2 * asin(fmin(sqrt(chord) / 2, 1)) * dot3(normal, m);
}

double cranny_polygon_occlusion(const double (*corners)[3], int count, const double point[3],
                                const double normal[3], enum cranny_polygon_form form)
{
    struct polygon whole, above;
    if (count < 3 || count > CORNERS_MAX || !move_polygon(corners, count, point, &whole))
        return 0;
    clip_polygon(&whole, normal, &above);
    double sum = 0;
    for (int i = 0; i < above.count; i++) {
        const double *a = above.corners[i], *b = above.corners[(i + 1) % above.count];
        sum += form == CRANNY_FORM_ANGLES ? arc_angle(a, b, normal) : arc_segment(a, b, normal);
    }
    return fmin(fabs(sum) / (2 * PI), 1);
}
