#pragma once

#include "scene/mesh.h"
#include "shading/surface_point.h"

namespace cistern {

// Mesh data inside a triangle, in object space. `barycentric` weighs vertices 1 and 2; weights outside [0, 1]
// extrapolate linearly, as bump mapping needs at edges.

Vec3 interpolate_position(const Mesh& mesh, uint32_t triangle, Vec2 barycentric);

/// Unit normal on the side the winding faces: stored normals interpolated, or the triangle's own where there are none.
Vec3 interpolate_normal(const Mesh& mesh, uint32_t triangle, Vec2 barycentric);

/// Stored normals (the mesh has some, at points or corners) interpolated, not normalised; 0 where they cancel.
Vec3 blend_normals(const Mesh& mesh, uint32_t triangle, Vec2 barycentric);
/// The same in the world, as the instance says.
Vec3 blend_world_normals(const Mesh& mesh, const Instance& instance, uint32_t triangle, Vec2 barycentric);

/// See `surface_attribute`.
AttributeValue interpolate_attribute(const Mesh& mesh, uint32_t triangle, Vec2 barycentric, int index);

/// World-space normal of an object-space one by the inverse transpose, not normalised.
inline Vec3 transform_normal(const Transform& object_to_world, Vec3 n) {
  const Transform& m = object_to_world;
  const Vec3 cofactors{dot(cross(m.row_y, m.row_z), n), dot(cross(m.row_z, m.row_x), n),
                       dot(cross(m.row_x, m.row_y), n)};
  return m.determinant() < 0.0f ? -cofactors : cofactors;
}

}  // namespace cistern
