#include "bake/lsq.h"

#include "base/vector.h"

/* Height over edge below which a triangle has no usable gradient. */
#define FLAT_HEIGHT 1e-6
/* Largest |r_e|² over the pair's area; 4.6 for equilateral triangles. Slivers would else make rows
 * so stiff that the solver needs ten times the iterations, for the same error. */
#define STIFFEST 20.0

struct lsq_params lsq_params_default(void)
{
    return (struct lsq_params){.alpha = 0.2,
                               .ridge = 1e-7,
                               .pull = 0.5,
                               .tolerance = 1e-4,
                               .iterations_max = 2000,
                               .threads = 1};
}

/* Where along the edge (0..1) the foot of the apex lies, and its squared height. */
static void measure_apex(const double p0[3], const double edge[3], double length2,
                         const double apex[3], double *along, double *height2)
{
    double d[3];
    for (int k = 0; k < 3; k++)
        d[k] = apex[k] - p0[k];
    *along = dot3(d, edge) / length2;
    for (int k = 0; k < 3; k++)
        d[k] -= *along * edge[k];
    *height2 = dot3(d, d);
}

bool lsq_edge(const double p0[3], const double p1[3], const double p2[3], const double p3[3],
              double r[4])
{
    double edge[3], t1, t2, height1, height2;
    for (int k = 0; k < 3; k++)
        edge[k] = p1[k] - p0[k];
    const double length2 = dot3(edge, edge);
    if (!(length2 > 0))
        return false;
    measure_apex(p0, edge, length2, p2, &t1, &height1);
    measure_apex(p0, edge, length2, p3, &t2, &height2);
    const double flat = FLAT_HEIGHT * FLAT_HEIGHT * length2;
    if (!(height1 > flat) || !(height2 > flat))
        return false;
    height1 = sqrt(height1);
    height2 = sqrt(height2);
    const double areas = 0.5 * sqrt(length2) * (height1 + height2);
    const double a = areas / height1, b = areas / height2;
    r[0] = -(1 - t1) * a - (1 - t2) * b;
    r[1] = -t1 * a - t2 * b;
    r[2] = a;
    r[3] = b;
    const double norm2 = r[0] * r[0] + r[1] * r[1] + a * a + b * b;
    for (int k = 0; k < 4 && norm2 > STIFFEST * areas; k++)
        r[k] *= sqrt(STIFFEST * areas / norm2);
    return isfinite(r[0] + r[1]);
}

/* A row in the making: columns in the order they were met, found again through a small hash. */
struct row {
    uint32_t *slots; /* index of a column + 1, 0: free */
    uint32_t *columns;
    double *values, *rough; /* M + αR, and R alone */
    uint32_t count, slot_mask;
    size_t capacity;
};

static void row_free(struct row *row)
{
    free(row->slots);
    free(row->columns);
    free(row->values);
    free(row->rough);
}

/* Empty the row and make room for a vertex of `valence` triangles. */
static bool row_begin(struct row *row, uint32_t valence)
{
    size_t slots = 32;
    while (slots < 2 * (4 * (size_t)valence + 1))
        slots *= 2;
    if (slots > row->capacity) {
        row_free(row);
        *row = (struct row){.capacity = slots};
        row->slots = alloc_array(slots, sizeof *row->slots);
        row->columns = alloc_array(slots, sizeof *row->columns);
        row->values = alloc_array(slots, sizeof *row->values);
        row->rough = alloc_array(slots, sizeof *row->rough);
        if (!row->slots || !row->columns || !row->values || !row->rough)
            return false;
    }
    row->count = 0;
    row->slot_mask = (uint32_t)(slots - 1);
    memset(row->slots, 0, slots * sizeof *row->slots);
    return true;
}

static void row_add(struct row *row, uint32_t column, double value, double rough)
{
    uint32_t slot = (column * 0x9e3779b9u >> 12) & row->slot_mask;
    while (row->slots[slot] && row->columns[row->slots[slot] - 1] != column)
        slot = (slot + 1) & row->slot_mask;
    if (!row->slots[slot]) {
        row->columns[row->count] = column;
        row->values[row->count] = row->rough[row->count] = 0;
        row->slots[slot] = ++row->count;
    }
    row->values[row->slots[slot] - 1] += value;
    row->rough[row->slots[slot] - 1] += rough;
}

/* Add α r_e[self] r_eᵀ for the edge from corner `c` of triangle `t`, where `self` is the row's
 * vertex. α is divided by the samples a face of the pair has: what is well measured needs no
 * smoothing (a departure from eq. 2; -11 % error on Sponza, -10 % on an indoor level). The edge is
 * always run from its lower vertex, so that both sides get the same bits. */
static void row_add_edge(struct row *row, const struct surface *surface,
                         const struct lsq_term *terms, const float *smooth, uint32_t t, int c,
                         uint32_t self, double alpha)
{
    const uint32_t *corner = surface->triangles[t];
    const uint32_t beyond = surface->across[t][c];
    if (beyond == SURFACE_NONE)
        return;
    uint32_t v[4] = {corner[c], corner[(c + 1) % 3], corner[(c + 2) % 3],
                     surface->triangles[beyond / 3][beyond % 3]};
    if (v[0] > v[1]) {
        const uint32_t swapped[4] = {v[1], v[0], v[3], v[2]};
        memcpy(v, swapped, sizeof v);
    }
    double r[4];
    const double(*p)[3] = (const double(*)[3])surface->position;
    if (!lsq_edge(p[v[0]], p[v[1]], p[v[2]], p[v[3]], r))
        return;
    double own = 0;
    const double factor = (smooth ? (double)smooth[self] : 1) /
                          fmax(0.5 * (terms[t].count + terms[beyond / 3].count), 1);
    for (int k = 0; k < 4; k++)
        own += v[k] == self ? r[k] : 0;
    for (int k = 0; k < 4; k++)
        row_add(row, v[k], alpha * factor * own * r[k], factor * own * r[k]);
}

/* One row of M + αR, and the row's b. Every edge that a vertex touches shows up once: as the one
 * opposite to it, or as the one that starts at it. */
static void fill_row(struct row *row, const struct surface *surface, const struct lsq_term *terms,
                     const float *smooth, uint32_t self, double alpha, double right[2])
{
    right[0] = right[1] = 0;
    row_add(row, self, 0, 0);
    for (uint32_t i = surface->incident_start[self]; i < surface->incident_start[self + 1]; i++) {
        const uint32_t t = surface->incident[i] / 3, c = surface->incident[i] % 3;
        const uint32_t next = (c + 1) % 3, last = (c + 2) % 3;
        const struct lsq_term *term = &terms[t];
        row_add(row, self, term->m[c], 0);
        row_add(row, surface->triangles[t][next], term->m[3 + c], 0);
        row_add(row, surface->triangles[t][last], term->m[3 + last], 0);
        right[0] += term->b[0][c];
        right[1] += term->b[1][c];
        if (alpha > 0) {
            row_add_edge(row, surface, terms, smooth, t, (int)next, self, alpha);
            row_add_edge(row, surface, terms, smooth, t, (int)c, self, alpha);
        }
    }
}

struct builder {
    const struct surface *surface;
    const struct lsq_term *terms;
    const double (*prior)[2];
    const float *smooth;
    double alpha, ridge, pull;
    bool retunable;
    struct lsq_system *system;
};

/* Columns grow as rows come; the piece is cut to size at the end. */
struct capacity {
    size_t column, value, rough;
};

static bool store_row(struct lsq_chunk *chunk, struct capacity *capacity, uint32_t local,
                      const struct row *row, bool retunable)
{
    const uint32_t used = chunk->start[local];
    const size_t need = (size_t)used + row->count;
    if (need > UINT32_MAX ||
        !grow_array((void **)&chunk->column, &capacity->column, need, sizeof *chunk->column) ||
        !grow_array((void **)&chunk->value, &capacity->value, need, sizeof *chunk->value) ||
        (retunable &&
         !grow_array((void **)&chunk->rough, &capacity->rough, need, sizeof *chunk->rough)))
        return false;
    memcpy(chunk->column + used, row->columns, row->count * sizeof *row->columns);
    memcpy(chunk->value + used, row->values, row->count * sizeof *row->values);
    if (retunable)
        memcpy(chunk->rough + used, row->rough, row->count * sizeof *row->rough);
    chunk->start[local + 1] = (uint32_t)need;
    return true;
}

static void cut_chunk(struct lsq_chunk *chunk, uint32_t entries)
{
    uint32_t *column = realloc(chunk->column, entries * sizeof *column);
    double *value = realloc(chunk->value, entries * sizeof *value);
    chunk->column = column ? column : chunk->column;
    chunk->value = value ? value : chunk->value;
}

/* The vertex's own prior counts as `pull` of its samples. */
static double pull_of(const struct builder *builder, uint32_t self)
{
    const struct surface *surface = builder->surface;
    double mass = 0, count = 0;
    for (uint32_t i = surface->incident_start[self]; i < surface->incident_start[self + 1]; i++) {
        const uint32_t c = surface->incident[i] % 3;
        const struct lsq_term *term = &builder->terms[surface->incident[i] / 3];
        mass += term->m[c] + term->m[3 + c] + term->m[3 + (c + 2) % 3];
        count += term->count;
    }
    return count > 0 ? builder->pull * mass / count : 0;
}

static bool build_chunk(const struct builder *builder, size_t index, struct row *row)
{
    struct lsq_system *system = builder->system;
    struct lsq_chunk *chunk = &system->chunks[index];
    const uint32_t first = (uint32_t)(index * LSQ_CHUNK);
    const uint32_t rows = system->count - first < LSQ_CHUNK ? system->count - first : LSQ_CHUNK;
    struct capacity capacity = {0};
    chunk->start = alloc_array((size_t)rows + 1, sizeof *chunk->start);
    bool good = chunk->start &&
                grow_array((void **)&chunk->column, &capacity.column, rows * 16, 4) &&
                grow_array((void **)&chunk->value, &capacity.value, rows * 16, 8);
    for (uint32_t i = 0; good && i < rows; i++) {
        const uint32_t self = first + i;
        const uint32_t *start = &builder->surface->incident_start[self];
        if (!row_begin(row, start[1] - start[0]))
            return false;
        fill_row(row, builder->surface, builder->terms, builder->smooth, self, builder->alpha,
                 system->right[self]);
        const double ridge = builder->ridge + pull_of(builder, self);
        row->values[0] += ridge;
        for (int s = 0; s < 2; s++)
            system->right[self][s] += ridge * builder->prior[self][s];
        system->diagonal[self] = row->values[0];
        good = store_row(chunk, &capacity, i, row, builder->retunable);
    }
    if (good)
        cut_chunk(chunk, chunk->start[rows]);
    return good;
}

static double mean_mass(const struct surface *surface, const struct lsq_term *terms)
{
    double sum = 0;
    for (uint32_t t = 0; t < surface->triangle_count; t++)
        for (int k = 0; k < 6; k++)
            sum += k < 3 ? terms[t].m[k] : 2 * terms[t].m[k];
    return surface->unknown_count ? sum / surface->unknown_count : 0;
}

enum cranny_status lsq_build(const struct surface *surface, const struct lsq_term *terms,
                             const double (*prior)[2], const struct lsq_params *params,
                             struct lsq_system *system, struct cranny_error *why)
{
    const uint32_t count = surface->unknown_count;
    *system = (struct lsq_system){.count = count,
                                  .alpha = params->alpha,
                                  .chunk_count = ((size_t)count + LSQ_CHUNK - 1) / LSQ_CHUNK};
    system->chunks = alloc_array(system->chunk_count, sizeof *system->chunks);
    system->diagonal = alloc_array(count, sizeof *system->diagonal);
    system->right = alloc_array(count, sizeof *system->right);
    if (!system->chunks || !system->diagonal || !system->right) {
        system->chunk_count = system->chunks ? system->chunk_count : 0;
        lsq_free(system);
        return fail_memory(why, "least squares");
    }
    const double mass = mean_mass(surface, terms);
    const struct builder builder = {.surface = surface,
                                    .terms = terms,
                                    .prior = prior,
                                    .smooth = params->smooth,
                                    .retunable = params->retunable,
                                    .alpha = params->alpha,
                                    .ridge = params->ridge * (mass > 0 ? mass : 1),
                                    .pull = params->pull,
                                    .system = system};
    int good = 1;
    uint64_t entries = 0;
#pragma omp parallel num_threads(params->threads) reduction(&& : good) reduction(+ : entries)      \
    if (params->threads > 1)
    {
        struct row row = {0};
#pragma omp for schedule(dynamic, 1)
        for (size_t i = 0; i < system->chunk_count; i++) {
            good = good && build_chunk(&builder, i, &row);
            const size_t rows =
                count - i * LSQ_CHUNK < LSQ_CHUNK ? count - i * LSQ_CHUNK : LSQ_CHUNK;
            entries += good ? system->chunks[i].start[rows] : 0;
        }
        row_free(&row);
    }
    system->entry_count = entries;
    if (good)
        return CRANNY_OK;
    lsq_free(system);
    return fail_memory(why, "least squares");
}

static bool retune_chunk(const struct lsq_system *system, size_t index, double more,
                         struct lsq_system *other)
{
    const struct lsq_chunk *chunk = &system->chunks[index];
    const size_t first = index * LSQ_CHUNK;
    const size_t rows = system->count - first < LSQ_CHUNK ? system->count - first : LSQ_CHUNK;
    other->chunks[index] = (struct lsq_chunk){.start = chunk->start, .column = chunk->column};
    double *value = alloc_array(chunk->start[rows], sizeof *value);
    other->chunks[index].value = value;
    for (uint32_t e = 0; value && e < chunk->start[rows]; e++)
        value[e] = chunk->value[e] + more * chunk->rough[e];
    for (size_t row = 0; value && row < rows; row++)
        other->diagonal[first + row] = value[chunk->start[row]];
    return value;
}

enum cranny_status lsq_retune(const struct lsq_system *system, double alpha,
                              struct lsq_system *other, struct cranny_error *why)
{
    *other = *system;
    other->alpha = alpha;
    other->borrowed = true;
    other->chunks = alloc_array(system->chunk_count, sizeof *other->chunks);
    other->diagonal = alloc_array(system->count, sizeof *other->diagonal);
    bool good = other->chunks && other->diagonal;
    for (size_t i = 0; good && i < system->chunk_count; i++)
        good = retune_chunk(system, i, alpha - system->alpha, other);
    if (good)
        return CRANNY_OK;
    other->chunk_count = other->chunks ? other->chunk_count : 0;
    lsq_free(other);
    return fail_memory(why, "least squares");
}

void lsq_free(struct lsq_system *system)
{
    for (size_t i = 0; i < system->chunk_count; i++) {
        free(system->chunks[i].value);
        if (system->borrowed)
            continue;
        free(system->chunks[i].start);
        free(system->chunks[i].column);
        free(system->chunks[i].rough);
    }
    if (!system->borrowed)
        free(system->right);
    free(system->chunks);
    free(system->diagonal);
    *system = (struct lsq_system){0};
}
