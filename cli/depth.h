/* A frame out of image files: the options of `render --depth` and `check --depth`, and reading. */
#ifndef CLI_DEPTH_H
#define CLI_DEPTH_H

#include "ui.h"

#include <cranny/gbuffer.h>
#include <cranny/image.h>

struct depth_options {
    const char *depth; /* NULL: the input is a scene */
    const char *normal;
    int kind, range; /* enum cranny_depth_kind; 0 Direct3D's range, 1 OpenGL's */
    bool reversed;
    double near_plane, far_plane, log_constant, scale; /* 0: not given */
    struct cranny_rect viewport;
    int normal_range; /* 0: by the file; 1: -1 ... 1; 2: 0 ... 1 */
    const char *normal_flip;
};

/* How pixels lie in space: shared with cameras of scenes. */
struct view_options {
    double fov_degrees, half_height; /* 0: not given */
    int guard;                       /* -1: not given */
};

/* Their rows; `target` is set by each command. */
extern const struct option_group depth_options, view_options;
struct depth_options depth_options_default(void);
struct view_options view_options_default(void);

/* CRANNY_USAGE when the field of view makes no sense. */
enum cranny_status view_options_check(const struct view_options *view, struct cranny_error *why);

/* What does not fit together among the options; looks at no file. CRANNY_USAGE when an option is
 * given that only makes sense with --depth. */
enum cranny_status depth_options_check(const struct interface *face,
                                       const struct depth_options *options,
                                       const struct view_options *view, struct cranny_error *why);

/* A frame as read; `gbuffer` points into the images. */
struct depth_frame {
    struct cranny_image depth, normal;
    struct cranny_gbuffer gbuffer;
    bool mismatched; /* depth and normals have different sizes; the normals are left out */
    bool few_bits;   /* integers of no more than 8 bits */
};

/* Read, make depth linear, normals signed. Without a field of view the projection stays zero.
 * CRANNY_INPUT for files that cannot be read or need more options; *frame is zeroed on failure.
 * Different sizes only set `mismatched`, with `why` filled. */
enum cranny_status depth_frame_read(const struct depth_options *options,
                                    const struct view_options *view, struct depth_frame *frame,
                                    struct cranny_error *why);
void depth_frame_free(struct depth_frame *frame);

/* The projection for pictures whose options give none: 60 degrees. */
struct cranny_projection depth_projection_assumed(const struct cranny_gbuffer *gbuffer);

/* The doctor's text in the command's words: options in place of the library's names. */
void depth_words(const char *code, const char *text, char *out, size_t size);

#endif
