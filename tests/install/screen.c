/* A renderer's program with the screen component alone: a wall on a floor is darkest where they
 * meet. The parts that need rays must not come along. */
#include <cranny/compare.h>
#include <cranny/filter.h>
#include <cranny/gbuffer.h>
#include <cranny/image.h>
#include <cranny/screen.h>
#include <stdio.h>

#if defined(CRANNY_SCENE_H) || defined(CRANNY_TRACE_H) || defined(CRANNY_CRANNY_H)
#    error "a header of the screen component includes one that is not"
#endif

enum { SIDE = 64 };

static float depth[SIDE * SIDE], seen[SIDE * SIDE], smooth[SIDE * SIDE];

static float mean_of_rows(int from, int to)
{
    float sum = 0;
    for (int i = from * SIDE; i < to * SIDE; i++)
        sum += smooth[i];
    return sum / (float)((to - from) * SIDE);
}

int main(void)
{
    struct cranny_error why = {CRANNY_OK, ""};
    struct cranny_gbuffer frame = {
        .width = SIDE, .height = SIDE, .depth = depth, .projection = cranny_perspective(1, 1)};
    for (int i = 0; i < SIDE * SIDE; i++) {
        const float v = frame.projection.top * (1 - (float)(2 * (i / SIDE) + 1) / SIDE);
        depth[i] = v < -0.25f ? -1 / v : 4;
    }
    struct cranny_screen_params params = cranny_screen_params_preset(CRANNY_ALCHEMY, NULL);
    params.radius_world = 1;
    struct cranny_edges *edges = NULL;
    struct cranny_difference change;
    const bool good =
        cranny_screen_render(&frame, &params, seen, 0, &why) == CRANNY_OK &&
        cranny_edges_create(&frame, NULL, &edges, &why) == CRANNY_OK &&
        cranny_filter_bilateral(edges, NULL, seen, 0, smooth, 0, &why) == CRANNY_OK &&
        cranny_difference_measure(SIDE, SIDE, smooth, 0, seen, 0, &change, &why) == CRANNY_OK;
    cranny_edges_destroy(&edges);
    const float corner = mean_of_rows(45, 49), wall = mean_of_rows(4, 20);
    printf("cranny %s: %g in the corner, %g on the wall %s\n", cranny_version(), (double)corner,
           (double)wall, why.message);
    return !good || corner > wall - 0.05f;
}
