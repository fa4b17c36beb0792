/* The methods of the command, each in one place: its name, its parameters, what it needs, and how
 * it runs on a frame. Programs loop over `methods` and know none by name. */
#ifndef CLI_METHOD_H
#define CLI_METHOD_H

#include "ui.h"

#include <cranny/cranny.h>

/* Parameters of any of them. */
union method_params {
    struct cranny_screen_params screen;
    struct cranny_volumes_params volumes;
    struct cranny_raytrace_params raytrace;
};

/* The fields that all of them have. */
struct method_fields {
    float *radius_world;
    int *threads;
    int *isa; /* NULL: there is none */
    const struct cranny_hooks **hooks;
};

/* What there is to look at. Owned by the caller. */
struct method_input {
    const struct cranny_scene *scene; /* NULL, as `frame`: depth images */
    const struct cranny_frame *frame;
    struct cranny_gbuffer gbuffer;
};

/* What is kept from run to run, of any methods in turn; zeroed to begin with. */
struct method_state {
    struct cranny_workspace *workspace;
    struct cranny_volumes *volumes; /* of the input's scene */
    bool quads;                     /* what they were made with */
};

/* What a run took. */
struct method_report {
    double total_ms;
    double setup_s; /* to make what stands still, whenever that was; not in total_ms; 0: nothing */
    int isa;        /* enum cranny_isa that ran; -1: none of them */
    struct cranny_screen_report screen;
    struct cranny_volumes_report volumes;
    struct cranny_volumes_info made; /* volumes */
    struct cranny_raytrace_report raytrace;
};

struct method;

/* What methods with the same parameters share. */
struct method_kind {
    bool needs_scene; /* a depth image is not enough */
    bool reads_guard; /* pixels around the picture change it */
    bool is_truth;    /* what the others are measured by */
    const struct cranny_param_table *(*table)(const struct method *method);
    const char *const *(*presets)(const struct method *method); /* NULL: no presets */
    void (*defaults)(const struct method *method, union method_params *params);
    enum cranny_status (*apply)(void *params, const char *preset, struct cranny_error *why);
    struct method_fields (*fields)(union method_params *params);
    enum cranny_status (*prepare)(const struct method_input *input,
                                  const union method_params *params, struct method_state *state,
                                  struct cranny_error *why);
    enum cranny_status (*run)(const struct method_input *input, const union method_params *params,
                              struct method_state *state, float *visibility,
                              struct method_report *report, struct cranny_error *why);
    /* Members of a --json result: `milliseconds`, and what only this kind has. */
    void (*add_json)(const struct method_report *report, json_t *object);
    /* --verbose: lines on stderr. */
    void (*print_details)(const struct method_report *report);
};

struct method {
    const char *name;
    const struct method_kind *kind;
    enum cranny_method screen; /* of the screen-space kind */
};

enum {
    METHOD_SSAO,
    METHOD_HBAO,
    METHOD_CREASE,
    METHOD_ALCHEMY,
    METHOD_VOLUMES,
    METHOD_RAYMARCH,
    METHOD_RAYTRACE,
    METHOD_COUNT
};

extern const struct method methods[METHOD_COUNT];

/* Their names in the same order, NULL-terminated. */
extern const char *const method_names[METHOD_COUNT + 1];

/* NULL: there is none of that name. */
const struct method *method_find(const char *name);

/* The one that --method names among the arguments, else `fallback`: it decides which options there
 * are, so it is looked for before they are parsed. */
const struct method *method_named(int argc, char **argv, const struct method *fallback);

const struct cranny_param_table *method_table(const struct method *method);

/* NULL-terminated; NULL for a method without presets. */
const char *const *method_presets(const struct method *method);

/* Every parameter of a preset; NULL or an unknown name: the defaults. */
void method_params_preset(const struct method *method, const char *preset,
                          union method_params *params);

struct method_fields method_fields(const struct method *method, union method_params *params);

/* A preset file says whose it is: {"method": "volumes", "intensity": 1.2, …}. CRANNY_INPUT when it
 * does not, or cannot be read; *params is the defaults with what the file states over them. */
enum cranny_status method_preset_load(const char *path, const struct method **method,
                                      union method_params *params, struct cranny_error *why);

/* `method` and the parameters, which is a preset file. */
json_t *method_parameters_json(const struct method *method, const union method_params *params);

/* Make what stands still, unless `state` has it; method_run does it, too, in its own time. */
enum cranny_status method_prepare(const struct method *method, const struct method_input *input,
                                  const union method_params *params, struct method_state *state,
                                  struct cranny_error *why);

/* Visibility of the G-buffer's viewport, tight rows. `report` is filled, too. */
enum cranny_status method_run(const struct method *method, const struct method_input *input,
                              const union method_params *params, struct method_state *state,
                              float *visibility, struct method_report *report,
                              struct cranny_error *why);

void method_state_free(struct method_state *state);

/* The volumes alone: those of another scene are to be made. */
void method_state_leave_scene(struct method_state *state);

#endif
