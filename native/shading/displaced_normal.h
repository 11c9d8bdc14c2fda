#pragma once

#include "shading/node_context.h"

namespace cistern {

/// Shading normal, unit, in world space and on the side of wo, bent by the displacement of a surface whose vertices were
/// moved by it too: what vertices are too few to show. The heights and the normal they bend are those of the surface
/// before it was moved. Without heights, and on strands, the normal of the point.
Vec3 displaced_normal(const NodeContext& context);

}  // namespace cistern
