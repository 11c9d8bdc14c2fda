#include <tbb/parallel_for.h>

#include <array>

#include "lights/light_tree.h"

namespace cistern {

namespace {

using Node = LightTree::Node;
constexpr int kWidth = LightTree::kWidth;
constexpr int kBins = 12;                   // per axis, as in the paper
constexpr size_t kParallelItems = 1 << 14;  // subtrees of larger ranges are built in parallel

/// What splitting needs to know of an emitter, moved about as a whole.
struct Item {
  Vec3 center;
  float intensity;
  Vec3 axis;
  uint32_t emitter;
};

/// Running summary of a set of items. Emitter normals are summed as vectors: the length of the sum tells how widely
/// they scatter, for a fraction of the cost of merging cones (which the finished nodes do exactly).
struct Summary {
  Bounds3 centers;
  Vec3 axis_sum;
  float intensity = 0.0f;
  uint32_t count = 0;

  void add(const Item& item) {
    centers.extend(item.center);
    axis_sum += item.axis;
    intensity += item.intensity;
    ++count;
  }
  void add(const Summary& other) {
    centers.extend(other.centers);
    axis_sum += other.axis_sum;
    intensity += other.intensity;
    count += other.count;
  }
  /// Surface area orientation heuristic of the paper (Eq. 1 and §4.2) with the squared diagonal for the area, which
  /// does not vanish for emitters in a row, and a linear stand-in for the solid angle of the emission.
  float cost() const {
    if (count == 0) return 0.0f;
    const float scatter = 1.0f - length(axis_sum) / static_cast<float>(count);
    return intensity * length_squared(centers.diagonal()) * (1.0f + 3.0f * scatter);
  }
};

struct Range {
  Item* begin;
  Item* end;
  Summary summary;
  size_t size() const { return static_cast<size_t>(end - begin); }
};

Range make_range(Item* begin, Item* end) {
  Range range{begin, end, {}};
  for (const Item* item = begin; item != end; ++item) range.summary.add(*item);
  return range;
}

struct Split {
  int axis = -1;  // -1: all centres coincide
  int bin = 0;    // items of bins up to this one go left
  float cost = INFINITY;
};

/// Bin of a coordinate along an axis of the bounds of the centres.
struct Binning {
  float lower, scale;
  Binning(const Bounds3& b, int axis)
      : lower(b.lower[axis]), scale(kBins / std::max(b.diagonal()[axis], std::numeric_limits<float>::min())) {}
  int operator()(float coordinate) const { return std::min(static_cast<int>((coordinate - lower) * scale), kBins - 1); }
};

Split best_split_along(const Range& range, int axis) {
  const Binning bin_of(range.summary.centers, axis);
  std::array<Summary, kBins> bins;
  for (const Item* item = range.begin; item != range.end; ++item) bins[bin_of(item->center[axis])].add(*item);
  std::array<float, kBins> cost_above{};
  Summary above;
  for (int i = kBins - 1; i > 0; --i) {
    above.add(bins[i]);
    cost_above[i] = above.cost();
  }
  // Flat boxes would hide how long the split axis is: the paper's regularisation of thin clusters.
  const Vec3 d = range.summary.centers.diagonal();
  const float thinness = std::max(d.x, std::max(d.y, d.z)) / d[axis];
  Split best;
  Summary below;
  for (int i = 0; i < kBins - 1; ++i) {
    below.add(bins[i]);
    if (below.count == 0 || below.count == range.summary.count) continue;
    const float cost = thinness * (below.cost() + cost_above[i + 1]);
    if (cost < best.cost) best = {axis, i, cost};
  }
  return best;
}

/// Cuts a range of at least two items in two non-empty ones.
std::array<Range, 2> cut(const Range& range) {
  Split best;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(range.summary.centers.diagonal()[axis] > 0.0f)) continue;
    const Split split = best_split_along(range, axis);
    if (split.cost < best.cost) best = split;
  }
  Item* middle = range.begin + range.size() / 2;
  if (best.axis >= 0) {
    const Binning bin_of(range.summary.centers, best.axis);
    middle = std::partition(range.begin, range.end,
                            [&](const Item& item) { return bin_of(item.center[best.axis]) <= best.bin; });
  }
  return {make_range(range.begin, middle), make_range(middle, range.end)};
}

/// Up to eight parts of a range: the costliest is cut until there are enough.
std::vector<Range> divide(const Range& range) {
  std::vector<Range> parts;
  if (range.size() <= kWidth) {
    for (Item* item = range.begin; item != range.end; ++item) parts.push_back(make_range(item, item + 1));
    return parts;
  }
  parts.push_back(range);
  while (parts.size() < kWidth) {
    size_t worst = parts.size();
    for (size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].size() < 2) continue;
      if (worst == parts.size() || parts[i].summary.cost() > parts[worst].summary.cost()) worst = i;
    }
    if (worst == parts.size()) break;
    const std::array<Range, 2> halves = cut(parts[worst]);
    parts[worst] = halves[0];
    parts.push_back(halves[1]);
  }
  return parts;
}

void set_child(Node& node, size_t i, const LightBounds& bounds, uint32_t child) {
  const Vec3 center = bounds.box.center();
  node.center_x[i] = center.x, node.center_y[i] = center.y, node.center_z[i] = center.z;
  node.radius[i] = std::copysign(0.5f * length(bounds.box.diagonal()), bounds.is_two_sided ? -1.0f : 1.0f);
  node.axis_x[i] = bounds.axis.x, node.axis_y[i] = bounds.axis.y, node.axis_z[i] = bounds.axis.z;
  node.cos_normals[i] = bounds.cos_normals, node.sin_normals[i] = safe_sqrt(1.0f - sqr(bounds.cos_normals));
  node.cos_emission[i] = bounds.cos_emission;
  node.intensity[i] = bounds.intensity;
  node.near_distance2[i] = std::max(bounds.near_distance2, sqr(node.radius[i]));
  node.child[i] = child;
}

struct Subtree {
  std::vector<Node> nodes;  // the subtree's root first
  LightBounds bounds;
};

void append(std::vector<Node>& nodes, std::vector<Node>&& subtree) {
  const auto offset = static_cast<uint32_t>(nodes.size());
  for (Node& node : subtree) {
    for (int i = 0; i < kWidth; ++i) {
      if (node.intensity[i] > 0.0f && !(node.child[i] & LightTree::kLeafBit)) node.child[i] += offset;
    }
  }
  nodes.insert(nodes.end(), subtree.begin(), subtree.end());
}

/// Adds the subtree of a range to `nodes`; returns its bounds.
LightBounds build_subtree(const Range& range, std::span<const LightBounds> emitters, std::vector<Node>& nodes) {
  const size_t self = nodes.size();
  nodes.emplace_back();
  const std::vector<Range> parts = divide(range);
  std::array<LightBounds, kWidth> bounds;
  std::array<uint32_t, kWidth> child{};

  std::array<Subtree, kWidth> subtrees;
  const bool is_parallel = range.size() > kParallelItems;
  const auto build_apart = [&](size_t i) {
    if (parts[i].size() > 1) subtrees[i].bounds = build_subtree(parts[i], emitters, subtrees[i].nodes);
  };
  if (is_parallel) tbb::parallel_for(size_t{0}, parts.size(), build_apart);

  for (size_t i = 0; i < parts.size(); ++i) {
    const uint32_t emitter = parts[i].begin->emitter;
    const bool is_leaf = parts[i].size() == 1;
    child[i] = is_leaf ? emitter | LightTree::kLeafBit : static_cast<uint32_t>(nodes.size());
    if (is_leaf)
      bounds[i] = emitters[emitter];
    else if (!is_parallel)
      bounds[i] = build_subtree(parts[i], emitters, nodes);
    else {
      bounds[i] = subtrees[i].bounds;
      append(nodes, std::move(subtrees[i].nodes));
      subtrees[i].nodes = {};
    }
    set_child(nodes[self], i, bounds[i], child[i]);
  }
  return merge(std::span(bounds.data(), parts.size()));
}

}  // namespace

std::vector<Node> build_light_tree(std::span<const LightBounds> emitters) {
  std::vector<Node> nodes;
  if (emitters.empty()) return nodes;
  std::vector<Item> items(emitters.size());
  // Two-sided normals have no sign; turned to one half space their sum still tells how much they scatter.
  const Vec3 reference{0.267261f, 0.534522f, 0.801784f};
  for (uint32_t i = 0; i < emitters.size(); ++i) {
    const LightBounds& b = emitters[i];
    const bool is_turned = b.is_two_sided && dot(b.axis, reference) < 0.0f;
    items[i] = {b.box.center(), b.intensity, is_turned ? -b.axis : b.axis, i};
  }
  build_subtree(make_range(items.data(), items.data() + items.size()), emitters, nodes);
  nodes.shrink_to_fit();
  return nodes;
}

}  // namespace cistern
