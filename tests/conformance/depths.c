/* How depth and normals are stored must not change the picture. */
#include "conformance/conformance.h"

static const struct {
    enum row_id id;
    struct cranny_depth_layout layout;
} conventions[] = {
    {ROW_DEPTH_GL,
     {.kind = CRANNY_DEPTH_DEVICE, .gl_range = true, .near_plane = 0.1f, .far_plane = 100}},
    {ROW_DEPTH_D3D, {.kind = CRANNY_DEPTH_DEVICE, .near_plane = 0.1f, .far_plane = 100}},
    {ROW_DEPTH_REVERSED,
     {.kind = CRANNY_DEPTH_DEVICE, .reversed = true, .near_plane = 0.1f, .far_plane = 100}},
    {ROW_DEPTH_INFINITE,
     {.kind = CRANNY_DEPTH_DEVICE, .reversed = true, .near_plane = 0.1f, .far_plane = INFINITY}},
    {ROW_DEPTH_LOGARITHMIC,
     {.kind = CRANNY_DEPTH_LOGARITHMIC, .far_plane = 1000, .log_constant = 1}},
    {ROW_DEPTH_24,
     {.kind = CRANNY_DEPTH_DEVICE,
      .format = CRANNY_DEPTH_UNORM24,
      .near_plane = 0.1f,
      .far_plane = 100}},
    {ROW_DEPTH_16,
     {.kind = CRANNY_DEPTH_DEVICE,
      .format = CRANNY_DEPTH_UNORM16,
      .near_plane = 0.1f,
      .far_plane = 100}},
};

/* As a renderer stores it. */
static void encode(const struct cranny_depth_layout *layout, const float *depth, void *stored)
{
    for (int i = 0; i < TILE_PIXELS; i++) {
        const float value = cranny_depth_encode(layout, depth[i]);
        if (layout->format == CRANNY_DEPTH_UNORM24)
            ((uint32_t *)stored)[i] = 0xab000000u | (uint32_t)((double)value * 16777215 + 0.5);
        else if (layout->format == CRANNY_DEPTH_UNORM16)
            ((uint16_t *)stored)[i] = (uint16_t)((double)value * 65535 + 0.5);
        else
            ((float *)stored)[i] = value;
    }
}

static void record_difference(enum row_id id, int method, const float *expected,
                              const struct cranny_gbuffer *frame)
{
    const struct cranny_screen_params params = method_params(method, NULL, 0.5);
    float *other = render(frame, &params);
    double sum = 0;
    for (int i = 0; i < TILE_PIXELS; i++)
        sum += fabs((double)expected[i] - (double)other[i]);
    record(id, method, false, sum / TILE_PIXELS);
    free(other);
}

static void measure_conventions(const struct view *view, float *const *expected)
{
    float *stored = floats(TILE_PIXELS), *linear = floats(TILE_PIXELS);
    struct cranny_gbuffer frame = view->frame;
    struct cranny_error why;
    frame.depth = linear;
    for (size_t c = 0; c < sizeof conventions / sizeof *conventions; c++) {
        encode(&conventions[c].layout, view->depth, stored);
        CHECK_OK(cranny_depth_linearize(&conventions[c].layout, TILE_WIDTH, TILE_HEIGHT, stored, 0,
                                        linear, 0, &why),
                 why);
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
            record_difference(conventions[c].id, m, expected[m], &frame);
    }
    free(stored);
    free(linear);
}

static void measure_formats(const struct view *view, float *const *expected)
{
    static const struct {
        enum row_id id;
        enum cranny_normal_format format;
    } formats[] = {{ROW_SNORM8, CRANNY_NORMAL_SNORM8},
                   {ROW_UNORM8, CRANNY_NORMAL_UNORM8},
                   {ROW_OCT16, CRANNY_NORMAL_OCT16},
                   {ROW_OCT8, CRANNY_NORMAL_OCT8}};
    float *stored = floats(TILE_PIXELS);
    struct cranny_gbuffer frame = view->frame;
    for (size_t f = 0; f < sizeof formats / sizeof *formats; f++) {
        const size_t bytes = cranny_normal_bytes(formats[f].format);
        for (size_t i = 0; i < TILE_PIXELS; i++)
            cranny_normal_encode(formats[f].format, view->normals[i], (char *)stored + i * bytes);
        frame.normal = stored;
        frame.normal_format = formats[f].format;
        for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
            record_difference(formats[f].id, m, expected[m], &frame);
    }
    frame.normal = NULL;
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        record_difference(ROW_FACE_NORMALS, m, expected[m], &frame);
    free(stored);
}

void measure_depths(void)
{
    struct view view = scene_view(SCENE_COURT);
    float *expected[CRANNY_METHOD_COUNT];
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        expected[m] = render_view(&view, m, 0.5);
    measure_conventions(&view, expected);
    measure_formats(&view, expected);
    for (int m = 0; m < CRANNY_METHOD_COUNT; m++)
        free(expected[m]);
    view_free(&view);
}
