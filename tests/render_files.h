/* For the tests of `render` and `check --depth`: scenes, pictures and what they hold. */
#ifndef TESTS_RENDER_FILES_H
#define TESTS_RENDER_FILES_H

#include "command.h"

#include <cranny/gbuffer.h>
#include <cranny/image.h>
#include <jansson.h>

static inline json_t *node(const char *name, int camera, double x, double y, double z)
{
    return json_pack("{ss si s[fff]}", "name", name, "camera", camera, "translation", x, y, z);
}

/* The example's corner, seen by two cameras along −Z: one of perspective, one parallel. */
static inline void write_scene(const char *path)
{
    json_t *scene = json_load_file(SOURCE_FOLDER "/examples/corner.gltf", 0, NULL);
    json_t *nodes = json_object_get(scene, "nodes");
    json_array_append_new(nodes, node("front", 0, 1.2, 1.1, 5));
    json_array_append_new(nodes, node("plan", 1, 1.1, 0.9, 5));
    json_object_set_new(scene, "cameras",
                        json_pack("[{sssss{sfsf}}, {sssss{sfsfsfsf}}]", "name", "front", "type",
                                  "perspective", "perspective", "yfov", 0.8, "znear", 0.1, "name",
                                  "plan", "type", "orthographic", "orthographic", "xmag", 1.6,
                                  "ymag", 1.2, "znear", 0.1, "zfar", 100.0));
    json_t *roots = json_object_get(json_array_get(json_object_get(scene, "scenes"), 0), "nodes");
    json_array_append_new(roots, json_integer(1));
    json_array_append_new(roots, json_integer(2));
    CHECK(json_dump_file(scene, path, 0) == 0);
    json_decref(scene);
}

static inline struct cranny_image read_image(const char *path, enum cranny_image_kind kind)
{
    struct cranny_error why;
    struct cranny_image image;
    CHECK_OK(cranny_image_read(path, kind, &image, &why), why);
    return image;
}

static inline void write_image(const char *path, enum cranny_image_kind kind,
                               enum cranny_image_bits bits, const struct cranny_image *image)
{
    struct cranny_error why;
    CHECK_OK(cranny_image_write(path, kind, bits, image->width, image->height, image->channels,
                                image->pixels, 0, &why),
             why);
}

/* The largest difference of two pictures of one size; 2 when there is none to be had. */
static inline double largest_difference(const char *a_path, const char *b_path)
{
    struct cranny_image a = read_image(a_path, CRANNY_IMAGE_VALUE);
    struct cranny_image b = read_image(b_path, CRANNY_IMAGE_VALUE);
    double largest = a.pixels && a.width == b.width && a.height == b.height ? 0 : 2;
    for (int i = 0; largest < 2 && i < a.width * a.height; i++)
        largest = fmax(largest, fabs((double)a.pixels[i] - (double)b.pixels[i]));
    cranny_image_free(&a);
    cranny_image_free(&b);
    return largest;
}

/* The object that a run printed, which must have succeeded; the result is done with. */
static inline json_t *take_json(struct result *result, int expected)
{
    CHECK_EXIT(*result, expected);
    json_t *object = json_loadb(result->out, result->out_size, 0, NULL);
    CHECK_MSG(json_is_object(object), "stdout: %s", result->out);
    done(result);
    return object;
}

static inline double number_of(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    CHECK_MSG(json_is_number(value), "no number '%s'", key);
    return json_number_value(value);
}

static inline const char *text_of(const json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    CHECK_MSG(text, "no text '%s'", key);
    return text ? text : "";
}

static inline void check_keys(const json_t *object, const char *const *keys)
{
    for (size_t i = 0; keys[i]; i++)
        CHECK_MSG(json_object_get(object, keys[i]), "no key '%s'", keys[i]);
}

/* Succeeds, whatever it says. */
#define CHECK_RUN(...)                                                                             \
    do {                                                                                           \
        struct result check_result = run(__VA_ARGS__, NULL);                                       \
        CHECK_EXIT(check_result, 0);                                                               \
        done(&check_result);                                                                       \
    } while (0)

#endif
