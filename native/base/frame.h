#pragma once

#include "base/vec.h"

namespace cistern {

/// Right-handed orthonormal basis around a unit normal.
/// [Duff et al. 2017, Building an Orthonormal Basis, Revisited]
struct Frame {
  Vec3 s, t, n;

  explicit Frame(Vec3 normal) : n(normal) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  Frame(Vec3 tangent, Vec3 bitangent, Vec3 normal) : s(tangent), t(bitangent), n(normal) {}

  Vec3 to_local(Vec3 v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vec3 to_world(Vec3 v) const { return s * v.x + t * v.y + n * v.z; }
};

}  // namespace cistern
