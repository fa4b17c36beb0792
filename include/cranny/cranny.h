/* All of Cranny: ambient occlusion and obscurance, baked, rendered and measured. */
#ifndef CRANNY_CRANNY_H
#define CRANNY_CRANNY_H

#include <cranny/bake.h>
#include <cranny/base.h>
#include <cranny/compare.h>
#include <cranny/filter.h>
#include <cranny/frame.h>
#include <cranny/gbuffer.h>
#include <cranny/image.h>
#include <cranny/report.h>
#include <cranny/runtime.h>
#include <cranny/scene.h>
#include <cranny/screen.h>
#include <cranny/trace.h>
#include <cranny/truth.h>
#include <cranny/tune.h>
#include <cranny/volumes.h>

#endif
