#version 450
#extension GL_GOOGLE_include_directive : require
/* cranny/runtime.h is GLSL, too. */
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer harmonics_buffer { float harmonics[]; };
layout(std430, binding = 1) writeonly buffer result_buffer { int bits[]; };

#include "cranny/runtime.h"

void main()
{
    const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    float sphere[9], convolved[9], linear[4], normal[3] = float[3](0.0, 1.0, 0.0);
    for (int i = 0; i < 9; i++)
        sphere[i] = harmonics[i];
    for (int i = 0; i < 4; i++)
        linear[i] = harmonics[9 + i];
    cranny_sh_convolve(sphere, convolved);
    const float part[4] = float[4](convolved[0], convolved[1], convolved[2], convolved[3]);
    const float local = cranny_sh9_visibility(convolved, normal) * cranny_sh4_visibility(part, normal);
    const float value = cranny_linear_visibility(linear, normal, local);
    const int packed = cranny_pack5(value, cranny_dither(pixel.x, pixel.y));
    bits[pixel.y * 1024 + pixel.x] = cranny_pack5(cranny_unpack5(packed), 0.5);
}
