/* What a level is made of besides solids: instanced meshes with coefficients, shrubs and grass with
 * one number, lower levels of detail, and the grid around instances. */
#include "bake_scenes.h"

#include "bake/volume.h"
#include "scene/document.h"

#include <cranny/cranny.h>
#include <unistd.h>

#define GRID_MAX 65

/* A field of heights over [−half, half]², front up. */
struct field {
    float positions[GRID_MAX * GRID_MAX][3];
    uint32_t triangles[2 * (GRID_MAX - 1) * (GRID_MAX - 1)][3];
    struct cranny_mesh mesh;
};

typedef float height_fn(float x, float z);

static float flat(float x, float z)
{
    return 0 * x * z;
}

static float waves(float x, float z)
{
    return 0.35f * sinf(2.1f * x) * cosf(1.7f * z);
}

static float dome(float x, float z)
{
    return fmaxf(0, 1 - x * x - z * z);
}

static void make_field(struct field *field, uint32_t side, float half, height_fn *height)
{
    const uint32_t n = side + 1;
    uint32_t count = 0;
    for (uint32_t i = 0; i < n * n; i++) {
        float *p = field->positions[i];
        p[0] = half * (2 * (float)(i % n) / (float)side - 1);
        p[2] = half * (2 * (float)(i / n) / (float)side - 1);
        p[1] = height(p[0], p[2]);
    }
    for (uint32_t i = 0; i < side * side; i++) {
        const uint32_t v = i / side * n + i % side;
        const uint32_t quad[2][3] = {{v, v + n, v + 1}, {v + 1, v + n, v + n + 1}};
        for (int t = 0; t < 2; t++, count++)
            memcpy(field->triangles[count], quad[t], sizeof quad[t]);
    }
    field->mesh = (struct cranny_mesh){.name = "field",
                                       .vertex_count = n * n,
                                       .triangle_count = count,
                                       .positions = (const float(*)[3])field->positions,
                                       .triangles = (const uint32_t(*)[3])field->triangles};
}

/* A quad that stands at x = 0, its front toward +x, 6 m high and wide. */
static const float wall_positions[4][3] = {{0, -1, -3}, {0, -1, 3}, {0, 5, -3}, {0, 5, 3}};
static const uint32_t wall_triangles[4][3] = {{0, 2, 1}, {1, 2, 3}, {0, 1, 2}, {1, 3, 2}};
static const struct cranny_mesh wall_mesh = {.name = "wall",
                                             .vertex_count = 4,
                                             .triangle_count = 4,
                                             .positions = wall_positions,
                                             .triangles = wall_triangles};

struct placing {
    uint32_t mesh;
    double x, y, z, scale, angle; /* about y */
    enum cranny_role role;
    uint32_t lod, group;
};

static uint32_t add(struct cranny_scene *scene, struct placing p)
{
    struct cranny_error why = {0};
    uint32_t index = 0;
    const double s = p.scale > 0 ? p.scale : 1, c = cos(p.angle), d = sin(p.angle);
    const struct cranny_instance instance = {
        .name = "",
        .mesh = p.mesh,
        .world_from_object = {s * c, 0, s * d, p.x, 0, s, 0, p.y, -s * d, 0, s * c, p.z},
        .role = p.role,
        .lod = p.lod,
        .lod_group = p.group};
    CHECK_OK(cranny_scene_add_instance(scene, &instance, &index, &why), why);
    return index;
}

static struct cranny_bake_params small_params(void)
{
    struct cranny_bake_params params = cranny_bake_params_default();
    params.distance_long = 4;
    params.distance_short = 1;
    params.rays = 32;
    params.samples_total = 20000;
    params.volume_rays = 256;
    return params;
}

static float final_value(const struct cranny_scene *scene, const struct cranny_bake *bake,
                         uint32_t instance, uint32_t vertex)
{
    float linear[4];
    const struct cranny_mesh *mesh =
        cranny_scene_mesh(scene, cranny_scene_instance(scene, instance)->mesh);
    cranny_bake_linear(bake, instance, CRANNY_CHANNEL_LONG, linear);
    return cranny_linear_visibility(
        linear, mesh->positions[vertex],
        cranny_bake_values(bake, instance, CRANNY_CHANNEL_LONG)[vertex]);
}

/* rms over the instances first…end−1 between two bakes of one scene. */
static double distance(const struct cranny_scene *scene, const struct cranny_bake *a,
                       const struct cranny_bake *b, uint32_t first, uint32_t end)
{
    double squares = 0, count = 0;
    for (uint32_t i = first; i < end; i++) {
        const struct cranny_mesh *mesh =
            cranny_scene_mesh(scene, cranny_scene_instance(scene, i)->mesh);
        for (uint32_t v = 0; v < mesh->vertex_count; v++, count++) {
            const double d =
                (double)final_value(scene, a, i, v) - (double)final_value(scene, b, i, v);
            squares += d * d;
        }
    }
    return sqrt(squares / fmax(count, 1));
}

/* Domes far apart, each with a wall of its own, at another side and distance. */
#define DOMES 20
static struct cranny_scene *dome_scene(struct field *field, uint32_t *first)
{
    struct cranny_scene *scene = empty_scene();
    make_field(field, 8, 1, dome);
    const uint32_t wall = add_mesh(scene, &wall_mesh), mesh = add_mesh(scene, &field->mesh);
    *first = DOMES;
    for (int i = 0; i < 2 * DOMES; i++) {
        const int k = i % DOMES;
        const double angle = 2.4 * k, away = 2 + 0.3 * k, middle = 200 * k;
        if (i < DOMES) /* its front looks along (cos, −sin), to the dome */
            add(scene, (struct placing){.mesh = wall,
                                        .x = middle - away * cos(angle),
                                        .z = away * sin(angle),
                                        .angle = angle});
        else
            add(scene, (struct placing){.mesh = mesh, .x = middle, .scale = 1 + 0.01 * k});
    }
    return scene;
}

/* One linear function of the position tells a wall's shade on a dome; one mean for all does not. */
static void test_linear(void)
{
    static struct field field;
    uint32_t first;
    struct cranny_scene *scene = dome_scene(&field, &first);
    struct cranny_bake_params params = small_params();
    params.distance_long = 20;
    params.instances = CRANNY_INSTANCES_SPLIT;
    params.rays = 256;
    struct cranny_bake *truth = bake_scene(scene, &params);
    params.rays = 32;
    params.instances = CRANNY_INSTANCES_SHARED;
    struct cranny_bake *shared = bake_scene(scene, &params);
    const double mean = distance(scene, truth, shared, first, first + DOMES);
    params.instances = CRANNY_INSTANCES_LINEAR;
    static const double limits[2][2] = {{0.6, 0.6}, {0.8, 0.8}};
    for (int local = 0; local < 2; local++)
        for (int from = 0; from < 2; from++) {
            params.local = local;
            params.linear_from = from;
            struct cranny_bake *bake = bake_scene(scene, &params);
            const double error = distance(scene, truth, bake, first, first + DOMES);
            CHECK_MSG(error < limits[local][from] * mean,
                      "local %d from %d: rms %.4f, the mean's %.4f", local, from, error, mean);
            struct cranny_bake_report report;
            cranny_bake_get_report(bake, &report);
            CHECK_INT(report.linear_instances, 2 * DOMES);
            CHECK(report.bytes_values < report.bytes_vertices);
            CHECK_INT(report.volume_points > 0, from == CRANNY_LINEAR_VOLUME);
            cranny_bake_destroy(&bake);
        }
    /* The automatic choice splits few and does not split many. */
    float y[4];
    params = small_params();
    params.rays = 8;
    struct cranny_bake *many = bake_scene(scene, &params);
    CHECK(cranny_bake_linear(many, first, CRANNY_CHANNEL_VISIBILITY, y));
    params.split_limit = DOMES;
    struct cranny_bake *few = bake_scene(scene, &params);
    CHECK(!cranny_bake_linear(few, first, CRANNY_CHANNEL_VISIBILITY, y));
    cranny_bake_destroy(&many);
    cranny_bake_destroy(&few);
    cranny_bake_destroy(&truth);
    cranny_bake_destroy(&shared);
    cranny_scene_destroy(&scene);
}

/* In the open, a mesh is what it is by itself: the function is 1 everywhere. */
static void test_isolated(void)
{
    static struct field field;
    struct cranny_scene *scene = empty_scene();
    make_field(&field, 8, 1, dome);
    const uint32_t mesh = add_mesh(scene, &field.mesh);
    for (int i = 0; i < 2; i++)
        add(scene, (struct placing){.mesh = mesh, .x = 1000.0 * i, .y = 7, .scale = 1});
    struct cranny_bake_params params = small_params();
    params.instances = CRANNY_INSTANCES_LINEAR;
    params.local = CRANNY_LOCAL_ISOLATED;
    params.linear_points = 512;
    for (int from = 0; from < 2; from++) {
        params.linear_from = from;
        struct cranny_bake *bake = bake_scene(scene, &params);
        for (uint32_t i = 0; i < 2; i++) {
            float y[4];
            CHECK(cranny_bake_linear(bake, i, CRANNY_CHANNEL_LONG, y));
            for (int c = 0; c < 4; c++)
                CHECK_NEAR((double)y[c], c == 0, 0.05);
        }
        cranny_bake_destroy(&bake);
    }
    cranny_scene_destroy(&scene);
}

/* Grass has what the ground has where it stands, near a wall and far away; where there is no
 * ground, what a level one there would have. */
static void test_scalar(void)
{
    static struct field ground, tuft;
    struct cranny_scene *scene = empty_scene();
    make_field(&ground, 64, 16, flat);
    make_field(&tuft, 1, 0.2f, flat);
    const uint32_t wall = add_mesh(scene, &wall_mesh), floor = add_mesh(scene, &ground.mesh),
                   grass = add_mesh(scene, &tuft.mesh);
    add(scene, (struct placing){.mesh = wall});
    const uint32_t land = add(scene, (struct placing){.mesh = floor});
    const uint32_t near =
        add(scene, (struct placing){.mesh = grass, .x = 1, .role = CRANNY_ROLE_GRASS});
    const uint32_t far =
        add(scene, (struct placing){.mesh = grass, .x = 13, .role = CRANNY_ROLE_GRASS});
    add(scene, (struct placing){.mesh = grass, .x = -13, .role = CRANNY_ROLE_SHRUB});
    const uint32_t up =
        add(scene, (struct placing){.mesh = grass, .x = 13, .y = 9, .role = CRANNY_ROLE_GRASS});
    const uint32_t gone =
        add(scene, (struct placing){.mesh = wall, .x = 0.5, .role = CRANNY_ROLE_IGNORED});
    struct cranny_bake_params params = small_params();
    struct cranny_bake *bake = bake_scene(scene, &params);
    const float *values = cranny_bake_values(bake, land, CRANNY_CHANNEL_LONG);
    const uint32_t middle = 32 * 65 + 34; /* x = 1, z = 0 */
    CHECK_NEAR((double)final_value(scene, bake, near, 0), (double)values[middle], 0.03);
    CHECK((double)values[middle] < 0.8);
    CHECK((double)final_value(scene, bake, far, 0) >
          (double)final_value(scene, bake, near, 0) + 0.1);
    CHECK_NEAR((double)final_value(scene, bake, up, 0), 1, 0.02);
    CHECK(cranny_bake_values(bake, near, CRANNY_CHANNEL_LONG) ==
          cranny_bake_values(bake, up, CRANNY_CHANNEL_LONG));
    CHECK(!cranny_bake_values(bake, gone, CRANNY_CHANNEL_LONG));
    struct cranny_bake_report report;
    cranny_bake_get_report(bake, &report);
    CHECK_INT(report.scalar_instances, 4);
    CHECK_INT(report.fog_boxes, 1);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
}

static double lod_rms(const struct cranny_bake *bake, uint64_t *missed)
{
    struct cranny_bake_report report;
    cranny_bake_get_report(bake, &report);
    *missed = report.lod_missed;
    for (size_t i = 0; i < cranny_bake_set_count(bake); i++) {
        struct cranny_bake_set set;
        cranny_bake_get_set(bake, i, &set);
        if (set.treatment == CRANNY_TREATMENT_LOD)
            return set.fit_rms;
    }
    CHECK_MSG(false, "no set is a lower level's");
    return 1;
}

/* The same mesh as its own lower level gets the same values; a coarse one is served better by a fit
 * than by looking at its vertices, and neither occludes. */
static void test_lod(void)
{
    static struct field fine, coarse;
    static const uint32_t sides[3] = {64, 16, 8};
    make_field(&fine, 64, 4, waves);
    for (int i = 0; i < 3; i++) {
        struct cranny_scene *scene = empty_scene();
        make_field(&coarse, sides[i], 4, waves);
        const uint32_t wall = add_mesh(scene, &wall_mesh), ground = add_mesh(scene, &fine.mesh),
                       lower = add_mesh(scene, &coarse.mesh);
        add(scene, (struct placing){.mesh = wall});
        const uint32_t first = add(scene, (struct placing){.mesh = ground, .group = 1});
        struct cranny_bake_params params = small_params();
        struct cranny_bake *alone = bake_scene(scene, &params);
        const uint32_t second = add(scene, (struct placing){.mesh = lower, .lod = 1, .group = 1});
        struct cranny_bake *fit = bake_scene(scene, &params);
        params.lod_fit = CRANNY_LOD_VERTEX;
        struct cranny_bake *vertex = bake_scene(scene, &params);
        uint64_t missed;
        const double fitted = lod_rms(fit, &missed), naive = lod_rms(vertex, &missed);
        CHECK_INT(missed, 0);
        if (i == 0) {
            double squares = 0;
            for (uint32_t v = 0; v < fine.mesh.vertex_count; v++) {
                const double d = (double)final_value(scene, fit, first, v) -
                                 (double)final_value(scene, fit, second, v);
                squares += d * d;
            }
            CHECK_MSG(sqrt(squares / fine.mesh.vertex_count) < 0.012, "rms %.4f",
                      sqrt(squares / fine.mesh.vertex_count));
            const size_t size = fine.mesh.vertex_count * sizeof(float);
            CHECK(memcmp(cranny_bake_values(alone, first, CRANNY_CHANNEL_LONG),
                         cranny_bake_values(fit, first, CRANNY_CHANNEL_LONG), size) == 0);
        } else {
            CHECK_MSG(fitted < 0.9 * naive, "fit %.4f, vertices %.4f", fitted, naive);
        }
        cranny_bake_destroy(&alone);
        cranny_bake_destroy(&fit);
        cranny_bake_destroy(&vertex);
        cranny_scene_destroy(&scene);
    }
}

/* Anywhere in a box all eight neighbours are there, so that what is linear in the position comes
 * back exactly. */
static void test_volume(void)
{
    static const double boxes[3][6] = {
        {-3.3, 0, 1.1, -1.2, 2.5, 4}, {-2, 1, 2, 7.77, 1.5, 3.21}, {50, -9, 0, 50, -9, 0}};
    struct cranny_error why = {0};
    struct volume volume;
    CHECK_OK(volume_create(boxes, 3, 0.31, &volume, &why), why);
    volume.harmonics = calloc(volume.point_count, sizeof *volume.harmonics);
    volume.valid = malloc(volume.point_count);
    memset(volume.valid, 1, volume.point_count);
    const double constant = 0.282094791773878; /* of the first harmonic */
    for (size_t i = 0; i < volume.point_count; i++) {
        const float *p = volume.positions[i];
        for (int d = 0; d < 2; d++)
            volume.harmonics[i][d][0] =
                (float)((0.5 + 0.004 * (double)(p[0] - 2 * p[1] + p[2]) + 0.1 * d) / constant);
    }
    const double up[3] = {0, 1, 0};
    double worst = 0;
    for (int b = 0; b < 3; b++)
        for (int i = 0; i < 1000; i++) {
            const double t[3] = {(i % 10) / 9.0, (i / 10 % 10) / 9.0, (i / 100) / 9.0};
            double p[3];
            float value[2];
            for (int k = 0; k < 3; k++)
                p[k] = boxes[b][k] + t[k] * (boxes[b][3 + k] - boxes[b][k]);
            CHECK(volume_sample(&volume, p, up, value));
            const double expected = 0.5 + 0.004 * (p[0] - 2 * p[1] + p[2]);
            worst = fmax(worst, fabs((double)value[0] - expected));
            worst = fmax(worst, fabs((double)value[1] - expected - 0.1));
        }
    CHECK_MSG(worst < 1e-5, "%g", worst);
    float value[2];
    const double outside[3] = {20, 20, 20};
    CHECK(!volume_sample(&volume, outside, up, value));
    /* Only what is needed: the boxes' own points and no more. */
    CHECK_MSG(volume.point_count < 9 * 10 * 12 + 34 * 4 * 6 + 8 + 200, "%zu", volume.point_count);
    volume_free(&volume);
    CHECK_INT(volume_create(boxes, 3, 1e-4, &volume, &why), CRANNY_USAGE);
}

static bool same_bits(const struct cranny_scene *scene, const struct cranny_bake *a,
                      const struct cranny_bake *b)
{
    bool same = true;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const struct cranny_mesh *mesh =
            cranny_scene_mesh(scene, cranny_scene_instance(scene, i)->mesh);
        for (int c = 0; c < 3; c++) {
            float x[4], y[4];
            cranny_bake_linear(a, i, (enum cranny_channel)c, x);
            cranny_bake_linear(b, i, (enum cranny_channel)c, y);
            same = same && memcmp(x, y, sizeof x) == 0 &&
                   memcmp(cranny_bake_values(a, i, (enum cranny_channel)c),
                          cranny_bake_values(b, i, (enum cranny_channel)c),
                          mesh->vertex_count * sizeof(float)) == 0;
        }
    }
    return same;
}

static void test_threads(void)
{
    static struct field dome_field, ground, coarse;
    uint32_t first;
    struct cranny_scene *scene = dome_scene(&dome_field, &first);
    make_field(&ground, 32, 16, waves);
    make_field(&coarse, 8, 16, waves);
    const uint32_t land = add_mesh(scene, &ground.mesh), low = add_mesh(scene, &coarse.mesh);
    add(scene, (struct placing){.mesh = land, .group = 3});
    add(scene, (struct placing){.mesh = low, .group = 3, .lod = 1});
    add(scene, (struct placing){.mesh = 1, .x = 3, .z = 4, .role = CRANNY_ROLE_SHRUB});
    add(scene, (struct placing){.mesh = 1, .x = 3, .z = -4, .role = CRANNY_ROLE_TREE});
    for (int from = 0; from < 2; from++) {
        struct cranny_bake_params params = small_params();
        params.linear_from = from;
        params.rays = 8;
        params.volume_rays = 32;
        params.threads = 1;
        struct cranny_bake *one = bake_scene(scene, &params);
        params.threads = 5;
        struct cranny_bake *five = bake_scene(scene, &params);
        CHECK(same_bits(scene, one, five));
        cranny_bake_destroy(&one);
        cranny_bake_destroy(&five);
    }
    cranny_scene_destroy(&scene);
}

struct counts {
    size_t linear, scalar, meshes;
};

static struct counts count_file(const char *path)
{
    struct cranny_error why = {0};
    struct document *document = NULL;
    struct counts counts = {0};
    CHECK_OK(document_load(path, false, UINT64_MAX, NULL, &document, &why), why);
    size_t i;
    json_t *node, *nodes = document ? json_object_get(document->root, "nodes") : NULL;
    json_array_foreach(nodes, i, node)
    {
        const json_t *extras = json_object_get(node, "extras");
        counts.linear += json_array_size(json_object_get(extras, "cranny_ao_linear")) == 4;
        counts.scalar += json_is_real(json_object_get(extras, "cranny_ao"));
    }
    counts.meshes = document ? json_array_size(json_object_get(document->root, "meshes")) : 0;
    document_destroy(&document);
    return counts;
}

/* Coefficients stand in the nodes' extras, and `expand` multiplies them out. */
static void test_save(void)
{
    static struct field field;
    const char *path = "bake_level_save.glb";
    uint32_t first;
    struct cranny_error why = {0};
    struct cranny_scene *scene = dome_scene(&field, &first);
    add(scene, (struct placing){.mesh = 0, .x = 30, .role = CRANNY_ROLE_GRASS});
    add(scene, (struct placing){.mesh = 0, .x = 40, .role = CRANNY_ROLE_GRASS});
    struct cranny_bake_params params = small_params();
    params.rays = 8;
    struct cranny_bake *bake = bake_scene(scene, &params);
    struct cranny_save_params save = cranny_save_params_default();
    save.to = CRANNY_OUTPUT_ATTRIBUTE;
    CHECK_OK(cranny_scene_save(scene, bake, path, &save, &why), why);
    struct counts counts = count_file(path);
    CHECK_INT(counts.linear, 2 * DOMES);
    CHECK_INT(counts.scalar, 2);
    CHECK_INT(counts.meshes, 3); /* the wall with its values, and with the grass's */
    save.expand = true;
    CHECK_OK(cranny_scene_save(scene, bake, path, &save, &why), why);
    counts = count_file(path);
    CHECK_INT(counts.linear + counts.scalar, 0);
    CHECK_INT(counts.meshes, 2 * DOMES + 2);
    unlink(path);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
}

/* A file that has coefficients of an earlier bake loses them to one that gives none. */
static void test_again(void)
{
    static struct field field;
    const char *path = "bake_level_again.glb";
    uint32_t first;
    struct cranny_error why = {0};
    struct cranny_scene *scene = dome_scene(&field, &first);
    struct cranny_bake_params params = small_params();
    params.rays = 8;
    struct cranny_bake *bake = bake_scene(scene, &params);
    CHECK_OK(cranny_scene_save(scene, bake, path, NULL, &why), why);
    CHECK_INT(count_file(path).linear, 2 * DOMES);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
    CHECK_OK(cranny_scene_load(path, NULL, &scene, &why), why);
    params.instances = CRANNY_INSTANCES_SPLIT;
    bake = bake_scene(scene, &params);
    CHECK_OK(cranny_scene_save(scene, bake, path, NULL, &why), why);
    CHECK_INT(count_file(path).linear, 0);
    unlink(path);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
}

/* The file's unit is nobody's business: coefficients of metres and of sixteen-bit numbers agree. */
static void test_units(void)
{
    static struct field field;
    float constants[2][2];
    for (int unit = 0; unit < 2; unit++) {
        const float size = unit ? 65536 : 1;
        struct cranny_scene *scene = empty_scene();
        make_field(&field, 8, 1, dome);
        for (uint32_t v = 0; v < field.mesh.vertex_count; v++)
            for (int k = 0; k < 3; k++)
                field.positions[v][k] *= size;
        const uint32_t mesh = add_mesh(scene, &field.mesh), wall = add_mesh(scene, &wall_mesh);
        const double scale = 0.01 / (double)size;
        add(scene, (struct placing){.mesh = wall, .x = -0.011});
        for (int i = 0; i < 2; i++)
            add(scene, (struct placing){.mesh = mesh, .x = 0.5 * i, .scale = scale});
        struct cranny_bake_params params = small_params();
        params.distance_long = 0.02f;
        params.instances = CRANNY_INSTANCES_LINEAR;
        params.local = CRANNY_LOCAL_NONE;
        struct cranny_bake *bake = bake_scene(scene, &params);
        for (uint32_t i = 0; i < 2; i++) {
            float y[4];
            cranny_bake_linear(bake, 1 + i, CRANNY_CHANNEL_LONG, y);
            constants[unit][i] = y[0];
        }
        CHECK(constants[unit][0] < constants[unit][1] - 0.05f);
        cranny_bake_destroy(&bake);
        cranny_scene_destroy(&scene);
    }
    for (int i = 0; i < 2; i++)
        CHECK_NEAR((double)constants[1][i], (double)constants[0][i], 0.03);
}

/* Levels and instances without area are nothing, not a crash; a scene of nothing else is refused.
 */
static void test_flat(void)
{
    static const uint32_t line[1][3] = {{0, 1, 2}};
    static const float points[3][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    static const struct cranny_mesh thin = {.name = "thin",
                                            .vertex_count = 3,
                                            .triangle_count = 1,
                                            .positions = points,
                                            .triangles = line};
    struct cranny_error why = {0};
    struct cranny_bake *bake = NULL;
    struct cranny_scene *scene = empty_scene();
    const uint32_t mesh = add_mesh(scene, &thin), wall = add_mesh(scene, &wall_mesh);
    for (int i = 0; i < 20; i++)
        add(scene, (struct placing){.mesh = mesh, .x = 3 * i});
    struct cranny_bake_params params = small_params();
    CHECK_INT(cranny_bake_create(scene, &params, &bake, &why), CRANNY_INPUT);
    add(scene, (struct placing){.mesh = wall, .group = 1});
    const uint32_t level = add(scene, (struct placing){.mesh = mesh, .lod = 1, .group = 1});
    for (int fit = 0; fit < 2; fit++) {
        params.lod_fit = fit;
        bake = bake_scene(scene, &params);
        CHECK_NEAR((double)cranny_bake_values(bake, level, CRANNY_CHANNEL_LONG)[1], 1, 0);
        cranny_bake_destroy(&bake);
    }
    cranny_scene_destroy(&scene);
}

static bool stop_in(void *user, const char *stage, double done, double total)
{
    (void)done;
    (void)total;
    return strcmp(stage, user) != 0;
}

/* Each stage can be stopped. */
static void test_cancel(void)
{
    static struct field dome_field, ground;
    static const char *const stages[] = {"bvh",    "trace",   "solve",   "volume",
                                         "linear", "scatter", "resample"};
    uint32_t first;
    struct cranny_scene *scene = dome_scene(&dome_field, &first);
    make_field(&ground, 32, 16, waves);
    const uint32_t land = add_mesh(scene, &ground.mesh);
    add(scene, (struct placing){.mesh = land, .group = 3});
    add(scene, (struct placing){.mesh = land, .group = 3, .lod = 1});
    add(scene, (struct placing){.mesh = 1, .x = 3, .z = 4, .role = CRANNY_ROLE_SHRUB});
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
        struct cranny_bake_params params = small_params();
        struct cranny_error why = {0};
        char stage[16];
        snprintf(stage, sizeof stage, "%s", stages[i]);
        const struct cranny_hooks hooks = {.user = stage, .progress = stop_in};
        struct cranny_bake *bake = NULL;
        params.linear_from = CRANNY_LINEAR_VOLUME;
        params.hooks = &hooks;
        CHECK_INT(cranny_bake_create(scene, &params, &bake, &why), CRANNY_CANCELLED);
        CHECK_MSG(!bake, "stage %s", stages[i]);
    }
    cranny_scene_destroy(&scene);
}

int main(void)
{
    test_linear();
    test_isolated();
    test_scalar();
    test_lod();
    test_volume();
    test_threads();
    test_save();
    test_again();
    test_units();
    test_flat();
    test_cancel();
    return check_end("bake_level");
}
