#pragma once

#include <cstdint>

#include "base/vec.h"

namespace cistern {

/// A cell of `NestedCells` as an exact integer, most significant first:
///   steps towards coarser cells (3 bits) | level (5) | x, y, z (16 each) | normal bin (3).
using NestedCellKey = uint64_t;

/// The key of a point that is not finite. No cell has it.
inline constexpr NestedCellKey kNoNestedCell = ~NestedCellKey{0};

struct NestedCellSettings {
  float coarsest_share = 1.0f / 64.0f;  ///< edge of a point's own cell at most, as a share of the box's diagonal
  float cell_pixels = 32.0f;            ///< and this many pixels wide where that is smaller
  bool use_normals = true;              ///< divided by the six directions that a normal may be nearest to
};

/// Cells of the world that lie in one another: cubes of edge 2^-level of a cube about the scene. Each point has a cell
/// of its own, small where the camera looks closely, and coarser ones that contain it: so statistics can be kept as
/// fine as their number of samples allows. The same in all frames of a render. (`cell_key.h` has cells that are
/// displaced at random for each frame, for reuse whose borders must not show; those of two levels are no family.)
class NestedCells {
 public:
  /// `pixel_angle`: radians, `pixel_size`: metres; one is 0, as in GridCamera. An empty box counts as a point.
  NestedCells(const NestedCellSettings& settings, const Bounds3& box, Vec3 camera_position, float pixel_angle,
              float pixel_size);

  /// The finest cell of a point. A zero normal has a bin of its own. Points outside of the box count as on its border.
  NestedCellKey key(Vec3 position, Vec3 normal) const;

  static constexpr int kFinestLevel = 16;  // of 2^16 cells along an edge: as fine as float positions are exact
  static constexpr int kNormalBits = 3, kCoordinateBits = 16, kLevelBits = 5;

 private:
  Vec3 origin_;
  float inverse_edge_ = 0.0f;  // of the cube about the scene, 1/m
  Vec3 camera_position_;
  float size_per_distance_ = 0.0f, size_everywhere_ = 0.0f;  // of the wanted cell, in edges of that cube
  int coarsest_level_ = 0;
  bool use_normals_ = true;
};

/// The cell with twice the edge that contains this one, a step further from the points' own cells. Cells whose points
/// differ in level never share a key, not even where they cover the same cube.
NestedCellKey coarser_cell(NestedCellKey key);

}  // namespace cistern
