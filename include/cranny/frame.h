/* Frames of a scene: cameras, a G-buffer by primary rays, the ray-traced truth per pixel, and a
 * picture that shows what visibility does to ambient light. */
#ifndef CRANNY_FRAME_H
#define CRANNY_FRAME_H

#include <cranny/gbuffer.h>
#include <cranny/trace.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A camera at `eye` that looks at `target`. `up` need not be perpendicular; `fov_y` radians.
 * CRANNY_USAGE when the numbers give no direction. */
CRANNY_API enum cranny_status cranny_camera_look_at(const double eye[3], const double target[3],
                                                    const double up[3], float fov_y,
                                                    struct cranny_camera *camera,
                                                    struct cranny_error *why);

/* The view for scenes without a camera: from the front, right and above, so that everything fits a
 * picture of `aspect` (width over height); or, where the outside shows mostly back faces (a room),
 * the longest look from a place within. */
CRANNY_API enum cranny_status cranny_camera_default(const struct cranny_scene *scene,
                                                    const struct cranny_tracer *tracer,
                                                    float aspect, struct cranny_camera *camera,
                                                    struct cranny_error *why);

/* Which normals a frame holds. */
enum cranny_frame_normals {
    CRANNY_FRAME_FACE,   /* of the triangles */
    CRANNY_FRAME_SMOOTH, /* interpolated from the vertices, where the mesh has them */
};

/* What to draw. */
struct cranny_frame_params {
    int width, height; /* of the picture, 1 to CRANNY_SIDE_MAX; default 1280 × 720 */
    int guard_band;    /* pixels drawn around it, too; default 0 */
    int samples;       /* a pixel: 1 (default), 2, 4 or 8, at the standard places */
    int normals;       /* enum cranny_frame_normals; default face */
    int threads;       /* 0 (default): all cores; never changes the result */
    const struct cranny_hooks *hooks; /* stage "frame"; may be NULL */
};
CRANNY_API struct cranny_frame_params cranny_frame_params_default(void);

/* A G-buffer with what belongs to it: depth, normals, colours, and where in the scene each sample
 * lies. Immutable. Keeps pointers to scene and tracer, which must outlive it. */
struct cranny_frame;

/* Draw. Surfaces: everything that the tracer holds, alpha-masked texels left out; blended ones by
 * dice of their alpha. Nearer than the camera's near plane is not drawn. */
CRANNY_API enum cranny_status
cranny_frame_create(const struct cranny_scene *scene, const struct cranny_tracer *tracer,
                    const struct cranny_camera *camera, const struct cranny_frame_params *params,
                    struct cranny_frame **frame, struct cranny_error *why);
CRANNY_API void cranny_frame_destroy(struct cranny_frame **frame);

/* Views into the frame: depth, float normals, projection, viewport, guard band, samples,
 * world_from_view. They live as long as it does. */
CRANNY_API struct cranny_gbuffer cranny_frame_gbuffer(const struct cranny_frame *frame);

/* The truth's parameters. */
struct cranny_raytrace_params {
    float radius_world;        /* metres, > 0; default 0.5, as the methods' */
    enum cranny_kernel kernel; /* default linear over radius_world */
    int rays;                  /* a pixel, its samples share them; 1 to 65536; default 256 */
    float error_target;        /* stop when the mean standard error is below; default 0: never */
    int seed, threads;         /* default 0; threads 0: all cores; never changes the result */
    const struct cranny_hooks *hooks; /* stage "trace" */
};
CRANNY_API struct cranny_raytrace_params cranny_raytrace_params_default(void);

/* Its rows: ranges, defaults, help; `hooks` is not among them. */
CRANNY_API const struct cranny_param_table *cranny_raytrace_param_table(void);

/* What it took. */
struct cranny_raytrace_report {
    uint64_t rays;      /* traced */
    int rays_per_pixel; /* spent on each, all passes together */
    int passes;
    double standard_error_mean, standard_error_max; /* over the pixels that are not sky; from the
                                                       spread of the passes; 0 with one pass */
    double seconds;
};

/* Ray-traced visibility of the viewport, cosine-weighted around the frame's normals, in passes of a
 * low-discrepancy set each. `visibility`: width × height floats, rows `stride` bytes apart (0:
 * tight), sky 1; with several samples a pixel the mean of all of theirs (a supersampled truth).
 * `standard_error`: the same shape, or NULL. `report` may be NULL. */
CRANNY_API enum cranny_status
cranny_frame_raytrace(const struct cranny_frame *frame, const struct cranny_raytrace_params *params,
                      float *visibility, size_t stride, float *standard_error,
                      struct cranny_raytrace_report *report, struct cranny_error *why);

/* Ambient light for cranny_frame_shade, linear RGB. */
struct cranny_light {
    float sky[3], ground[3]; /* radiance from above and below */
    float weights[3];        /* how much of visibility the ambient, diffuse and specular components
                                take (Fox, Compton 2008): 1 all, 0 none; default 1, 0, 0 */
    float sun[3], sun_direction[3]; /* a directional light for the other two, world space, towards
                                       the sun; surfaces cast shadows in it; default none */
    float exposure; /* factor before the sRGB curve; 0 (default): from the picture's mean,
                       within 0.2 and 5 */
};
CRANNY_API struct cranny_light cranny_light_default(void);

/* A picture: the scene's base colours (factors and, where the scene holds them, textures) under sky
 * and ground light times visibility. `visibility` NULL: as if all were open. `rgb`: viewport
 * width × height × 3 bytes, sRGB, rows top to bottom. */
CRANNY_API enum cranny_status cranny_frame_shade(const struct cranny_frame *frame,
                                                 const float *visibility, size_t stride,
                                                 const struct cranny_light *light, int threads,
                                                 uint8_t *rgb, struct cranny_error *why);

/* The exposure that cranny_frame_shade would take: the light's own, or, where that is 0, what it
 * chooses from this picture. For pictures that are to be looked at side by side: shade the others
 * with it. Arguments as there. */
CRANNY_API enum cranny_status cranny_frame_exposure(const struct cranny_frame *frame,
                                                    const float *visibility, size_t stride,
                                                    const struct cranny_light *light,
                                                    float *exposure, struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
