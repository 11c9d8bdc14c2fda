#pragma once

#include "scene/scene.h"
#include "shading/surface_point.h"

namespace cistern {

/// Sets the footprint of a point, which is new, and bends its shading normal where the material has moved vertices and
/// shows by bump what they are too few for. The heights and the normal they bend are those of the surface before it was
/// moved (as in Cycles); from then on the bent normal is the surface's own. `path` is that of the ray that arrived.
void set_footprint(SurfacePoint& point, float footprint, const Scene& scene, const PathState& path);

}  // namespace cistern
