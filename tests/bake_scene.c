/* Whole bakes of small made-up scenes: buried geometry, instances, threads, odd input. */
#include "bake_scenes.h"

#include <cranny/cranny.h>

typedef float vec3[3];

/* A box from its corners, outward faces, `side` × `side` quads a face, flat normals. */
struct box {
    vec3 positions[6 * 17 * 17], normals[6 * 17 * 17];
    uint32_t triangles[6 * 2 * 16 * 16][3];
    struct cranny_mesh mesh;
};

static void make_box(struct box *box, uint32_t side, float half)
{
    const uint32_t n = side + 1;
    uint32_t vertices = 0, triangles = 0;
    for (uint32_t face = 0; face < 6; face++) {
        const uint32_t axis = face / 2, a = (axis + 1) % 3, b = (axis + 2) % 3, first = vertices;
        const bool positive = face % 2;
        for (uint32_t i = 0; i < n * n; i++, vertices++) {
            float *p = box->positions[vertices];
            memset(box->normals[vertices], 0, sizeof(vec3));
            box->normals[vertices][axis] = positive ? 1 : -1;
            p[axis] = positive ? half : -half;
            p[a] = half * (2 * (float)(i % n) / (float)side - 1);
            p[b] = half * (2 * (float)(i / n) / (float)side - 1);
        }
        for (uint32_t i = 0; i < side * side; i++) {
            const uint32_t v = first + i / side * n + i % side;
            const uint32_t quad[2][3] = {{v, v + 1, v + n}, {v + 1, v + n + 1, v + n}};
            for (int t = 0; t < 2; t++, triangles++)
                for (int c = 0; c < 3; c++)
                    box->triangles[triangles][c] = quad[t][positive ? c : 2 - c];
        }
    }
    box->mesh = (struct cranny_mesh){.name = "box",
                                     .vertex_count = vertices,
                                     .triangle_count = triangles,
                                     .positions = (const float(*)[3])box->positions,
                                     .normals = (const float(*)[3])box->normals,
                                     .triangles = (const uint32_t(*)[3])box->triangles};
}

static void add_instance(struct cranny_scene *scene, uint32_t mesh, double x, double y, double z,
                         double scale)
{
    struct cranny_error why = {0};
    const struct cranny_instance instance = {
        .name = "",
        .mesh = mesh,
        .world_from_object = {scale, 0, 0, x, 0, scale, 0, y, 0, 0, scale, z}};
    CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
}

/* An open sheet that passes through a box: its middle lies inside. */
static struct cranny_scene *soup_scene(struct box *box, struct box *fine)
{
    struct cranny_scene *scene = empty_scene();
    make_box(box, 8, 1);
    make_box(fine, 16, 1);
    const uint32_t coarse = add_mesh(scene, &box->mesh), small = add_mesh(scene, &fine->mesh);
    add_instance(scene, coarse, 0, 0, 0, 1);
    add_instance(scene, coarse, 0.9, 0.6, 0.4, 1);
    add_instance(scene, small, -0.7, 0.8, -0.5, 0.9);
    /* Open: the top face of a box alone, cutting through the others. */
    struct cranny_mesh sheet = fine->mesh;
    sheet.name = "sheet";
    sheet.triangles = fine->mesh.triangles + 3 * 512;
    sheet.triangle_count = 512;
    add_instance(scene, add_mesh(scene, &sheet), 0, -2.7, 0, 3);
    return scene;
}

/* Outside all solids and not below the sheet: what a viewer sees. */
static bool outside_boxes(const double p[3])
{
    static const double centres[3][4] = {{0, 0, 0, 1}, {0.9, 0.6, 0.4, 1}, {-0.7, 0.8, -0.5, 0.9}};
    for (int b = 0; b < 3; b++) {
        double reach = 0;
        for (int k = 0; k < 3; k++)
            reach = fmax(reach, fabs(p[k] - centres[b][k]));
        if (reach < centres[b][3] - 1e-6)
            return false;
    }
    return p[1] > 0.3 - 1e-6; /* below the sheet all see its back */
}

/* Faces in the open, at their centres, against rays from there: how much too dark at worst. */
static double worst_leak(const struct cranny_scene *scene, const struct cranny_bake *bake,
                         const struct cranny_tracer *tracer, double *darkest)
{
    double worst = 0;
    *darkest = 1;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const struct cranny_instance *instance = cranny_scene_instance(scene, i);
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, instance->mesh);
        const float *values = cranny_bake_values(bake, i, CRANNY_CHANNEL_VISIBILITY);
        for (uint32_t t = 0; t < mesh->triangle_count; t++) {
            vec3 point = {0}, normal = {0};
            double world[3][3], value = 0, centre[3] = {0};
            bool outside = true;
            for (int c = 0; c < 3; c++) {
                for (int k = 0; k < 3; k++) {
                    const double *m = instance->world_from_object;
                    world[c][k] =
                        m[4 * k + k] * mesh->positions[mesh->triangles[t][c]][k] + m[4 * k + 3];
                    centre[k] += world[c][k] / 3;
                }
                outside = outside && outside_boxes(world[c]);
                value += values[mesh->triangles[t][c]] / 3;
            }
            if (!outside)
                continue;
            for (int k = 0; k < 3; k++) {
                const int a = (k + 1) % 3, b = (k + 2) % 3;
                normal[k] = (float)((world[1][a] - world[0][a]) * (world[2][b] - world[0][b]) -
                                    (world[1][b] - world[0][b]) * (world[2][a] - world[0][a]));
                point[k] = (float)centre[k];
            }
            const float length =
                sqrtf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
            for (int k = 0; k < 3; k++)
                normal[k] /= length;
            struct cranny_gather_params gather = cranny_gather_params_default();
            gather.rays = 64;
            vec3 points[1] = {{point[0], point[1], point[2]}};
            vec3 normals[1] = {{normal[0], normal[1], normal[2]}};
            float truth[1][2];
            struct cranny_error why = {0};
            CHECK_OK(cranny_gather(tracer, 1, (const float(*)[3])points, (const float(*)[3])normals,
                                   NULL, &gather, truth, NULL, &why),
                     why);
            worst = fmax(worst, 0.97 * truth[0][0] + 0.03 * truth[0][1] - value);
            *darkest = fmin(*darkest, value);
        }
    }
    return worst;
}

static void soup_does_not_leak(void)
{
    struct cranny_error why = {0};
    struct box *box = malloc(sizeof *box), *fine = malloc(sizeof *fine);
    struct cranny_scene *scene = soup_scene(box, fine);
    struct cranny_tracer *tracer = NULL;
    CHECK_OK(cranny_tracer_create(scene, NULL, &tracer, &why), why);
    static const int rays[] = {8, 64};
    for (int i = 0; i < 2; i++) {
        struct cranny_bake_params params = cranny_bake_params_default();
        params.rays = rays[i];
        double darkest[2];
        struct cranny_bake *with = bake_scene(scene, &params);
        params.back_limit = 1;
        struct cranny_bake *without = bake_scene(scene, &params);
        const double clean = worst_leak(scene, with, tracer, &darkest[0]);
        const double leaky = worst_leak(scene, without, tracer, &darkest[1]);
        printf("soup at %d rays: worst leak %.3f with invalidation, %.3f without; darkest %.3f, "
               "%.3f\n",
               rays[i], clean, leaky, darkest[0], darkest[1]);
        CHECK_MSG(leaky > 0.2, "no leak to cure: %g", leaky);
        CHECK_MSG(clean < 0.1, "leak of %g", clean);
        struct cranny_bake_report report;
        cranny_bake_get_report(with, &report);
        CHECK(report.invalid_samples > 0 && report.invalid_samples < report.samples / 2);
        CHECK(report.unsampled_vertices > 0);
        CHECK_INT(report.instances, 4);
        cranny_bake_destroy(&with);
        cranny_bake_destroy(&without);
        CHECK(with == NULL);
    }
    cranny_tracer_destroy(&tracer);
    cranny_scene_destroy(&scene);
    free(box);
    free(fine);
}

static bool same_values(const struct cranny_scene *scene, const struct cranny_bake *a,
                        const struct cranny_bake *b)
{
    bool same = true;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const uint32_t mesh = cranny_scene_instance(scene, i)->mesh;
        const size_t size = cranny_scene_mesh(scene, mesh)->vertex_count * sizeof(float);
        for (int c = CRANNY_CHANNEL_VISIBILITY; c <= CRANNY_CHANNEL_SHORT; c++)
            same = same && memcmp(cranny_bake_values(a, i, (enum cranny_channel)c),
                                  cranny_bake_values(b, i, (enum cranny_channel)c), size) == 0;
    }
    return same;
}

static void threads_give_the_same_bits(void)
{
    struct box *box = malloc(sizeof *box), *fine = malloc(sizeof *fine);
    struct cranny_scene *scene = soup_scene(box, fine);
    for (int fit = CRANNY_FIT_LEAST_SQUARES; fit <= CRANNY_FIT_VERTEX; fit++) {
        for (int mode = CRANNY_INSTANCES_SPLIT; mode <= CRANNY_INSTANCES_SHARED; mode++) {
            struct cranny_bake_params params = cranny_bake_params_default();
            params.fit = fit;
            params.instances = mode;
            params.adaptive = mode == CRANNY_INSTANCES_SHARED;
            params.threads = 1;
            struct cranny_bake *one = bake_scene(scene, &params);
            params.threads = 2;
            struct cranny_bake *two = bake_scene(scene, &params);
            params.threads = 7;
            struct cranny_bake *seven = bake_scene(scene, &params);
            CHECK(same_values(scene, one, two));
            CHECK(same_values(scene, one, seven));
            params.seed = 5;
            struct cranny_bake *other = bake_scene(scene, &params);
            CHECK(!same_values(scene, one, other));
            cranny_bake_destroy(&one);
            cranny_bake_destroy(&two);
            cranny_bake_destroy(&seven);
            cranny_bake_destroy(&other);
        }
    }
    cranny_scene_destroy(&scene);
    free(box);
    free(fine);
}

/* Two far boxes and one on the ground beside a tall one: split differs, shared is one pointer and
 * lies between. */
static void instances_share_or_split(void)
{
    struct box *box = malloc(sizeof *box);
    struct cranny_scene *scene = empty_scene();
    make_box(box, 4, 1);
    const uint32_t mesh = add_mesh(scene, &box->mesh);
    add_instance(scene, mesh, 0, 0, 0, 1);
    add_instance(scene, mesh, 2.1, 0, 0, 1);
    add_instance(scene, mesh, 0, 0, 90, 1);
    add_instance(scene, mesh, 0, 0, 180, 0); /* flattened to a point */
    struct cranny_bake_params params = cranny_bake_params_default();
    params.rays = 64;
    params.instances = CRANNY_INSTANCES_SPLIT;
    struct cranny_bake *split = bake_scene(scene, &params);
    params.instances = CRANNY_INSTANCES_SHARED;
    struct cranny_bake *shared = bake_scene(scene, &params);
    params.instances = CRANNY_INSTANCES_AUTO;
    params.split_limit = 2;
    struct cranny_bake *limited = bake_scene(scene, &params);
    const float *a = cranny_bake_values(split, 0, CRANNY_CHANNEL_VISIBILITY);
    const float *b = cranny_bake_values(split, 1, CRANNY_CHANNEL_VISIBILITY);
    const float *c = cranny_bake_values(split, 2, CRANNY_CHANNEL_VISIBILITY);
    const float *s = cranny_bake_values(shared, 0, CRANNY_CHANNEL_VISIBILITY);
    CHECK(a != b && b != c);
    CHECK(s == cranny_bake_values(shared, 2, CRANNY_CHANNEL_VISIBILITY));
    CHECK(same_values(scene, shared, limited));
    double worst = 0, apart = 0;
    for (uint32_t v = 0; v < box->mesh.vertex_count; v++) {
        worst = fmax(worst, fabs((a[v] + b[v] + c[v]) / 3 - s[v]));
        apart = fmax(apart, fabs(a[v] - c[v]));
    }
    CHECK_MSG(apart > 0.3, "the neighbour darkens by %g", apart);
    CHECK_MSG(worst < 0.12, "shared values differ from the mean by %g", worst);
    CHECK_NEAR(cranny_bake_values(split, 3, CRANNY_CHANNEL_LONG)[0], 1, 0);
    struct cranny_bake_report report;
    cranny_bake_get_report(shared, &report);
    CHECK_INT(report.meshes, 1);
    cranny_bake_get_report(split, &report);
    CHECK_INT(report.meshes, 4);
    cranny_bake_destroy(&split);
    cranny_bake_destroy(&shared);
    cranny_bake_destroy(&limited);
    cranny_scene_destroy(&scene);
    free(box);
}

/* A convex body in the open sees nothing of itself: 1 everywhere, with every fit; the ground plane
 * under it darkens the sides to about a half. */
static void open_box_is_white(void)
{
    struct box *box = malloc(sizeof *box);
    struct cranny_scene *scene = empty_scene();
    make_box(box, 6, 1);
    add_instance(scene, add_mesh(scene, &box->mesh), 1000, 3, -2000, 1);
    for (int fit = CRANNY_FIT_LEAST_SQUARES; fit <= CRANNY_FIT_VERTEX; fit++) {
        struct cranny_bake_params params = cranny_bake_params_default();
        params.fit = fit;
        struct cranny_bake *bake = bake_scene(scene, &params);
        const float *values = cranny_bake_values(bake, 0, CRANNY_CHANNEL_VISIBILITY);
        for (uint32_t v = 0; v < box->mesh.vertex_count; v++)
            CHECK_NEAR(values[v], 1, 1e-3);
        cranny_bake_destroy(&bake);
    }
    struct cranny_bake_params params = cranny_bake_params_default();
    params.ground = true;
    params.distance_long = 1e9f;
    params.short_weight = 0;
    struct cranny_bake *bake = bake_scene(scene, &params);
    const float *values = cranny_bake_values(bake, 0, CRANNY_CHANNEL_VISIBILITY);
    for (uint32_t v = 0; v < box->mesh.vertex_count; v++)
        if (box->positions[v][1] < 0.9f && box->positions[v][1] > -0.9f)
            CHECK_NEAR(values[v], 0.5, 0.03);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
    free(box);
}

static bool stop_at_once(void *user, const char *stage, double done, double total)
{
    (void)done;
    (void)total;
    return strcmp(stage, user) != 0;
}

static void odd_input_is_refused(void)
{
    struct cranny_error why = {0};
    struct cranny_scene *scene = empty_scene();
    struct cranny_bake *bake;
    CHECK_INT(cranny_bake_create(scene, NULL, &bake, &why), CRANNY_INPUT);
    CHECK(bake == NULL);
    const vec3 line[4] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 5, 5}};
    const uint32_t flat[2][3] = {{0, 1, 2}, {1, 1, 1}};
    const struct cranny_mesh needle = {
        .name = "", .vertex_count = 4, .triangle_count = 2, .positions = line, .triangles = flat};
    add_instance(scene, add_mesh(scene, &needle), 0, 0, 0, 1);
    CHECK_INT(cranny_bake_create(scene, NULL, &bake, &why), CRANNY_INPUT);
    CHECK(strstr(why.message, "area") != NULL);
    /* With one good triangle it bakes; the vertex that nothing uses is white. */
    const vec3 corners[5] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {2, 0, 0}};
    const uint32_t mixed[3][3] = {{0, 1, 2}, {0, 1, 4}, {2, 2, 1}};
    const struct cranny_mesh usable = {.name = "",
                                       .vertex_count = 5,
                                       .triangle_count = 3,
                                       .positions = corners,
                                       .triangles = mixed};
    add_instance(scene, add_mesh(scene, &usable), 0, 0, 0, 1);
    bake = bake_scene(scene, NULL);
    const float *values = cranny_bake_values(bake, 1, CRANNY_CHANNEL_VISIBILITY);
    for (int v = 0; v < 5; v++)
        CHECK(values[v] > 0.9f && values[v] <= 1);
    CHECK_NEAR(values[3], 1, 0);
    cranny_bake_destroy(&bake);
    struct cranny_bake_params params = cranny_bake_params_default();
    params.rays = 0;
    CHECK_INT(cranny_bake_create(scene, &params, &bake, &why), CRANNY_USAGE);
    params = cranny_bake_params_default();
    params.samples_min = 9;
    params.samples_max = 8;
    CHECK_INT(cranny_bake_create(scene, &params, &bake, &why), CRANNY_USAGE);
    static const char *const stages[] = {"trace", "solve"};
    for (int i = 0; i < 2; i++) {
        const struct cranny_hooks hooks = {.user = (void *)stages[i], .progress = stop_at_once};
        params = cranny_bake_params_default();
        params.hooks = &hooks;
        CHECK_INT(cranny_bake_create(scene, &params, &bake, &why), CRANNY_CANCELLED);
        CHECK(bake == NULL);
    }
    cranny_scene_destroy(&scene);
}

static void remapping(void)
{
    struct box *box = malloc(sizeof *box), *fine = malloc(sizeof *fine);
    struct cranny_scene *scene = soup_scene(box, fine);
    struct cranny_bake_params params = cranny_bake_params_default();
    params.short_weight = 0.25f;
    params.intensity = 1.5f;
    params.contrast = 2;
    struct cranny_bake *bake = bake_scene(scene, &params);
    const float *v = cranny_bake_values(bake, 0, CRANNY_CHANNEL_VISIBILITY);
    const float *l = cranny_bake_values(bake, 0, CRANNY_CHANNEL_LONG);
    const float *s = cranny_bake_values(bake, 0, CRANNY_CHANNEL_SHORT);
    double least = 1, sums[2] = {0, 0};
    for (uint32_t i = 0; i < box->mesh.vertex_count; i++) {
        const double blend = fmax(1 - 1.5 * (1 - (0.75 * l[i] + 0.25 * s[i])), 0);
        CHECK_NEAR(v[i], blend * blend, 1e-5);
        least = fmin(least, v[i]);
        sums[0] += l[i];
        sums[1] += s[i];
    }
    CHECK(sums[0] < sums[1]); /* the short distance forgives what is near */
    CHECK(least < 0.7);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
    free(box);
    free(fine);
}

static void table_and_defaults_agree(void)
{
    struct cranny_error why = {0};
    const struct cranny_param_table *table = cranny_bake_param_table();
    struct cranny_bake_params params = cranny_bake_params_default();
    CHECK_OK(cranny_params_validate(table, &params, &why), why);
    for (size_t i = 0; i < table->row_count; i++) {
        char text[64];
        CHECK(table->rows[i].help && *table->rows[i].help);
        CHECK(cranny_params_get(table, &params, table->rows[i].name, text, sizeof text) > 0);
        CHECK_OK(cranny_params_set(table, &params, table->rows[i].name, text, &why), why);
    }
}

int main(void)
{
    table_and_defaults_agree();
    open_box_is_white();
    soup_does_not_leak();
    instances_share_or_split();
    odd_input_is_refused();
    remapping();
    threads_give_the_same_bits();
    return check_end("bake_scene");
}
