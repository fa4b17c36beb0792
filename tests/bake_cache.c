/* Bakes that take over what the last one left: against bakes without a cache, value by value and
 * sample by sample; files that are damaged; folders that do not work; two at once. */
#include "check.h"

#include "bake/collect.h"
#include "bake/state.h"

#include <cranny/cranny.h>

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

typedef float vec3[3];

/* A box, faces outward, `side` × `side` quads each. */
struct box {
    vec3 positions[6 * 9 * 9];
    uint32_t triangles[6 * 2 * 8 * 8][3];
    uint32_t materials[6 * 2 * 8 * 8];
    struct cranny_mesh mesh;
};

static void make_box(struct box *box, uint32_t side, const vec3 half, uint32_t material)
{
    const uint32_t n = side + 1;
    uint32_t vertices = 0, triangles = 0;
    for (uint32_t face = 0; face < 6; face++) {
        const uint32_t axis = face / 2, a = (axis + 1) % 3, b = (axis + 2) % 3, first = vertices;
        for (uint32_t i = 0; i < n * n; i++, vertices++) {
            float *p = box->positions[vertices];
            p[axis] = face % 2 ? half[axis] : -half[axis];
            p[a] = half[a] * (2 * (float)(i % n) / (float)side - 1);
            p[b] = half[b] * (2 * (float)(i / n) / (float)side - 1);
        }
        for (uint32_t i = 0; i < side * side; i++) {
            const uint32_t v = first + i / side * n + i % side;
            const uint32_t quad[2][3] = {{v, v + 1, v + n}, {v + 1, v + n + 1, v + n}};
            for (int t = 0; t < 2; t++, triangles++)
                for (int c = 0; c < 3; c++)
                    box->triangles[triangles][c] = quad[t][face % 2 ? c : 2 - c];
        }
    }
    for (uint32_t t = 0; t < triangles; t++)
        box->materials[t] = material;
    box->mesh = (struct cranny_mesh){.name = "box",
                                     .vertex_count = vertices,
                                     .triangle_count = triangles,
                                     .positions = (const float(*)[3])box->positions,
                                     .triangles = (const uint32_t(*)[3])box->triangles,
                                     .triangle_materials = box->materials};
}

enum { GROUND, CRATE, GLASS, CROWN, BUSH, COARSE, MESHES };
enum { ITEMS_MAX = 64 };

struct item {
    uint32_t mesh;
    float x, y, z, scale;
    enum cranny_role role;
    uint32_t lod, group;
};

/* What a scene is made of, to be changed and made again. */
struct village {
    struct item items[ITEMS_MAX];
    int count;
    float opacity; /* of the glass */
};

static struct item *put(struct village *village, uint32_t mesh, float x, float y, float z)
{
    struct item *item = &village->items[village->count++];
    *item = (struct item){mesh, x, y, z, 1, CRANNY_ROLE_SOLID, 0, 0};
    return item;
}

/* Something coarse in the place of a thing, as its lower level of detail. */
static struct item *put_level(struct village *village, const struct item *fine, float scale)
{
    struct item *item = put(village, COARSE, fine->x, fine->y, fine->z);
    item->role = fine->role;
    item->group = fine->group;
    item->lod = 1;
    item->scale = scale;
    return item;
}

static struct village make_village(void)
{
    struct village v = {.opacity = 0.5f};
    put(&v, GROUND, 0, -0.1f, 0)->group = 9;
    for (int i = 0; i < 4; i++)
        put(&v, CRATE, -4 + 2.5f * (float)i, 0.5f, -2 + (float)i);
    put(&v, GLASS, 1, 1, 3);
    put(&v, GLASS, -6, 1, 5);
    for (int i = 0; i < 5; i++) {
        struct item *crown = put(&v, CROWN, -7 + 3 * (float)i, 1.5f, -6 + 0.3f * (float)i);
        crown->role = CRANNY_ROLE_TREE;
        crown->group = 2 + (uint32_t)i;
        put_level(&v, crown, 1.6f);
    }
    for (int i = 0; i < 6; i++)
        put(&v, BUSH, -5 + 0.5f * (float)i, 0.2f, 6)->role = CRANNY_ROLE_SHRUB;
    struct item *fine = put(&v, CRATE, 6, 0.5f, 4);
    fine->group = 1;
    put_level(&v, fine, 1);
    put_level(&v, v.items, 20)->y = -10;
    return v;
}

static struct cranny_scene *build(const struct village *village)
{
    static struct box box;
    static const struct {
        uint32_t side;
        vec3 half;
        uint32_t material;
    } shapes[MESHES] = {
        {8, {10, 0.1f, 10}, 0},     {4, {0.5f, 0.5f, 0.5f}, 0}, {2, {0.8f, 1, 0.1f}, 1},
        {4, {0.7f, 0.9f, 0.7f}, 0}, {3, {0.3f, 0.2f, 0.4f}, 1}, {1, {0.5f, 0.5f, 0.5f}, 0},
    };
    struct cranny_error why = {0};
    struct cranny_scene *scene = NULL;
    CHECK_OK(cranny_scene_create(&scene, &why), why);
    struct cranny_material material = cranny_material_default();
    CHECK_OK(cranny_scene_add_material(scene, &material, NULL, &why), why);
    material.alpha_mode = CRANNY_ALPHA_BLEND;
    material.opacity = village->opacity;
    CHECK_OK(cranny_scene_add_material(scene, &material, NULL, &why), why);
    for (int m = 0; m < MESHES; m++) {
        make_box(&box, shapes[m].side, shapes[m].half, shapes[m].material);
        CHECK_OK(cranny_scene_add_mesh(scene, &box.mesh, NULL, &why), why);
    }
    for (int i = 0; i < village->count; i++) {
        const struct item *item = &village->items[i];
        const double s = (double)item->scale;
        const struct cranny_instance instance = {.name = "",
                                                 .mesh = item->mesh,
                                                 .role = item->role,
                                                 .lod = item->lod,
                                                 .lod_group = item->group,
                                                 .world_from_object = {s, 0, 0, (double)item->x, 0,
                                                                       s, 0, (double)item->y, 0, 0,
                                                                       s, (double)item->z}};
        CHECK_OK(cranny_scene_add_instance(scene, &instance, NULL, &why), why);
    }
    return scene;
}

static int warnings;

static void count_warnings(void *user, enum cranny_log_level level, const char *line)
{
    (void)user;
    warnings += level == CRANNY_LOG_WARNING && strstr(line, "baked anew");
}

static const struct cranny_hooks hooks = {.log = count_warnings};

static struct cranny_bake_params params_for(const char *folder)
{
    struct cranny_bake_params params = cranny_bake_params_default();
    params.density = 40;
    params.distance_long = 4;
    params.distance_short = 0.5f;
    params.split_limit = 4; /* crowns are linear */
    params.linear_points = 32;
    params.cache_folder = folder;
    params.hooks = &hooks;
    return params;
}

static struct cranny_bake *bake_it(const struct cranny_scene *scene,
                                   const struct cranny_bake_params *params,
                                   struct cranny_bake_report *report)
{
    struct cranny_error why = {0};
    struct cranny_bake *bake = NULL;
    CHECK_OK(cranny_bake_create(scene, params, &bake, &why), why);
    cranny_bake_get_report(bake, report);
    return bake;
}

/* The largest difference of values and coefficients. */
static double difference(const struct cranny_scene *scene, const struct cranny_bake *a,
                         const struct cranny_bake *b)
{
    double worst = 0;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++)
        for (int c = 0; c < 3; c++) {
            const uint32_t mesh = cranny_scene_instance(scene, i)->mesh;
            const float *x = cranny_bake_values(a, i, (enum cranny_channel)c);
            const float *y = cranny_bake_values(b, i, (enum cranny_channel)c);
            float p[4], q[4];
            for (uint32_t v = 0; v < cranny_scene_mesh(scene, mesh)->vertex_count; v++)
                worst = fmax(worst, fabs((double)x[v] - (double)y[v]));
            cranny_bake_linear(a, i, (enum cranny_channel)c, p);
            cranny_bake_linear(b, i, (enum cranny_channel)c, q);
            for (int k = 0; k < 4; k++)
                worst = fmax(worst, fabs((double)p[k] - (double)q[k]));
        }
    return worst;
}

static char root[] = "/tmp/cranny-cache-XXXXXX";

/* A folder of the test's own. */
static const char *folder(const char *name)
{
    static char paths[128][64];
    static int count;
    CHECK(count < 128);
    snprintf(paths[count % 128], sizeof *paths, "%s/%s", root, name);
    return paths[count++ % 128];
}

/* The only state in a folder, by path; "" for none. */
static const char *state_in(const char *where)
{
    static char path[2][600];
    static int turn;
    turn = !turn;
    path[turn][0] = 0;
    DIR *files = opendir(where);
    for (const struct dirent *entry; files && (entry = readdir(files));)
        if (entry->d_name[0] != '.')
            snprintf(path[turn], sizeof path[turn], "%s/%.300s", where, entry->d_name);
    if (files)
        closedir(files);
    return path[turn];
}

/* Bake with the folder and without one: how far apart they are. */
static double bake_both(const struct village *village, const struct cranny_bake_params *params,
                        struct cranny_bake_report *report)
{
    struct cranny_scene *scene = build(village);
    struct cranny_bake_params plain = *params;
    struct cranny_bake_report unused;
    plain.cache_folder = NULL;
    struct cranny_bake *kept = bake_it(scene, params, report);
    struct cranny_bake *fresh = bake_it(scene, &plain, &unused);
    CHECK_INT(unused.reuse, CRANNY_REUSE_OFF);
    CHECK_INT(report->samples, unused.samples);
    const double apart = difference(scene, kept, fresh);
    cranny_bake_destroy(&kept);
    cranny_bake_destroy(&fresh);
    cranny_scene_destroy(&scene);
    return apart;
}

static void test_same_again(void)
{
    const struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("same"));
    struct cranny_bake_report report;
    struct stat before, after;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_FIRST);
    CHECK_INT(report.reused_samples, 0);
    CHECK(report.bytes_cache > 6 * report.samples && report.linear_instances == 10 &&
          report.lod_instances == 7 && report.fog_boxes == 6);
    CHECK(stat(state_in(params.cache_folder), &before) == 0);
    params.threads = 3;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_DONE);
    CHECK_INT(report.reused_samples, report.samples);
    CHECK_INT(report.added_occluders + report.removed_occluders, 0);
    CHECK_INT(report.rays, 0);
    /* Every set but the shrubs' one, which has no samples. */
    CHECK_INT(report.reused_sets, report.meshes - 1);
    CHECK(stat(state_in(params.cache_folder), &after) == 0 && before.st_ino == after.st_ino);
}

/* A step of an edit, from a seed. */
static void edit(struct village *village, unsigned *seed)
{
    const unsigned dice = *seed = *seed * 1664525u + 1013904223u;
    const int at = 1 + (int)(dice >> 8) % (village->count - 1);
    struct item *item = &village->items[at];
    switch (dice >> 28) {
    case 0: /* away, and what follows is numbered anew */
        if (item->group || village->count < 12)
            break;
        memmove(item, item + 1, sizeof *item * (size_t)(village->count - at - 1));
        village->count--;
        return;
    case 1:
    case 2: /* one more, in front of others */
        memmove(item + 1, item, sizeof *item * (size_t)(village->count - at));
        village->count++;
        item->group = item->lod = 0;
        item->z += 1.3f;
        return;
    case 3:
        item->role = item->lod || item->group ? item->role : CRANNY_ROLE_SOLID;
        return;
    case 4:
        village->opacity = village->opacity > 0.4f ? 0.3f : 0.5f;
        return;
    default:
        break;
    }
    item->x += 0.37f;
    item->scale *= dice & 1 << 20 ? 1.1f : 1;
}

/* Whatever is done to the scene: nothing is kept that a bake without a cache would not have. */
static void test_edits(void)
{
    struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("edits"));
    struct cranny_bake_report report;
    unsigned seed = 7;
    uint64_t kept = 0, traced = 0, sets = 0;
    params.reuse_limit = 0;
    printf("edits: seed %u\n", seed);
    for (int step = 0; step < 24; step++) {
        const double apart = bake_both(&village, &params, &report);
        CHECK_MSG(apart == 0, "step %d: %g apart", step, apart);
        CHECK_INT(report.reuse, step ? CRANNY_REUSE_DONE : CRANNY_REUSE_FIRST);
        kept += report.reused_samples;
        traced += report.samples - report.reused_samples;
        sets += report.reused_sets;
        edit(&village, &seed);
    }
    printf("edits: %.1f %% kept, %llu sets\n", 100.0 * (double)kept / (double)(kept + traced),
           (unsigned long long)sets);
    CHECK(kept > traced && traced > 0 && sets > 0);
}

static void read_state(const char *where, struct state *state)
{
    FILE *file = fopen(state_in(where), "rb");
    uint64_t key = 0;
    enum state_found found;
    struct cranny_error why = {0};
    CHECK(file && fseek(file, 16, SEEK_SET) == 0 && fread(&key, sizeof key, 1, file) == 1);
    if (file)
        fclose(file);
    CHECK_OK(state_read(state_in(where), key, 1u << 30, &hooks, state, &found, &why), why);
    CHECK_INT(found, STATE_READ);
}

/* How samples of two bakes differ. */
struct comparison {
    double worst, worst_level; /* on surfaces; of lower levels of detail */
    int differing, drifted;    /* on surfaces */
};

static void compare_record(const struct kept *p, const struct kept *q, size_t count, bool level,
                           struct comparison *sum)
{
    double *worst = level ? &sum->worst_level : &sum->worst;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 2; c++) {
            const double apart = fabs((double)p[i].visibility[c] - q[i].visibility[c]) / 65535;
            *worst = fmax(*worst, apart);
            sum->differing += !level && apart > 0;
            sum->drifted += !level && p[i].drift > 0;
        }
}

/* Sample by sample, what two folders keep. */
static struct comparison compare_samples(const char *a, const char *b)
{
    struct state x, y;
    struct comparison sum = {0};
    size_t seen = 0;
    read_state(a, &x);
    read_state(b, &y);
    for (size_t r = 0; r < x.count; r++) {
        const uint64_t key = x.records[r].key;
        size_t size, other, unused;
        if (x.records[r].kind != STATE_SAMPLES)
            continue;
        const struct kept *p = state_find(&x, STATE_SAMPLES, key, &size);
        const struct kept *q = state_find(&y, STATE_SAMPLES, key, &other);
        CHECK(q && size == other);
        if (q)
            compare_record(p, q, size / sizeof *p, state_find(&x, STATE_SOURCES, key, &unused),
                           &sum);
        seen += size;
    }
    CHECK(seen > 1000);
    state_free(&x);
    state_free(&y);
    return sum;
}

/* Bake in the folder, and in one of its own. */
static struct comparison bake_beside(const struct village *village,
                                     const struct cranny_bake_params *params,
                                     struct cranny_bake_report *report)
{
    static int number;
    char name[32];
    struct cranny_bake_params fresh = *params;
    struct cranny_bake_report unused;
    struct cranny_scene *scene = build(village);
    struct cranny_bake *bake = bake_it(scene, params, report);
    cranny_bake_destroy(&bake);
    snprintf(name, sizeof name, "beside-%d", number++);
    fresh.cache_folder = folder(name);
    bake = bake_it(scene, &fresh, &unused);
    CHECK_INT(unused.reused_samples, 0);
    cranny_bake_destroy(&bake);
    cranny_scene_destroy(&scene);
    const struct comparison sum = compare_samples(params->cache_folder, fresh.cache_folder);
    const double limit = (double)params->reuse_limit;
    CHECK_MSG(sum.worst <= limit + 1.0 / 65535, "%s: %g", name, sum.worst);
    /* The limit, and what the values differ that they are taken from. */
    CHECK_MSG(sum.worst_level <= 2 * limit, "%s: %g", name, sum.worst_level);
    return sum;
}

static void add_comparison(struct comparison *sum, struct comparison one)
{
    sum->worst = fmax(sum->worst, one.worst);
    sum->worst_level = fmax(sum->worst_level, one.worst_level);
    sum->differing += one.differing;
    sum->drifted += one.drifted;
}

static void print_comparison(const char *what, const struct cranny_bake_params *params,
                             const struct comparison *sum)
{
    printf("%s: limit %.5f, worst sample %.5f, of levels %.5f; %d differ, %d drifted\n", what,
           (double)params->reuse_limit, sum->worst, sum->worst_level, sum->differing, sum->drifted);
}

/* Small steps of one crate far from most: samples are kept though their rays meet it, until what
 * has changed adds up to more than the limit. */
static void test_limit(void)
{
    struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("limit"));
    struct cranny_bake_report report;
    struct comparison sum = {0};
    params.reuse_limit = 1.0f / 64;
    params.distance_long = 1;
    for (int step = 0; step < 12; step++) {
        add_comparison(&sum, bake_beside(&village, &params, &report));
        CHECK(step == 0 || (report.reused_samples > report.samples / 2 &&
                            report.reused_samples < report.samples));
        village.items[3].x += 0.21f;
        village.items[3].z -= 0.13f;
    }
    print_comparison("steps", &params, &sum);
    CHECK(sum.differing > 0 && sum.drifted > sum.differing);
    CHECK(sum.worst > (double)params.reuse_limit / 8);
}

/* Walls that come one after the other, each at a distance at which it counts little. */
static void test_adding_up(bool adaptive)
{
    struct village village = make_village();
    struct cranny_bake_params params = params_for(folder(adaptive ? "adaptive" : "adding"));
    struct cranny_bake_report report;
    struct comparison sum = {0};
    params.reuse_limit = 1.0f / 128;
    params.distance_long = 1.3f;
    params.adaptive = adaptive;
    params.rays = adaptive ? 16 : 8;
    for (int step = 0; step < 9; step++) {
        const double angle = 0.7 * step;
        add_comparison(&sum, bake_beside(&village, &params, &report));
        put(&village, CRATE, (float)(9 * cos(angle)), 2, (float)(9 * sin(angle)))->scale = 6;
    }
    print_comparison(adaptive ? "walls, adaptive" : "walls", &params, &sum);
    CHECK(sum.differing > 0 && sum.worst > (double)params.reuse_limit / 2);
}

/* Something that no bake's ray meets stands in the way when the ground's lower level looks for the
 * ground: only where it is tells. */
static void test_levels(void)
{
    struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("levels"));
    struct cranny_bake_report report;
    struct item *bush = put(&village, BUSH, 3, 0.1f, 1);
    bush->role = CRANNY_ROLE_SHRUB;
    bush->group = 20;
    put_level(&village, bush, 0.3f);
    params.fog_density = 0;
    params.reuse_limit = 0;
    for (int step = 0; step < 3; step++) {
        CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
        village.items[village.count - 2].x += 0.5f;
    }
}

static void test_outcomes(void)
{
    struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("outcomes"));
    struct cranny_bake_report report;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    params.rays = 9;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_PARAMETERS);
    params.ground = true;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    village.items[0].y -= 0.01f;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_GROUND);
    params.density = 0;
    params.ground = false;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    village.items[0].scale = 2;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_DENSITY);
    params.fit = CRANNY_FIT_VERTEX;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_VERTEX);
    params.fit = CRANNY_FIT_LEAST_SQUARES;
    params.cache_name = "another";
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_FIRST);
}

/* Other ways to bake, each changed once. */
static void test_ways(void)
{
    static const char *const ways[][2] = {
        {"adaptive", "true"},      {"dimming", "plain"}, {"sampler", "sobol"},
        {"kernel", "linear"},      {"kernel", "hard"},   {"local", "isolated"},
        {"linear_from", "volume"}, {"fit", "splat"},     {"lod_fit", "vertex"},
        {"instances", "shared"},   {"back_limit", "1"},  {"rays", "130"},
    };
    struct cranny_error why = {0};
    for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) {
        struct village village = make_village();
        struct cranny_bake_params params = params_for(folder("ways"));
        struct cranny_bake_report report;
        CHECK_OK(
            cranny_params_set(cranny_bake_param_table(), &params, ways[w][0], ways[w][1], &why),
            why);
        params.reuse_limit = 0;
        params.density = 10;
        for (int step = 0; step < 3; step++) {
            const double apart = bake_both(&village, &params, &report);
            CHECK_MSG(apart == 0, "%s=%s, step %d: %g apart", ways[w][0], ways[w][1], step, apart);
            CHECK_MSG(step == 0 || (report.reuse == CRANNY_REUSE_DONE && report.reused_samples > 0),
                      "%s=%s", ways[w][0], ways[w][1]);
            village.items[2 + 6 * step].x += 0.4f;
        }
    }
}

static void write_bytes(const char *path, const uint8_t *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    CHECK(file && (!size || fwrite(bytes, size, 1, file) == 1));
    if (file)
        fclose(file);
}

/* The next bake warns once, is right, and leaves a good file. */
static void expect_damage(const struct cranny_scene *scene, const struct cranny_bake *good,
                          const struct cranny_bake_params *params, const char *what)
{
    struct cranny_bake_report report;
    warnings = 0;
    struct cranny_bake *bake = bake_it(scene, params, &report);
    CHECK_MSG(report.reuse == CRANNY_REUSE_DAMAGED && warnings == 1, "%s: outcome %d, %d warnings",
              what, (int)report.reuse, warnings);
    CHECK_MSG(difference(scene, bake, good) == 0, "%s", what);
    cranny_bake_destroy(&bake);
}

static void test_damage(void)
{
    const struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("damage"));
    struct cranny_bake_report report;
    struct cranny_error why = {0};
    params.density = 2;
    params.rays = 2;
    struct cranny_scene *scene = build(&village);
    struct cranny_bake *good = bake_it(scene, &params, &report);
    char path[600];
    snprintf(path, sizeof path, "%s", state_in(params.cache_folder));
    uint8_t *bytes = NULL;
    size_t size = 0;
    CHECK_OK(file_read(path, 1u << 30, &bytes, &size, &why), why);
    const size_t lengths[] = {0, 1, 7, 55, 56, 60, 1000, size / 2, size - 8, size - 1};
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
        write_bytes(path, bytes, lengths[i]);
        expect_damage(scene, good, &params, "cut short");
    }
    for (size_t at = 0; at < size; at = at < 64 ? at + 1 : at + size / 16) {
        bytes[at] ^= (uint8_t)(1 << at % 8);
        write_bytes(path, bytes, size);
        bytes[at] ^= (uint8_t)(1 << at % 8);
        expect_damage(scene, good, &params, "a bit turned");
    }
    CHECK(truncate(path, (off_t)1 << 40) == 0);
    expect_damage(scene, good, &params, "a terabyte");
    CHECK(unlink(path) == 0 && mkfifo(path, 0600) == 0);
    expect_damage(scene, good, &params, "a pipe");
    struct cranny_bake *again = bake_it(scene, &params, &report);
    CHECK_INT(report.reuse, CRANNY_REUSE_DONE);
    CHECK_INT(report.reused_samples, report.samples);
    free(bytes);
    cranny_bake_destroy(&again);
    cranny_bake_destroy(&good);
    cranny_scene_destroy(&scene);
}

/* Says so before any work. */
static void test_folders(void)
{
    const struct village village = make_village();
    struct cranny_scene *scene = build(&village);
    struct cranny_bake *bake = NULL;
    write_bytes(folder("file"), (const uint8_t *)"x", 1);
    const char *const wrong[] = {"/proc/none", "/proc", folder("no/where"), folder("file")};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct cranny_error why = {0};
        const struct cranny_bake_params params = params_for(wrong[i]);
        CHECK_INT(cranny_bake_create(scene, &params, &bake, &why), CRANNY_FAILED);
        CHECK_MSG(!bake && strstr(why.message, wrong[i]), "%s", why.message);
    }
    cranny_scene_destroy(&scene);
}

/* The last one to write wins; all are right. */
static void test_at_once(void)
{
    struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("once"));
    params.reuse_limit = 0;
    params.threads = 1; /* a forked child has none of the others */
    for (int child = 0; child < 3; child++) {
        const pid_t pid = fork();
        CHECK(pid >= 0);
        if (pid != 0)
            continue;
        for (int round = 0; round < 4; round++) {
            struct cranny_bake_report report;
            village.items[2].x = (float)((child + round) % 3);
            if (bake_both(&village, &params, &report) != 0 || report.reuse == CRANNY_REUSE_DAMAGED)
                _exit(1);
        }
        _exit(check_failures > 0);
    }
    for (int child = 0; child < 3; child++) {
        int status = 1;
        CHECK(wait(&status) > 0);
        CHECK_INT(status, 0);
    }
    struct cranny_bake_report report;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK_INT(report.reuse, CRANNY_REUSE_DONE);
}

static bool stop_late(void *user, const char *stage, double done, double total)
{
    (void)user;
    (void)done;
    (void)total;
    return strcmp(stage, "solve") != 0;
}

/* A cancelled bake leaves the file as it was. */
static void test_cancel(void)
{
    struct village village = make_village();
    struct cranny_bake_params params = params_for(folder("cancel"));
    struct cranny_bake_report report;
    struct cranny_error why = {0};
    struct cranny_bake *bake = NULL;
    struct stat before, after;
    CHECK_NEAR(bake_both(&village, &params, &report), 0, 0);
    CHECK(stat(state_in(params.cache_folder), &before) == 0);
    const struct cranny_hooks stopping = {.progress = stop_late};
    params.hooks = &stopping;
    village.items[3].x += 1;
    struct cranny_scene *scene = build(&village);
    CHECK_INT(cranny_bake_create(scene, &params, &bake, &why), CRANNY_CANCELLED);
    CHECK(stat(state_in(params.cache_folder), &after) == 0 && before.st_ino == after.st_ino);
    cranny_scene_destroy(&scene);
}

int main(void)
{
    char command[300];
    CHECK(mkdtemp(root) != NULL);
    test_at_once(); /* first: before there are threads */
    test_same_again();
    test_edits();
    test_limit();
    test_adding_up(false);
    test_adding_up(true);
    test_levels();
    test_outcomes();
    test_ways();
    test_damage();
    test_folders();
    test_cancel();
    snprintf(command, sizeof command, "rm -r %s", root);
    CHECK_INT(system(command), 0);
    return check_end("bake_cache");
}
