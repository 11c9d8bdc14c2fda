#include "lights/lamp_bvh.h"

#include <algorithm>
#include <numeric>

namespace cistern {

namespace {

constexpr int kHalvings = 3;  // of what a node holds: eight children
/// Boxes count as this much larger, relative to the distances involved, so that rounding loses no lamp.
constexpr float kSlabSlack = 1e-5f;

using Parts = std::vector<std::span<uint32_t>>;

/// Halves by the widest axis of the boxes' centers, first parts in whole nodes, until they fit a node.
void divide(std::span<const Bounds3> bounds, std::span<uint32_t> order, size_t node_size, int halvings, Parts& parts) {
  if (halvings == 0 || order.size() <= node_size) {
    parts.push_back(order);
    return;
  }
  Bounds3 centers;
  for (const uint32_t i : order) centers.extend(bounds[i].center());
  const Vec3 d = centers.diagonal();
  const int axis = d.x >= d.y && d.x >= d.z ? 0 : (d.y >= d.z ? 1 : 2);
  const size_t half = (order.size() / 2 + node_size - 1) / node_size * node_size;
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                   [&](uint32_t a, uint32_t b) {
                     const float ca = bounds[a].center()[axis], cb = bounds[b].center()[axis];
                     return ca < cb || (ca == cb && a < b);
                   });
  divide(bounds, order.first(half), node_size, halvings - 1, parts);
  divide(bounds, order.subspan(half), node_size, halvings - 1, parts);
}

}  // namespace

struct LampBvh::Boxes {
  std::span<const Bounds3> bounds;
  std::span<const uint32_t> items;
};

LampBvh::LampBvh(std::span<const Bounds3> bounds, std::span<const uint32_t> items) {
  if (items.empty()) return;
  std::vector<uint32_t> order(items.size());
  std::iota(order.begin(), order.end(), 0u);
  build({bounds, items}, order);
  nodes_.shrink_to_fit();
}

uint32_t LampBvh::build(const Boxes& boxes, std::span<uint32_t> order) {
  const auto self = static_cast<uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Parts parts;
  if (order.size() <= kWidth) {
    for (size_t i = 0; i < order.size(); ++i) parts.push_back(order.subspan(i, 1));
  } else {
    divide(boxes.bounds, order, kWidth, kHalvings, parts);
  }
  nodes_[self].count = static_cast<uint32_t>(parts.size());
  for (size_t c = 0; c < parts.size(); ++c) {
    Bounds3 box;
    for (const uint32_t i : parts[c]) box.extend(boxes.bounds[i]);
    const uint32_t child = parts[c].size() == 1 ? boxes.items[parts[c].front()] | kItemBit : build(boxes, parts[c]);
    nodes_[self].child[c] = child;
    for (int axis = 0; axis < 3; ++axis) {
      nodes_[self].lower[axis][c] = box.lower[axis];
      nodes_[self].upper[axis][c] = box.upper[axis];
    }
  }
  return self;
}

uint32_t LampBvh::crossed_children(const Node& node, const Ray& ray, Vec3 inverse_direction) {
  alignas(32) uint32_t is_crossed[kWidth];
  for (int i = 0; i < kWidth; ++i) {
    float enter = ray.t_min, leave = ray.t_max, away = 0.0f;
    const auto cut = [&](const float* lower, const float* upper, float origin, float inverse) {
      const float low = lower[i] - origin, high = upper[i] - origin;
      const float a = low * inverse, b = high * inverse;
      // An axis along which the ray does not move and on whose slab face it lies gives NaN, which comparisons drop.
      const float first = b < a ? b : a, last = a < b ? b : a;
      enter = enter < first ? first : enter;
      leave = last < leave ? last : leave;
      away += 0.5f * std::abs(low + high);
    };
    cut(node.lower[0], node.upper[0], ray.origin.x, inverse_direction.x);
    cut(node.lower[1], node.upper[1], ray.origin.y, inverse_direction.y);
    cut(node.lower[2], node.upper[2], ray.origin.z, inverse_direction.z);
    const float reach = std::abs(enter) < away ? away : std::abs(enter);
    is_crossed[i] = enter <= leave + kSlabSlack * reach ? 1u << i : 0u;
  }
  uint32_t crossed = 0;
  for (int i = 0; i < kWidth; ++i) crossed |= is_crossed[i];
  return crossed & ((1u << node.count) - 1u);
}

}  // namespace cistern
