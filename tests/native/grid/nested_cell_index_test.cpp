#include "grid/nested_cell_index.h"

#include <gtest/gtest.h>

namespace cistern::test {
namespace {

const NestedCells kCells({}, Bounds3{{-4, -4, 0}, {4, 4, 4}}, {0, 0, 2}, 1e-3f, 0.0f);
const Vec3 kUp{0, 0, 1};

NestedCellKey coarser(NestedCellKey key, int steps) {
  for (int i = 0; i < steps; ++i) key = coarser_cell(key);
  return key;
}

TEST(NestedCellIndex, NamesTheFinestRowAroundAPoint) {
  const NestedCellKey here = kCells.key({1, 1, 0}, kUp), there = kCells.key({-3, 2, 1}, kUp);
  NestedCellIndex index;
  EXPECT_FALSE(index.find(here));
  for (const bool told_before : {false, true}) {
    const NestedCellKey own[] = {here, there};
    index.build({{coarser(here, 3), 5}, {coarser(here, 1), 6}}, told_before ? std::span(own) : std::span(own, 0));
    EXPECT_EQ(index.find(here), 6u);
    EXPECT_EQ(index.find(coarser(here, 2)), 5u);
    EXPECT_FALSE(index.find(there));
    EXPECT_FALSE(index.find(kNoNestedCell));
  }
}

TEST(NestedCellIndex, LooksNoFartherThanItSays) {
  const NestedCellKey here = kCells.key({1, 1, 0}, kUp);
  NestedCellIndex index;
  index.build({{coarser(here, NestedCellIndex::kDoublings + 1), 5}}, {});
  EXPECT_FALSE(index.find(here));
  index.build({{coarser(here, NestedCellIndex::kDoublings), 5}}, {});
  EXPECT_EQ(index.find(here), 5u);
}

}  // namespace
}  // namespace cistern::test
