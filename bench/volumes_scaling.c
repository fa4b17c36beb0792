/* Ambient occlusion volumes of one view at 10 thousand to 2 million triangles: time against what is
 * covered, and memory; times are the processor's, of all threads. The scene is a floor with 64
 * balls, tessellated more and more finely.
 *
 * Usage: bench-volumes_scaling [--markdown] */
#include <cranny/cranny.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { WIDTH = 640, HEIGHT = 360, BALLS = 64, RUNS = 3 };

static const double pi = 3.14159265358979323846;

static enum cranny_status add_mesh(struct cranny_scene *scene, float (*positions)[3],
                                   uint32_t vertices, uint32_t (*triangles)[3], uint32_t count,
                                   uint32_t *index, struct cranny_error *why)
{
    const struct cranny_mesh mesh = {.name = "",
                                     .vertex_count = vertices,
                                     .triangle_count = count,
                                     .positions = (const float(*)[3])positions,
                                     .triangles = (const uint32_t(*)[3])triangles};
    return cranny_scene_add_mesh(scene, &mesh, index, why);
}

/* `rings` × 2 rings quads, radius 0.5. */
static enum cranny_status add_ball(struct cranny_scene *scene, uint32_t rings, uint32_t *index,
                                   struct cranny_error *why)
{
    const uint32_t columns = 2 * rings, vertices = (rings + 1) * columns;
    float(*positions)[3] = calloc(vertices, sizeof *positions);
    uint32_t(*triangles)[3] = calloc((size_t)rings * columns * 2, sizeof *triangles);
    if (!positions || !triangles)
        exit(1);
    uint32_t count = 0;
    for (uint32_t v = 0; v < vertices; v++) {
        const double theta = pi * (v / columns) / rings, phi = 2 * pi * (v % columns) / columns;
        positions[v][0] = (float)(0.5 * sin(theta) * cos(phi));
        positions[v][1] = (float)(0.5 * cos(theta));
        positions[v][2] = (float)(0.5 * sin(theta) * sin(phi));
    }
    for (uint32_t i = 0; i < rings; i++)
        for (uint32_t j = 0; j < columns; j++) {
            const uint32_t a = i * columns + j, b = i * columns + (j + 1) % columns;
            memcpy(triangles[count++], (uint32_t[3]){a, b, a + columns}, sizeof *triangles);
            memcpy(triangles[count++], (uint32_t[3]){b, b + columns, a + columns},
                   sizeof *triangles);
        }
    const enum cranny_status status =
        add_mesh(scene, positions, vertices, triangles, count, index, why);
    free(positions);
    free(triangles);
    return status;
}

static enum cranny_status make_scene(uint32_t rings, struct cranny_scene **scene,
                                     struct cranny_error *why)
{
    float floor[4][3] = {{-6, 0, -6}, {-6, 0, 6}, {6, 0, 6}, {6, 0, -6}};
    uint32_t corners[2][3] = {{0, 1, 2}, {0, 2, 3}}, ball, ground;
    enum cranny_status status = cranny_scene_create(scene, why);
    if (status == CRANNY_OK)
        status = add_ball(*scene, rings, &ball, why);
    if (status == CRANNY_OK)
        status = add_mesh(*scene, floor, 4, corners, 2, &ground, why);
    for (int i = 0; i <= BALLS && status == CRANNY_OK; i++) {
        struct cranny_instance instance = {
            .name = "",
            .mesh = i < BALLS ? ball : ground,
            .world_from_object = {1, 0, 0, i < BALLS ? i % 8 * 1.2 - 4.2 : 0, 0, 1, 0,
                                  i < BALLS ? 0.5 : 0, 0, 0, 1, i < BALLS ? i / 8 * 1.2 - 4.2 : 0}};
        status = cranny_scene_add_instance(*scene, &instance, NULL, why);
    }
    return status;
}

static enum cranny_status draw(const struct cranny_scene *scene, struct cranny_tracer *tracer,
                               struct cranny_frame **frame, struct cranny_error *why)
{
    struct cranny_camera camera;
    struct cranny_frame_params params = cranny_frame_params_default();
    params.width = WIDTH;
    params.height = HEIGHT;
    enum cranny_status status = cranny_camera_look_at((double[3]){3, 4, 8}, (double[3]){0, 0, 0},
                                                      (double[3]){0, 1, 0}, 0.9f, &camera, why);
    if (status == CRANNY_OK)
        status = cranny_frame_create(scene, tracer, &camera, &params, frame, why);
    return status;
}

/* Of all threads: what others do on the machine does not count. */
static double processor_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static enum cranny_status measure(const struct cranny_volumes *volumes,
                                  const struct cranny_frame *frame, double made_ms, bool markdown,
                                  struct cranny_error *why)
{
    static float visibility[WIDTH * HEIGHT];
    struct cranny_volumes_report report;
    struct cranny_volumes_params params = cranny_volumes_params_preset(NULL);
    const struct cranny_gbuffer gbuffer = cranny_frame_gbuffer(frame);
    const struct cranny_volumes_info info = cranny_volumes_info(volumes);
    double least = INFINITY, begin;
    params.report = &report;
    for (int i = 0; i < RUNS; i++) {
        begin = processor_ms();
        const enum cranny_status status =
            cranny_volumes_render(volumes, &gbuffer, &params, visibility, 0, why);
        if (status != CRANNY_OK)
            return status;
        least = fmin(least, processor_ms() - begin);
    }
    printf(markdown ? "| %llu | %llu | %.1f | %.2f | %.2f | %.2f | %.0f | %.0f |\n"
                    : "%8llu triangles, %8llu polygons, %6.1f MB, made in %.2f s (processor); %.2f "
                      "M blocks "
                      "tested, %.2f M evaluated, %.0f ms, %.0f ns a block\n",
           (unsigned long long)info.triangles, (unsigned long long)info.polygons,
           (double)info.size_bytes * 1e-6, 1e-3 * made_ms, (double)report.tested * 1e-6,
           (double)report.evaluated * 1e-6, least, 1e6 * least / (double)report.tested);
    fflush(stdout);
    return CRANNY_OK;
}

static enum cranny_status run(uint32_t rings, bool markdown, struct cranny_error *why)
{
    struct cranny_scene *scene = NULL;
    struct cranny_tracer *tracer = NULL;
    struct cranny_frame *frame = NULL;
    struct cranny_volumes *volumes = NULL;
    double begin = 0;
    enum cranny_status status = make_scene(rings, &scene, why);
    if (status == CRANNY_OK)
        status = cranny_tracer_create(scene, NULL, &tracer, why);
    if (status == CRANNY_OK)
        status = draw(scene, tracer, &frame, why);
    if (status == CRANNY_OK)
        begin = processor_ms();
    if (status == CRANNY_OK)
        status = cranny_volumes_create(scene, NULL, &volumes, why);
    if (status == CRANNY_OK)
        status = measure(volumes, frame, processor_ms() - begin, markdown, why);
    cranny_volumes_destroy(&volumes);
    cranny_frame_destroy(&frame);
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
    return status;
}

int main(int argc, char **argv)
{
    static const uint32_t rings[] = {6, 12, 20, 40, 64, 90};
    const bool markdown = argc > 1 && strcmp(argv[1], "--markdown") == 0;
    struct cranny_error why = {0};
    if (markdown)
        printf("| triangles | polygons | MB | s to make | M blocks tested | M evaluated | ms | ns "
               "a block |\n|---|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < sizeof rings / sizeof *rings; i++) {
        const enum cranny_status status = run(rings[i], markdown, &why);
        if (status != CRANNY_OK) {
            fprintf(stderr, "bench-volumes_scaling: %s\n", why.message);
            return cranny_exit_status(status);
        }
    }
    return 0;
}
