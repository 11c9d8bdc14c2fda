#include "base/alias_table.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kDraws = 200000;

std::vector<float> uneven_weights(size_t count) {
  Rng rng(7, 0, 0, 0);
  std::vector<float> weights(count);
  for (float& w : weights) w = rng.next_float() < 0.2f ? 0.0f : std::exp(6.0f * rng.next_float());
  return weights;
}

double p_value_of(const AliasTable& table, const std::vector<float>& weights) {
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<double> observed(weights.size()), expected;
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < kDraws; ++i) ++observed[table.sample(rng.next_float())];
  for (const float w : weights) expected.push_back(kDraws * static_cast<double>(w) / sum);
  return chi_square_p_value(observed, expected);
}

TEST(AliasTable, DrawsInProportionToWeights) {
  const std::vector<float> weights = uneven_weights(500);
  EXPECT_GT(p_value_of(AliasTable(weights), weights), kFalseAlarmRate);
}

TEST(AliasTable, PlantedWrongWeightIsCaught) {
  std::vector<float> weights = uneven_weights(500);
  const AliasTable table(weights);
  *std::max_element(weights.begin(), weights.end()) *= 1.5f;
  EXPECT_LT(p_value_of(table, weights), kFalseAlarmRate);
}

TEST(AliasTable, ProbabilitiesSumToOneAndMatchWeights) {
  const std::vector<float> weights = uneven_weights(1000);
  const double weight_sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  const AliasTable table(weights);
  double sum = 0.0;
  for (uint32_t i = 0; i < table.size(); ++i) {
    sum += table.pmf(i);
    EXPECT_NEAR(table.pmf(i), weights[i] / weight_sum, 1e-6 * weights[i] / weight_sum);
  }
  EXPECT_NEAR(sum, 1.0, 1e-5);
}

/// p-value of the share of the heavy sixteenth of 2^20 indices, which has half of the weight.
double heavy_p_value(bool with_float) {
  std::vector<float> weights(1 << 20);
  Rng rng(8, 0, 0, 0);
  for (size_t i = 0; i < weights.size(); ++i) weights[i] = i % 16 == 0 ? 15.0f : 2.0f * rng.next_float();
  const AliasTable table(weights);
  double share = 0.0;
  for (uint32_t i = 0; i < weights.size(); i += 16) share += table.pmf(i);
  double heavy = 0.0;
  for (int i = 0; i < kDraws; ++i)
    heavy += table.sample(with_float ? rng.next_float() : rng.next_double()) % 16 == 0 ? 1.0 : 0.0;
  return z_test_p_value((heavy - kDraws * share) / std::sqrt(kDraws * share * (1.0 - share)));
}

TEST(AliasTable, LargeTablesKeepTheirWeights) {
  EXPECT_GT(heavy_p_value(false), kFalseAlarmRate);
  EXPECT_LT(heavy_p_value(true), kFalseAlarmRate) << "planted: 4 bits are left to choose within a column";
}

TEST(AliasTable, NeverDrawsWeightZero) {
  const std::vector<float> weights{0.0f, 3.0f, 0.0f, 1e-20f, 0.0f};
  const AliasTable table(weights);
  for (int i = 0; i < 1000; ++i) EXPECT_GT(weights[table.sample(static_cast<float>(i) / 1000.0f)], 0.0f);
  EXPECT_GT(weights[table.sample(kOneMinusEpsilon)], 0.0f);
}

TEST(AliasTable, IsEmptyWithoutWeight) {
  EXPECT_TRUE(AliasTable().is_empty());
  EXPECT_TRUE(AliasTable(std::vector<float>{}).is_empty());
  EXPECT_TRUE(AliasTable(std::vector<float>{0.0f, 0.0f}).is_empty());
}

}  // namespace
}  // namespace cistern::test
