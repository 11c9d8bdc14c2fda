#include "scene/voxel_volume.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace cistern::test {
namespace {

/// Of 20 x 9 x 12 voxels, of which one in a hundred is not 0, half of these below.
VoxelGrid random_grid(Rng& rng) {
  VoxelGrid grid;
  grid.size = {20, 9, 12};
  grid.object_to_voxel = {{2.0f, 0.5f, 0.0f}, {0.0f, 3.0f, 0.0f}, {0.0f, 0.3f, 1.5f}, {1.0f, 2.0f, 3.0f}};
  auto voxels = std::make_shared<float[]>(grid.voxel_count());
  for (size_t i = 0; i < grid.voxel_count(); ++i) voxels[i] = rng.next_float() < 0.01f ? rng.next_float() - 0.5f : 0.0f;
  grid.voxels = voxels;
  return grid;
}

TEST(VoxelGrid, IsItsVoxelsAtWholeNumbersAndLinearBetween) {
  Rng rng(1, 0, 0, 0);
  VoxelGrid grid = random_grid(rng);
  grid.background = 0.25f;
  const Transform to_object = inverse(grid.object_to_voxel);
  const auto at = [&](float x, float y, float z) { return sample_grid(grid, to_object.point({x, y, z})).channel[0]; };
  for (int x = -2; x < 22; ++x)
    for (int y = -2; y < 11; ++y)
      for (int z = -2; z < 14; ++z) {
        const float a = voxel_at(grid, {x, y, z}).channel[0], b = voxel_at(grid, {x, y + 1, z}).channel[0];
        const Vec3 p{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
        ASSERT_NEAR(at(p.x, p.y, p.z), a, 1e-5f);
        ASSERT_NEAR(at(p.x, p.y + 0.25f, p.z), 0.75f * a + 0.25f * b, 1e-5f);
      }
}

/// The places of a block bound all that is interpolated in it, from above and from below.
TEST(VoxelVolume, PlacesOfBlocksAreExtremes) {
  Rng rng(2, 0, 0, 0);
  const VoxelGrid grid = random_grid(rng);
  const Transform box{{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, {8.0f, 8.0f, 8.0f}};
  const VoxelVolume volume = make_voxel_volume({grid}, box * grid.object_to_voxel, {32, 24, 32}, false);
  ASSERT_EQ(volume.blocks, (std::array<int, 3>{4, 3, 4}));
  const Transform to_object = inverse(volume.object_to_blocks);
  size_t blocks_with_places = 0;
  for (int b = 0; b < 4 * 3 * 4; ++b) {
    float most = 0.0f, least = 0.0f;
    for (size_t k = volume.first_place[static_cast<size_t>(b)]; k < volume.first_place[static_cast<size_t>(b) + 1];
         ++k) {
      most = std::max(most, sample_grid(grid, volume.places[k]).channel[0]);
      least = std::min(least, sample_grid(grid, volume.places[k]).channel[0]);
    }
    blocks_with_places += most > 0.0f;
    for (int i = 0; i < 500; ++i) {
      const Vec3 corner{static_cast<float>(b / 12), static_cast<float>(b / 4 % 3), static_cast<float>(b % 4)};
      const Vec3 place = corner + Vec3{rng.next_float(), rng.next_float(), rng.next_float()};
      const float value = sample_grid(grid, to_object.point(place)).channel[0];
      ASSERT_LE(value, most + 1e-4f);
      ASSERT_GE(value, least - 1e-4f);
    }
  }
  EXPECT_GT(blocks_with_places, 5u);
}

/// A way of (0.5, 0, 0) everywhere in [0, 20].
VoxelGrid even_way() {
  VoxelGrid way;
  way.size = {21, 21, 21};
  way.channels = 3;
  auto voxels = std::make_shared<float[]>(3 * way.voxel_count());
  for (size_t i = 0; i < way.voxel_count(); ++i) voxels[3 * i] = 0.5f;
  way.voxels = voxels;
  return way;
}

TEST(VoxelVolume, DriftsWhileAShutterIsOpen) {
  VoxelVolume volume = make_voxel_volume({}, Transform{}, {20, 20, 20}, false);
  add_drift(volume, even_way(), -0.25f);
  EXPECT_FLOAT_EQ(volume.drift->longest, 0.5f * 3.0f / 20.0f) << "in blocks";
  const Vec3 place{10.0f, 4.0f, 5.0f}, beyond{30.0f, 4.0f, 5.0f};
  EXPECT_EQ(volume.origin_of(place), place) << "not told when";
  for (const float time : {0.0f, 0.25f, 1.0f}) {
    const VoxelVolume then = at_time(volume, time);
    const Vec3 way{0.5f * (time - 0.25f), 0.0f, 0.0f};
    EXPECT_EQ(then.origin_of(place), place - way);
    EXPECT_EQ(then.destination_of(place), place + way);
    EXPECT_EQ(then.origin_of(beyond), beyond) << "nothing goes there";
    EXPECT_EQ(is_same_volume(volume, then), time == 0.25f);
  }
  EXPECT_EQ(at_time(make_voxel_volume({}, Transform{}, {20, 20, 20}, false), 0.5f).origin_of(place), place);
}

}  // namespace
}  // namespace cistern::test
