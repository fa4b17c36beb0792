/* Visibility from a depth image: depth_to_ao DEPTH.exr FOV OUT.png. Depth is metres along the view,
 * FOV degrees from bottom to top. */
#include <cranny/cranny.h>
#include <stdio.h>
#include <stdlib.h>

static int complain(const struct cranny_error *why)
{
    fprintf(stderr, "depth_to_ao: %s\n", why->message);
    return 1;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        fprintf(stderr, "usage: depth_to_ao DEPTH.exr FOV OUT.png\n");
        return 2;
    }
    struct cranny_error why;
    struct cranny_image depth;
    if (cranny_image_read(argv[1], CRANNY_IMAGE_DEPTH, &depth, &why) != CRANNY_OK)
        return complain(&why);

    const float fov_y = (float)(atof(argv[2]) * 3.14159265 / 180);
    const struct cranny_gbuffer frame = {
        .width = depth.width,
        .height = depth.height,
        .depth = depth.pixels, /* without normals they are reconstructed */
        .projection = cranny_perspective(fov_y, (float)depth.width / (float)depth.height),
    };
    struct cranny_screen_params params = cranny_screen_params_preset(CRANNY_ALCHEMY, "calibrated");
    params.radius_world = 0.5f;

    float *visibility = malloc(sizeof *visibility * (size_t)depth.width * (size_t)depth.height);
    enum cranny_status status = CRANNY_MEMORY;
    snprintf(why.message, sizeof why.message, "out of memory");
    if (visibility)
        status = cranny_screen_render(&frame, &params, visibility, 0, &why);
    if (status == CRANNY_OK)
        status = cranny_image_write(argv[3], CRANNY_IMAGE_VALUE, CRANNY_IMAGE_BITS8, depth.width,
                                    depth.height, 1, visibility, 0, &why);
    free(visibility);
    cranny_image_free(&depth);
    return status == CRANNY_OK ? 0 : complain(&why);
}
