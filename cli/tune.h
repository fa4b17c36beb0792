/* Fitting a method's parameters, from the command line to the preset file. */
#ifndef CLI_TUNE_H
#define CLI_TUNE_H

#include "views.h"

enum { TUNE_FIT_LIMIT = 64 };

/* Which views judge instead of being fitted to. */
enum tune_hold {
    TUNE_HOLD_ALTERNATE, /* every other one of each scene */
    TUNE_HOLD_REST,      /* all but each scene's first */
    TUNE_HOLD_NONE,
};

struct tune_options {
    int method; /* of the list of methods; -1: not given */
    const char *output, *cache, *fit;
    int hold; /* enum tune_hold */
    int evaluations, rays;
};

/* A view with its truth, the scene long gone. */
struct tune_view {
    size_t scene; /* the input's number */
    struct sight sight;
    struct cranny_gbuffer gbuffer; /* its arrays are owned */
    double world_from_view[12];
    struct cranny_truth truth;
    bool held_out;
};

struct tune {
    struct ui ui;
    struct tune_options options;
    struct load_options load;
    struct scene_options view_scene;
    struct view_options lens;
    struct views_options looks;
    const struct interface *face;
    const char *inputs[SCENE_LIMIT];

    const struct method *method;
    union method_params params; /* to begin with */
    struct method_fields fields;
    char *names; /* what --fit says, cut up; owned */
    const char *fit[TUNE_FIT_LIMIT];
    size_t fit_count;

    bool made_cache;
    size_t scene_first; /* views before those of the scene in progress */
    struct cranny_scene *scene;
    struct cranny_tracer *tracer;
    struct method_state states[SCENE_LIMIT]; /* one a scene */
    struct tune_view *views;                 /* owned, as what is in them */
    size_t view_count, view_room;

    union method_params fitted;
    struct cranny_tune_report report;
    struct cranny_tune_change *changes; /* a view each; owned */
    double total_s;
};

/* What is no matter of looks, or cannot change between views: neither fitted nor in a preset. */
bool tune_is_fixed(const char *name);

/* The scene in progress, and how it is looked at. */
struct views_task tune_task(const struct tune *tune, size_t input);

/* Load every scene, draw its views, get their truths, say which are held out. */
enum cranny_status tune_open_views(struct tune *tune, struct cranny_error *why);
void tune_close_views(struct tune *tune);

/* The preset file's content. */
json_t *tune_preset(const struct tune *tune);

/* The outcome on stdout; the exit status. */
int tune_print(struct tune *tune);

#endif
