#include "lights/coincident_triangles.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <utility>

#include "base/hash.h"
#include "base/parallel.h"

namespace cistern {

namespace {

/// Where a triangle lies: its corners in the world, in the order of their coordinates, and whether that turns its
/// winding over. Exact, other than the sums of p0 and edges, which depend on the corner that is p0.
struct Place {
  std::array<Vec3, 3> corners;
  bool is_turned = false;
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

bool are_alike(const Scene& scene, const EmissiveTriangle& a, const EmissiveTriangle& b,
               std::span<const SideEmission> uniform) {
  const Place place_of_a = place_of(scene, a), place_of_b = place_of(scene, b);
  if (place_of_a.corners != place_of_b.corners) return false;
  const Instance &of_a = scene.instances[a.instance], &of_b = scene.instances[b.instance];
  if (of_a.visibility != of_b.visibility || of_a.links != of_b.links) return false;
  const bool is_opposite = place_of_a.is_turned != place_of_b.is_turned;
  if (a.uniform < 0 || b.uniform < 0) return !is_opposite && a.material == b.material;
  SideEmission sides = uniform[static_cast<size_t>(b.uniform)];
  if (is_opposite) std::swap(sides.along_normal, sides.against_normal);
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
    auto operator<=>(const Item&) const = default;
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
