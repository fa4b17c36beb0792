/* The doctor on normals: compare them with what depth says, and look for the change of sign, axes
 * or space that brings the two together.
 *
 * The rotation that fits best is Horn's (Closed-form solution of absolute orientation using unit
 * quaternions, 1987, §4), reweighted a few times so that edges do not count. */
#include "screen/doctor.h"

#define PAIRS_MAX 40000
#define PAIRS_MIN 64
#define CELLS 5        /* a side of the cube of directions */
#define COS_CLOSE 0.97 /* a normal that agrees: within 14 degrees */
#define COS_ROUGH 0.85 /* one that is smoothed or bent by a normal map: 32 degrees */

/* A stored normal and the one that depth has there. */
struct pair {
    double stored[3], seen[3], toward[3]; /* `toward`: unit, from the surface to the camera */
    double weight;
};

struct pairs {
    struct pair *items;
    size_t count;
};

/* How the stored numbers are to be read. */
enum mend { MEND_NONE, MEND_DOUBLE, MEND_SNORM, MEND_UNORM };

static const void *stored_at(const struct frame *frame, int x, int y)
{
    return (const char *)frame->gbuffer->normal +
           (size_t)(frame->view.y + y) * frame->normal_stride +
           (size_t)(frame->view.x + x) * cranny_normal_bytes(frame->gbuffer->normal_format);
}

static void read_normal(const struct frame *frame, enum mend mend, int x, int y, double n[3])
{
    enum cranny_normal_format format = frame->gbuffer->normal_format;
    float stored[3];
    if (mend == MEND_SNORM || mend == MEND_UNORM)
        format = mend == MEND_SNORM ? CRANNY_NORMAL_SNORM8 : CRANNY_NORMAL_UNORM8;
    cranny_normal_decode(format, stored_at(frame, x, y), stored);
    for (int k = 0; k < 3; k++)
        n[k] = mend == MEND_DOUBLE ? 2 * (double)stored[k] - 1 : (double)stored[k];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool unit_length(double v[3])
{
    const double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
    return length > 1e-6 && isfinite(length);
}

/* A surface is seen here; what its depth means may be unknown. */
static bool is_surface(const struct frame *frame, int x, int y)
{
    const float v = frame->sign * frame_depth(frame, x, y);
    return isfinite(v) && v != 0 && v != 1 && v != -1;
}

struct normal_counts {
    size_t seen, nan, zero, unit, unit_mended, different;
    double length_sum;
};

static bool about_unit(const double n[3])
{
    return fabs(sqrt(dot(n, n)) - 1) < 0.03;
}

static void count_normal(const double n[3], const double mended[3], double first[3],
                         struct normal_counts *counts)
{
    counts->seen++;
    if (!isfinite(n[0] + n[1] + n[2])) {
        counts->nan++;
        return;
    }
    if (dot(n, n) == 0) {
        counts->zero++;
        return;
    }
    if (dot(first, first) == 0)
        memcpy(first, n, 3 * sizeof *first);
    counts->length_sum += sqrt(dot(n, n));
    counts->unit += about_unit(n);
    counts->unit_mended += about_unit(mended);
    for (int k = 0; k < 3; k++)
        if (fabs(n[k] - first[k]) > 0.02) {
            counts->different++;
            break;
        }
}

static enum mend possible_mend(const struct frame *frame)
{
    switch (frame->gbuffer->normal_format) {
    case CRANNY_NORMAL_FLOAT3:
    case CRANNY_NORMAL_FLOAT4:
        return MEND_DOUBLE;
    case CRANNY_NORMAL_SNORM8:
        return MEND_UNORM;
    case CRANNY_NORMAL_UNORM8:
        return MEND_SNORM;
    case CRANNY_NORMAL_OCT16:
    case CRANNY_NORMAL_OCT8:
        break;
    }
    return MEND_NONE;
}

static void count_all(const struct frame *frame, enum mend mend, struct normal_counts *counts)
{
    double first[3] = {0};
    *counts = (struct normal_counts){0};
    for (int y = 0; y < frame->view.height; y += frame->step)
        for (int x = 0; x < frame->view.width; x += frame->step)
            if (is_surface(frame, x, y)) {
                double n[3], mended[3];
                read_normal(frame, MEND_NONE, x, y, n);
                read_normal(frame, mend, x, y, mended);
                count_normal(n, mended, first, counts);
            }
}

static const char *const mend_words[] = {
    [MEND_NONE] = "",
    [MEND_DOUBLE] = "they run 0 ... 1 as pictures hold them: store 2 c - 1",
    [MEND_SNORM] = "the bytes are signed: pass CRANNY_NORMAL_SNORM8",
    [MEND_UNORM] = "the bytes are unsigned: pass CRANNY_NORMAL_UNORM8",
};

/* Lengths alone; answers how to read the normals from here on. */
static enum mend check_lengths(const struct normal_counts *counts, enum mend mend,
                               struct depth_findings *findings)
{
    const size_t good = counts->seen - counts->nan - counts->zero;
    const double all = (double)counts->seen;
    if (counts->nan)
        depth_found(findings,
                    2 * counts->nan > counts->seen ? CRANNY_DEPTH_ERROR : CRANNY_DEPTH_WARNING,
                    "normal-nan",
                    "%zu normals (%.3g %%) on surfaces are NaN or infinite; they are reconstructed "
                    "from depth",
                    counts->nan, 100 * (double)counts->nan / all);
    if (2 * counts->zero > counts->seen)
        depth_found(findings, CRANNY_DEPTH_WARNING, "normal-empty",
                    "%.3g %% of the normals on surfaces are zero; they are reconstructed from "
                    "depth: pass NULL if there are none",
                    100 * (double)counts->zero / all);
    if (!good)
        return MEND_NONE;
    if (2 * counts->unit < good && 10 * counts->unit_mended > 8 * good) {
        depth_found(findings, CRANNY_DEPTH_ERROR, "normal-range",
                    "the normals are not unit, but nearly all are once their range is undone; %s",
                    mend_words[mend]);
        return mend;
    }
    if (50 * (good - counts->unit) > good)
        depth_found(findings, CRANNY_DEPTH_WARNING, "normal-length",
                    "%.3g %% of the normals are not unit (their mean length is %.3g); they are "
                    "normalised, but if they were compressed another way pass normal_format",
                    100 * (double)(good - counts->unit) / (double)good,
                    counts->length_sum / (double)good);
    return MEND_NONE;
}

static void position(const struct frame *frame, int x, int y, double p[3])
{
    const struct cranny_projection *q = &frame->projection;
    const double d = (double)frame->sign * (double)frame_depth(frame, x, y);
    const double u = (x + 0.5) / frame->view.width, v = (y + 0.5) / frame->view.height;
    const double scale = q->kind == CRANNY_PERSPECTIVE ? d : 1;
    p[0] = scale * ((double)q->left + u * ((double)q->right - (double)q->left));
    p[1] = scale * ((double)q->top - v * ((double)q->top - (double)q->bottom));
    p[2] = -d;
}

/* The tangent along one axis, from the side on which depth bends less; false at edges. */
static bool tangent(const struct frame *frame, int x, int y, int dx, int dy, double t[3])
{
    const double here = (double)frame->sign * (double)frame_depth(frame, x, y);
    double least = 0.02;
    int best = 0;
    for (int side = -1; side <= 1; side += 2) {
        const int x2 = x + 2 * side * dx, y2 = y + 2 * side * dy;
        if (x2 < 0 || y2 < 0 || x2 >= frame->view.width || y2 >= frame->view.height)
            continue;
        const double next =
            (double)frame->sign * (double)frame_depth(frame, x + side * dx, y + side * dy);
        const double second = (double)frame->sign * (double)frame_depth(frame, x2, y2);
        const double bend =
            next > 0 && second > 0 ? fabs(here / second - 2 * here / next + 1) : INFINITY;
        if (bend < least && fabs(next / here - 1) < 0.2) {
            least = bend;
            best = side;
        }
    }
    if (!best)
        return false;
    double a[3], b[3];
    position(frame, x, y, a);
    position(frame, x + best * dx, y + best * dy, b);
    for (int k = 0; k < 3; k++)
        t[k] = best * (b[k] - a[k]);
    return true;
}

/* False where depth does not tell: edges, sky, grazing angles. */
static bool seen_normal(const struct frame *frame, int x, int y, int reach, struct pair *pair)
{
    double along[3], down[3], p[3];
    const float d = frame->sign * frame_depth(frame, x, y);
    if (!(d > 0) || isinf(d) || !tangent(frame, x, y, reach, 0, along) ||
        !tangent(frame, x, y, 0, reach, down))
        return false;
    position(frame, x, y, p);
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        pair->seen[k] = down[i] * along[j] - down[j] * along[i];
        pair->toward[k] = frame->projection.kind == CRANNY_PERSPECTIVE ? -p[k] : k == 2;
    }
    return unit_length(pair->seen) && unit_length(pair->toward) &&
           dot(pair->seen, pair->toward) > 0.1;
}

/* Directions as cells of a cube. */
static int cell_of(const double n[3])
{
    int cell = 0;
    for (int k = 0; k < 3; k++)
        cell = cell * CELLS + (int)lrint((n[k] + 1) * 0.5 * (CELLS - 1));
    return cell;
}

/* Each direction counts alike: a floor that fills the picture says little about x. Rare ones are
 * edges that slipped through, and count nothing. */
static void weigh(struct pairs *pairs)
{
    size_t counts[CELLS * CELLS * CELLS] = {0};
    for (size_t i = 0; i < pairs->count; i++)
        counts[cell_of(pairs->items[i].seen)]++;
    for (size_t i = 0; i < pairs->count; i++) {
        const size_t count = counts[cell_of(pairs->items[i].seen)];
        pairs->items[i].weight = 200 * count >= pairs->count ? 1.0 / (double)count : 0;
    }
}

/* `mirror`: the normals' rows are taken from the bottom up. */
static void gather_pairs(const struct frame *frame, enum mend mend, int reach, bool mirror,
                         struct pairs *pairs)
{
    const int width = frame->view.width, height = frame->view.height;
    const int step = max_int(1, (int)ceil(sqrt((double)width * height / (PAIRS_MAX / 2))));
    pairs->count = 0;
    for (int y = 0; y < height; y += step)
        for (int x = 0; x < width && pairs->count < PAIRS_MAX; x += step) {
            struct pair *pair = &pairs->items[pairs->count];
            if (!seen_normal(frame, x, y, reach, pair))
                continue;
            read_normal(frame, mend, x, mirror ? height - 1 - y : y, pair->stored);
            pairs->count += unit_length(pair->stored);
        }
    weigh(pairs);
}

static void apply(double m[3][3], const double v[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = dot(m[k], v);
}

/* The share of pairs that a matrix brings together. */
static double agreement(const struct pairs *pairs, double m[3][3], double cosine)
{
    double good = 0, all = 0;
    for (size_t i = 0; i < pairs->count; i++) {
        const double weight = pairs->items[i].weight;
        double turned[3];
        apply(m, pairs->items[i].stored, turned);
        good += dot(turned, pairs->items[i].seen) > cosine ? weight : 0;
        all += weight;
    }
    return all > 0 ? good / all : 0;
}

/* Which axis feeds each of x, y, z; identity first, then what swaps two, then what turns all. */
static const int axes[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}};
/* Bit k flips axis k: none, all, one, two. */
static const int flips[8] = {0, 7, 4, 2, 1, 6, 5, 3};

static void signed_axes(int order, int flip, double m[3][3])
{
    memset(m, 0, 9 * sizeof(double));
    for (int k = 0; k < 3; k++)
        m[k][axes[order][k]] = flip >> k & 1 ? -1 : 1;
}

/* The simplest of the 48 changes of axes that does best. */
static double best_axes(const struct pairs *pairs, int *order, int *flip)
{
    double best = -1, m[3][3];
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 8; j++) {
            signed_axes(i, flips[j], m);
            const double share = agreement(pairs, m, COS_CLOSE);
            if (share > best + 0.02) {
                best = share;
                *order = i;
                *flip = flips[j];
            }
        }
    return best;
}

/* The eigenvector of the largest eigenvalue, after shifting all to be positive: by squaring. */
static void principal(double n[4][4], double shift, double q[4])
{
    for (int i = 0; i < 4; i++)
        n[i][i] += shift;
    for (int round = 0; round < 12; round++) {
        double square[4][4], trace = 0;
        for (int i = 0; i < 4; i++)
            trace += n[i][i];
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                square[i][j] = 0;
                for (int k = 0; k < 4; k++)
                    square[i][j] += n[i][k] * n[k][j] / (trace * trace);
            }
        memcpy(n, square, sizeof square);
    }
    int column = 0;
    for (int i = 1; i < 4; i++)
        if (n[i][i] > n[column][column])
            column = i;
    double length = 0;
    for (int i = 0; i < 4; i++)
        length += n[i][column] * n[i][column];
    for (int i = 0; i < 4; i++)
        q[i] = n[i][column] / sqrt(length);
}

/* Horn's matrix of the sums s[a][b] = Σ stored_a seen_b, and the rotation of its quaternion. */
static void rotation_from_sums(double s[3][3], double weight, double m[3][3])
{
    double n[4][4] = {{s[0][0] + s[1][1] + s[2][2]}}, q[4];
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        n[0][a + 1] = n[a + 1][0] = s[b][c] - s[c][b];
        n[a + 1][a + 1] = s[a][a] - s[b][b] - s[c][c];
        n[a + 1][b + 1] = n[b + 1][a + 1] = s[a][b] + s[b][a];
    }
    principal(n, 2 * weight, q);
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        m[a][a] = q[0] * q[0] + q[a + 1] * q[a + 1] - q[b + 1] * q[b + 1] - q[c + 1] * q[c + 1];
        m[a][b] = 2 * (q[a + 1] * q[b + 1] - q[0] * q[c + 1]);
        m[b][a] = 2 * (q[a + 1] * q[b + 1] + q[0] * q[c + 1]);
    }
}

/* `sign` −1: rotations with a mirror, as left-handed worlds need. */
static double best_rotation(const struct pairs *pairs, double sign, double m[3][3])
{
    memset(m, 0, 9 * sizeof(double));
    for (int round = 0; round < 8; round++) {
        double s[3][3] = {{0}}, total = 0;
        for (size_t i = 0; i < pairs->count; i++) {
            const struct pair *pair = &pairs->items[i];
            double turned[3];
            apply(m, pair->stored, turned);
            const double weight =
                pair->weight * (round ? 0.02 / (1.02 - dot(turned, pair->seen)) : 1);
            total += weight;
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < 3; b++)
                    s[a][b] += weight * sign * pair->stored[a] * pair->seen[b];
        }
        rotation_from_sums(s, total, m);
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                m[a][b] *= sign;
    }
    return agreement(pairs, m, COS_CLOSE);
}

static bool odd_order(int order)
{
    return order >= 1 && order <= 3;
}

static void report_axes(int order, int flip, double share, double identity,
                        struct depth_findings *findings)
{
    char recipe[40] = "";
    for (int k = 0; k < 3; k++)
        snprintf(recipe + strlen(recipe), sizeof recipe - strlen(recipe), "%s%s%c", k ? ", " : "",
                 flip >> k & 1 ? "-" : "", "xyz"[axes[order][k]]);
    const int mirrors = (flip & 1) + (flip >> 1 & 1) + (flip >> 2 & 1) + odd_order(order);
    if (order == 0 && flip == 7)
        depth_found(findings, CRANNY_DEPTH_ERROR, "normal-sign",
                    "the normals point away from the camera: negate them (%.0f %% then agree with "
                    "depth, now %.0f %%)",
                    100 * share, 100 * identity);
    else if (order && mirrors % 2 == 0)
        depth_found(findings, CRANNY_DEPTH_ERROR, "normal-world",
                    "the normals are turned by quarters, as in world space or with another axis "
                    "up; view space has x right, y up, z towards the viewer: pass (%s) (%.0f %% "
                    "then agree with depth, now %.0f %%)",
                    recipe, 100 * share, 100 * identity);
    else
        depth_found(findings, CRANNY_DEPTH_ERROR, "normal-axis",
                    "the normals' axes differ from depth's; view space has x right, y up, z "
                    "towards the viewer, and row 0 is the top one: pass (%s)%s (%.0f %% then agree "
                    "with depth, now %.0f %%)",
                    recipe, flip == 2 && !order ? ", or turn both pictures upside down" : "",
                    100 * share, 100 * identity);
}

static void report_world(double m[3][3], const char *source, double share, double identity,
                         struct depth_findings *findings)
{
    depth_found(findings, CRANNY_DEPTH_ERROR, "normal-world",
                "the normals are not in view space but rotated, as world space is: multiply them "
                "by %s, [%.3f %.3f %.3f; %.3f %.3f %.3f; %.3f %.3f %.3f] (%.0f %% then agree with "
                "depth, now %.0f %%)",
                source, m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1],
                m[2][2], 100 * share, 100 * identity);
}

/* Its rotation's inverse; scale does not matter to directions as long as it is uniform. */
static bool view_from_world(const struct frame *frame, double m[3][3])
{
    const double *w = frame->gbuffer->world_from_view;
    if (!w)
        return false;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 3; i++)
            m[k][i] = w[4 * i + k];
        if (!unit_length(m[k]))
            return false;
    }
    return true;
}

/* True: reported. */
static bool explain(const struct frame *frame, const struct pairs *pairs, double identity,
                    struct depth_findings *findings)
{
    /* a change of axes that leaves few of the misfits is one even when most things fit before */
    const double needed = fmax(0.6, identity + 0.25);
    const double needed_axes = fmax(0.6, fmin(identity + 0.25, 1 - 0.4 * (1 - identity)));
    double world[3][3], turned[3][3], mirrored[3][3], share;
    int order = 0, flip = 0;
    if (view_from_world(frame, world) && (share = agreement(pairs, world, COS_CLOSE)) >= needed) {
        report_world(world, "the rotation of world_from_view, transposed", share, identity,
                     findings);
        return true;
    }
    const double by_axes = best_axes(pairs, &order, &flip);
    const double by_turn = best_rotation(pairs, 1, turned);
    const double by_mirror = best_rotation(pairs, -1, mirrored);
    if (by_axes >= needed_axes && by_axes >= fmax(by_turn, by_mirror) - 0.1) {
        report_axes(order, flip, by_axes, identity, findings);
        return true;
    }
    if (fmax(by_turn, by_mirror) < needed)
        return false;
    const bool mirror = by_mirror > by_turn + 0.1;
    report_world(mirror ? mirrored : turned,
                 mirror ? "the camera's rotation with a mirror" : "the camera's rotation",
                 mirror ? by_mirror : by_turn, identity, findings);
    return true;
}

static double share_away(const struct pairs *pairs)
{
    size_t away = 0;
    for (size_t i = 0; i < pairs->count; i++)
        away += dot(pairs->items[i].stored, pairs->items[i].toward) < -0.1;
    return (double)away / (double)pairs->count;
}

static double agreement_mirrored(const struct frame *frame, enum mend mend, int reach,
                                 struct pairs *pairs)
{
    double same[3][3];
    signed_axes(0, 0, same);
    gather_pairs(frame, mend, reach, true, pairs);
    return agreement(pairs, same, COS_CLOSE);
}

static void compare(const struct frame *frame, enum mend mend, int reach, bool constant,
                    struct pairs *pairs, struct depth_findings *findings)
{
    double same[3][3];
    signed_axes(0, 0, same);
    gather_pairs(frame, mend, reach, false, pairs);
    if (pairs->count < PAIRS_MIN)
        return;
    const double close = agreement(pairs, same, COS_CLOSE);
    const double rough = agreement(pairs, same, COS_ROUGH), away = share_away(pairs);
    if (constant && close < 0.9) {
        depth_found(findings, CRANNY_DEPTH_ERROR, "normal-constant",
                    "all normals are one and the same, but depth is no single plane; pass NULL to "
                    "have them reconstructed");
        return;
    }
    if (close < 0.92 && explain(frame, pairs, close, findings))
        return;
    if (close >= 0.75) {
        if (away > 0.05)
            depth_found(findings, CRANNY_DEPTH_WARNING, "normal-sign",
                        "%.0f %% of the normals point away from the camera; turn those of back "
                        "faces round",
                        100 * away);
        return;
    }
    if (rough >= 0.4)
        return;
    const double mirrored = agreement_mirrored(frame, mend, reach, pairs);
    if (mirrored > fmax(0.6, close + 0.25))
        depth_found(findings, CRANNY_DEPTH_ERROR, "normal-rows",
                    "the normals' rows run from the bottom up and depth's from the top down: turn "
                    "one of the two over (%.0f %% then agree, now %.0f %%)",
                    100 * mirrored, 100 * close);
    else
        depth_found(findings, CRANNY_DEPTH_WARNING, "normal-mismatch",
                    "only %.0f %% of the normals agree with depth, and no change of sign, axes or "
                    "space explains it; are both of one frame, one size and one projection?",
                    100 * rough);
}

/* Pixels between neighbours, so that a step (as normal_check's) of depth tilts a surface by a tenth
 * at most; 0: the steps are too coarse for any. */
static int reach_for(const struct frame *frame, double step)
{
    const struct cranny_projection *p = &frame->projection;
    const double pixel = ((double)p->top - (double)p->bottom) / frame->view.height;
    const double reach = ceil(step / (0.1 * pixel));
    const int most = max_int(1, min_int(frame->view.width, frame->view.height) / 24);
    return reach > most ? 0 : max_int(1, (int)reach);
}

enum cranny_status normal_check(const struct frame *frame, bool usable, double step,
                                struct depth_findings *findings, struct cranny_error *why)
{
    struct normal_counts counts;
    const enum mend possible = possible_mend(frame);
    count_all(frame, possible, &counts);
    if (!counts.seen)
        return CRANNY_OK;
    const enum mend mend = check_lengths(&counts, possible, findings);
    const size_t good = counts.seen - counts.nan - counts.zero;
    const int reach = reach_for(frame, step);
    if (!usable || !reach || !good)
        return CRANNY_OK;
    struct pairs pairs = {alloc_array(PAIRS_MAX, sizeof *pairs.items), 0};
    if (!pairs.items)
        return fail_memory(why, "the normals' sample");
    compare(frame, mend, reach, 100 * counts.different < good, &pairs, findings);
    free(pairs.items);
    return CRANNY_OK;
}
