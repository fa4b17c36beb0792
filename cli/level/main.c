/* cranny-level: the demo level as a .glb. */
#include "glb.h"

#include <cranny/base.h>
#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SCALE_MINIMUM 0.01
#define SCALE_MAXIMUM 100.0

static const char help[] =
    "usage: cranny-level [--scale S] [--seed N] [--json] -o FILE.glb\n"
    "\n"
    "Writes a village as binary glTF: terrain, houses with rooms and furniture, a courtyard, a "
    "well,\n"
    "fences with an alpha mask, rubble, instanced trees and shrubs, clumps of grass\n"
    "(EXT_mesh_gpu_instancing), three cameras. Plants carry their roles (cranny_role in extras);\n"
    "terrain, houses, courtyard and rubble have simpler levels of detail (MSFT_lod).\n"
    "The same scale and seed give the same bytes.\n"
    "\n"
    "  -o FILE.glb   where to write; appears whole or not at all\n"
    "  --scale S     0.01 to 100, default 1. Triangles grow about in proportion: surfaces get "
    "finer,\n"
    "                and there are more plants. 0.01: 16 thousand triangles in the world;\n"
    "                1: 300 thousand; 16.5: the level of the 2013 paper, 1.5 million vertices and\n"
    "                1.9 million triangles without plants, 46 tree models, 7,856 shrubs, simpler\n"
    "                levels of 0.6 million vertices; 60: over ten million triangles\n"
    "  --seed N      0 to 4294967295, default 1: another landscape and other plants\n"
    "  --json        one JSON object on stdout instead of the summary\n"
    "  --help\n"
    "\n"
    "example: cranny-level --scale 0.5 -o level.glb && cranny bake level.glb -o level-ao.glb\n";

struct options {
    const char *output;
    double scale;
    uint32_t seed;
    bool json, help;
};

static bool wrong(const char *what, const char *value)
{
    fprintf(stderr, "cranny-level: %s%s%s; see cranny-level --help\n", what, value ? " " : "",
            value ? value : "");
    return false;
}

static bool set_scale(struct options *options, const char *text)
{
    char *end;
    options->scale = strtod(text, &end);
    if (end == text || *end ||
        !(options->scale >= SCALE_MINIMUM && options->scale <= SCALE_MAXIMUM))
        return wrong("--scale takes a number from 0.01 to 100, not", text);
    return true;
}

static bool set_seed(struct options *options, const char *text)
{
    char *end;
    unsigned long long seed = strtoull(text, &end, 10);
    if (text[0] < '0' || text[0] > '9' || *end || seed > UINT32_MAX)
        return wrong("--seed takes a whole number from 0 to 4294967295, not", text);
    options->seed = (uint32_t)seed;
    return true;
}

static bool set_value(struct options *options, const char *name, const char *value)
{
    if (strcmp(name, "--scale") == 0)
        return set_scale(options, value);
    if (strcmp(name, "--seed") == 0)
        return set_seed(options, value);
    options->output = value;
    return true;
}

static bool takes_value(const char *name)
{
    return strcmp(name, "--scale") == 0 || strcmp(name, "--seed") == 0 || strcmp(name, "-o") == 0 ||
           strcmp(name, "--output") == 0;
}

static bool parse(int count, char **args, struct options *options)
{
    *options = (struct options){.scale = 1, .seed = 1};
    for (int i = 1; i < count; i++) {
        if (strcmp(args[i], "--help") == 0 || strcmp(args[i], "-h") == 0)
            options->help = true;
        else if (strcmp(args[i], "--json") == 0)
            options->json = true;
        else if (!takes_value(args[i]))
            return wrong("does not know", args[i]);
        else if (i + 1 == count)
            return wrong("a value is missing after", args[i]);
        else if (!set_value(options, args[i], args[i + 1]))
            return false;
        else
            i++;
    }
    if (!options->output && !options->help)
        return wrong("name the file to write with -o FILE.glb", NULL);
    return true;
}

static void print_json(const struct options *options, const struct world *world, size_t bytes)
{
    struct totals t = world_totals(world);
    json_t *object = json_pack(
        "{s:s, s:f, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:i, s:I}", "output",
        options->output, "scale", options->scale, "seed", (json_int_t)world->seed, "triangles",
        (json_int_t)t.triangles, "vertices", (json_int_t)t.vertices, "unique_triangles",
        (json_int_t)t.unique_triangles, "unique_vertices", (json_int_t)t.unique_vertices,
        "lod_triangles", (json_int_t)t.lod_triangles, "meshes", (json_int_t)world->mesh_count,
        "nodes", (json_int_t)world->node_count, "trees", (json_int_t)world->trees, "shrubs",
        (json_int_t)world->shrubs, "cameras", VIEW_COUNT, "bytes", (json_int_t)bytes);
    json_object_set_new(object, "lod_vertices", json_integer((json_int_t)t.lod_vertices));
    json_object_set_new(object, "solid_triangles", json_integer((json_int_t)t.solid_triangles));
    json_object_set_new(object, "solid_vertices", json_integer((json_int_t)t.solid_vertices));
    json_object_set_new(object, "tree_models", json_integer((json_int_t)world->tree_models));
    json_object_set_new(object, "grass_clumps", json_integer((json_int_t)world->clumps));
    json_dumpf(object, stdout, JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(object);
}

static void print_summary(const struct options *options, const struct world *world, size_t bytes)
{
    struct totals t = world_totals(world);
    printf("%s: %" PRIu64 " triangles and %" PRIu64 " vertices in the world, of which %" PRIu64
           " and %" PRIu64 " are no plants; %" PRIu64 " and %" PRIu64
           " more in simpler levels of detail;\n%zu trees of %zu models, %zu shrubs, %zu clumps of "
           "grass, %zu meshes, %.1f MB\n",
           options->output, t.triangles, t.vertices, t.solid_triangles, t.solid_vertices,
           t.lod_triangles, t.lod_vertices, world->trees, world->tree_models, world->shrubs,
           world->clumps, world->mesh_count, (double)bytes / 1e6);
}

static int out_of_memory(void)
{
    fprintf(stderr, "cranny-level: out of memory; ask for a smaller --scale\n");
    return 1;
}

static int write_level(const struct options *options)
{
    struct world world;
    size_t size = 0;
    uint8_t *file =
        world_build(&world, options->scale, options->seed) ? glb_encode(&world, &size) : NULL;
    int result = file ? 0 : out_of_memory();
    struct cranny_error why;
    if (file && cranny_file_write(options->output, file, size, &why) != CRANNY_OK) {
        fprintf(stderr, "cranny-level: %s\n", why.message);
        result = 1;
    }
    if (result == 0) {
        if (options->json)
            print_json(options, &world, size);
        else
            print_summary(options, &world, size);
    }
    free(file);
    world_free(&world);
    return result;
}

int main(int count, char **args)
{
    struct options options;
    if (!parse(count, args, &options))
        return 2;
    if (options.help) {
        fputs(help, stdout);
        return 0;
    }
    return write_level(&options);
}
