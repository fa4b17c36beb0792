#include "texture.h"

#include "mesh.h"

#include <png.h>
#include <stdlib.h>
#include <string.h>

#define SIZE 128

typedef double coverage_fn(double u, double v, double *shade);

/* Four pickets a metre with pointed tops, on two rails. */
static double fence_at(double u, double v, double *shade)
{
    double across = fmod(u * 4, 1) - 0.5, tip = 0.06 + 0.28 * fabs(across);
    *shade = 0.86 + 0.14 * chance(7, (uint32_t)(u * 4), 0) - 0.25 * fabs(across);
    bool picket = fabs(across) < 0.32 && v > tip;
    bool rail = fabs(v - 0.32) < 0.045 || fabs(v - 0.78) < 0.045;
    return picket || rail;
}

static double leaves_at(double u, double v, double *shade)
{
    *shade = 0.8;
    for (uint32_t i = 0; i < 46; i++) {
        double turn = 2 * LEVEL_PI * chance(11, i, 0), far = 0.42 * sqrt(chance(11, i, 1));
        double x = u - 0.5 - far * cos(turn), y = v - 0.5 - far * sin(turn);
        double lie = 2 * LEVEL_PI * chance(11, i, 2), c = cos(lie), s = sin(lie);
        double a = (c * x + s * y) / 0.088, b = (c * y - s * x) / (0.045 * (1.1 - 0.5 * a));
        if (a * a + b * b < 1) {
            *shade = 0.7 + 0.3 * chance(11, i, 3);
            return 1;
        }
    }
    return 0;
}

static double grass_at(double u, double v, double *shade)
{
    *shade = 0.75;
    for (uint32_t i = 0; i < 15; i++) {
        double root = 0.12 + 0.76 * (i + 0.5) / 15, top = 0.55 * chance(13, i, 0);
        double lean = 0.28 * (chance(13, i, 1) - 0.5), t = (1 - v) / (1 - top);
        if (t >= 0 && t < 1 && fabs(u - root - lean * t * t) < 0.034 * (1 - t)) {
            *shade = 0.65 + 0.35 * chance(13, i, 2);
            return 1;
        }
    }
    return 0;
}

uint8_t *texture_png(enum texture texture, size_t *size)
{
    static coverage_fn *const shapes[TEXTURE_COUNT] = {fence_at, leaves_at, grass_at};
    static const double colors[TEXTURE_COUNT][3] = {
        {222, 208, 180}, {160, 182, 84}, {196, 205, 112}};
    uint8_t *rgba = malloc(SIZE * SIZE * 4), *png = NULL;
    for (int i = 0; rgba && i < SIZE * SIZE; i++) {
        double shade;
        double alpha = shapes[texture]((i % SIZE + 0.5) / SIZE, (i / SIZE + 0.5) / SIZE, &shade);
        for (int k = 0; k < 3; k++)
            rgba[4 * i + k] = (uint8_t)lround(colors[texture][k] * fmin(shade, 1));
        rgba[4 * i + 3] = alpha > 0.5 ? 255 : 0;
    }
    png_image image = {
        .version = PNG_IMAGE_VERSION, .width = SIZE, .height = SIZE, .format = PNG_FORMAT_RGBA};
    png_alloc_size_t room = PNG_IMAGE_PNG_SIZE_MAX(image);
    png = rgba ? malloc(room) : NULL;
    if (png && !png_image_write_to_memory(&image, png, &room, 0, rgba, 0, NULL)) {
        free(png);
        png = NULL;
    }
    free(rgba);
    *size = room;
    return png;
}
