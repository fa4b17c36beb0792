/* 64-bit hashes of contents: to find what is the same again, not to defend against anybody. */
#ifndef BASE_HASH_H
#define BASE_HASH_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define HASH_BEGIN 0x6a09e667f3bcc909u

static inline uint64_t hash_word(uint64_t hash, uint64_t word)
{
    hash = (hash ^ word) * 0x9fb21c651e98df25u;
    return hash ^ hash >> 32;
}

/* The bytes and their number. */
static inline uint64_t hash_bytes(uint64_t hash, const void *data, size_t size)
{
    const unsigned char *bytes = data;
    uint64_t word;
    for (size_t i = 0; i + 8 <= size; i += 8) {
        memcpy(&word, bytes + i, 8);
        hash = hash_word(hash, word);
    }
    word = 0;
    if (size % 8)
        memcpy(&word, bytes + size / 8 * 8, size % 8);
    return hash_word(hash_word(hash, word), size);
}

#endif
