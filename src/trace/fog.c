/* Shrubs as boxes of fog: how dense a mesh's box is, and how much boxes overlap.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.1, which
 * leaves open where densities come from and how they are reduced. */
#include "base/sequence.h"
#include "base/watch.h"
#include "scene/scene.h"
#include "trace/build.h"
#include "trace/kernel.h"

/* Chords through a mesh's box, by which its density is found. */
#define CHORDS 2048

/* Points per box at which the boxes there are counted; fewer where more than NEAR_MAX are near. */
#define OVERLAP_POINTS 16
#define CROWDED_POINTS 8
#define NEAR_MAX 256

/* Optical depth of half a box, at most: nothing gets through, and its square is a float. */
#define WEIGHT_MAX 1e9f

struct mesh_box {
    float centre[3], half[3]; /* in the mesh's own space */
    float density;            /* optical depth per length there */
    bool wanted;
    uint32_t instance; /* one that uses it */
};

/* The bounding box of what may stop a ray; false when there is nothing. */
static bool find_box(const struct cranny_scene *scene, const struct cranny_mesh *mesh,
                     struct mesh_box *box)
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        if (alpha_class(scene, mesh, t) >= TRIANGLE_CLASSES)
            continue;
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++) {
                const float p = mesh->positions[mesh->triangles[t][c]][k];
                low[k] = fminf(low[k], p);
                high[k] = fmaxf(high[k], p);
            }
    }
    float longest = 0;
    for (int k = 0; k < 3; k++) {
        box->centre[k] = 0.5f * low[k] + 0.5f * high[k];
        box->half[k] = 0.5f * high[k] - 0.5f * low[k];
        longest = fmaxf(longest, box->half[k]);
    }
    for (int k = 0; k < 3; k++)
        box->half[k] = fmaxf(box->half[k], FOG_THICKNESS_MIN * longest);
    return longest > 0 && isfinite(longest);
}

struct chord {
    float origin[3], direction[3], length;
};

/* Lines that are even over all that meet the box: points even over its faces, directions by the
 * cosine. The five numbers are the generalised golden ratio's steps (Roberts 2018). */
static struct chord box_chord(const struct mesh_box *box, uint32_t index)
{
    static const double steps[5] = {0.8812714616335696, 0.7766393890897682, 0.6844301295853426,
                                    0.6031687406857282, 0.5315553977157793};
    double u[5];
    for (int k = 0; k < 5; k++)
        u[k] = fraction(0.5 + steps[k] * (index + 1));
    const float *h = box->half;
    const float areas[3] = {h[1] * h[2], h[2] * h[0], h[0] * h[1]};
    float pick = (float)fraction(2 * u[4]) * (areas[0] + areas[1] + areas[2]);
    int axis = 0;
    for (; axis < 2 && pick >= areas[axis]; axis++)
        pick -= areas[axis];
    const float side = u[4] < 0.5 ? -1 : 1;
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    float cosine, sine;
    turn_vector(u[3], &cosine, &sine);
    const float radius = sqrtf((float)u[2]);
    struct chord chord = {.length = INFINITY};
    float at[3];
    at[axis] = side * h[axis];
    at[b] = (float)(2 * u[0] - 1) * h[b];
    at[c] = (float)(2 * u[1] - 1) * h[c];
    chord.direction[axis] = -side * sqrtf(1 - (float)u[2]);
    chord.direction[b] = radius * cosine;
    chord.direction[c] = radius * sine;
    for (int k = 0; k < 3; k++) {
        const float d = chord.direction[k];
        if (d != 0)
            chord.length = fminf(chord.length, ((d > 0 ? h[k] : -h[k]) - at[k]) / d);
        chord.origin[k] = box->centre[k] + at[k];
    }
    return chord;
}

/* Share of the chords that the mesh's triangles let through. */
static double open_share(RTCScene scene, const struct chord *chords)
{
    int open = 0;
    for (uint32_t first = 0; first < CHORDS; first += 8) {
        struct RTCRay8 r;
        _Alignas(32) int valid[8];
        for (uint32_t i = 0; i < 8; i++) {
            const struct chord *chord = &chords[first + i];
            valid[i] = -1;
            r.org_x[i] = chord->origin[0];
            r.org_y[i] = chord->origin[1];
            r.org_z[i] = chord->origin[2];
            r.dir_x[i] = chord->direction[0];
            r.dir_y[i] = chord->direction[1];
            r.dir_z[i] = chord->direction[2];
            r.tnear[i] = r.time[i] = 0;
            r.tfar[i] = chord->length;
            r.mask[i] = UINT32_MAX;
            r.id[i] = hash_u32(first + i);
            r.flags[i] = 0;
        }
        embree_any8(scene, valid, &r);
        for (int i = 0; i < 8; i++)
            open += r.tfar[i] >= 0;
    }
    return (double)open / CHORDS;
}

static double mean_rest(const struct chord *chords, float density)
{
    double sum = 0;
    for (int i = 0; i < CHORDS; i++)
        sum += (double)fog_rest(density, chords[i].length);
    return sum / CHORDS;
}

/* The density whose mean rest over the chords is `open`; half a chord stands for none. */
static float density_for(double open, const struct chord *chords, float size)
{
    if (open >= 1)
        return 0;
    open = fmax(open, 0.5 / CHORDS);
    float low = 0, high = 1 / size;
    for (int doublings = 0; doublings < 40 && mean_rest(chords, high) > open; doublings++)
        high *= 2;
    for (int step = 0; step < 24; step++) {
        const float middle = 0.5f * (low + high);
        *(mean_rest(chords, middle) > open ? &low : &high) = middle;
    }
    return 0.5f * (low + high);
}

/* False: out of memory. */
static bool measure_density(struct build *build, uint32_t mesh, struct mesh_box *box)
{
    struct chord *chords = alloc_array(CHORDS, sizeof *chords);
    RTCScene scene = chords ? rtcNewScene(build->tracer->device) : NULL;
    if (!scene) {
        free(chords);
        return false;
    }
    for (uint32_t i = 0; i < CHORDS; i++)
        chords[i] = box_chord(box, i);
    build_add_mesh(build, scene, mesh, NULL, false, 2 * box->instance);
    rtcCommitScene(scene);
    const float size = fmaxf(box->half[0], fmaxf(box->half[1], box->half[2]));
    box->density = density_for(open_share(scene, chords), chords, size);
    rtcReleaseScene(scene);
    free(chords);
    return true;
}

static enum cranny_status find_boxes(struct build *build, struct mesh_box *boxes,
                                     struct cranny_error *why)
{
    const struct cranny_tracer *tracer = build->tracer;
    const uint32_t mesh_count = cranny_scene_mesh_count(tracer->scene);
    for (uint32_t i = cranny_scene_instance_count(tracer->scene); i-- > 0;)
        if (tracer->instances[i].kind == KIND_FOG) {
            struct mesh_box *box = &boxes[cranny_scene_instance(tracer->scene, i)->mesh];
            box->wanted = true;
            box->instance = i;
        }
    atomic_bool failed = false;
#pragma omp parallel for schedule(dynamic) num_threads(build->threads)
    for (uint32_t m = 0; m < mesh_count; m++) {
        if (!boxes[m].wanted)
            continue;
        boxes[m].wanted = find_box(tracer->scene, cranny_scene_mesh(tracer->scene, m), &boxes[m]);
        if (boxes[m].wanted && !measure_density(build, m, &boxes[m]))
            atomic_store(&failed, true);
    }
    const enum cranny_status status = build_status(build, why);
    if (status == CRANNY_OK && atomic_load(&failed))
        return fail_memory(why, "acceleration structure");
    return status;
}

/* From the cube to the world: columns are half the sides, the last one the centre. */
static void world_from_unit(const struct cranny_instance *instance, const struct mesh_box *box,
                            double m[12])
{
    for (int row = 0; row < 3; row++) {
        const double *w = instance->world_from_object + 4 * row;
        m[4 * row + 3] = w[3];
        for (int k = 0; k < 3; k++) {
            m[4 * row + k] = w[k] * box->half[k];
            m[4 * row + 3] += w[k] * box->centre[k];
        }
    }
}

/* False for an instance without volume. */
static bool place_box(const struct cranny_tracer *tracer, uint32_t index,
                      const struct mesh_box *mesh_box, float factor, struct fog_box *box)
{
    double m[12], inverse[9];
    world_from_unit(cranny_scene_instance(tracer->scene, index), mesh_box, m);
    if (!transform_inverse3(m, inverse))
        return false;
    for (int row = 0; row < 3; row++) {
        double shift = 0;
        for (int k = 0; k < 3; k++) {
            box->unit_from_world[4 * row + k] = (float)inverse[3 * row + k];
            shift -= inverse[3 * row + k] * m[4 * k + 3];
        }
        box->unit_from_world[4 * row + 3] = (float)shift;
        box->weight[row] = fminf(factor * mesh_box->density * mesh_box->half[row], WEIGHT_MAX);
    }
    box->instance = index;
    return true;
}

/* The way back from a box to the world. */
struct places {
    const struct cranny_tracer *tracer;
    const struct mesh_box *mesh_boxes;
    float units[3][OVERLAP_POINTS]; /* points in the cube, evenly (R3 of Roberts 2018) */
};

static void box_to_world(const struct places *places, uint32_t box, double m[12])
{
    const struct cranny_scene *scene = places->tracer->scene;
    const struct cranny_instance *instance =
        cranny_scene_instance(scene, places->tracer->boxes[box].instance);
    world_from_unit(instance, &places->mesh_boxes[instance->mesh], m);
}

static void fog_bounds(const struct RTCBoundsFunctionArguments *args)
{
    double m[12];
    box_to_world(args->geometryUserPtr, args->primID, m);
    float *low = &args->bounds_o->lower_x, *high = &args->bounds_o->upper_x;
    for (int k = 0; k < 3; k++) {
        const double *row = m + 4 * k;
        const double half = fabs(row[0]) + fabs(row[1]) + fabs(row[2]);
        const double slack = 0x1p-20 * (half + fabs(row[3])); /* for the roundings to float */
        low[k] = (float)(row[3] - half - slack);
        high[k] = (float)(row[3] + half + slack);
    }
}

static RTCScene fog_scene(struct build *build, struct places *places, uint32_t count)
{
    RTCScene scene = rtcNewScene(build->tracer->device);
    RTCGeometry geometry = rtcNewGeometry(build->tracer->device, RTC_GEOMETRY_TYPE_USER);
    if (!scene || !geometry) {
        if (scene)
            rtcReleaseScene(scene);
        if (geometry)
            rtcReleaseGeometry(geometry);
        return NULL;
    }
    rtcSetGeometryUserPrimitiveCount(geometry, count);
    rtcSetGeometryUserData(geometry, places);
    rtcSetGeometryBoundsFunction(geometry, fog_bounds, NULL);
    rtcSetGeometryIntersectFunction(geometry, fog_intersect);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);
    rtcSetGeometryUserData(geometry, NULL); /* only bounds need the places */
    rtcReleaseGeometry(geometry);
    return scene;
}

/* Counting boxes at points of one of them. */
struct count {
    struct watch *watch;
    uint32_t calls;
    const struct fog_box *boxes;
    uint32_t self;
    bool counts;  /* else the boxes near it are listed */
    bool crowded; /* and not all found room */
    uint32_t near_count, near[NEAR_MAX];
    int point_count;
    float points[3][OVERLAP_POINTS]; /* x, y, z in the world */
    uint64_t inside;
};

static void count_box(struct count *count, uint32_t box)
{
    const float *m = count->boxes[box].unit_from_world;
    const float *x = count->points[0], *y = count->points[1], *z = count->points[2];
    int inside = 0;
    for (int i = 0; i < count->point_count; i++) { /* so written, it vectorises */
        const float a = fabsf(m[0] * x[i] + m[1] * y[i] + m[2] * z[i] + m[3]);
        const float b = fabsf(m[4] * x[i] + m[5] * y[i] + m[6] * z[i] + m[7]);
        const float c = fabsf(m[8] * x[i] + m[9] * y[i] + m[10] * z[i] + m[11]);
        inside += (a <= 1) & (b <= 1) & (c <= 1);
    }
    count->inside += (uint64_t)inside;
}

static bool near_box(struct RTCPointQueryFunctionArguments *args)
{
    struct count *count = args->userPtr;
    if (args->primID == count->self)
        return false;
    /* Crowds take a time that grows with the square of their number. */
    if (++count->calls % 4096 == 0 && !watch_goes_on(count->watch)) {
        args->query->radius = 0;
        return true;
    }
    if (count->counts)
        count_box(count, args->primID);
    else if (count->near_count < NEAR_MAX)
        count->near[count->near_count++] = args->primID;
    else
        count->crowded = true;
    return false;
}

/* Half the longest of a box's four diagonals. */
static double box_radius(const double m[12])
{
    double largest = 0;
    for (int signs = 0; signs < 4; signs++) {
        double square = 0;
        for (int row = 0; row < 3; row++) {
            const double *r = m + 4 * row;
            const double reach = r[0] + (signs & 1 ? -r[1] : r[1]) + (signs & 2 ? -r[2] : r[2]);
            square += reach * reach;
        }
        largest = fmax(largest, square);
    }
    return sqrt(largest);
}

static void count_near(RTCScene scene, const double m[12], struct count *count)
{
    struct RTCPointQuery query = {
        .x = (float)m[3], .y = (float)m[7], .z = (float)m[11], .radius = (float)box_radius(m)};
    struct RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene, &query, &context, near_box, count);
}

static void place_overlap_points(const struct places *places, const double m[12],
                                 struct count *count)
{
    for (int row = 0; row < 3; row++) {
        const float a = (float)m[4 * row], b = (float)m[4 * row + 1], c = (float)m[4 * row + 2];
        for (int i = 0; i < count->point_count; i++)
            count->points[row][i] = (float)(m[4 * row + 3] + (double)(a * places->units[0][i] +
                                                                      b * places->units[1][i] +
                                                                      c * places->units[2][i]));
    }
}

/* The mean number of boxes at a point of a box: 1 when it is alone, n when n are in one place. */
static double mean_overlap(const struct places *places, RTCScene scene, uint32_t box,
                           struct watch *watch)
{
    struct count count;
    count.watch = watch;
    count.calls = 0;
    count.boxes = places->tracer->boxes;
    count.self = box;
    count.counts = count.crowded = false;
    count.near_count = 0;
    double m[12];
    box_to_world(places, box, m);
    count_near(scene, m, &count);
    if (!count.near_count)
        return 1;
    count.inside = 0;
    count.point_count = count.crowded ? CROWDED_POINTS : OVERLAP_POINTS;
    count.counts = true;
    place_overlap_points(places, m, &count);
    for (uint32_t i = 0; i < count.near_count && !count.crowded; i++)
        count_box(&count, count.near[i]);
    if (count.crowded)
        count_near(scene, m, &count);
    return 1 + (double)count.inside / count.point_count;
}

static void thin_overlaps(struct build *build, const struct places *places, RTCScene scene,
                          uint32_t count)
{
    struct fog_box *boxes = build->tracer->boxes;
    struct watch watch;
    watch_begin(&watch, build->hooks, "bvh", count);
#pragma omp parallel for schedule(dynamic, 64) num_threads(build->threads)
    for (uint32_t i = 0; i < count; i++) {
        if (!watch_goes_on(&watch))
            continue;
        const float share = (float)(1 / mean_overlap(places, scene, i, &watch));
        watch_advance(&watch, 1);
        for (int k = 0; k < 3; k++)
            boxes[i].weight[k] *= share;
    }
    if (watch_stopped(&watch))
        atomic_store(&build->cancelled, true);
}

static enum cranny_status place_boxes(struct build *build, const struct mesh_box *mesh_boxes,
                                      struct cranny_error *why)
{
    struct cranny_tracer *tracer = build->tracer;
    const uint32_t instance_count = cranny_scene_instance_count(tracer->scene);
    uint32_t count = 0;
    for (uint32_t i = 0; i < instance_count; i++)
        count += tracer->instances[i].kind == KIND_FOG;
    tracer->boxes = alloc_aligned(count, sizeof *tracer->boxes);
    if (!tracer->boxes)
        return fail_memory(why, "acceleration structure");
    atomic_fetch_add(&tracer->bytes, (long long)(count * sizeof *tracer->boxes));
    count = 0;
    for (uint32_t i = 0; i < instance_count; i++) {
        const struct mesh_box *box = &mesh_boxes[cranny_scene_instance(tracer->scene, i)->mesh];
        if (tracer->instances[i].kind == KIND_FOG && box->wanted)
            count += place_box(tracer, i, box, build->params->fog_density, &tracer->boxes[count]);
    }
    tracer->built.fog_boxes = count;
    if (!count)
        return CRANNY_OK;
    struct places places = {.tracer = tracer, .mesh_boxes = mesh_boxes};
    static const double steps[3] = {0.8191725133961645, 0.6710436067037893, 0.5497004779019703};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < OVERLAP_POINTS; i++)
            places.units[k][i] = (float)(2 * fraction(0.5 + steps[k] * i) - 1);
    tracer->fog = fog_scene(build, &places, count);
    const enum cranny_status status = build_status(build, why);
    if (status == CRANNY_OK && !tracer->fog)
        return fail_memory(why, "acceleration structure");
    if (status != CRANNY_OK)
        return status;
    thin_overlaps(build, &places, tracer->fog, count);
    return build_status(build, why);
}

enum cranny_status build_fog(struct build *build, struct cranny_error *why)
{
    struct cranny_tracer *tracer = build->tracer;
    const uint32_t instance_count = cranny_scene_instance_count(tracer->scene);
    bool any = false;
    for (uint32_t i = 0; i < instance_count && !any; i++)
        any = tracer->instances[i].kind == KIND_FOG;
    if (!any)
        return CRANNY_OK;
    const double start = seconds_now();
    const uint64_t before = cranny_tracer_bytes(tracer);
    struct mesh_box *boxes = alloc_array(cranny_scene_mesh_count(tracer->scene), sizeof *boxes);
    if (!boxes)
        return fail_memory(why, "acceleration structure");
    enum cranny_status status = find_boxes(build, boxes, why);
    if (status == CRANNY_OK)
        status = place_boxes(build, boxes, why);
    free(boxes);
    tracer->built.fog_bytes = cranny_tracer_bytes(tracer) - before;
    tracer->built.fog_seconds = seconds_now() - start;
    return status;
}
