/* Triangle lists, strips and fans (glTF 2.0, 3.7.2.1) as lists of checked indices. */
#include "scene/draco.h"
#include "scene/mesh.h"

static enum cranny_status fail_index(const struct builder *builder, const struct primitive *p,
                                     size_t position, uint32_t index, struct cranny_error *why)
{
    const struct place mesh = {NULL, "meshes", builder->index};
    return fail_at(builder->gltf->document, PLACE(&mesh, "primitives", p->index), why, CRANNY_INPUT,
                   "index %zu is %u, but there are only %zu vertices", position, index,
                   builder->runs[p->run].source.count);
}

/* Indices relative to the run become indices of the mesh. */
static enum cranny_status rebase(const struct builder *builder, const struct primitive *p,
                                 uint32_t *indices, size_t count, struct cranny_error *why)
{
    const struct vertex_run *run = &builder->runs[p->run];
    const uint32_t limit = (uint32_t)run->source.count, first = run->first;
    uint32_t outside = 0;
    for (size_t i = 0; i < count; i++)
        outside |= indices[i] >= limit;
    for (size_t i = 0; outside && i < count; i++)
        if (indices[i] >= limit)
            return fail_index(builder, p, i, indices[i], why);
    for (size_t i = 0; first && i < count; i++)
        indices[i] += first;
    return CRANNY_OK;
}

/* `count` indices; up to two more are written when a list ends in an incomplete triangle. */
static enum cranny_status read_indices(const struct builder *builder, const struct primitive *p,
                                       size_t count, uint32_t *out, struct cranny_error *why)
{
    const struct vertex_run *run = &builder->runs[p->run];
    struct accessor accessor;
    if (!count)
        return CRANNY_OK;
    if (p->indices < 0) {
        for (size_t i = 0; i < count; i++)
            out[i] = run->first + (uint32_t)i;
        return CRANNY_OK;
    }
    enum cranny_status status =
        accessor_open(&builder->gltf->views, (size_t)p->indices, &accessor, why);
    if (status != CRANNY_OK)
        return status;
    accessor_indices(&accessor, out);
    return rebase(builder, p, out, count, why);
}

static bool degenerate(const uint32_t t[3])
{
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

/* Strips are joined by triangles without area, which are no triangles of the model. */
static size_t unroll(const uint32_t *v, size_t count, bool fan, uint32_t (*out)[3])
{
    size_t made = 0;
    for (size_t i = 0; i + 2 < count; i++) {
        const size_t odd = i % 2;
        const uint32_t strip[3] = {v[i], v[i + 1 + odd], v[i + 2 - odd]};
        const uint32_t blade[3] = {v[i + 1], v[i + 2], v[0]};
        memcpy(out[made], fan ? blade : strip, sizeof strip);
        made += !degenerate(out[made]);
    }
    return made;
}

static enum cranny_status read_rolled(struct builder *builder, const struct primitive *p,
                                      uint32_t (*out)[3], uint32_t *made, struct cranny_error *why)
{
    const size_t count = p->triangle_bound ? (size_t)p->triangle_bound + 2 : 0;
    uint32_t *indices = alloc_array(count, sizeof *indices);
    if (!indices)
        return fail_memory(why, "indices");
    enum cranny_status status = read_indices(builder, p, count, indices, why);
    if (status == CRANNY_OK)
        *made = (uint32_t)unroll(indices, count, p->mode == 6, out);
    free(indices);
    return status;
}

static enum cranny_status read_primitive(struct builder *builder, const struct primitive *p,
                                         uint32_t *made, struct cranny_error *why)
{
    uint32_t(*out)[3] = builder->triangles + builder->triangle_count;
    const size_t bound = (size_t)p->triangle_bound;
    *made = (uint32_t)bound;
#if CRANNY_HAVE_DRACO
    const struct vertex_source *source = &builder->runs[p->run].source;
    if (source->draco) {
        draco_indices(source->draco, &out[0][0]);
        return rebase(builder, p, &out[0][0], bound * 3, why);
    }
#endif
    if (p->mode == 4)
        return read_indices(builder, p, bound * 3, &out[0][0], why);
    return read_rolled(builder, p, out, made, why);
}

enum cranny_status triangles_read(struct builder *builder, struct cranny_error *why)
{
    for (size_t i = 0; i < builder->primitive_count; i++) {
        const struct primitive *p = &builder->primitives[i];
        const struct vertex_run *run = &builder->runs[p->run];
        uint32_t made = 0;
        enum cranny_status status = read_primitive(builder, p, &made, why);
        if (status != CRANNY_OK)
            return status;
        for (uint32_t t = 0; t < made; t++)
            builder->triangle_materials[builder->triangle_count + t] = p->material;
        builder->parts[i] = (struct mesh_part){.vertex_first = run->first,
                                               .vertex_count = (uint32_t)run->source.count,
                                               .triangle_first = builder->triangle_count,
                                               .triangle_count = made,
                                               .primitive = (uint32_t)p->index};
        builder->triangle_count += made;
    }
    return CRANNY_OK;
}
