/* Planes, and scenes whose truth rays give. */
#include "conformance/conformance.h"

static const double tilts[][3] = {{0, 0, 1},      {0, 1, 1},       {0, 1, 0.3},
                                  {0, -1, 0.3},   {1, 0, 1},       {-1, 0, 0.4},
                                  {1, 0.2, 0.1},  {0.3, 1, 0.15},  {-0.5, 0.5, 0.2},
                                  {0.7, -0.7, 1}, {-0.2, -1, 0.5}, {0.1, 0.05, 1}};

static const struct camera straight = {{0, 0, 0}, {0, 0, -1}};

/* Near the horizon a pixel covers metres. */
static double plane_darkening(const struct view *view, const float *visibility)
{
    double worst = 0;
    for (int y = 0; y < view->height; y++)
        for (int x = 0; x < view->width; x++)
            if (view_counts(view, x, y, 30))
                worst = fmax(worst, 1 - (double)visibility[y * view->width + x]);
    return worst;
}

static void measure_planes(void)
{
    for (size_t t = 0; t < sizeof tilts / sizeof *tilts; t++) {
        struct analytic world = {0};
        add_plane(&world, 0, -0.3, -3, tilts[t][0], tilts[t][1], tilts[t][2]);
        struct view view = view_make(&world, &straight, usual_lens(), TILE_WIDTH, TILE_HEIGHT);
        for (int k = 0; k < 4 * CRANNY_METHOD_COUNT; k++) {
            const int method = k / 4;
            const bool face = k & 1, paper = k & 2;
            const struct cranny_screen_params params =
                method_params(method, paper ? "paper" : NULL, 0.5);
            struct cranny_gbuffer frame = view.frame;
            frame.normal = face ? NULL : frame.normal;
            float *visibility = render(&frame, &params);
            record(face ? ROW_PLANE_FACE : ROW_PLANE_GIVEN, method, paper,
                   plane_darkening(&view, visibility));
            free(visibility);
        }
        view_free(&view);
    }
}

/* The rays' own check: at a crease all that a plane hides counts in full. */
static void check_truth(void)
{
    static const struct {
        int scene;
        double point[3], normal[3], open;
    } known[] = {
        {SCENE_WALL, {0, 0, 1e-6}, {0, 1, 0}, 0.5},
        {SCENE_ROOM, {1e-6, 0, 1e-6}, {0, 1, 0}, 0.25},
        {SCENE_GULLY, {-0.5e-6, 0.8660254037844386e-6, 0}, {0.8660254037844386, 0.5, 0}, 0.25},
        {SCENE_WALL, {0, 0, 0.6}, {0, 1, 0}, 1},
        {SCENE_HALO, {0, 0, -4}, {0, 0, 1}, 1},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        struct analytic world = {0};
        scenes[known[i].scene].build(&world);
        CHECK_NEAR(truth_at(&world, known[i].point, known[i].normal, 0.5, 64), known[i].open,
                   0.003);
    }
}

static void record_errors(const struct scene_of_test *scene, const struct view *view,
                          const float *truth, const float *visibility, int method, bool paper)
{
    double squares = 0, worst = 0;
    int count = 0;
    for (int y = 0; y < view->height; y++)
        for (int x = 0; x < view->width; x++) {
            const int i = y * view->width + x;
            if (!view_counts(view, x, y, 30))
                continue;
            const double error = fabs((double)visibility[i] - (double)truth[i]);
            squares += error * error;
            worst = fmax(worst, error);
            count++;
        }
    record(scene->rms, method, paper, sqrt(squares / count));
    record((enum row_id)(scene->rms + 1), method, paper, worst);
}

/* Darkening where the truth is open: of the far wall, and around the box. */
static void record_open(const struct view *view, const float *truth, const float *visibility,
                        int method, bool paper, enum row_id mean)
{
    double sum = 0, worst = 0;
    int count = 0;
    for (int y = 0; y < view->height; y++)
        for (int x = 0; x < view->width; x++) {
            const int i = y * view->width + x;
            if (!view_counts(view, x, y, 30) || truth[i] < 0.999f)
                continue;
            sum += 1 - (double)visibility[i];
            worst = fmax(worst, 1 - (double)visibility[i]);
            count++;
        }
    record(mean, method, paper, sum / count);
    record((enum row_id)(mean + 1), method, paper, worst);
}

static int sky_touched(const struct view *view, const float *visibility)
{
    int touched = 0;
    for (int i = 0; i < view->width * view->height; i++)
        touched += isinf(view->depth[i]) && visibility[i] != 1;
    return touched;
}

static void measure_scene(int index, const char *folder)
{
    const struct scene_of_test *scene = &scenes[index];
    struct view view = scene_view(index);
    float *pictures[1 + CRANNY_METHOD_COUNT];
    pictures[0] = view_truth(&view, scene->radius, 32);
    for (int k = 0; k < 2 * CRANNY_METHOD_COUNT; k++) {
        const int method = k / 2;
        const bool paper = k & 1;
        const struct cranny_screen_params params =
            method_params(method, paper ? "paper" : NULL, scene->radius);
        float *visibility = render(&view.frame, &params);
        if (scene->rms != ROW_COUNT)
            record_errors(scene, &view, pictures[0], visibility, method, paper);
        if (index == SCENE_HALO)
            record_open(&view, pictures[0], visibility, method, paper, ROW_HALO_MEAN);
        if (index == SCENE_STEP)
            record_open(&view, pictures[0], visibility, method, paper, ROW_EDGE_MEAN);
        record(ROW_SKY_TOUCHED, method, paper, sky_touched(&view, visibility));
        if (paper)
            free(visibility);
        else
            pictures[1 + method] = visibility;
    }
    strip_write(folder, scene->name, pictures, 1 + CRANNY_METHOD_COUNT, view.width, view.height);
    for (int i = 0; i <= CRANNY_METHOD_COUNT; i++)
        free(pictures[i]);
    view_free(&view);
}

/* A ball alone before the sky, and a floor up to its horizon: nothing hides anything. */
static void measure_sky(void)
{
    struct analytic ball = {0}, floor = {0};
    add_sphere(&ball, 0, 0, -3, 0.9);
    add_plane(&floor, 0, -1, 0, 0, 1, 0);
    struct view views[2];
    views[0] = view_make(&ball, &straight, usual_lens(), TILE_WIDTH, TILE_HEIGHT);
    views[1] = view_make(&floor, &straight, usual_lens(), TILE_WIDTH, TILE_HEIGHT);
    for (int k = 0; k < 4 * CRANNY_METHOD_COUNT; k++) {
        const int method = k / 4;
        const bool paper = k & 1;
        const struct view *view = &views[k / 2 % 2];
        const struct cranny_screen_params params =
            method_params(method, paper ? "paper" : NULL, 0.5);
        float *visibility = render(&view->frame, &params);
        record(ROW_SKY_TOUCHED, method, paper, sky_touched(view, visibility));
        record(ROW_SKY_BALL, method, paper, plane_darkening(view, visibility));
        free(visibility);
    }
    view_free(&views[0]);
    view_free(&views[1]);
}

void measure_forms(const char *folder)
{
    check_truth();
    measure_planes();
    for (int i = 0; i < SCENE_COUNT; i++)
        measure_scene(i, folder);
    measure_sky();
}
