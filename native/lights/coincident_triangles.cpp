#include "lights/coincident_triangles.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <utility>

#include "base/hash.h"
#include "base/parallel.h"
#include "shading/material.h"
#include "shading/mesh_interpolation.h"

namespace cistern {

namespace {

/// Where a triangle lies: its corners in the world, in the order of their coordinates, and whether that turns its
/// winding over. Exact, other than the sums of p0 and edges, which depend on the corner that is p0.
struct Place {
  std::array<Vec3, 3> corners;
  std::array<size_t, 3> order{0, 1, 2};  // which corners of the triangle they are
  bool is_turned = false;

  /// `weights` of the corners, as barycentric coordinates of the triangle.
  Vec2 barycentric(std::array<float, 3> weights) const {
    std::array<float, 3> own{};
    for (size_t i = 0; i < 3; ++i) own[order[i]] = weights[i];
    return {own[1], own[2]};
  }
};

Place place_of(const Scene& scene, const EmissiveTriangle& t) {
  const Instance& instance = scene.instances[t.instance];
  Place place{scene.meshes[static_cast<size_t>(instance.mesh)]->triangle_positions(t.triangle)};
  auto& corners = place.corners;
  for (Vec3& corner : corners) corner = instance.object_to_world.point(corner);
  for (const auto& [i, k] : {std::pair{0u, 1u}, {1u, 2u}, {0u, 1u}}) {
    const Vec3 &a = corners[i], &b = corners[k];
    if (std::array{a.x, a.y, a.z} <= std::array{b.x, b.y, b.z}) continue;
    std::swap(corners[i], corners[k]);
    std::swap(place.order[i], place.order[k]);
    place.is_turned = !place.is_turned;
  }
  return place;
}

uint64_t hash_of(const Place& place) {
  uint64_t hash = 0;
  for (const Vec3& corner : place.corners) {
    for (const float coordinate : {corner.x, corner.y, corner.z})
      hash = hash_combine(hash, std::bit_cast<uint32_t>(coordinate + 0.0f));  // -0 is 0
  }
  return hash;
}

/// What leaves a point along a direction that is `along` the winding or against it.
Rgb emission_at(const Scene& scene, const EmissiveTriangle& t, Vec2 barycentric, bool along) {
  const Vec3 normal = normalize_or(t.scaled_normal(), {0.0f, 0.0f, 1.0f}), wo = along ? normal : -normal;
  // A hit's normal is on the object's outside, which mirroring leaves where it was.
  const bool is_mirrored = scene.instances[t.instance].object_to_world.determinant() < 0.0f;
  const Hit hit{1.0f, barycentric.x, barycentric.y, is_mirrored ? -normal : normal, t.instance, t.triangle};
  PathState path;
  path.ray_kind = kVisibleToDiffuse;
  return evaluate_emission(scene, make_surface_point(scene, Ray{t.point(barycentric) + wo, -wo}, hit), path);
}

Vec3 uv_at(const Scene& scene, const EmissiveTriangle& t, Vec2 barycentric) {
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(scene.instances[t.instance].mesh)];
  const int map = mesh.first_uv_map();
  return map < 0 ? Vec3{} : interpolate_attribute(mesh, t.triangle, barycentric, map).value;
}

bool is_close(Vec3 a, Vec3 b) {
  constexpr float kRounding = 1e-6f;  // of squares
  return length_squared(a - b) <= kRounding * std::max(length_squared(a), length_squared(b));
}

bool look_alike(const Scene& scene, const EmissiveTriangle& a, const Place& place_of_a, const EmissiveTriangle& b,
                const Place& place_of_b) {
  constexpr std::array<std::array<float, 3>, 4> kPoints{
      {{0.34f, 0.33f, 0.33f}, {0.8f, 0.1f, 0.1f}, {0.1f, 0.8f, 0.1f}, {0.1f, 0.1f, 0.8f}}};
  const bool is_opposite = place_of_a.is_turned != place_of_b.is_turned;
  return std::ranges::all_of(kPoints, [&](const std::array<float, 3>& weights) {
    const Vec2 in_a = place_of_a.barycentric(weights), in_b = place_of_b.barycentric(weights);
    if (!is_close(uv_at(scene, a, in_a), uv_at(scene, b, in_b))) return false;
    const auto is_same_from = [&](bool along) {
      return is_close(to_vec(emission_at(scene, a, in_a, along)),
                      to_vec(emission_at(scene, b, in_b, along != is_opposite)));
    };
    return is_same_from(true) && is_same_from(false);
  });
}

bool are_alike(const Scene& scene, const EmissiveTriangle& a, const EmissiveTriangle& b,
               std::span<const SideEmission> uniform) {
  const Place place_of_a = place_of(scene, a), place_of_b = place_of(scene, b);
  if (place_of_a.corners != place_of_b.corners) return false;
  const Instance &of_a = scene.instances[a.instance], &of_b = scene.instances[b.instance];
  if (of_a.visibility != of_b.visibility || of_a.links != of_b.links) return false;
  if (of_a.light_group != of_b.light_group) return false;
  if (a.uniform < 0 || b.uniform < 0)
    return a.material == b.material && look_alike(scene, a, place_of_a, b, place_of_b);
  SideEmission sides = uniform[static_cast<size_t>(b.uniform)];
  if (place_of_a.is_turned != place_of_b.is_turned) std::swap(sides.along_normal, sides.against_normal);
  return uniform[static_cast<size_t>(a.uniform)] == sides;
}

}  // namespace

std::vector<uint32_t> find_coincident_triangles(const Scene& scene, std::span<const EmissiveTriangle> triangles,
                                                std::span<const SideEmission> uniform) {
  constexpr size_t kBlockSize = 4096;
  constexpr size_t kMostAlone = 16;  // in one place, that others are compared with
  struct Item {
    uint64_t hash;
    uint32_t index;
    auto operator<=>(const Item&) const = default;  // NOLINT(modernize-use-nullptr)
  };
  std::vector<Item> items(triangles.size());
  parallel_blocks(items.size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) items[i] = {hash_of(place_of(scene, triangles[i])), static_cast<uint32_t>(i)};
  });
  tbb::parallel_sort(items);

  std::vector<uint32_t> first;
  std::vector<uint32_t> alone;  // of one hash
  for (size_t begin = 0, end = 0; begin < items.size(); begin = end) {
    alone.clear();
    for (; end < items.size() && items[end].hash == items[begin].hash; ++end) {
      const uint32_t later = items[end].index;
      const auto same = std::ranges::find_if(
          alone, [&](uint32_t earlier) { return are_alike(scene, triangles[earlier], triangles[later], uniform); });
      if (same == alone.end()) {
        if (alone.size() < kMostAlone) alone.push_back(later);
        continue;
      }
      if (first.empty()) {
        first.resize(triangles.size());
        std::iota(first.begin(), first.end(), 0u);
      }
      first[later] = *same;
    }
  }
  return first;
}

}  // namespace cistern
