/* What is run with failing allocations: alloc.c refuses them, each stage says what it made. */
#ifndef ALLOC_STAGES_H
#define ALLOC_STAGES_H

#include <cranny/bake.h>
#include <cranny/screen.h>

/* What the stages work on; made without failures before they run. */
struct context {
    const char *name;
    uint8_t *data;
    size_t size;
    struct cranny_scene *scene;
    struct cranny_bake *bake;
    const struct cranny_screen_params *screen;
    char folder[64], output[80];
    uint64_t *digest; /* of what a stage that succeeds makes */
};

typedef enum cranny_status stage_fn(const struct context *, struct cranny_error *);
struct stage {
    const char *name;
    stage_fn *run;
};

/* Add to the digest. */
void fold(const struct context *with, const void *bytes, size_t size);

/* Run the stage with every allocation refused in turn. */
void sweep(const struct stage *stage, const struct context *with);

/* Screen space: each method, the filters, normals. `folder` is one where nothing may be left. */
void sweep_frames(const char *folder);

#endif
