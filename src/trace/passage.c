/* Shares of a ray, taken one after another.
 *
 * Based on: Sloan, Tranchida, Chen, Kavan, Ambient Obscurance Baking on the GPU, 2013, §2.1, which
 * multiplies (CRANNY_DIMMING_PLAIN); that a share counts at its own distance is ours. */
#include "trace/passage.h"

#include "trace/kernel.h"

void passage_cross(struct passage *passage, float distance, uint32_t instance, float apart)
{
    struct passage_crossing *list = passage->crossings;
    for (int i = 0; i < passage->crossing_count; i++)
        if (list[i].instance == instance && fabsf(list[i].distance - distance) <= apart)
            return;
    struct passage_crossing dropped = {distance, instance};
    if (passage->crossing_count == PASSAGE_MAX) {
        passage->further_crossings++;
        if (list[PASSAGE_MAX - 1].distance > distance)
            dropped = list[--passage->crossing_count];
        passage->further_crossing = fminf(passage->further_crossing, dropped.distance);
        if (passage->crossing_count == PASSAGE_MAX)
            return;
    }
    int i = passage->crossing_count++;
    for (; i > 0 && list[i - 1].distance > distance; i--)
        list[i] = list[i - 1];
    list[i] = (struct passage_crossing){distance, instance};
}

void passage_enter(struct passage *passage, float enter, float leave, float rate)
{
    struct passage_fog *list = passage->fog;
    if (passage->fog_count == PASSAGE_MAX) {
        struct passage_fog dropped = {enter, leave, rate};
        if (list[PASSAGE_MAX - 1].enter > enter)
            dropped = list[--passage->fog_count];
        passage->further_depth += (dropped.leave - dropped.enter) * dropped.rate;
        passage->further_fog = fminf(passage->further_fog, dropped.enter);
        if (passage->fog_count == PASSAGE_MAX)
            return;
    }
    int i = passage->fog_count++;
    for (; i > 0 && list[i - 1].enter > enter; i--)
        list[i] = list[i - 1];
    list[i] = (struct passage_fog){enter, leave, rate};
}

/* Where fog's rate changes, or (change 0) where a share is taken at once. */
struct event {
    float distance, change, share;
};

enum { EVENTS_MAX = 3 * PASSAGE_MAX + 2 };

static int put_event(struct event *events, int count, struct event event)
{
    int i = count;
    for (; i > 0 && events[i - 1].distance > event.distance; i--)
        events[i] = events[i - 1];
    events[i] = event;
    return count + 1;
}

static int list_events(const struct passage *passage, float opacity, struct event *events)
{
    int count = 0;
    for (int i = 0; i < passage->crossing_count; i++)
        events[count++] =
            (struct event){.distance = passage->crossings[i].distance, .share = opacity};
    for (int i = 0; i < passage->fog_count; i++) {
        const struct passage_fog *f = &passage->fog[i];
        count = put_event(events, count, (struct event){.distance = f->enter, .change = f->rate});
        count = put_event(events, count, (struct event){.distance = f->leave, .change = -f->rate});
    }
    if (passage->further_crossings) {
        float rest = 1;
        for (int i = 0; i < passage->further_crossings && rest > 0; i++)
            rest *= 1 - opacity;
        count = put_event(events, count,
                          (struct event){.distance = passage->further_crossing, .share = 1 - rest});
    }
    if (passage->further_depth > 0)
        count = put_event(events, count,
                          (struct event){.distance = passage->further_fog,
                                         .share = 1 - fog_rest(passage->further_depth, 1)});
    return count;
}

static float plain_rest(const struct passage *passage, float opacity)
{
    float depth = passage->further_depth, rest = 1;
    for (int i = 0; i < passage->fog_count; i++)
        depth += (passage->fog[i].leave - passage->fog[i].enter) * passage->fog[i].rate;
    const int crossings = passage->crossing_count + passage->further_crossings;
    for (int i = 0; i < crossings && rest > 0; i++)
        rest *= 1 - opacity;
    return rest * fog_rest(depth, 1);
}

void passage_apply(const struct passage *passage, const struct passage_rules *rules,
                   float values[2])
{
    if (rules->dimming == CRANNY_DIMMING_PLAIN) {
        const float rest = plain_rest(passage, rules->opacity);
        values[0] *= rest;
        values[1] *= rest;
        return;
    }
    struct event events[EVENTS_MAX];
    const int count = list_events(passage, rules->opacity, events);
    float seen[2] = {0, 0}, left = 1, rate = 0, at = 0;
    int boxes = 0;
    for (int i = 0; i < count; i++) {
        const struct event *e = &events[i];
        for (int k = 0; k < 2 && boxes; k++)
            seen[k] +=
                left * kernel_over_fog(rules->kernel, rules->distances[k], at, e->distance, rate);
        left *= boxes ? fog_rest(rate, e->distance - at) : 1;
        for (int k = 0; k < 2 && e->share > 0; k++)
            seen[k] +=
                left * e->share * kernel_value(rules->kernel, rules->distances[k], e->distance);
        left *= 1 - e->share;
        boxes += e->change > 0 ? 1 : e->change < 0 ? -1 : 0;
        rate = boxes ? rate + e->change : 0; /* no rounding is left over outside */
        at = e->distance;
    }
    for (int k = 0; k < 2; k++)
        values[k] = seen[k] + left * values[k];
}
