#include "grid/nested_cells.h"

#include <bit>

namespace cistern {
namespace {

constexpr int kNormalBits = NestedCells::kNormalBits, kCoordinateBits = NestedCells::kCoordinateBits;
constexpr int kLevelShift = 3 * kCoordinateBits + kNormalBits, kStepShift = kLevelShift + NestedCells::kLevelBits;
constexpr uint64_t kNoNormal = 6;

/// The cube is this much wider than the diagonal of the box, and the box lies in it off the planes that halve it: so
/// the sides of the box, where walls and floors often are, are no borders of cells.
constexpr float kMargin = 0.31830989f, kShareBefore = 0.38196601f;

/// floor(log2(x)) for a normal x > 0.
int floor_log2(float x) { return static_cast<int>(std::bit_cast<uint32_t>(x) >> 23) - 127; }

uint64_t normal_side(Vec3 n) {
  const float ax = std::abs(n.x), ay = std::abs(n.y), az = std::abs(n.z);
  const int axis = ax >= ay && ax >= az ? 0 : (ay >= az ? 1 : 2);
  const float along = n[axis];
  return along == 0.0f ? kNoNormal : static_cast<uint64_t>(2 * axis + (along < 0.0f ? 1 : 0));
}

}  // namespace

NestedCells::NestedCells(const NestedCellSettings& settings, const Bounds3& box, Vec3 camera_position,
                         float pixel_angle, float pixel_size)
    : camera_position_(camera_position), use_normals_(settings.use_normals) {
  const float diagonal = box.is_empty() ? 0.0f : length(box.diagonal());
  const float edge = diagonal > 0.0f ? diagonal * (1.0f + kMargin) : 1.0f;
  const Vec3 lower = box.is_empty() ? Vec3{} : box.lower;
  const float before = kShareBefore * kMargin * edge / (1.0f + kMargin);
  origin_ = lower - Vec3{before, before, before};
  inverse_edge_ = 1.0f / edge;
  size_per_distance_ = settings.cell_pixels * pixel_angle * inverse_edge_;
  size_everywhere_ = settings.cell_pixels * pixel_size * inverse_edge_;
  const float coarsest = settings.coarsest_share * diagonal * inverse_edge_;
  coarsest_level_ = coarsest > 0.0f ? std::clamp(-floor_log2(coarsest), 0, kFinestLevel) : 0;
}

NestedCellKey NestedCells::key(Vec3 position, Vec3 normal) const {
  if (!is_finite(position)) return kNoNestedCell;
  const float size = size_everywhere_ + length(position - camera_position_) * size_per_distance_;
  const int wanted = size > 0.0f ? -1 - floor_log2(size) : coarsest_level_;
  const int level = std::clamp(wanted, coarsest_level_, kFinestLevel);
  const float cells = static_cast<float>(1 << level);
  auto key = static_cast<NestedCellKey>(level);
  for (int axis = 0; axis < 3; ++axis) {
    const float along = std::clamp((position[axis] - origin_[axis]) * inverse_edge_, 0.0f, kOneMinusEpsilon);
    key = (key << kCoordinateBits) | static_cast<NestedCellKey>(along * cells);
  }
  return (key << kNormalBits) | (use_normals_ ? normal_side(normal) : kNoNormal);
}

NestedCellKey coarser_cell(NestedCellKey key) {
  constexpr uint64_t kCoordinate = (uint64_t{1} << kCoordinateBits) - 1;
  constexpr uint64_t kLow = (kCoordinate >> 1) << kNormalBits;  // of a coordinate after halving, in the lowest place
  constexpr uint64_t kHalved = kLow | kLow << kCoordinateBits | kLow << 2 * kCoordinateBits;
  constexpr uint64_t kNormal = (uint64_t{1} << kNormalBits) - 1;
  const uint64_t level = (key >> kLevelShift) & ((uint64_t{1} << NestedCells::kLevelBits) - 1);
  const uint64_t steps = (key >> kStepShift) + 1;
  return steps << kStepShift | (level > 0 ? level - 1 : 0) << kLevelShift | ((key >> 1) & kHalved) | (key & kNormal);
}

}  // namespace cistern
