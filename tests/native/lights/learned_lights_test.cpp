#include "lights/learned_lights.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "lights/light_scenes.h"
#include "lights/light_training.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr uint32_t kLampCount = 40;
const Bounds3 kBox{{-4, -4, 0}, {4, 4, 4}};
const Vec3 kUp{0, 0, 1};

std::shared_ptr<Scene> lamps() {
  auto scene = std::make_shared<Scene>();
  Rng rng(1, 0, 0, 0);
  for (uint32_t i = 0; i < kLampCount; ++i) {
    const Vec3 position{8 * rng.next_float() - 4, 8 * rng.next_float() - 4, 1 + 3 * rng.next_float()};
    scene->lights.push_back(make_light(PointLight{position, 0.1f, Rgb(1.0f + 4.0f * rng.next_float()), true}));
  }
  return scene;
}

NestedCells cells() { return NestedCells({}, kBox, {0, 0, 2}, 1e-3f, 0.0f); }

/// A lamp's light at a place: near lamps bring more, every third is hidden.
LightRecord record(const NestedCells& grid, Vec3 position, uint32_t lamp, float noise) {
  const float unshadowed = noise / (1.0f + static_cast<float>(lamp));
  return {grid.key(position, kUp), lamp, lamp % 3 == 0 ? 0.0f : unshadowed, unshadowed};
}

/// Of points in the quadrant x, y > 0 of the floor.
std::vector<LightRecord> records(int count, uint32_t seed = 0) {
  const NestedCells grid = cells();
  std::vector<LightRecord> result;
  Rng rng(2, seed, 0, 0);
  for (int i = 0; i < count; ++i) {
    const Vec3 p{4 * rng.next_float(), 4 * rng.next_float(), 0};
    const auto lamp = static_cast<uint32_t>(rng.next_float() * kLampCount);
    result.push_back(record(grid, p, lamp, 0.5f + rng.next_float()));
  }
  return result;
}

LearnedLightTable learn(std::span<const LightRecord> of) {
  LightTraining training;
  training.add(of);
  return training.learn();
}

TEST(LearnedLights, SampleAsTheLightSetUntilTaught) {
  const LightSet lights(lamps(), LightSampling::TREE);
  const LearnedLights learned(lights, cells());
  const auto chooser = learned.chooser({1, 1, 0}, kUp);
  EXPECT_EQ(chooser.row, nullptr);
  EXPECT_EQ(chooser.candidates, 1);
  for (const double u : {0.0, 0.3, 0.99}) {
    const auto a = learned.choose(chooser, u, 0.5f, {0.1f, 0.2f});
    const auto b = lights.choose({1, 1, 0}, kUp, u, {0.1f, 0.2f});
    EXPECT_EQ(a->sample.emitter, b->sample.emitter);
    EXPECT_EQ(a->pmf, b->pmf);
    EXPECT_EQ(learned.pmf(chooser, a->sample.emitter), lights.pmf(a->sample.emitter, {1, 1, 0}, kUp));
  }
}

/// Draws of a taught sampler against its probabilities; what is rejected has a bin of its own.
double draw_p_value(const LearnedLights& learned, Vec3 position, float planted_factor = 1.0f) {
  constexpr int kDraws = 40000;
  const auto chooser = learned.chooser(position, kUp);
  EXPECT_NE(chooser.row, nullptr);
  std::vector<double> observed(kLampCount + 1), expected(kLampCount + 1);
  Rng rng(3, 0, 0, 0);
  for (int i = 0; i < kDraws; ++i) {
    const auto choice = learned.choose(chooser, rng.next_double(), rng.next_float(), {});
    ++observed[choice ? choice->sample.emitter : kLampCount];
    if (!choice) continue;
    EXPECT_NEAR(choice->pmf, learned.pmf(chooser, choice->sample.emitter), 1e-6f);
    EXPECT_GT(choice->visibility, 0.0f);
  }
  double sum = 0.0;
  for (uint32_t e = 0; e < kLampCount; ++e) {
    const double pmf = learned.pmf(chooser, e);
    EXPECT_GT(pmf, 0.0);
    sum += pmf;
    expected[e] = kDraws * pmf;
  }
  EXPECT_LE(sum, 1.0 + 1e-5);
  EXPECT_GT(sum, 0.7) << "only draws by the light set can be rejected";
  expected[kLampCount] = kDraws * (1.0 - sum);
  expected[1] *= planted_factor;
  return chi_square_p_value(observed, expected);
}

TEST(LearnedLights, DrawWithTheirProbabilities) {
  const LightSet lights(lamps(), LightSampling::TREE);
  for (const size_t most_clusters : {EmitterClusters::kMostClusters, size_t{8}}) {
    LearnedLights learned(lights, cells(), most_clusters);
    std::vector<LightRecord> taught = records(40000);
    for (LightRecord& r : taught) r.cluster = learned.clusters().cluster_of(r.cluster);
    learned.set_table(learn(taught));
    EXPECT_GT(draw_p_value(learned, {1, 1, 0}), shared_rate(2));
    EXPECT_LT(draw_p_value(learned, {1, 1, 0}, 0.8f), shared_rate(2)) << "planted: a lamp's share";
  }
}

TEST(LearnedLights, PreferWhatWasVisible) {
  const LightSet lights(lamps(), LightSampling::UNIFORM);
  LearnedLights learned(lights, cells());
  learned.set_table(learn(records(40000)));
  const auto chooser = learned.chooser({1, 1, 0}, kUp);
  EXPECT_GT(learned.pmf(chooser, 1), 2.0f * learned.pmf(chooser, 4)) << "five halves of its light";
  EXPECT_GT(learned.pmf(chooser, 1), 1.5f * learned.pmf(chooser, 0)) << "brighter, but hidden";
}

TEST(LearnedLights, EstimatesDoNotDependOnTheTable) {
  // Mean of F / pmf over draws, for an F that the table knows nothing of; planted: the light set's probability instead.
  const LightSet lights(lamps(), LightSampling::POWER);
  LearnedLights learned(lights, cells());
  learned.set_table(learn(records(40000)));
  const auto chooser = learned.chooser({1, 1, 0}, kUp);
  const auto brings = [](uint32_t e) { return 1.0 + (e * 7) % 5; };
  double truth = 0.0;
  for (uint32_t e = 0; e < kLampCount; ++e) truth += brings(e);
  Moments right, planted;
  Rng rng(4, 0, 0, 0);
  for (int i = 0; i < 100000; ++i) {
    const auto choice = learned.choose(chooser, rng.next_double(), rng.next_float(), {});
    const uint32_t e = choice ? choice->sample.emitter : 0;
    right.add(choice ? brings(e) / choice->pmf : 0.0);
    planted.add(choice ? brings(e) / lights.pmf(e, {1, 1, 0}, kUp) : 0.0);
  }
  EXPECT_GT(mean_p_value(right, truth), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(planted, truth), kFalseAlarmRate);
}

/// A point beside another: in another cell, which the next coarser one joins with the first.
Vec3 sibling(const NestedCells& grid, Vec3 p) {
  const NestedCellKey key = grid.key(p, kUp);
  Rng rng(5, 0, 0, 0);
  for (;;) {
    const Vec3 q = p + Vec3{0.2f * (rng.next_float() - 0.5f), 0.2f * (rng.next_float() - 0.5f), 0.0f};
    const NestedCellKey other = grid.key(q, kUp);
    if (other != key && coarser_cell(other) == coarser_cell(key)) return q;
  }
}

TEST(LearnedLightTable, TakesTheFinestCellThatHasSeenEnough) {
  const NestedCells grid = cells();
  const Vec3 busy{1, 1, 0}, quiet = sibling(grid, busy);
  std::vector<LightRecord> some;
  for (uint32_t i = 0; i < 70; ++i) some.push_back({grid.key(busy, kUp), i % 4 + 1, 1.0f, 1.0f});
  some.push_back({grid.key(quiet, kUp), 9, 1.0f, 1.0f});
  const LearnedLightTable table = learn(some);
  const auto* own = table.find(grid.key(busy, kUp));
  const auto* around = table.find(grid.key(quiet, kUp));
  ASSERT_TRUE(own && around);
  EXPECT_NEAR(own->effective_sample_size, 70.0f, 1e-3f);
  EXPECT_NEAR(around->effective_sample_size, 71.0f, 1e-3f) << "a coarser cell has both";
  EXPECT_FALSE(table.find(*own, 9));
  EXPECT_FALSE(table.find(grid.key({-3, -3, 0}, kUp))) << "nobody was there";
  some.resize(60);
  EXPECT_FALSE(learn(some).find(grid.key(busy, kUp))) << "too few";
}

TEST(LearnedLightTable, CountsSamplesByTheirWeights) {
  // 100 records of which one has almost all of the weight are worth about one.
  const NestedCells grid = cells();
  std::vector<LightRecord> some(100, LightRecord{grid.key({1, 1, 0}, kUp), 1, 1.0f, 1.0f});
  EXPECT_TRUE(learn(some).find(some[0].cell));
  some[0].visible = 1000.0f;
  EXPECT_FALSE(learn(some).find(some[0].cell));
}

TEST(LearnedLightTable, TakesMoreCandidatesWhereMoreLightsMatter) {
  const NestedCells grid = cells();
  const auto candidates = [&](uint32_t lights) {
    std::vector<LightRecord> some;
    for (uint32_t i = 0; i < 400; ++i) some.push_back({grid.key({1, 1, 0}, kUp), i % lights, 1.0f, 1.0f});
    return learn(some).find(some[0].cell)->candidates;
  };
  EXPECT_EQ(candidates(1), 1);
  EXPECT_EQ(candidates(3), 2);
  EXPECT_EQ(candidates(20), 4);
}

TEST(LightTraining, SameTableForAnyOrderAndNumberOfThreads) {
  const std::vector<LightRecord> all = records(30000);
  const auto learn_with = [&](int threads, bool reversed) {
    std::vector<LightRecord> order = all;
    if (reversed) std::reverse(order.begin(), order.end());
    LearnedLightTable table;
    tbb::task_arena(threads).execute([&] { table = learn(order); });
    return table;
  };
  const LearnedLightTable one = learn_with(1, false);
  for (const auto& other : {learn_with(2, true), learn_with(7, false)}) {
    ASSERT_EQ(one.row_count(), other.row_count());
    for (const LightRecord& r : records(500, 1)) {
      const auto *a = one.find(r.cell), *b = other.find(r.cell);
      ASSERT_EQ(a == nullptr, b == nullptr);
      if (!a) continue;
      EXPECT_EQ(a->entropy, b->entropy);
      const auto *x = one.find(*a, r.cluster), *y = other.find(*b, r.cluster);
      ASSERT_EQ(x == nullptr, y == nullptr);
      EXPECT_EQ(x ? x->pmf : 0.0f, y ? y->pmf : 0.0f);
    }
  }
}

}  // namespace
}  // namespace cistern::test
