#include "transport/guide_table.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "base/rng.h"
#include "base/sphere_map.h"
#include "transport/guide_training.h"

namespace cistern::test {
namespace {

const NestedCells kCells({}, Bounds3{{-4, -4, 0}, {4, 4, 4}}, {0, 0, 2}, 1e-3f, 0.0f);
const Vec3 kUp{0, 0, 1};

/// Light at points of a square of the floor that comes from about `towards`; all of it with equal weights but a
/// `heavy` share, which weighs a thousand times as much.
std::vector<GuideRecord> records(int count, Vec3 towards, float edge = 0.01f, float heavy = 0.0f) {
  std::vector<GuideRecord> result;
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < count; ++i) {
    const Vec3 position{1.0f + edge * rng.next_float(), 1.0f + edge * rng.next_float(), 0};
    const Vec3 w = normalize(towards + 0.2f * equal_area_direction(rng.next_vec2()));
    const float light = rng.next_float() < heavy ? 1000.0f : 1.0f;
    result.push_back({kCells.key(position, kUp), DirectionHistogram::bin(w), light});
  }
  return result;
}

GuideTable learn(std::span<const GuideRecord> of) {
  GuideTraining training;
  training.add(of);
  return training.learn();
}

TEST(GuideTable, LearnsWhereLightComesFrom) {
  const Vec3 towards = normalize({1, 0.5f, 1});
  const GuideTable table = learn(records(1000, towards));
  const DirectionHistogram* guide = table.find(kCells.key({1, 1, 0}, kUp));
  ASSERT_NE(guide, nullptr);
  EXPECT_GT(guide->pdf(towards), 2.0f);
  EXPECT_EQ(guide->pdf(-towards), 0.0f);
  EXPECT_EQ(table.find(kCells.key({1, 1, 0}, {1, 0, 0})), nullptr) << "other sides of surfaces see other light";
}

TEST(GuideTable, AsksForManySamplesThatWeighTheSame) {
  const NestedCellKey cell = kCells.key({1, 1, 0}, kUp);
  EXPECT_EQ(learn(records(100, kUp)).find(cell), nullptr);
  EXPECT_NE(learn(records(200, kUp)).find(cell), nullptr);
  EXPECT_EQ(learn(records(2000, kUp, 0.01f, 0.01f)).find(cell), nullptr) << "a few fireflies are all there is";
}

TEST(GuideTable, CoarserCellsStandInForFinerOnes) {
  const GuideTable table = learn(records(600, kUp, 0.4f));
  EXPECT_NE(table.find(kCells.key({1.2f, 1.2f, 0}, kUp)), nullptr);
}

TEST(GuideTraining, SameTableWhateverTheOrderAndTheThreads) {
  std::vector<GuideRecord> all = records(3000, normalize({1, 1, 1}), 0.4f, 0.001f);
  Rng rng(2, 0, 0, 0);
  for (GuideRecord& r : all) r.light *= 0.1f + rng.next_float();
  const auto table_of = [](std::vector<GuideRecord> records_of, int threads) {
    GuideTable table;
    tbb::task_arena arena(threads);
    arena.execute([&] { table = learn(records_of); });
    return table;
  };
  const GuideTable one = table_of(all, 1);
  std::reverse(all.begin(), all.end());
  const GuideTable other = table_of(all, 4);
  ASSERT_EQ(one.row_count(), other.row_count());
  for (float x = 1.0f; x < 1.4f; x += 0.01f) {
    const NestedCellKey cell = kCells.key({x, 1.2f, 0}, kUp);
    const DirectionHistogram *a = one.find(cell), *b = other.find(cell);
    ASSERT_EQ(a == nullptr, b == nullptr);
    for (uint32_t bin = 0; a && bin < DirectionHistogram::kBins; ++bin) ASSERT_EQ(a->pmf(bin), b->pmf(bin));
  }
}

}  // namespace
}  // namespace cistern::test
