/* Roles: their names, what glTF's extras say, and rules by name. */
#include "scene/gltf.h"

#include <ctype.h>
#include <strings.h>

static const char *const names[CRANNY_ROLE_COUNT + 1] = {"solid", "tree",    "shrub",
                                                         "grass", "ignored", NULL};

const char *const *cranny_role_names(void)
{
    return names;
}

/* What the extras of a node or mesh say: a role or ROLE_UNSAID. */
static int said_role(struct gltf *gltf, const char *list, size_t index, const json_t *object)
{
    const json_t *value = json_object_get(json_object_get(object, "extras"), "cranny_role");
    const char *word = json_string_value(value);
    for (int i = 0; word && names[i]; i++)
        if (!strcasecmp(word, names[i]))
            return i;
    /* A broken file has thousands of these; the first few are said. */
    if (value && gltf->role_complaints++ < COMPLAINT_LIMIT)
        warn_at(gltf->document,
                PLACE(PLACE(PLACE(NULL, list, index), "extras", NO_INDEX), "cranny_role", NO_INDEX),
                "%s%.40s%s is no role; roles are solid, tree, shrub, grass and ignored",
                word ? "'" : "", word ? word : "this value", word ? "'" : "");
    return ROLE_UNSAID;
}

static int mesh_role(struct gltf *gltf, int mesh)
{
    int *role = &gltf->mesh_roles[mesh];
    if (*role == ROLE_UNREAD)
        *role = said_role(
            gltf, "meshes", (size_t)mesh,
            json_array_get(json_object_get(gltf->document->root, "meshes"), (size_t)mesh));
    return *role;
}

void node_take_role(struct gltf *gltf, size_t index)
{
    struct node *node = &gltf->nodes[index];
    const struct node *up = node_up(node) >= 0 ? &gltf->nodes[node_up(node)] : NULL;
    const int said = said_role(gltf, "nodes", index, node->object);
    const int by_mesh = node->mesh >= 0 ? mesh_role(gltf, node->mesh) : ROLE_UNSAID;
    /* a mesh speaks for its own node and that node's coarser levels, not for the nodes below */
    const enum cranny_role above = !up                 ? CRANNY_ROLE_SOLID
                                   : node->lod_of >= 0 ? up->role
                                                       : up->role_below;
    node->role_below = said >= 0 ? (enum cranny_role)said : above;
    node->role = said >= 0 || by_mesh < 0 ? node->role_below : (enum cranny_role)by_mesh;
}

/* The start of the UTF-8 character after `text`'s first. */
static const char *next_character(const char *text)
{
    text++;
    while (((unsigned char)*text & 0xc0) == 0x80)
        text++;
    return text;
}

/* Only the last star is ever gone back to, so that time is at most the product of the lengths. */
static bool matches(const char *pattern, const char *text)
{
    const char *star = NULL, *retry = NULL;
    while (*text) {
        if (*pattern == '*') {
            star = ++pattern;
            retry = text;
        } else if (*pattern == '?') {
            pattern++;
            text = next_character(text);
        } else if (*pattern && tolower((unsigned char)*pattern) == tolower((unsigned char)*text)) {
            pattern++;
            text++;
        } else if (star) {
            pattern = star;
            text = retry = next_character(retry);
        } else {
            return false;
        }
    }
    while (*pattern == '*')
        pattern++;
    return !*pattern;
}

/* Which nodes match one rule by their own name or one above; each node is looked at once. */
enum verdict { VERDICT_NONE, VERDICT_NO, VERDICT_YES };

static bool node_matches(const struct cranny_scene *scene, const json_t *nodes, const char *pattern,
                         uint8_t *verdicts, int node)
{
    int at = node;
    while (at >= 0 && verdicts[at] == VERDICT_NONE &&
           !matches(pattern, loose_name(json_array_get(nodes, (size_t)at))))
        at = scene->node_up[at];
    if (at >= 0 && verdicts[at] == VERDICT_NONE)
        verdicts[at] = VERDICT_YES;
    const uint8_t verdict = at >= 0 ? verdicts[at] : VERDICT_NO;
    for (int below = node; below != at; below = scene->node_up[below])
        verdicts[below] = verdict;
    return verdict == VERDICT_YES;
}

/* Rules at work: what each has matched, and which was the last to match each instance (0: none). */
struct ruling {
    const struct cranny_scene *scene;
    const struct cranny_role_rule *rules;
    uint8_t *verdicts;     /* of nodes */
    uint8_t *mesh_matches; /* of meshes */
    uint32_t *last;        /* of instances: 1 and the rule */
};

static uint32_t apply_rule(struct ruling *ruling, size_t r)
{
    const struct cranny_scene *scene = ruling->scene;
    const char *pattern = ruling->rules[r].pattern;
    const json_t *nodes = scene->document ? document_array(scene->document, "nodes") : NULL;
    uint32_t count = 0;
    memset(ruling->verdicts, VERDICT_NONE, scene->node_count);
    for (size_t i = 0; i < scene->mesh_count; i++)
        ruling->mesh_matches[i] = matches(pattern, scene->meshes[i].view.name);
    for (size_t i = 0; i < scene->instance_count; i++) {
        const struct instance *instance = &scene->instances[i];
        const int node = instance->source_node;
        const bool placed = node >= 0 && (size_t)node < scene->node_count;
        if (!ruling->mesh_matches[instance->view.mesh] && !matches(pattern, instance->view.name) &&
            !(placed && node_matches(scene, nodes, pattern, ruling->verdicts, node)))
            continue;
        ruling->last[i] = (uint32_t)r + 1;
        count++;
    }
    return count;
}

struct by_group {
    uint32_t group, last;
};

static int compare_groups(const void *a, const void *b)
{
    const struct by_group *x = a, *y = b;
    return x->group != y->group ? (x->group > y->group) - (x->group < y->group)
                                : (x->last < y->last) - (x->last > y->last);
}

/* Coarser levels take the rules of their finest. `groups` has room for all instances. */
static void levels_follow(struct ruling *ruling, struct by_group *groups)
{
    const struct instance *instances = ruling->scene->instances;
    size_t count = 0;
    for (size_t i = 0; i < ruling->scene->instance_count; i++)
        if (instances[i].view.lod_group && !instances[i].view.lod)
            groups[count++] = (struct by_group){instances[i].view.lod_group, ruling->last[i]};
    qsort(groups, count, sizeof *groups, compare_groups);
    for (size_t i = 0; i < ruling->scene->instance_count; i++) {
        size_t low = 0, high = count;
        while (instances[i].view.lod && low < high) {
            const size_t middle = (low + high) / 2;
            if (groups[middle].group < instances[i].view.lod_group)
                low = middle + 1;
            else
                high = middle;
        }
        if (instances[i].view.lod && low < count &&
            groups[low].group == instances[i].view.lod_group && groups[low].last > ruling->last[i])
            ruling->last[i] = groups[low].last;
    }
}

/* `rules` are kept. False: out of memory; close it all the same. */
static bool ruling_open(struct ruling *ruling, const struct cranny_scene *scene,
                        const struct cranny_role_rule *rules)
{
    *ruling = (struct ruling){.scene = scene,
                              .rules = rules,
                              .verdicts = alloc_array(scene->node_count, 1),
                              .mesh_matches = alloc_array(scene->mesh_count, 1),
                              .last = alloc_array(scene->instance_count, sizeof *ruling->last)};
    return ruling->verdicts && ruling->mesh_matches && ruling->last;
}

static void ruling_close(struct ruling *ruling)
{
    free(ruling->verdicts);
    free(ruling->mesh_matches);
    free(ruling->last);
}

bool roles_count(const struct cranny_scene *scene, const char *pattern, uint32_t *count)
{
    const struct cranny_role_rule rule = {pattern, CRANNY_ROLE_SOLID};
    struct ruling ruling;
    const bool good = ruling_open(&ruling, scene, &rule);
    *count = 0;
    if (good)
        apply_rule(&ruling, 0);
    for (size_t i = 0; good && i < scene->instance_count; i++)
        *count += ruling.last[i] && cranny_instance_exists(&scene->instances[i].view);
    ruling_close(&ruling);
    return good;
}

enum cranny_status cranny_scene_assign_roles(struct cranny_scene *scene,
                                             const struct cranny_role_rule *rules,
                                             size_t rule_count, uint32_t *matched,
                                             struct cranny_error *why)
{
    for (size_t r = 0; r < rule_count; r++)
        if ((unsigned)rules[r].role >= CRANNY_ROLE_COUNT)
            return fail(why, CRANNY_USAGE, "role rule '%s': role %d does not exist",
                        rules[r].pattern, (int)rules[r].role);
    struct ruling ruling;
    const bool opened = ruling_open(&ruling, scene, rules);
    struct by_group *groups = alloc_array(scene->instance_count, sizeof *groups);
    const bool good = opened && groups;
    for (size_t r = 0; good && r < rule_count; r++) {
        const uint32_t count = apply_rule(&ruling, r);
        if (matched)
            matched[r] = count;
    }
    if (good)
        levels_follow(&ruling, groups);
    for (size_t i = 0; good && i < scene->instance_count; i++)
        if (ruling.last[i])
            scene->instances[i].view.role = rules[ruling.last[i] - 1].role;
    free(groups);
    ruling_close(&ruling);
    return good ? CRANNY_OK : fail_memory(why, "roles");
}
