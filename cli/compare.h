/* Every method beside the truth, from the command line to the folder. */
#ifndef CLI_COMPARE_H
#define CLI_COMPARE_H

#include "views.h"

enum { COMPARE_METHOD_LIMIT = 64 };

struct compare_options {
    const char *output, *cache, *methods;
    struct option_list presets;
    int rays, repeat, threads;
    int isa; /* enum cranny_isa */
};

/* One line of the method list. */
struct compare_method {
    const struct method *method;
    char label[64];               /* what it is called: a preset's name, or what differs from it */
    int file;                     /* which of the files of --preset, from 1; 0: none */
    const char *preset, *setting; /* of --preset and --set; NULL: none */
    const char *device;
    bool series; /* one of steps of one quality */
    union method_params params;
};

/* What a method gave on a view. */
struct compare_trial {
    const struct compare_method *method;
    double milliseconds;
    int runs;
    struct method_report report; /* of the last run */
    struct cranny_difference difference;
    char *image, *map; /* names in the folder; owned */
    char *command;     /* owned */
    json_t *parameters;
};

/* A view to look at, before and after that. */
struct compare_view {
    const char *scene; /* path as given */
    struct sight sight;
    uint64_t triangles;
    struct cranny_raytrace_report truth; /* of the tracing, whenever that was */
    double truth_s;                      /* that getting it took */
    bool truth_kept;
    char *image, *command; /* of the truth; owned */
    struct compare_trial trials[COMPARE_METHOD_LIMIT];
    size_t trial_count;
};

struct compare {
    struct ui ui;
    struct compare_options options;
    struct load_options load;
    struct scene_options view_scene;
    struct view_options lens;
    struct views_options looks;
    const struct interface *face;
    const char *inputs[SCENE_LIMIT];
    char *command; /* the whole of it; owned */

    struct compare_method methods[COMPARE_METHOD_LIMIT];
    size_t method_count;
    int file_count; /* of the rows out of files */

    char *folder, *work, *cache; /* owned; `work` is in the folder while there is work */
    bool made_folder, made_cache;

    struct cranny_scene *scene; /* of the views in progress */
    struct cranny_tracer *tracer;
    struct method_state state;
    struct compare_view *views; /* owned, as what is in them */
    size_t view_count, view_room;
    char *failures[SCENE_LIMIT]; /* owned */
    size_t failure_count;
    enum cranny_status failure; /* the first one's */
};

/* The list of what is tried on each view: raytrace at low counts, then every method at every
 * preset and at its steps; of these what --methods names; then the files of --preset.
 * CRANNY_USAGE when that is nothing, CRANNY_INPUT for a file that is no preset. */
enum cranny_status compare_list_methods(struct compare *compare, struct cranny_error *why);

/* The scene in progress, the input of that number, and how it is looked at. */
struct views_task compare_views(const struct compare *compare, size_t input);

/* Truth and trials of a view; pictures go to the work folder. */
enum cranny_status compare_measure(struct compare *compare, struct compare_view *view,
                                   struct cranny_error *why);
void compare_view_free(struct compare_view *view);

/* Make the folder, and in it one to work in. CRANNY_FAILED when that cannot be. */
enum cranny_status compare_open_folder(struct compare *compare, struct cranny_error *why);

/* Move everything to its place, and remove pictures that the results.json there before names and
 * this one does not. */
enum cranny_status compare_fill_folder(struct compare *compare, const json_t *results,
                                       struct cranny_error *why);

/* Remove what is left of the work, and folders that were made for nothing. */
void compare_close_folder(struct compare *compare);

/* The cache's folder exists from now on. */
enum cranny_status compare_need_cache(struct compare *compare, struct cranny_error *why);

/* The path of a file in the work folder, malloced. */
char *compare_path(const struct compare *compare, const char *name);

/* results.json's content. */
json_t *compare_json(const struct compare *compare);

/* results.json and index.html into the work folder. */
enum cranny_status compare_write(const struct compare *compare, json_t *results,
                                 struct cranny_error *why);

#endif
