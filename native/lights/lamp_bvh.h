#pragma once

#include <span>
#include <vector>

#include "accel/accel.h"

namespace cistern {

/// Finds the boxes a ray crosses, in no particular order: lamps never block, so all of them are wanted. A few boxes
/// make a single leaf, which is a loop over them.
class LampBvh {
 public:
  LampBvh() = default;
  /// `bounds[i]` belongs to `items[i]`.
  LampBvh(std::span<const Bounds3> bounds, std::span<const uint32_t> items);

  bool is_empty() const { return nodes_.empty(); }
  size_t memory_bytes() const { return nodes_.capacity() * sizeof(Node) + items_.capacity() * sizeof(uint32_t); }

  /// Calls visit(item) for every item whose leaf the ray crosses between its ends.
  template <class Visit>
  void for_each(const Ray& ray, const Visit& visit) const {
    if (nodes_.empty()) return;
    const Vec3 inverse{1.0f / ray.direction.x, 1.0f / ray.direction.y, 1.0f / ray.direction.z};
    uint32_t stack[kMaxDepth];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const uint32_t index = stack[--depth];
      const Node& node = nodes_[index];
      if (!crosses(node.box, ray, inverse)) continue;
      for (uint32_t i = node.first; i < node.first + node.count; ++i) visit(items_[i]);
      if (node.count > 0) continue;
      stack[depth++] = node.first;  // the right child
      stack[depth++] = index + 1;
    }
  }

 private:
  struct Node {
    Bounds3 box;
    uint32_t first = 0;  // first item of a leaf, right child of an inner node (the left one follows it)
    uint32_t count = 0;  // items of a leaf, 0 for an inner node
  };
  static constexpr int kMaxDepth = 64;  // the tree is cut in halves: log2 of the count

  static bool crosses(const Bounds3& box, const Ray& ray, Vec3 inverse_direction);
  void build(std::span<const Bounds3> bounds, std::span<const uint32_t> items, std::span<uint32_t> order,
             uint32_t first);

  std::vector<Node> nodes_;
  std::vector<uint32_t> items_;
};

}  // namespace cistern
