#include "resampling/mis_weight.h"

#include <gtest/gtest.h>

#include <array>

namespace cistern::test {
namespace {

TEST(MisWeight, OnlyThisPlaceKnowsWhatBiasMeans) {
  EXPECT_EQ(mis_weight_for(Bias::FAST, 1), MisWeight::CONSTANT);
  EXPECT_EQ(mis_weight_for(Bias::FAST, 6), MisWeight::CONSTANT);
  EXPECT_EQ(mis_weight_for(Bias::UNBIASED, 1), MisWeight::BALANCE);
  EXPECT_EQ(mis_weight_for(Bias::UNBIASED, 2), MisWeight::BALANCE);
  EXPECT_EQ(mis_weight_for(Bias::UNBIASED, 3), MisWeight::PAIRWISE);
}

// For one sample y: the receiver's share and what every neighbour would take, had it made y.
TEST(MisWeight, PairwiseSharesSumToOne) {
  constexpr std::array<double, 3> kConfidences{1.0, 20.0, 0.25};
  constexpr double kReceiver = 2.0, kSum = kReceiver + 1.0 + 20.0 + 0.25;
  for (double p_hat_0 : {1e-6, 1.0, 1e6}) {
    for (const std::array<double, 3>& p_hat : {std::array{0.0, 0.0, 0.0}, std::array{0.0, 1e-9, 5.0},
                                               std::array{3.0, 1e9, 1.0}, std::array{1.0, 1.0, 1.0}}) {
      double sum = kReceiver / kSum;
      for (size_t j = 0; j < p_hat.size(); ++j) {
        sum += pairwise_weight_of_neighbour(kConfidences[j], p_hat[j], kReceiver, p_hat_0, kSum);
        sum += pairwise_weight_of_receiver(kConfidences[j], p_hat[j], kReceiver, p_hat_0, kSum);
      }
      EXPECT_NEAR(sum, 1.0, 1e-12);
    }
  }
}

TEST(MisWeight, PairwiseGivesNothingToANeighbourThatCannotMakeTheSample) {
  EXPECT_EQ(pairwise_weight_of_neighbour(5.0, 0.0, 1.0, 1.0, 6.0), 0.0);
  EXPECT_EQ(pairwise_weight_of_neighbour(5.0, 0.0, 0.0, 1.0, 5.0), 0.0);  // nor is 0 / 0 a weight
}

TEST(MisWeight, PairwiseOfTwoEqualsIsTheBalanceHeuristicMadeDefensive) {
  // C = 4, a = 3 p_1, b = p_0: the neighbour gets 3/4 · 3/(3 + 1) of a sample both make equally well.
  EXPECT_DOUBLE_EQ(pairwise_weight_of_neighbour(3.0, 1.0, 1.0, 1.0, 4.0), 9.0 / 16.0);
  EXPECT_DOUBLE_EQ(pairwise_weight_of_receiver(3.0, 1.0, 1.0, 1.0, 4.0), 3.0 / 16.0);
}

}  // namespace
}  // namespace cistern::test
