/* From a target's samples to its vertex values. */
#ifndef BAKE_FIT_H
#define BAKE_FIT_H

#include "bake/collect.h"
#include "bake/surface.h"
#include "base/watch.h"

/* Sums over targets; two may be added in any order except the doubles. */
struct fit_report {
    uint64_t unsampled_vertices, lost_components, invalid, bytes;
    int iterations, unconverged;
    double squares, weight;       /* of samples against the fit, by area */
    double visibility;            /* of samples, by area */
    double agreed, agreed_weight; /* squares that both halves of a triangle's samples agree on */
};

/* Fill values[vertex][0..1] (long, short) for target `index`, in [0,1]; vertices that no triangle
 * uses get 1. `threads` never changes the bits. `watch` may stop it. */
enum cranny_status fit_target(const struct plan *plan, const struct samples *samples, size_t index,
                              const struct cranny_bake_params *params, int threads,
                              struct watch *watch, float (*values)[2], struct fit_report *report,
                              struct cranny_error *why);

/* Compare values that came from elsewhere with the target's samples, as fit_target does with its
 * own: fills `report`. */
enum cranny_status fit_measure(const struct plan *plan, const struct samples *samples, size_t index,
                               const struct cranny_bake_params *params, const float (*values)[2],
                               struct fit_report *report, struct cranny_error *why);

/* A vertex of an instance as a place to gather at, with its own normal or the mean of its faces';
 * false: it has none. `surface`: of the mesh. */
bool fit_vertex_point(const struct frame *frame, const struct cranny_mesh *mesh,
                      const struct surface *surface, uint32_t vertex, struct gather_point *point);

/* Like fit_target for CRANNY_FIT_VERTEX: rays from the vertices; `rays` and `samples` are added to.
 */
enum cranny_status fit_from_vertices(const struct plan *plan, const struct cranny_tracer *tracer,
                                     size_t index, const struct cranny_bake_params *params,
                                     float (*values)[2], struct fit_report *report,
                                     struct samples *samples, struct cranny_error *why);

#endif
