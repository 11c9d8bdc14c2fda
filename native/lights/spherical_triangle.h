#pragma once

#include <optional>

#include "lights/emissive_triangles.h"

namespace cistern {

/// A triangle as a receiver sees it, sampled uniformly by solid angle: next to a large emitter the density of points
/// that are uniform over its area differs by orders of magnitude between its near and its far end.
/// [Arvo 1995, Stratified Sampling of Spherical Triangles], with areas by [Van Oosterom and Strackee 1983], whose
/// tangents of half of them, unlike excesses of angles, are as precise for small triangles as for large ones.
class SphericalTriangle {
 public:
  /// Empty where sampling by area is as good: of triangles far off for their size, and of those seen edge-on.
  static std::optional<SphericalTriangle> of(const EmissiveTriangle& triangle, Vec3 receiver);

  /// Of all directions, per solid angle.
  float pdf() const { return pdf_; }
  /// Unit vector from the receiver to a point of the triangle.
  Vec3 direction(Vec2 u) const;

 private:
  SphericalTriangle() = default;

  Vec3 a_, b_, c_;                        // unit vectors from the receiver to the corners
  float half_turns_ = 0.0f, pdf_ = 0.0f;  // half of the solid angle, in full turns
};

/// Barycentric coordinates (b1, b2) of the point of a triangle that a direction from the receiver meets: of one next to
/// it those of its edge.
Vec2 barycentric_along(const EmissiveTriangle& triangle, Vec3 receiver, Vec3 direction);
/// The same where the direction meets the triangle; else empty.
std::optional<Vec2> find_barycentric(const EmissiveTriangle& triangle, Vec3 receiver, Vec3 direction);

}  // namespace cistern
