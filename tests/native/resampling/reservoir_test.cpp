#include "resampling/reservoir.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "resampling/toy_lights.h"

namespace cistern::test {
namespace {

constexpr std::array<double, 7> kWeights{0.0, 0.5, 3.0, 0.0, 1e-3, 2.0, 0.0};
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::array<double, kWeights.size()> expected_counts(double total) {
  std::array<double, kWeights.size()> expected{};
  const double sum = std::accumulate(kWeights.begin(), kWeights.end(), 0.0);
  for (size_t i = 0; i < kWeights.size(); ++i) expected[i] = total * kWeights[i] / sum;
  return expected;
}

// Seed 1; false alarm with probability kFalseAlarmRate.
TEST(Reservoir, KeepsCandidatesInProportionToTheirWeights) {
  constexpr int kTrials = 300000;
  Rng rng(1, 0, 0, 0);
  uint64_t non_finite = 0;
  std::array<double, kWeights.size()> kept{}, forgetful{};
  for (int trial = 0; trial < kTrials; ++trial) {
    ReservoirBuilder<size_t> builder(non_finite);
    size_t last = 0;
    double sum_before = 0.0;
    for (size_t i = 0; i < kWeights.size(); ++i) {
      const float u = rng.next_float();
      builder.add(i, kWeights[i], 1.0f, u);
      if (u * sum_before < kWeights[i]) last = i;  // planted bug: weighed against the sum before it
      sum_before += kWeights[i];
    }
    ++kept[builder.finish(1.0f).sample];
    ++forgetful[last];
  }
  EXPECT_GT(chi_square_p_value(kept, expected_counts(kTrials)), kFalseAlarmRate);
  EXPECT_LT(chi_square_p_value(forgetful, expected_counts(kTrials)), kFalseAlarmRate);
  EXPECT_EQ(non_finite, 0u);
}

TEST(Reservoir, NeverKeepsACandidateOfZeroWeight) {
  uint64_t non_finite = 0;
  ReservoirBuilder<int> builder(non_finite);
  EXPECT_FALSE(builder.add(1, 0.0, 1.0f, 0.0f));
  EXPECT_TRUE(builder.add(2, 1e-30, 1.0f, 0.999f));
  EXPECT_FALSE(builder.add(3, 0.0, 1.0f, 0.0f));
  EXPECT_EQ(builder.finish(1.0f).sample, 2);
}

TEST(Reservoir, WeightIsTheSumOverTheTargetKept) {
  uint64_t non_finite = 0;
  ReservoirBuilder<int> builder(non_finite);
  builder.add(1, 0.5, 4.0f, 0.5f);
  EXPECT_TRUE(builder.add(2, 1.5, 8.0f, 0.5f));
  EXPECT_EQ(builder.p_hat(), 8.0f);
  EXPECT_EQ(builder.w_sum(), 2.0);
  const Reservoir<int> reservoir = builder.finish(3.0f);
  EXPECT_EQ(reservoir.sample, 2);
  EXPECT_EQ(reservoir.W, 0.25f);
  EXPECT_EQ(reservoir.c, 3.0f);
}

TEST(Reservoir, NothingFoundIsANullSampleThatKeepsItsConfidence) {
  uint64_t non_finite = 0;
  ReservoirBuilder<int> builder(non_finite);
  builder.add(7, 0.0, 0.0f, 0.5f);
  const Reservoir<int> reservoir = builder.finish(5.0f);
  EXPECT_EQ(reservoir.W, 0.0f);
  EXPECT_EQ(reservoir.c, 5.0f);
  EXPECT_EQ(non_finite, 0u);
}

TEST(Reservoir, CountsWeightsThatAreNoNumbers) {
  uint64_t non_finite = 0;
  ReservoirBuilder<int> builder(non_finite);
  for (double w : {double{kNan}, double{kInfinity}, -1.0}) EXPECT_FALSE(builder.add(1, w, 1.0f, 0.0f));
  EXPECT_EQ(non_finite, 3u);
  builder.add(2, 1.0, 2.0f, 0.5f);
  EXPECT_EQ(builder.finish(1.0f).W, 0.5f);

  ReservoirBuilder<int> overflowing(non_finite);
  overflowing.add(1, 1e30, 1e-30f, 0.5f);
  const Reservoir<int> reservoir = overflowing.finish(2.0f);
  EXPECT_EQ(non_finite, 4u);
  EXPECT_EQ(reservoir.W, 0.0f);
  EXPECT_EQ(reservoir.c, 2.0f);
}

TEST(Reservoir, CapLimitsConfidenceOnly) {
  const Reservoir<int> full{3, 0.5f, 40.0f};
  EXPECT_EQ(cap_confidence(full, 20.0f).c, 20.0f);
  EXPECT_EQ(cap_confidence(full, 20.0f).W, 0.5f);
  EXPECT_EQ(cap_confidence(full, 20.0f).sample, 3);
  EXPECT_EQ(cap_confidence(full, 50.0f).c, 40.0f);
}

}  // namespace
}  // namespace cistern::test
