/* Disjoint sets as a forest of parents; a root is the smallest of its set. */
#ifndef BAKE_FOREST_H
#define BAKE_FOREST_H

#include <stdint.h>

static inline uint32_t forest_root(uint32_t *parent, uint32_t item)
{
    while (parent[item] != item) {
        parent[item] = parent[parent[item]];
        item = parent[item];
    }
    return item;
}

static inline void forest_join(uint32_t *parent, uint32_t a, uint32_t b)
{
    a = forest_root(parent, a);
    b = forest_root(parent, b);
    parent[a > b ? a : b] = a > b ? b : a;
}

#endif
