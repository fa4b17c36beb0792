/* Worlds, cameras and frames of the conformance suite. */
#include "conformance/conformance.h"

static void build_wall(struct analytic *w)
{
    add_plane(w, 0, 0, 0, 0, 1, 0);
    add_plane(w, 0, 0, 0, 0, 0, 1);
}

static void build_room(struct analytic *w)
{
    build_wall(w);
    add_plane(w, 0, 0, 0, 1, 0, 0);
}

/* Two slopes that meet at 60°. */
static void build_gully(struct analytic *w)
{
    const double c = sqrt(0.75);
    add_plane(w, 0, 0, 0, c, 0.5, 0);
    add_plane(w, 0, 0, 0, -c, 0.5, 0);
}

static void build_ball(struct analytic *w)
{
    add_plane(w, 0, 0, 0, 0, 1, 0);
    add_sphere(w, 0, 0.5, 0, 0.5);
}

static void build_step(struct analytic *w)
{
    add_plane(w, 0, 0, 0, 0, 1, 0);
    add_box(w, 0, 0.25, 0, 0.6, 0.25, 0.5);
}

static void build_court(struct analytic *w)
{
    add_plane(w, 0, 0, 0, 0, 1, 0);
    add_plane(w, 0, 0, -1, 0.3, 0, 1);
    add_box(w, -0.7, 0.3, -0.3, 0.3, 0.3, 0.25);
    add_box(w, 0.1, 0.12, 0.4, 0.2, 0.12, 0.2);
    add_sphere(w, 0.6, 0.35, 0, 0.35);
    add_sphere(w, 0.1, 0.34, 0.4, 0.1);
}

static void build_halo(struct analytic *w)
{
    add_plane(w, 0, 0, -4, 0, 0, 1);
    add_sphere(w, 0, 0, 0, 0.5);
}

const struct scene_of_test scenes[SCENE_COUNT] = {
    [SCENE_WALL] = {"wall",
                    "a floor and an endless wall",
                    build_wall,
                    {{0.5, 1.2, 2.6}, {0, 0.5, 0}},
                    0.5,
                    ROW_WALL_RMS},
    [SCENE_ROOM] = {"room",
                    "the corner of a room",
                    build_room,
                    {{1.7, 1.5, 1.9}, {0.2, 0.35, 0.2}},
                    0.5,
                    ROW_ROOM_RMS},
    [SCENE_GULLY] = {"gully",
                     "two slopes that meet at 60°",
                     build_gully,
                     {{0.1, 2.6, 1.2}, {0, 0.3, 0}},
                     0.5,
                     ROW_GULLY_RMS},
    [SCENE_BALL] =
        {"ball", "a ball on a floor", build_ball, {{0, 1.6, 2.4}, {0, 0.3, 0}}, 0.5, ROW_BALL_RMS},
    [SCENE_STEP] =
        {"step", "a box on a floor", build_step, {{1, 1.6, 2}, {0, 0.15, 0}}, 0.5, ROW_STEP_RMS},
    [SCENE_COURT] = {"court",
                     "boxes and balls before a wall",
                     build_court,
                     {{0.3, 1.4, 2.4}, {0, 0.3, 0}},
                     0.5,
                     ROW_COURT_RMS},
    [SCENE_HALO] =
        {"halo", "a ball far before a wall", build_halo, {{0, 0, 2.5}, {0, 0, 0}}, 0.5, ROW_COUNT},
};

struct cranny_projection usual_lens(void)
{
    return cranny_perspective(0.9f, (float)TILE_WIDTH / TILE_HEIGHT);
}

struct view scene_view(int scene)
{
    struct analytic world = {0};
    scenes[scene].build(&world);
    return view_make(&world, &scenes[scene].camera, usual_lens(), TILE_WIDTH, TILE_HEIGHT);
}

static void unit(double v[3])
{
    const double length = sqrt(dot_of(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static void cross_of(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* Right, up and backwards. */
static void camera_axes(const struct camera *camera, double axes[3][3])
{
    const double up[3] = {0, 1, 0};
    for (int i = 0; i < 3; i++)
        axes[2][i] = camera->eye[i] - camera->target[i];
    unit(axes[2]);
    cross_of(up, axes[2], axes[0]);
    unit(axes[0]);
    cross_of(axes[2], axes[0], axes[1]);
}

static void turn(const double axes[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = dot_of(axes[i], v);
}

static void shape_into(const struct view *view, const struct shape *in, struct shape *out)
{
    double from_eye[3];
    *out = *in;
    for (int i = 0; i < 3; i++)
        from_eye[i] = in->point[i] - view->eye[i];
    turn(view->axes, from_eye, out->point);
    turn(view->axes, in->normal, out->normal);
    for (int i = 0; i < 3; i++)
        turn(view->axes, in->axes[i], out->axes[i]);
}

float *floats(size_t count)
{
    float *memory = calloc(count, sizeof(float));
    if (!memory) {
        fprintf(stderr, "no memory for %zu floats\n", count);
        exit(1);
    }
    return memory;
}

struct view view_make(const struct analytic *world, const struct camera *camera,
                      struct cranny_projection lens, int width, int height)
{
    struct view view = {.lens = lens, .width = width, .height = height};
    memcpy(view.eye, camera->eye, sizeof view.eye);
    camera_axes(camera, view.axes);
    view.scene.count = world->count;
    for (int i = 0; i < world->count; i++)
        shape_into(&view, &world->shapes[i], &view.scene.shapes[i]);
    const size_t pixels = (size_t)width * (size_t)height;
    view.depth = floats(pixels);
    view.normals = (float(*)[3])floats(3 * pixels);
    view.frame = analytic_frame(&view.scene, width, height, lens, view.depth, view.normals);
    return view;
}

void view_free(struct view *view)
{
    free(view->depth);
    free(view->normals);
    *view = (struct view){0};
}

void view_point(const struct view *view, int x, int y, double p[3])
{
    const struct cranny_projection *l = &view->lens;
    const double depth = (double)view->depth[y * view->width + x];
    const double w = l->kind == CRANNY_ORTHOGRAPHIC ? 1 : depth;
    p[0] = w * (l->left + (x + 0.5) / view->width * ((double)l->right - l->left));
    p[1] = w * (l->top + (y + 0.5) / view->height * ((double)l->bottom - l->top));
    p[2] = -depth;
}

void view_world(const struct view *view, const double p[3], double world[3])
{
    for (int i = 0; i < 3; i++)
        world[i] = view->eye[i] + p[0] * view->axes[0][i] + p[1] * view->axes[1][i] +
                   p[2] * view->axes[2][i];
}

void view_project(const struct view *view, const double world[3], double *x, double *y, double *z)
{
    const struct cranny_projection *l = &view->lens;
    double from_eye[3], p[3];
    for (int i = 0; i < 3; i++)
        from_eye[i] = world[i] - view->eye[i];
    turn(view->axes, from_eye, p);
    const double w = l->kind == CRANNY_ORTHOGRAPHIC ? 1 : -p[2];
    *x = (p[0] / w - l->left) / ((double)l->right - l->left) * view->width - 0.5;
    *y = (p[1] / w - l->top) / ((double)l->bottom - l->top) * view->height - 0.5;
    *z = -p[2];
}

bool view_counts(const struct view *view, int x, int y, double far)
{
    return x >= MARGIN && y >= MARGIN && x < view->width - MARGIN && y < view->height - MARGIN &&
           (double)view->depth[y * view->width + x] < far;
}

/* Whether any part of a shape is within `reach` of a point. */
static bool shape_near(const struct shape *s, const double p[3], double reach)
{
    double v[3], outside = 0;
    for (int i = 0; i < 3; i++)
        v[i] = p[i] - s->point[i];
    if (s->radius > 0)
        return sqrt(dot_of(v, v)) < s->radius + reach;
    if (s->half[0] <= 0)
        return fabs(dot_of(v, s->normal)) < reach;
    for (int i = 0; i < 3; i++) {
        const double d = fmax(0, fabs(dot_of(v, s->axes[i])) - s->half[i]);
        outside += d * d;
    }
    return outside < reach * reach;
}

double truth_at(const struct analytic *scene, const double p[3], const double n[3], double radius,
                int side)
{
    struct analytic near = {0};
    for (int i = 0; i < scene->count; i++)
        if (shape_near(&scene->shapes[i], p, radius))
            near.shapes[near.count++] = scene->shapes[i];
    /* All shapes are convex: one alone hides nothing of itself. */
    return near.count < 2 ? 1 : analytic_visibility(&near, p, n, radius, side);
}

float *view_truth(const struct view *view, double radius, int side)
{
    float *truth = floats((size_t)view->width * (size_t)view->height);
#pragma omp parallel for schedule(dynamic, 4)
    for (int y = 0; y < view->height; y++)
        for (int x = 0; x < view->width; x++) {
            const int i = y * view->width + x;
            double p[3], n[3];
            truth[i] = 1;
            if (!isfinite(view->depth[i]))
                continue;
            view_point(view, x, y, p);
            for (int k = 0; k < 3; k++)
                n[k] = (double)view->normals[i][k];
            /* Off the surface by more than the depth's rounding. */
            for (int k = 0; k < 3; k++)
                p[k] += 1e-6 * (double)view->depth[i] * n[k];
            truth[i] = (float)truth_at(&view->scene, p, n, radius, side);
        }
    return truth;
}

struct cranny_screen_params method_params(int method, const char *preset, double radius)
{
    struct cranny_screen_params params =
        cranny_screen_params_preset((enum cranny_method)method, preset);
    params.radius_world = (float)radius;
    return params;
}

float *render(const struct cranny_gbuffer *frame, const struct cranny_screen_params *params)
{
    struct cranny_error why;
    const struct cranny_rect *v = &frame->viewport;
    const int width = v->width ? v->width : frame->width;
    const int height = v->height ? v->height : frame->height;
    float *visibility = floats((size_t)width * (size_t)height);
    CHECK_OK(cranny_screen_render(frame, params, visibility, 0, &why), why);
    return visibility;
}

float *render_view(const struct view *view, int method, double radius)
{
    const struct cranny_screen_params params = method_params(method, NULL, radius);
    return render(&view->frame, &params);
}

float *render_mean(const struct view *view, struct cranny_screen_params params, int count)
{
    const size_t pixels = (size_t)view->width * (size_t)view->height;
    float *mean = floats(pixels);
    params.filter = CRANNY_FILTER_NONE;
    for (int seed = 0; seed < count; seed++) {
        params.seed = seed;
        float *one = render(&view->frame, &params);
        for (size_t i = 0; i < pixels; i++)
            mean[i] += one[i] / (float)count;
        free(one);
    }
    return mean;
}
