/* Vertex runs: decoded, morphed, skinned. */
#include "scene/mesh.h"

#define SETS_MAX 16 /* of JOINTS_n and WEIGHTS_n */

static float *scratch(struct builder *b, size_t count, size_t size, struct cranny_error *why)
{
    if (document_reserve(b->gltf->document, (uint64_t)count * size, "vertices", why) != CRANNY_OK)
        return NULL;
    float *memory = alloc_array(count, size);
    if (!memory)
        fail_memory(why, "vertices");
    return memory;
}

/* Add `weight` times a target's attribute to `out`. */
static enum cranny_status add_target(struct builder *b, const struct vertex_run *run, size_t target,
                                     const char *name, float weight, float *deltas, float (*out)[3],
                                     struct cranny_error *why)
{
    struct document *document = b->gltf->document;
    const struct place mesh = {NULL, "meshes", b->index};
    const struct place primitive = {&mesh, "primitives", run->source.primitive};
    const struct place place = {&primitive, "targets", target};
    const json_t *attributes = json_array_get(run->targets, target);
    struct accessor accessor;
    int index;
    enum cranny_status status = field_index(document, &place, attributes, name,
                                            document_count(document, "accessors"), &index, why);
    if (status != CRANNY_OK || index < 0)
        return status;
    status = counted_accessor(&b->gltf->views, &place, index, run->source.count, 3, &accessor, why);
    if (status != CRANNY_OK)
        return status;
    accessor_floats(&accessor, deltas);
    for (size_t i = 0; i < run->source.count; i++)
        for (int k = 0; k < 3; k++)
            out[i][k] += weight * deltas[3 * i + (size_t)k];
    return CRANNY_OK;
}

static enum cranny_status morph(struct builder *b, const struct vertex_run *run,
                                float (*positions)[3], float (*normals)[3],
                                struct cranny_error *why)
{
    const size_t targets = json_array_size(run->targets), given = json_array_size(b->weights);
    float *deltas = NULL;
    enum cranny_status status = CRANNY_OK;
    for (size_t t = 0; status == CRANNY_OK && t < targets && t < given; t++) {
        const float weight = (float)json_number_value(json_array_get(b->weights, t));
        if (weight == 0)
            continue;
        if (!deltas)
            deltas = scratch(b, run->source.count, 12, why);
        if (!deltas)
            return CRANNY_MEMORY;
        status = add_target(b, run, t, "POSITION", weight, deltas, positions, why);
        if (status == CRANNY_OK && normals)
            status = add_target(b, run, t, "NORMAL", weight, deltas, normals, why);
    }
    free(deltas);
    return status;
}

static enum cranny_status add_influences(const struct builder *b, const struct vertex_run *run,
                                         const float *joints, const float *weights,
                                         double (*blend)[13], struct cranny_error *why)
{
    const struct place mesh = {NULL, "meshes", b->index};
    for (size_t i = 0; i < 4 * run->source.count; i++) {
        const double weight = weights[i];
        if (weight == 0)
            continue;
        if (!isfinite(weight) || !(joints[i] >= 0 && joints[i] < (float)b->pose->joint_count))
            return fail_at(b->gltf->document, PLACE(&mesh, "primitives", run->source.primitive),
                           why, CRANNY_INPUT,
                           "vertex %zu is tied to joint %g with weight %g, but the skin has %zu "
                           "joints",
                           i / 4, (double)joints[i], weight, b->pose->joint_count);
        const double *joint = b->pose->joints[(size_t)joints[i]];
        double *sum = blend[i / 4];
        for (int k = 0; k < 12; k++)
            sum[k] += weight * joint[k];
        sum[12] += weight;
    }
    return CRANNY_OK;
}

/* The cofactors transform normals, whatever the scale and the handedness. */
static void apply_blend(const double *m, float position[3], float *normal)
{
    double moved[3];
    transform_point(m, position, moved);
    for (int k = 0; k < 3; k++)
        position[k] = (float)moved[k];
    if (!normal)
        return;
    const double n[3] = {normal[0], normal[1], normal[2]};
    for (int i = 0; i < 3; i++) {
        const double *p = m + 4 * ((i + 1) % 3), *q = m + 4 * ((i + 2) % 3);
        normal[i] =
            (float)((p[1] * q[2] - p[2] * q[1]) * n[0] + (p[2] * q[0] - p[0] * q[2]) * n[1] +
                    (p[0] * q[1] - p[1] * q[0]) * n[2]);
    }
}

static void deform(const struct builder *b, size_t count, double (*blend)[13],
                   float (*positions)[3], float (*normals)[3])
{
    for (size_t i = 0; i < count; i++) {
        const double total = blend[i][12];
        /* weights should add up to 1; a vertex without any follows the first joint */
        if (total > 0 && fabs(total - 1) > 1e-6)
            for (int k = 0; k < 12; k++)
                blend[i][k] /= total;
        if (!(total > 0))
            memcpy(blend[i], b->pose->joints[0], sizeof b->pose->joints[0]);
        apply_blend(blend[i], positions[i], normals ? normals[i] : NULL);
    }
}

static enum cranny_status blend_joints(struct builder *b, const struct vertex_run *run,
                                       float *joints, float *weights, double (*blend)[13],
                                       struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (int set = 0; status == CRANNY_OK && set < SETS_MAX; set++) {
        char joint_name[16], weight_name[16];
        snprintf(joint_name, sizeof joint_name, "JOINTS_%d", set);
        snprintf(weight_name, sizeof weight_name, "WEIGHTS_%d", set);
        if (!json_object_get(run->source.attributes, joint_name))
            break;
        status = source_floats(&b->gltf->views, &run->source, joint_name, 4, joints, why);
        if (status == CRANNY_OK)
            status = source_floats(&b->gltf->views, &run->source, weight_name, 4, weights, why);
        if (status == CRANNY_OK)
            status = add_influences(b, run, joints, weights, blend, why);
    }
    return status;
}

static enum cranny_status skin(struct builder *b, const struct vertex_run *run,
                               float (*positions)[3], float (*normals)[3], struct cranny_error *why)
{
    const size_t count = run->source.count;
    if (!b->pose || !b->pose->joint_count || !json_object_get(run->source.attributes, "JOINTS_0"))
        return CRANNY_OK;
    const uint64_t bytes = (uint64_t)count * (32 + 13 * sizeof(double));
    enum cranny_status status = document_reserve(b->gltf->document, bytes, "skin", why);
    if (status != CRANNY_OK)
        return status;
    float *joints = alloc_array(count, 16), *weights = alloc_array(count, 16);
    double(*blend)[13] = alloc_array(count, sizeof *blend);
    status = joints && weights && blend ? blend_joints(b, run, joints, weights, blend, why)
                                        : fail_memory(why, "skin");
    if (status == CRANNY_OK)
        deform(b, count, blend, positions, normals);
    free(joints);
    free(weights);
    free(blend);
    return status;
}

static enum cranny_status read_texcoords(struct builder *b, const struct vertex_run *run,
                                         struct cranny_error *why)
{
    char name[24];
    float(*out)[2] = b->texcoords + run->first;
    snprintf(name, sizeof name, "TEXCOORD_%d", run->texcoord);
    enum cranny_status status =
        source_floats(&b->gltf->views, &run->source, name, 2, &out[0][0], why);
    for (size_t i = 0; status == CRANNY_OK && i < run->source.count; i++)
        for (int k = 0; k < 2; k++)
            if (!(fabsf(out[i][k]) < 1e9f))
                out[i][k] = 0;
    return status;
}

static enum cranny_status read_run(struct builder *b, const struct vertex_run *run,
                                   struct cranny_error *why)
{
    struct views *views = &b->gltf->views;
    float(*positions)[3] = b->positions + run->first;
    float(*normals)[3] = run->normal >= 0 ? b->normals + run->first : NULL;
    enum cranny_status status =
        source_floats(views, &run->source, "POSITION", 3, &positions[0][0], why);
    if (status == CRANNY_OK && normals)
        status = source_floats(views, &run->source, "NORMAL", 3, &normals[0][0], why);
    if (status == CRANNY_OK && run->texcoord >= 0)
        status = read_texcoords(b, run, why);
    if (status == CRANNY_OK && run->targets)
        status = morph(b, run, positions, normals, why);
    if (status == CRANNY_OK)
        status = skin(b, run, positions, normals, why);
    return status;
}

enum cranny_status vertices_read(struct builder *builder, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (size_t i = 0; status == CRANNY_OK && i < builder->run_count; i++)
        status = read_run(builder, &builder->runs[i], why);
    return status;
}

/* Beyond 1e18 squares leave the range of float, in rays and in areas. */
static bool usable(const float p[3])
{
    return fabsf(p[0]) <= 1e18f && fabsf(p[1]) <= 1e18f && fabsf(p[2]) <= 1e18f;
}

static enum cranny_status find_broken(const struct builder *b, struct cranny_error *why)
{
    const struct place mesh = {NULL, "meshes", b->index};
    for (size_t i = 0; i < b->primitive_count; i++) {
        const struct mesh_part *part = &b->parts[i];
        for (uint32_t t = 0; t < part->triangle_count; t++) {
            const uint32_t *v = b->triangles[part->triangle_first + t];
            for (int c = 0; c < 3; c++)
                if (!usable(b->positions[v[c]]))
                    return fail_at(b->gltf->document, PLACE(&mesh, "primitives", part->primitive),
                                   why, CRANNY_INPUT,
                                   "the position of vertex %u is not finite, or beyond 1e18",
                                   v[c] - part->vertex_first);
        }
    }
    return CRANNY_OK;
}

enum cranny_status positions_check(struct builder *builder, struct cranny_error *why)
{
    const size_t count = (size_t)builder->vertex_count;
    size_t broken = 0;
    for (size_t v = 0; v < count; v++)
        broken += !usable(builder->positions[v]);
    if (!broken)
        return CRANNY_OK;
    enum cranny_status status = find_broken(builder, why);
    for (size_t v = 0; status == CRANNY_OK && v < count; v++)
        if (!usable(builder->positions[v]))
            memset(builder->positions[v], 0, sizeof *builder->positions);
    return status;
}
