/* The conformance suite: what each method makes of scenes whose truth is known, and what must not
 * change the picture. conformance.c has the bounds, the files beside this one the measurements. */
#ifndef TESTS_CONFORMANCE_H
#define TESTS_CONFORMANCE_H

#include "analytic.h"

enum { TILE_WIDTH = 160, TILE_HEIGHT = 120, TILE_PIXELS = TILE_WIDTH * TILE_HEIGHT };
enum { MARGIN = 8 }; /* pixels at the border that a measurement leaves out */

enum section { SECTION_FORMS, SECTION_SAME, SECTION_SAMPLES, SECTION_NOISE, SECTION_COUNT };

/* What is measured, one number a method. */
enum row_id {
    ROW_PLANE_GIVEN,
    ROW_PLANE_FACE,
    ROW_WALL_RMS,
    ROW_WALL_MAX,
    ROW_ROOM_RMS,
    ROW_ROOM_MAX,
    ROW_GULLY_RMS,
    ROW_GULLY_MAX,
    ROW_BALL_RMS,
    ROW_BALL_MAX,
    ROW_STEP_RMS,
    ROW_STEP_MAX,
    ROW_COURT_RMS,
    ROW_COURT_MAX,
    ROW_EDGE_MEAN,
    ROW_EDGE_MAX,
    ROW_HALO_MEAN,
    ROW_HALO_MAX,
    ROW_SKY_TOUCHED,
    ROW_SKY_BALL,
    ROW_RESOLUTION,
    ROW_LENS,
    ROW_SCALE_SMALL,
    ROW_SCALE_LARGE,
    ROW_SCALE_EXACT,
    ROW_MOVE_ALONG,
    ROW_MOVE_ACROSS,
    ROW_DEPTH_GL,
    ROW_DEPTH_D3D,
    ROW_DEPTH_REVERSED,
    ROW_DEPTH_INFINITE,
    ROW_DEPTH_LOGARITHMIC,
    ROW_DEPTH_24,
    ROW_DEPTH_16,
    ROW_PARALLEL_FAR,
    ROW_PARALLEL_SCALE,
    ROW_LONG_LENS,
    ROW_VIEWPORT,
    ROW_FACE_NORMALS,
    ROW_SNORM8,
    ROW_UNORM8,
    ROW_OCT16,
    ROW_OCT8,
    ROW_BORDER_BARE,
    ROW_BORDER_GUARDED,
    ROW_MIRROR,
    ROW_FIRST_4,
    ROW_CROSS_4,
    ROW_BLUR_4,
    ROW_FIRST_8,
    ROW_CROSS_8,
    ROW_BLUR_8,
    ROW_FIRST_TRUTH,
    ROW_CROSS_TRUTH,
    ROW_BLUR_TRUTH,
    ROW_BLEED_MEAN,
    ROW_BLEED_RMS,
    ROW_SEED_MEAN,
    ROW_SEED_NOISE,
    ROW_PATTERN_RAW,
    ROW_PATTERN,
    ROW_COUNT
};

struct row {
    enum section section;
    const char *what;
    const char *limit; /* why the bound is no better: a known limit; NULL: none */
    double bound[CRANNY_METHOD_COUNT];
    double measured[CRANNY_METHOD_COUNT], paper[CRANNY_METHOD_COUNT]; /* NaN: not measured */
};

extern struct row rows[ROW_COUNT];

/* The largest of what is recorded counts. `paper`: reported, not enforced. */
void record(enum row_id id, int method, bool paper, double value);

/* Where a camera stands and what it looks at; +Y is up. */
struct camera {
    double eye[3], target[3];
};

/* A frame with its geometry: made by view_make, freed by view_free. */
struct view {
    struct analytic scene; /* in view space */
    struct cranny_projection lens;
    int width, height;
    double eye[3], axes[3][3]; /* of the camera, in the world */
    float *depth;
    float (*normals)[3];
    struct cranny_gbuffer frame;
};

struct view view_make(const struct analytic *world, const struct camera *camera,
                      struct cranny_projection lens, int width, int height);
void view_free(struct view *view);

/* The frame anew with another lens or other depths: `frame` refers to the view's buffers. */
void view_point(const struct view *view, int x, int y, double p[3]);

/* A world's point in a view: pixel coordinates and depth. */
void view_project(const struct view *view, const double world[3], double *x, double *y, double *z);
void view_world(const struct view *view, const double p[3], double world[3]);

/* Ray-traced visibility at a point; shapes out of reach are left out. */
double truth_at(const struct analytic *scene, const double p[3], const double n[3], double radius,
                int side);

/* Of all pixels; the caller frees. */
float *view_truth(const struct view *view, double radius, int side);

/* Memory of `count` floats that cannot fail; the caller frees. */
float *floats(size_t count);

/* Whether a pixel counts: no sky, off the border, nearer than `far`. */
bool view_counts(const struct view *view, int x, int y, double far);

/* A method's parameters for a radius. */
struct cranny_screen_params method_params(int method, const char *preset, double radius);

/* Visibility of a frame; the caller frees. */
float *render(const struct cranny_gbuffer *frame, const struct cranny_screen_params *params);

/* The calibrated preset on a view. */
float *render_view(const struct view *view, int method, double radius);

/* Mean over `count` seeds without a filter: what the filter should find. */
float *render_mean(const struct view *view, struct cranny_screen_params params, int count);

struct scene_of_test {
    const char *name, *title;
    void (*build)(struct analytic *world);
    struct camera camera;
    double radius;
    enum row_id rms; /* the row after it is the largest error */
};

enum { SCENE_WALL, SCENE_ROOM, SCENE_GULLY, SCENE_BALL, SCENE_STEP, SCENE_COURT, SCENE_HALO };
enum { SCENE_COUNT = SCENE_HALO + 1 };
extern const struct scene_of_test scenes[SCENE_COUNT];

struct cranny_projection usual_lens(void);
struct view scene_view(int scene);

/* Measurements. */
void measure_forms(const char *folder);
void measure_same(void);
void measure_depths(void);
void measure_samples(const char *folder);
void measure_noise(void);

/* Pages: `folder` NULL writes nothing. A strip is `count` pictures side by side. */
void strip_write(const char *folder, const char *name, float *const *pictures, int count, int width,
                 int height);
void page_write(const char *folder);

#endif
