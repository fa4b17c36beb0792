/* From Embree's hits back to the scene, and cranny_trace. */
#include "trace/gather.h"
#include "trace/pack.h"

struct tracer_place tracer_place(const struct cranny_tracer *tracer, uint32_t geometry,
                                 uint32_t top, uint32_t primitive)
{
    struct tracer_place place = {.instance = hit_instance(geometry, top)};
    place.mesh = cranny_scene_instance(tracer->scene, place.instance)->mesh;
    const uint32_t *triangles = tracer->meshes[place.mesh].triangles[geometry & 1];
    place.triangle = triangles ? triangles[primitive] : primitive;
    return place;
}

bool tracer_back_face(const struct cranny_tracer *tracer, uint32_t top, const float normal[3],
                      const float direction[3])
{
    const float *d = direction;
    float local[3] = {d[0], d[1], d[2]};
    if (top != RTC_INVALID_GEOMETRY_ID) {
        const float *m = tracer->instances[top >> 1].object_from_world;
        for (int i = 0; i < 3; i++)
            local[i] = m[3 * i] * d[0] + m[3 * i + 1] * d[1] + m[3 * i + 2] * d[2];
    }
    return local[0] * normal[0] + local[1] * normal[1] + local[2] * normal[2] > 0;
}

bool tracer_double_sided(const struct cranny_tracer *tracer, uint32_t geometry, uint32_t top,
                         uint32_t primitive)
{
    const uint32_t instance = hit_instance(geometry, top);
    const uint32_t mesh = cranny_scene_instance(tracer->scene, instance)->mesh;
    if (tracer->meshes[mesh].sides != SIDES_MIXED)
        return tracer->meshes[mesh].sides == SIDES_DOUBLE;
    const struct tracer_place place = tracer_place(tracer, geometry, top, primitive);
    const uint32_t material =
        cranny_scene_mesh(tracer->scene, mesh)->triangle_materials[place.triangle];
    return cranny_scene_material(tracer->scene, material)->double_sided;
}

static struct cranny_hit describe(const struct cranny_tracer *tracer, const struct RTCRayHit *r)
{
    const uint32_t top = r->hit.instID[0];
    const struct tracer_place place = tracer_place(tracer, r->hit.geomID, top, r->hit.primID);
    const bool turned = tracer->instances[place.instance].mirrored;
    const float normal[3] = {r->hit.Ng_x, r->hit.Ng_y, r->hit.Ng_z};
    const float direction[3] = {r->ray.dir_x, r->ray.dir_y, r->ray.dir_z};
    return (struct cranny_hit){.instance = place.instance,
                               .triangle = place.triangle,
                               .u = turned ? r->hit.v : r->hit.u,
                               .v = turned ? r->hit.u : r->hit.v,
                               .back_face = tracer_back_face(tracer, top, normal, direction)};
}

void trace_ray(const struct cranny_tracer *tracer, const float origin[3], const float direction[3],
               float reach, uint32_t id, float *distance, struct cranny_hit *hit)
{
    struct RTCRayHit r = pack_ray(origin, direction, reach, id);
    embree_closest1(tracer->world, &r);
    const float ground = ground_distance(tracer, origin[1], direction[1]);
    const bool surface = r.hit.geomID != RTC_INVALID_GEOMETRY_ID && !(ground < r.ray.tfar);
    *distance = surface ? r.ray.tfar : ground < reach ? ground : INFINITY;
    if (hit)
        *hit = surface ? describe(tracer, &r)
                       : (struct cranny_hit){.instance = UINT32_MAX, .triangle = UINT32_MAX};
}

enum cranny_status cranny_trace(const struct cranny_tracer *tracer, size_t ray_count,
                                const float (*origins)[3], const float (*directions)[3],
                                float *distances, struct cranny_hit *hits, int threads,
                                struct cranny_error *why)
{
    if (!tracer || threads < 0 || (ray_count && (!origins || !directions || !distances)))
        return fail(why, CRANNY_USAGE,
                    "trace: a tracer, rays, distances and threads of 0 or more are needed");
#pragma omp parallel num_threads(thread_count(threads))
    {
        const unsigned saved = gather_thread_begin();
#pragma omp for schedule(dynamic, 1024)
        for (size_t i = 0; i < ray_count; i++)
            trace_ray(tracer, origins[i], directions[i], INFINITY, (uint32_t)i, &distances[i],
                      hits ? &hits[i] : NULL);
        gather_thread_end(saved);
    }
    return CRANNY_OK;
}
