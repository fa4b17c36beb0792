#include "bake/fill.h"

enum state { UNSEEN, QUEUED, DONE };

struct filler {
    const struct surface *surface;
    uint8_t *state;
    uint32_t *queue;
    size_t queued;
    double (*x)[2];
};

/* Calls for each neighbour of `unknown` (several times for inner edges). */
typedef void visit_fn(struct filler *filler, uint32_t neighbour, void *user);

static void visit(struct filler *filler, uint32_t unknown, visit_fn *call, void *user)
{
    const struct surface *surface = filler->surface;
    for (uint32_t i = surface->incident_start[unknown]; i < surface->incident_start[unknown + 1];
         i++) {
        const uint32_t t = surface->incident[i] / 3, c = surface->incident[i] % 3;
        call(filler, surface->triangles[t][(c + 1) % 3], user);
        call(filler, surface->triangles[t][(c + 2) % 3], user);
    }
}

static void enqueue(struct filler *filler, uint32_t unknown, void *user)
{
    (void)user;
    if (filler->state[unknown] != UNSEEN)
        return;
    filler->state[unknown] = QUEUED;
    filler->queue[filler->queued++] = unknown;
}

struct mean {
    double sum[2];
    uint32_t count;
};

static void add_to_mean(struct filler *filler, uint32_t unknown, void *user)
{
    struct mean *mean = user;
    if (filler->state[unknown] != DONE)
        return;
    mean->sum[0] += filler->x[unknown][0];
    mean->sum[1] += filler->x[unknown][1];
    mean->count++;
}

static void fill_ring(struct filler *filler, size_t first, size_t end)
{
    for (size_t i = first; i < end; i++) {
        const uint32_t unknown = filler->queue[i];
        struct mean mean = {{0, 0}, 0};
        visit(filler, unknown, add_to_mean, &mean);
        for (int s = 0; s < 2; s++)
            filler->x[unknown][s] = mean.sum[s] / mean.count;
    }
    for (size_t i = first; i < end; i++)
        filler->state[filler->queue[i]] = DONE;
    for (size_t i = first; i < end; i++)
        visit(filler, filler->queue[i], enqueue, NULL);
}

static bool touches_known(struct filler *filler, uint32_t unknown)
{
    struct mean mean = {{0, 0}, 0};
    visit(filler, unknown, add_to_mean, &mean);
    return mean.count > 0;
}

static void spread(struct filler *filler)
{
    for (uint32_t u = 0; u < filler->surface->unknown_count; u++)
        if (filler->state[u] == UNSEEN && touches_known(filler, u))
            enqueue(filler, u, NULL);
    for (size_t first = 0; first < filler->queued;) {
        const size_t end = filler->queued;
        fill_ring(filler, first, end);
        first = end;
    }
}

/* Pieces where nothing is known keep what they hold; returns how many there are. */
static uint64_t count_lost(struct filler *filler)
{
    uint64_t pieces = 0;
    size_t first = filler->queued;
    for (uint32_t u = 0; u < filler->surface->unknown_count; u++) {
        if (filler->state[u] != UNSEEN)
            continue;
        pieces++;
        for (enqueue(filler, u, NULL); first < filler->queued; first++)
            visit(filler, filler->queue[first], enqueue, NULL);
    }
    return pieces;
}

enum cranny_status fill_unknowns(const struct surface *surface, const uint8_t *known,
                                 double (*x)[2], uint64_t *lost, struct cranny_error *why)
{
    const uint32_t count = surface->unknown_count;
    size_t missing = 0;
    *lost = 0;
    for (uint32_t u = 0; u < count; u++)
        missing += !known[u];
    if (!missing)
        return CRANNY_OK;
    struct filler filler = {.surface = surface, .x = x};
    filler.state = alloc_array(count, 1);
    filler.queue = alloc_array(missing, sizeof *filler.queue);
    const bool complete = filler.state && filler.queue;
    if (complete) {
        for (uint32_t u = 0; u < count; u++)
            filler.state[u] = known[u] ? DONE : UNSEEN;
        spread(&filler);
        *lost = count_lost(&filler);
    }
    free(filler.state);
    free(filler.queue);
    return complete ? CRANNY_OK : fail_memory(why, "fit");
}
