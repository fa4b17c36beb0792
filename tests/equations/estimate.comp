#version 450
#extension GL_GOOGLE_include_directive : require
/* Shows that the equations are GLSL, too: each method's estimator as a compute shader. Compiled with
 * -DMETHOD=alchemy_estimate and the like. */
layout(local_size_x = 8, local_size_y = 8) in;

struct view_block {
    int width, height, stride, orthographic;
    float scale_x, shift_x, scale_y, shift_y;
};
struct constants_block {
    float radius, radius2, inverse_radius, amount, contrast, bias, epsilon, limit_px;
    float sine_bias, cosine_bias, range_default, thickness, minimum_crease, crease_scale;
    float kernel_x, kernel_y, kernel_z, band_begin;
    int samples, directions, steps, bands, falloff, cosine, spread, curve, facing, world, mirror, clamp;
    vec4 table[256];
};
layout(std430, binding = 0) readonly buffer view_buffer { view_block view; };
layout(std430, binding = 1) readonly buffer constants_buffer { constants_block constants; };
layout(std430, binding = 2) readonly buffer depth_buffer { float frame_depth[]; };
layout(std430, binding = 3) readonly buffer normal_buffer { vec4 frame_normal[]; };
layout(std430, binding = 4) writeonly buffer result_buffer { float visibility[]; };

#include "screen/equations/glsl.h"

#include "screen/equations/view.h"

#include "screen/equations/alchemy.h"
#include "screen/equations/crease.h"
#include "screen/equations/hbao.h"
#include "screen/equations/raymarch.h"
#include "screen/equations/ssao.h"

void main()
{
    const ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (at.x >= view.width || at.y >= view.height)
        return;
    const int index = at.y * view.stride + at.x;
    pixel p;
    p.x = float(at.x);
    p.y = float(at.y);
    p.depth = frame_depth[index];
    p.position = view_position(p.x, p.y, p.depth);
    p.normal = frame_normal[index].xyz;
    p.cosine = 1.0;
    p.sine = 0.0;
    p.jitter = 0.5;
    p.radius_x = constants.radius / (abs(view.scale_x) * view_w(p.depth));
    p.radius_y = constants.radius / (abs(view.scale_y) * view_w(p.depth));
    visibility[index] = METHOD(p);
}
