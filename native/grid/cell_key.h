#pragma once

#include <array>
#include <cstdint>

#include "base/rgb.h"
#include "base/vec.h"

namespace cistern {

/// A cell of the world-space grid as an exact integer, most significant first:
///   0 (1 bit) | level (6) | x, y, z (17 each) | normal bin (6).
/// Two points have the same key if and only if they lie in the same cell of the same layout: nothing is hashed.
using CellKey = uint64_t;

/// The key of what has no cell (a pixel without a surface, a point that is not finite). No cell has it.
inline constexpr CellKey kNoCell = ~CellKey{0};

/// What the user chooses about cells.
struct GridSettings {
  float min_cell_size = 0.0f;  ///< metres; the edge of cells of level 0, see `default_min_cell_size`
  float cell_pixels = 10.0f;   ///< edge of a cell as seen on the picture; 0: all cells have the smallest size
  bool use_normals = true;  ///< whether cells are divided by the direction of the surface [Zhang and Wang 2023, §4.2]
  bool randomised = true;   ///< a new offset and rotation for each (seed, frame); false: the same cells in all frames
  friend bool operator==(const GridSettings&, const GridSettings&) = default;
};

/// How large a pixel looks from where: one of the two sizes is zero. Panoramas are perspective in this sense.
struct GridCamera {
  Vec3 position;
  float pixel_angle = 0.0f;  ///< radians; of a perspective camera, see `pixel_angle`
  float pixel_size = 0.0f;   ///< metres; of an orthographic camera
};

/// The cells of one frame: values only, so that the grid of the previous frame is read with the layout it was built
/// with.
struct GridLayout {
  std::array<double, 3> camera_position{};
  std::array<std::array<double, 3>, 3> rotation{};  ///< rows: from the world to the axes of the grid
  std::array<double, 3> offset{};                   ///< of the grid, in cells of level 0
  double min_cell_size = 0.0;                       ///< metres
  double size_per_distance = 0.0;                   ///< wanted size of a cell for each metre from the camera
  double size_everywhere = 0.0;                     ///< metres; wanted size of a cell at any distance
  bool use_normals = true;
};

/// Angle of a pixel in radians for a vertical field of view and a picture in pixels. [Boissé 2021] Alg. 4. (Eq. (11)
/// of [Zhang and Wang 2023] has width and height exchanged: cells would be 1.8 times as large at 16:9.)
float pixel_angle(float vertical_fov, int width, int height);

/// 1 % of the diagonal of the scene's box, in metres. [Zhang and Wang 2023, §5.3] take the shortest side, which is zero
/// for a flat scene. Clamped to sizes that floats resolve; an empty or point-like box gives the smallest.
float default_min_cell_size(Vec3 box_min, Vec3 box_max);

/// Raises `Error` naming the setting for a size that is not finite or not positive, or a negative number of pixels.
GridLayout make_grid_layout(const GridSettings& settings, const GridCamera& camera, uint64_t seed, uint32_t frame);

/// The cell of a point. Edge = min_cell_size 2^level with level = floor(log2(wanted size / min_cell_size)), at least 0
/// [Boissé 2021, Alg. 4]. The level rises by itself where coordinates would need more than their bits: cells are at
/// least 2^-14 of the distance to the camera and 2^-40 of the largest coordinate wide. `kNoCell` for a point or a
/// used normal that is not finite; `Error` naming min_cell_size where even level 63 is too small.
CellKey cell_key(const GridLayout& layout, Vec3 position, Vec3 normal);

/// Edge in metres of the cell at a point; the same exceptions as `cell_key`, 0 for a point that is not finite.
float cell_size(const GridLayout& layout, Vec3 position);

/// A point moved within its tangent plane by up to half a cell along both axes; `u` in [0, 1)^2. For insertion only, to
/// blur the borders of cells. [Boissé 2021, §4, jittered descriptors]
Vec3 jitter_in_tangent_plane(const GridLayout& layout, Vec3 position, Vec3 normal, Vec2 u);

/// Bins of directions: 6 faces of a cube, 3 x 3 on each, with the middle one about the axis, so that the normals of
/// axis-aligned walls never change bins. Bins are 30 degrees wide through the middle.
inline constexpr int kNormalBinCount = 54;
/// The bin of a zero normal and of layouts without normals.
inline constexpr int kNoNormalBin = 63;
int normal_bin(Vec3 normal);

inline constexpr int kCellCoordinateBits = 17;
inline constexpr int kNormalBinBits = 6;
inline constexpr int kLevelBits = 6;

inline constexpr int key_level(CellKey key) {
  return static_cast<int>(key >> (3 * kCellCoordinateBits + kNormalBinBits)) & ((1 << kLevelBits) - 1);
}
inline constexpr int key_normal_bin(CellKey key) { return static_cast<int>(key) & ((1 << kNormalBinBits) - 1); }
/// The key of the whole cell, for views that show positions only.
inline constexpr CellKey without_normal(CellKey key) { return key | CellKey{kNoNormalBin}; }

/// A colour that tells neighbouring cells apart: each channel in [0.1, 1], the same in all frames; black for `kNoCell`.
Rgb cell_color(CellKey key);

}  // namespace cistern
