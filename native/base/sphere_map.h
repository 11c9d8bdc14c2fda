#pragma once

#include "base/angle.h"

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
  const float off_middle = r > 0.0f ? (ay - ax) / r * (kPi / 4.0f) : 0.0f;  // of its octant of azimuths
  const SineCosine turned = sine_cosine_near_zero(off_middle);
  constexpr float kHalf = 0.5f * std::numbers::sqrt2_v<float>;
  const float sine = r * std::sqrt(2.0f - r * r) * kHalf;  // of the angle to the z axis
  return {std::copysign(sine * (turned.cosine - turned.sine), x),
          std::copysign(sine * (turned.cosine + turned.sine), y), std::copysign(1.0f - r * r, inside)};
}

/// The other way; the direction is unit.
inline Vec2 equal_area_point(const Vec3& w) {
  const float r = safe_sqrt(1.0f - std::abs(w.z));
  float v = r * quarter_turns(std::abs(w.y), std::abs(w.x));
  float u = r - v;
  if (w.z < 0.0f) {
    const float folded = 1.0f - u;
    u = 1.0f - v;
    v = folded;
  }
  return {0.5f * (1.0f + std::copysign(u, w.x)), 0.5f * (1.0f + std::copysign(v, w.y))};
}

}  // namespace cistern
