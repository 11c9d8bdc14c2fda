#include "lights/lamp_bvh.h"

#include <numeric>

namespace cistern {

namespace {

constexpr size_t kLeafSize = 4;
/// Boxes count as this much larger, relative to the distances involved, so that rounding loses no lamp.
constexpr float kSlabSlack = 1e-5f;

}  // namespace

LampBvh::LampBvh(std::span<const Bounds3> bounds, std::span<const uint32_t> items) : items_(items.size()) {
  if (items.empty()) return;
  std::vector<uint32_t> order(items.size());
  std::iota(order.begin(), order.end(), 0u);
  build(bounds, items, order, 0);
}

void LampBvh::build(std::span<const Bounds3> bounds, std::span<const uint32_t> items, std::span<uint32_t> order,
                    uint32_t first) {
  const size_t self = nodes_.size();
  nodes_.emplace_back();
  Bounds3 centers;
  for (const uint32_t i : order) {
    nodes_[self].box.extend(bounds[i]);
    centers.extend(bounds[i].center());
  }
  if (order.size() <= kLeafSize) {
    nodes_[self].first = first;
    nodes_[self].count = static_cast<uint32_t>(order.size());
    for (size_t i = 0; i < order.size(); ++i) items_[first + i] = items[order[i]];
    return;
  }
  const Vec3 d = centers.diagonal();
  const int axis = d.x >= d.y && d.x >= d.z ? 0 : (d.y >= d.z ? 1 : 2);
  const size_t half = order.size() / 2;
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                   [&](uint32_t a, uint32_t b) {
                     const float ca = bounds[a].center()[axis], cb = bounds[b].center()[axis];
                     return ca < cb || (ca == cb && a < b);
                   });
  build(bounds, items, order.first(half), first);
  nodes_[self].first = static_cast<uint32_t>(nodes_.size());
  build(bounds, items, order.subspan(half), first + static_cast<uint32_t>(half));
}

bool LampBvh::crosses(const Bounds3& box, const Ray& ray, Vec3 inverse_direction) {
  const Vec3 a = (box.lower - ray.origin) * inverse_direction, b = (box.upper - ray.origin) * inverse_direction;
  // An axis along which the ray does not move and on whose slab face it lies gives NaN, which min and max drop when it
  // stands second.
  float enter = ray.t_min, leave = ray.t_max;
  for (int axis = 0; axis < 3; ++axis) {
    enter = std::max(enter, std::min(a[axis], b[axis]));
    leave = std::min(leave, std::max(a[axis], b[axis]));
  }
  const float slack = kSlabSlack * std::max(std::abs(enter), length(ray.origin - box.center()));
  return enter <= leave + slack;
}

}  // namespace cistern
