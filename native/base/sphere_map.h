#pragma once

#include "base/vec.h"

namespace cistern {

// The sphere as a square without stretched places: the unit square folds about the inscribed diamond into an
// octahedron, and area is kept: 4 pi steradians for 1. [Clarberg 2008, Fast Equal-Area Mapping of the (Hemi)Sphere
// using SIMD]

/// Direction of a point of the unit square.
inline Vec3 equal_area_direction(Vec2 p) {
  const float x = 2.0f * p.x - 1.0f, y = 2.0f * p.y - 1.0f;
  const float ax = std::abs(x), ay = std::abs(y);
  const float inside = 1.0f - ax - ay;  // below 0: beyond the diamond, z < 0
  const float r = 1.0f - std::abs(inside);
  const float phi = r > 0.0f ? ((ay - ax) / r + 1.0f) * (kPi / 4.0f) : 0.0f;
  const float sine = r * std::sqrt(2.0f - r * r);  // of the angle to the z axis
  return {std::copysign(sine * std::cos(phi), x), std::copysign(sine * std::sin(phi), y),
          std::copysign(1.0f - r * r, inside)};
}

/// The other way; the direction is unit.
inline Vec2 equal_area_point(const Vec3& w) {
  const float r = safe_sqrt(1.0f - std::abs(w.z));
  float v = r * std::atan2(std::abs(w.y), std::abs(w.x)) * (2.0f * kInvPi);
  float u = r - v;
  if (w.z < 0.0f) {
    const float folded = 1.0f - u;
    u = 1.0f - v;
    v = folded;
  }
  return {0.5f * (1.0f + std::copysign(u, w.x)), 0.5f * (1.0f + std::copysign(v, w.y))};
}

}  // namespace cistern
