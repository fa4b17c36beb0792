/* Volumes against rays: the processor time after which rays have the volumes' error, over the
 * volumes' own. Rays are traced at 2, 4, 8 … a pixel, and what lies between is interpolated; sparse
 * rays take the volumes' grid, filter and refinement (cranny_volumes_reconstruct), at the price of
 * the pixels that they need. Volumes run again after each doubling, so that both see the same load.
 */
#include "volumes_versus.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { RATES = 2, SPACINGS = 4, DOUBLINGS = 9, RUNS_MAX = 32 };

static const int spacings[SPACINGS] = {1, 2, 3, 5};
static const int rates[RATES] = {0, 3}; /* of spacings, that volumes run at */

/* What rays at one spacing reach. */
struct curve {
    double rays[DOUBLINGS], ms[DOUBLINGS], error[DOUBLINGS];
    int count;
};

struct rival {
    double rays, ms;
    bool beyond; /* from the slope of the last doubling */
};

struct side {
    struct cranny_volumes_report report;
    double error, times[RUNS_MAX];
    int runs;
};

struct fight {
    const struct versus_options *o;
    const struct view *view;
    const struct view_sight *sight;
    const struct cranny_volumes *volumes;
    struct cranny_volumes_params params;
    float *picture, *traced;
    struct side sides[RATES];
    struct curve curves[SPACINGS];
};

static double processor_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(struct side *side)
{
    qsort(side->times, (size_t)side->runs, sizeof *side->times, compare_doubles);
    return side->times[side->runs / 2];
}

static double error_of(const struct fight *f, const float *picture)
{
    struct cranny_difference d;
    struct cranny_error why;
    const struct view_sight *s = f->sight;
    return cranny_difference_measure(s->width, s->height, picture, 0, s->truth, 0, &d, &why) ==
                   CRANNY_OK
               ? d.error
               : NAN;
}

static enum cranny_status run_volumes(struct fight *f, struct cranny_error *why)
{
    for (int k = 0; k < RATES; k++) {
        struct side *side = &f->sides[k];
        if (side->runs == RUNS_MAX)
            continue;
        f->params.spacing = spacings[rates[k]];
        f->params.report = &side->report;
        const double begin = processor_ms();
        const enum cranny_status status =
            cranny_volumes_render(f->volumes, &f->sight->gbuffer, &f->params, f->picture, 0, why);
        if (status != CRANNY_OK)
            return status;
        side->times[side->runs++] = processor_ms() - begin;
        side->error = error_of(f, f->picture);
    }
    return CRANNY_OK;
}

/* One doubling: a picture by `rays` a pixel, and what each spacing makes of it. */
static enum cranny_status run_rays(struct fight *f, int rays, struct cranny_error *why)
{
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    struct cranny_volumes_report report = {0};
    double all = 0, begin = processor_ms();
    params.radius_world = f->params.radius_world;
    params.rays = rays;
    params.seed = 77; /* rays that the truth has not cast */
    enum cranny_status status =
        cranny_frame_raytrace(f->sight->frame, &params, f->traced, 0, NULL, NULL, why);
    const double ms = processor_ms() - begin;
    f->params.report = &report;
    for (int k = 0; k < SPACINGS && status == CRANNY_OK; k++) {
        struct curve *c = &f->curves[k];
        memcpy(f->picture, f->traced,
               (size_t)f->sight->width * (size_t)f->sight->height * sizeof *f->picture);
        f->params.spacing = spacings[k];
        begin = processor_ms();
        status = cranny_volumes_reconstruct(&f->sight->gbuffer, &f->params, f->picture, 0, why);
        const double filter = spacings[k] > 1 ? processor_ms() - begin : 0;
        all = k ? all : (double)report.pixels;
        c->rays[c->count] = rays;
        c->ms[c->count] = ms * (double)report.pixels / fmax(all, 1) + filter;
        c->error[c->count++] = error_of(f, f->picture);
    }
    return status;
}

/* Where the curve comes down to the error; ms infinite: nowhere. */
static struct rival meet(const struct curve *c, double error)
{
    int k = 0;
    while (k < c->count && c->error[k] > error)
        k++;
    const bool beyond = k == c->count;
    if (k == 0)
        return (struct rival){c->rays[0], c->ms[0], false};
    k -= beyond;
    const double fall = log(c->error[k - 1] / c->error[k]);
    const double t = log(c->error[k - 1] / error) / fall;
    if (beyond && !(fall > 0.15 && t < 2))
        return (struct rival){INFINITY, INFINITY, true};
    return (struct rival){c->rays[k - 1] * pow(c->rays[k] / c->rays[k - 1], t),
                          c->ms[k - 1] * pow(c->ms[k] / c->ms[k - 1], t), beyond};
}

static void print_rival(const struct rival *r, double ms)
{
    if (isinf(r->ms))
        printf(" never | |");
    else
        printf(" %s%.0f | %.1f |", r->beyond ? "~" : "", r->rays, r->ms / ms);
}

static void print_side(struct fight *f, int k)
{
    struct side *side = &f->sides[k];
    const struct cranny_volumes_report *r = &side->report;
    const double ms = median(side);
    const struct rival plain = meet(&f->curves[0], side->error);
    const struct rival sparse = meet(&f->curves[SPACINGS - 1], side->error);
    int best = 0;
    for (int i = 1; i < SPACINGS; i++)
        if (meet(&f->curves[i], side->error).ms < meet(&f->curves[best], side->error).ms)
            best = i;
    const struct rival cheapest = meet(&f->curves[best], side->error);
    const int s = spacings[rates[k]];
    printf("| %s %s | %.3g | 1/%d | %.3f | %.1f |", f->view->scene, f->view->name,
           (double)f->params.radius_world, s * s, side->error, ms);
    print_rival(&plain, ms);
    print_rival(&sparse, ms);
    printf(" 1/%d |", spacings[best] * spacings[best]);
    print_rival(&cheapest, ms);
    printf(" %.2f | %.0f %% |\n", 1e6 * ms / (16 * (double)r->tested),
           100 * (double)r->pairs / (16 * (double)r->tested));
    fflush(stdout);
}

static enum cranny_status run_fight(struct fight *f, struct cranny_error *why)
{
    enum cranny_status status = CRANNY_OK;
    for (int i = 0; i < f->o->runs && status == CRANNY_OK; i++)
        status = run_volumes(f, why);
    for (int k = 0; k < DOUBLINGS && status == CRANNY_OK; k++) {
        const double reached = k ? f->curves[0].error[k - 1] : INFINITY;
        if (reached <= f->sides[0].error && reached <= f->sides[1].error)
            break;
        status = run_rays(f, 2 << k, why);
        if (status == CRANNY_OK)
            status = run_volumes(f, why);
    }
    for (int k = 0; k < RATES && status == CRANNY_OK; k++)
        print_side(f, k);
    return status;
}

static enum cranny_status run_radius(const struct versus_options *o, struct view_stage *stage,
                                     const struct view *view, struct cranny_volumes **volumes,
                                     struct cranny_error *why)
{
    struct view_sight sight;
    struct fight f = {.o = o, .view = view, .sight = &sight};
    enum cranny_status status =
        view_see(stage, view, o->width, o->height, o->rays, o->cache, &sight, why);
    if (status != CRANNY_OK)
        return status;
    const size_t size = (size_t)o->width * (size_t)o->height * sizeof *f.picture;
    f.params = cranny_volumes_params_preset(o->preset);
    f.params.radius_world = view->radius_world;
    f.picture = malloc(size);
    f.traced = malloc(size);
    status = f.picture && f.traced ? CRANNY_OK : CRANNY_MEMORY;
    if (status == CRANNY_OK && !*volumes)
        status = cranny_volumes_create(stage->scene, &f.params, volumes, why);
    f.volumes = *volumes;
    if (status == CRANNY_OK)
        status = run_fight(&f, why);
    free(f.picture);
    free(f.traced);
    view_sight_free(&sight);
    return status;
}

enum cranny_status volumes_versus(const struct versus_options *o, struct cranny_error *why)
{
    /* The dragon is a figurine of 0.2 m: its radii are a twentieth. */
    static const struct {
        const char *scene, *view;
        float scale;
    } list[] = {{"sponza", "nave", 1},
                {"dragon", "front", 0.05f},
                {"bathroom", "basin", 1},
                {"pandora", "down", 1},
                {"garden", "low", 1}};
    static const float radii[] = {0.25f, 0.5f, 1};
    enum cranny_status status = CRANNY_OK;
    printf("| view | radius, m | rate | error | ms | rays | times | rays 1/25 | times | rays' best "
           "rate | rays | times | ns a pair | of use |\n"
           "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < sizeof list / sizeof *list && status == CRANNY_OK; i++) {
        struct view_stage stage = {0};
        struct cranny_volumes *volumes = NULL;
        for (int v = 0; v < view_count; v++) {
            char *path = view_path(&views[v]);
            const bool here = path && strcmp(views[v].scene, list[i].scene) == 0 &&
                              strcmp(views[v].name, list[i].view) == 0 &&
                              (!o->scene || strcmp(o->scene, list[i].scene) == 0);
            free(path);
            for (int r = 0; r < 3 && here && status == CRANNY_OK; r++) {
                struct view view = views[v];
                view.radius_world = radii[r] * list[i].scale;
                status = run_radius(o, &stage, &view, &volumes, why);
            }
        }
        cranny_volumes_destroy(&volumes);
        view_leave(&stage);
    }
    return status;
}
