#pragma once

#include <functional>

#include "subdivision/limit_surface.h"
#include "subdivision/longest_edge.h"

namespace cistern {

/// How the polygons of a cage are cut into triangles. Points are those of the cage, then others; corners are the points
/// of each square that was cut, one square after the other.
struct DicingPattern {
  std::vector<CagePlace> points, corners;
  std::vector<LimitSurface::Point> limits;  // of the points
  std::vector<TriangleIndices> point_triangles, corner_triangles;
  std::vector<uint32_t> polygons;  // by triangle
  bool is_too_fine = false;        // it would have more triangles than are allowed, and has none
};

/// The same for any number of threads. Once `is_stopped`, if there is such a question, what comes back is of no use.
DicingPattern cut_polygons(const Mesh& mesh, const LimitSurface& surface, const LongestEdge& longest, int most_levels,
                           size_t most_triangles, const std::function<bool()>& is_stopped);

}  // namespace cistern
