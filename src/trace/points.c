/* cranny_gather and cranny_gather_sphere: many points over all threads. */
#include "trace/gather.h"
#include "trace/tracer.h"

#include <omp.h>

/* Points are handed out in chunks of about this many rays: some milliseconds of work. */
#define CHUNK_RAYS 8192
#define CHUNK_POINTS_MAX 64
#define HOOK_PERIOD_SECONDS 0.05

struct cranny_gather_params cranny_gather_params_default(void)
{
    return (struct cranny_gather_params){.rays = 64,
                                         .distances = {300, 2},
                                         .kernel = CRANNY_KERNEL_EXPONENTIAL,
                                         .sampler = CRANNY_SAMPLER_SPIRAL,
                                         .packet = CRANNY_PACKET_8};
}

struct job {
    const struct cranny_tracer *tracer;
    const struct gather_plan *plan;
    const struct cranny_hooks *hooks;
    size_t point_count, chunk;
    const float (*positions)[3], (*normals)[3], (*face_normals)[3];
    float (*visibility)[2];
    float (*harmonics)[2][9]; /* in the open: instead of normals and visibility */
    float *back_fraction;
    atomic_size_t next;
    atomic_bool cancelled;
};

static bool all_finite(const float (*vectors)[3], size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(vectors[i][k]))
                return false;
    return true;
}

static enum cranny_status validate(const struct job *job, const struct cranny_gather_params *p,
                                   struct cranny_error *why)
{
    if (!job->tracer ||
        (job->point_count &&
         (!job->positions || !(job->harmonics || (job->normals && job->visibility)))))
        return fail(why, CRANNY_USAGE,
                    "gather: a tracer, positions, normals and an output are needed");
    if (p->rays < 1 || p->rays > 65536)
        return fail(why, CRANNY_USAGE, "gather: rays is %d; 1 to 65536 are possible", p->rays);
    for (int k = 0; k < 2; k++)
        if (!(p->distances[k] >= 1e-30f && p->distances[k] <= 1e30f))
            return fail(why, CRANNY_USAGE,
                        "gather: distances[%d] is %g; 1e-30 to 1e30 m are possible", k,
                        (double)p->distances[k]);
    if ((unsigned)p->kernel > CRANNY_KERNEL_HARD || (unsigned)p->sampler > CRANNY_SAMPLER_RANDOM ||
        (unsigned)p->packet > CRANNY_PACKET_16 || p->threads < 0)
        return fail(why, CRANNY_USAGE,
                    "gather: kernel, sampler, packet or threads is out of range");
    if (job->point_count > UINT32_MAX)
        return fail(why, CRANNY_USAGE, "gather: %zu points; split them into calls of at most %u",
                    job->point_count, UINT32_MAX);
    if (!all_finite(job->positions, job->point_count) ||
        (job->normals && !all_finite(job->normals, job->point_count)) ||
        (job->face_normals && !all_finite(job->face_normals, job->point_count)))
        return fail(why, CRANNY_USAGE, "gather: a position or normal holds a NaN or an infinity");
    return CRANNY_OK;
}

static void sphere_chunk(const struct job *job, size_t first, size_t count)
{
    struct gather_sphere results[CHUNK_POINTS_MAX];
    gather_spheres(job->tracer, job->plan, job->positions + first, count, (uint32_t)first, results);
    for (size_t i = 0; i < count; i++) {
        memcpy(job->harmonics[first + i], results[i].harmonics, sizeof results[i].harmonics);
        if (job->back_fraction)
            job->back_fraction[first + i] = (float)results[i].back_faces / (float)results[i].rays;
    }
}

static void gather_chunk(const struct job *job, size_t first, size_t count)
{
    struct gather_point points[CHUNK_POINTS_MAX] = {0};
    struct gather_result results[CHUNK_POINTS_MAX];
    for (size_t i = 0; i < count; i++) {
        const size_t p = first + i;
        points[i] = (struct gather_point){.id = (uint32_t)p};
        memcpy(points[i].position, job->positions[p], sizeof points[i].position);
        memcpy(points[i].normal, job->normals[p], sizeof points[i].normal);
        memcpy(points[i].face_normal, job->face_normals ? job->face_normals[p] : job->normals[p],
               sizeof points[i].face_normal);
    }
    gather_points(job->tracer, job->plan, points, count, results);
    for (size_t i = 0; i < count; i++) {
        memcpy(job->visibility[first + i], results[i].visibility, sizeof results[i].visibility);
        if (job->back_fraction)
            job->back_fraction[first + i] = (float)results[i].back_faces / (float)results[i].rays;
    }
}

/* One thread's share; the caller's thread, number 0, also reports. */
static void gather_thread(struct job *job)
{
    const bool reports = omp_get_thread_num() == 0;
    const unsigned saved = gather_thread_begin();
    double reported = seconds_now();
    for (;;) {
        const size_t first = atomic_fetch_add(&job->next, job->chunk);
        if (first >= job->point_count || atomic_load(&job->cancelled))
            break;
        const size_t left = job->point_count - first;
        (job->harmonics ? sphere_chunk : gather_chunk)(job, first,
                                                       left < job->chunk ? left : job->chunk);
        if (!reports || seconds_now() - reported < HOOK_PERIOD_SECONDS)
            continue;
        reported = seconds_now();
        if (!hook_progress(job->hooks, "trace", (double)first, (double)job->point_count))
            atomic_store(&job->cancelled, true);
    }
    gather_thread_end(saved);
}

static enum cranny_status run_job(struct job *job, const struct cranny_gather_params *params,
                                  struct cranny_error *why)
{
    enum cranny_status status = validate(job, params, why);
    if (status != CRANNY_OK)
        return status;
    struct gather_plan *plan;
    status = job->harmonics ? gather_plan_create_sphere(params, &plan, why)
                            : gather_plan_create(params, false, &plan, why);
    if (status != CRANNY_OK)
        return status;
    if (!job->back_fraction)
        gather_plan_shorten(plan);
    job->plan = plan;
    job->hooks = params->hooks;
    job->chunk = (size_t)max_int(1, min_int(CHUNK_POINTS_MAX, CHUNK_RAYS / params->rays));
    if (!hook_progress(job->hooks, "trace", 0, (double)job->point_count))
        atomic_store(&job->cancelled, true);
#pragma omp parallel num_threads(thread_count(params->threads))
    gather_thread(job);
    gather_plan_destroy(&plan);
    if (!atomic_load(&job->cancelled) &&
        !hook_progress(job->hooks, "trace", (double)job->point_count, (double)job->point_count))
        atomic_store(&job->cancelled, true);
    if (atomic_load(&job->cancelled))
        return fail(why, CRANNY_CANCELLED, "gather: cancelled");
    return CRANNY_OK;
}

enum cranny_status cranny_gather(const struct cranny_tracer *tracer, size_t point_count,
                                 const float (*positions)[3], const float (*normals)[3],
                                 const float (*face_normals)[3],
                                 const struct cranny_gather_params *params, float (*visibility)[2],
                                 float *back_fraction, struct cranny_error *why)
{
    const struct cranny_gather_params defaults = cranny_gather_params_default();
    struct job job = {.tracer = tracer,
                      .point_count = point_count,
                      .positions = positions,
                      .normals = normals,
                      .face_normals = face_normals,
                      .visibility = visibility,
                      .back_fraction = back_fraction};
    return run_job(&job, params ? params : &defaults, why);
}

enum cranny_status cranny_gather_sphere(const struct cranny_tracer *tracer, size_t point_count,
                                        const float (*positions)[3],
                                        const struct cranny_gather_params *params,
                                        float (*harmonics)[2][9], float *back_fraction,
                                        struct cranny_error *why)
{
    const struct cranny_gather_params defaults = cranny_gather_params_default();
    if (point_count && !harmonics)
        return fail(why, CRANNY_USAGE, "gather: no place for the harmonics");
    float none[1][2][9]; /* of no points: tells the job what is wanted */
    struct job job = {.tracer = tracer,
                      .point_count = point_count,
                      .positions = positions,
                      .harmonics = harmonics ? harmonics : none,
                      .back_fraction = back_fraction};
    return run_job(&job, params ? params : &defaults, why);
}
