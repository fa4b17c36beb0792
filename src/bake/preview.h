/* Choosing where to look at a scene from. */
#ifndef BAKE_PREVIEW_H
#define BAKE_PREVIEW_H

#include "base/base.h"

#include <cranny/trace.h>

/* See cranny_preview_default_view. */
enum cranny_status preview_choose_view(const struct cranny_scene *scene,
                                       const struct cranny_tracer *tracer, double aspect,
                                       struct cranny_camera *view, struct cranny_error *why);

#endif
