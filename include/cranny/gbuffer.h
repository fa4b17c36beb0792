/* The G-buffer: what a renderer hands in. Linear view depth, normals if it has them, and how pixels
 * lie in view space; with converters from what graphics APIs store.
 *
 * View space: right-handed, the camera looks down −Z, +Y up. Pixel (0,0) is the top left one; a
 * pixel's centre is at (x + ½, y + ½). */
#ifndef CRANNY_GBUFFER_H
#define CRANNY_GBUFFER_H

#include <cranny/base.h>

#ifdef __cplusplus
extern "C" {
#endif

#define CRANNY_SAMPLES_MAX 8  /* samples a pixel */
#define CRANNY_SIDE_MAX 16384 /* pixels each way */

/* Perspective: a pixel's view position is depth × (x, y, −1). Orthographic: (x, y, −depth). */
enum cranny_projection_kind { CRANNY_PERSPECTIVE, CRANNY_ORTHOGRAPHIC };

/* View x and y at the borders of the viewport: at depth 1 (perspective: tangents of the angles), or
 * in metres (orthographic). left < right and bottom < top; need not be symmetric. */
struct cranny_projection {
    enum cranny_projection_kind kind;
    float left, right, bottom, top;
};

/* Symmetric perspective. `fov_y` radians, in (0, π); `aspect` width over height. */
CRANNY_API struct cranny_projection cranny_perspective(float fov_y, float aspect);

/* Symmetric parallel projection. `half_height` metres. */
CRANNY_API struct cranny_projection cranny_orthographic(float half_height, float aspect);

/* How normals are stored; all in view space. */
enum cranny_normal_format {
    CRANNY_NORMAL_FLOAT3, /* x y z, 12 bytes */
    CRANNY_NORMAL_FLOAT4, /* x y z and one unused, 16 bytes */
    CRANNY_NORMAL_SNORM8, /* R8G8B8A8_SNORM: c / 127, 4 bytes */
    CRANNY_NORMAL_UNORM8, /* R8G8B8A8_UNORM: 2 c / 255 − 1, 4 bytes */
    CRANNY_NORMAL_OCT16,  /* octahedral, R16G16_SNORM, 4 bytes */
    CRANNY_NORMAL_OCT8,   /* octahedral, R8G8_SNORM, 2 bytes */
};

/* Bytes of a normal in `format`. */
CRANNY_API size_t cranny_normal_bytes(enum cranny_normal_format format);

/* Pixels of a buffer. All zero: the whole of it. */
struct cranny_rect {
    int x, y, width, height;
};

/* A frame as a renderer left it. Nothing is copied or kept: pointers must live during a call.
 * Zero-initialise and fill in what there is. */
struct cranny_gbuffer {
    int width, height;  /* of the buffers, 1 to CRANNY_SIDE_MAX */
    const float *depth; /* linear view depth: metres along −Z, positive; sky +INFINITY. NaN, 0 and
                           negative values count as sky */
    size_t depth_stride;  /* bytes from row to row; 0: tight */
    const void *normal;   /* unit, view space, towards the camera's side; NULL: reconstructed.
                             Lengths are mended; a normal without one is reconstructed */
    size_t normal_stride; /* bytes from row to row; 0: tight */
    enum cranny_normal_format normal_format;
    struct cranny_projection projection; /* of `viewport` */
    struct cranny_rect viewport;         /* what is wanted and what `projection` spans; {0}: all */
    int guard_band;   /* pixels around the viewport that hold the scene, too, and may be read;
                         clipped to the buffer. What lies beyond is never read */
    int sample_count; /* multisampling: 2 to CRANNY_SAMPLES_MAX; 0 and 1: none */
    size_t depth_sample_stride, normal_sample_stride; /* bytes from a sample's plane (height rows)
                                                         to the next one's; 0: tight */
    const float (*sample_positions)[2]; /* sample_count places in the pixel, [0,1), y down; NULL:
                                           the standard pattern of Vulkan and Direct3D */
    const double
        *world_from_view; /* 3 rows of 4; only for noise that stays on surfaces; NULL: none */
};

/* CRANNY_USAGE, saying which field makes no sense. Does not look at pixels. */
CRANNY_API enum cranny_status cranny_gbuffer_validate(const struct cranny_gbuffer *gbuffer,
                                                      struct cranny_error *why);

/* The standard sample pattern for 1, 2, 4 or 8 samples (Vulkan 1.3 §26.4): `count` places. Other
 * counts take the first of the next larger pattern. */
CRANNY_API const float (*cranny_sample_positions(int count))[2];

/* What the numbers of a depth buffer mean. */
enum cranny_depth_kind {
    CRANNY_DEPTH_LINEAR,     /* metres along −Z, positive */
    CRANNY_DEPTH_VIEW_Z,     /* view z: metres, negative in front of the camera */
    CRANNY_DEPTH_NORMALIZED, /* (depth − near) / (far − near), also orthographic device depth */
    CRANNY_DEPTH_DEVICE, /* perspective device depth: far (depth − near) / (depth (far − near)) */
    CRANNY_DEPTH_LOGARITHMIC, /* log(c depth + 1) / log(c far + 1) */
};

/* How they are stored. */
enum cranny_depth_format {
    CRANNY_DEPTH_FLOAT32,
    CRANNY_DEPTH_FLOAT16,
    CRANNY_DEPTH_UNORM16,
    CRANNY_DEPTH_UNORM24,      /* low 24 bits of 32 (D24 with the stencil above) */
    CRANNY_DEPTH_UNORM24_HIGH, /* high 24 bits of 32 (GL_UNSIGNED_INT_24_8) */
    CRANNY_DEPTH_UNORM32,
};

/* A depth buffer's convention. Zero-initialised: linear floats, far = 0 (set it where it counts).
 */
struct cranny_depth_layout {
    enum cranny_depth_kind kind;
    enum cranny_depth_format format;
    bool gl_range; /* values run −1 … 1 (OpenGL's NDC) instead of 0 … 1. UNORM formats cannot and
                      hold 0 … 1 all the same; so do depth buffers read back from OpenGL */
    bool reversed; /* 1 is near and 0 (or −1) far; before `gl_range` is undone: near at its top */
    float near_plane;   /* metres, > 0 for DEVICE */
    float far_plane;    /* metres; INFINITY allowed for DEVICE */
    float log_constant; /* c of LOGARITHMIC, > 0 */
};

/* Depth values to linear view depth. Values at or beyond the far plane, and NaN, become +INFINITY
 * (sky); LINEAR and VIEW_Z keep what they are (a wrong sign becomes sky).
 * `input`: height rows, `input_stride` bytes apart (0: tight), of the format's elements.
 * `depth`: width × height floats, `depth_stride` bytes apart (0: tight); may be `input` itself when
 * both are floats of one stride. CRANNY_USAGE for planes that make no sense. */
CRANNY_API enum cranny_status cranny_depth_linearize(const struct cranny_depth_layout *layout,
                                                     int width, int height, const void *input,
                                                     size_t input_stride, float *depth,
                                                     size_t depth_stride, struct cranny_error *why);

/* The inverse, for one depth (metres, +INFINITY for sky) as the float that a buffer would hold. */
CRANNY_API float cranny_depth_encode(const struct cranny_depth_layout *layout, float depth);

/* Projection and depth convention out of a 4×4 matrix that takes view to clip space (column-major
 * as in OpenGL and Vulkan: m[4 * column + row]). `gl_range`: the matrix's depth runs −1 … 1.
 * Reversed and infinite matrices, ones that flip y (Vulkan) and left-handed perspective ones are
 * recognised. `layout`: of the matrix's own depth; clear its gl_range for floats read back from an
 * OpenGL depth buffer, which holds 0 … 1. May be NULL. CRANNY_USAGE when it is neither a
 * perspective nor a parallel projection. */
CRANNY_API enum cranny_status cranny_projection_from_matrix(const float m[16], bool gl_range,
                                                            struct cranny_projection *projection,
                                                            struct cranny_depth_layout *layout,
                                                            struct cranny_error *why);

/* View normals from depth, per pixel the pair of neighbours across which depth bends least, so that
 * edges stay sharp; face normals as HBAO prefers (Bavoil, Sainz 2009). `gbuffer`'s own normals are
 * not read. `normals`: 3 floats a pixel of the viewport, rows `stride` bytes apart (0: tight); sky
 * gets 0 0 1. */
CRANNY_API enum cranny_status cranny_normals_reconstruct(const struct cranny_gbuffer *gbuffer,
                                                         int threads, float *normals, size_t stride,
                                                         struct cranny_error *why);

/* Decode one normal of `format`; not renormalised (octahedral ones are unit as they come). */
CRANNY_API void cranny_normal_decode(enum cranny_normal_format format, const void *stored,
                                     float normal[3]);

/* Encode a unit normal; `stored` has cranny_normal_bytes(format). */
CRANNY_API void cranny_normal_encode(enum cranny_normal_format format, const float normal[3],
                                     void *stored);

/* How serious a finding of the doctor is. */
enum cranny_depth_severity { CRANNY_DEPTH_ERROR, CRANNY_DEPTH_WARNING, CRANNY_DEPTH_NOTE };
typedef void cranny_depth_finding_fn(void *user, enum cranny_depth_severity severity,
                                     const char *code, const char *text);

/* What fits a frame's scale. */
struct cranny_depth_advice {
    float depth_near, depth_median, depth_far; /* metres: 1 %, 50 % and 99 % of what is not sky */
    float radius_world;         /* metres: a tenth of the picture's height at the median depth */
    float bias;                 /* metres: twice what depth noise needs at the median depth */
    float fade_begin, fade_end; /* metres: where the radius covers 4 pixels and one pixel */
};

/* The doctor: what is wrong with a frame, worst first. Finds: NaN and infinities, wrong sign,
 * device depth (also reversed or logarithmic) in place of linear, 16-bit steps, a scale that is no
 * metre's, normals of wrong sign, axis, range or space, or not unit. `text` is one line: what is
 * wrong and what to pass. `advice` may be NULL; all 0 when depth must be converted first. The
 * projection may be left zero: 60° are then assumed, and said. */
CRANNY_API enum cranny_status cranny_gbuffer_check(const struct cranny_gbuffer *gbuffer,
                                                   cranny_depth_finding_fn *report, void *user,
                                                   struct cranny_depth_advice *advice,
                                                   struct cranny_error *why);

#ifdef __cplusplus
}
#endif
#endif
