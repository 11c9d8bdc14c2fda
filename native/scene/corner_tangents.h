#pragma once

#include "scene/mesh.h"

namespace cistern {

/// Tangents of a UV map at the corners of triangles, by which normal maps are baked and read. [MikkTSpace: Mikkelsen
/// 2008, Simulation of Wrinkled Surfaces Revisited]
struct CornerTangents {
  std::vector<std::array<uint32_t, 3>> directions;  // by triangle; octahedral, in object space
  std::vector<uint8_t> mirrored;                    // by triangle; bit j: at corner j the map is mirrored

  /// Interpolated, not normalised.
  Vec3 tangent(uint32_t triangle, Vec2 barycentric) const;
  /// 1 where the map is as seen from outside, -1 where it is mirrored.
  float handedness(uint32_t triangle, Vec2 barycentric) const;
  friend bool operator==(const CornerTangents&, const CornerTangents&) = default;
};

/// In place of an attribute, on meshes without a UV map: longitude and latitude of points about the object's origin,
/// as in Cycles.
inline constexpr int kNoUvMap = -2;

/// Of a triangle mesh by an attribute of two components or more, or kNoUvMap. Corners with the same place, normal and
/// UV are one vertex. It has one tangent for all triangles around it that share edges and lie in the map the same way:
/// their directions of u in the plane of its normal, weighed by angle. Triangles without area in the map take what
/// their neighbours have; +x, mirrored, where these have none.
CornerTangents corner_tangents(const Mesh& mesh, int attribute);

/// What materials ask for of a mesh.
struct MeshTangents {
  int attribute = -1;
  bool is_of_original = false;  // as before displacement
  std::shared_ptr<const CornerTangents> corners;
};

size_t memory_bytes(const CornerTangents& tangents);

}  // namespace cistern
