/* One glTF mesh: what its primitives need is surveyed first, then allocated once and decoded. */
#include "scene/mesh.h"
#include "scene/draco.h"

static const struct place *primitive_place(const struct builder *b, struct place places[2],
                                           size_t index)
{
    places[0] = (struct place){NULL, "meshes", b->index};
    places[1] = (struct place){&places[0], "primitives", index};
    return &places[1];
}

static bool same_targets(const json_t *a, const json_t *b)
{
    return a == b || (a && b && json_equal(a, b));
}

/* May a primitive with run `b`'s accessors use the vertices of `a`? */
static bool same_run(const struct builder *builder, const struct vertex_run *a,
                     const struct vertex_run *b)
{
    return a->position == b->position && a->normal == b->normal && !a->source.draco_ids &&
           !b->source.draco_ids &&
           (a->texcoord < 0 || b->texcoord < 0 || a->texcoord_accessor == b->texcoord_accessor) &&
           same_targets(a->targets, b->targets) &&
           (!builder->pose || !builder->pose->joint_count ||
            json_equal(a->source.attributes, b->source.attributes));
}

static size_t *run_bucket(struct builder *b, const struct vertex_run *run)
{
    const uint32_t hash = (uint32_t)run->position * 2654435761u ^ (uint32_t)run->normal * 40503u;
    return &b->buckets[hash % b->bucket_count];
}

/* The index of a run that serves; `run` is added when none does, and then owned by the builder. */
static size_t share_run(struct builder *b, const struct vertex_run *run)
{
    size_t *bucket = run_bucket(b, run);
    for (size_t i = *bucket; i != NO_INDEX; i = b->runs[i].next) {
        struct vertex_run *known = &b->runs[i];
        if (!same_run(b, known, run))
            continue;
        if (known->texcoord < 0) {
            known->texcoord = run->texcoord;
            known->texcoord_accessor = run->texcoord_accessor;
        }
        return i;
    }
    struct vertex_run *added = &b->runs[b->run_count];
    *added = *run;
    added->next = *bucket;
    added->first = (uint32_t)b->vertex_count;
    *bucket = b->run_count;
    b->vertex_count += run->source.count;
    return b->run_count++;
}

static enum cranny_status find_texcoord(struct builder *b, const struct place *place,
                                        struct vertex_run *run, struct cranny_error *why)
{
    char name[24];
    const struct document *document = b->gltf->document;
    if (run->texcoord < 0)
        return CRANNY_OK;
    snprintf(name, sizeof name, "TEXCOORD_%d", run->texcoord);
    enum cranny_status status =
        field_index(document, place, run->source.attributes, name,
                    document_count(document, "accessors"), &run->texcoord_accessor, why);
    if (status == CRANNY_OK && run->texcoord_accessor < 0) {
        warn_at(document, place,
                "its material's texture wants %s, which is missing; "
                "the texture's corner is used",
                name);
        run->texcoord = -1;
    }
    return status;
}

static enum cranny_status survey_run(struct builder *b, const struct place *place,
                                     struct primitive *p, struct vertex_run *run,
                                     struct cranny_error *why)
{
    struct document *document = b->gltf->document;
    const size_t accessors = document_count(document, "accessors");
    const struct place attributes = {place, "attributes", NO_INDEX};
    struct accessor position;
    json_t *targets;
    run->source.mesh = b->index;
    run->source.primitive = p->index;
    enum cranny_status status = field_index(document, &attributes, run->source.attributes, "NORMAL",
                                            accessors, &run->normal, why);
    if (status == CRANNY_OK)
        status = field_array(document, place, p->object, "targets", &targets, why);
    if (status == CRANNY_OK)
        status = accessor_open(&b->gltf->views, (size_t)run->position, &position, why);
    if (status != CRANNY_OK)
        return status;
    run->targets = targets;
    run->source.count = position.count;
    status = material_use(b->gltf, (int)p->material, &p->material, &run->texcoord, why);
    if (status == CRANNY_OK)
        status = find_texcoord(b, &attributes, run, why);
    if (status == CRANNY_OK)
        status = source_open(&b->gltf->views, p->object, &run->source, why);
    if (status != CRANNY_OK) {
        source_close(&run->source);
        return status;
    }
    p->run = share_run(b, run);
    return CRANNY_OK;
}

static enum cranny_status count_triangles(struct builder *b, const struct place *place,
                                          struct primitive *p, struct cranny_error *why)
{
    struct document *document = b->gltf->document;
    const struct vertex_source *source = &b->runs[p->run].source;
    struct accessor indices;
    uint64_t count = source->count;
    enum cranny_status status =
        field_index(document, place, p->object, "indices", document_count(document, "accessors"),
                    &p->indices, why);
#if CRANNY_HAVE_DRACO
    if (status == CRANNY_OK && source->draco) {
        p->triangle_bound = draco_triangles(source->draco);
        return status;
    }
#endif
    if (status == CRANNY_OK && p->indices >= 0) {
        status = accessor_open(&b->gltf->views, (size_t)p->indices, &indices, why);
        if (status != CRANNY_OK)
            return status;
        if (indices.components != 1 ||
            (indices.type != COMPONENT_U8 && indices.type != COMPONENT_U16 &&
             indices.type != COMPONENT_U32))
            return fail_at(document, PLACE(place, "indices", NO_INDEX), why, CRANNY_INPUT,
                           "accessor %d must hold SCALARs of unsigned bytes, shorts or ints",
                           p->indices);
        count = indices.count;
    }
    if (p->mode == 4 && count % 3)
        warn_at(document, place, "%llu indices are not a multiple of 3; the last ones are ignored",
                (unsigned long long)count);
    p->triangle_bound = p->mode == 4 ? count / 3 : count > 2 ? count - 2 : 0;
    return status;
}

/* *skip: nothing here occludes (points, lines, no positions). */
static enum cranny_status survey_primitive(struct builder *b, const struct place *place,
                                           struct primitive *p, bool *skip,
                                           struct cranny_error *why)
{
    struct document *document = b->gltf->document;
    struct vertex_run run = {.normal = -1, .texcoord = -1, .texcoord_accessor = -1};
    uint64_t mode;
    int material;
    json_t *attributes;
    *skip = true;
    if (!json_is_object(p->object))
        return fail_at(document, place, why, CRANNY_INPUT, "must be an object");
    enum cranny_status status = field_count(document, place, p->object, "mode", 4, &mode, why);
    if (status == CRANNY_OK && mode > 6)
        return fail_at(document, place, why, CRANNY_INPUT, "mode %llu is not one of glTF's",
                       (unsigned long long)mode);
    if (status == CRANNY_OK)
        status = field_object(document, place, p->object, "attributes", &attributes, why);
    if (status == CRANNY_OK && !attributes)
        return fail_at(document, place, why, CRANNY_INPUT, "has no attributes");
    if (status == CRANNY_OK)
        status = field_index(document, PLACE(place, "attributes", NO_INDEX), attributes, "POSITION",
                             document_count(document, "accessors"), &run.position, why);
    if (status == CRANNY_OK)
        status = field_index(document, place, p->object, "material", b->gltf->material_count,
                             &material, why);
    if (status != CRANNY_OK)
        return status;
    b->gltf->scene->skipped_primitives += mode < 4;
    if (mode < 4)
        return CRANNY_OK;
    if (run.position < 0) {
        warn_at(document, place, "has no POSITION; skipped");
        return CRANNY_OK;
    }
    *skip = false;
    p->mode = (int)mode;
    p->material = (uint32_t)material;
    run.source.attributes = attributes;
    status = survey_run(b, place, p, &run, why);
    return status == CRANNY_OK ? count_triangles(b, place, p, why) : status;
}

static enum cranny_status survey(struct builder *b, const json_t *primitives,
                                 struct cranny_error *why)
{
    const size_t count = json_array_size(primitives);
    b->bucket_count = count | 1;
    b->runs = alloc_array(count, sizeof *b->runs);
    b->buckets = alloc_array(b->bucket_count, sizeof *b->buckets);
    b->primitives = alloc_array(count, sizeof *b->primitives);
    b->parts = alloc_array(count, sizeof *b->parts);
    if (!b->runs || !b->buckets || !b->primitives || !b->parts)
        return fail_memory(why, "primitives");
    for (size_t i = 0; i < b->bucket_count; i++)
        b->buckets[i] = NO_INDEX;
    for (size_t i = 0; i < count; i++) {
        struct place places[2];
        struct primitive p = {.index = i, .object = json_array_get(primitives, i)};
        const struct place *place = primitive_place(b, places, i);
        bool skip;
        enum cranny_status status = survey_primitive(b, place, &p, &skip, why);
        if (status != CRANNY_OK)
            return status;
        if (skip)
            continue;
        b->primitives[b->primitive_count++] = p;
        b->triangle_bound += p.triangle_bound;
        if (b->vertex_count >= UINT32_MAX || b->triangle_bound >= UINT32_MAX / 3)
            return fail_at(b->gltf->document, place, why, CRANNY_INPUT,
                           "the mesh has more vertices or triangles than 32 bits can count");
    }
    return CRANNY_OK;
}

static enum cranny_status allocate(struct builder *b, struct cranny_error *why)
{
    const size_t vertices = (size_t)b->vertex_count;
    const size_t triangles = (size_t)b->triangle_bound + 1; /* triangles.c writes past the last */
    bool normals = false, texcoords = false;
    for (size_t i = 0; i < b->run_count; i++) {
        normals |= b->runs[i].normal >= 0;
        texcoords |= b->runs[i].texcoord >= 0;
    }
    const uint64_t per_vertex = 12 + (normals ? 12 : 0) + (texcoords ? 8 : 0);
    enum cranny_status status = document_reserve(
        b->gltf->document, vertices * per_vertex + (uint64_t)triangles * 16, "mesh", why);
    if (status != CRANNY_OK)
        return status;
    b->positions = alloc_array(vertices, sizeof *b->positions);
    b->normals = normals ? alloc_array(vertices, sizeof *b->normals) : NULL;
    b->texcoords = texcoords ? alloc_array(vertices, sizeof *b->texcoords) : NULL;
    b->triangles = alloc_array(triangles, sizeof *b->triangles);
    b->triangle_materials = alloc_array(triangles, sizeof *b->triangle_materials);
    if (!b->positions || !b->triangles || !b->triangle_materials || (normals && !b->normals) ||
        (texcoords && !b->texcoords))
        return fail_memory(why, "mesh");
    return CRANNY_OK;
}

static void release(struct builder *b)
{
    for (size_t i = 0; b->runs && i < b->run_count; i++)
        source_close(&b->runs[i].source);
    free(b->runs);
    free(b->buckets);
    free(b->primitives);
    free(b->positions);
    free(b->normals);
    free(b->texcoords);
    free(b->triangles);
    free(b->triangle_materials);
    free(b->parts);
}

/* Hand the builder's arrays to the scene. */
static enum cranny_status take(struct builder *b, int *scene_mesh, struct cranny_error *why)
{
    const struct mesh mesh = {.view = {.name = copy_text(loose_name(b->object)),
                                       .vertex_count = (uint32_t)b->vertex_count,
                                       .triangle_count = b->triangle_count,
                                       .positions = (const float(*)[3])b->positions,
                                       .normals = (const float(*)[3])b->normals,
                                       .texcoords = (const float(*)[2])b->texcoords,
                                       .triangles = (const uint32_t(*)[3])b->triangles,
                                       .triangle_materials = b->triangle_materials},
                              .source_mesh = (int)b->index,
                              .parts = b->parts,
                              .part_count = (uint32_t)b->primitive_count};
    if (!mesh.view.name)
        return fail_memory(why, "mesh");
    enum cranny_status status = scene_take_mesh(b->gltf->scene, &mesh, why);
    if (status != CRANNY_OK) {
        free((void *)mesh.view.name);
        return status;
    }
    *scene_mesh = (int)b->gltf->scene->mesh_count - 1;
    b->positions = NULL;
    b->normals = NULL;
    b->texcoords = NULL;
    b->triangles = NULL;
    b->triangle_materials = NULL;
    b->parts = NULL;
    return CRANNY_OK;
}

static enum cranny_status build(struct builder *b, const json_t *primitives, int *scene_mesh,
                                struct cranny_error *why)
{
    enum cranny_status status = survey(b, primitives, why);
    if (status != CRANNY_OK || !b->triangle_bound)
        return status;
    status = allocate(b, why);
    if (status == CRANNY_OK)
        status = vertices_read(b, why);
    if (status == CRANNY_OK)
        status = triangles_read(b, why);
    if (status == CRANNY_OK)
        status = positions_check(b, why);
    if (status == CRANNY_OK)
        status = normals_complete(b, why);
    if (status != CRANNY_OK || !b->triangle_count)
        return status;
    return take(b, scene_mesh, why);
}

enum cranny_status mesh_read(struct gltf *gltf, size_t index, const struct pose *pose,
                             int *scene_mesh, struct cranny_error *why)
{
    const struct place place = {NULL, "meshes", index};
    struct builder builder = {.gltf = gltf, .index = index, .pose = pose};
    json_t *object, *primitives, *weights;
    *scene_mesh = -1;
    enum cranny_status status = document_item(gltf->document, "meshes", index, &object, why);
    if (status == CRANNY_OK)
        status = field_array(gltf->document, &place, object, "primitives", &primitives, why);
    if (status == CRANNY_OK && !primitives)
        return fail_at(gltf->document, &place, why, CRANNY_INPUT, "has no primitives");
    if (status == CRANNY_OK)
        status = field_array(gltf->document, &place, object, "weights", &weights, why);
    if (status != CRANNY_OK)
        return status;
    builder.object = object;
    builder.weights = pose && pose->weights ? pose->weights : weights;
    status = build(&builder, primitives, scene_mesh, why);
    release(&builder);
    return status;
}
