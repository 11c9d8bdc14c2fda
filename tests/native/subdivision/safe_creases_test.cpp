#include "subdivision/safe_creases.h"

#include <gtest/gtest.h>

#include "subdivision/cages.h"
#include "subdivision/limit_surface.h"

namespace cistern {
namespace {

/// From a head of Blender's: point 2 is between two quads alone, the border is open.
test::Cage patch_of_a_head() {
  return {{{0.0f, -0.625f, -0.2562f},
           {0.0f, -0.6375f, -0.15f},
           {0.0f, -0.6f, -0.1562f},
           {0.0f, -0.5938f, -0.1125f},
           {0.0813f, -0.5938f, -0.1187f},
           {-0.0813f, -0.5938f, -0.1187f},
           {-0.1f, -0.6f, -0.1813f},
           {0.0688f, -0.5938f, -0.2313f},
           {0.0f, -0.5938f, -0.2625f},
           {0.075f, -0.625f, -0.2188f},
           {-0.1063f, -0.6375f, -0.1813f},
           {0.0875f, -0.625f, -0.1063f},
           {-0.0875f, -0.625f, -0.1063f},
           {0.0312f, -0.625f, -0.1f},
           {-0.0312f, -0.625f, -0.1f}},
          {{10, 12, 5, 6}, {3, 13, 11, 4}, {12, 14, 3, 5}, {2, 1, 13, 3}, {14, 1, 2, 3}, {8, 7, 9, 0}}};
}

std::shared_ptr<const Mesh> creased(const test::Cage& cage, std::vector<std::array<uint32_t, 2>> creases) {
  const std::shared_ptr<const Mesh> mesh = cage.mesh();
  auto changed = std::make_shared<Mesh>(*mesh);
  auto creased_cage = std::make_shared<SubdivisionCage>(*mesh->cage);
  creased_cage->crease_sharpness.assign(creases.size(), SubdivisionCage::kSharpest);
  creased_cage->creases = std::move(creases);
  changed->cage = creased_cage;
  return changed;
}

TEST(SafeCreases, LeavesOutThoseThatOpenSubdivCannotBeGiven) {
  // The edges of the other polygons stay, but for those that touch the unsafe ones.
  const auto mesh = creased(patch_of_a_head(), {{3, 13}, {7, 9}, {10, 12}, {14, 1}, {11, 13}});
  EXPECT_EQ(safe_creases(*mesh->cage), (std::vector<size_t>{1, 2}));
}

TEST(SafeCreases, KeepsAllOthers) {
  EXPECT_EQ(safe_creases(*creased(test::cube(), {{0, 1}, {2, 3}})->cage).size(), 2u);
  test::Cage open = test::cube();
  open.polygons.pop_back();
  EXPECT_EQ(safe_creases(*creased(open, {{0, 1}, {1, 3}})->cage).size(), 2u);
  EXPECT_TRUE(safe_creases(*creased(open, {})->cage).empty());
  EXPECT_TRUE(safe_creases(SubdivisionCage{}).empty());
}

/// Ended the process.
TEST(SafeCreases, SurfacesOfSuchMeshesExist) {
  const auto mesh = creased(patch_of_a_head(), {{3, 13}});
  const LimitSurface surface(*mesh);
  ASSERT_TRUE(surface.exists());
  for (uint32_t polygon = 0; polygon < 6; ++polygon) {
    const LimitSurface::Point point = LimitSurface::Patch(surface).at({polygon, 0, {0.5f, 0.5f}});
    EXPECT_TRUE(is_finite(point.position)) << polygon;
  }
}

}  // namespace
}  // namespace cistern
