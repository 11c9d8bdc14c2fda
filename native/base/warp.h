#pragma once

#include "base/angle.h"

namespace cistern {

// Maps from the unit square to shapes; each says its density. All are continuous enough to keep stratification.

/// Unit disk, density 1/pi. [Shirley and Chiu 1997, A Low Distortion Map Between Disk and Square]
inline Vec2 square_to_disk(Vec2 u) {
  const Vec2 p{2.0f * u.x - 1.0f, 2.0f * u.y - 1.0f};
  if (p.x == 0.0f && p.y == 0.0f) return {0.0f, 0.0f};
  const bool is_nearer_x = std::abs(p.x) > std::abs(p.y);
  const float radius = is_nearer_x ? p.x : p.y, other = is_nearer_x ? p.y : p.x;
  const SineCosine off_axis = sine_cosine_near_zero((kPi / 4.0f) * (other / radius));
  const float along = radius * off_axis.cosine, across = radius * off_axis.sine;
  return is_nearer_x ? Vec2{along, across} : Vec2{across, along};
}

/// Upper hemisphere around +z, density cos(theta)/pi per solid angle.
inline Vec3 square_to_cosine_hemisphere(Vec2 u) {
  const Vec2 d = square_to_disk(u);
  return {d.x, d.y, safe_sqrt(1.0f - d.x * d.x - d.y * d.y)};
}

/// Unit sphere, density 1/(4 pi) per solid angle.
inline Vec3 square_to_sphere(Vec2 u) {
  const float z = 1.0f - 2.0f * u.x;
  const float r = safe_sqrt(1.0f - z * z);
  const SineCosine azimuth = sine_cosine_of_turns(u.y);
  return {r * azimuth.cosine, r * azimuth.sine, z};
}

/// Cone of half angle acos(1 - one_minus_cos) around +z, density 1/(2 pi one_minus_cos) per solid angle.
inline Vec3 square_to_cone(Vec2 u, float one_minus_cos) {
  const float height = u.x * one_minus_cos;  // 1 - cos(theta), accurate for small cones
  const float r = safe_sqrt(height * (2.0f - height));
  const SineCosine azimuth = sine_cosine_of_turns(u.y);
  return {r * azimuth.cosine, r * azimuth.sine, 1.0f - height};
}

/// Weights (b1, b2) of vertices 1 and 2, uniform over a triangle's area.
/// [Heitz 2019, A Low-Distortion Map Between Triangle and Square]
inline Vec2 square_to_triangle(Vec2 u) {
  if (u.y > u.x) {
    const float b1 = u.x * 0.5f;
    return {b1, u.y - b1};
  }
  const float b2 = u.y * 0.5f;
  return {u.x - b2, b2};
}

/// Power heuristic with exponent 2 for one sample of each of two techniques. [Veach 1997, §9.2.4]
inline float power_heuristic(float pdf_this, float pdf_other) {
  if (!std::isfinite(pdf_this)) return 1.0f;
  const float ratio = pdf_other / pdf_this;
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace cistern
