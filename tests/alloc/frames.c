/* Failing allocations in screen space, and in a fit to it. */
#include "alloc/stages.h"

#include "check.h"

#include <cranny/filter.h>
#include <cranny/tune.h>

enum { WIDTH = 37, HEIGHT = 29, PIXELS = WIDTH * HEIGHT, SAMPLES = 2 };

static float depth[SAMPLES * PIXELS];

static struct cranny_gbuffer frame_of(int samples)
{
    for (int i = 0; i < SAMPLES * PIXELS; i++) {
        const int x = i % WIDTH, y = i / WIDTH % HEIGHT;
        depth[i] = y < 4 ? INFINITY : x > 20 ? 3 : 4 + 0.01f * (float)(x + i / PIXELS);
    }
    return (struct cranny_gbuffer){.width = WIDTH,
                                   .height = HEIGHT,
                                   .depth = depth,
                                   .sample_count = samples,
                                   .projection = cranny_perspective(1, (float)WIDTH / HEIGHT)};
}

static enum cranny_status stage_render(const struct context *with, struct cranny_error *why)
{
    float visibility[PIXELS];
    const struct cranny_gbuffer frame = frame_of(1);
    enum cranny_status status = cranny_screen_render(&frame, with->screen, visibility, 0, why);
    if (status == CRANNY_OK)
        fold(with, visibility, sizeof visibility);
    return status;
}

static enum cranny_status stage_samples(const struct context *with, struct cranny_error *why)
{
    float visibility[SAMPLES * PIXELS];
    const struct cranny_gbuffer frame = frame_of(SAMPLES);
    enum cranny_status status =
        cranny_screen_render_samples(&frame, with->screen, visibility, 0, why);
    if (status == CRANNY_OK)
        fold(with, visibility, sizeof visibility);
    return status;
}

/* One workspace for two frames, the second one larger; a refusal in between must not harm it. */
static enum cranny_status stage_workspace(const struct context *with, struct cranny_error *why)
{
    float visibility[PIXELS];
    struct cranny_screen_params params = *with->screen;
    enum cranny_status status = cranny_workspace_create(&params.workspace, why);
    for (int i = 0; i < 2 && params.workspace; i++) {
        struct cranny_gbuffer frame = frame_of(1);
        frame.height = i ? HEIGHT : 10;
        const enum cranny_status once = cranny_screen_render(&frame, &params, visibility, 0, why);
        status = status == CRANNY_OK ? once : status;
    }
    if (status == CRANNY_OK)
        fold(with, visibility, sizeof visibility);
    cranny_workspace_destroy(&params.workspace);
    return status;
}

static enum cranny_status stage_normals(const struct context *with, struct cranny_error *why)
{
    float normals[PIXELS][3];
    const struct cranny_gbuffer frame = frame_of(1);
    enum cranny_status status = cranny_normals_reconstruct(&frame, 1, normals[0], 0, why);
    if (status == CRANNY_OK)
        fold(with, normals, sizeof normals);
    return status;
}

static enum cranny_status stage_filters(const struct context *with, struct cranny_error *why)
{
    float out[PIXELS];
    struct cranny_edges *edges;
    const struct cranny_gbuffer frame = frame_of(1);
    struct cranny_filter_params params = cranny_filter_params_default();
    params.threads = 1;
    enum cranny_status status = cranny_edges_create(&frame, &params, &edges, why);
    CHECK((status == CRANNY_OK) == (edges != NULL));
    if (status == CRANNY_OK)
        status = cranny_filter_bilateral(edges, &params, depth, 0, out, 0, why);
    if (status == CRANNY_OK)
        status = cranny_filter_box4(edges, &params, out, 0, out, 0, why);
    for (int within = 0; within < 2 && status == CRANNY_OK; within++) {
        params.edge_bloom = within;
        status = cranny_filter_bloom(edges, &params, out, 0, out, 0, why);
    }
    if (status == CRANNY_OK)
        fold(with, out, sizeof out);
    if (status == CRANNY_OK)
        status = cranny_filter_upsample(edges, &params, depth, 0, out, 0, why);
    if (status == CRANNY_OK)
        fold(with, out, sizeof out);
    cranny_edges_destroy(&edges);
    return status;
}

/* After a refusal the edges hold no frame; the next update is as good as new. */
static enum cranny_status stage_update(const struct context *with, struct cranny_error *why)
{
    float out[PIXELS];
    struct cranny_edges *edges;
    struct cranny_error other;
    struct cranny_gbuffer frame = frame_of(1);
    frame.height = 10;
    enum cranny_status status = cranny_edges_create(&frame, NULL, &edges, why);
    if (status != CRANNY_OK)
        return status;
    frame.height = HEIGHT;
    status = cranny_edges_update(edges, &frame, NULL, why);
    if (status != CRANNY_OK)
        CHECK_INT(cranny_filter_box4(edges, NULL, depth, 0, out, 0, &other), CRANNY_USAGE);
    else
        status = cranny_filter_box4(edges, NULL, depth, 0, out, 0, why);
    if (status == CRANNY_OK)
        fold(with, out, sizeof out);
    cranny_edges_destroy(&edges);
    return status;
}

static enum cranny_status draw(void *user, size_t view, const void *params, float *visibility,
                               struct cranny_error *why)
{
    const struct cranny_gbuffer frame = frame_of(1);
    (void)user;
    (void)view;
    return cranny_screen_render(&frame, params, visibility, 0, why);
}

/* A fit of a few steps to a grey truth. */
static enum cranny_status stage_fit(const struct context *with, struct cranny_error *why)
{
    static float truth[PIXELS];
    struct cranny_screen_params begin = cranny_screen_params_preset(CRANNY_CREASE, NULL), fitted;
    const struct cranny_tune_view views[2] = {{WIDTH, HEIGHT, truth, 1, false},
                                              {WIDTH, HEIGHT, truth, 1, true}};
    const struct cranny_tune_problem problem = {.table = cranny_screen_param_table(CRANNY_CREASE),
                                                .params_size = sizeof begin,
                                                .params = &begin,
                                                .views = views,
                                                .view_count = 2,
                                                .draw = draw};
    const struct cranny_tune_params params = {5, NULL};
    begin.threads = 1;
    for (int i = 0; i < PIXELS; i++)
        truth[i] = 0.5f;
    const enum cranny_status status = cranny_tune(&problem, &params, &fitted, NULL, NULL, why);
    if (status == CRANNY_OK)
        fold(with, &fitted.intensity, sizeof fitted.intensity);
    return status;
}

static struct context context_of(const char *name, const char *folder, uint64_t *digest)
{
    struct context with = {.name = name, .digest = digest};
    snprintf(with.folder, sizeof with.folder, "%s", folder);
    return with;
}

static void sweep_method(enum cranny_method method, const char *folder)
{
    static const struct stage renders[] = {
        {"render", stage_render},
        {"render samples", stage_samples},
        {"render with a workspace", stage_workspace},
    };
    uint64_t digest;
    struct context with = context_of(cranny_method_name(method), folder, &digest);
    struct cranny_screen_params params = cranny_screen_params_preset(method, NULL);
    params.threads = 1;
    with.screen = &params;
    for (int resolution = 0; resolution < 2; resolution++)
        for (int filter = 0; filter <= CRANNY_FILTER_BLOOM; filter++) {
            params.resolution = resolution;
            params.filter = filter;
            if (filter == CRANNY_FILTER_BLOOM && method != CRANNY_CREASE)
                continue;
            for (size_t i = 0; i < sizeof renders / sizeof *renders; i++)
                sweep(&renders[i], &with);
        }
}

void sweep_frames(const char *folder)
{
    static const struct stage others[] = {
        {"normals", stage_normals},
        {"filters", stage_filters},
        {"edges anew", stage_update},
        {"fit", stage_fit},
    };
    uint64_t digest;
    const struct context with = context_of("frame", folder, &digest);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        sweep_method((enum cranny_method)m, folder);
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        sweep(&others[i], &with);
}
