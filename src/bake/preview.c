/* A quick picture of baked values: one primary ray per sample, clay, hemispheric light. */
#include "base/srgb.h"
#include "trace/sight.h"
#include "trace/view.h"

#include "bake/bake.h"

#define GRID 2            /* rays per pixel, each way */
#define METER 32          /* pixels each way that the exposure is measured on */
#define WANTED_MEAN 0.45f /* of the visibility in a picture, reached by brightening */
#define GAIN_MAXIMUM 5.0f
#define BAND_RAYS (1 << 18) /* rays traced at once: bounds the memory of large pictures */

static float visibility_at(const struct cranny_bake *bake, const struct cranny_hit *hit)
{
    return bake ? (float)bake_value_at(bake, hit->instance, hit->triangle, (double)hit->u,
                                       (double)hit->v, CRANNY_CHANNEL_VISIBILITY)
                : 1;
}

/* Linear colour of what a ray saw. */
static void shade(const struct cranny_scene *scene, const struct cranny_bake *bake, float gain,
                  const struct cranny_hit *hit, const float direction[3], float color[3])
{
    static const float above[3] = {0.66f, 0.66f, 0.66f}, below[3] = {0.34f, 0.31f, 0.28f};
    if (hit->instance == UINT32_MAX) {
        sight_sky(direction, color);
        return;
    }
    const struct cranny_instance *instance = cranny_scene_instance(scene, hit->instance);
    const struct cranny_mesh *mesh = cranny_scene_mesh(scene, instance->mesh);
    double n[3];
    sight_normal(instance, mesh, hit, direction, n);
    double facing = -(n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2]);
    float level = gain * visibility_at(bake, hit) * (0.82f + 0.18f * fmaxf((float)facing, 0));
    float t = 0.5f + 0.5f * (float)n[1];
    for (int i = 0; i < 3; i++)
        color[i] = level * (below[i] + (above[i] - below[i]) * t);
}

/* What every step of a picture needs. */
struct picture {
    const struct cranny_scene *scene;
    const struct cranny_bake *bake;
    struct cranny_tracer *tracer; /* owned */
    struct lens lens;
    const struct cranny_hooks *hooks;
    int threads;
};

struct band {
    float (*origins)[3], (*directions)[3];
    float *distances;
    struct cranny_hit *hits;
};

static bool band_alloc(struct band *band, size_t count)
{
    band->origins = alloc_array(count, sizeof *band->origins);
    band->directions = alloc_array(count, sizeof *band->directions);
    band->distances = alloc_array(count, sizeof *band->distances);
    band->hits = alloc_array(count, sizeof *band->hits);
    return band->origins && band->directions && band->distances && band->hits;
}

static void band_free(struct band *band)
{
    free(band->origins);
    free(band->directions);
    free(band->distances);
    free(band->hits);
}

static void band_aim(const struct band *band, const struct picture *picture, int width, int height,
                     int first_row, int rows)
{
#pragma omp parallel for schedule(static) num_threads(thread_count(picture->threads))
    for (int row = 0; row < rows * GRID; row++) {
        for (int column = 0; column < width * GRID; column++) {
            size_t ray = (size_t)row * (size_t)width * GRID + (size_t)column;
            double x = 2 * (column + 0.5) / ((double)width * GRID) - 1;
            double y = 1 - 2 * ((double)first_row * GRID + row + 0.5) / ((double)height * GRID);
            lens_ray(&picture->lens, x, y, band->origins[ray], band->directions[ray]);
        }
    }
}

static enum cranny_status band_trace(const struct band *band, const struct picture *picture,
                                     size_t count, struct cranny_error *why)
{
    return cranny_trace(picture->tracer, count, (const float(*)[3])band->origins,
                        (const float(*)[3])band->directions, band->distances, band->hits,
                        picture->threads, why);
}

static void band_resolve(const struct band *band, const struct picture *picture, float gain,
                         int width, int rows, uint8_t *rgb)
{
#pragma omp parallel for schedule(static) num_threads(thread_count(picture->threads))
    for (int row = 0; row < rows; row++) {
        for (int column = 0; column < width; column++) {
            float sum[3] = {0}, color[3];
            for (int k = 0; k < GRID * GRID; k++) {
                size_t line = (size_t)row * GRID + (size_t)(k / GRID);
                size_t ray = (line * (size_t)width + (size_t)column) * GRID + (size_t)(k % GRID);
                shade(picture->scene, picture->bake, gain, &band->hits[ray], band->directions[ray],
                      color);
                for (int i = 0; i < 3; i++)
                    sum[i] += color[i];
            }
            uint8_t *pixel = rgb + ((size_t)row * (size_t)width + (size_t)column) * 3;
            for (int i = 0; i < 3; i++)
                pixel[i] = srgb_encode(sum[i] / (GRID * GRID));
        }
    }
}

/* Brighten a dark room, as an eye would: from the mean visibility on a coarse grid. */
static enum cranny_status choose_gain(const struct picture *picture, float *gain,
                                      struct cranny_error *why)
{
    struct band band = {0};
    enum cranny_status status = CRANNY_OK;
    const size_t count = METER * METER * GRID * GRID;
    double sum = 0, seen = 0;
    *gain = 1;
    if (!band_alloc(&band, count))
        status = fail_memory(why, "preview");
    else
        band_aim(&band, picture, METER, METER, 0, METER);
    if (status == CRANNY_OK)
        status = band_trace(&band, picture, count, why);
    for (size_t i = 0; status == CRANNY_OK && i < count; i++) {
        if (band.hits[i].instance == UINT32_MAX)
            continue;
        sum += visibility_at(picture->bake, &band.hits[i]);
        seen += 1;
    }
    if (seen > 0)
        *gain = clamp_float((float)(WANTED_MEAN * seen / fmax(sum, 1e-9)), 1, GAIN_MAXIMUM);
    band_free(&band);
    return status;
}

static enum cranny_status draw(const struct picture *picture, int width, int height, uint8_t *rgb,
                               struct cranny_error *why)
{
    int rows = max_int(1, min_int(height, BAND_RAYS / (GRID * GRID * width)));
    struct band band = {0};
    float gain;
    enum cranny_status status = choose_gain(picture, &gain, why);
    if (status == CRANNY_OK && !band_alloc(&band, (size_t)rows * (size_t)width * GRID * GRID))
        status = fail_memory(why, "preview");
    for (int first = 0; first < height && status == CRANNY_OK; first += rows) {
        int count = min_int(rows, height - first);
        if (!hook_progress(picture->hooks, "preview", first, height)) {
            status = fail(why, CRANNY_CANCELLED, "preview: cancelled");
            break;
        }
        band_aim(&band, picture, width, height, first, count);
        status = band_trace(&band, picture, (size_t)count * (size_t)width * GRID * GRID, why);
        if (status == CRANNY_OK)
            band_resolve(&band, picture, gain, width, count,
                         rgb + (size_t)first * (size_t)width * 3);
    }
    band_free(&band);
    return status;
}

static enum cranny_status check_size(int width, int height, struct cranny_error *why)
{
    if (width < 1 || height < 1 || width > 16384 || height > 16384)
        return fail(why, CRANNY_USAGE, "preview: %d x %d pixels; pass 1 to 16384 each way", width,
                    height);
    return CRANNY_OK;
}

struct cranny_preview_params cranny_preview_params_default(void)
{
    return (struct cranny_preview_params){0};
}

static enum cranny_status open_picture(const struct cranny_scene *scene,
                                       const struct cranny_bake *bake,
                                       const struct cranny_preview_params *params,
                                       struct picture *picture, struct cranny_error *why)
{
    const struct cranny_preview_params defaults = cranny_preview_params_default();
    params = params ? params : &defaults;
    *picture = (struct picture){
        .scene = scene, .bake = bake, .hooks = params->hooks, .threads = params->threads};
    struct cranny_tracer_params tracer = cranny_tracer_params_default();
    tracer.threads = params->threads;
    tracer.hooks = params->hooks;
    return cranny_tracer_create(scene, &tracer, &picture->tracer, why);
}

enum cranny_status cranny_preview_render_view(const struct cranny_scene *scene,
                                              const struct cranny_bake *bake,
                                              const struct cranny_camera *view, int width,
                                              int height,
                                              const struct cranny_preview_params *params,
                                              uint8_t *rgb, struct cranny_error *why)
{
    struct picture picture;
    struct lens lens;
    enum cranny_status status = check_size(width, height, why);
    if (status == CRANNY_OK)
        status = lens_create(view, (double)width / height, &lens, why);
    if (status != CRANNY_OK)
        return status;
    status = open_picture(scene, bake, params, &picture, why);
    picture.lens = lens;
    if (status == CRANNY_OK)
        status = draw(&picture, width, height, rgb, why);
    cranny_tracer_destroy(&picture.tracer);
    return status;
}

enum cranny_status cranny_preview_default_view(const struct cranny_scene *scene, float aspect,
                                               const struct cranny_preview_params *params,
                                               struct cranny_camera *view, struct cranny_error *why)
{
    if (!(aspect > 0) || !isfinite(aspect))
        return fail(why, CRANNY_USAGE, "preview: the picture's aspect must be above 0");
    struct picture picture;
    enum cranny_status status = open_picture(scene, NULL, params, &picture, why);
    if (status == CRANNY_OK)
        status = view_choose(scene, picture.tracer, aspect, view, why);
    cranny_tracer_destroy(&picture.tracer);
    return status;
}

enum cranny_status cranny_preview_render(const struct cranny_scene *scene,
                                         const struct cranny_bake *bake, int camera, int width,
                                         int height, const struct cranny_preview_params *params,
                                         uint8_t *rgb, struct cranny_error *why)
{
    const int count = (int)cranny_scene_camera_count(scene);
    enum cranny_status status = check_size(width, height, why);
    if (status != CRANNY_OK)
        return status;
    if (camera < -1 || camera >= count)
        return fail(why, CRANNY_USAGE, "preview: camera %d; the scene has %d, counted from 0",
                    camera, count);
    if (count > 0)
        return cranny_preview_render_view(scene, bake,
                                          cranny_scene_camera(scene, (uint32_t)max_int(camera, 0)),
                                          width, height, params, rgb, why);
    const double aspect = (double)width / height;
    struct picture picture;
    struct cranny_camera view;
    status = open_picture(scene, bake, params, &picture, why);
    if (status == CRANNY_OK)
        status = view_choose(scene, picture.tracer, aspect, &view, why);
    if (status == CRANNY_OK)
        status = lens_create(&view, aspect, &picture.lens, why);
    if (status == CRANNY_OK)
        status = draw(&picture, width, height, rgb, why);
    cranny_tracer_destroy(&picture.tracer);
    return status;
}
