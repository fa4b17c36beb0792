/* How a long stage tells how far it is, and hears that it should stop. */
#ifndef BASE_WATCH_H
#define BASE_WATCH_H

#include "base/base.h"

#include <pthread.h>
#include <stdatomic.h>

/* Shared by all threads of a stage; only the caller's thread talks to its hook. */
struct watch {
    const struct cranny_hooks *hooks;
    const char *stage;
    double total;
    pthread_t caller;
    double next; /* of the caller's thread: when to ask again */
    atomic_size_t done;
    atomic_bool stopped;
};

void watch_begin(struct watch *watch, const struct cranny_hooks *hooks, const char *stage,
                 size_t total);

/* Whether to go on; asks the hook ten times a second. Accepts NULL. */
bool watch_goes_on(struct watch *watch);

/* Count `units` done. */
void watch_advance(struct watch *watch, size_t units);

/* Whether it was stopped, without asking. */
bool watch_stopped(const struct watch *watch);

#endif
