/* Truths kept in a folder, by what they show. */
#include "base/base.h"

#include <cranny/image.h>
#include <cranny/truth.h>
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <math.h>

/* Raise when tracing gives other values for the same parameters. */
#define TRUTH_FORMAT 1

/* Two independent 64-bit multiplicative hashes of the same words. */
struct content {
    uint64_t a, b;
};

static void add_word(struct content *content, uint64_t word)
{
    content->a = (content->a ^ word) * UINT64_C(0x9e3779b97f4a7c15);
    content->a ^= content->a >> 32;
    content->b = (content->b + word) * UINT64_C(0xc2b2ae3d27d4eb4f);
    content->b ^= content->b >> 29;
}

static void add_bytes(struct content *content, const void *data, size_t size)
{
    const char *bytes = data;
    add_word(content, size);
    for (; size >= 8; size -= 8, bytes += 8) {
        uint64_t word;
        memcpy(&word, bytes, 8);
        add_word(content, word);
    }
    uint64_t rest = 0;
    if (size)
        memcpy(&rest, bytes, size);
    add_word(content, rest);
}

static void add_double(struct content *content, double value)
{
    add_bytes(content, &value, sizeof value);
}

static void add_material(struct content *content, const struct cranny_material *material)
{
    add_word(content, (uint64_t)material->alpha_mode);
    add_double(content, (double)material->alpha_cutoff);
    add_double(content, (double)material->opacity);
    add_word(content, (uint64_t)(int64_t)material->alpha_texture);
    add_bytes(content, material->uv_transform, sizeof material->uv_transform);
}

static void add_mesh(struct content *content, const struct cranny_mesh *mesh)
{
    const size_t vertices = mesh->vertex_count, triangles = mesh->triangle_count;
    add_bytes(content, mesh->positions, vertices * sizeof *mesh->positions);
    add_bytes(content, mesh->texcoords, mesh->texcoords ? vertices * sizeof *mesh->texcoords : 0);
    add_bytes(content, mesh->triangles, triangles * sizeof *mesh->triangles);
    add_bytes(content, mesh->triangle_materials, triangles * sizeof *mesh->triangle_materials);
}

static void add_scene(struct content *content, const struct cranny_scene *scene)
{
    for (uint32_t i = 0; i < cranny_scene_material_count(scene); i++)
        add_material(content, cranny_scene_material(scene, i));
    for (uint32_t i = 0; i < cranny_scene_texture_count(scene); i++) {
        const struct cranny_alpha_texture *texture = cranny_scene_texture(scene, i);
        add_word(content, (uint64_t)texture->wrap_u << 32 | (uint64_t)texture->wrap_v);
        add_word(content, texture->width);
        add_bytes(content, texture->alpha, (size_t)texture->width * texture->height);
    }
    for (uint32_t i = 0; i < cranny_scene_mesh_count(scene); i++)
        add_mesh(content, cranny_scene_mesh(scene, i));
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const struct cranny_instance *instance = cranny_scene_instance(scene, i);
        add_word(content, instance->mesh);
        add_bytes(content, instance->world_from_object, sizeof instance->world_from_object);
        /* nothing for ordinary ones, so that truths kept before there were roles stay good */
        if (instance->role != CRANNY_ROLE_SOLID || instance->lod)
            add_word(content, UINT64_C(0x726f6c65) << 32 | (uint64_t)instance->role << 1 |
                                  cranny_instance_exists(instance));
    }
}

/* What the viewport shows: the guard band does not touch the truth. */
static void add_view(struct content *content, const struct cranny_gbuffer *g)
{
    const size_t width = (size_t)g->viewport.width, samples = (size_t)max_int(1, g->sample_count);
    const size_t depth_row = g->depth_stride ? g->depth_stride : (size_t)g->width * sizeof(float);
    const size_t normal_bytes = cranny_normal_bytes(g->normal_format);
    const size_t normal_row = g->normal_stride ? g->normal_stride : (size_t)g->width * normal_bytes;
    const size_t rows = (size_t)g->height;
    add_word(content, width << 32 | (size_t)g->viewport.height);
    add_word(content, samples);
    add_bytes(content, g->world_from_view, 12 * sizeof(double));
    add_bytes(content, &g->projection, sizeof g->projection);
    for (size_t s = 0; s < samples; s++)
        for (int y = g->viewport.y; y < g->viewport.y + g->viewport.height; y++) {
            const size_t row = s * rows + (size_t)y, x = (size_t)g->viewport.x;
            add_bytes(content, (const char *)g->depth + row * depth_row + x * sizeof(float),
                      width * sizeof(float));
            add_bytes(content, (const char *)g->normal + row * normal_row + x * normal_bytes,
                      width * normal_bytes);
        }
}

static struct content content_of(const struct cranny_scene *scene, const struct cranny_gbuffer *g,
                                 const struct cranny_raytrace_params *params)
{
    struct content content = {UINT64_C(0x243f6a8885a308d3), UINT64_C(0x13198a2e03707344)};
    add_word(&content, TRUTH_FORMAT);
    add_bytes(&content, cranny_version(), strlen(cranny_version()));
    add_double(&content, (double)params->radius_world);
    add_double(&content, (double)params->error_target);
    add_word(&content, (uint64_t)params->kernel);
    add_word(&content, (uint64_t)params->rays);
    add_word(&content, (uint64_t)params->seed);
    add_scene(&content, scene);
    add_view(&content, g);
    return content;
}

/* `path` holds at least the folder's length and 48 more. */
static char *entry_path(const char *folder, const struct content *content, const char *ending)
{
    const size_t size = strlen(folder) + 48;
    char *path = malloc(size);
    if (path)
        snprintf(path, size, "%s/%016" PRIx64 "%016" PRIx64 "%s", folder, content->a, content->b,
                 ending);
    return path;
}

static bool read_report(const char *path, struct cranny_raytrace_report *report)
{
    json_t *entry = json_load_file(path, 0, NULL);
    json_int_t rays = 0;
    const bool good =
        entry &&
        json_unpack(entry, "{sI si si sF sF sF}", "rays", &rays, "rays_per_pixel",
                    &report->rays_per_pixel, "passes", &report->passes, "standard_error_mean",
                    &report->standard_error_mean, "standard_error_max", &report->standard_error_max,
                    "seconds", &report->seconds) == 0;
    report->rays = (uint64_t)rays;
    json_decref(entry);
    return good;
}

/* What is missing, broken or of another size is traced anew. */
static bool read_entry(const char *picture, const char *facts, struct cranny_truth *truth)
{
    struct cranny_image image;
    if (!read_report(facts, &truth->report) ||
        cranny_image_read(picture, CRANNY_IMAGE_VALUE, &image, NULL) != CRANNY_OK)
        return false;
    const bool fits = image.width == truth->width && image.height == truth->height;
    if (fits)
        memcpy(truth->visibility, image.pixels,
               (size_t)image.width * (size_t)image.height * sizeof(float));
    cranny_image_free(&image);
    return fits;
}

/* The facts come last: without them there is no entry. */
static enum cranny_status write_entry(const char *picture, const char *facts,
                                      const struct cranny_truth *truth, struct cranny_error *why)
{
    const struct cranny_raytrace_report *r = &truth->report;
    enum cranny_status status =
        cranny_image_write(picture, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_AUTO, truth->width,
                           truth->height, 1, truth->visibility, 0, why);
    json_t *entry = json_pack("{sI si si sf sf sf}", "rays", (json_int_t)r->rays, "rays_per_pixel",
                              r->rays_per_pixel, "passes", r->passes, "standard_error_mean",
                              r->standard_error_mean, "standard_error_max", r->standard_error_max,
                              "seconds", r->seconds);
    char *text = entry ? json_dumps(entry, JSON_INDENT(2)) : NULL;
    json_decref(entry);
    if (status == CRANNY_OK)
        status =
            text ? cranny_file_write(facts, text, strlen(text), why) : fail_memory(why, "truth");
    free(text);
    return status;
}

static enum cranny_status trace(const struct cranny_frame *frame,
                                const struct cranny_raytrace_params *params,
                                struct cranny_truth *truth, struct cranny_error *why)
{
    return cranny_frame_raytrace(frame, params, truth->visibility, 0, NULL, &truth->report, why);
}

static enum cranny_status get_kept(const struct cranny_scene *scene,
                                   const struct cranny_frame *frame,
                                   const struct cranny_raytrace_params *params, const char *folder,
                                   struct cranny_truth *truth, struct cranny_error *why)
{
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    const struct content content = content_of(scene, &g, params);
    char *picture = entry_path(folder, &content, ".pfm");
    char *facts = entry_path(folder, &content, ".json");
    enum cranny_status status = picture && facts ? CRANNY_OK : fail_memory(why, "truth");
    truth->kept = status == CRANNY_OK && read_entry(picture, facts, truth);
    if (status == CRANNY_OK && !truth->kept) {
        status = trace(frame, params, truth, why);
        if (status == CRANNY_OK)
            status = write_entry(picture, facts, truth, why);
    }
    free(picture);
    free(facts);
    return status;
}

enum cranny_status cranny_truth_get(const struct cranny_scene *scene,
                                    const struct cranny_frame *frame,
                                    const struct cranny_raytrace_params *params, const char *folder,
                                    struct cranny_truth *truth, struct cranny_error *why)
{
    const struct cranny_raytrace_params defaults = cranny_raytrace_params_default();
    const struct cranny_gbuffer g = cranny_frame_gbuffer(frame);
    const double begin_s = seconds_now();
    params = params ? params : &defaults;
    *truth = (struct cranny_truth){.width = g.viewport.width, .height = g.viewport.height};
    truth->visibility = alloc_array((size_t)truth->width * (size_t)truth->height, sizeof(float));
    if (!truth->visibility)
        return fail_memory(why, "truth");
    const enum cranny_status status = folder ? get_kept(scene, frame, params, folder, truth, why)
                                             : trace(frame, params, truth, why);
    truth->seconds = seconds_now() - begin_s;
    if (status != CRANNY_OK)
        cranny_truth_free(truth);
    return status;
}

void cranny_truth_free(struct cranny_truth *truth)
{
    free(truth->visibility);
    *truth = (struct cranny_truth){0};
}
