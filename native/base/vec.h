#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace cistern {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;
inline constexpr float kOneMinusEpsilon = 0x1.fffffep-1f;
inline constexpr double kDoubleOneMinusEpsilon = 0x1.fffffffffffffp-1;

inline constexpr float sqr(float x) { return x * x; }
inline float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.0f)); }
inline constexpr float lerp(float a, float b, float t) { return a + t * (b - a); }
inline constexpr float clamp01(float x) { return x < 0.0f ? 0.0f : (x > 1.0f ? 1.0f : x); }

struct Vec2 {
  float x = 0.0f, y = 0.0f;

  friend constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend constexpr Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }
  friend constexpr Vec2 operator*(float s, Vec2 a) { return a * s; }
  friend constexpr bool operator==(Vec2 a, Vec2 b) = default;
};

/// A point, a direction or a normal; which one is said by the name of the variable.
struct Vec3 {
  float x = 0.0f, y = 0.0f, z = 0.0f;

  constexpr float operator[](int axis) const { return axis == 0 ? x : (axis == 1 ? y : z); }
  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  friend constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(float s, Vec3 a) { return a * s; }
  friend constexpr Vec3 operator/(Vec3 a, float s) { return a * (1.0f / s); }
  constexpr Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  constexpr Vec3& operator*=(float s) { return *this = *this * s; }
  friend constexpr bool operator==(Vec3 a, Vec3 b) = default;
};

inline constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline constexpr Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline constexpr float length_squared(Vec3 a) { return dot(a, a); }
inline float length(Vec3 a) { return std::sqrt(length_squared(a)); }
inline Vec3 normalize(Vec3 a) { return a * (1.0f / length(a)); }
/// Unit vector along `a`, or `fallback` where `a` is zero or not finite.
inline Vec3 normalize_or(Vec3 a, Vec3 fallback) {
  const float l2 = length_squared(a);
  return l2 > 0.0f && std::isfinite(l2) ? a * (1.0f / std::sqrt(l2)) : fallback;
}
inline constexpr Vec3 lerp(Vec3 a, Vec3 b, float t) { return a + (b - a) * t; }
inline constexpr Vec3 min(Vec3 a, Vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
inline constexpr Vec3 max(Vec3 a, Vec3 b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
inline bool is_finite(Vec3 a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
/// Mirror image of `d` (leaving the surface) about the normal `n`.
inline constexpr Vec3 reflect(Vec3 d, Vec3 n) { return 2.0f * dot(d, n) * n - d; }

struct Bounds3 {
  Vec3 lower{INFINITY, INFINITY, INFINITY};
  Vec3 upper{-INFINITY, -INFINITY, -INFINITY};

  void extend(Vec3 p) { lower = min(lower, p), upper = max(upper, p); }
  void extend(const Bounds3& b) { lower = min(lower, b.lower), upper = max(upper, b.upper); }
  bool is_empty() const { return lower.x > upper.x; }
  Vec3 diagonal() const { return upper - lower; }
  Vec3 center() const { return 0.5f * (lower + upper); }
  friend constexpr bool operator==(const Bounds3& a, const Bounds3& b) = default;
};

}  // namespace cistern
