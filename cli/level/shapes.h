/* What the level is built of: tessellated panels, boxes, beams, turned bodies, blobs, cards. */
#ifndef LEVEL_SHAPES_H
#define LEVEL_SHAPES_H

#include "mesh.h"

/* Where shapes go: their coordinates are those of `mesh` turned and moved by origin and axes. */
struct builder {
    struct mesh *mesh;
    double edge; /* metres: no edge on a flat surface is longer */
    struct vec origin, x, y, z;
};

struct builder builder_at(struct mesh *mesh, double edge);
/* The same, moved by `offset` and turned by `angle` about y (both in the parent's axes). */
struct builder builder_turned(const struct builder *b, struct vec offset, double angle);
struct vec builder_point(const struct builder *b, struct vec p);
struct vec builder_direction(const struct builder *b, struct vec d);

/* A rectangle cut out of a panel. */
struct hole {
    double u0, u1, v0, v1;
};

/* A flat panel from `corner` along unit axes u and v, facing u × v, without its holes. Lines of
 * vertices run along all edges of holes and at the `marks` along u (may be NULL). */
struct panel {
    enum material material;
    struct vec corner, u, v;
    double width, height;
    const struct hole *holes;
    size_t hole_count;
    const double *marks;
    size_t mark_count;
};
void panel(struct builder *b, const struct panel *p);

/* A parallelogram spanned by u and v from `corner`, facing u × v. */
void quad(struct builder *b, enum material material, struct vec corner, struct vec u, struct vec v);
void triangle(struct builder *b, enum material material, struct vec p, struct vec q, struct vec r);

/* A box around `center`: half sizes along x, y, z of the builder. */
void box(struct builder *b, enum material material, struct vec center, struct vec half);
/* A box given by half axes that are at right angles and right-handed. */
void block(struct builder *b, enum material material, struct vec center, struct vec x, struct vec y,
           struct vec z);
/* A box along a segment: `width` across, `depth` along `up` as far as it is at right angles. */
void beam(struct builder *b, enum material material, struct vec from, struct vec to, struct vec up,
          double width, double depth);

/* A wall with thickness: outer face from `corner` (bottom left, seen from outside) along unit u,
 * facing u × up; openings with reveals. */
struct wall {
    enum material outside, inside, reveal;
    struct vec corner, u;
    double width, height, thickness;
    const struct hole *openings;
    size_t opening_count;
    const double *marks;
    size_t mark_count;
    bool ends; /* close its left and right ends */
};
void wall(struct builder *b, const struct wall *w);

/* Turn a profile of (radius, height) pairs, bottom to top, about y; seen from outside. Edges
 * between the profile's pieces are hard. `sides` at least 3. */
void lathe(struct builder *b, enum material material, struct vec base, const double (*profile)[2],
           size_t count, int sides);

/* A tapered, smooth tube between two points (trunks, branches), open at both ends. */
void tube(struct builder *b, enum material material, struct vec from, struct vec to, double radius0,
          double radius1, int sides, int pieces);

/* A closed lumpy ball. */
void blob(struct builder *b, enum material material, struct vec center, struct vec radii,
          double roughness, uint32_t seed, int sides);

/* A rectangle around `center` with its texture once on it; `pieces` squared quads, all with
 * `normal`: foliage is shaded as the crown it belongs to. */
void card(struct builder *b, enum material material, struct vec center, struct vec half_u,
          struct vec half_v, struct vec normal, int pieces);

#endif
