#pragma once

#include "shading/node_context.h"

namespace cistern {

/// `make_surface_point` for a mesh of splats: where the ray met the splat, with the axis as its normal in which that is
/// flattest, as in Cycles. [Chen et al. 2024, PGSR, 3.1]
SurfacePoint make_splat_point(const Scene& scene, const Ray& ray, const Hit& hit);

/// Whether an attribute that the mesh lacks is the radiance of its splats.
bool reads_splat_radiance(const NodeContext& context, int name_index);
/// What the splat sends to where it is seen from.
Vec3 splat_radiance(const NodeContext& context);

}  // namespace cistern
