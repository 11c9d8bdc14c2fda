#include "grid/cell_groups.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/rng.h"

namespace cistern {
namespace {

constexpr uint32_t kEntries = 20'000;
constexpr GroupRules kRules{.size = 16, .fine_levels = 3};
constexpr GroupRules kInterleaved{.size = 16, .fine_levels = 3, .interleaved = true};
constexpr uint64_t kSeed = 7;

struct Points {
  std::vector<Vec3> positions;
  std::vector<CellKey> keys;
  std::vector<uint32_t> classes;
  std::vector<CellKey> large_keys;  // of the cells that bound groups
};

/// Points on both sides of the origin, every tenth without a cell, in two classes.
Points make_points() {
  GridSettings small{.min_cell_size = 0.05f, .cell_pixels = 0.0f, .randomised = false}, large = small;
  large.min_cell_size *= 8.0f;
  GridLayout small_layout = make_grid_layout(small, {}, 1, 0), large_layout = make_grid_layout(large, {}, 1, 0);
  small_layout.offset = large_layout.offset = {};  // so that small cells lie in large ones
  Points points;
  Rng rng(5, 0, 0, 0);
  for (uint32_t i = 0; i < kEntries; ++i) {
    const Vec3 p{2.0f * rng.next_float() - 1.0f, 2.0f * rng.next_float() - 1.0f, 0.1f};
    const Vec3 n{0.0f, 0.0f, 1.0f};
    points.positions.push_back(p);
    points.keys.push_back(i % 10 == 0 ? kNoCell : cell_key(small_layout, p, n));
    points.large_keys.push_back(cell_key(large_layout, p, n));
    points.classes.push_back(i % 3 == 0);
  }
  return points;
}

class CellGroupsOfBothKinds : public testing::TestWithParam<GroupRules> {};
INSTANTIATE_TEST_SUITE_P(Rules, CellGroupsOfBothKinds, testing::Values(kRules, kInterleaved), [](const auto& info) {
  return std::string(info.param.interleaved ? "Interleaved" : "InARow");
});

TEST_P(CellGroupsOfBothKinds, EveryEntryWithACellIsInOneGroupOfItsCellAndClass) {
  const Points points = make_points();
  CellGroups groups;
  groups.build(points.keys, points.classes, GetParam(), kSeed);
  std::vector<int> seen(kEntries, 0);
  for (size_t g = 0; g < groups.count(); ++g) {
    const auto members = groups.members(g);
    ASSERT_GE(members.size(), 1u);
    ASSERT_LE(members.size(), 16u);
    for (const uint32_t i : members) {
      ++seen[i];
      EXPECT_EQ(points.large_keys[i], points.large_keys[members[0]]);
      EXPECT_EQ(points.classes[i], points.classes[members[0]]);
    }
  }
  for (uint32_t i = 0; i < kEntries; ++i) ASSERT_EQ(seen[i], i % 10 == 0 ? 0 : 1) << i;
}

TEST_P(CellGroupsOfBothKinds, GroupsOfACellDifferByOneAtMost) {
  const Points points = make_points();
  CellGroups groups;
  groups.build(points.keys, points.classes, GetParam(), kSeed);
  std::map<std::pair<CellKey, uint32_t>, std::pair<size_t, size_t>> extremes;
  for (size_t g = 0; g < groups.count(); ++g) {
    const auto members = groups.members(g);
    const auto cell = std::pair(points.large_keys[members[0]], points.classes[members[0]]);
    const auto it = extremes.try_emplace(cell, members.size(), members.size()).first;
    it->second = {std::min(it->second.first, members.size()), std::max(it->second.second, members.size())};
  }
  for (const auto& [cell, sizes] : extremes) EXPECT_LE(sizes.second - sizes.first, 1u);
}

/// A square cell of side a with c points in groups of 16 along a Morton curve: patches of about 16 / c of its area.
TEST(CellGroups, MembersLieNearEachOther) {
  const Points points = make_points();
  CellGroups groups;
  groups.build(points.keys, points.classes, kRules, kSeed);
  double within = 0.0, across = 0.0;
  size_t pairs = 0;
  for (size_t g = 0; g + 1 < groups.count(); ++g) {
    const auto members = groups.members(g);
    for (size_t i = 1; i < members.size(); ++i, ++pairs) {
      within += length(points.positions[members[i]] - points.positions[members[i - 1]]);
      across += length(points.positions[members[i]] - points.positions[(members[i] * 7919u) % kEntries]);
    }
  }
  EXPECT_LT(within, 0.1 * across);  // planted bug: sign-folded coordinates along the curve give 0.4
}

/// Entries in a row along the curve, of a square that one cell holds: any two of a row of as many as there are groups
/// are in different groups, and which of them share a group is another matter in each row.
TEST(CellGroups, InterleavedGroupsTakeOneOfEachRow) {
  constexpr uint32_t kCount = 1024, kGroups = kCount / 16;
  const GridLayout layout = make_grid_layout({.min_cell_size = 1.0f, .cell_pixels = 0.0f}, {}, 1, 0);
  std::vector<CellKey> keys;
  for (uint32_t i = 0; i < kCount; ++i) keys.push_back(cell_key(layout, {}, {0.0f, 0.0f, 1.0f}));
  const std::vector<uint32_t> classes(kCount, 0);
  std::vector<std::vector<size_t>> by_seed;
  for (const uint64_t seed : {1, 2}) {
    CellGroups groups;
    groups.build(keys, classes, kInterleaved, seed);
    ASSERT_EQ(groups.count(), kGroups);
    std::vector<size_t> group_of(kCount);
    for (size_t g = 0; g < kGroups; ++g)
      for (const uint32_t i : groups.members(g)) group_of[i] = g;
    std::set<size_t> shifts;
    for (uint32_t row = 0; row < kCount / kGroups; ++row) {
      const auto begin = group_of.begin() + row * kGroups;
      EXPECT_EQ(std::set<size_t>(begin, begin + kGroups).size(), kGroups);
      shifts.insert(*begin);
    }
    EXPECT_GE(shifts.size(), 8u);  // of 16 of 64 by chance, 1.3e-7 have fewer; planted bug: without turns, 1
    by_seed.push_back(std::move(group_of));
  }
  EXPECT_NE(by_seed[0], by_seed[1]);
}

TEST_P(CellGroupsOfBothKinds, AreTheSameForAnyNumberOfThreads) {
  const Points points = make_points();
  std::vector<std::vector<uint32_t>> all;
  for (const int threads : {1, 7}) {
    tbb::task_arena arena(threads);
    CellGroups groups;
    arena.execute([&] { groups.build(points.keys, points.classes, GetParam(), kSeed); });
    std::vector<uint32_t> flat;
    for (size_t g = 0; g < groups.count(); ++g) {
      flat.insert(flat.end(), groups.members(g).begin(), groups.members(g).end());
      flat.push_back(~0u);
    }
    all.push_back(std::move(flat));
  }
  EXPECT_EQ(all[0], all[1]);
}

TEST(CellGroups, NoEntriesMakeNoGroups) {
  CellGroups groups;
  groups.build({}, {}, kRules, kSeed);
  EXPECT_EQ(groups.count(), 0u);
}

}  // namespace
}  // namespace cistern
