#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/transform.h"

namespace cistern {

/// Values at the points of a lattice, in a dense box; between them they are interpolated trilinearly, and beyond the
/// box everything is `background`. As OpenVDB has it, voxels are points at whole numbers, not cells.
struct VoxelGrid {
  std::string name;
  uint32_t name_hash = 0;              // attribute_name_hash(name), set by SceneBuilder
  std::array<int, 3> size{};           // voxels along x, y, z
  int channels = 1;                    // 1 to 4, interleaved
  bool is_half = false;                // 16 bits each, otherwise 32
  float background = 0.0f;             // of each channel
  Transform object_to_voxel;           // 0 is the first voxel of an axis
  std::shared_ptr<const void> voxels;  // z the fastest; may be memory of somebody else

  size_t voxel_count() const {
    return static_cast<size_t>(size[0]) * static_cast<size_t>(size[1]) * static_cast<size_t>(size[2]);
  }
  size_t memory_bytes() const { return voxel_count() * static_cast<size_t>(channels) * (is_half ? 2 : 4); }
};

/// Channels of a grid; what it does not have is 0, the fourth 1.
struct VoxelValue {
  std::array<float, 4> channel{0.0f, 0.0f, 0.0f, 1.0f};
};
/// At a place of object space.
VoxelValue sample_grid(const VoxelGrid& grid, Vec3 place);
/// Of one voxel; outside of the box the background.
VoxelValue voxel_at(const VoxelGrid& grid, std::array<int, 3> index);

/// How what is in a volume goes on while a shutter is open.
struct VoxelDrift {
  VoxelGrid way;         // all the way, in object space; 3 channels
  float opening = 0.0f;  // how often it, since the grids were as they are: -0.5 where that is in the middle
  float longest = 0.0f;  // the way of anything along any axis, in blocks
};
/// The grid of a VolumeInput that is its drift.
inline constexpr std::string_view kDriftGrid = "INFO:drift";

/// What is inside the box of a volume object. Blocks divide the box; each has places where what a material makes of the
/// grids is likely to be the densest of all the block: the voxels of largest and of smallest value that it reads.
struct VoxelVolume {
  std::vector<VoxelGrid> grids;
  std::shared_ptr<const VoxelDrift> drift;  // null: it rests
  float drifts = 0.0f;                      // how often its way since the grids were as they are
  bool scales_with_object = false;          // an object twice as large is half as dense
  Transform object_to_blocks;               // whole numbers are where blocks meet
  std::array<int, 3> blocks{1, 1, 1};
  std::vector<uint32_t> first_place;  // by block, z the fastest, and the number of all
  std::vector<Vec3> places;           // in object space

  /// Null for a name that is not there.
  const VoxelGrid* find(uint32_t name_hash) const;
  /// From where what is at a place of object space has drifted. [Cycles, kernel/geom/volume.h: an implicit step of
  /// Euler, solved by two look-ups]
  Vec3 origin_of(Vec3 place) const;
  /// The other way: about where it has drifted to.
  Vec3 destination_of(Vec3 place) const;
  size_t memory_bytes() const;
};

/// Divides the box [0, size] of `object_to_box`, in voxels of about the grids', into blocks and finds their places.
VoxelVolume make_voxel_volume(std::vector<VoxelGrid> grids, const Transform& object_to_box, std::array<int, 3> size,
                              bool scales_with_object);
/// `way`: 3 channels, finite; `opening`: see VoxelDrift.
void add_drift(VoxelVolume& volume, VoxelGrid way, float opening);
/// The same when a shutter has been open for `time`: 0 as it opens, 1 as it closes.
VoxelVolume at_time(const VoxelVolume& volume, float time);

/// Whether all of both is equal, value by value.
bool is_same_volume(const VoxelVolume& a, const VoxelVolume& b);

}  // namespace cistern
