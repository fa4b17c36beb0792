#include "bake/sheets.h"

#include "bake/forest.h"

/* A sample is closed in when nothing escapes and what there is lies well within the short distance.
 * A dark room is not: its walls are further off. */
#define CLOSED_IN_LONG 0.02
#define CLOSED_IN_SHORT 0.25
/* Share of a piece's area that must be closed in. The floor in a tent is not: the rest of the
 * ground is outside. */
#define CLOSED_IN_SHARE 0.9

struct piece {
    double area, closed;
    bool single_sided; /* some of it */
};

struct finder {
    const struct plan *plan;
    const struct samples *samples;
    const struct target *target;
    const struct cranny_mesh *mesh;
    uint32_t *parent;     /* per vertex: a forest */
    struct piece *pieces; /* per root */
};

static bool is_closed(const struct sample *sample)
{
    return sample_value(sample, 0) < CLOSED_IN_LONG && sample_value(sample, 1) < CLOSED_IN_SHORT;
}

static bool two_sided(const struct finder *finder, uint32_t triangle)
{
    return finder->plan->scene->materials[finder->mesh->triangle_materials[triangle]].double_sided;
}

static uint32_t closed_samples(const struct finder *finder, uint32_t triangle)
{
    const struct target *target = finder->target;
    uint32_t count = 0;
    for (uint32_t s = target->sample_start[triangle]; s < target->sample_start[triangle + 1]; s++)
        count += is_closed(&finder->samples->values[target->sample_base + s]);
    return count;
}

/* Whether it is worth looking closer. */
static bool any_closed(const struct finder *finder)
{
    for (uint32_t t = 0; t < finder->mesh->triangle_count; t++)
        if (two_sided(finder, t) && closed_samples(finder, t) > 0)
            return true;
    return false;
}

static uint32_t hash_position(const float p[3])
{
    uint32_t h = 0;
    for (int k = 0; k < 3; k++) {
        uint32_t bits;
        const float positive_zero = p[k] + 0.0f;
        memcpy(&bits, &positive_zero, sizeof bits);
        h = hash_combine(h, bits);
    }
    return h;
}

static bool same_position(const float a[3], const float b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Vertices at one place, and the corners of a triangle, are connected. */
static enum cranny_status connect(struct finder *finder, struct cranny_error *why)
{
    const struct cranny_mesh *mesh = finder->mesh;
    size_t slot_count = 16;
    while (slot_count < (size_t)mesh->vertex_count * 2)
        slot_count *= 2;
    uint32_t *slots = alloc_array(slot_count, sizeof *slots);
    if (!slots)
        return fail_memory(why, "bake");
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        finder->parent[v] = v;
        size_t slot = hash_position(mesh->positions[v]) & (slot_count - 1);
        while (slots[slot] && !same_position(mesh->positions[slots[slot] - 1], mesh->positions[v]))
            slot = (slot + 1) & (slot_count - 1);
        if (slots[slot])
            forest_join(finder->parent, v, slots[slot] - 1);
        else
            slots[slot] = v + 1;
    }
    free(slots);
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        for (int c = 0; c < 2; c++)
            forest_join(finder->parent, mesh->triangles[t][c], mesh->triangles[t][c + 1]);
    return CRANNY_OK;
}

static void weigh(const struct finder *finder)
{
    const struct target *target = finder->target;
    for (uint32_t t = 0; t < finder->mesh->triangle_count; t++) {
        const uint32_t count = target->sample_start[t + 1] - target->sample_start[t];
        if (!count)
            continue;
        const double area = metric_area(target->metric, finder->mesh, t);
        struct piece *piece =
            &finder->pieces[forest_root(finder->parent, finder->mesh->triangles[t][0])];
        piece->area += area;
        piece->closed += area * closed_samples(finder, t) / count;
        piece->single_sided |= !two_sided(finder, t);
    }
}

/* Flags for the triangles of closed pieces; NULL when there are none. */
static enum cranny_status flag(const struct finder *finder, uint8_t **turned,
                               uint64_t *sample_count, struct cranny_error *why)
{
    const struct target *target = finder->target;
    for (uint32_t t = 0; t < finder->mesh->triangle_count; t++) {
        const struct piece *piece =
            &finder->pieces[forest_root(finder->parent, finder->mesh->triangles[t][0])];
        if (piece->single_sided || !(piece->closed > CLOSED_IN_SHARE * piece->area))
            continue;
        if (!*turned)
            *turned = alloc_array(finder->mesh->triangle_count, 1);
        if (!*turned)
            return fail_memory(why, "bake");
        (*turned)[t] = 1;
        *sample_count += target->sample_start[t + 1] - target->sample_start[t];
    }
    return CRANNY_OK;
}

static enum cranny_status find_in_target(struct finder *finder, uint8_t **turned,
                                         uint64_t *sample_count, struct cranny_error *why)
{
    if (!finder->target->sample_count || !any_closed(finder))
        return CRANNY_OK;
    finder->parent = alloc_array(finder->mesh->vertex_count, sizeof *finder->parent);
    finder->pieces = alloc_array(finder->mesh->vertex_count, sizeof *finder->pieces);
    enum cranny_status status =
        finder->parent && finder->pieces ? connect(finder, why) : fail_memory(why, "bake");
    if (status == CRANNY_OK) {
        weigh(finder);
        status = flag(finder, turned, sample_count, why);
    }
    free(finder->parent);
    free(finder->pieces);
    return status;
}

enum cranny_status sheets_find(const struct plan *plan, const struct samples *samples,
                               struct sheets *sheets, struct cranny_error *why)
{
    *sheets = (struct sheets){.target_count = plan->target_count};
    sheets->turned = alloc_array(plan->target_count, sizeof *sheets->turned);
    enum cranny_status status = sheets->turned ? CRANNY_OK : fail_memory(why, "bake");
    for (size_t i = 0; i < plan->target_count && status == CRANNY_OK; i++) {
        struct finder finder = {.plan = plan,
                                .samples = samples,
                                .target = &plan->targets[i],
                                .mesh = plan_mesh(plan, &plan->targets[i])};
        status = find_in_target(&finder, &sheets->turned[i], &sheets->sample_count, why);
    }
    if (status != CRANNY_OK)
        sheets_free(sheets);
    return status;
}

void sheets_free(struct sheets *sheets)
{
    for (size_t i = 0; sheets->turned && i < sheets->target_count; i++)
        free(sheets->turned[i]);
    free(sheets->turned);
    *sheets = (struct sheets){0};
}
