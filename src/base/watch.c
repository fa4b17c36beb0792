#include "base/watch.h"

void watch_begin(struct watch *watch, const struct cranny_hooks *hooks, const char *stage,
                 size_t total)
{
    watch->hooks = hooks;
    watch->stage = stage;
    watch->total = (double)total;
    watch->caller = pthread_self();
    watch->next = 0;
    atomic_init(&watch->done, 0);
    atomic_init(&watch->stopped, false);
}

bool watch_goes_on(struct watch *watch)
{
    if (!watch)
        return true;
    if (pthread_equal(pthread_self(), watch->caller)) {
        const double now = seconds_now();
        if (now >= watch->next) {
            watch->next = now + 0.1;
            if (!hook_progress(watch->hooks, watch->stage, (double)atomic_load(&watch->done),
                               watch->total))
                atomic_store(&watch->stopped, true);
        }
    }
    return !atomic_load(&watch->stopped);
}

void watch_advance(struct watch *watch, size_t units)
{
    atomic_fetch_add(&watch->done, units);
}

bool watch_stopped(const struct watch *watch)
{
    return atomic_load(&watch->stopped);
}
