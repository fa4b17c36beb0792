/* Choosing where to look at a scene from. */
#ifndef TRACE_VIEW_H
#define TRACE_VIEW_H

#include "base/base.h"

#include <cranny/trace.h>

/* From the front, right and above, so that everything fits a picture of `aspect`; or, where the
 * outside shows mostly back faces (a room), the longest look from a place within. */
enum cranny_status view_choose(const struct cranny_scene *scene, const struct cranny_tracer *tracer,
                               double aspect, struct cranny_camera *view, struct cranny_error *why);

#endif
