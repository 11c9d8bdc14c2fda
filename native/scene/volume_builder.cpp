#include "scene/volume_builder.h"

#include "base/check.h"
#include "scene/mesh_builder.h"
#include "scene/scene_checks.h"

namespace cistern {
namespace {

/// Corner 4 x + 2 y + z of a box; corners of its sides, counter-clockwise as seen from outside.
constexpr std::array<int32_t, 24> kSides{0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3};
constexpr std::array<int32_t, 7> kSideOffsets{0, 4, 8, 12, 16, 20, 24};

void check_invertible(const std::string& name, const char* what, const Transform& transform) {
  check_transform(name, what, transform);
  if (is_singular(transform)) throw Error(name, std::string(what) + " cannot be inverted");
}

void check(const VolumeInput& input) {
  if (!std::isfinite(input.drift_opening)) throw Error(input.name, "drift_opening is not finite");
  check_invertible(input.name, "object_to_box", input.object_to_box);
  if (std::ranges::any_of(input.size, [](int size) { return size < 1; }))
    throw Error(input.name, "the box of a volume must have at least one voxel along each axis");
  for (const VoxelGrid& grid : input.grids) {
    check_invertible(input.name, "object_to_voxel", grid.object_to_voxel);
    if (std::ranges::any_of(grid.size, [](int size) { return size < 1; }) || !grid.voxels)
      throw Error(input.name, "grid '" + grid.name + "' has no voxels");
    if (grid.channels < 1 || grid.channels > 4)
      throw Error(input.name,
                  "grid '" + grid.name + "' has " + std::to_string(grid.channels) + " channels: must have 1 to 4");
    if (!std::isfinite(grid.background)) throw Error(input.name, "grid '" + grid.name + "' is not finite");
    if (grid.name == kDriftGrid && grid.channels != 3)
      throw Error(input.name, "grid '" + grid.name + "' has " + std::to_string(grid.channels) + " channels, not 3");
  }
}

std::optional<VoxelGrid> take_drift(std::vector<VoxelGrid>& grids) {
  const auto found = std::ranges::find(grids, kDriftGrid, &VoxelGrid::name);
  if (found == grids.end()) return std::nullopt;
  VoxelGrid drift = std::move(*found);
  grids.erase(found);
  return drift;
}

}  // namespace

Mesh build_volume(VolumeInput input) {
  check(input);
  const Transform box_to_object = inverse(input.object_to_box);
  std::array<Vec3, 8> corners;
  for (size_t i = 0; i < 8; ++i) {
    const auto at = [&](size_t axis) { return (i >> (2 - axis)) & 1 ? static_cast<float>(input.size[axis]) : 0.0f; };
    corners[i] = box_to_object.point({at(0), at(1), at(2)});
  }
  std::array<int32_t, 24> sides = kSides;
  if (box_to_object.determinant() < 0.0f)
    for (size_t side = 0; side < 6; ++side) std::swap(sides[4 * side + 1], sides[4 * side + 3]);
  MeshInput mesh_input;
  mesh_input.name = input.name;
  mesh_input.positions = corners;
  mesh_input.corner_vertices = sides;
  mesh_input.polygon_offsets = kSideOffsets;
  mesh_input.texture_space = input.texture_space;
  Mesh mesh = build_mesh(mesh_input);
  for (VoxelGrid& grid : input.grids) grid.name_hash = attribute_name_hash(grid.name);
  std::optional<VoxelGrid> drift = take_drift(input.grids);
  VoxelVolume volume =
      make_voxel_volume(std::move(input.grids), input.object_to_box, input.size, input.scales_with_object);
  if (drift) add_drift(volume, std::move(*drift), input.drift_opening);
  mesh.volume = std::make_shared<const VoxelVolume>(std::move(volume));
  return mesh;
}

}  // namespace cistern
