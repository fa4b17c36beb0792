#include "bake/state.h"

#include "base/hash.h"

#include <errno.h>
#include <sys/stat.h>

/* In the order of the machine that wrote it; `order` tells. */
struct state_header {
    char magic[8];
    uint32_t format, order;
    uint64_t key, count, size;
    uint64_t body;  /* hash of all that follows */
    uint64_t check; /* hash of the header up to here */
};

static const char magic[8] = "CrannyB";
#define STATE_ORDER 0x01020304u

static uint64_t header_check(const struct state_header *header)
{
    return hash_bytes(HASH_BEGIN, header, offsetof(struct state_header, check));
}

static uint64_t padded(uint64_t size)
{
    return (size + 7) & ~(uint64_t)7;
}

static int compare_records(const void *a, const void *b)
{
    const struct state_record *x = a, *y = b;
    if (x->kind != y->kind)
        return x->kind < y->kind ? -1 : 1;
    return (x->key > y->key) - (x->key < y->key);
}

/* What is wrong with the bytes; NULL: nothing. */
static const char *judge(const uint8_t *bytes, size_t size, uint64_t key)
{
    struct state_header header;
    if (size < sizeof header)
        return "it is too short";
    memcpy(&header, bytes, sizeof header);
    if (memcmp(header.magic, magic, sizeof magic) != 0)
        return "it is no such file";
    if (header.format != STATE_FORMAT || header.order != STATE_ORDER)
        return "another version of Cranny wrote it";
    if (header.check != header_check(&header) || header.size != size)
        return "it is damaged";
    if (header.key != key)
        return "it belongs to other parameters";
    if (header.count > (size - sizeof header) / sizeof(struct state_record) ||
        header.body != hash_bytes(HASH_BEGIN, bytes + sizeof header, size - sizeof header))
        return "it is damaged";
    return NULL;
}

static bool records_fit(const struct state *state)
{
    for (size_t i = 0; i < state->count; i++) {
        const struct state_record *record = &state->records[i];
        if (record->offset % 8 || record->offset > state->size ||
            record->size > state->size - record->offset)
            return false;
        if (i > 0 && compare_records(record - 1, record) > 0)
            return false;
    }
    return true;
}

static const char *open_state(struct state *state, uint64_t key)
{
    const char *problem = judge(state->bytes, state->size, key);
    if (problem)
        return problem;
    struct state_header header;
    memcpy(&header, state->bytes, sizeof header);
    state->count = (size_t)header.count;
    state->records = (struct state_record *)(void *)(state->bytes + sizeof header);
    return records_fit(state) ? NULL : "it is damaged";
}

enum cranny_status state_read(const char *path, uint64_t key, uint64_t limit,
                              const struct cranny_hooks *hooks, struct state *state,
                              enum state_found *found, struct cranny_error *why)
{
    struct cranny_error inner;
    struct stat info;
    *state = (struct state){0};
    *found = STATE_MISSING;
    if (stat(path, &info) != 0 && errno == ENOENT)
        return CRANNY_OK;
    const char *problem = !S_ISREG(info.st_mode)           ? "it is no file"
                          : (uint64_t)info.st_size > limit ? "it is too large for this scene"
                                                           : NULL;
    if (!problem) {
        const enum cranny_status status =
            file_read(path, limit, &state->bytes, &state->size, &inner);
        if (status == CRANNY_MEMORY)
            return fail(why, status, "%s", inner.message);
        problem = status == CRANNY_OK ? open_state(state, key) : "it cannot be read";
    }
    *found = problem ? STATE_DAMAGED : STATE_READ;
    if (!problem)
        return CRANNY_OK;
    state_free(state);
    hook_warn(hooks, "%s: not used: %s; everything is baked anew", path, problem);
    return CRANNY_OK;
}

void state_free(struct state *state)
{
    free(state->bytes);
    *state = (struct state){0};
}

const void *state_find(const struct state *state, enum state_kind kind, uint64_t key, size_t *size)
{
    const struct state_record wanted = {.kind = kind, .key = key};
    const struct state_record *record =
        state->count
            ? bsearch(&wanted, state->records, state->count, sizeof wanted, compare_records)
            : NULL;
    *size = record ? (size_t)record->size : 0;
    return record ? state->bytes + record->offset : NULL;
}

bool state_add(struct state_list *list, enum state_kind kind, uint64_t key, const void *data,
               size_t size)
{
    if (!grow_array((void **)&list->records, &list->record_capacity, list->count + 1,
                    sizeof *list->records) ||
        !grow_array((void **)&list->data, &list->data_capacity, list->count + 1,
                    sizeof *list->data))
        return false;
    /* The number of its data, until offsets are known. */
    list->records[list->count] =
        (struct state_record){.key = key, .kind = kind, .offset = list->count, .size = size};
    list->data[list->count++] = data;
    return true;
}

/* hash_bytes over all parts as one run: each is a multiple of 8 bytes, or is padded to one. */
static uint64_t hash_parts(const struct file_part *parts, size_t count, size_t size)
{
    uint64_t hash = HASH_BEGIN, word;
    for (size_t p = 0; p < count; p++)
        for (size_t i = 0; i < parts[p].size; i += 8) {
            memcpy(&word, (const uint8_t *)parts[p].data + i, 8);
            hash = hash_word(hash, word);
        }
    return hash_word(hash_word(hash, 0), size);
}

/* Header, records, then data and padding in turns. */
static void lay_out(struct state_list *list, struct state_header *header, struct file_part *parts,
                    uint8_t (*tails)[8])
{
    uint64_t offset = sizeof *header + list->count * sizeof *list->records;
    size_t used = 0;
    qsort(list->records, list->count, sizeof *list->records, compare_records);
    parts[used++] = (struct file_part){header, sizeof *header};
    parts[used++] = (struct file_part){list->records, list->count * sizeof *list->records};
    for (size_t i = 0; i < list->count; i++) {
        struct state_record *record = &list->records[i];
        const uint8_t *data = list->data[record->offset];
        const size_t whole = (size_t)record->size & ~(size_t)7, rest = (size_t)record->size % 8;
        if (rest)
            memcpy(tails[i], data + whole, rest);
        parts[used++] = (struct file_part){data, whole};
        parts[used++] = (struct file_part){tails[i], rest ? 8 : 0};
        record->offset = offset;
        offset += padded(record->size);
    }
    header->size = offset;
}

enum cranny_status state_write(const char *path, uint64_t key, struct state_list *list,
                               uint64_t *size, struct cranny_error *why)
{
    struct state_header header = {.format = STATE_FORMAT, .order = STATE_ORDER, .key = key};
    const size_t part_count = 2 + 2 * list->count;
    struct file_part *parts = alloc_array(part_count, sizeof *parts);
    uint8_t(*tails)[8] = alloc_array(list->count, sizeof *tails);
    enum cranny_status status = parts && tails ? CRANNY_OK : fail_memory(why, path);
    memcpy(header.magic, magic, sizeof magic);
    header.count = list->count;
    if (status == CRANNY_OK) {
        lay_out(list, &header, parts, tails);
        header.body = hash_parts(parts + 1, part_count - 1, (size_t)header.size - sizeof header);
        header.check = header_check(&header);
        status = file_write(path, parts, part_count, why);
    }
    *size = status == CRANNY_OK ? header.size : 0;
    free(parts);
    free(tails);
    return status;
}

void state_list_free(struct state_list *list)
{
    free(list->records);
    free(list->data);
    *list = (struct state_list){0};
}
