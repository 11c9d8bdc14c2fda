#include "scene/corner_tangents.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "base/parallel.h"

namespace cistern {
namespace {

constexpr uint32_t kNone = 0xffffffffu;
constexpr size_t kBlockSize = 1 << 12;  // triangles per task

bool is_zero(float x) { return !(std::abs(x) > std::numeric_limits<float>::min()); }  // or not a number

Vec3 unit_or_zero(Vec3 v) {
  const float square = dot(v, v);
  return is_zero(square) || !std::isfinite(square) ? Vec3{} : v * (1.0f / std::sqrt(square));
}

Vec3 in_plane(Vec3 v, Vec3 normal) { return unit_or_zero(v - dot(normal, v) * normal); }

/// See kNoUvMap.
Vec2 place_on_sphere(Vec3 p) {
  const float distance = length(p);
  if (!(distance > 0.0f)) return {};
  const float longitude = p.x == 0.0f && p.y == 0.0f ? kPi : std::atan2(p.x, p.y);
  return {0.5f * (1.0f - longitude / kPi), 1.0f - std::acos(std::clamp(p.z / distance, -1.0f, 1.0f)) / kPi};
}

/// What makes corners one vertex.
struct Corner {
  Vec3 position, normal;
  Vec2 uv;
  friend bool operator==(const Corner&, const Corner&) = default;

  uint64_t hash() const {
    uint64_t h = 0;
    for (const float x : {position.x, position.y, position.z, normal.x, normal.y, normal.z, uv.x, uv.y}) {
      h = (h ^ std::bit_cast<uint32_t>(x + 0.0f)) * 0x9e3779b97f4a7c15u;  // -0 is 0
      h ^= h >> 29;
    }
    return h;
  }
};

/// Corner j of triangle t is number 3 t + j, and so is the edge from it to the next.
uint32_t triangle_of(uint32_t corner) { return corner / 3; }
uint32_t next_in_triangle(uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
uint32_t previous_in_triangle(uint32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

class TangentFinder {
 public:
  TangentFinder(const Mesh& mesh, int attribute)
      : mesh_(mesh),
        map_(attribute == kNoUvMap ? nullptr : &mesh.attributes[static_cast<size_t>(attribute)]),
        corners_(3 * mesh.triangle_count()) {}

  CornerTangents run() {
    read_corners();
    weld();
    find_directions();
    find_neighbours();
    group_corners();
    return mean_directions();
  }

 private:
  size_t triangle_count() const { return mesh_.triangle_count(); }

  template <class Body>
  void for_each_triangle(const Body& body) const {
    parallel_blocks(triangle_count(), kBlockSize, [&](size_t, size_t first, size_t last) {
      for (size_t t = first; t < last; ++t) body(t);
    });
  }

  void read_corners() {
    for_each_triangle([&](size_t i) {
      const auto t = static_cast<uint32_t>(i);
      const std::array<Vec3, 3> p = mesh_.triangle_positions(t);
      std::array<Vec3, 3> normals;
      normals.fill(unit_or_zero(cross(p[1] - p[0], p[2] - p[0])));
      if (!mesh_.is_flat(t)) {
        const TriangleIndices e = mesh_.elements(t, mesh_.normals_domain);
        for (size_t j = 0; j < 3; ++j) normals[j] = decode_octahedral(mesh_.normals[e[j]]);
      }
      for (size_t j = 0; j < 3; ++j) corners_[3 * i + j] = {p[j], normals[j], map_ ? uv(t, j) : place_on_sphere(p[j])};
    });
  }

  Vec2 uv(uint32_t t, size_t j) const {
    const float* values =
        map_->values.get() + static_cast<size_t>(map_->components) * mesh_.elements(t, map_->domain)[j];
    return {values[0], values[1]};
  }

  /// Gives equal corners one vertex, the first of them.
  void weld() {
    vertices_.resize(corners_.size());
    const size_t mask = std::bit_ceil(2 * corners_.size() + 1) - 1;
    std::vector<uint32_t> table(mask + 1, kNone), latest(mesh_.positions.size(), kNone);
    for (uint32_t c = 0; c < corners_.size(); ++c) {
      uint32_t& at_point = latest[mesh_.vertices[triangle_of(c)][c % 3]];  // most corners of a point are one vertex
      if (at_point != kNone && corners_[at_point] == corners_[c]) {
        vertices_[c] = at_point;
        continue;
      }
      size_t slot = corners_[c].hash() & mask;
      while (table[slot] != kNone && !(corners_[table[slot]] == corners_[c])) slot = (slot + 1) & mask;
      if (table[slot] == kNone) table[slot] = c;
      vertices_[c] = at_point = table[slot];
    }
  }

  /// In the map. Longitudes go on around the object, up to half of a turn back.
  Vec2 step(Vec2 from, Vec2 to) const {
    const Vec2 d = to - from;
    return {map_ ? d.x : d.x - std::floor(d.x + 0.5f), d.y};
  }

  void find_directions() {
    directions_.resize(triangle_count());
    is_mirrored_.resize(triangle_count());
    has_no_area_.resize(triangle_count());
    for_each_triangle([&](size_t t) {
      const Corner &a = corners_[3 * t], &b = corners_[3 * t + 1], &c = corners_[3 * t + 2];
      const Vec3 edge_1 = b.position - a.position, edge_2 = c.position - a.position;
      const Vec2 duv_1 = step(a.uv, b.uv), duv_2 = step(a.uv, c.uv);
      const float area = duv_1.x * duv_2.y - duv_1.y * duv_2.x;
      const Vec3 dp_du = duv_2.y * edge_1 - duv_1.y * edge_2, dp_dv = duv_1.x * edge_2 - duv_2.x * edge_1;
      is_mirrored_[t] = !(area > 0.0f);
      const Vec3 direction = unit_or_zero(dp_du);
      has_no_area_[t] = is_zero(area) || direction == Vec3{} || unit_or_zero(dp_dv) == Vec3{};
      directions_[t] = is_mirrored_[t] ? -direction : direction;
    });
  }

  uint32_t lower_end(uint32_t edge) const { return std::min(vertices_[edge], vertices_[next_in_triangle(edge)]); }
  uint32_t upper_end(uint32_t edge) const { return std::max(vertices_[edge], vertices_[next_in_triangle(edge)]); }

  void find_neighbours() {
    opposite_edges_.assign(corners_.size(), kNone);
    std::vector<uint32_t> ends(corners_.size() + 1), edges(corners_.size());  // of the edges of each lower end
    for (uint32_t e = 0; e < corners_.size(); ++e) ++ends[lower_end(e) + 1];
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    for (uint32_t e = 0; e < corners_.size(); ++e) edges[ends[lower_end(e)]++] = e;
    parallel_blocks(corners_.size(), kBlockSize, [&](size_t, size_t first, size_t last) {
      for (size_t v = first; v < last; ++v) {
        const uint32_t begin = v == 0 ? 0 : ends[v - 1];
        pair_edges({edges.data() + begin, ends[v] - begin});
      }
    });
  }

  /// Of one lower end. Edges meet in pairs that run against each other; of more than two along a line, in their order.
  void pair_edges(std::span<uint32_t> edges) {
    std::ranges::sort(edges, {}, [&](uint32_t e) { return std::pair(upper_end(e), e); });
    size_t waiting = 0;  // the first that has no opposite one yet
    for (size_t i = 0; i < edges.size(); ++i) {
      const uint32_t e = edges[i];
      while (waiting < i && (upper_end(edges[waiting]) != upper_end(e) || opposite_edges_[edges[waiting]] != kNone))
        ++waiting;
      const uint32_t other = edges[waiting];
      if (waiting == i || vertices_[other] == vertices_[e]) continue;
      opposite_edges_[e] = other;
      opposite_edges_[other] = e;
    }
  }

  void group_corners() {
    groups_.assign(corners_.size(), kNone);
    is_placed_.assign(triangle_count(), false);
    for (uint32_t c = 0; c < corners_.size(); ++c)
      if (!has_no_area_[triangle_of(c)] && groups_[c] == kNone) gather_group(c);
  }

  /// All corners at its vertex that edges lead to.
  void gather_group(uint32_t first) {
    const uint8_t is_mirrored = is_mirrored_[triangle_of(first)];
    to_visit_.assign(1, first);
    while (!to_visit_.empty()) {
      const uint32_t c = to_visit_.back(), t = triangle_of(c);
      to_visit_.pop_back();
      if (groups_[c] != kNone) continue;
      if (has_no_area_[t] && !is_placed_[t]) is_mirrored_[t] = is_mirrored;
      if (is_mirrored_[t] != is_mirrored) continue;
      is_placed_[t] = true;
      groups_[c] = first;
      // The edge after a corner starts at it, and the opposite one ends there; the edge before it the other way round.
      if (const uint32_t e = opposite_edges_[c]; e != kNone) to_visit_.push_back(next_in_triangle(e));
      if (const uint32_t e = opposite_edges_[previous_in_triangle(c)]; e != kNone) to_visit_.push_back(e);
    }
  }

  /// What a triangle adds at a corner.
  Vec3 share(uint32_t c) const {
    const Corner& corner = corners_[c];
    const Vec3 to_next = in_plane(corners_[next_in_triangle(c)].position - corner.position, corner.normal);
    const Vec3 to_previous = in_plane(corners_[previous_in_triangle(c)].position - corner.position, corner.normal);
    const float angle = std::acos(std::clamp(dot(to_next, to_previous), -1.0f, 1.0f));
    return angle * in_plane(directions_[triangle_of(c)], corner.normal);
  }

  CornerTangents mean_directions() const {
    std::vector<Vec3> shares(corners_.size()), sums(corners_.size());  // by corner, by the first corner of a group
    for_each_triangle([&](size_t t) {
      if (!has_no_area_[t])
        for (uint32_t c = static_cast<uint32_t>(3 * t); c < 3 * t + 3; ++c) shares[c] = share(c);
    });
    for (size_t c = 0; c < shares.size(); ++c)
      if (groups_[c] != kNone) sums[groups_[c]] += shares[c];
    CornerTangents result;
    result.directions.resize(triangle_count());
    result.mirrored.resize(triangle_count());
    for_each_triangle([&](size_t t) {
      for (size_t j = 0; j < 3; ++j) {
        const uint32_t group = groups_[3 * t + j];
        const Vec3 sum = group == kNone ? Vec3{} : sums[group];
        result.directions[t][j] = encode_octahedral(normalize_or(sum, {1.0f, 0.0f, 0.0f}));
        if (group == kNone || is_mirrored_[t]) result.mirrored[t] |= static_cast<uint8_t>(1u << j);
      }
    });
    return result;
  }

  const Mesh& mesh_;
  const MeshAttribute* map_;  // null: kNoUvMap
  std::vector<Corner> corners_;
  std::vector<uint32_t> vertices_;  // by corner
  // By triangle:
  std::vector<Vec3> directions_;
  std::vector<uint8_t> is_mirrored_, has_no_area_, is_placed_;
  std::vector<uint32_t> opposite_edges_;  // by edge; kNone: a border
  std::vector<uint32_t> groups_;          // by corner: the first of its group
  std::vector<uint32_t> to_visit_;
};

}  // namespace

Vec3 CornerTangents::tangent(uint32_t triangle, Vec2 barycentric) const {
  const std::array<uint32_t, 3>& d = directions[triangle];
  const float w = 1.0f - barycentric.x - barycentric.y;
  return w * decode_octahedral(d[0]) + barycentric.x * decode_octahedral(d[1]) +
         barycentric.y * decode_octahedral(d[2]);
}

float CornerTangents::handedness(uint32_t triangle, Vec2 barycentric) const {
  const uint32_t bits = mirrored[triangle];
  if (bits == 0) return 1.0f;
  if (bits == 7) return -1.0f;
  const auto sign = [&](uint32_t j) { return (bits >> j & 1u) != 0 ? -1.0f : 1.0f; };
  return (1.0f - barycentric.x - barycentric.y) * sign(0) + barycentric.x * sign(1) + barycentric.y * sign(2);
}

CornerTangents corner_tangents(const Mesh& mesh, int attribute) { return TangentFinder(mesh, attribute).run(); }

size_t memory_bytes(const CornerTangents& tangents) {
  return tangents.directions.capacity() * sizeof(tangents.directions[0]) + tangents.mirrored.capacity();
}

}  // namespace cistern
