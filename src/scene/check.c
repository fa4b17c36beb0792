/* The doctor: what in a scene spoils a bake, and what to pass instead. */
#include "scene/check.h"

#include "scene/document.h"
#include "scene/fields.h"
#include "scene/topology.h"

#include <stdarg.h>

void finding_add(struct findings *findings, enum cranny_severity severity, const char *code,
                 const char *format, ...)
{
    if (!grow_array((void **)&findings->items, &findings->capacity, findings->count + 1,
                    sizeof *findings->items)) {
        findings->failed = true;
        return;
    }
    struct finding *finding = &findings->items[findings->count++];
    finding->severity = severity;
    finding->code = code;
    va_list args;
    va_start(args, format);
    vsnprintf(finding->text, sizeof finding->text, format, args);
    va_end(args);
    one_line(finding->text);
}

/* Two digits are enough for a distance someone types. */
static double round2(double x)
{
    const double unit = pow(10, floor(log10(x)) - 1);
    return round(x / unit) * unit;
}

/* Units that models come in, with the metres of one. A building or an object in it measures between
 * half a metre and half a kilometre. */
static const struct {
    const char *name;
    double metres;
} units[] = {{"centimetres", 0.01}, {"millimetres", 0.001}};

static void check_large(struct findings *findings, double diagonal)
{
    const size_t unit = diagonal * units[0].metres <= 500 ? 0 : 1;
    finding_add(
        findings, diagonal > 5e4 ? CRANNY_SEVERITY_ERROR : CRANNY_SEVERITY_WARNING, "scale-large",
        "the scene measures %.4g m from corner to corner; distances are in metres, so it is "
        "probably "
        "modelled in %s: pass --set distance_long=%g --set distance_short=%g, or scale it by %g",
        diagonal, units[unit].name, 300 / units[unit].metres, 2 / units[unit].metres,
        units[unit].metres);
}

static void check_small(struct findings *findings, double diagonal)
{
    /* the defaults suit halls of some 50 m: six diagonals, and a twenty-fifth of one */
    finding_add(
        findings, diagonal < 0.05 ? CRANNY_SEVERITY_ERROR : CRANNY_SEVERITY_WARNING, "scale-small",
        "the scene measures only %.4g m from corner to corner, far below the default distances of "
        "300 and 2 m; for a small object, or one modelled in larger units, pass --set "
        "distance_long=%g --set distance_short=%g",
        diagonal, round2(diagonal * 6), round2(diagonal / 25));
}

static void check_scale(struct findings *findings, const double bounds[6])
{
    double size = 0, far = 0;
    for (int k = 0; k < 3; k++) {
        size += (bounds[3 + k] - bounds[k]) * (bounds[3 + k] - bounds[k]);
        far = fmax(far, fmax(fabs(bounds[k]), fabs(bounds[3 + k])));
    }
    size = sqrt(size);
    if (!(size > 0))
        return;
    if (size < 0.5)
        check_small(findings, size);
    else if (size > 5000)
        check_large(findings, size);
    else if (size > 500)
        finding_add(
            findings, CRANNY_SEVERITY_NOTE, "scale-doubtful",
            "the scene measures %.4g m from corner to corner; if it is no landscape but modelled "
            "in "
            "centimetres, pass --set distance_long=30000 --set distance_short=200",
            size);
    if (far > 2e4 * size)
        finding_add(
            findings, CRANNY_SEVERITY_WARNING, "far-from-origin",
            "the scene of %.4g m lies %.4g m away from the origin, where floats are coarse; move "
            "it "
            "to the origin",
            size, far);
}

/* Sums over all meshes, and where each oddity was seen first. */
struct totals {
    struct topology sum;
    uint64_t triangles, vertices, flat_meshes, inverted_meshes;
    const char *first_inverted, *first_flipped, *first_duplicate, *first_flat;
};

static void note_first(const char **first, const struct mesh *mesh, bool seen)
{
    if (seen && !*first)
        *first = *mesh->view.name ? mesh->view.name : "without a name";
}

/* What only ignored instances show harms nothing, whatever its faces are like. */
static bool *ignored_meshes(const struct cranny_scene *scene)
{
    bool *ignored = alloc_array(scene->mesh_count, sizeof *ignored);
    for (int pass = 0; ignored && pass < 2; pass++)
        for (size_t i = 0; i < scene->instance_count; i++)
            if ((scene->instances[i].view.role != CRANNY_ROLE_IGNORED) == pass)
                ignored[scene->instances[i].view.mesh] = !pass;
    return ignored;
}

static enum cranny_status measure(const struct cranny_scene *scene, struct totals *totals,
                                  struct cranny_error *why)
{
    bool *ignored = ignored_meshes(scene);
    enum cranny_status status = ignored ? CRANNY_OK : fail_memory(why, "check");
    for (size_t i = 0; status == CRANNY_OK && i < scene->mesh_count; i++) {
        const struct mesh *mesh = &scene->meshes[i];
        struct topology t;
        if (ignored[i])
            continue;
        status = topology_measure(&mesh->view, &t, why);
        if (status != CRANNY_OK)
            break;
        const bool inverted = t.closed && t.volume < 0;
        totals->triangles += mesh->view.triangle_count;
        totals->vertices += mesh->view.vertex_count;
        totals->sum.degenerate += t.degenerate;
        totals->sum.duplicates += t.duplicates;
        totals->sum.back_to_back += t.back_to_back;
        totals->sum.flipped_edges += t.flipped_edges;
        totals->sum.unused_vertices += t.unused_vertices;
        totals->inverted_meshes += inverted;
        totals->flat_meshes += !mesh->view.normals;
        note_first(&totals->first_inverted, mesh, inverted);
        note_first(&totals->first_flipped, mesh, t.flipped_edges > 0);
        note_first(&totals->first_duplicate, mesh, t.duplicates + t.back_to_back > 0);
        note_first(&totals->first_flat, mesh, !mesh->view.normals);
    }
    free(ignored);
    return status;
}

static void check_faces(struct findings *findings, const struct totals *totals)
{
    const struct topology *sum = &totals->sum;
    typedef unsigned long long number;
    if (totals->inverted_meshes)
        finding_add(
            findings, CRANNY_SEVERITY_WARNING, "inverted-mesh",
            "%llu closed meshes are inside out (the first is '%s'): rays from them start inside; "
            "flip their faces, unless they are rooms seen from within",
            (number)totals->inverted_meshes, totals->first_inverted);
    if (sum->flipped_edges)
        finding_add(
            findings, CRANNY_SEVERITY_WARNING, "inconsistent-winding",
            "at %llu edges neighbouring faces look to opposite sides (first in mesh '%s'); unify "
            "the "
            "winding, or make the material doubleSided",
            (number)sum->flipped_edges, totals->first_flipped);
    if (sum->duplicates || sum->back_to_back)
        finding_add(
            findings, sum->duplicates ? CRANNY_SEVERITY_WARNING : CRANNY_SEVERITY_NOTE,
            "duplicate-faces",
            "%llu triangles repeat another one, and at %llu places two lie back to back (first in "
            "mesh '%s'); repeated ones fight for the same samples: remove them",
            (number)sum->duplicates, (number)sum->back_to_back, totals->first_duplicate);
    if (sum->degenerate && sum->degenerate < totals->triangles)
        finding_add(findings, CRANNY_SEVERITY_NOTE, "degenerate-triangles",
                    "%llu of %llu triangles have no area; they take no samples",
                    (number)sum->degenerate, (number)totals->triangles);
    if (totals->flat_meshes)
        finding_add(
            findings, CRANNY_SEVERITY_NOTE, "missing-normals",
            "%llu meshes have no normals (the first is '%s') and are baked faceted, as glTF says; "
            "export normals if they should be smooth",
            (number)totals->flat_meshes, totals->first_flat);
    if (sum->unused_vertices)
        finding_add(findings, CRANNY_SEVERITY_NOTE, "unused-vertices",
                    "%llu of %llu vertices belong to no triangle; they are baked as open",
                    (number)sum->unused_vertices, (number)totals->vertices);
}

static void check_materials(struct findings *findings, const struct cranny_scene *scene)
{
    struct cranny_scene_info info;
    cranny_scene_get_info(scene, &info);
    if (info.blended_triangles)
        finding_add(
            findings, CRANNY_SEVERITY_NOTE, "blend-materials",
            "%llu triangles are blended; each ray counts their hits in proportion to their opacity",
            (unsigned long long)info.blended_triangles);
    if (info.skipped_primitives)
        finding_add(findings, CRANNY_SEVERITY_NOTE, "skipped-primitives",
                    "%llu primitives are points or lines; they neither occlude nor receive values",
                    (unsigned long long)info.skipped_primitives);
}

static bool has_occlusion(const json_t *material)
{
    return json_object_get(material, "occlusionTexture") != NULL;
}

/* Sets in use by the primitive that has most: TEXCOORD_0 up to one below the answer. */
static int texcoord_sets(const json_t *attributes)
{
    char name[24];
    for (int set = 0;; set++) {
        snprintf(name, sizeof name, "TEXCOORD_%d", set);
        if (!json_object_get(attributes, name))
            return set;
    }
}

static void check_texcoords(struct findings *findings, const struct document *document)
{
    const json_t *meshes = document_array(document, "meshes");
    int most = 0;
    size_t compressed = 0;
    for (size_t m = 0; m < json_array_size(meshes); m++) {
        const json_t *primitives = json_object_get(json_array_get(meshes, m), "primitives");
        for (size_t p = 0; p < json_array_size(primitives); p++) {
            const json_t *primitive = json_array_get(primitives, p);
            most = max_int(most, texcoord_sets(json_object_get(primitive, "attributes")));
            compressed += extension_of(primitive, "KHR_draco_mesh_compression") != NULL;
        }
    }
    if (most > 1)
        finding_add(
            findings, CRANNY_SEVERITY_WARNING, "texcoord-sets",
            "some primitives already have %d sets of texture coordinates, so that the occlusion "
            "becomes TEXCOORD_%d, which some viewers ignore; --to color or --to attribute avoids "
            "it",
            most, most);
    else if (most > 0)
        finding_add(findings, CRANNY_SEVERITY_NOTE, "texcoord-sets",
                    "the occlusion becomes TEXCOORD_%d beside the set that is there", most);
    if (compressed)
        finding_add(
            findings, CRANNY_SEVERITY_NOTE, "compressed-primitives",
            "%zu primitives are Draco-compressed; the values are added beside the compressed data",
            compressed);
}

static void check_document(struct findings *findings, const struct cranny_scene *scene)
{
    const struct document *document = scene->document;
    const json_t *materials = document_array(document, "materials");
    size_t kept = 0, posed = 0;
    for (size_t i = 0; i < json_array_size(materials); i++)
        kept += has_occlusion(json_array_get(materials, i));
    if (kept)
        finding_add(
            findings, CRANNY_SEVERITY_WARNING, "occlusion-texture",
            "%zu materials have an occlusion texture, which is kept; pass --replace to displace it",
            kept);
    for (size_t i = 0; i < scene->instance_count; i++) {
        const int node = scene->instances[i].source_node;
        const json_t *object =
            node < 0 ? NULL : json_array_get(document_array(document, "nodes"), (size_t)node);
        posed += json_object_get(object, "skin") || json_object_get(object, "weights");
    }
    if (posed)
        finding_add(
            findings, CRANNY_SEVERITY_NOTE, "stored-pose",
            "%zu nodes are skinned or morphed; they are baked in the pose that the file stores",
            posed);
    check_texcoords(findings, document);
}

/* Worst first; equal ones stay in the order in which they were found. */
static void report_all(const struct findings *findings, cranny_finding_fn *report, void *user)
{
    for (int severity = CRANNY_SEVERITY_ERROR; severity <= CRANNY_SEVERITY_NOTE; severity++)
        for (size_t i = 0; i < findings->count; i++)
            if ((int)findings->items[i].severity == severity)
                report(user, findings->items[i].severity, findings->items[i].code,
                       findings->items[i].text);
}

static enum cranny_status find_all(struct findings *findings, const struct cranny_scene *scene,
                                   struct cranny_error *why)
{
    struct totals totals = {0};
    double bounds[6];
    enum cranny_status status = measure(scene, &totals, why);
    if (status != CRANNY_OK)
        return status;
    cranny_scene_bounds(scene, bounds);
    if (!cranny_scene_triangle_count(scene))
        finding_add(
            findings, CRANNY_SEVERITY_ERROR, "empty-scene",
            "the scene shows no triangles, so there is nothing to bake; choose another scene of "
            "the "
            "file, or export meshes");
    else if (totals.sum.degenerate == totals.triangles)
        finding_add(findings, CRANNY_SEVERITY_ERROR, "no-area",
                    "none of the %llu triangles has an area, so there is nothing to bake",
                    (unsigned long long)totals.triangles);
    check_scale(findings, bounds);
    check_faces(findings, &totals);
    check_materials(findings, scene);
    if (scene->document)
        check_document(findings, scene);
    status = check_roles(findings, scene, bounds, why);
    return status == CRANNY_OK && findings->failed ? fail_memory(why, "check") : status;
}

enum cranny_status cranny_scene_check(const struct cranny_scene *scene, cranny_finding_fn *report,
                                      void *user, struct cranny_error *why)
{
    struct findings findings = {0};
    enum cranny_status status = find_all(&findings, scene, why);
    if (status == CRANNY_OK)
        report_all(&findings, report, user);
    free(findings.items);
    return status;
}
