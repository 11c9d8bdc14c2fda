#include "scene/triangulate.h"

#include <optional>

#include "base/check.h"
#include "base/parallel.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 1 << 14;  // elements per task
constexpr uint32_t kDropped = UINT32_MAX;

/// Index of the first element in [0, count) for which `is_wrong` holds.
template <class Predicate>
std::optional<size_t> find_first(size_t count, const Predicate& is_wrong) {
  std::vector<size_t> first(block_count(count, kBlockSize), count);
  parallel_blocks(count, kBlockSize, [&](size_t block, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      if (!is_wrong(i)) continue;
      first[block] = i;
      return;
    }
  });
  for (const size_t i : first) {
    if (i < count) return i;
  }
  return {};
}

void check_indices(const std::string& name, const char* what, std::span<const int32_t> indices, size_t limit) {
  const std::optional<size_t> wrong =
      find_first(indices.size(), [&](size_t i) { return indices[i] < 0 || static_cast<size_t>(indices[i]) >= limit; });
  if (!wrong) return;
  throw Error(name, std::string(what) + " " + std::to_string(*wrong) + " is " + std::to_string(indices[*wrong]) +
                        ": must be at least 0 and less than " + std::to_string(limit));
}

void check_offsets(const MeshInput& input) {
  const std::span<const int32_t> offsets = input.polygon_offsets;
  const size_t corners = input.corner_vertices.size();
  if (offsets.front() != 0) {
    throw Error(input.name, "first polygon offset is " + std::to_string(offsets.front()) + ": must be 0");
  }
  const auto decreases = [&](size_t i) { return offsets[i + 1] < offsets[i]; };
  if (const std::optional<size_t> wrong = find_first(offsets.size() - 1, decreases)) {
    throw Error(input.name, "polygon offset " + std::to_string(*wrong + 1) + " is " +
                                std::to_string(offsets[*wrong + 1]) + ": must not be less than the one before, " +
                                std::to_string(offsets[*wrong]));
  }
  if (static_cast<size_t>(offsets.back()) != corners) {
    throw Error(input.name, "last polygon offset is " + std::to_string(offsets.back()) +
                                ": must be the number of corners, " + std::to_string(corners));
  }
  if (!input.triangle_corners.empty()) return;
  const auto is_ngon = [&](size_t i) { return offsets[i + 1] - offsets[i] > 4; };
  if (const std::optional<size_t> ngon = find_first(offsets.size() - 1, is_ngon)) {
    throw Error(input.name, "polygon " + std::to_string(*ngon) + " has " +
                                std::to_string(offsets[*ngon + 1] - offsets[*ngon]) +
                                " corners: more than 4 need a triangulation (triangle_corners)");
  }
}

bool is_usable(Vec3 p) {
  return std::abs(p.x) <= kLargestCoordinate && std::abs(p.y) <= kLargestCoordinate &&
         std::abs(p.z) <= kLargestCoordinate;
}

bool has_area(Vec3 a, Vec3 b, Vec3 c) {
  return is_usable(a) && is_usable(b) && is_usable(c) && cross(b - a, c - a) != Vec3{};
}

/// Whether corners 1 and 3 lie on the same side of the diagonal 0-2.
bool needs_other_diagonal(Vec3 p0, Vec3 p1, Vec3 p2, Vec3 p3) {
  const Vec3 diagonal = p2 - p0;
  return dot(cross(p1 - p0, diagonal), cross(p3 - p0, diagonal)) > 0.0f;
}

/// Writes triangles at fixed places; dropped ones are marked and squeezed out by `compact`.
class Triangulator {
 public:
  Triangulator(const MeshInput& input, bool with_corners, size_t triangle_count, bool with_polygons) : input_(input) {
    result_.vertices.resize(triangle_count);
    if (with_corners) result_.corners.resize(triangle_count);
    if (with_polygons) result_.polygons.resize(triangle_count);
  }

  Vec3 corner_position(uint32_t corner) const { return input_.positions[input_.corner_vertices[corner]]; }

  /// Returns how many triangles were dropped: 0 or 1.
  uint32_t write(size_t triangle, uint32_t polygon, TriangleIndices corners) {
    TriangleIndices vertices;
    for (int k = 0; k < 3; ++k) vertices[k] = static_cast<uint32_t>(input_.corner_vertices[corners[k]]);
    const std::span<const Vec3> p = input_.positions;
    const bool keep = has_area(p[vertices[0]], p[vertices[1]], p[vertices[2]]);
    if (!keep) vertices[0] = kDropped;
    result_.vertices[triangle] = vertices;
    if (!result_.corners.empty()) result_.corners[triangle] = corners;
    if (!result_.polygons.empty()) result_.polygons[triangle] = polygon;
    return keep ? 0 : 1;
  }

  uint32_t write_quad(size_t triangle, uint32_t polygon, uint32_t c) {
    const bool other = needs_other_diagonal(corner_position(c), corner_position(c + 1), corner_position(c + 2),
                                            corner_position(c + 3));
    const TriangleIndices first{c, c + 1, other ? c + 3 : c + 2};
    const TriangleIndices second{other ? c + 1 : c, c + 2, c + 3};
    return write(triangle, polygon, first) + write(triangle + 1, polygon, second);
  }

  Triangulation finish(std::span<const uint32_t> dropped_per_block) {
    uint32_t dropped = 0;
    for (const uint32_t count : dropped_per_block) dropped += count;
    if (dropped > 0) compact();
    result_.dropped = dropped;
    return std::move(result_);
  }

 private:
  void compact() {
    const size_t count = result_.vertices.size();
    const bool is_identity = result_.polygons.empty();
    if (is_identity) result_.polygons.resize(count);
    size_t kept = 0;
    for (size_t i = 0; i < count; ++i) {
      if (result_.vertices[i][0] == kDropped) continue;
      result_.vertices[kept] = result_.vertices[i];
      if (!result_.corners.empty()) result_.corners[kept] = result_.corners[i];
      result_.polygons[kept] = is_identity ? static_cast<uint32_t>(i) : result_.polygons[i];
      ++kept;
    }
    result_.vertices.resize(kept);
    if (!result_.corners.empty()) result_.corners.resize(kept);
    result_.polygons.resize(kept);
  }

  const MeshInput& input_;
  Triangulation result_;
};

/// Triangles given by the caller (`with_polygons`) or polygons that all are triangles.
Triangulation copy_triangles(const MeshInput& input, bool with_corners) {
  const bool is_given = !input.triangle_corners.empty();
  const size_t count = is_given ? input.triangle_polygons.size() : input.corner_vertices.size() / 3;
  Triangulator out(input, with_corners, count, is_given);
  std::vector<uint32_t> dropped(block_count(count, kBlockSize));
  parallel_blocks(count, kBlockSize, [&](size_t block, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      TriangleIndices corners;
      for (size_t k = 0; k < 3; ++k) {
        corners[k] =
            is_given ? static_cast<uint32_t>(input.triangle_corners[3 * i + k]) : static_cast<uint32_t>(3 * i + k);
      }
      const uint32_t polygon = is_given ? static_cast<uint32_t>(input.triangle_polygons[i]) : 0;
      dropped[block] += out.write(i, polygon, corners);
    }
  });
  return out.finish(dropped);
}

Triangulation split_polygons(const MeshInput& input, bool with_corners) {
  const std::span<const int32_t> offsets = input.polygon_offsets;
  const size_t count = offsets.size() - 1;
  const size_t blocks = block_count(count, kBlockSize);
  std::vector<size_t> first_triangle(blocks + 1, 0);
  std::vector<uint32_t> dropped(blocks + 1, 0);
  parallel_blocks(count, kBlockSize, [&](size_t block, size_t begin, size_t end) {
    size_t triangles = 0;
    for (size_t i = begin; i < end; ++i) triangles += static_cast<size_t>(std::max(offsets[i + 1] - offsets[i] - 2, 0));
    first_triangle[block + 1] = triangles;
  });
  for (size_t i = 0; i < blocks; ++i) first_triangle[i + 1] += first_triangle[i];
  Triangulator out(input, with_corners, first_triangle[blocks], true);
  std::vector<uint32_t> empty_polygons(blocks, 0);
  parallel_blocks(count, kBlockSize, [&](size_t block, size_t begin, size_t end) {
    size_t triangle = first_triangle[block];
    for (size_t i = begin; i < end; ++i) {
      const int32_t corners = offsets[i + 1] - offsets[i];
      const uint32_t c = static_cast<uint32_t>(offsets[i]);
      const uint32_t polygon = static_cast<uint32_t>(i);
      if (corners < 3) {
        ++empty_polygons[block];
      } else if (corners == 3) {
        dropped[block] += out.write(triangle++, polygon, {c, c + 1, c + 2});
      } else {
        dropped[block] += out.write_quad(triangle, polygon, c);
        triangle += 2;
      }
    }
  });
  Triangulation result = out.finish(dropped);
  for (const uint32_t n : empty_polygons) result.dropped += n;
  return result;
}

}  // namespace

size_t polygon_count(const MeshInput& input) {
  return input.polygon_offsets.empty() ? input.corner_vertices.size() / 3 : input.polygon_offsets.size() - 1;
}

void check_topology(const MeshInput& input) {
  check_indices(input.name, "vertex of corner", input.corner_vertices, input.positions.size());
  if (!input.polygon_offsets.empty()) {
    check_offsets(input);
  } else if (input.corner_vertices.size() % 3 != 0) {
    throw Error(input.name, "has " + std::to_string(input.corner_vertices.size()) +
                                " corners: must be a multiple of 3 without polygon offsets");
  }
  if (input.triangle_corners.size() != 3 * input.triangle_polygons.size()) {
    throw Error(input.name, "has " + std::to_string(input.triangle_corners.size()) + " triangle corners for " +
                                std::to_string(input.triangle_polygons.size()) + " triangles: must be 3 each");
  }
  check_indices(input.name, "triangle corner", input.triangle_corners, input.corner_vertices.size());
  check_indices(input.name, "polygon of triangle", input.triangle_polygons, polygon_count(input));
}

Triangulation triangulate(const MeshInput& input, bool with_corners) {
  const std::span<const int32_t> offsets = input.polygon_offsets;
  const auto is_no_triangle = [&](size_t i) { return offsets[i + 1] - offsets[i] != 3; };
  const bool are_given = !input.triangle_corners.empty() || offsets.empty();
  if (are_given || !find_first(offsets.size() - 1, is_no_triangle)) return copy_triangles(input, with_corners);
  return split_polygons(input, with_corners);
}

}  // namespace cistern
