#pragma once

#include <array>

#include "base/vec.h"

namespace cistern {

/// A colour, radiance, throughput or weight: scene-linear Rec. 709.
struct Rgb {
  float r = 0.0f, g = 0.0f, b = 0.0f;

  constexpr Rgb() = default;
  constexpr explicit Rgb(float grey) : r(grey), g(grey), b(grey) {}
  constexpr Rgb(float red, float green, float blue) : r(red), g(green), b(blue) {}

  friend constexpr Rgb operator+(Rgb a, Rgb c) { return {a.r + c.r, a.g + c.g, a.b + c.b}; }
  friend constexpr Rgb operator-(Rgb a, Rgb c) { return {a.r - c.r, a.g - c.g, a.b - c.b}; }
  friend constexpr Rgb operator*(Rgb a, Rgb c) { return {a.r * c.r, a.g * c.g, a.b * c.b}; }
  friend constexpr Rgb operator*(Rgb a, float s) { return {a.r * s, a.g * s, a.b * s}; }
  friend constexpr Rgb operator*(float s, Rgb a) { return a * s; }
  friend constexpr Rgb operator/(Rgb a, float s) { return a * (1.0f / s); }
  friend constexpr Rgb operator/(Rgb a, Rgb c) { return {a.r / c.r, a.g / c.g, a.b / c.b}; }
  constexpr Rgb& operator+=(Rgb c) { return *this = *this + c; }
  constexpr Rgb& operator*=(Rgb c) { return *this = *this * c; }
  constexpr Rgb& operator*=(float s) { return *this = *this * s; }
  friend constexpr bool operator==(Rgb a, Rgb b) = default;
};

/// Rec. 709 luminance.
inline constexpr float luminance(Rgb c) { return 0.2126391f * c.r + 0.7151691f * c.g + 0.0721928f * c.b; }
/// Luminance as if nothing were negative, as light of lamps that take away is: 0 for black alone.
inline constexpr float magnitude(Rgb c) {
  const auto size = [](float x) { return x < 0.0f ? -x : x; };
  return luminance({size(c.r), size(c.g), size(c.b)});
}
inline constexpr float average(Rgb c) { return (c.r + c.g + c.b) * (1.0f / 3.0f); }
inline constexpr float max_component(Rgb c) { return std::max(c.r, std::max(c.g, c.b)); }
inline constexpr bool is_black(Rgb c) { return c.r == 0.0f && c.g == 0.0f && c.b == 0.0f; }
inline bool is_finite(Rgb c) { return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b); }
inline constexpr Rgb lerp(Rgb a, Rgb b, float t) { return a + (b - a) * t; }
inline constexpr Rgb lerp(Rgb a, Rgb b, Rgb t) { return a + (b - a) * t; }
inline constexpr Rgb min(Rgb a, Rgb b) { return {std::min(a.r, b.r), std::min(a.g, b.g), std::min(a.b, b.b)}; }
inline constexpr Rgb max(Rgb a, Rgb b) { return {std::max(a.r, b.r), std::max(a.g, b.g), std::max(a.b, b.b)}; }
inline Rgb exp(Rgb c) { return {std::exp(c.r), std::exp(c.g), std::exp(c.b)}; }
/// By a matrix, row by row.
inline constexpr Rgb multiply(const std::array<float, 9>& m, Rgb c) {
  return {m[0] * c.r + m[1] * c.g + m[2] * c.b, m[3] * c.r + m[4] * c.g + m[5] * c.b,
          m[6] * c.r + m[7] * c.g + m[8] * c.b};
}
inline constexpr Rgb to_rgb(Vec3 v) { return {v.x, v.y, v.z}; }
inline constexpr Vec3 to_vec(Rgb c) { return {c.r, c.g, c.b}; }

}  // namespace cistern
