/* What the parts of 'cranny bake' share. */
#ifndef CLI_BAKE_H
#define CLI_BAKE_H

#include "commands.h"

struct bake_options {
    const char *output;
    int to;
    bool raw, replace, expand;
    const char *report, *cache;
    const char *ground; /* NULL: not given; "": at the lowest vertex */
    const char *preview;
    int preview_size[2];
    int preview_camera;
};

struct job {
    struct ui ui;
    struct load_options load;
    struct bake_options options;
    struct cranny_bake_params params;
    const char *input;
    char *output; /* owned */
    struct cranny_scene *scene;
    struct cranny_bake *bake;
    struct cranny_bake_report report;
    double load_s, write_s, preview_s, total_s;
};

/* The most memory that the process has held. */
uint64_t bake_peak_bytes(void);

/* The result as one object. */
json_t *bake_json(const struct job *job, const char *to);

/* What a cache was of use for, as a sentence without its end; NULL: there is none. `text` has 160
 * bytes. */
const char *bake_reuse_text(const struct cranny_bake_report *report, char text[160]);

/* --report's page. */
enum cranny_status bake_write_report(const struct job *job, struct cranny_error *why);

#endif
