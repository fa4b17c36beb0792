/* Shading a frame: ambient light from above and below dimmed by visibility, and perhaps a sun.
 *
 * Based on: Fox, Compton, Ambient Occlusive Crease Shading, 2008: visibility dims each component of
 * the light by a weight of its own. */
#include "base/srgb.h"
#include "base/vector.h"
#include "frame/frame.h"
#include "trace/gather.h"
#include "trace/sight.h"
#include "trace/tracer.h"

#define METER 64           /* pixels each way that the exposure is measured on */
#define WANTED_LEVEL 0.35f /* of the mean luminance */
#define EXPOSURE_MINIMUM 0.2f
#define EXPOSURE_MAXIMUM 5.0f
#define GLOSS 24          /* exponent of the highlight, */
#define REFLECTANCE 0.04f /* its strength along the normal: that of most dielectrics */

struct shading {
    const struct cranny_frame *frame;
    const char *visibility; /* NULL: all open */
    size_t stride;
    struct cranny_light light;
    double sun_direction[3]; /* unit */
    bool sun;
};

struct cranny_light cranny_light_default(void)
{
    return (struct cranny_light){.sky = {0.80f, 0.83f, 0.88f},
                                 .ground = {0.42f, 0.39f, 0.35f},
                                 .weights = {1, 0, 0},
                                 .sun_direction = {0.3f, 0.9f, 0.3f}};
}

static float visibility_at(const struct shading *shading, int x, int y)
{
    if (!shading->visibility)
        return 1;
    const char *row = shading->visibility + (size_t)y * shading->stride;
    return ((const float *)(const void *)row)[x];
}

/* Whether nothing stands between a sample's surface and the sun. */
static bool sees_sun(const struct shading *shading, struct frame_pixel pixel)
{
    const struct cranny_frame *frame = shading->frame;
    const size_t index = frame_index(frame, pixel);
    const struct frame_ray ray = frame_ray(frame, pixel);
    const struct frame_surface surface =
        frame_surface(frame, &ray, &frame->hits[index], (double)frame->depth[index]);
    if (dot3(surface.normal, shading->sun_direction) <= 0)
        return false;
    float origin[3], direction[3], distance;
    for (int i = 0; i < 3; i++) {
        origin[i] = (float)(ray.origin[i] + surface.depth * ray.direction[i]);
        direction[i] = (float)shading->sun_direction[i];
    }
    const float offset = ray_offset(origin, surface.extent);
    for (int i = 0; i < 3; i++)
        origin[i] += offset * (float)surface.normal[i];
    trace_ray(frame->tracer, origin, direction, INFINITY, (uint32_t)index, &distance, NULL);
    return !isfinite(distance);
}

/* Diffuse and highlight (Blinn's) of the sun, without its colour. */
static void sun_terms(const struct shading *shading, struct frame_pixel pixel, const double n[3],
                      float *diffuse, float *specular)
{
    *diffuse = *specular = 0;
    const double facing = dot3(n, shading->sun_direction);
    if (!shading->sun || facing <= 0 || !sees_sun(shading, pixel))
        return;
    const struct frame_ray ray = frame_ray(shading->frame, pixel);
    double half[3] = {ray.direction[0], ray.direction[1], ray.direction[2]};
    normalise3(half);
    for (int i = 0; i < 3; i++)
        half[i] = shading->sun_direction[i] - half[i];
    normalise3(half);
    const double highlight = pow(fmax(dot3(n, half), 0), GLOSS);
    *diffuse = (float)facing;
    *specular = (float)(REFLECTANCE * (GLOSS + 8) / 8 * highlight * facing);
}

/* Linear colour of one sample's surface. */
static void shade_surface(const struct shading *shading, struct frame_pixel pixel, float color[3])
{
    const struct cranny_frame *frame = shading->frame;
    const struct cranny_light *light = &shading->light;
    const size_t index = frame_index(frame, pixel);
    const float visibility = visibility_at(shading, pixel.x, pixel.y);
    float dimmed[3], diffuse, specular;
    double n[3];
    frame_to_world(frame, frame->normals[index], n);
    sun_terms(shading, pixel, n, &diffuse, &specular);
    for (int k = 0; k < 3; k++)
        dimmed[k] = 1 - light->weights[k] * (1 - visibility);
    const float up = 0.5f + 0.5f * (float)n[1];
    for (int i = 0; i < 3; i++) {
        const float albedo = (float)frame->colors[index][i] * (1.0f / 65535);
        const float ambient = light->ground[i] + (light->sky[i] - light->ground[i]) * up;
        color[i] = albedo * (ambient * dimmed[0] + light->sun[i] * diffuse * dimmed[1]) +
                   light->sun[i] * specular * dimmed[2];
    }
}

/* Brighten a dark picture, dim a glaring one, as an eye would: from the mean luminance of some of
 * its surfaces. */
static float choose_exposure(const struct shading *shading)
{
    const struct cranny_frame *frame = shading->frame;
    double sum = 0, seen = 0;
    for (int k = 0; k < METER * METER; k++) {
        const struct frame_pixel pixel = {
            (int)((int64_t)(2 * (k % METER) + 1) * frame->width / (2 * METER)),
            (int)((int64_t)(2 * (k / METER) + 1) * frame->height / (2 * METER)), 0};
        float color[3];
        if (!isfinite(frame->depth[frame_index(frame, pixel)]))
            continue;
        shade_surface(shading, pixel, color);
        sum += 0.2126 * (double)color[0] + 0.7152 * (double)color[1] + 0.0722 * (double)color[2];
        seen += 1;
    }
    return clamp_float((float)(WANTED_LEVEL * seen / fmax(sum, 1e-9)), EXPOSURE_MINIMUM,
                       EXPOSURE_MAXIMUM);
}

static void shade_pixel(const struct shading *shading, int x, int y, uint8_t *rgb)
{
    const struct cranny_frame *frame = shading->frame;
    float sum[3] = {0};
    for (int sample = 0; sample < frame->samples; sample++) {
        const struct frame_pixel pixel = {x, y, sample};
        float color[3], scale = 1;
        if (isfinite(frame->depth[frame_index(frame, pixel)])) {
            shade_surface(shading, pixel, color);
            scale = shading->light.exposure;
        } else {
            const struct frame_ray ray = frame_ray(frame, pixel);
            double d[3] = {ray.direction[0], ray.direction[1], ray.direction[2]};
            normalise3(d);
            sight_sky((const float[3]){(float)d[0], (float)d[1], (float)d[2]}, color);
        }
        for (int i = 0; i < 3; i++)
            sum[i] += fminf(scale * color[i], 1);
    }
    for (int i = 0; i < 3; i++)
        rgb[i] = srgb_encode(sum[i] / (float)frame->samples);
}

static enum cranny_status prepare(struct shading *shading, struct cranny_error *why)
{
    const struct cranny_light *light = &shading->light;
    bool good = light->exposure >= 0 && isfinite(light->exposure);
    for (int i = 0; i < 3; i++) {
        good = good && light->sky[i] >= 0 && light->ground[i] >= 0 && light->sun[i] >= 0 &&
               light->weights[i] >= 0 && light->weights[i] <= 1;
        shading->sun |= light->sun[i] > 0;
        shading->sun_direction[i] = (double)light->sun_direction[i];
    }
    if (!good)
        return fail(why, CRANNY_USAGE,
                    "shade: colours and exposure must be 0 or more, weights in [0,1]");
    if (shading->sun && !normalise3(shading->sun_direction))
        return fail(why, CRANNY_USAGE, "shade: the sun has no direction");
    if (light->exposure == 0)
        shading->light.exposure = choose_exposure(shading);
    return CRANNY_OK;
}

static struct shading shading_of(const struct cranny_frame *frame, const float *visibility,
                                 size_t stride, const struct cranny_light *light)
{
    return (struct shading){.frame = frame,
                            .visibility = (const char *)visibility,
                            .stride = stride ? stride : sizeof(float) * (size_t)frame->width,
                            .light = light ? *light : cranny_light_default()};
}

enum cranny_status cranny_frame_exposure(const struct cranny_frame *frame, const float *visibility,
                                         size_t stride, const struct cranny_light *light,
                                         float *exposure, struct cranny_error *why)
{
    if (!frame || !exposure)
        return fail(why, CRANNY_USAGE, "exposure: a frame and an output");
    struct shading shading = shading_of(frame, visibility, stride, light);
    const enum cranny_status status = prepare(&shading, why);
    *exposure = status == CRANNY_OK ? shading.light.exposure : 0;
    return status;
}

enum cranny_status cranny_frame_shade(const struct cranny_frame *frame, const float *visibility,
                                      size_t stride, const struct cranny_light *light, int threads,
                                      uint8_t *rgb, struct cranny_error *why)
{
    if (!frame || !rgb || threads < 0)
        return fail(why, CRANNY_USAGE, "shade: a frame, an output and threads of 0 or more");
    struct shading shading = shading_of(frame, visibility, stride, light);
    const enum cranny_status status = prepare(&shading, why);
    if (status != CRANNY_OK)
        return status;
#pragma omp parallel num_threads(thread_count(threads))
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 8)
        for (int y = 0; y < frame->height; y++)
            for (int x = 0; x < frame->width; x++)
                shade_pixel(&shading, x, y,
                            rgb + 3 * ((size_t)y * (size_t)frame->width + (size_t)x));
        gather_thread_end(saved);
    }
    return CRANNY_OK;
}
