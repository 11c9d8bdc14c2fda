#include "subdivision/safe_creases.h"

#include <algorithm>
#include <numeric>
#include <span>

namespace cistern {
namespace {

using Edge = std::array<uint32_t, 2>;  // the smaller point first

/// By edge of the cage, in order, each as often as polygons have it.
std::vector<Edge> sorted_edges(const SubdivisionCage& cage) {
  std::vector<Edge> edges;
  edges.reserve(cage.vertices.size());
  for (size_t polygon = 0; polygon < cage.polygon_count(); ++polygon) {
    const uint32_t first = cage.offsets[polygon], size = cage.size(polygon);
    for (uint32_t i = 0; i < size; ++i) {
      const auto [a, b] = std::minmax(cage.vertices[first + i], cage.vertices[first + (i + 1) % size]);
      edges.push_back({a, b});
    }
  }
  std::ranges::sort(edges);
  return edges;
}

struct Points {
  std::vector<uint8_t> edges;  // up to three
  std::vector<char> is_on_boundary;

  explicit Points(const SubdivisionCage& cage)
      : edges(1 + *std::ranges::max_element(cage.vertices)), is_on_boundary(edges.size()) {
    const std::vector<Edge> all = sorted_edges(cage);
    for (auto edge = all.begin(); edge != all.end();) {
      const auto end = std::upper_bound(edge, all.end(), *edge);
      for (const uint32_t point : *edge) {
        edges[point] = static_cast<uint8_t>(std::min(edges[point] + 1, 3));
        if (end - edge == 1) is_on_boundary[point] = 1;
      }
      edge = end;
    }
  }
  bool is_between_two(uint32_t point) const { return edges[point] == 2 && !is_on_boundary[point]; }
};

}  // namespace

std::vector<size_t> safe_creases(const SubdivisionCage& cage) {
  std::vector<size_t> safe(cage.creases.size());
  std::iota(safe.begin(), safe.end(), size_t{0});
  if (safe.empty() || cage.vertices.empty()) return safe;
  const Points points(cage);
  std::vector<char> is_of_unsafe_polygon(points.edges.size());
  for (size_t polygon = 0; polygon < cage.polygon_count(); ++polygon) {
    const std::span<const uint32_t> corners(cage.vertices.data() + cage.offsets[polygon], cage.size(polygon));
    const bool is_safe = std::ranges::none_of(corners, [&](uint32_t i) { return points.is_between_two(i); }) ||
                         std::ranges::none_of(corners, [&](uint32_t i) { return points.is_on_boundary[i] != 0; });
    if (is_safe) continue;
    for (const uint32_t i : corners) is_of_unsafe_polygon[i] = 1;
  }
  const auto is_unsafe = [&](uint32_t point) {
    return point < is_of_unsafe_polygon.size() && is_of_unsafe_polygon[point] != 0;
  };
  std::erase_if(safe, [&](size_t i) { return is_unsafe(cage.creases[i][0]) || is_unsafe(cage.creases[i][1]); });
  return safe;
}

}  // namespace cistern
