/* Pixels and view space, for all estimators, in the common subset of C and GLSL.
 *
 * The including file says what the rest means: kernels_body.h for C, glsl.h for GLSL. lane_f is a
 * float of each pixel at hand (float in GLSL), float one number for all. VIEW and K are the canvas
 * and the constants; VIEW_ARG, VIEW_PASS and the like hand them on in C, and are empty in GLSL,
 * where they are bound. */
#ifndef EQUATIONS_VIEW_H
#define EQUATIONS_VIEW_H

/* The pixel that is estimated. */
struct pixel {
    lane_f x, y, depth;
    lane_3 position, normal;   /* view space */
    lane_f cosine, sine;       /* of the pixel's own turn */
    lane_f jitter;             /* [0, 1) */
    lane_f radius_x, radius_y; /* the radius projected, in pixels */
};
RECORD(pixel)

/* What a read at some place of the picture found. */
struct surface {
    lane_3 position;
    lane_f depth;
    lane_b counts; /* inside the frame, or clamped to it by choice */
    lane_i index;
};
RECORD(surface)

/* A place in the picture, in pixels. */
struct place {
    lane_f x, y;
};
RECORD(place)

FUNCTION lane_f view_w(VIEW_ARG lane_f depth)
{
    return VIEW(orthographic) != 0 ? splat(1.0f) : depth;
}

FUNCTION lane_3 view_position(VIEW_ARG lane_f x, lane_f y, lane_f depth)
{
    const lane_f w = view_w(VIEW_PASS depth);
    return vec3_((x * VIEW(scale_x) + VIEW(shift_x)) * w, (y * VIEW(scale_y) + VIEW(shift_y)) * w,
                 -depth);
}

/* The surface seen by the pixel whose square holds (x, y): coordinates are snapped to centres, so
 * that the depth belongs to the place (Bavoil, Sainz 2009, "Snapping Texture Coordinates"). */
FUNCTION surface read_surface(VIEW_ARG lane_f x, lane_f y, int clamped)
{
    surface s;
    const lane_f fx = x + 0.5f, fy = y + 0.5f;
    const lane_f width = splat(float_(VIEW(width))), height = splat(float_(VIEW(height)));
    const lane_f zero = splat(0.0f);
    const lane_i ix = to_int(min_(max_(fx, zero), width - 0.5f));
    const lane_i iy = to_int(min_(max_(fy, zero), height - 0.5f));
    s.index = iy * int_(VIEW(stride)) + ix;
    s.depth = READ_DEPTH(s.index);
    s.position = view_position(VIEW_PASS to_float(ix), to_float(iy), s.depth);
    s.counts = and_(and_(not_(less_(fx, zero)), less_(fx, width)),
                    and_(not_(less_(fy, zero)), less_(fy, height)));
    if (clamped != 0)
        s.counts = or_(s.counts, not_(s.counts));
    return s;
}

/* Where a point of view space lies in the picture. */
FUNCTION place project(VIEW_ARG lane_3 p)
{
    const lane_f inverse = 1.0f / view_w(VIEW_PASS max_(-p.z, splat(1e-6f)));
    const float ix = 1.0f / VIEW(scale_x), iy = 1.0f / VIEW(scale_y);
    place at;
    at.x = clamp_((p.x * inverse - VIEW(shift_x)) * ix, -1e6f, 1e6f);
    at.y = clamp_((p.y * inverse - VIEW(shift_y)) * iy, -1e6f, 1e6f);
    return at;
}

/* How much an occluder at distance `d`, squared `d2`, counts; enum cranny_falloff. */
FUNCTION lane_f falloff_(CONSTANTS_ARG lane_f d2, lane_f d)
{
    const lane_f q = d2 * (K(inverse_radius) * K(inverse_radius));
    if (K(falloff) == 0)
        return select_(less_(q, splat(1.0f)), splat(1.0f), splat(0.0f));
    if (K(falloff) == 1)
        return max_(1.0f - q, splat(0.0f));
    if (K(falloff) == 2)
        return max_(1.0f - d * K(inverse_radius), splat(0.0f));
    const lane_f s = max_(1.0f - q, splat(0.0f));
    return s * s;
}

/* intensity and contrast, on the mean of the occlusion. */
FUNCTION lane_f finish_(CONSTANTS_ARG lane_f occlusion)
{
    const lane_f v = saturate_(1.0f - occlusion * K(amount));
    if (K(contrast) == 1.0f)
        return v;
    return pow_(v, K(contrast));
}

#endif
