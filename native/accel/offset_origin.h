#pragma once

#include <array>

#include "base/transform.h"

namespace cistern {

/// By world axis, the largest magnitude of what is added up on the way to a point of a triangle with these vertices,
/// in object space: rounding errors of the point, and of rays that are tested against the triangle near it, are in
/// proportion. Where a large triangle passes the origin, or an object's own coordinates cancel with its translation,
/// it is much larger than the point's coordinates.
inline Vec3 coordinate_reach(const Transform& object_to_world, const std::array<Vec3, 3>& vertices) {
  const auto magnitude = [](Vec3 v) { return Vec3{std::abs(v.x), std::abs(v.y), std::abs(v.z)}; };
  const Vec3 largest = max(max(magnitude(vertices[0]), magnitude(vertices[1])), magnitude(vertices[2]));
  const Transform& m = object_to_world;
  return Vec3{dot(magnitude(m.row_x), largest), dot(magnitude(m.row_y), largest), dot(magnitude(m.row_z), largest)} +
         magnitude(m.translation);
}

/// How far, in metres along the unit geometric normal `ng`, a ray has to start off a triangle of this `reach` so as
/// not to hit it again: 32 roundings of the coordinates, each as far as the normal points along its axis, and one of
/// the largest of all. Axes that the triangle is flat in count for nothing, so that small things keep their contact
/// shadows on a wide floor. [Pharr, Jakob and Humphreys 2023, Physically Based Rendering, 6.8: errors of the point
/// carried along, projected on the normal]; departure: a bound for all points of the triangle, since the test of the
/// next ray, which pbrt's own makes robust, has errors of the size of the triangle.
inline float surface_clearance(Vec3 reach, Vec3 ng) {
  constexpr float kRounding = 0x1p-24f, kRoundings = 32.0f;
  const float along_normal = std::abs(ng.x) * reach.x + std::abs(ng.y) * reach.y + std::abs(ng.z) * reach.z;
  return kRounding * (kRoundings * along_normal + std::max(std::max(reach.x, reach.y), reach.z));
}

/// Origin moved by `clearance` off the surface along the unit geometric normal, to the side of `direction`.
inline Vec3 offset_origin(Vec3 position, float clearance, Vec3 geometric_normal, Vec3 direction) {
  return position + (dot(geometric_normal, direction) < 0.0f ? -clearance : clearance) * geometric_normal;
}

}  // namespace cistern
