/* Truths to compare with: ray-traced visibility of frames, kept in a folder between runs. */
#ifndef CRANNY_TRUTH_H
#define CRANNY_TRUTH_H

#include <cranny/frame.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A frame's ray-traced visibility. */
struct cranny_truth {
    int width, height;
    float *visibility;                    /* width × height; freed by cranny_truth_free */
    struct cranny_raytrace_report report; /* of the tracing, whenever that was */
    bool kept;                            /* it was in the folder */
    double seconds;                       /* that this call took */
};

/* The truth of a frame: out of `folder` when it holds it, else traced and left there. What is kept
 * is found by content: of the scene, of what the frame shows, of `params` and the version; so a
 * folder may serve many scenes, and nothing in it is ever wrong, only unused. `scene`: the frame's.
 * `folder` NULL: always traced. CRANNY_FAILED when the folder does not take the files. */
CRANNY_API enum cranny_status cranny_truth_get(const struct cranny_scene *scene,
                                               const struct cranny_frame *frame,
                                               const struct cranny_raytrace_params *params,
                                               const char *folder, struct cranny_truth *truth,
                                               struct cranny_error *why);

/* Frees the pixels and zeroes *truth; accepts one that is zeroed. */
CRANNY_API void cranny_truth_free(struct cranny_truth *truth);

#ifdef __cplusplus
}
#endif
#endif
