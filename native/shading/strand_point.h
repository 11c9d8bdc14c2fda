#pragma once

#include "shading/surface_point.h"

namespace cistern {

/// `make_surface_point` for a mesh of strands: a point of the round surface. Its normals point away from the middle of
/// the strand, whatever its taper, as in Cycles.
SurfacePoint make_strand_point(const Scene& scene, const Ray& ray, const Hit& hit);

}  // namespace cistern
