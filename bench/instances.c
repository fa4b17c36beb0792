/* Compact models of instanced meshes against rays from their vertices: what four coefficients an
 * instance lose, and what each half of the model is worth (2013, Figure 2).
 *
 * Usage: bench-instances [--rays N] [--vertices N] [--role ROLE=PATTERN]... SCENE */
#include <cranny/bake.h>
#include <cranny/runtime.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RULE_LIMIT = 16 };

struct options {
    const char *scene;
    int rays, vertices;
    struct cranny_role_rule rules[RULE_LIMIT];
    size_t rule_count;
};

/* A vertex of a linear instance, and what it should have. */
struct place {
    uint32_t instance, vertex;
};

struct truth {
    struct place *places;
    float (*positions)[3], (*normals)[3], (*raw)[2];
    float *back;
    size_t count, capacity;
};

struct variant {
    const char *name;
    int instances, local, from;
    bool use_local, use_linear;
};

static const struct variant variants[] = {
    {"values on every vertex (split)", CRANNY_INSTANCES_SPLIT, 0, 0, true, true},
    {"one set, the mean (shared)", CRANNY_INSTANCES_SHARED, 0, 0, true, true},
    {"local alone (isolated)", CRANNY_INSTANCES_LINEAR, CRANNY_LOCAL_ISOLATED,
     CRANNY_LINEAR_SURFACE, true, false},
    {"linear alone, from rays", CRANNY_INSTANCES_LINEAR, CRANNY_LOCAL_NONE, CRANNY_LINEAR_SURFACE,
     true, true},
    {"isolated x linear, from the volume (2013)", CRANNY_INSTANCES_LINEAR, CRANNY_LOCAL_ISOLATED,
     CRANNY_LINEAR_VOLUME, true, true},
    {"isolated x linear, from rays", CRANNY_INSTANCES_LINEAR, CRANNY_LOCAL_ISOLATED,
     CRANNY_LINEAR_SURFACE, true, true},
    {"shared x linear, from the volume", CRANNY_INSTANCES_LINEAR, CRANNY_LOCAL_SHARED,
     CRANNY_LINEAR_VOLUME, true, true},
    {"shared x linear, from rays", CRANNY_INSTANCES_LINEAR, CRANNY_LOCAL_SHARED,
     CRANNY_LINEAR_SURFACE, true, true},
};

static bool parse(int argc, char **argv, struct options *options)
{
    *options = (struct options){.rays = 512, .vertices = 24};
    for (int i = 1; i < argc; i++) {
        char *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (argv[i][0] != '-') {
            options->scene = argv[i];
            continue;
        }
        if (!value)
            return false;
        i++;
        if (strcmp(argv[i - 1], "--rays") == 0) {
            options->rays = atoi(value);
        } else if (strcmp(argv[i - 1], "--vertices") == 0) {
            options->vertices = atoi(value);
        } else if (strcmp(argv[i - 1], "--role") == 0 && options->rule_count < RULE_LIMIT) {
            char *equals = strchr(value, '=');
            const char *const *names = cranny_role_names();
            if (!equals)
                return false;
            *equals = 0;
            for (int r = 0; names[r]; r++)
                if (strcmp(names[r], value) == 0)
                    options->rules[options->rule_count++] =
                        (struct cranny_role_rule){equals + 1, (enum cranny_role)r};
        } else {
            return false;
        }
    }
    return options->scene && options->rays > 0 && options->vertices > 0;
}

static bool add_place(struct truth *truth, struct place place, const double m[12],
                      const double inverse[9], const struct cranny_mesh *mesh)
{
    if (truth->count == truth->capacity) {
        const size_t capacity = truth->capacity ? 2 * truth->capacity : 1024;
        void *places = realloc(truth->places, capacity * sizeof *truth->places);
        truth->places = places ? places : truth->places;
        void *positions = realloc(truth->positions, capacity * sizeof *truth->positions);
        truth->positions = positions ? positions : truth->positions;
        void *normals = realloc(truth->normals, capacity * sizeof *truth->normals);
        truth->normals = normals ? normals : truth->normals;
        if (!places || !positions || !normals)
            return false;
        truth->capacity = capacity;
    }
    const float *p = mesh->positions[place.vertex], *n = mesh->normals[place.vertex];
    float normal[3], length = 0;
    for (int k = 0; k < 3; k++) {
        truth->positions[truth->count][k] =
            (float)(m[4 * k] * (double)p[0] + m[4 * k + 1] * (double)p[1] +
                    m[4 * k + 2] * (double)p[2] + m[4 * k + 3]);
        normal[k] = (float)(inverse[k] * (double)n[0] + inverse[3 + k] * (double)n[1] +
                            inverse[6 + k] * (double)n[2]);
        length += normal[k] * normal[k];
    }
    if (!(length > 0))
        return true;
    for (int k = 0; k < 3; k++)
        truth->normals[truth->count][k] = normal[k] / sqrtf(length);
    truth->places[truth->count++] = place;
    return true;
}

static bool invert(const double m[12], double inverse[9])
{
    double det = 0;
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        for (int r = 0; r < 3; r++) {
            const int c = (r + 1) % 3, d = (r + 2) % 3;
            inverse[3 * r + k] = m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c];
        }
    }
    for (int k = 0; k < 3; k++)
        det += m[k] * inverse[3 * k];
    for (int k = 0; k < 9; k++)
        inverse[k] /= det;
    return det != 0;
}

/* Vertices of the instances that a linear bake gives coefficients, evenly through each mesh. */
static bool choose_places(const struct cranny_scene *scene, const struct cranny_bake *linear,
                          int vertices, struct truth *truth)
{
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const struct cranny_instance *instance = cranny_scene_instance(scene, i);
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, instance->mesh);
        float y[4];
        double inverse[9];
        if (instance->role == CRANNY_ROLE_SHRUB || instance->role == CRANNY_ROLE_GRASS ||
            !cranny_bake_linear(linear, i, CRANNY_CHANNEL_VISIBILITY, y) || !mesh->normals ||
            !invert(instance->world_from_object, inverse))
            continue;
        const uint32_t wanted =
            (uint32_t)vertices < mesh->vertex_count ? (uint32_t)vertices : mesh->vertex_count;
        for (uint32_t k = 0; k < wanted; k++) {
            const uint32_t v =
                (uint32_t)(((uint64_t)k * mesh->vertex_count + i % mesh->vertex_count) / wanted) %
                mesh->vertex_count;
            if (!add_place(truth, (struct place){i, v}, instance->world_from_object, inverse, mesh))
                return false;
        }
    }
    return true;
}

static enum cranny_status trace_truth(const struct cranny_scene *scene,
                                      const struct options *options, struct truth *truth,
                                      struct cranny_error *why)
{
    struct cranny_tracer_params build = cranny_tracer_params_default();
    struct cranny_gather_params gather = cranny_gather_params_default();
    struct cranny_tracer *tracer;
    build.roles = true;
    gather.rays = options->rays;
    gather.sampler = CRANNY_SAMPLER_SOBOL;
    truth->raw = malloc((truth->count + 1) * sizeof *truth->raw);
    truth->back = malloc((truth->count + 1) * sizeof *truth->back);
    enum cranny_status status = cranny_tracer_create(scene, &build, &tracer, why);
    if (status == CRANNY_OK)
        status = cranny_gather(tracer, truth->count, (const float(*)[3])truth->positions,
                               (const float(*)[3])truth->normals, NULL, &gather, truth->raw,
                               truth->back, why);
    cranny_tracer_destroy(&tracer);
    return status;
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void judge(const struct cranny_scene *scene, const struct cranny_bake *bake,
                  const struct variant *variant, const struct truth *truth)
{
    struct cranny_bake_report report;
    float *errors = malloc((truth->count + 1) * sizeof *errors);
    double sum = 0, squares = 0, bias = 0;
    size_t count = 0;
    for (size_t i = 0; errors && i < truth->count; i++) {
        const struct place place = truth->places[i];
        const uint32_t mesh = cranny_scene_instance(scene, place.instance)->mesh;
        const float *values = cranny_bake_values(bake, place.instance, CRANNY_CHANNEL_VISIBILITY);
        float linear[4];
        if (!values || truth->back[i] > 0.25f)
            continue;
        cranny_bake_linear(bake, place.instance, CRANNY_CHANNEL_VISIBILITY, linear);
        const float value =
            variant->use_linear
                ? cranny_linear_visibility(linear,
                                           cranny_scene_mesh(scene, mesh)->positions[place.vertex],
                                           values[place.vertex])
                : values[place.vertex];
        const float departure = value - (0.97f * truth->raw[i][0] + 0.03f * truth->raw[i][1]);
        errors[count++] = fabsf(departure);
        sum += (double)fabsf(departure);
        squares += (double)(departure * departure);
        bias += (double)departure;
    }
    cranny_bake_get_report(bake, &report);
    if (count) {
        qsort(errors, count, sizeof *errors, compare_floats);
        printf("| %s | %.4f | %.4f | %.4f | %+.4f | %.1f | %.2f |\n", variant->name,
               sum / (double)count, (double)errors[count * 95 / 100], sqrt(squares / (double)count),
               bias / (double)count, (double)report.bytes_values / 1024,
               report.seconds_trace + report.seconds_solve + report.seconds_local +
                   report.seconds_volume + report.seconds_linear);
    }
    free(errors);
}

static enum cranny_status bake_variant(const struct cranny_scene *scene,
                                       const struct variant *variant, struct cranny_bake **bake,
                                       struct cranny_error *why)
{
    struct cranny_bake_params params = cranny_bake_params_default();
    params.instances = variant->instances;
    params.local = variant->local;
    params.linear_from = variant->from;
    return cranny_bake_create(scene, &params, bake, why);
}

static enum cranny_status run(const struct options *options, struct cranny_scene *scene,
                              struct cranny_error *why)
{
    struct truth truth = {0};
    struct cranny_bake *bake;
    enum cranny_status status =
        cranny_scene_assign_roles(scene, options->rules, options->rule_count, NULL, why);
    if (status == CRANNY_OK)
        status = bake_variant(scene, &variants[7], &bake, why);
    if (status != CRANNY_OK)
        return status;
    const bool complete = choose_places(scene, bake, options->vertices, &truth);
    cranny_bake_destroy(&bake);
    status = complete ? trace_truth(scene, options, &truth, why) : CRANNY_MEMORY;
    printf(
        "%zu vertices of linear instances, %d rays each\n\n"
        "| model | mean | 95 %% | rms | bias | KiB in all | s |\n|---|---|---|---|---|---|---|\n",
        truth.count, options->rays);
    for (size_t i = 0; status == CRANNY_OK && i < sizeof variants / sizeof *variants; i++) {
        status = bake_variant(scene, &variants[i], &bake, why);
        if (status == CRANNY_OK)
            judge(scene, bake, &variants[i], &truth);
        cranny_bake_destroy(&bake);
        fflush(stdout);
    }
    free(truth.places);
    free(truth.positions);
    free(truth.normals);
    free(truth.raw);
    free(truth.back);
    return status;
}

int main(int argc, char **argv)
{
    struct options options;
    struct cranny_scene *scene;
    struct cranny_error why = {0};
    if (argc == 1) {
        printf("bench-instances: no scene given; see the head of bench/instances.c\n");
        return 0;
    }
    if (!parse(argc, argv, &options)) {
        fprintf(stderr, "bench-instances: wrong usage; see the head of bench/instances.c\n");
        return 2;
    }
    enum cranny_status status = cranny_scene_load(options.scene, NULL, &scene, &why);
    if (status == CRANNY_OK)
        status = run(&options, scene, &why);
    if (status != CRANNY_OK)
        fprintf(stderr, "bench-instances: %s\n", why.message);
    cranny_scene_destroy(&scene);
    return cranny_exit_status(status);
}
