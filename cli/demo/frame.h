/* One view as a renderer sees it: the truth, estimates of it, and light. */
#ifndef DEMO_FRAME_H
#define DEMO_FRAME_H

#include "../method.h"

#define FRAME_WIDTH 960
#define FRAME_HEIGHT 540
#define FRAME_RAYS 128       /* a pixel, for the truth */
#define FRAME_RUNS 5         /* of each method; the median counts */
#define FRAME_MAP_SCALE 0.25 /* the difference of full colour; the default of cranny diff */

enum { FRAME_METHOD_COUNT = 5, FRAME_LIT = 3 };

/* Indices of `methods`; that of FRAME_LIT, the default of cranny render, lights the picture. */
extern const int frame_methods[FRAME_METHOD_COUNT];

struct frame_job {
    const struct cranny_scene *scene; /* loaded with `colors` */
    const struct cranny_camera *views;
    int view_count;
    const char *folder;
    int rays;
    const struct cranny_hooks *hooks;
};

struct frame_score {
    double milliseconds; /* median */
    double setup_s;      /* to make what is kept; not in them */
    struct cranny_difference difference;
};

/* What was made, and the words of the command that makes the same. */
struct frame {
    bool made; /* false: no view shows a surface that anything is near to */
    int view;  /* index */
    char view_words[192], radius[32], exposure[32];
    double depth_median;
    int rays;
    const char *isa;
    struct cranny_raytrace_report truth;
    struct frame_score scores[FRAME_METHOD_COUNT];
};

/* Writes into the job's folder frame-truth.png, frame-METHOD.png, frame-METHOD-map.png,
 * frame-lit.png and frame-open.png. */
enum cranny_status frame_make(const struct frame_job *job, struct frame *frame,
                              struct cranny_error *why);

#endif
