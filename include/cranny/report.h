/* A page that shows methods beside the truth: the table and the plot of McGuire, Ambient Occlusion
 * Volumes, 2009 (Figures 9 and 10), and every picture against the reference (Figure 11).
 *
 * The caller fills in what was measured; the page is one file that needs nothing else. */
#ifndef CRANNY_REPORT_H
#define CRANNY_REPORT_H

#include <cranny/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One method at one preset on one device, on one view. Texts are UTF-8 of any content: they are
 * escaped. The same method, preset and device on several views are one row of the table. */
struct cranny_report_trial {
    const char *method, *preset, *device;
    double milliseconds;  /* of a picture */
    double error, rmse;   /* eq. 31; of visibility */
    double mean;          /* of test − reference: below 0 is too dark */
    double setup_seconds; /* to make what is kept while the scene stands still; not in
                             milliseconds; 0: nothing is */
    bool series;          /* of steps of one quality: the plot joins those of a method */
    bool is_truth;        /* the reference's own method with fewer rays: grey in the plot */
    const char *image;    /* path of the visibility as an 8-bit grey PNG, put into the page */
    const char *command;  /* that makes this picture */
};

/* One view of one scene, with its reference. */
struct cranny_report_view {
    const char *scene;           /* a name to show */
    const char *camera;          /* which view of it */
    uint64_t triangles;          /* in the world */
    int width, height;           /* pixels */
    double radius_world;         /* metres */
    int rays;                    /* a pixel, of the reference */
    double seconds;              /* that tracing took */
    double standard_error;       /* of the reference's visibility, mean over pixels */
    const char *image, *command; /* as of a trial */
    const struct cranny_report_trial *trials;
    size_t trial_count;
};

/* All of a page. Pointers must live during the call only. */
struct cranny_report {
    const char *machine; /* what the times were taken on */
    const char *command; /* that makes this page */
    const struct cranny_report_view *views;
    size_t view_count;
    const char *const *failures; /* scenes that are not in it, and why; a line each */
    size_t failure_count;
};

/* Write the page to `path` as HTML. CRANNY_INPUT when an image cannot be read, CRANNY_FAILED when
 * the page cannot be written; the file is then incomplete, for it is written in place. */
CRANNY_API enum cranny_status cranny_report_write(const struct cranny_report *report,
                                                  const char *path, struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
