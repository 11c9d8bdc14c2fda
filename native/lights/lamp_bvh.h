#pragma once

#include <bit>
#include <span>
#include <vector>

#include "accel/accel.h"

namespace cistern {

/// Finds the boxes a ray crosses, in no particular order: lamps never block, so all of them are wanted. Nodes have
/// eight children, whose boxes one step of vector instructions tests; a child may be a single item. About 40 bytes for
/// each of many.
class LampBvh {
 public:
  LampBvh() = default;
  /// `bounds[i]` belongs to `items[i]`; items are below 2^31.
  LampBvh(std::span<const Bounds3> bounds, std::span<const uint32_t> items);

  bool is_empty() const { return nodes_.empty(); }
  size_t memory_bytes() const { return nodes_.capacity() * sizeof(Node); }

  /// Calls visit(item) for every item whose box the ray crosses between its ends, and for few others.
  template <class Visit>
  void for_each(const Ray& ray, const Visit& visit) const {
    if (nodes_.empty()) return;
    const Vec3 inverse{1.0f / ray.direction.x, 1.0f / ray.direction.y, 1.0f / ray.direction.z};
    uint32_t stack[kStackSize];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      for (uint32_t crossed = crossed_children(node, ray, inverse); crossed != 0; crossed &= crossed - 1) {
        const uint32_t child = node.child[std::countr_zero(crossed)];
        if ((child & kItemBit) != 0)
          visit(child & ~kItemBit);
        else
          stack[depth++] = child;
      }
    }
  }

 private:
  static constexpr int kWidth = 8;
  static constexpr uint32_t kItemBit = 0x80000000u;
  static constexpr int kStackSize = 96;  // seven wait at each of at most twelve levels

  /// Each coordinate of the children's boxes in a row of its own.
  struct alignas(32) Node {
    float lower[3][kWidth] = {}, upper[3][kWidth] = {};
    uint32_t child[kWidth] = {};  // node, or item | kItemBit
    uint32_t count = 0;           // of children
  };

  /// Bit i stands for child i.
  static uint32_t crossed_children(const Node& node, const Ray& ray, Vec3 inverse_direction);
  struct Boxes;
  uint32_t build(const Boxes& boxes, std::span<uint32_t> order);

  std::vector<Node> nodes_;  // the root first
};

}  // namespace cistern
