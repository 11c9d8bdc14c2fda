#pragma once

#include <experimental/simd>

#include "base/rgb.h"

namespace cistern {

/// A number for each of eight things, or what was asked of each: as many as vector instructions take at once. Not set
/// unless said.
using Lanes = std::experimental::native_simd<float>;
using LaneMask = Lanes::mask_type;
inline constexpr size_t kLanes = Lanes::size();

inline size_t blocks_of_lanes(size_t count) { return (count + kLanes - 1) / kLanes; }

struct Vec3Lanes {
  Lanes x = 0.0f, y = 0.0f, z = 0.0f;

  Vec3Lanes() = default;
  Vec3Lanes(const Lanes& x_lanes, const Lanes& y_lanes, const Lanes& z_lanes) : x(x_lanes), y(y_lanes), z(z_lanes) {}
  explicit Vec3Lanes(const Vec3& same) : x(same.x), y(same.y), z(same.z) {}
  Vec3 at(size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  void set(size_t lane, const Vec3& v) { x[lane] = v.x, y[lane] = v.y, z[lane] = v.z; }

  friend Vec3Lanes operator+(const Vec3Lanes& a, const Vec3Lanes& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3Lanes operator-(const Vec3Lanes& a, const Vec3Lanes& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3Lanes operator*(const Vec3Lanes& a, const Lanes& s) { return {a.x * s, a.y * s, a.z * s}; }
};

inline Lanes dot(const Vec3Lanes& a, const Vec3Lanes& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3Lanes cross(const Vec3Lanes& a, const Vec3Lanes& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Lanes length(const Vec3Lanes& a) { return sqrt(dot(a, a)); }

struct RgbLanes {
  Lanes r = 0.0f, g = 0.0f, b = 0.0f;

  RgbLanes() = default;
  RgbLanes(const Lanes& red, const Lanes& green, const Lanes& blue) : r(red), g(green), b(blue) {}
  explicit RgbLanes(const Lanes& grey) : r(grey), g(grey), b(grey) {}
  Rgb at(size_t lane) const { return {r[lane], g[lane], b[lane]}; }
  void set(size_t lane, const Rgb& c) { r[lane] = c.r, g[lane] = c.g, b[lane] = c.b; }

  friend RgbLanes operator+(const RgbLanes& a, const RgbLanes& c) { return {a.r + c.r, a.g + c.g, a.b + c.b}; }
  friend RgbLanes operator-(const RgbLanes& a, const RgbLanes& c) { return {a.r - c.r, a.g - c.g, a.b - c.b}; }
  friend RgbLanes operator*(const RgbLanes& a, const RgbLanes& c) { return {a.r * c.r, a.g * c.g, a.b * c.b}; }
  friend RgbLanes operator*(const RgbLanes& a, const Lanes& s) { return {a.r * s, a.g * s, a.b * s}; }
  RgbLanes& operator+=(const RgbLanes& c) {
    r += c.r, g += c.g, b += c.b;
    return *this;
  }
};

inline RgbLanes operator*(const Rgb& same, const Lanes& s) { return {same.r * s, same.g * s, same.b * s}; }
inline LaneMask is_black(const RgbLanes& c) { return c.r == 0.0f && c.g == 0.0f && c.b == 0.0f; }

/// Zero where not `mask`.
inline Lanes where_or_zero(const LaneMask& mask, const Lanes& lanes) {
  Lanes kept = 0.0f;
  where(mask, kept) = lanes;
  return kept;
}
inline RgbLanes where_or_zero(const LaneMask& mask, const RgbLanes& lanes) {
  return {where_or_zero(mask, lanes.r), where_or_zero(mask, lanes.g), where_or_zero(mask, lanes.b)};
}
/// Sets those of `mask`.
inline void assign(const LaneMask& mask, RgbLanes& to, const RgbLanes& from) {
  where(mask, to.r) = from.r;
  where(mask, to.g) = from.g;
  where(mask, to.b) = from.b;
}

}  // namespace cistern
