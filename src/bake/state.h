/* The file that a bake leaves for the next one: blobs, found by kind and key. */
#ifndef BAKE_STATE_H
#define BAKE_STATE_H

#include "base/base.h"

/* What a record holds. A number, once given, keeps its meaning; STATE_FORMAT grows otherwise. */
enum state_kind {
    STATE_SCENE = 1,     /* struct scene_state, key 0 */
    STATE_INSTANCES = 2, /* struct occluder [], key 0 */
    STATE_SAMPLES = 3,   /* struct kept [], of a target */
    STATE_PICKS = 4,     /* struct pick [], of a target that several instances share */
    STATE_VALUES = 5,    /* struct fit_report and float[2] a vertex, of a target */
    STATE_PROBES = 6,    /* struct kept [], of an instance */
    STATE_SOURCES = 7,   /* struct source [], of a lower level of detail (levels.c) */
};
#define STATE_FORMAT 1u

struct state_record {
    uint64_t key;
    uint32_t kind, unused;
    uint64_t offset, size; /* bytes, from the start of the file; offsets are multiples of 8 */
};

/* A file as it was read; zeroed: there is none. */
struct state {
    uint8_t *bytes;
    size_t size;
    struct state_record *records; /* by kind and key */
    size_t count;
};

enum state_found { STATE_MISSING, STATE_DAMAGED, STATE_READ };

/* Read it. `key`: of what the whole file is for. More than `limit` bytes are not read. What is
 * damaged or of another program is warned of, once, and not read. CRANNY_MEMORY only. */
enum cranny_status state_read(const char *path, uint64_t key, uint64_t limit,
                              const struct cranny_hooks *hooks, struct state *state,
                              enum state_found *found, struct cranny_error *why);
void state_free(struct state *state);

/* A record's bytes, 8-byte aligned; NULL when there is none. */
const void *state_find(const struct state *state, enum state_kind kind, uint64_t key, size_t *size);

/* What is to be written: pointers to bytes that stay until then. */
struct state_list {
    struct state_record *records;
    const void **data;
    size_t count, record_capacity, data_capacity;
};

/* False: out of memory. Of several with one kind and key, one is found. */
bool state_add(struct state_list *list, enum state_kind kind, uint64_t key, const void *data,
               size_t size);

/* Write the list; the file appears whole or not at all. */
enum cranny_status state_write(const char *path, uint64_t key, struct state_list *list,
                               uint64_t *size, struct cranny_error *why);
void state_list_free(struct state_list *list);

#endif
