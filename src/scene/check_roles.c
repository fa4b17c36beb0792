/* What seems to be a plant, a sky or a hull but is taken for solid, by name, number, size and alpha
 * mask; and levels of detail by name that found no finer one. */
#include "scene/check.h"
#include "scene/gltf.h"

#include <ctype.h>
#include <strings.h>

/* NAME_LENGTH: what comes behind so many bytes of a name is not looked at. */
enum { NOTE_LIMIT = 12, NAME_LENGTH = 128, TRY_LIMIT = 100, NAMES_ABOVE = 6, PATTERN_SIZE = 96 };

/* What a word says. Generic ones leave it to the size whether it is a tree, a shrub or grass. */
enum hint { HINT_NONE, HINT_TREE, HINT_SHRUB, HINT_GRASS, HINT_IGNORED, HINT_PLANT, HINT_MASK };

static const struct {
    const char *word;
    enum hint hint;
    bool ending; /* of a longer word, too: "appletree" */
} words[] = {
    {"tree", HINT_TREE, true},          {"trees", HINT_TREE, true},
    {"oak", HINT_TREE, false},          {"pine", HINT_TREE, false},
    {"birch", HINT_TREE, false},        {"spruce", HINT_TREE, false},
    {"palm", HINT_TREE, false},         {"willow", HINT_TREE, false},
    {"maple", HINT_TREE, false},        {"shrub", HINT_SHRUB, false},
    {"shrubs", HINT_SHRUB, false},      {"bush", HINT_SHRUB, true},
    {"bushes", HINT_SHRUB, true},       {"fern", HINT_SHRUB, false},
    {"hedge", HINT_SHRUB, false},       {"grass", HINT_GRASS, false},
    {"reed", HINT_GRASS, false},        {"reeds", HINT_GRASS, false},
    {"plant", HINT_PLANT, false},       {"plants", HINT_PLANT, false},
    {"foliage", HINT_PLANT, false},     {"vegetation", HINT_PLANT, false},
    {"leaf", HINT_PLANT, false},        {"leaves", HINT_PLANT, false},
    {"flower", HINT_PLANT, false},      {"flowers", HINT_PLANT, false},
    {"skybox", HINT_IGNORED, false},    {"skydome", HINT_IGNORED, false},
    {"skysphere", HINT_IGNORED, false}, {"collider", HINT_IGNORED, false},
    {"collision", HINT_IGNORED, false}, {"ucx", HINT_IGNORED, false},
};

static enum hint word_hint(const char *word, size_t length)
{
    for (size_t i = 0; i < COUNT_OF(words); i++) {
        const size_t known = strlen(words[i].word);
        if (length == known || (words[i].ending && length > known && length < 16))
            if (!strncasecmp(word + length - known, words[i].word, known))
                return words[i].hint;
    }
    return HINT_NONE;
}

static size_t letters(const char *text, bool to_capital)
{
    size_t length = 0;
    while (length < NAME_LENGTH && isalpha((unsigned char)text[length]) &&
           !(to_capital && length && isupper((unsigned char)text[length]) &&
             islower((unsigned char)text[length - 1])))
        length++;
    return length;
}

/* Words end where letters do, or where a capital follows a small one: "SkyBox" is one word or two.
 */
static enum hint name_hint(const char *name)
{
    for (const char *at = name; *at && at < name + NAME_LENGTH;) {
        const size_t run = letters(at, false);
        enum hint hint = run ? word_hint(at, run) : HINT_NONE;
        for (size_t first = 0, length; hint == HINT_NONE && first < run; first += length) {
            length = letters(at + first, true);
            hint = word_hint(at + first, length);
        }
        if (hint != HINT_NONE)
            return hint;
        at += run ? run : 1;
    }
    return HINT_NONE;
}

/* Length without the numbers that tell copies apart: "Shrub" of "Shrub_012" and of "Shrub.001". */
static size_t stem_length(const char *name)
{
    const size_t whole = strnlen(name, NAME_LENGTH);
    size_t length = whole;
    while (length > 0 && (isdigit((unsigned char)name[length - 1]) ||
                          (length > 1 && strchr("_-. ", name[length - 1]))))
        length--;
    return length ? length : whole;
}

/* What is known of a mesh whatever its instances are called. */
struct mesh_facts {
    double low[3], high[3]; /* object space */
    double masked;          /* share of its triangles */
    enum hint material;     /* of its materials' names */
};

/* An instance that may have another role, under the name that says so. */
struct suspect {
    const char *name;
    size_t stem;
    enum hint hint;
    enum cranny_role role;
    uint32_t instance;
    double triangles, masked;
    bool by_name; /* not by a material's name or its mask alone */
};

struct inquiry {
    const struct cranny_scene *scene;
    struct findings *findings;
    struct mesh_facts *meshes;
    enum hint *materials; /* of their names */
    struct suspect *suspects;
    size_t count;
    double diagonal, triangles; /* of the scene */
    size_t notes, unsaid, tries;
    bool failed; /* out of memory */
};

static struct mesh_facts mesh_facts(const struct inquiry *inquiry, const struct cranny_mesh *mesh)
{
    struct mesh_facts facts = {.low = {INFINITY, INFINITY, INFINITY},
                               .high = {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            facts.low[k] = fmin(facts.low[k], (double)mesh->positions[v][k]);
            facts.high[k] = fmax(facts.high[k], (double)mesh->positions[v][k]);
        }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t index = mesh->triangle_materials[t];
        facts.masked += inquiry->scene->materials[index].alpha_mode == CRANNY_ALPHA_MASK;
        if (facts.material == HINT_NONE)
            facts.material = inquiry->materials[index];
    }
    facts.masked /= mesh->triangle_count ? mesh->triangle_count : 1;
    return facts;
}

/* Height and largest extent in the world, of the box around the turned box of the mesh. */
static void instance_size(const struct cranny_instance *instance, const struct mesh_facts *facts,
                          double *height, double *extent)
{
    const double *m = instance->world_from_object;
    double size[3];
    *extent = 0;
    for (int i = 0; i < 3; i++) {
        size[i] = 0;
        for (int k = 0; k < 3; k++)
            size[i] += fabs(m[4 * i + k]) * (facts->high[k] - facts->low[k]);
        *extent = fmax(*extent, size[i]);
    }
    *height = size[1];
}

/* Files in other units than the metre are measured against the scene itself. */
static enum cranny_role plant_by_size(const struct inquiry *inquiry, double height, double extent)
{
    const bool metres = inquiry->diagonal > 5 && inquiry->diagonal < 2000;
    const double unit = metres ? 1 : inquiry->diagonal / 100;
    return extent < 0.4 * unit   ? CRANNY_ROLE_GRASS
           : height > 2.5 * unit ? CRANNY_ROLE_TREE
                                 : CRANNY_ROLE_SHRUB;
}

/* The role that fits, or solid when the thing is too large for what its name says: a lawn, a whole
 * forest in one mesh. */
static enum cranny_role fitting_role(const struct inquiry *inquiry, enum hint hint, double height,
                                     double extent)
{
    static const double largest[CRANNY_ROLE_COUNT] = {[CRANNY_ROLE_TREE] = 0.35,
                                                      [CRANNY_ROLE_SHRUB] = 0.12,
                                                      [CRANNY_ROLE_GRASS] = 0.02,
                                                      [CRANNY_ROLE_IGNORED] = INFINITY};
    const enum cranny_role role = hint == HINT_TREE      ? CRANNY_ROLE_TREE
                                  : hint == HINT_SHRUB   ? CRANNY_ROLE_SHRUB
                                  : hint == HINT_GRASS   ? CRANNY_ROLE_GRASS
                                  : hint == HINT_IGNORED ? CRANNY_ROLE_IGNORED
                                                         : plant_by_size(inquiry, height, extent);
    return extent <= largest[role] * inquiry->diagonal ? role : CRANNY_ROLE_SOLID;
}

/* The nearest name that says something: its own, its mesh's, those above. */
static const char *telling_name(const struct cranny_scene *scene, const struct instance *instance,
                                enum hint *hint)
{
    const char *name = instance->view.name;
    if ((*hint = name_hint(name)) != HINT_NONE)
        return name;
    name = scene->meshes[instance->view.mesh].view.name;
    if ((*hint = name_hint(name)) != HINT_NONE)
        return name;
    const json_t *nodes = scene->document ? document_array(scene->document, "nodes") : NULL;
    int node = instance->source_node;
    for (int i = 0; i < NAMES_ABOVE && node >= 0 && (size_t)node < scene->node_count; i++) {
        name = loose_name(json_array_get(nodes, (size_t)node));
        if ((*hint = name_hint(name)) != HINT_NONE)
            return name;
        node = scene->node_up[node];
    }
    return NULL;
}

static void suspect_instance(struct inquiry *inquiry, uint32_t index)
{
    const struct cranny_scene *scene = inquiry->scene;
    const struct instance *instance = &scene->instances[index];
    const struct mesh_facts *facts = &inquiry->meshes[instance->view.mesh];
    const struct mesh *mesh = &scene->meshes[instance->view.mesh];
    double height, extent;
    enum hint hint;
    const char *name = telling_name(scene, instance, &hint);
    const bool by_name = name != NULL;
    if (!name) {
        hint = facts->material != HINT_NONE ? HINT_PLANT : facts->masked > 0.5 ? HINT_MASK : hint;
        name = *mesh->view.name ? mesh->view.name : instance->view.name;
    }
    if (hint == HINT_NONE || facts->material == HINT_IGNORED || !*name)
        return;
    instance_size(&instance->view, facts, &height, &extent);
    const enum cranny_role role = fitting_role(inquiry, hint, height, extent);
    if (role == CRANNY_ROLE_SOLID)
        return;
    inquiry->suspects[inquiry->count++] =
        (struct suspect){.name = name,
                         .stem = stem_length(name),
                         .hint = hint,
                         .role = role,
                         .instance = index,
                         .triangles = mesh->view.triangle_count,
                         .masked = facts->masked * mesh->view.triangle_count,
                         .by_name = by_name};
}

static int compare_stems(const struct suspect *a, const struct suspect *b)
{
    const int order = strncasecmp(a->name, b->name, a->stem < b->stem ? a->stem : b->stem);
    return order ? order : (a->stem > b->stem) - (a->stem < b->stem);
}

static int compare_suspects(const void *a, const void *b)
{
    const struct suspect *x = a, *y = b;
    const int order = compare_stems(x, y);
    return order ? order : (x->instance > y->instance) - (x->instance < y->instance);
}

/* The name as a pattern for one shell word: what would mean something to either becomes ?. */
static void make_pattern(const struct suspect *suspects, size_t count, char pattern[PATTERN_SIZE])
{
    bool longer = false;
    size_t length = suspects[0].stem;
    for (size_t i = 0; i < count; i++)
        longer = longer || suspects[i].name[length];
    if (length > PATTERN_SIZE - 2) {
        length = PATTERN_SIZE - 2;
        longer = true;
    }
    for (size_t i = 0; i < length; i++) {
        const char c = suspects[0].name[i];
        pattern[i] = strchr("*?'\\", c) || iscntrl((unsigned char)c) ? '?' : c;
    }
    pattern[length] = longer ? '*' : 0;
    pattern[length + 1] = 0;
}

/* Most of the group decides between tree, shrub and grass. */
static enum cranny_role group_role(const struct suspect *suspects, size_t count)
{
    size_t votes[CRANNY_ROLE_COUNT] = {0}, best = 0;
    for (size_t i = 0; i < count; i++)
        votes[suspects[i].role]++;
    for (size_t role = 1; role < CRANNY_ROLE_COUNT; role++)
        best = votes[role] > votes[best] ? role : best;
    return (enum cranny_role)best;
}

/* Single things and the scene's main object need no role; a mask alone says little unless the thing
 * is everywhere. */
static bool worth_saying(const struct inquiry *inquiry, const struct suspect *suspects,
                         size_t count)
{
    double triangles = 0;
    bool named = false;
    for (size_t i = 0; i < count; i++) {
        triangles += suspects[i].triangles;
        named = named || suspects[i].by_name;
    }
    if (suspects[0].hint == HINT_IGNORED)
        return true;
    if (named)
        return count >= 3 || triangles < 0.5 * inquiry->triangles;
    return count >= (suspects[0].hint == HINT_MASK ? 20 : 3);
}

/* Whether the pattern stays within the group; a telling name may take a few more along. */
static bool pattern_fits(struct inquiry *inquiry, const struct suspect *suspects, size_t count,
                         const char *pattern)
{
    uint32_t matched = 0;
    size_t allowed = count;
    if (inquiry->tries++ >= TRY_LIMIT)
        return false;
    for (size_t i = 0; allowed == count && i < count; i++)
        allowed += suspects[i].by_name ? 1 + count / 2 : 0;
    if (!roles_count(inquiry->scene, pattern, &matched))
        inquiry->failed = true;
    return matched > 0 && matched <= allowed;
}

static void report_group(struct inquiry *inquiry, const struct suspect *suspects, size_t count)
{
    static const char *const gains[CRANNY_ROLE_COUNT] = {
        [CRANNY_ROLE_TREE] = "half-transparent to rays",
        [CRANNY_ROLE_SHRUB] = "boxes of fog to rays",
        [CRANNY_ROLE_GRASS] = "nothing to rays, one value each",
        [CRANNY_ROLE_IGNORED] = "left out",
    };
    char pattern[PATTERN_SIZE];
    double triangles = 0, masked = 0;
    if (!worth_saying(inquiry, suspects, count))
        return;
    make_pattern(suspects, count, pattern);
    if (!pattern_fits(inquiry, suspects, count, pattern))
        return;
    if (inquiry->notes == NOTE_LIMIT) {
        inquiry->unsaid++;
        return;
    }
    inquiry->notes++;
    for (size_t i = 0; i < count; i++) {
        triangles += suspects[i].triangles;
        masked += suspects[i].masked;
    }
    const enum cranny_role role = group_role(suspects, count);
    finding_add(inquiry->findings, CRANNY_SEVERITY_NOTE, "role-proposed",
                "%zu %s %.60s (%.0f triangles, %.0f %% with a mask) may be %s: to make them %s, "
                "pass --role %s='%s'",
                count, count == 1 ? "instance named" : "instances named like", suspects[0].name,
                triangles, 100 * masked / fmax(triangles, 1), cranny_role_names()[role],
                gains[role], cranny_role_names()[role], pattern);
}

static void report_groups(struct inquiry *inquiry)
{
    qsort(inquiry->suspects, inquiry->count, sizeof *inquiry->suspects, compare_suspects);
    for (size_t first = 0, end; first < inquiry->count; first = end) {
        end = first + 1;
        while (end < inquiry->count &&
               compare_stems(&inquiry->suspects[first], &inquiry->suspects[end]) == 0)
            end++;
        report_group(inquiry, inquiry->suspects + first, end - first);
    }
    if (inquiry->unsaid)
        finding_add(inquiry->findings, CRANNY_SEVERITY_NOTE, "role-proposed",
                    "%zu more groups of instances may be plants", inquiry->unsaid);
}

/* "X_LOD1" that is drawn on its own. */
static void check_level_names(struct findings *findings, const struct cranny_scene *scene)
{
    const char *first = NULL, *rest = NULL;
    size_t count = 0, base = 0;
    for (size_t i = 0; i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        const char *after;
        size_t before;
        uint32_t level;
        if (!cranny_instance_exists(instance) ||
            !lod_name(instance->name, &before, &level, &after) || !level)
            continue;
        if (!count++) {
            first = instance->name;
            base = before;
            rest = after;
        }
    }
    if (count)
        finding_add(findings, CRANNY_SEVERITY_WARNING, "unpaired-lods",
                    "%zu instances are named as coarser levels of detail (the first is '%.60s'), "
                    "but have no finer one in their place under the same parent, so that they are "
                    "drawn and occlude; if they should not, pass --role ignored='*%.*s*'",
                    count, first, (int)(rest - first - (ptrdiff_t)base), first + base);
}

enum cranny_status check_roles(struct findings *findings, const struct cranny_scene *scene,
                               const double bounds[6], struct cranny_error *why)
{
    struct inquiry inquiry = {.scene = scene,
                              .findings = findings,
                              .meshes = alloc_array(scene->mesh_count, sizeof *inquiry.meshes),
                              .suspects =
                                  alloc_array(scene->instance_count, sizeof *inquiry.suspects),
                              .triangles = (double)cranny_scene_triangle_count(scene)};
    inquiry.materials = alloc_array(scene->material_count, sizeof *inquiry.materials);
    const bool good = inquiry.meshes && inquiry.materials && inquiry.suspects;
    for (size_t i = 0; good && i < scene->material_count; i++)
        inquiry.materials[i] = name_hint(scene->materials[i].name);
    for (int k = 0; k < 3; k++)
        inquiry.diagonal += (bounds[3 + k] - bounds[k]) * (bounds[3 + k] - bounds[k]);
    inquiry.diagonal = sqrt(inquiry.diagonal);
    for (size_t i = 0; good && i < scene->mesh_count; i++)
        inquiry.meshes[i] = mesh_facts(&inquiry, &scene->meshes[i].view);
    for (size_t i = 0; good && i < scene->instance_count; i++) {
        const struct cranny_instance *instance = &scene->instances[i].view;
        if (instance->role == CRANNY_ROLE_SOLID && instance->lod == 0)
            suspect_instance(&inquiry, (uint32_t)i);
    }
    if (good) {
        report_groups(&inquiry);
        check_level_names(findings, scene);
    }
    free(inquiry.meshes);
    free(inquiry.materials);
    free(inquiry.suspects);
    return good && !inquiry.failed ? CRANNY_OK : fail_memory(why, "check");
}
