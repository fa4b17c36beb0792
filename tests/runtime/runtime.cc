// cranny/runtime.h is C++, too.
#include <cranny/runtime.h>

int main()
{
    const float normal[3] = {0, 1, 0}, sphere[9] = {3.5449077f};
    float convolved[9];
    cranny_sh_convolve(sphere, convolved);
    const float open = cranny_sh9_visibility(convolved, normal);
    return cranny_pack5(open, cranny_dither(3, 5)) == 31 &&
                   cranny_sh4_visibility(convolved, normal) > 0.999f
               ? 0
               : 1;
}
