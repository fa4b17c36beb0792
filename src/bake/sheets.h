/* Two-sided sheets that are modelled upside down. */
#ifndef BAKE_SHEETS_H
#define BAKE_SHEETS_H

#include "bake/collect.h"

/* Triangles to be sampled from behind: per target, a flag per triangle, or NULL for none. */
struct sheets {
    uint8_t **turned; /* target_count */
    size_t target_count;
    uint64_t sample_count; /* on turned triangles */
};

/* Find, from the samples of all fronts, the connected pieces whose materials are two-sided and
 * whose fronts look into the inside of a solid, nearly everywhere: water and paving in many models.
 * Pieces are joined by position, whatever the normals. */
enum cranny_status sheets_find(const struct plan *plan, const struct samples *samples,
                               struct sheets *sheets, struct cranny_error *why);
void sheets_free(struct sheets *sheets);

#endif
