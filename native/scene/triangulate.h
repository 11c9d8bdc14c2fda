#pragma once

#include <vector>

#include "scene/mesh.h"
#include "scene/scene_builder.h"

namespace cistern {

/// Triangles of a polygon mesh. Each one has finite corners and an area.
struct Triangulation {
  std::vector<TriangleIndices> vertices;  // indices into the positions
  std::vector<TriangleIndices> corners;   // indices into the corners; empty unless asked for
  std::vector<uint32_t> polygons;         // empty where triangle i is polygon i
  uint32_t dropped = 0;                   // triangles left out, and polygons with fewer than three corners
};

/// Largest coordinate the ray tracer can work with; anything beyond it counts as not finite.
inline constexpr float kLargestCoordinate = 1e18f;

/// Polygons of the input: by its offsets, or one per three corners.
size_t polygon_count(const MeshInput& input);

/// Throws Error naming the mesh, the element and the value where an index, an offset or the length of an array is
/// wrong.
void check_topology(const MeshInput& input);

/// Splits polygons as Blender does: a quad along its first diagonal unless its other two corners lie on the same side
/// of it (then it is concave or twisted, and the other diagonal is taken). `input` has passed `check_topology`.
Triangulation triangulate(const MeshInput& input, bool with_corners);

}  // namespace cistern
