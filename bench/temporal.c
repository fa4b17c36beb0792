/* Temporal coherence, the first requirement of McGuire et al. 2011 (§1): how much the obscurance of
 * a point on a surface changes from one frame to the next while the camera walks by.
 *
 * The camera walks 1.4 m/s and turns 9°/s at 60 frames a second, centred on a view of views.c.
 * Pixel centres of frame f are reprojected into frame f + 1, and taken where all four neighbours
 * there lie on the same surface: within 0.2 % of the depth of the point's plane, normals within
 * 18°. There the picture is read bilinearly. Measured is the rms over points and frames of
 *
 *     [V(f+1) − V(f)] − [T(f+1) − T(f)]
 *
 * for each method's V, raw and filtered. The truth T of a point does not change; what its own
 * difference takes out is the resampling. T is traced at every 29th match alone, at the point and
 * its four neighbours, twice, with independent seeds: the mean of (ΔV − ΔT_a)(ΔV − ΔT_b) over these
 * matches has no share of the rays' noise. Where both ΔT are above 0.03 the pixels do not resolve
 * what is there, and the match is left out.
 *
 * Usage: bench-temporal [--json] [--frames N] [--rays N] [--size WxH] [--method M]
 *                       ["SCENE VIEW"...]
 * Views as in "sponza nave"; without any, that one and "bathroom camera". */
#include "views.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FRAMES_A_SECOND 60
#define WALK_M_S 1.4
#define TURN_DEGREES_S 9
#define PLANE_TOLERANCE 0.002 /* of the depth */
#define RESOLVED 0.03         /* change of the truth beyond which pixels do not resolve it */

enum {
    TRUTHS = 2,
    TAPS = 5, /* the point and its neighbours in the next frame */
    MATCH_STEP = 29,
    VIEWS_MAX = 8
};

static const struct look {
    const char *name;
    int noise, anchor;
} looks[] = {
    {"tile, screen", CRANNY_NOISE_TILE, CRANNY_ANCHOR_SCREEN},
    {"hash, screen", CRANNY_NOISE_HASH, CRANNY_ANCHOR_SCREEN},
    {"hash, surface", CRANNY_NOISE_HASH, CRANNY_ANCHOR_SURFACE},
    {"none", CRANNY_NOISE_NONE, CRANNY_ANCHOR_SCREEN},
};
enum {
    LOOKS = sizeof looks / sizeof *looks,
    COLUMNS = CRANNY_METHOD_COUNT * LOOKS * 2 /* raw and filtered */
};

struct options {
    int width, height, frames, rays;
    bool json;
    const char *method, *views[VIEWS_MAX];
    int view_count;
};

/* One frame: its G-buffer and, one after the other, all pictures. */
struct shot {
    struct cranny_camera camera;
    struct cranny_frame *frame;
    struct cranny_gbuffer gbuffer;
    float *pictures;
};

/* Pixel `from` of a frame is found between pixels `to`, to + 1 and those below of the next one. */
struct match {
    int from, to;
    float fx, fy;
    double truth[TRUTHS]; /* its change */
};

struct run {
    const struct options *options;
    const struct view *view;
    struct cranny_workspace *workspace;
    struct shot shots[2];
    struct match *matches;                                  /* of which the truth is known */
    float (*positions)[3], (*normals)[3], (*visibility)[2]; /* TAPS for each */
    size_t match_count, seen, points; /* of this frame; of all: found, and looked at */
    double truth_sum, sums[COLUMNS];  /* of the products */
};

static size_t pixels_of(const struct options *o)
{
    return (size_t)o->width * (size_t)o->height;
}

static bool is_wanted(const struct options *o, int column)
{
    const char *name = cranny_method_name((enum cranny_method)(column / (LOOKS * 2)));
    return !o->method || strcmp(o->method, name) == 0;
}

/* The view's camera, `step` frames along its walk: ahead and to the right, turning about +Y. */
static void walk(const struct cranny_camera *base, double step, struct cranny_camera *camera)
{
    const double angle = -step * TURN_DEGREES_S / FRAMES_A_SECOND * 0.017453292519943295;
    const double metres = step * WALK_M_S / FRAMES_A_SECOND, c = cos(angle), s = sin(angle);
    *camera = *base;
    for (int column = 0; column < 3; column++) {
        const double x = base->world_from_view[column], z = base->world_from_view[8 + column];
        camera->world_from_view[column] = c * x + s * z;
        camera->world_from_view[8 + column] = c * z - s * x;
    }
    for (int row = 0; row < 3; row++) {
        const double *m = base->world_from_view + 4 * row;
        camera->world_from_view[4 * row + 3] += metres * (0.6 * m[0] - 0.8 * m[2]);
    }
}

static float depth_at(const struct shot *shot, int x, int y)
{
    const struct cranny_gbuffer *g = &shot->gbuffer;
    return g->depth[(size_t)(g->viewport.y + y) * (size_t)g->width + (size_t)(g->viewport.x + x)];
}

static const float *normal_at(const struct shot *shot, int x, int y)
{
    const struct cranny_gbuffer *g = &shot->gbuffer;
    const float *normals = g->normal;
    return normals +
           3 * ((size_t)(g->viewport.y + y) * (size_t)g->width + (size_t)(g->viewport.x + x));
}

static void view_at(const struct shot *shot, double x, double y, double depth, double p[3])
{
    const struct cranny_gbuffer *g = &shot->gbuffer;
    const struct cranny_projection *q = &g->projection;
    const double u = (x + 0.5) / g->viewport.width, v = (y + 0.5) / g->viewport.height;
    p[0] = depth * ((double)q->left + u * ((double)q->right - (double)q->left));
    p[1] = depth * ((double)q->top + v * ((double)q->bottom - (double)q->top));
    p[2] = -depth;
}

/* A direction (w 0) or point (w 1) from one frame's view space to the other's. */
static void carry(const struct shot *from, const struct shot *to, const double p[3], double w,
                  double q[3])
{
    const double *a = from->gbuffer.world_from_view, *b = to->gbuffer.world_from_view;
    double world[3];
    for (int i = 0; i < 3; i++)
        world[i] = a[4 * i] * p[0] + a[4 * i + 1] * p[1] + a[4 * i + 2] * p[2] +
                   w * (a[4 * i + 3] - b[4 * i + 3]);
    for (int i = 0; i < 3; i++)
        q[i] = b[i] * world[0] + b[4 + i] * world[1] + b[8 + i] * world[2];
}

/* Whether pixel (x, y) shows the surface through p with normal n. */
static bool is_same_surface(const struct shot *shot, int x, int y, const double p[3],
                            const double n[3])
{
    const float depth = depth_at(shot, x, y), *normal = normal_at(shot, x, y);
    if (!isfinite(depth))
        return false;
    double there[3], apart = 0, alike = 0;
    view_at(shot, x, y, (double)depth, there);
    for (int i = 0; i < 3; i++) {
        apart += n[i] * (there[i] - p[i]);
        alike += n[i] * (double)normal[i];
    }
    return fabs(apart) < -PLANE_TOLERANCE * p[2] && alike > 0.95;
}

static bool find_match(const struct run *run, int x, int y, struct match *match)
{
    const struct shot *now = &run->shots[0], *next = &run->shots[1];
    const struct cranny_gbuffer *g = &next->gbuffer;
    const struct cranny_projection *q = &g->projection;
    const float depth = depth_at(now, x, y), *normal = normal_at(now, x, y);
    if (!isfinite(depth))
        return false;
    double here[3], p[3], n[3];
    const double facing[3] = {(double)normal[0], (double)normal[1], (double)normal[2]};
    view_at(now, x, y, (double)depth, here);
    carry(now, next, here, 1, p);
    carry(now, next, facing, 0, n);
    if (!(p[2] < 0))
        return false;
    const double u = (-p[0] / p[2] - (double)q->left) / ((double)q->right - (double)q->left);
    const double v = (-p[1] / p[2] - (double)q->top) / ((double)q->bottom - (double)q->top);
    const double sx = u * g->viewport.width - 0.5, sy = v * g->viewport.height - 0.5;
    if (!(sx >= 0 && sy >= 0 && sx < g->viewport.width - 1 && sy < g->viewport.height - 1))
        return false;
    const int ix = (int)sx, iy = (int)sy;
    for (int k = 0; k < 4; k++)
        if (!is_same_surface(next, ix + (k & 1), iy + k / 2, p, n))
            return false;
    *match = (struct match){.from = y * run->options->width + x,
                            .to = iy * run->options->width + ix,
                            .fx = (float)(sx - ix),
                            .fy = (float)(sy - iy)};
    return true;
}

static void find_matches(struct run *run)
{
    run->match_count = 0;
    for (int y = 0; y < run->options->height; y++)
        for (int x = 0; x < run->options->width; x++) {
            struct match match;
            if (find_match(run, x, y, &match) && run->seen++ % MATCH_STEP == 0)
                run->matches[run->match_count++] = match;
        }
}

/* What pixel `index` of the picture shows, in world space. */
static void world_at(const struct shot *shot, int width, int index, float position[3],
                     float normal[3])
{
    const double *m = shot->gbuffer.world_from_view;
    const int x = index % width, y = index / width;
    const float *n = normal_at(shot, x, y);
    double p[3];
    view_at(shot, x, y, (double)depth_at(shot, x, y), p);
    for (int i = 0; i < 3; i++) {
        const double *row = m + 4 * i;
        position[i] = (float)(row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]);
        normal[i] = (float)(row[0] * (double)n[0] + row[1] * (double)n[1] + row[2] * (double)n[2]);
    }
}

static double bilinear(const struct match *m, double a, double b, double c, double d)
{
    const double x = (double)m->fx, upper = a + x * (b - a), lower = c + x * (d - c);
    return upper + (double)m->fy * (lower - upper);
}

/* The truth's change at all matches. Owen-scrambled points: seeds are independent, as those of the
 * spiral, whose shifts are a lattice, are not. */
static enum cranny_status trace_matches(struct run *run, const struct view_stage *stage, int frame,
                                        struct cranny_error *why)
{
    const int width = run->options->width, offsets[TAPS] = {0, 0, 1, width, width + 1};
    struct cranny_gather_params params = cranny_gather_params_default();
    params.sampler = CRANNY_SAMPLER_SOBOL;
    params.kernel = CRANNY_KERNEL_LINEAR;
    params.rays = run->options->rays;
    params.distances[0] = params.distances[1] = run->view->radius_world;
    for (size_t i = 0; i < TAPS * run->match_count; i++) {
        const struct match *m = &run->matches[i / TAPS];
        const int tap = (int)(i % TAPS);
        world_at(&run->shots[tap > 0], width, tap ? m->to + offsets[tap] : m->from,
                 run->positions[i], run->normals[i]);
    }
    enum cranny_status status = CRANNY_OK;
    for (int t = 0; t < TRUTHS && status == CRANNY_OK; t++) {
        params.seed = (uint32_t)(TRUTHS * frame + t);
        status = cranny_gather(stage->tracer, TAPS * run->match_count,
                               (const float(*)[3])run->positions, (const float(*)[3])run->normals,
                               NULL, &params, run->visibility, NULL, why);
        for (size_t i = 0; i < run->match_count; i++) {
            float(*v)[2] = run->visibility + TAPS * i;
            run->matches[i].truth[t] = bilinear(&run->matches[i], (double)v[1][0], (double)v[2][0],
                                                (double)v[3][0], (double)v[4][0]) -
                                       (double)v[0][0];
        }
    }
    return status;
}

static double change(const struct run *run, int column, const struct match *m)
{
    const size_t offset = (size_t)column * pixels_of(run->options);
    const float *before = run->shots[0].pictures + offset;
    const float *after = run->shots[1].pictures + offset + m->to;
    const float *below = after + run->options->width;
    return bilinear(m, (double)after[0], (double)after[1], (double)below[0], (double)below[1]) -
           (double)before[m->from];
}

static void add_changes(struct run *run)
{
    for (size_t i = 0; i < run->match_count; i++) {
        const struct match *m = &run->matches[i];
        if (fmin(fabs(m->truth[0]), fabs(m->truth[1])) > RESOLVED)
            continue;
        run->points++;
        run->truth_sum += m->truth[0] * m->truth[1];
        for (int c = 0; c < COLUMNS; c++) {
            const double v = is_wanted(run->options, c) ? change(run, c, m) : 0;
            run->sums[c] += (v - m->truth[0]) * (v - m->truth[1]);
        }
    }
}

static enum cranny_status render_column(struct run *run, struct shot *shot, int column,
                                        struct cranny_error *why)
{
    const struct look *look = &looks[column / 2 % LOOKS];
    struct cranny_screen_params params =
        cranny_screen_params_preset((enum cranny_method)(column / (LOOKS * 2)), NULL);
    params.radius_world = run->view->radius_world;
    params.noise = look->noise;
    params.anchor = look->anchor;
    params.filter = column % 2 ? params.filter : CRANNY_FILTER_NONE;
    params.workspace = run->workspace;
    return cranny_screen_render(&shot->gbuffer, &params,
                                shot->pictures + (size_t)column * pixels_of(run->options), 0, why);
}

static enum cranny_status shoot(struct run *run, const struct view_stage *stage, struct shot *shot,
                                struct cranny_error *why)
{
    const struct options *o = run->options;
    struct cranny_frame_params frame = cranny_frame_params_default();
    frame.width = o->width;
    frame.height = o->height;
    frame.guard_band = o->height / 10;
    cranny_frame_destroy(&shot->frame);
    enum cranny_status status =
        cranny_frame_create(stage->scene, stage->tracer, &shot->camera, &frame, &shot->frame, why);
    if (status == CRANNY_OK)
        shot->gbuffer = cranny_frame_gbuffer(shot->frame);
    for (int c = 0; c < COLUMNS && status == CRANNY_OK; c++)
        if (is_wanted(o, c))
            status = render_column(run, shot, c, why);
    return status;
}

static enum cranny_status fly(struct run *run, struct view_stage *stage, struct cranny_error *why)
{
    struct cranny_camera base;
    const int frames = run->options->frames;
    enum cranny_status status = view_enter(stage, run->view, why);
    if (status == CRANNY_OK)
        status = view_camera(run->view, stage->scene, &base, why);
    for (int f = 0; f < frames && status == CRANNY_OK; f++) {
        const struct shot last = run->shots[0];
        run->shots[0] = run->shots[1];
        run->shots[1] = last;
        walk(&base, f - 0.5 * (frames - 1), &run->shots[1].camera);
        status = shoot(run, stage, &run->shots[1], why);
        if (f == 0 || status != CRANNY_OK)
            continue;
        find_matches(run);
        status = trace_matches(run, stage, f, why);
        add_changes(run);
    }
    return status;
}

static double rms(const struct run *run, double sum)
{
    return sqrt(fmax(0, sum / (double)run->points));
}

static void print_table(const struct run *run)
{
    const struct options *o = run->options;
    printf("\n### %s %s\n\n%d frames of %d x %d, %.0f %% of the pixels are seen in the next frame; "
           "the truth's own change is %.4f\n\n| method |",
           run->view->scene, run->view->name, o->frames, o->width, o->height,
           100 * (double)run->seen / (double)pixels_of(o) / (o->frames - 1),
           rms(run, run->truth_sum));
    for (int l = 0; l < LOOKS; l++)
        printf(" %s: raw | filtered |", looks[l].name);
    printf("\n|---|");
    for (int l = 0; l < 2 * LOOKS; l++)
        printf("---|");
    for (int c = 0; c < COLUMNS; c++) {
        if (!is_wanted(o, c))
            continue;
        if (c % (2 * LOOKS) == 0)
            printf("\n| %s |", cranny_method_name((enum cranny_method)(c / (2 * LOOKS))));
        printf(" %.4f |", rms(run, run->sums[c]));
    }
    printf("\n");
}

static void print_json(const struct run *run, bool first)
{
    const struct options *o = run->options;
    for (int c = 0; c < COLUMNS; c += 2) {
        if (!is_wanted(o, c))
            continue;
        const struct look *look = &looks[c / 2 % LOOKS];
        printf("%s\n  {\"scene\": \"%s\", \"view\": \"%s\", \"method\": \"%s\", \"noise\": \"%s\", "
               "\"frames\": %d, \"width\": %d, \"height\": %d, \"points\": %zu, \"raw\": %.6f, "
               "\"filtered\": %.6f, \"truth\": %.6f}",
               first ? "" : ",", run->view->scene, run->view->name,
               cranny_method_name((enum cranny_method)(c / (2 * LOOKS))), look->name, o->frames,
               o->width, o->height, run->points, rms(run, run->sums[c]), rms(run, run->sums[c + 1]),
               rms(run, run->truth_sum));
        first = false;
    }
}

static enum cranny_status run_view(const struct options *o, const struct view *view,
                                   struct view_stage *stage, bool first, struct cranny_error *why)
{
    struct run run = {.options = o, .view = view};
    enum cranny_status status = cranny_workspace_create(&run.workspace, why);
    const size_t most = pixels_of(o) / MATCH_STEP + 1;
    run.matches = malloc(most * sizeof *run.matches);
    run.positions = malloc(TAPS * most * sizeof *run.positions);
    run.normals = malloc(TAPS * most * sizeof *run.normals);
    run.visibility = malloc(TAPS * most * sizeof *run.visibility);
    bool enough = run.matches && run.positions && run.normals && run.visibility;
    for (int i = 0; i < 2; i++) {
        run.shots[i].pictures = malloc(pixels_of(o) * COLUMNS * sizeof(float));
        enough = enough && run.shots[i].pictures;
    }
    if (!enough)
        status = CRANNY_MEMORY;
    if (status == CRANNY_OK)
        status = fly(&run, stage, why);
    if (status == CRANNY_OK && o->json)
        print_json(&run, first);
    else if (status == CRANNY_OK)
        print_table(&run);
    fflush(stdout);
    for (int i = 0; i < 2; i++) {
        cranny_frame_destroy(&run.shots[i].frame);
        free(run.shots[i].pictures);
    }
    free(run.matches);
    free(run.positions);
    free(run.normals);
    free(run.visibility);
    cranny_workspace_destroy(&run.workspace);
    return status;
}

static const struct view *find_view(const char *text)
{
    for (int i = 0; i < view_count; i++) {
        char name[64];
        snprintf(name, sizeof name, "%s %s", views[i].scene, views[i].name);
        if (strcmp(name, text) == 0)
            return &views[i];
    }
    return NULL;
}

static bool parse(int argc, char **argv, struct options *o)
{
    for (int i = 1; i < argc; i++) {
        const bool more = i + 1 < argc;
        if (strcmp(argv[i], "--json") == 0)
            o->json = true;
        else if (strcmp(argv[i], "--frames") == 0 && more)
            o->frames = atoi(argv[++i]);
        else if (strcmp(argv[i], "--rays") == 0 && more)
            o->rays = atoi(argv[++i]);
        else if (strcmp(argv[i], "--method") == 0 && more)
            o->method = argv[++i];
        else if (strcmp(argv[i], "--size") == 0 && more) {
            if (sscanf(argv[++i], "%dx%d", &o->width, &o->height) != 2)
                return false;
        } else if (find_view(argv[i]) && o->view_count < VIEWS_MAX)
            o->views[o->view_count++] = argv[i];
        else
            return false;
    }
    enum cranny_method method;
    return o->frames > 1 && o->rays > 0 && o->width > 1 && o->width <= CRANNY_SIDE_MAX &&
           o->height > 1 && o->height <= CRANNY_SIDE_MAX &&
           (!o->method || cranny_method_find(o->method, &method));
}

int main(int argc, char **argv)
{
    struct options o = {.width = 320, .height = 180, .frames = 60, .rays = 64};
    struct view_stage stage = {0};
    struct cranny_error why = {.message = "out of memory"};
    enum cranny_status status = CRANNY_OK;
    bool first = true;
    if (!parse(argc, argv, &o)) {
        fprintf(stderr, "bench-temporal: wrong usage; see the head of bench/temporal.c\n");
        return 2;
    }
    if (!o.view_count) {
        o.views[o.view_count++] = "sponza nave";
        o.views[o.view_count++] = "bathroom camera";
    }
    printf(o.json ? "[" : "## Change of a point's visibility from frame to frame, rms\n");
    for (int i = 0; i < o.view_count && status == CRANNY_OK; i++) {
        const struct view *view = find_view(o.views[i]);
        char *path = view_path(view);
        if (!path)
            fprintf(stderr, "%s: SKIPPED: not in CRANNY_SCENES\n", o.views[i]);
        else
            status = run_view(&o, view, &stage, first, &why);
        first = first && !path;
        free(path);
    }
    if (o.json)
        printf("\n]\n");
    view_leave(&stage);
    if (status != CRANNY_OK)
        fprintf(stderr, "bench-temporal: %s\n", why.message);
    return cranny_exit_status(status);
}
