#include "scene/voxel_volume.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/parallel.h"

namespace cistern {
namespace {

constexpr int kVoxelsInBlock = 8;      // along an axis, as in the leaves of OpenVDB
constexpr int kMostBlocksOnAxis = 32;  // more voxels make larger blocks
constexpr size_t kBlocksPerTask = 64;

using Index = std::array<int, 3>;

size_t offset_of(const VoxelGrid& grid, const Index& index) {
  const auto at = [&](size_t axis) { return static_cast<size_t>(index[axis]); };
  return (at(0) * static_cast<size_t>(grid.size[1]) + at(1)) * static_cast<size_t>(grid.size[2]) + at(2);
}

bool contains(const VoxelGrid& grid, const Index& index) {
  for (size_t axis = 0; axis < 3; ++axis)
    if (index[axis] < 0 || index[axis] >= grid.size[axis]) return false;
  return true;
}

float stored(const VoxelGrid& grid, size_t i) {
  return grid.is_half ? _cvtsh_ss(static_cast<const uint16_t*>(grid.voxels.get())[i])
                      : static_cast<const float*>(grid.voxels.get())[i];
}

/// Voxels that the trilinear values inside of a block depend on.
struct Range {
  Index begin, end;
};
Range voxels_of_block(const VoxelGrid& grid, const Transform& blocks_to_object, const Index& block) {
  const Transform blocks_to_voxel = grid.object_to_voxel * blocks_to_object;
  Bounds3 bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](size_t axis) { return static_cast<float>(block[axis] + ((corner >> axis) & 1)); };
    bounds.extend(blocks_to_voxel.point({at(0), at(1), at(2)}));
  }
  Range range;
  constexpr float kRounding = 1e-3f;  // of a voxel
  for (int axis = 0; axis < 3; ++axis) {
    const float last = static_cast<float>(grid.size[static_cast<size_t>(axis)]);
    const auto within = [&](float x) { return static_cast<int>(std::clamp(x, 0.0f, last)); };
    range.begin[static_cast<size_t>(axis)] = within(std::floor(bounds.lower[axis] + kRounding));
    range.end[static_cast<size_t>(axis)] = within(std::ceil(bounds.upper[axis] - kRounding) + 1.0f);
  }
  return range;
}

float sum_of_channels(const VoxelGrid& grid, size_t voxel) {
  float sum = 0.0f;
  for (size_t c = 0; c < static_cast<size_t>(grid.channels); ++c)
    sum += stored(grid, voxel * static_cast<size_t>(grid.channels) + c);
  return sum;
}

/// Where the grid is largest and smallest in a block; nothing where it is the same everywhere.
void add_extremes(const VoxelGrid& grid, const Transform& blocks_to_object, const Index& block,
                  std::vector<Vec3>& places) {
  const Range range = voxels_of_block(grid, blocks_to_object, block);
  const float background = grid.background * static_cast<float>(grid.channels);
  Index largest{}, smallest{};
  float most = background, least = background;  // what is beyond the box may be part of the block
  for (Index i{range.begin}; i[0] < range.end[0]; ++i[0])
    for (i[1] = range.begin[1]; i[1] < range.end[1]; ++i[1])
      for (i[2] = range.begin[2]; i[2] < range.end[2]; ++i[2]) {
        const float value = sum_of_channels(grid, offset_of(grid, i));
        if (value > most) most = value, largest = i;
        if (value < least) least = value, smallest = i;
      }
  const Transform voxel_to_object = inverse(grid.object_to_voxel);
  const auto add = [&](const Index& i) {
    places.push_back(
        voxel_to_object.point({static_cast<float>(i[0]), static_cast<float>(i[1]), static_cast<float>(i[2])}));
  };
  if (most > background) add(largest);
  if (least < background) add(smallest);
}

void find_places(VoxelVolume& volume) {
  const Transform blocks_to_object = inverse(volume.object_to_blocks);
  const auto& n = volume.blocks;
  const size_t count = static_cast<size_t>(n[0]) * static_cast<size_t>(n[1]) * static_cast<size_t>(n[2]);
  std::vector<std::vector<Vec3>> found(count);
  parallel_blocks(count, kBlocksPerTask, [&](size_t, size_t begin, size_t end) {
    for (size_t b = begin; b < end; ++b) {
      const int i = static_cast<int>(b);
      const Index block{i / (n[1] * n[2]), i / n[2] % n[1], i % n[2]};
      for (const VoxelGrid& grid : volume.grids) add_extremes(grid, blocks_to_object, block, found[b]);
    }
  });
  volume.first_place.assign(1, 0);
  for (const std::vector<Vec3>& places : found) {
    volume.places.insert(volume.places.end(), places.begin(), places.end());
    volume.first_place.push_back(static_cast<uint32_t>(volume.places.size()));
  }
}

Vec3 drift_at(const VoxelVolume& volume, Vec3 place) {
  const std::array<float, 4> way = sample_grid(volume.drift->way, place).channel;
  return volume.drifts * Vec3{way[0], way[1], way[2]};
}

bool is_same_grid(const VoxelGrid& a, const VoxelGrid& b) {
  return a.name == b.name && a.size == b.size && a.channels == b.channels && a.is_half == b.is_half &&
         a.background == b.background && a.object_to_voxel == b.object_to_voxel &&
         (a.voxels == b.voxels || std::memcmp(a.voxels.get(), b.voxels.get(), a.memory_bytes()) == 0);
}

bool is_same_drift(const VoxelDrift* a, const VoxelDrift* b) {
  return a == b || (a && b && a->opening == b->opening && is_same_grid(a->way, b->way));
}

}  // namespace

VoxelValue voxel_at(const VoxelGrid& grid, std::array<int, 3> index) {
  VoxelValue value;
  const bool is_inside = contains(grid, index);
  const size_t channels = static_cast<size_t>(grid.channels);
  const size_t first = is_inside ? offset_of(grid, index) * channels : 0;
  for (size_t c = 0; c < channels; ++c) value.channel[c] = is_inside ? stored(grid, first + c) : grid.background;
  return value;
}

VoxelValue sample_grid(const VoxelGrid& grid, Vec3 place) {
  const Vec3 p = grid.object_to_voxel.point(place);
  Index low;
  std::array<float, 3> part;
  const size_t channels = static_cast<size_t>(grid.channels);
  bool is_inside = true;  // with all eight voxels
  for (size_t axis = 0; axis < 3; ++axis) {
    const float x = p[static_cast<int>(axis)];
    if (!(x > -1.0f && x < static_cast<float>(grid.size[axis]))) return voxel_at(grid, {-1, -1, -1});
    const float whole = std::floor(x);
    low[axis] = static_cast<int>(whole);
    part[axis] = x - whole;
    is_inside &= low[axis] >= 0 && low[axis] + 1 < grid.size[axis];
  }
  const size_t first = is_inside ? offset_of(grid, low) : 0;
  const size_t row = static_cast<size_t>(grid.size[2]), layer = row * static_cast<size_t>(grid.size[1]);
  VoxelValue result;
  for (size_t c = 0; c < channels; ++c) result.channel[c] = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner >> 2, y = (corner >> 1) & 1, z = corner & 1;
    const float weight =
        (x ? part[0] : 1.0f - part[0]) * (y ? part[1] : 1.0f - part[1]) * (z ? part[2] : 1.0f - part[2]);
    if (is_inside) {
      const size_t voxel = first + (x ? layer : 0) + (y ? row : 0) + static_cast<size_t>(z);
      for (size_t c = 0; c < channels; ++c) result.channel[c] += weight * stored(grid, voxel * channels + c);
    } else {
      const VoxelValue value = voxel_at(grid, {low[0] + x, low[1] + y, low[2] + z});
      for (size_t c = 0; c < channels; ++c) result.channel[c] += weight * value.channel[c];
    }
  }
  return result;
}

const VoxelGrid* VoxelVolume::find(uint32_t name_hash) const {
  for (const VoxelGrid& grid : grids)
    if (grid.name_hash == name_hash) return &grid;
  return nullptr;
}

Vec3 VoxelVolume::origin_of(Vec3 place) const {
  if (!drift || drifts == 0.0f) return place;
  return place - drift_at(*this, place - drift_at(*this, place));
}

Vec3 VoxelVolume::destination_of(Vec3 place) const {
  return drift && drifts != 0.0f ? place + drift_at(*this, place) : place;
}

void add_drift(VoxelVolume& volume, VoxelGrid way, float opening) {
  float most = 0.0f;
  for (size_t i = 0; i < way.voxel_count(); ++i) {
    const Vec3 v = volume.object_to_blocks.vector({stored(way, 3 * i), stored(way, 3 * i + 1), stored(way, 3 * i + 2)});
    most = std::max({most, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  }
  volume.drift = std::make_shared<const VoxelDrift>(VoxelDrift{std::move(way), opening, most});
}

VoxelVolume at_time(const VoxelVolume& volume, float time) {
  VoxelVolume result = volume;
  if (volume.drift) result.drifts = volume.drift->opening + time;
  return result;
}

size_t VoxelVolume::memory_bytes() const {
  size_t bytes = first_place.capacity() * sizeof(uint32_t) + places.capacity() * sizeof(Vec3);
  for (const VoxelGrid& grid : grids) bytes += grid.memory_bytes();
  if (drift) bytes += drift->way.memory_bytes();
  return bytes;
}

VoxelVolume make_voxel_volume(std::vector<VoxelGrid> grids, const Transform& object_to_box, std::array<int, 3> size,
                              bool scales_with_object) {
  VoxelVolume volume;
  volume.grids = std::move(grids);
  volume.scales_with_object = scales_with_object;
  std::array<float, 3> blocks_per_voxel;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int wanted = (size[axis] + kVoxelsInBlock - 1) / kVoxelsInBlock;
    volume.blocks[axis] = std::clamp(wanted, 1, kMostBlocksOnAxis);
    blocks_per_voxel[axis] = static_cast<float>(volume.blocks[axis]) / static_cast<float>(size[axis]);
  }
  const Transform scale{
      {blocks_per_voxel[0], 0.0f, 0.0f}, {0.0f, blocks_per_voxel[1], 0.0f}, {0.0f, 0.0f, blocks_per_voxel[2]}, {}};
  volume.object_to_blocks = scale * object_to_box;
  find_places(volume);
  return volume;
}

bool is_same_volume(const VoxelVolume& a, const VoxelVolume& b) {
  return a.scales_with_object == b.scales_with_object && a.object_to_blocks == b.object_to_blocks &&
         a.blocks == b.blocks && a.drifts == b.drifts && is_same_drift(a.drift.get(), b.drift.get()) &&
         std::ranges::equal(a.grids, b.grids, is_same_grid);
}

}  // namespace cistern
