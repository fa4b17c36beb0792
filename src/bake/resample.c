/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2.1. */
#include "bake/resample.h"

#include "base/sequence.h"
#include "base/vector.h"
#include "trace/tracer.h"

/* Lowest cosine to `facing` of where the rays come from. */
#define COSINE_MIN 0.35

/* Direction `index` of `count` from the centre outwards: a spiral on the sphere about +Z, or on its
 * cap about `facing`. */
static void outward(const double *facing, uint32_t id, int index, int count, double out[3])
{
    const double low = facing ? COSINE_MIN : -1;
    const double cosine = 1 - (1 - low) * (index + 0.5) / count;
    const double sine = sqrt(fmax(1 - cosine * cosine, 0));
    const double angle =
        6.283185307179586 * (fraction(index * GOLDEN_RATIO_FRACTION) + unit_from_u32(hash_u32(id)));
    const double local[3] = {sine * cos(angle), sine * sin(angle), cosine};
    if (!facing) {
        memcpy(out, local, sizeof local);
        return;
    }
    const double helper[3] = {fabs(facing[0]) < 0.6, fabs(facing[0]) >= 0.6, 0};
    double tangent[3], bitangent[3];
    cross3(helper, facing, tangent);
    normalise3(tangent);
    cross3(facing, tangent, bitangent);
    for (int k = 0; k < 3; k++)
        out[k] = local[0] * tangent[k] + local[1] * bitangent[k] + local[2] * facing[k];
}

/* Unit face normal of a triangle in the world, toward the side of its front. */
static bool face_normal(const struct cranny_scene *scene, const struct cranny_hit *hit,
                        double normal[3])
{
    const struct cranny_instance *instance = &scene->instances[hit->instance].view;
    const struct cranny_mesh *mesh = &scene->meshes[instance->mesh].view;
    const uint32_t *corner = mesh->triangles[hit->triangle];
    double p[3][3], a[3], b[3];
    for (int c = 0; c < 3; c++)
        transform_point(instance->world_from_object, mesh->positions[corner[c]], p[c]);
    for (int k = 0; k < 3; k++) {
        a[k] = p[1][k] - p[0][k];
        b[k] = p[2][k] - p[0][k];
    }
    cross3(a, b, normal);
    if (transform_determinant(instance->world_from_object) < 0)
        for (int k = 0; k < 3; k++)
            normal[k] = -normal[k];
    return normalise3(normal);
}

static bool counts(const struct resampler *resampler, const struct cranny_hit *hit)
{
    if (hit->instance == UINT32_MAX || resampler->bake->set_of[hit->instance] == SET_NONE)
        return false;
    const struct cranny_scene *scene = resampler->scene;
    const struct cranny_instance *instance = &scene->instances[hit->instance].view;
    if (resampler->lod_group && instance->lod_group != resampler->lod_group)
        return false;
    const struct cranny_mesh *mesh = &scene->meshes[instance->mesh].view;
    return !hit->back_face ||
           scene->materials[mesh->triangle_materials[hit->triangle]].double_sided;
}

/* How much a hit weighs: its depth in the sphere, times how far it faces with `facing`. */
static double weigh(const struct resampler *resampler, const struct cranny_hit *hit,
                    const double *facing, double depth)
{
    double normal[3];
    if (!(depth > 0) || !counts(resampler, hit))
        return 0;
    if (!facing)
        return depth;
    if (!face_normal(resampler->scene, hit, normal))
        return 0;
    const double cosine = dot3(normal, facing);
    return depth * fmax(hit->back_face ? -cosine : cosine, 0);
}

bool resample_sphere(const struct resampler *resampler, const double center[3],
                     const double *facing, double radius, uint32_t id, int rays,
                     double values[CHANNELS])
{
    double sum[CHANNELS] = {0}, total = 0;
    for (int i = 0; i < rays; i++) {
        double out[3];
        float origin[3], direction[3], distance;
        struct cranny_hit hit;
        outward(facing, id, i, rays, out);
        for (int k = 0; k < 3; k++) {
            origin[k] = (float)(center[k] + radius * out[k]);
            direction[k] = (float)-out[k];
        }
        trace_ray(resampler->tracer, origin, direction, (float)(2 * radius), id, &distance, &hit);
        const double weight =
            weigh(resampler, &hit, facing, radius - fabs(radius - (double)distance));
        for (int c = 0; weight > 0 && c < CHANNELS; c++)
            sum[c] += weight * bake_value_at(resampler->bake, hit.instance, hit.triangle,
                                             (double)hit.u, (double)hit.v, (enum cranny_channel)c);
        total += weight;
    }
    for (int c = 0; c < CHANNELS; c++)
        values[c] = total > 0 ? sum[c] / total : 1;
    return total > 0;
}

int resample_widening(const struct resampler *resampler, const double center[3],
                      const double *facing, double radius, int doublings, uint32_t id, int rays,
                      double values[CHANNELS])
{
    for (int i = 0; i <= doublings; i++, radius *= 2)
        if (resample_sphere(resampler, center, facing, radius, id, rays, values))
            return i;
    return -1;
}
