#include "grid/hash_grid.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <map>
#include <string>

#include "base/check.h"
#include "base/rng.h"

namespace cistern::test {
namespace {

constexpr size_t kManyEntries = 300000;  // several blocks, the last one short

/// Keys of `cells` cells, some crowded, some of one entry, with all 63 bits in use; one in 16 entries has no cell.
std::vector<CellKey> random_keys(size_t count, uint32_t cells) {
  Rng rng(1, 0, 0, 0);
  std::vector<CellKey> keys(count);
  for (CellKey& key : keys) {
    const double u = rng.next_double();
    key = rng.next_float() < 0.0625f ? kNoCell : mix_bits(static_cast<uint64_t>(u * u * u * cells)) >> 1;
  }
  return keys;
}

struct Grouping {
  std::vector<CellSegment> segments;
  std::vector<uint32_t> entries;
};

Grouping grouping_of(const HashGrid& grid) {
  return {{grid.segments().begin(), grid.segments().end()}, {grid.entries().begin(), grid.entries().end()}};
}

/// What is wrong with a grouping of keys, compared with one by std::map; empty if nothing.
std::string fault_of(const Grouping& grouping, const std::vector<CellKey>& keys) {
  std::map<CellKey, std::vector<uint32_t>> cells;
  for (uint32_t i = 0; i < keys.size(); ++i)
    if (keys[i] != kNoCell) cells[keys[i]].push_back(i);
  if (grouping.segments.size() != cells.size()) return "number of cells";
  uint32_t position = 0;
  auto segment = grouping.segments.begin();
  for (const auto& [key, members] : cells) {
    if (segment->key != key) return "key";
    if (segment->begin != position || segment->end != position + members.size()) return "bounds";
    for (const uint32_t member : members)
      if (grouping.entries[position++] != member) return "entries";
    ++segment;
  }
  return position == grouping.entries.size() ? "" : "entries left over";
}

TEST(HashGrid, GroupsEntriesByKeyInOrder) {
  HashGrid grid;
  for (const uint32_t cells : {1u, 2u, 1000u, 10000000u}) {
    const std::vector<CellKey> keys = random_keys(kManyEntries, cells);
    grid.build(keys);
    EXPECT_EQ(fault_of(grouping_of(grid), keys), "") << cells << " cells";
  }
}

TEST(HashGrid, PlantedUnstableOrderIsCaught) {
  const std::vector<CellKey> keys = random_keys(1000, 10);
  HashGrid grid;
  grid.build(keys);
  Grouping grouping = grouping_of(grid);
  std::swap(grouping.entries[0], grouping.entries[1]);
  EXPECT_EQ(fault_of(grouping, keys), "entries") << "two entries of a cell exchanged";
  grouping = grouping_of(grid);
  grouping.segments.back().end -= 1;
  EXPECT_EQ(fault_of(grouping, keys), "bounds") << "an entry dropped";
}

TEST(HashGrid, FindsEveryCellAndNoOther) {
  const std::vector<CellKey> keys = random_keys(kManyEntries, 50000);
  HashGrid grid;
  grid.build(keys);
  for (const CellSegment& segment : grid.segments()) {
    const std::span<const uint32_t> found = grid.find(segment.key);
    ASSERT_EQ(found.data(), grid.entries().data() + segment.begin);
    ASSERT_EQ(found.size(), segment.end - segment.begin);
  }
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 10000; ++i)
    ASSERT_TRUE(grid.find((uint64_t{rng.next_uint32()} << 31) ^ rng.next_uint32()).empty());
  EXPECT_TRUE(grid.find(kNoCell).empty());
}

TEST(HashGrid, ACrowdedCellDropsNothing) {
  HashGrid grid;
  grid.build(std::vector<CellKey>(kManyEntries, 42));
  ASSERT_EQ(grid.segments().size(), 1u);
  ASSERT_EQ(grid.find(42).size(), kManyEntries);
  EXPECT_EQ(grid.find(42)[kManyEntries - 1], kManyEntries - 1);
}

TEST(HashGrid, MayBeEmpty) {
  HashGrid grid;
  EXPECT_TRUE(grid.find(0).empty()) << "never built";
  for (const size_t count : {0, 1, 100000}) {
    grid.build(std::vector<CellKey>(count, kNoCell));
    EXPECT_TRUE(grid.segments().empty());
    EXPECT_TRUE(grid.find(0).empty());
  }
  grid.build(std::vector<CellKey>{0});
  EXPECT_EQ(grid.find(0).size(), 1u);
}

TEST(HashGrid, DoesNotDependOnThreads) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 7);
  const std::vector<CellKey> keys = random_keys(kManyEntries, 50000);
  for (const int threads : {1, 2, 7}) {
    tbb::task_arena arena(threads);
    HashGrid grid;
    arena.execute([&] { grid.build(keys); });
    EXPECT_EQ(fault_of(grouping_of(grid), keys), "") << threads << " threads";
    for (const CellSegment& segment : grid.segments())
      ASSERT_EQ(grid.find(segment.key).data(), grid.entries().data() + segment.begin) << threads << " threads";
  }
}

TEST(HashGrid, RebuildsWithoutAllocation) {
  HashGrid grid;
  const std::vector<CellKey> keys = random_keys(kManyEntries, 50000);
  grid.build(keys);
  const size_t bytes = grid.memory_bytes();
  EXPECT_GE(bytes, kManyEntries * 15 / 16 * 2 * (sizeof(CellKey) + sizeof(uint32_t)));
  grid.build(random_keys(1000, 10));
  EXPECT_EQ(grid.memory_bytes(), bytes);
  grid.build(keys);
  EXPECT_EQ(grid.memory_bytes(), bytes);
  EXPECT_EQ(fault_of(grouping_of(grid), keys), "");
}

TEST(HashGrid, TooManyEntriesAreAnError) {
  const CellKey key = 0;
  HashGrid grid;
  EXPECT_THROW(grid.build(std::span(&key, (size_t{1} << 31) + 1)), Error);
}

}  // namespace
}  // namespace cistern::test
