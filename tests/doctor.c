/* The doctor of G-buffers: drawn scenes under every wrong convention get the right code, and under
 * the right one no alarm. */
#include "check.h"

#include <cranny/gbuffer.h>
#include <stdint.h>

/* ---- a small ray caster ---- */

struct solid {
    bool sphere;
    double centre[3], half[3], yaw, pitch; /* sphere: half[0] is its radius */
    bool inside;                           /* seen from within */
    double turned[3][3];                   /* made of yaw and pitch when drawn */
};

struct picture {
    int width, height;
    float *depth, *normal; /* linear metres, sky INFINITY; view space, sky 0 */
    struct cranny_projection projection;
    double world_from_view[12];
};

struct hit {
    double t, normal[3];
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void meet_sphere(const struct solid *s, const double o[3], const double d[3],
                        struct hit *hit)
{
    double q[3];
    for (int k = 0; k < 3; k++)
        q[k] = o[k] - s->centre[k];
    const double a = dot(d, d), b = dot(q, d), c = dot(q, q) - s->half[0] * s->half[0];
    const double root = b * b - a * c;
    const double t = root > 0 ? (-b - sqrt(root)) / a : -1;
    if (!(t > 1e-9 && t < hit->t))
        return;
    hit->t = t;
    for (int k = 0; k < 3; k++)
        hit->normal[k] = (q[k] + t * d[k]) / s->half[0];
}

/* The matrix that pitches about x, then yaws about y. */
static void turn_by(double yaw, double pitch, double m[3][3])
{
    const double cy = cos(yaw), sy = sin(yaw), cp = cos(pitch), sp = sin(pitch);
    const double rows[3][3] = {{cy, sy * sp, sy * cp}, {0, cp, -sp}, {-sy, cy * sp, cy * cp}};
    memcpy(m, rows, sizeof rows);
}

/* `back`: by the inverse. */
static void turn(const double m[3][3], bool back, const double v[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = back ? m[0][k] * v[0] + m[1][k] * v[1] + m[2][k] * v[2]
                      : m[k][0] * v[0] + m[k][1] * v[1] + m[k][2] * v[2];
}

static void meet_box(const struct solid *s, const double o[3], const double d[3], struct hit *hit)
{
    double q[3], lo[3], ld[3], n[3] = {0}, in = -1e30, out = 1e30;
    int axis_in = 0, axis_out = 0;
    for (int k = 0; k < 3; k++)
        q[k] = o[k] - s->centre[k];
    turn(s->turned, true, q, lo);
    turn(s->turned, true, d, ld);
    for (int k = 0; k < 3; k++) {
        double t0 = (-s->half[k] - lo[k]) / ld[k], t1 = (s->half[k] - lo[k]) / ld[k];
        if (t0 > t1) {
            const double swap = t0;
            t0 = t1, t1 = swap;
        }
        if (t0 > in)
            in = t0, axis_in = k;
        if (t1 < out)
            out = t1, axis_out = k;
    }
    const double t = s->inside ? out : in;
    const int axis = s->inside ? axis_out : axis_in;
    if (in > out || !(t > 1e-9 && t < hit->t))
        return;
    hit->t = t;
    n[axis] = ld[axis] > 0 ? -1 : 1;
    turn(s->turned, false, n, hit->normal);
}

static void draw(struct picture *p, struct solid *solids, int count, const double eye[3],
                 double yaw, double pitch)
{
    const struct cranny_projection *q = &p->projection;
    const bool parallel = q->kind == CRANNY_ORTHOGRAPHIC;
    double camera[3][3];
    turn_by(yaw, pitch, camera);
    for (int k = 0; k < count; k++)
        turn_by(solids[k].yaw, solids[k].pitch, solids[k].turned);
    p->depth = malloc(sizeof(float) * (size_t)p->width * (size_t)p->height);
    p->normal = malloc(3 * sizeof(float) * (size_t)p->width * (size_t)p->height);
    for (int k = 0; k < 3; k++) {
        const double axis[3] = {k == 0, k == 1, k == 2};
        double turned[3];
        turn(camera, false, axis, turned);
        for (int i = 0; i < 3; i++)
            p->world_from_view[4 * i + k] = turned[i];
        p->world_from_view[4 * k + 3] = eye[k];
    }
    for (int i = 0; i < p->width * p->height; i++) {
        const double u = (i % p->width + 0.5) / p->width, v = (i / p->width + 0.5) / p->height;
        const double x = (double)q->left + u * ((double)q->right - (double)q->left);
        const double y = (double)q->top - v * ((double)q->top - (double)q->bottom);
        const double from[3] = {parallel ? x : 0, parallel ? y : 0, 0};
        const double to[3] = {parallel ? 0 : x, parallel ? 0 : y, -1};
        double o[3], d[3], n[3];
        struct hit hit = {1e30, {0}};
        turn(camera, false, from, o);
        turn(camera, false, to, d);
        for (int k = 0; k < 3; k++)
            o[k] += eye[k];
        for (int k = 0; k < count; k++)
            (solids[k].sphere ? meet_sphere : meet_box)(&solids[k], o, d, &hit);
        turn(camera, true, hit.normal, n);
        p->depth[i] = hit.t < 1e29 ? (float)hit.t : INFINITY;
        for (int k = 0; k < 3; k++)
            p->normal[3 * i + k] = (float)n[k];
    }
}

/* ---- scenes ---- */

enum scene { STREET, ROOM, BALLS, HALL, SCENES };
static const char *const scene_names[] = {"street", "room", "balls", "hall"};

static uint32_t state;
static double random_in(double low, double high)
{
    state = state * 1664525u + 1013904223u;
    return low + (high - low) * (state >> 8) / 16777216.0;
}

static struct solid random_solid(double size, double depth)
{
    struct solid s = {.sphere = random_in(0, 1) < 0.4};
    const double half = random_in(0.3, 1) * size;
    for (int k = 0; k < 3; k++)
        s.half[k] = half * random_in(0.5, 1.2);
    s.centre[0] = random_in(-0.5, 0.5) * depth;
    s.centre[1] = s.half[1] * 0.8;
    s.centre[2] = -random_in(0.25, 1) * depth;
    s.yaw = random_in(-1, 1);
    s.pitch = random_in(-0.3, 0.3);
    return s;
}

/* `scale`: everything's size; 1 is a street of 40 m, a room of 8 m. */
static struct picture make(enum scene scene, bool parallel, double scale, int width, int height)
{
    struct solid solids[40];
    int count = 0;
    double eye[3] = {0, 1.7 * scale, 0}, yaw = 0.35, pitch = -0.22;
    state = 77 + (uint32_t)scene;
    if (scene == STREET)
        solids[count++] = (struct solid){.centre = {0, -1 * scale, 0},
                                         .half = {60 * scale, 1 * scale, 60 * scale}};
    if (scene == ROOM || scene == HALL)
        solids[count++] = (struct solid){.centre = {0, 2 * scale, -1 * scale},
                                         .half = {4 * scale, 2 * scale, 7 * scale},
                                         .inside = true};
    if (scene == HALL)
        yaw = 0, pitch = 0;
    for (int i = 0; i < (scene == BALLS ? 36 : 12); i++) {
        struct solid s =
            random_solid((scene == STREET ? 3 : 0.9) * scale, (scene == STREET ? 40 : 7) * scale);
        if (scene == BALLS)
            s.sphere = true, s.centre[1] = random_in(-1, 3) * scale;
        if (scene == HALL)
            s.yaw = s.pitch = 0;
        solids[count++] = s;
    }
    struct picture p = {.width = width, .height = height};
    const float aspect = (float)width / (float)height;
    if (parallel) {
        p.projection = cranny_orthographic((float)(scale * (scene == STREET ? 12 : 2)), aspect);
        eye[1] = (scene == STREET ? 14 : 2) * scale;
        eye[2] = (scene == STREET ? 10 : 0) * scale;
        pitch = scene == HALL ? 0 : scene == STREET ? -0.25 : -0.5;
    } else
        p.projection = cranny_perspective(1.0f, aspect);
    draw(&p, solids, count, eye, yaw, pitch);
    return p;
}

static void drop(struct picture *p)
{
    free(p->depth);
    free(p->normal);
}

/* ---- what the doctor said ---- */

struct said {
    int errors, warnings;
    char codes[512], texts[4096];
};

static void listen(void *user, enum cranny_depth_severity severity, const char *code,
                   const char *text)
{
    struct said *said = user;
    said->errors += severity == CRANNY_DEPTH_ERROR;
    said->warnings += severity == CRANNY_DEPTH_WARNING;
    const size_t c = strlen(said->codes), t = strlen(said->texts);
    snprintf(said->codes + c, sizeof said->codes - c, "%s,", code);
    snprintf(said->texts + t, sizeof said->texts - t, "\n    %c %s: %s", "EWN"[severity], code,
             text);
    CHECK(strlen(text) > 20 && !strchr(text, '\n'));
}

static struct said ask(const struct cranny_gbuffer *g, struct cranny_depth_advice *advice)
{
    struct said said = {0};
    struct cranny_error why = {0};
    CHECK_OK(cranny_gbuffer_check(g, listen, &said, advice, &why), why);
    return said;
}

static bool has(const struct said *said, const char *code)
{
    char wanted[64];
    snprintf(wanted, sizeof wanted, "%s,", code);
    return strstr(said->codes, wanted) != NULL;
}

static struct cranny_gbuffer frame_of(const struct picture *p)
{
    return (struct cranny_gbuffer){.width = p->width,
                                   .height = p->height,
                                   .depth = p->depth,
                                   .normal = p->normal,
                                   .projection = p->projection};
}

#define EXPECT(said, code, ...)                                                                    \
    do {                                                                                           \
        CHECK_MSG(has(&(said), code), __VA_ARGS__);                                                \
        if (!has(&(said), code))                                                                   \
            fprintf(stderr, "  wanted %s, got:%s\n", code, (said).texts);                          \
    } while (0)

#define EXPECT_QUIET(said, ...)                                                                    \
    do {                                                                                           \
        CHECK_MSG((said).errors + (said).warnings == 0, __VA_ARGS__);                              \
        if ((said).errors + (said).warnings)                                                       \
            fprintf(stderr, "  wanted nothing, got:%s\n", (said).texts);                           \
    } while (0)

/* ---- right conventions ---- */

static const struct {
    int width, height;
} sizes[] = {{480, 270}, {200, 150}, {120, 200}};

static void test_quiet(void)
{
    const double scales[] = {0.1, 1, 20};
    for (int scene = 0; scene < SCENES; scene++)
        for (int k = 0; k < 18; k++) {
            const int size = k % 3, parallel = k / 9;
            const double scale = scales[k / 3 % 3];
            struct picture p =
                make((enum scene)scene, parallel, scale, sizes[size].width, sizes[size].height);
            const struct cranny_gbuffer g = frame_of(&p);
            const struct said said = ask(&g, NULL);
            /* a parallel view of less than a metre cannot be told from normalised depth */
            if (parallel && has(&said, "depth-normalized"))
                CHECK_MSG(!said.errors && scale < 0.5, "%s: %s", scene_names[scene], said.texts);
            else
                EXPECT_QUIET(said, "%s, parallel %d, scale %g, %d wide", scene_names[scene],
                             parallel, scale, p.width);
            drop(&p);
        }
}

/* ---- wrong depth ---- */

struct convention {
    const char *code, *coarse; /* `coarse`: of 16 bits */
    struct cranny_depth_layout layout;
};

static void encode(struct picture *p, const struct cranny_depth_layout *layout)
{
    for (int i = 0; i < p->width * p->height; i++) {
        float v = cranny_depth_encode(layout, p->depth[i]);
        if (layout->format == CRANNY_DEPTH_UNORM16)
            v = (float)(lrint((double)v * 65535) / 65535.0);
        p->depth[i] = v;
    }
}

static void check_wrong(enum scene scene, bool parallel, int size,
                        const struct cranny_depth_layout *layout, const char *code)
{
    struct picture p = make(scene, parallel, 1, sizes[size].width, sizes[size].height);
    encode(&p, layout);
    const struct cranny_gbuffer g = frame_of(&p);
    const struct said said = ask(&g, NULL);
    EXPECT(said, code, "%s, %d wide, kind %d, format %d, gl %d, near %g", scene_names[scene],
           p.width, layout->kind, layout->format, layout->gl_range, (double)layout->near_plane);
    CHECK_MSG(said.errors > 0 || scene == BALLS || layout->format == CRANNY_DEPTH_UNORM16, "%s: %s",
              scene_names[scene], said.texts);
    if (layout->format == CRANNY_DEPTH_UNORM16)
        EXPECT(said, "depth-steps", "%s: 16 bits", scene_names[scene]);
    drop(&p);
}

static void test_wrong_perspective(void)
{
    const float planes[][2] = {{0.1f, 100}, {0.05f, INFINITY}, {0.5f, 500}};
    for (int scene = 0; scene < SCENES; scene++)
        for (int size = 0; size < 3; size++)
            for (int k = 0; k < 12; k++) {
                struct cranny_depth_layout l = {.kind = CRANNY_DEPTH_DEVICE,
                                                .near_plane = planes[k / 4][0],
                                                .far_plane = planes[k / 4][1],
                                                .reversed = k & 1,
                                                .gl_range = k & 2};
                check_wrong((enum scene)scene, false, size, &l,
                            l.reversed ? "depth-reversed" : "depth-device");
                l.format = CRANNY_DEPTH_UNORM16;
                l.gl_range = false;
                if (size == 0 && scene != BALLS)
                    check_wrong((enum scene)scene, false, size, &l,
                                l.reversed ? "depth-reversed" : "depth-device");
            }
}

static void test_wrong_others(void)
{
    for (int scene = 0; scene < SCENES; scene++)
        for (int size = 0; size < 3; size++)
            for (int parallel = 0; parallel < 2; parallel++) {
                struct cranny_depth_layout l = {.kind = CRANNY_DEPTH_VIEW_Z};
                check_wrong((enum scene)scene, parallel, size, &l, "depth-negative");
                l = (struct cranny_depth_layout){
                    .kind = CRANNY_DEPTH_NORMALIZED, .near_plane = 0.1f, .far_plane = 100};
                if (scene == STREET)
                    check_wrong((enum scene)scene, parallel, size, &l, "depth-normalized");
                l.reversed = true;
                if (scene == STREET && parallel)
                    check_wrong((enum scene)scene, parallel, size, &l, "depth-reversed");
                /* a parallel view of the hall shows flat depth and spheres: nothing to go by */
                for (int k = 0; k < 4 && scene != BALLS && !(scene == HALL && parallel); k++) {
                    l = (struct cranny_depth_layout){.kind = CRANNY_DEPTH_LOGARITHMIC,
                                                     .far_plane = k & 1 ? 1000 : 1e6f,
                                                     .log_constant = 1,
                                                     .reversed = k & 2};
                    check_wrong((enum scene)scene, parallel, size, &l, "depth-logarithmic");
                }
            }
}

/* Linear metres that came out of 16 bits, or of half floats. */
static void coarsen(struct picture *p, bool halves, float near_plane)
{
    const struct cranny_depth_layout l = {.kind = CRANNY_DEPTH_DEVICE,
                                          .near_plane = near_plane,
                                          .far_plane = 100,
                                          .format = CRANNY_DEPTH_UNORM16};
    const int count = p->width * p->height;
    uint16_t *stored = malloc(sizeof *stored * (size_t)count);
    struct cranny_error why = {0};
    for (int i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &p->depth[i], 4);
        bits = (bits + 0x1000) & ~0x1fffu;
        stored[i] = (uint16_t)lrint((double)cranny_depth_encode(&l, p->depth[i]) * 65535);
        if (halves)
            memcpy(&p->depth[i], &bits, 4);
    }
    if (!halves)
        CHECK_OK(cranny_depth_linearize(&l, p->width, p->height, stored, 0, p->depth, 0, &why),
                 why);
    free(stored);
}

static void test_steps(void)
{
    for (int k = 0; k < 2 * SCENES; k++) {
        struct picture p = make((enum scene)(k / 2), false, 1, 640, 360);
        coarsen(&p, k & 1, 0.1f);
        const struct cranny_gbuffer g = frame_of(&p);
        struct cranny_depth_advice advice;
        const struct said said = ask(&g, &advice);
        EXPECT(said, "depth-steps", "%s, %s", scene_names[k / 2], k & 1 ? "halves" : "16 bits");
        CHECK_MSG(said.errors == 0 && said.warnings == 1, "%s: %s", scene_names[k / 2], said.texts);
        /* a step of device depth at depth d is d² / near of the value's, within a factor */
        const double d = (double)advice.depth_median, step = k & 1 ? d / 2048 : d * d / 6553.5;
        CHECK_MSG((double)advice.bias > 0.7 * step && (double)advice.bias < 8 * step,
                  "%s: bias %g for steps of %g", scene_names[k / 2], (double)advice.bias, step);
        drop(&p);
    }
}

/* Normals are right though depth is too coarse to show them from pixel to pixel. */
static void test_coarse_normals(void)
{
    struct picture p = make(ROOM, false, 1, 640, 360);
    coarsen(&p, false, 0.01f);
    const struct cranny_gbuffer g = frame_of(&p);
    const struct said said = ask(&g, NULL);
    CHECK_MSG(!strcmp(said.codes, "depth-steps,"), "%s", said.texts);
    drop(&p);
}

/* No sky, and near things at the top: values near 1 still tell what is far. */
static void test_upside_down(void)
{
    for (int reversed = 0; reversed < 2; reversed++) {
        struct picture p = make(ROOM, false, 1, 200, 150);
        const struct cranny_depth_layout l = {.kind = CRANNY_DEPTH_DEVICE,
                                              .near_plane = 0.1f,
                                              .far_plane = 100,
                                              .reversed = reversed};
        encode(&p, &l);
        for (int i = 0; i < p.width * p.height / 2; i++) {
            const int j = p.width * (p.height - 1 - i / p.width) + i % p.width;
            const float kept = p.depth[i];
            p.depth[i] = p.depth[j];
            p.depth[j] = kept;
        }
        const struct cranny_gbuffer g = frame_of(&p);
        const struct said said = ask(&g, NULL);
        EXPECT(said, reversed ? "depth-reversed" : "depth-device", "a room upside down");
        drop(&p);
    }
}

/* Few bits of true metres below 1: coarse, but no other convention. */
static void test_coarse_linear(void)
{
    for (int k = 0; k < 2 * SCENES; k++) {
        struct picture p =
            make((enum scene)(k / 2), false, k / 2 == STREET ? 0.01 : 0.08, 480, 270);
        const double levels = k & 1 ? 65535 : 255;
        for (int i = 0; i < p.width * p.height; i++)
            p.depth[i] = (float)(nearbyint((double)p.depth[i] * levels) / levels);
        const struct cranny_gbuffer g = frame_of(&p);
        const struct said said = ask(&g, NULL);
        CHECK_MSG(!said.errors, "%s, %g levels: %s", scene_names[k / 2], levels, said.texts);
        drop(&p);
    }
}

/* View z is understood well enough to go on with. */
static void test_view_z(void)
{
    struct picture p = make(ROOM, false, 1, 200, 150);
    struct cranny_depth_advice right, negative;
    const struct cranny_gbuffer g = frame_of(&p);
    ask(&g, &right);
    for (int i = 0; i < p.width * p.height; i++) {
        p.depth[i] *= -1;
        p.normal[3 * i + 1] *= -1;
    }
    const struct said said = ask(&g, &negative);
    EXPECT(said, "depth-negative", "view z");
    EXPECT(said, "normal-axis", "view z and y flipped");
    CHECK_NEAR((double)negative.depth_median, (double)right.depth_median, 1e-3);
    CHECK_NEAR((double)negative.depth_near, (double)right.depth_near, 1e-3);
    drop(&p);
}

static void test_scale(void)
{
    const double scales[] = {1e-4, 2e5};
    for (int k = 0; k < 2; k++) {
        struct picture p = make(STREET, false, scales[k], 200, 150);
        const struct cranny_gbuffer g = frame_of(&p);
        const struct said said = ask(&g, NULL);
        EXPECT(said, "depth-scale", "scale %g", scales[k]);
        CHECK_MSG(!said.errors, "%s", said.texts);
        drop(&p);
    }
    struct picture p = make(ROOM, false, 1, 200, 150);
    for (int i = 0; i < p.width * p.height; i++)
        p.depth[i] = rintf(p.depth[i] * 1000);
    const struct cranny_gbuffer g = frame_of(&p);
    const struct said said = ask(&g, NULL);
    EXPECT(said, "depth-scale", "millimetres in whole numbers");
    drop(&p);
}

static void test_values(void)
{
    struct picture p = make(STREET, false, 1, 200, 150);
    struct cranny_gbuffer g = frame_of(&p);
    const int count = p.width * p.height;
    struct said said;
    p.depth[700] = p.depth[9000] = NAN;
    said = ask(&g, NULL);
    EXPECT(said, "depth-nan", "two NaN");
    CHECK_INT(said.errors, 0);
    p.depth[700] = -3;
    said = ask(&g, NULL);
    EXPECT(said, "depth-negative", "one negative");
    CHECK_INT(said.errors, 0);
    for (int i = 0; i < count; i++)
        if (isinf(p.depth[i]))
            p.depth[i] = 1000;
    said = ask(&g, NULL);
    EXPECT(said, "depth-sky", "sky of 1000");
    const float cleared[] = {NAN, INFINITY, 0, 1};
    for (int k = 0; k < 4; k++) {
        struct cranny_depth_advice advice;
        for (int i = 0; i < count; i++)
            p.depth[i] = cleared[k];
        said = ask(&g, &advice);
        EXPECT(said, "depth-empty", "all %g", (double)cleared[k]);
        CHECK(advice.radius_world == 0);
    }
    drop(&p);
}

static void test_projection(void)
{
    for (int scene = 0; scene < SCENES; scene++) {
        if (scene == BALLS)
            continue;
        struct picture p = make((enum scene)scene, false, 1, 640, 360);
        struct picture q = make((enum scene)scene, true, 1, 640, 360);
        struct cranny_gbuffer g = frame_of(&p);
        g.projection = q.projection;
        struct said said = ask(&g, NULL);
        EXPECT(said, "projection-kind", "%s: perspective called parallel", scene_names[scene]);
        g = frame_of(&q);
        g.projection = p.projection;
        said = ask(&g, NULL);
        if (scene != HALL)
            EXPECT(said, "projection-kind", "%s: parallel called perspective", scene_names[scene]);
        g = frame_of(&p);
        g.projection = (struct cranny_projection){0};
        said = ask(&g, NULL);
        EXPECT(said, "projection-assumed", "%s", scene_names[scene]);
        EXPECT_QUIET(said, "%s: 60 degrees for 57", scene_names[scene]);
        drop(&p);
        drop(&q);
    }
}

/* ---- wrong normals ---- */

static void map_normals(struct picture *p, double m[3][3])
{
    for (int i = 0; i < p->width * p->height; i++) {
        float *n = p->normal + 3 * i;
        const double v[3] = {(double)n[0], (double)n[1], (double)n[2]};
        for (int k = 0; k < 3; k++)
            n[k] = (float)dot(m[k], v);
    }
}

static void check_mapped(enum scene scene, bool parallel, int size, double m[3][3],
                         const char *code, const char *recipe)
{
    struct picture p = make(scene, parallel, 1, sizes[size].width, sizes[size].height);
    map_normals(&p, m);
    const struct cranny_gbuffer g = frame_of(&p);
    const struct said said = ask(&g, NULL);
    EXPECT(said, code, "%s, parallel %d, %d wide, wants %s", scene_names[scene], parallel, p.width,
           recipe);
    CHECK_MSG(strstr(said.texts, recipe), "%s: wanted '%s' in:%s", scene_names[scene], recipe,
              said.texts);
    CHECK_INT(said.errors + said.warnings, 1);
    drop(&p);
}

static void test_axes(void)
{
    const struct {
        const char *code, *recipe;
        double m[3][3];
    } changes[] = {
        {"normal-sign", "negate", {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}},
        {"normal-axis", "(-x, y, z)", {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
        {"normal-axis", "(x, -y, z)", {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}}},
        {"normal-axis", "(x, y, -z)", {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}},
        {"normal-axis", "(x, -y, -z)", {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}},
        {"normal-axis", "(x, z, y)", {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}}},
        {"normal-world", "(x, z, -y)", {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}},
        {"normal-world", "(z, x, y)", {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}},
    };
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++)
        for (int k = 0; k < 6; k++) {
            double m[3][3];
            memcpy(m, changes[i].m, sizeof m);
            check_mapped((enum scene)(k % 3), k / 3, (int)(i + (size_t)k) % 3, m, changes[i].code,
                         changes[i].recipe);
        }
}

static void test_world(void)
{
    for (int k = 0; k < 12; k++) {
        const enum scene scene = (enum scene)(k % 3);
        const bool parallel = k / 3 % 2, given = k / 6;
        struct picture p = make(scene, parallel, 1, 200, 150);
        double m[3][3];
        for (int i = 0; i < 9; i++)
            m[i / 3][i % 3] = p.world_from_view[4 * (i / 3) + i % 3];
        map_normals(&p, m);
        struct cranny_gbuffer g = frame_of(&p);
        g.world_from_view = given ? p.world_from_view : NULL;
        struct said said = ask(&g, NULL);
        EXPECT(said, "normal-world", "%s, parallel %d", scene_names[scene], parallel);
        CHECK_INT(said.errors + said.warnings, 1);
        CHECK(!strstr(said.texts, "world_from_view") == !given);
        /* the same in a left-handed world */
        double mirror[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
        map_normals(&p, mirror);
        g.world_from_view = NULL;
        said = ask(&g, NULL);
        EXPECT(said, "normal-world", "%s, parallel %d, left-handed", scene_names[scene], parallel);
        CHECK(strstr(said.texts, "mirror"));
        drop(&p);
    }
}

static void test_normal_values(void)
{
    struct picture p = make(STREET, false, 1, 200, 150);
    struct cranny_gbuffer g = frame_of(&p);
    const int count = 3 * p.width * p.height;
    float *kept = malloc(sizeof(float) * (size_t)count);
    memcpy(kept, p.normal, sizeof(float) * (size_t)count);
    struct said said;
    for (int i = 0; i < count; i++)
        p.normal[i] = 0.5f * kept[i] + 0.5f;
    said = ask(&g, NULL);
    EXPECT(said, "normal-range", "0 ... 1");
    CHECK_MSG(said.errors == 1 && !said.warnings, "%s", said.texts);
    for (int i = 0; i < count; i++)
        p.normal[i] = 0.6f * kept[i];
    said = ask(&g, NULL);
    EXPECT(said, "normal-length", "too short");
    CHECK_INT(said.errors, 0);
    memcpy(p.normal, kept, sizeof(float) * (size_t)count);
    for (int i = count / 2; i < count / 2 + 300; i++)
        p.normal[i] = NAN;
    said = ask(&g, NULL);
    EXPECT(said, "normal-nan", "some");
    CHECK_INT(said.errors, 0);
    for (int i = 0; i < count; i++)
        p.normal[i] = i % 3 == 2;
    said = ask(&g, NULL);
    EXPECT(said, "normal-constant", "all 0 0 1");
    memset(p.normal, 0, sizeof(float) * (size_t)count);
    said = ask(&g, NULL);
    EXPECT(said, "normal-empty", "all zero");
    CHECK_INT(said.errors, 0);
    for (int i = 0; i < count; i++) {
        const int row = i / (3 * p.width);
        p.normal[i] = kept[(p.height - 1 - row) * 3 * p.width + i % (3 * p.width)];
    }
    said = ask(&g, NULL);
    EXPECT(said, has(&said, "normal-rows") ? "normal-rows" : "normal-mismatch", "upside down");
    for (int i = 0; i < count / 3; i++) {
        const double z = random_in(-1, 1), a = random_in(0, 6.28318), r = sqrt(1 - z * z);
        p.normal[3 * i] = (float)(r * cos(a));
        p.normal[3 * i + 1] = (float)(r * sin(a));
        p.normal[3 * i + 2] = (float)z;
    }
    said = ask(&g, NULL);
    EXPECT(said, "normal-mismatch", "random");
    CHECK_INT(said.errors, 0);
    free(kept);
    drop(&p);
}

/* Right and wrong formats of 8 bits. */
static void test_formats(void)
{
    struct picture p = make(ROOM, false, 1, 200, 150);
    struct cranny_gbuffer g = frame_of(&p);
    unsigned char *bytes = calloc((size_t)p.width * (size_t)p.height, 16);
    for (int f = CRANNY_NORMAL_FLOAT3; f <= CRANNY_NORMAL_OCT8; f++) {
        g.normal = bytes;
        g.normal_format = (enum cranny_normal_format)f;
        for (int i = 0; i < p.width * p.height; i++)
            cranny_normal_encode(g.normal_format, p.normal + 3 * i,
                                 bytes + (size_t)i * cranny_normal_bytes(g.normal_format));
        struct said said = ask(&g, NULL);
        EXPECT_QUIET(said, "format %d", f);
        if (f != CRANNY_NORMAL_SNORM8 && f != CRANNY_NORMAL_UNORM8)
            continue;
        g.normal_format = f == CRANNY_NORMAL_SNORM8 ? CRANNY_NORMAL_UNORM8 : CRANNY_NORMAL_SNORM8;
        said = ask(&g, NULL);
        EXPECT(said, "normal-range", "format %d read as the other", f);
    }
    free(bytes);
    drop(&p);
}

/* One back face in ten. */
static void test_back_faces(void)
{
    struct picture p = make(BALLS, false, 1, 640, 360);
    for (int i = 0; i < p.width * p.height; i++)
        for (int k = 0; k < 3 && i / 8 % 10 == 0; k++)
            p.normal[3 * i + k] *= -1;
    const struct cranny_gbuffer g = frame_of(&p);
    const struct said said = ask(&g, NULL);
    EXPECT(said, "normal-sign", "a tenth turned");
    CHECK_INT(said.errors, 0);
    drop(&p);
}

/* ---- advice, viewports, refusals ---- */

static void test_advice(void)
{
    struct picture p = make(ROOM, false, 1, 640, 360);
    struct cranny_gbuffer g = frame_of(&p);
    struct cranny_depth_advice a;
    ask(&g, &a);
    CHECK(a.depth_near > 0 && a.depth_near < a.depth_median && a.depth_median < a.depth_far);
    const double height = (double)(p.projection.top - p.projection.bottom);
    CHECK_NEAR((double)a.radius_world, 0.1 * height * (double)a.depth_median, 1e-4);
    /* at fade_end the radius is one pixel */
    CHECK_NEAR((double)a.radius_world, (double)a.fade_end * height / 360, 1e-4);
    CHECK_NEAR((double)a.fade_end, 4 * (double)a.fade_begin, 1e-3);
    CHECK_MSG(a.bias > 0 && a.bias < 1e-3f * a.depth_median, "%g", (double)a.bias);
    drop(&p);
    p = make(ROOM, true, 1, 640, 360);
    g = frame_of(&p);
    ask(&g, &a);
    CHECK_NEAR((double)a.radius_world, 0.4, 1e-5);
    CHECK(isinf(a.fade_begin) && isinf(a.fade_end));
    drop(&p);
}

/* Rubbish around the viewport is not seen, and padded rows are followed. */
static void test_viewport(void)
{
    enum { ROW = 260, ROWS = 200, X = 30, Y = 20 };
    struct picture p = make(STREET, false, 1, 200, 150);
    float *depth = malloc(sizeof(float) * ROW * ROWS),
          *normal = malloc(3 * sizeof(float) * ROW * ROWS);
    for (int i = 0; i < ROW * ROWS; i++) {
        const int x = i % ROW - X, y = i / ROW - Y;
        const bool in = x >= 0 && y >= 0 && x < p.width && y < p.height;
        depth[i] = in ? p.depth[y * p.width + x] : NAN;
        for (int k = 0; k < 3; k++)
            normal[3 * i + k] = in ? p.normal[3 * (y * p.width + x) + k] : NAN;
    }
    struct cranny_gbuffer g = {.width = 250,
                               .height = ROWS,
                               .depth = depth,
                               .depth_stride = ROW * sizeof(float),
                               .normal = normal,
                               .normal_stride = 3 * ROW * sizeof(float),
                               .projection = p.projection,
                               .viewport = {X, Y, 200, 150}};
    const struct said said = ask(&g, NULL);
    EXPECT_QUIET(said, "a viewport in rubbish");
    g.viewport.x = 60;
    struct cranny_error why = {0};
    CHECK_INT(cranny_gbuffer_check(&g, listen, NULL, NULL, &why), CRANNY_USAGE);
    free(depth);
    free(normal);
    drop(&p);
}

static void test_tiny(void)
{
    const float one = 3, normal[3] = {0, 0, 1};
    const struct cranny_gbuffer g = {.width = 1,
                                     .height = 1,
                                     .depth = &one,
                                     .normal = normal,
                                     .projection = cranny_perspective(1, 1)};
    const struct said said = ask(&g, NULL);
    EXPECT_QUIET(said, "one pixel");
    struct cranny_error why = {0};
    CHECK_OK(cranny_gbuffer_check(&g, NULL, NULL, NULL, &why), why);
}

int main(void)
{
    test_quiet();
    test_wrong_perspective();
    test_wrong_others();
    test_steps();
    test_coarse_normals();
    test_upside_down();
    test_coarse_linear();
    test_view_z();
    test_scale();
    test_values();
    test_projection();
    test_axes();
    test_world();
    test_normal_values();
    test_formats();
    test_back_faces();
    test_advice();
    test_viewport();
    test_tiny();
    return check_end("doctor");
}
