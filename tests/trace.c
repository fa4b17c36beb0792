/* Single rays, the way back from a hit to the scene, alpha, and the tracer's life. */
#include "trace_scenes.h"

#include "base/portable.h"

static struct cranny_hit shoot(const struct cranny_tracer *tracer, const float origin[3],
                               const float direction[3], float *distance)
{
    struct cranny_error why;
    struct cranny_hit hit;
    CHECK_OK(cranny_trace(tracer, 1, (const float(*)[3])origin, (const float(*)[3])direction,
                          distance, &hit, 1, &why),
             why);
    return hit;
}

static void test_portable(void)
{
    double worst = 0;
    for (int i = 0; i <= 200000; i++) {
        const float x = -(float)i * 1e-4f;
        worst = fmax(worst, fabs((double)exp2_negative(x) - exp2((double)x)));
    }
    CHECK_MSG(worst < 2e-7, "exp2_negative is off by %g", worst);
    CHECK(exp2_negative(0) == 1 && exp2_negative(-INFINITY) < 1e-30f);
    double turn_worst = 0;
    for (int i = 0; i < 10000; i++) {
        const double turns = i * 1e-3, angle = turns * 2 * acos(-1);
        float c, s;
        turn_vector(turns, &c, &s);
        turn_worst = fmax(turn_worst, fmax(fabs(c - cos(angle)), fabs(s - sin(angle))));
    }
    CHECK_MSG(turn_worst < 1e-7, "turn_vector is off by %g", turn_worst);
}

/* Triangle, barycentrics and side, for plain, mirrored, and shared instances of one mesh. */
static void test_hits(void)
{
    struct cranny_scene *scene = new_scene();
    const uint32_t ball = sphere_mesh(scene, (double[3]){0, 0, 0}, 1, 16);
    const uint32_t card =
        quad_mesh(scene, (double[3]){0, 0, 0}, (double[3]){1, 0, 0}, (double[3]){0, 2, 0}, 0, 1);
    const double mirrored[12] = {-1, 0, 0, 10, 0, 1, 0, 0, 0, 0, 1, 0};
    const double stretched[12] = {-2, 0, 0, 20, 0, 3, 0, 0, 0, 0, 1, 5};
    add_instance(scene, card, identity);
    add_instance(scene, card, mirrored);
    add_instance(scene, ball, stretched);
    const double single[12] = {1, 0, 0, 30, 0, 1, 0, 0, 0, 0, 1, 0};
    add_instance(scene, ball, single);
    struct cranny_tracer *tracer = new_tracer(scene);
    CHECK(cranny_tracer_bytes(tracer) > 1000);
    float d;
    struct cranny_hit hit = shoot(tracer, (float[3]){0.75f, 0.5f, 3}, (float[3]){0, 0, -1}, &d);
    CHECK_NEAR(d, 3, 1e-6);
    CHECK_INT(hit.instance, 0);
    CHECK_INT(hit.triangle, 0);
    CHECK_NEAR(hit.u, 0.5, 1e-5); /* p = u (1,0) + v (1,2) */
    CHECK_NEAR(hit.v, 0.25, 1e-5);
    CHECK(!hit.back_face);
    hit = shoot(tracer, (float[3]){0.25f, 1.5f, -3}, (float[3]){0, 0, 1}, &d);
    CHECK(hit.back_face && hit.triangle == 1);
    hit = shoot(tracer, (float[3]){9.25f, 0.5f, 3}, (float[3]){0, 0, -1}, &d);
    CHECK_INT(hit.instance, 1);
    CHECK_NEAR(hit.u, 0.5, 1e-5);
    CHECK_NEAR(hit.v, 0.25, 1e-5);
    CHECK(!hit.back_face);
    hit = shoot(tracer, (float[3]){20, 0, 9}, (float[3]){0, 0, -1}, &d);
    CHECK_INT(hit.instance, 2);
    CHECK_NEAR(d, 3, 1e-2);
    CHECK(!hit.back_face);
    hit = shoot(tracer, (float[3]){20.1f, 0.3f, 5}, (float[3]){1, 0, 0}, &d);
    CHECK(hit.back_face && hit.instance == 2);
    hit = shoot(tracer, (float[3]){30, 0, 9}, (float[3]){0, 0, -1}, &d);
    CHECK(!hit.back_face && hit.instance == 3);
    hit = shoot(tracer, (float[3]){50, 0, 9}, (float[3]){0, 0, -1}, &d);
    CHECK(hit.instance == UINT32_MAX && isinf(d));
    cranny_tracer_destroy(&tracer);
    CHECK(tracer == NULL);
    cranny_scene_destroy(&scene);
}

/* The triangle number must survive the split into solid and masked triangles. */
static void test_triangle_numbers(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    struct cranny_material half = cranny_material_default();
    half.alpha_mode = CRANNY_ALPHA_BLEND;
    half.opacity = 0.999999f;
    uint32_t blended;
    CHECK_OK(cranny_scene_add_material(scene, &half, &blended, &why), why);
    float positions[16][3];
    uint32_t corners[8][3], materials[8];
    for (uint32_t i = 0; i < 8; i++) {
        memcpy(positions[2 * i], (float[3]){(float)i, 0, 0}, 12);
        memcpy(positions[2 * i + 1], (float[3]){(float)i, 1, 0}, 12);
        memcpy(corners[i], (uint32_t[3]){2 * i, (2 * i + 2) % 16, 2 * i + 1}, 12);
        materials[i] = i % 3 == 1 ? blended : 0;
    }
    struct cranny_mesh mesh = {.name = "strip",
                               .vertex_count = 16,
                               .triangle_count = 7,
                               .positions = positions,
                               .triangles = corners,
                               .triangle_materials = materials};
    uint32_t index;
    CHECK_OK(cranny_scene_add_mesh(scene, &mesh, &index, &why), why);
    add_instance(scene, index, identity);
    struct cranny_tracer *tracer = new_tracer(scene);
    for (uint32_t i = 0; i < 7; i++) {
        float d;
        struct cranny_hit hit =
            shoot(tracer, (float[3]){(float)i + 0.2f, 0.3f, 1}, (float[3]){0, 0, -1}, &d);
        CHECK_INT(hit.triangle, i);
        CHECK_NEAR(d, 1, 1e-6);
        CHECK_NEAR(hit.u, 0.2, 1e-5);
    }
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
}

/* Share of a grid of rays that a textured quad stops. */
static double stopped_share(const struct cranny_material *material, enum cranny_wrap wrap,
                            float repeat)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    uint8_t checker[64];
    for (int i = 0; i < 64; i++)
        checker[i] = (i % 8 / 4 + i / 32) % 2 ? 255 : 0;
    struct cranny_alpha_texture texture = {8, 8, wrap, wrap, checker};
    CHECK_OK(cranny_scene_add_texture(scene, &texture, NULL, &why), why);
    uint32_t index;
    CHECK_OK(cranny_scene_add_material(scene, material, &index, &why), why);
    add_instance(scene,
                 quad_mesh(scene, (double[3]){0, 0, 0}, (double[3]){1, 0, 0}, (double[3]){0, 1, 0},
                           index, repeat),
                 identity);
    struct cranny_tracer *tracer = new_tracer(scene);
    enum { SIDE = 128 };
    static float origins[SIDE * SIDE][3], directions[SIDE * SIDE][3], distances[SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) {
        memcpy(origins[i],
               (float[3]){((float)(i % SIDE) + 0.5f) / SIDE, ((float)(i / SIDE) + 0.5f) / SIDE, 1},
               12);
        memcpy(directions[i], (float[3]){0, 0, -1}, 12);
    }
    CHECK_OK(cranny_trace(tracer, SIDE * SIDE, (const float(*)[3])origins,
                          (const float(*)[3])directions, distances, NULL, 2, &why),
             why);
    int stopped = 0;
    for (int i = 0; i < SIDE * SIDE; i++)
        stopped += isfinite(distances[i]);
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
    return (double)stopped / (SIDE * SIDE);
}

static void test_alpha(void)
{
    struct cranny_material material = cranny_material_default();
    material.alpha_mode = CRANNY_ALPHA_MASK;
    material.alpha_texture = 0;
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_REPEAT, 1), 0.5, 0.01);
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_REPEAT, 4), 0.5, 0.01);
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_MIRROR, 4), 0.5, 0.01);
    /* Clamped, texcoords 0 to 2: the second half of each axis repeats the edge texels. */
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_CLAMP, 2), 3.0 / 8, 0.01);
    /* Scaled into the solid quarter u > ½, v < ½ by the texture transform. */
    memcpy(material.uv_transform, (float[6]){0.25f, 0, 0.625f, 0, 0.25f, 0.125f}, 24);
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_REPEAT, 1), 1, 0);
    memcpy(material.uv_transform, (float[6]){1, 0, 0, 0, 1, 0}, 24);
    material.opacity = 0.4f; /* never reaches the cutoff */
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_REPEAT, 1), 0, 0);
    material.alpha_mode = CRANNY_ALPHA_BLEND;
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_REPEAT, 1), 0.2, 0.01);
    material.alpha_texture = -1;
    material.opacity = 0.3f;
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_REPEAT, 1), 0.3, 0.01);
    material.opacity = 0;
    CHECK_NEAR(stopped_share(&material, CRANNY_WRAP_REPEAT, 1), 0, 0);
}

static void test_ground(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    add_instance(scene, box_mesh(scene, (float[3]){-1, 0.5f, -1}, (float[3]){1, 2, 1}, false),
                 identity);
    struct cranny_tracer_params params = cranny_tracer_params_default();
    params.ground = true;
    struct cranny_tracer *tracer;
    CHECK_OK(cranny_tracer_create(scene, &params, &tracer, &why), why);
    float d;
    struct cranny_hit hit = shoot(tracer, (float[3]){5, 3, 0}, (float[3]){0, -1, 0}, &d);
    CHECK_NEAR(d, 2.5, 1e-6);
    CHECK(hit.instance == UINT32_MAX && !hit.back_face);
    hit = shoot(tracer, (float[3]){0, 3, 0}, (float[3]){0, -1, 0}, &d);
    CHECK_NEAR(d, 1, 1e-6);
    CHECK_INT(hit.instance, 0);
    shoot(tracer, (float[3]){5, 0, 0}, (float[3]){0, 1, 0}, &d);
    CHECK(isinf(d));
    cranny_tracer_destroy(&tracer);
    params.ground_height = -1;
    CHECK_OK(cranny_tracer_create(scene, &params, &tracer, &why), why);
    shoot(tracer, (float[3]){5, 3, 0}, (float[3]){0, -1, 0}, &d);
    CHECK_NEAR(d, 4, 1e-6);
    cranny_tracer_destroy(&tracer);
    params.ground_height = INFINITY;
    CHECK_INT(cranny_tracer_create(scene, &params, &tracer, &why), CRANNY_USAGE);
    CHECK(tracer == NULL);
    cranny_scene_destroy(&scene);
}

/* No triangles, no area, huge numbers, singular transforms: rays miss, nothing breaks. */
static void test_hostile(void)
{
    float d;
    struct cranny_scene *scene = new_scene();
    struct cranny_tracer *tracer = new_tracer(scene);
    shoot(tracer, (float[3]){0, 1, 0}, (float[3]){0, -1, 0}, &d);
    CHECK(isinf(d));
    cranny_tracer_destroy(&tracer);
    const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3e38f, -3e38f, 1}};
    const uint32_t corners[4][3] = {{0, 0, 0}, {0, 1, 2}, {1, 1, 2}, {0, 1, 3}};
    const uint32_t mesh = add_mesh(scene, 4, positions, NULL, 4, corners, 0);
    const uint32_t empty = add_mesh(scene, 0, positions, NULL, 0, corners, 0);
    const double flat[12] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0};
    const double huge[12] = {1e300, 0, 0, 0, 0, 1e300, 0, 0, 0, 0, 1e300, 0};
    const double zero[12] = {0};
    add_instance(scene, mesh, identity);
    add_instance(scene, mesh, flat);
    add_instance(scene, mesh, huge);
    add_instance(scene, mesh, zero);
    add_instance(scene, empty, identity);
    const uint32_t ball = sphere_mesh(scene, (double[3]){0, 0, 0}, 1, 16);
    add_instance(scene, ball, flat);
    add_instance(scene, ball, zero);
    add_instance(scene, ball, huge);
    tracer = new_tracer(scene);
    struct cranny_hit hit = shoot(tracer, (float[3]){0.5f, 3, 0.25f}, (float[3]){0, -1, 0}, &d);
    CHECK_NEAR(d, 3, 1e-6); /* the ball pressed flat */
    CHECK_INT(hit.instance, 5);
    cranny_tracer_destroy(&tracer);
    cranny_tracer_destroy(&tracer);
    cranny_tracer_destroy(NULL);
    cranny_scene_destroy(&scene);
}

static bool refuse(void *user, const char *stage, double done, double total)
{
    (void)done;
    (void)total;
    int *calls = user;
    ++*calls;
    return strcmp(stage, "bvh") != 0;
}

static void test_cancel(void)
{
    struct cranny_error why;
    struct cranny_scene *scene = new_scene();
    add_instance(scene, sphere_mesh(scene, (double[3]){0, 0, 0}, 1, 300), identity);
    int calls = 0;
    const struct cranny_hooks hooks = {.user = &calls, .progress = refuse};
    struct cranny_tracer_params params = cranny_tracer_params_default();
    params.hooks = &hooks;
    struct cranny_tracer *tracer = (struct cranny_tracer *)&calls;
    CHECK_INT(cranny_tracer_create(scene, &params, &tracer, &why), CRANNY_CANCELLED);
    CHECK(tracer == NULL && calls > 0);
    cranny_scene_destroy(&scene);
}

int main(void)
{
    test_portable();
    test_hits();
    test_triangle_numbers();
    test_alpha();
    test_ground();
    test_hostile();
    test_cancel();
    return check_end("trace");
}
