/* Buffer views, decompressed on first use. */
#ifndef SCENE_VIEWS_H
#define SCENE_VIEWS_H

#include "scene/document.h"

/* Bytes of a buffer view. `stride` 0: elements follow each other closely. */
struct view {
    const uint8_t *data;
    size_t size, stride;
};

/* Keeps what was decompressed until views_close. */
struct views {
    struct document *document;
    uint8_t **decoded; /* per buffer view; NULL: not compressed, or not yet asked for */
    size_t *decoded_size;
    size_t count;
};

enum cranny_status views_open(struct document *document, struct views *views,
                              struct cranny_error *why);
void views_close(struct views *views);

/* Buffer view `index`, as uncompressed bytes. */
enum cranny_status views_get(struct views *views, size_t index, struct view *view,
                             struct cranny_error *why);

#endif
