/* Small glTF documents made in the test: bytes in a data URI, the rest as text with ' for ". */
#ifndef TESTS_GLTF_TEXT_H
#define TESTS_GLTF_TEXT_H

#include "check.h"

#include <cranny/scene.h>
#include <stdint.h>

struct bytes {
    uint8_t data[1 << 16];
    size_t size;
};

/* Append, 4-byte aligned; returns the offset. */
static inline size_t bytes_put(struct bytes *bytes, const void *data, size_t size)
{
    const size_t at = bytes->size;
    memcpy(bytes->data + at, data, size);
    bytes->size = (at + size + 3) & ~(size_t)3;
    return at;
}

static inline void base64(const uint8_t *data, size_t size, char *out)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const size_t left = size - i;
        const uint32_t three = (uint32_t)data[i] << 16 |
                               (left > 1 ? (uint32_t)data[i + 1] << 8 : 0) |
                               (left > 2 ? data[i + 2] : 0);
        *out++ = digits[three >> 18];
        *out++ = digits[three >> 12 & 63];
        *out++ = left > 1 ? digits[three >> 6 & 63] : '=';
        *out++ = left > 2 ? digits[three & 63] : '=';
    }
    *out = 0;
}

/* The document's text, malloced. `rest`: its members after asset and buffers. */
static inline char *gltf_text(const struct bytes *bytes, const char *rest)
{
    const size_t size = bytes->size * 4 / 3 + strlen(rest) + 512;
    char *text = malloc(size), *code = malloc(bytes->size * 4 / 3 + 8), *quoted = strdup(rest);
    base64(bytes->data, bytes->size, code);
    for (char *c = quoted; *c; c++)
        if (*c == '\'')
            *c = '"';
    if (bytes->size)
        snprintf(text, size,
                 "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":%zu,\"uri\":"
                 "\"data:application/octet-stream;base64,%s\"}],%s}",
                 bytes->size, code, quoted);
    else
        snprintf(text, size, "{\"asset\":{\"version\":\"2.0\"},%s}", quoted);
    free(code);
    free(quoted);
    return text;
}

static inline enum cranny_status gltf_load(const struct bytes *bytes, const char *rest, int scene,
                                           struct cranny_scene **out, struct cranny_error *why)
{
    struct cranny_scene_load_params params = cranny_scene_load_params_default();
    params.scene = scene;
    params.memory_limit_bytes = 1ull << 30;
    char *text = gltf_text(bytes, rest);
    memset(why, 0, sizeof *why);
    enum cranny_status status =
        cranny_scene_load_memory(text, strlen(text), "test.gltf", &params, out, why);
    free(text);
    return status;
}

#endif
