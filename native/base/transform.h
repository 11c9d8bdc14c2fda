#pragma once

#include <array>
#include <cmath>

#include "base/vec.h"

namespace cistern {

/// Affine map, row-major 3x4: p' = linear * p + translation.
struct Transform {
  Vec3 row_x{1.0f, 0.0f, 0.0f}, row_y{0.0f, 1.0f, 0.0f}, row_z{0.0f, 0.0f, 1.0f};
  Vec3 translation;

  Vec3 vector(Vec3 v) const { return {dot(row_x, v), dot(row_y, v), dot(row_z, v)}; }
  Vec3 point(Vec3 p) const { return vector(p) + translation; }
  Vec3 column(int i) const { return {row_x[i], row_y[i], row_z[i]}; }
  /// Transpose of the linear part times v: maps normals when called on the inverse transform.
  Vec3 transposed_vector(Vec3 v) const { return row_x * v.x + row_y * v.y + row_z * v.z; }
  float determinant() const { return dot(row_x, cross(row_y, row_z)); }
  friend bool operator==(const Transform&, const Transform&) = default;
};

/// First `b`, then `a`.
inline Transform operator*(const Transform& a, const Transform& b) {
  const auto row = [&](Vec3 r) { return Vec3{dot(r, b.column(0)), dot(r, b.column(1)), dot(r, b.column(2))}; };
  return {row(a.row_x), row(a.row_y), row(a.row_z), a.point(b.translation)};
}

/// Whether all angles stay, but for roundings: nothing is stretched or sheared.
inline bool is_conformal(const Transform& m) {
  const Vec3 x = m.column(0), y = m.column(1), z = m.column(2);
  const float scale = dot(x, x), tolerance = 1e-5f * scale;
  return std::abs(dot(y, y) - scale) <= tolerance && std::abs(dot(z, z) - scale) <= tolerance &&
         std::abs(dot(x, y)) <= tolerance && std::abs(dot(y, z)) <= tolerance && std::abs(dot(z, x)) <= tolerance;
}

/// The inverse; the caller has checked that the determinant is not zero.
inline Transform inverse(const Transform& m) {
  const float inv_det = 1.0f / m.determinant();
  const Vec3 cx = cross(m.row_y, m.row_z) * inv_det;
  const Vec3 cy = cross(m.row_z, m.row_x) * inv_det;
  const Vec3 cz = cross(m.row_x, m.row_y) * inv_det;
  Transform r{{cx.x, cy.x, cz.x}, {cx.y, cy.y, cz.y}, {cx.z, cy.z, cz.z}, {}};
  r.translation = -r.vector(m.translation);
  return r;
}

}  // namespace cistern
