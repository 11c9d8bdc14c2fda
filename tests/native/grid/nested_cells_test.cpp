#include "grid/nested_cells.h"

#include <gtest/gtest.h>

#include <set>

#include "base/rng.h"
#include "base/warp.h"

namespace cistern::test {
namespace {

const Bounds3 kBox{{-1, -2, 0}, {3, 2, 5}};
constexpr float kPixelAngle = 1e-3f;

NestedCells cells(bool use_normals = true, float pixel_angle = kPixelAngle) {
  return NestedCells({.use_normals = use_normals}, kBox, {0, 0, 1}, pixel_angle, 0.0f);
}

Vec3 random_point(Rng& rng) {
  const Vec3 d = kBox.diagonal();
  return kBox.lower + Vec3{d.x * rng.next_float(), d.y * rng.next_float(), d.z * rng.next_float()};
}

/// Largest distance along an axis between points that share a cell.
float widest_cell(const NestedCells& grid, Vec3 corner, float span, int count = 4000) {
  std::vector<std::pair<NestedCellKey, Vec3>> points;
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < count; ++i) {
    const Vec3 p = corner + span * Vec3{rng.next_float(), rng.next_float(), rng.next_float()};
    points.emplace_back(grid.key(p, {0, 0, 1}), p);
  }
  float widest = 0.0f;
  for (const auto& [a, p] : points)
    for (const auto& [b, q] : points)
      if (a == b) widest = std::max({widest, std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)});
  return widest;
}

TEST(NestedCells, AreAtMostTheShareOfTheDiagonalWide) {
  const float widest = widest_cell(cells(true, 0.0f), {0, 0, 2}, 0.3f);
  const float diagonal = length(kBox.diagonal());
  EXPECT_LE(widest, diagonal / 64.0f);
  EXPECT_GT(widest, 0.4f * diagonal / 64.0f);
}

TEST(NestedCells, AreFinerWhereTheCameraLooksClosely) {
  // 32 pixels of 1/1000 radian at 0.1 to 0.15 m are 3 to 5 mm.
  const float widest = widest_cell(cells(), {0.1f, 0, 1}, 0.02f);
  EXPECT_LE(widest, 0.1f * 32 * kPixelAngle * 2.0f);
  EXPECT_GT(widest, 0.3f * 0.1f * 32 * kPixelAngle);
}

TEST(NestedCells, CoarserCellsContainTheFiner) {
  const NestedCells grid = cells();
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = random_point(rng), q = p + 0.01f * square_to_sphere(rng.next_vec2());
    NestedCellKey a = grid.key(p, {0, 1, 0}), b = grid.key(q, {0, 1, 0});
    bool were_equal = false;
    for (int step = 0; step <= 4; ++step, a = coarser_cell(a), b = coarser_cell(b)) {
      EXPECT_TRUE(!were_equal || a == b) << "cells that share a point stay together";
      were_equal = a == b;
    }
  }
}

TEST(NestedCells, StepsHaveKeysOfTheirOwn) {
  const NestedCells grid = cells();
  Rng rng(3, 0, 0, 0);
  std::set<NestedCellKey> seen;
  NestedCellKey key = grid.key(random_point(rng), {1, 0, 0});
  for (int step = 0; step <= 4; ++step, key = coarser_cell(key)) EXPECT_TRUE(seen.insert(key).second);
}

TEST(NestedCells, AreDividedByTheSideOfTheNormal) {
  const Vec3 p{1, 1, 1};
  std::set<NestedCellKey> keys, without;
  for (const Vec3 n :
       {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{}}) {
    keys.insert(cells().key(p, n));
    without.insert(cells(false).key(p, n));
  }
  EXPECT_EQ(keys.size(), 7u);
  EXPECT_EQ(without.size(), 1u);
}

TEST(NestedCells, SidesOfTheBoxAreNoBorders) {
  const NestedCells grid = cells(false);
  for (const float nudge : {-1e-4f, 1e-4f})
    EXPECT_EQ(grid.key(kBox.lower, {}), grid.key(kBox.lower + Vec3{nudge, nudge, nudge}, {}));
}

TEST(NestedCells, OddInput) {
  EXPECT_EQ(cells().key({NAN, 0, 0}, {}), kNoNestedCell);
  EXPECT_NE(cells().key({1e9f, -1e9f, 0}, {0, 0, 1}), kNoNestedCell);
  EXPECT_NE(NestedCells({}, Bounds3{}, {}, 0.0f, 0.0f).key({1, 2, 3}, {0, 0, 1}), kNoNestedCell);
  const Bounds3 point{{1, 1, 1}, {1, 1, 1}};
  EXPECT_NE(NestedCells({}, point, {}, 0.0f, 0.0f).key({1, 1, 1}, {0, 0, 1}), kNoNestedCell);
}

}  // namespace
}  // namespace cistern::test
