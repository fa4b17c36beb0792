/* Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.2. */
#include "bake/volume.h"

#include "bake/collect.h"
#include "base/sequence.h"

#include <cranny/runtime.h>

#define POINTS_PER_BOX 256.0
#define INDEX_MAX ((double)(1u << 30))
#define POINTS_MAX ((double)(1u << 26))

/* Points that the boxes take at a spacing, those they share counted more than once. */
static double count_points(const double (*boxes)[6], size_t box_count, double spacing)
{
    double sum = 0;
    for (size_t i = 0; i < box_count; i++) {
        double product = 1;
        for (int k = 0; k < 3; k++)
            product *= floor((boxes[i][3 + k] - boxes[i][k]) / spacing) + 2;
        sum += product;
    }
    return sum;
}

static double choose_spacing(const double (*boxes)[6], size_t box_count, double far)
{
    const double aim = fmin(POINTS_PER_BOX * (double)box_count, POINTS_MAX);
    double low = 1e-30, high = 0;
    for (size_t i = 0; i < box_count; i++)
        for (int k = 0; k < 3; k++)
            high = fmax(high, boxes[i][3 + k] - boxes[i][k]);
    if (!(high > 0))
        return 1;
    for (int i = 0; i < 100; i++) {
        const double middle = sqrt(low * high);
        if (count_points(boxes, box_count, middle) > aim)
            low = middle;
        else
            high = middle;
    }
    return fmax(high, far / INDEX_MAX);
}

static size_t brick_slot(const struct volume *volume, const int32_t at[3])
{
    const uint32_t hash =
        hash_combine(hash_combine((uint32_t)at[0], (uint32_t)at[1]), (uint32_t)at[2]);
    size_t slot = hash & (volume->slot_count - 1);
    for (; volume->slots[slot]; slot = (slot + 1) & (volume->slot_count - 1))
        if (memcmp(volume->bricks[volume->slots[slot] - 1].at, at, 3 * sizeof *at) == 0)
            break;
    return slot;
}

static bool grow_slots(struct volume *volume)
{
    const size_t count = volume->slot_count ? 2 * volume->slot_count : 1024;
    uint32_t *slots = alloc_array(count, sizeof *slots);
    if (!slots)
        return false;
    free(volume->slots);
    volume->slots = slots;
    volume->slot_count = count;
    for (size_t i = 0; i < volume->brick_count; i++)
        slots[brick_slot(volume, volume->bricks[i].at)] = (uint32_t)i + 1;
    return true;
}

static struct brick *brick_make(struct volume *volume, const int32_t at[3])
{
    if (2 * (volume->brick_count + 1) > volume->slot_count && !grow_slots(volume))
        return NULL;
    const size_t slot = brick_slot(volume, at);
    if (volume->slots[slot])
        return &volume->bricks[volume->slots[slot] - 1];
    if (!grow_array((void **)&volume->bricks, &volume->brick_capacity, volume->brick_count + 1,
                    sizeof *volume->bricks))
        return NULL;
    struct brick *brick = &volume->bricks[volume->brick_count];
    memcpy(brick->at, at, sizeof brick->at);
    for (int i = 0; i < BRICK_POINTS; i++)
        brick->points[i] = VOLUME_NONE;
    volume->slots[slot] = (uint32_t)++volume->brick_count;
    return brick;
}

/* The brick of a grid point, and its number therein. */
static int split_index(const int64_t index[3], int32_t at[3])
{
    int inside[3];
    for (int k = 0; k < 3; k++) {
        at[k] = (int32_t)(index[k] >> 2);
        inside[k] = (int)(index[k] & (BRICK_SIDE - 1));
    }
    _Static_assert(BRICK_SIDE == 4, "the shift above");
    return inside[0] + BRICK_SIDE * (inside[1] + BRICK_SIDE * inside[2]);
}

static bool add_point(struct volume *volume, const int64_t index[3])
{
    int32_t at[3];
    const int inside = split_index(index, at);
    struct brick *brick = brick_make(volume, at);
    if (!brick)
        return false;
    if (brick->points[inside] != VOLUME_NONE)
        return true;
    if (!grow_array((void **)&volume->positions, &volume->point_capacity, volume->point_count + 1,
                    sizeof *volume->positions))
        return false;
    for (int k = 0; k < 3; k++)
        volume->positions[volume->point_count][k] = (float)((double)index[k] * volume->spacing);
    brick->points[inside] = (uint32_t)volume->point_count++;
    return true;
}

static bool add_box(struct volume *volume, const double box[6])
{
    int64_t first[3], last[3], index[3];
    for (int k = 0; k < 3; k++) {
        first[k] = (int64_t)floor(box[k] / volume->spacing);
        last[k] = (int64_t)floor(box[3 + k] / volume->spacing) + 1;
    }
    for (index[2] = first[2]; index[2] <= last[2]; index[2]++)
        for (index[1] = first[1]; index[1] <= last[1]; index[1]++)
            for (index[0] = first[0]; index[0] <= last[0]; index[0]++)
                if (!add_point(volume, index))
                    return false;
    return true;
}

enum cranny_status volume_create(const double (*boxes)[6], size_t box_count, double spacing,
                                 struct volume *volume, struct cranny_error *why)
{
    double far = 0;
    for (size_t i = 0; i < box_count; i++)
        for (int k = 0; k < 6; k++)
            far = fmax(far, fabs(boxes[i][k]));
    *volume =
        (struct volume){.spacing = spacing > 0 ? spacing : choose_spacing(boxes, box_count, far)};
    if (count_points(boxes, box_count, volume->spacing) > POINTS_MAX ||
        far / volume->spacing > 2 * INDEX_MAX)
        return fail(why, CRANNY_USAGE,
                    "volume_spacing: %g m makes more than %.0f points around %zu instances; raise "
                    "it",
                    volume->spacing, POINTS_MAX, box_count);
    for (size_t i = 0; i < box_count; i++)
        if (!add_box(volume, boxes[i])) {
            volume_free(volume);
            return fail_memory(why, "volume around the instances");
        }
    return CRANNY_OK;
}

/* Gathering calls its stage "trace", as the samples' is called. */
static bool volume_progress(void *user, const char *stage, double done, double total)
{
    (void)stage;
    return hook_progress(user, "volume", done, total);
}

static void volume_log(void *user, enum cranny_log_level level, const char *text)
{
    hook_log(user, level, "%s", text);
}

enum cranny_status volume_trace(struct volume *volume, const struct cranny_tracer *tracer,
                                const struct cranny_bake_params *params, struct cranny_error *why)
{
    struct cranny_gather_params gather = bake_gather_params(params);
    gather.rays = params->volume_rays;
    const struct cranny_hooks hooks = {
        .user = (void *)(uintptr_t)params->hooks, .log = volume_log, .progress = volume_progress};
    gather.hooks = &hooks;
    float *back = alloc_array(volume->point_count, sizeof *back);
    volume->harmonics = alloc_array(volume->point_count, sizeof *volume->harmonics);
    volume->valid = alloc_array(volume->point_count, 1);
    enum cranny_status status = back && volume->harmonics && volume->valid
                                    ? CRANNY_OK
                                    : fail_memory(why, "volume around the instances");
    if (status == CRANNY_OK)
        status =
            cranny_gather_sphere(tracer, volume->point_count, (const float(*)[3])volume->positions,
                                 &gather, volume->harmonics, back, why);
    for (size_t i = 0; status == CRANNY_OK && i < volume->point_count; i++) {
        volume->valid[i] = params->back_limit >= 1 || back[i] <= params->back_limit;
        volume->buried += !volume->valid[i];
        for (int d = 0; d < 2; d++) {
            float convolved[9];
            cranny_sh_convolve(volume->harmonics[i][d], convolved);
            memcpy(volume->harmonics[i][d], convolved, sizeof convolved);
        }
    }
    free(back);
    return status;
}

static uint32_t find_point(const struct volume *volume, const int64_t index[3])
{
    int32_t at[3];
    const int inside = split_index(index, at);
    const uint32_t brick = volume->slots[brick_slot(volume, at)];
    return brick ? volume->bricks[brick - 1].points[inside] : VOLUME_NONE;
}

bool volume_sample(const struct volume *volume, const double position[3], const double normal[3],
                   float visibility[2])
{
    int64_t cell[3];
    double part[3];
    float sum[2][9] = {{0}}, total = 0;
    for (int k = 0; k < 3; k++) {
        const double at = position[k] / volume->spacing;
        cell[k] = (int64_t)floor(at);
        part[k] = at - floor(at);
    }
    for (int c = 0; c < 8 && volume->slot_count; c++) {
        const int64_t index[3] = {cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)};
        const uint32_t point = find_point(volume, index);
        if (point == VOLUME_NONE || !volume->valid[point])
            continue;
        float weight = 1;
        for (int k = 0; k < 3; k++)
            weight *= (float)(c >> k & 1 ? part[k] : 1 - part[k]);
        for (int d = 0; d < 2; d++)
            for (int h = 0; h < 9; h++)
                sum[d][h] += weight * volume->harmonics[point][d][h];
        total += weight;
    }
    const float n[3] = {(float)normal[0], (float)normal[1], (float)normal[2]};
    for (int d = 0; d < 2; d++) {
        for (int h = 0; h < 9; h++)
            sum[d][h] /= total > 0 ? total : 1;
        visibility[d] = cranny_sh9_visibility(sum[d], n);
    }
    return total > 1e-3f;
}

uint64_t volume_bytes(const struct volume *volume)
{
    return (uint64_t)volume->brick_count * sizeof(struct brick) +
           (uint64_t)volume->slot_count * sizeof *volume->slots +
           (uint64_t)volume->point_count *
               (sizeof *volume->positions + sizeof *volume->harmonics + 1);
}

void volume_free(struct volume *volume)
{
    free(volume->bricks);
    free(volume->slots);
    free(volume->positions);
    free(volume->harmonics);
    free(volume->valid);
    *volume = (struct volume){0};
}
