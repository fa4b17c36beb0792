/* Where the samples of a pixel lie: the standard patterns that Vulkan 1.3 (§26.4) and Direct3D
 * prescribe, in sixteenths of a pixel. */
#include <cranny/gbuffer.h>

#define AT(x, y)                                                                                   \
    {                                                                                              \
        (x) / 16.0f, (y) / 16.0f                                                                   \
    }

static const float one[1][2] = {AT(8, 8)};
static const float two[2][2] = {AT(12, 12), AT(4, 4)};
static const float four[4][2] = {AT(6, 2), AT(14, 6), AT(2, 10), AT(10, 14)};
static const float eight[8][2] = {AT(9, 5),  AT(7, 11), AT(13, 9),  AT(5, 3),
                                  AT(3, 13), AT(1, 7),  AT(11, 15), AT(15, 1)};

const float (*cranny_sample_positions(int count))[2]
{
    return count <= 1 ? one : count == 2 ? two : count <= 4 ? four : eight;
}
