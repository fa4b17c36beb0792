/* Levels of detail by the names of siblings. */
#include "scene/gltf.h"

#include <ctype.h>
#include <strings.h>

bool lod_name(const char *name, size_t *base, uint32_t *level, const char **rest)
{
    const char *mark = NULL;
    for (const char *at = strchr(name, '_'); at; at = strchr(at + 1, '_'))
        if (!strncasecmp(at, "_lod", 4) && isdigit((unsigned char)at[4]))
            mark = at;
    if (!mark || mark == name)
        return false;
    const char *end = mark + 4;
    for (*level = 0; isdigit((unsigned char)*end) && end < mark + 7; end++)
        *level = 10 * *level + (uint32_t)(*end - '0');
    *base = (size_t)(mark - name);
    *rest = end;
    if (*end == '.' && isdigit((unsigned char)end[1]))
        for (end++; isdigit((unsigned char)*end);)
            end++;
    return !*end;
}

/* A node that may be a level. */
struct candidate {
    const char *name, *rest;
    size_t base;
    int parent;
    uint32_t level;
    bool plain; /* without _LOD */
    size_t node;
};

static bool read_candidate(const struct gltf *gltf, size_t index, struct candidate *candidate)
{
    const struct node *node = &gltf->nodes[index];
    const char *name = loose_name(node->object);
    if (!node->reached || node->finest || node->lod_of >= 0 || !*name)
        return false;
    *candidate = (struct candidate){.name = name, .parent = node->base, .node = index};
    candidate->plain = !lod_name(name, &candidate->base, &candidate->level, &candidate->rest);
    if (candidate->plain) {
        /* "Rock.001" belongs beside "Rock_LOD1.001" */
        const char *dot = strrchr(name, '.');
        const size_t length = strlen(name);
        const bool copy = dot && dot > name && dot[1] &&
                          strspn(dot + 1, "0123456789") == length - (size_t)(dot + 1 - name);
        candidate->base = copy ? (size_t)(dot - name) : length;
        candidate->rest = copy ? dot : "";
        candidate->level = 0;
    }
    return true;
}

static int compare_things(const struct candidate *a, const struct candidate *b)
{
    if (a->parent != b->parent)
        return a->parent < b->parent ? -1 : 1;
    const size_t shorter = a->base < b->base ? a->base : b->base;
    const int order = memcmp(a->name, b->name, shorter);
    if (order || a->base != b->base)
        return order ? order : a->base < b->base ? -1 : 1;
    return strcmp(a->rest, b->rest);
}

static int compare_candidates(const void *a, const void *b)
{
    const struct candidate *x = a, *y = b;
    const int order = compare_things(x, y);
    if (order)
        return order;
    if (x->level != y->level)
        return x->level < y->level ? -1 : 1;
    if (x->plain != y->plain)
        return x->plain - y->plain;
    return (x->node > y->node) - (x->node < y->node);
}

/* Candidates of one thing, the finest first: join the levels when there are two or more. A plain
 * name beside an explicit level 0 is another thing. */
static void join(struct gltf *gltf, const struct candidate *items, size_t count)
{
    const struct candidate *finest = &items[0];
    if (items[count - 1].level == finest->level)
        return;
    gltf->nodes[finest->node].finest = gltf->nodes[finest->node].by_name = true;
    for (size_t i = 1; i < count; i++) {
        struct node *node = &gltf->nodes[items[i].node];
        if (items[i].plain && !finest->plain)
            continue;
        node->lod_of = (int)finest->node;
        node->level = items[i].level - finest->level;
        node->by_name = true;
    }
}

enum cranny_status lods_by_name(struct gltf *gltf, struct cranny_error *why)
{
    struct candidate candidate, *items;
    bool any = false;
    for (size_t i = 0; !any && i < gltf->node_count; i++)
        any = read_candidate(gltf, i, &candidate) && !candidate.plain;
    if (!any)
        return CRANNY_OK;
    enum cranny_status status =
        document_reserve(gltf->document, gltf->node_count * sizeof *items, "levels of detail", why);
    if (status != CRANNY_OK)
        return status;
    items = alloc_array(gltf->node_count, sizeof *items);
    if (!items)
        return fail_memory(why, "levels of detail");
    size_t count = 0;
    for (size_t i = 0; i < gltf->node_count; i++)
        count += read_candidate(gltf, i, &items[count]);
    qsort(items, count, sizeof *items, compare_candidates);
    for (size_t first = 0, end; first < count; first = end) {
        for (end = first + 1; end < count && !compare_things(&items[first], &items[end]);)
            end++;
        join(gltf, items + first, end - first);
    }
    free(items);
    return status;
}
