#pragma once

#include "base/vec.h"

namespace cistern {

/// Change of the weights of vertices 1 and 2 for a step in the plane of a triangle; 0 for one without area.
inline Vec2 weight_step(Vec3 edge_1, Vec3 edge_2, Vec3 step) {
  const Vec3 n = cross(edge_1, edge_2);
  const float n2 = dot(n, n);
  if (!(n2 > 0.0f)) return {};
  return {dot(cross(step, edge_2), n) / n2, dot(cross(edge_1, step), n) / n2};
}

}  // namespace cistern
