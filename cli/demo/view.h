/* Views: which shows occlusion best, in the words of cranny render; and one from within. */
#ifndef DEMO_VIEW_H
#define DEMO_VIEW_H

#include <cranny/cranny.h>

struct view {
    int index;
    struct cranny_camera camera;
    char words[192];
    double depth_median, radius_world; /* metres */
    double score; /* how much visibility varies over the picture; 0 or less: nothing to see */
};

/* The best of `views`. The first of them are the scene's own cameras, in order. */
enum cranny_status view_pick(const struct cranny_scene *scene, const struct cranny_tracer *tracer,
                             const struct cranny_camera *views, int count, struct view *best,
                             struct cranny_error *why);

/* The longest look from within the scene, where there is a place with surfaces all around it. */
enum cranny_status view_within(const struct cranny_scene *scene, const struct cranny_hooks *hooks,
                               struct cranny_camera *camera, bool *found, struct cranny_error *why);

#endif
