/* libdraco behind C calls; no exception crosses them. */
#ifndef SCENE_DRACO_H
#define SCENE_DRACO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct draco_geometry;

/* The counts that the stream's header claims, so that they can be refused before decoding. False
 * when it cannot be read. (Streams older than 2.2 place them elsewhere: zeros.) */
bool draco_claims(const void *data, size_t size, uint64_t *triangles, uint64_t *points);

/* NULL on failure, with one line in `message`. */
struct draco_geometry *draco_decode(const void *data, size_t size, char *message,
                                    size_t message_size);
void draco_free(struct draco_geometry *geometry);

size_t draco_points(const struct draco_geometry *geometry);
size_t draco_triangles(const struct draco_geometry *geometry);

/* 3 × draco_triangles point indices, each below draco_points. */
void draco_indices(const struct draco_geometry *geometry, uint32_t *out);

/* draco_points × components floats of the attribute with this unique id, without normalisation;
 * missing components are 0. False when there is no such attribute. */
bool draco_floats(const struct draco_geometry *geometry, uint32_t unique_id, int components,
                  float *out, bool *integers);

#ifdef __cplusplus
}
#endif
#endif
