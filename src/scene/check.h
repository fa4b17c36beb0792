/* The doctor's findings, from its several files. */
#ifndef SCENE_CHECK_H
#define SCENE_CHECK_H

#include "scene/scene.h"

struct finding {
    enum cranny_severity severity;
    const char *code;
    char text[512];
};

struct findings {
    struct finding *items;
    size_t count, capacity;
    bool failed; /* out of memory */
};

void finding_add(struct findings *findings, enum cranny_severity severity, const char *code,
                 const char *format, ...) __attribute__((format(printf, 4, 5)));

/* check_roles.c: what looks like plants, skies and hulls but is taken for solid, and levels of
 * detail by name that found no finer one. `bounds`: of the scene. */
enum cranny_status check_roles(struct findings *findings, const struct cranny_scene *scene,
                               const double bounds[6], struct cranny_error *why);

#endif
