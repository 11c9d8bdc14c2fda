#include "support/statistics.h"

#include <gtest/gtest.h>

#include <array>

#include "base/rng.h"

namespace cistern::test {
namespace {

TEST(Statistics, MatchesTabulatedQuantiles) {
  // Abramowitz and Stegun, tables 26.8 and 26.10: upper 5 % and 1 % points.
  EXPECT_NEAR(upper_incomplete_gamma(0.5, 3.841459 / 2), 0.05, 1e-6);
  EXPECT_NEAR(upper_incomplete_gamma(5.0, 18.307038 / 2), 0.05, 1e-6);
  EXPECT_NEAR(upper_incomplete_gamma(50.0, 135.806723 / 2), 0.01, 1e-6);
  EXPECT_NEAR(z_test_p_value(1.959964), 0.05, 1e-6);
  EXPECT_NEAR(t_test_p_value(2.228139, 10), 0.05, 1e-6);
  EXPECT_NEAR(t_test_p_value(-4.604095, 4), 0.01, 1e-6);
}

// Seed 1; a right die fails falsely with probability kFalseAlarmRate.
TEST(Statistics, ChiSquareTellsARightDieFromALoadedOne) {
  constexpr int kRolls = 60000;
  std::array<double, 6> fair{}, loaded{}, expected;
  expected.fill(kRolls / 6.0);
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < kRolls; ++i) {
    ++fair[static_cast<size_t>(rng.next_float() * 6.0f)];
    ++loaded[static_cast<size_t>(rng.next_float() * 5.9f)];  // planted bug: the last face comes up too rarely
  }
  EXPECT_GT(chi_square_p_value(fair, expected), kFalseAlarmRate);
  EXPECT_LT(chi_square_p_value(loaded, expected), kFalseAlarmRate);
}

TEST(Statistics, PoolsSmallBins) {
  const std::array<double, 5> expected{100.0, 1.0, 1.0, 1.0, 100.0};
  const std::array<double, 5> one_rare_bin_hit_three_times{100.0, 3.0, 0.0, 0.0, 100.0};
  EXPECT_GT(chi_square_p_value(one_rare_bin_hit_three_times, expected), 0.9);
  const std::array<double, 2> impossible{0.0, 10.0}, counts{1.0, 9.0};
  EXPECT_EQ(chi_square_p_value(counts, impossible), 0.0);
}

TEST(Statistics, MomentsAndMeans) {
  Moments a, b;
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 10000; ++i) {
    a.add(rng.next_float());
    b.add(rng.next_float() + 0.03f);
  }
  EXPECT_NEAR(a.variance(), 1.0 / 12.0, 0.003);
  EXPECT_GT(mean_p_value(a, 0.5), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(b, 0.5), kFalseAlarmRate);
  EXPECT_LT(same_mean_p_value(a, b), kFalseAlarmRate);
}

}  // namespace
}  // namespace cistern::test
