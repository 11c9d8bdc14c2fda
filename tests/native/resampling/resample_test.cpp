#include "resampling/resample.h"

#include <gtest/gtest.h>

#include <limits>

#include "resampling/toy_lights.h"

namespace cistern::test {
namespace {

constexpr std::array<MisWeight, 3> kUnbiased{MisWeight::CONTRIBUTION, MisWeight::BALANCE, MisWeight::PAIRWISE};
constexpr std::array<MisWeight, 4> kAll{MisWeight::CONSTANT, MisWeight::CONTRIBUTION, MisWeight::BALANCE,
                                        MisWeight::PAIRWISE};
constexpr size_t kReceivers = 4;
// The receiver sees lights 0-7; the first neighbour 4-11; the second the same as the receiver with other strengths; the
// third nothing at all: its reservoirs are always null.
constexpr std::array<Targets, kReceivers> kTargets{
    Targets{1.0f, 2.0f, 0.5f, 4.0f, 1.0f, 0.2f, 3.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f},
    Targets{0.0f, 0.0f, 0.0f, 0.0f, 2.0f, 2.0f, 0.1f, 1.0f, 9.0f, 1.0f, 1.0f, 5.0f},
    Targets{40.f, 2.0f, 1.0f, 1.0f, 30.f, 5.0f, 0.3f, 2.0f, 0.0f, 0.0f, 0.0f, 0.0f},
    Targets{},
};
constexpr std::array<float, kReceivers> kConfidences{1.0f, 3.0f, 0.5f, 2.0f};
constexpr int kRuns = 60000;

float toy_target(size_t i, size_t light) { return kTargets[i][light]; }

std::array<LightReservoir, kReceivers> initial_reservoirs(Rng& rng, uint64_t& non_finite, int M) {
  std::array<LightReservoir, kReceivers> result;
  for (size_t i = 0; i < kReceivers; ++i)
    result[i] = initial_reservoir(kTargets[i], M, kConfidences[i], rng, non_finite);
  return result;
}

/// Mean weights of what `merge` makes of initial reservoirs.
template <class Merge>
MeanWeights mean_weights(uint64_t seed, const Merge& merge, int M = 3) {
  MeanWeights means;
  Rng rng(seed, 0, 0, 0);
  uint64_t non_finite = 0;
  for (int run = 0; run < kRuns; ++run) means.add(merge(initial_reservoirs(rng, non_finite, M), rng, non_finite));
  EXPECT_EQ(non_finite, 0u);
  return means;
}

MeanWeights mean_weights(uint64_t seed, MisWeight weights) {
  return mean_weights(seed, [&](const auto& candidates, Rng& rng, uint64_t& non_finite) {
    return resample<size_t>(candidates, toy_target, weights, rng, non_finite);
  });
}

// Seeds 1-3; false alarm with probability kFalseAlarmRate each. W is an unbiased contribution weight iff its mean over
// runs where light s was chosen is 1, for each s.
TEST(Resample, UnbiasedWeightsAreRightForEachLight) {
  for (size_t i = 0; i < kUnbiased.size(); ++i)
    EXPECT_GT(mean_weights(1 + i, kUnbiased[i]).p_value(seen_by(kTargets[0])), kFalseAlarmRate) << i;
}

// Planted bug: 1/M where balance is promised. Its error is known exactly: light s gets the share of the confidences
// whose receivers see it. Seed 4; false alarm with probability kFalseAlarmRate.
TEST(Resample, ConstantWeightsAreWrongByTheShareOfThoseThatCannotSeeTheLight) {
  const MeanWeights means = mean_weights(4, MisWeight::CONSTANT);
  EXPECT_LT(means.p_value(seen_by(kTargets[0])), kFalseAlarmRate);
  const float c_sum = std::accumulate(kConfidences.begin(), kConfidences.end(), 0.0f);
  std::array<double, kLights> expected{};
  for (size_t s = 0; s < kLights; ++s) {
    for (size_t i = 0; i < kReceivers && kTargets[0][s] > 0.0f; ++i)
      expected[s] += kTargets[i][s] > 0.0f ? double{kConfidences[i] / c_sum} : 0.0;
  }
  EXPECT_GT(means.p_value(expected), kFalseAlarmRate);
}

/// [Ouyang 2021] Alg. 4 l.14-20 word for word, but for the Jacobian: Z counts the members of Q that can make the chosen
/// sample.
LightReservoir merge_with_q(std::span<const LightReservoir> candidates, std::span<const size_t> q, Rng& rng) {
  double w_sum = 0.0;
  LightReservoir merged;
  for (const auto& [light, W, c] : candidates) {
    merged.c += c;
    const double w = double{c} * kTargets[0][light] * W;
    w_sum += w;
    if (w > 0.0 && rng.next_float() * w_sum < w) merged.sample = light;
  }
  float z = 0.0f;
  for (size_t j : q) z += kTargets[j][merged.sample] > 0.0f ? candidates[j].c : 0.0f;
  if (w_sum > 0.0) merged.W = static_cast<float>(w_sum / (double{z} * kTargets[0][merged.sample]));
  return merged;
}

// Line 15 intersects the set of merged pixels with each next one where it means to unite them. No two pixels are the
// same, so at most the receiver is left. Seeds 31, 32; false alarm with probability kFalseAlarmRate.
TEST(Resample, PlantedIntersectionOfQIsSeen) {
  const auto mean_with = [](uint64_t seed, std::vector<size_t> q) {
    return mean_weights(seed,
                        [&](const auto& candidates, Rng& rng, uint64_t&) { return merge_with_q(candidates, q, rng); });
  };
  EXPECT_GT(mean_with(31, {0, 1, 2, 3}).p_value(seen_by(kTargets[0])), kFalseAlarmRate);
  EXPECT_LT(mean_with(32, {0}).p_value(seen_by(kTargets[0])), kFalseAlarmRate) << "as printed";
}

/// Merges the listed candidates, in this order.
template <class Candidates>
LightReservoir merge_listed(const Candidates& candidates, std::span<const size_t> list, MisWeight weights, Rng& rng,
                            uint64_t& non_finite) {
  std::vector<LightReservoir> listed;
  for (size_t j : list) listed.push_back(candidates[j]);
  const auto target = [&](size_t i, size_t light) { return kTargets[list[i]][light]; };
  return resample<size_t>(listed, target, weights, rng, non_finite);
}

// Neighbours drawn at random, perhaps one of them twice, or the receiver itself. Seeds 5-7; false alarm with
// probability kFalseAlarmRate each.
TEST(Resample, AnyListDrawnWithoutLookingIsUnbiased) {
  for (size_t i = 0; i < kUnbiased.size(); ++i) {
    const MeanWeights means = mean_weights(5 + i, [&](const auto& candidates, Rng& rng, uint64_t& non_finite) {
      std::array<size_t, 4> list{};
      for (size_t j = 1; j < list.size(); ++j) list[j] = static_cast<size_t>(rng.next_float() * kReceivers);
      return merge_listed(candidates, list, kUnbiased[i], rng, non_finite);
    });
    EXPECT_GT(means.p_value(seen_by(kTargets[0])), kFalseAlarmRate) << i;
  }
}

// Planted bug: only neighbours that found something are listed, so the list depends on the samples.
TEST(Resample, DroppingNullCandidatesIsSeen) {
  for (size_t i = 0; i < kUnbiased.size(); ++i) {
    const auto merge_found = [&](const auto& candidates, Rng& rng, uint64_t& non_finite) {
      std::vector<size_t> list{0};
      for (size_t j = 1; j < kReceivers; ++j) {
        if (candidates[j].W > 0.0f) list.push_back(j);
      }
      return merge_listed(candidates, list, kUnbiased[i], rng, non_finite);
    };
    EXPECT_LT(mean_weights(24 + i, merge_found, 1).p_value(seen_by(kTargets[0])), kFalseAlarmRate) << i;
  }
}

/// Neighbour 2 must not give lights 0 and 4.
bool is_refused(size_t i, size_t light) { return i == 2 && light % 4 == 0; }

// Seeds 8-10; false alarm with probability kFalseAlarmRate each.
TEST(Resample, RefusingASampleByItsTargetIsUnbiased) {
  const auto target = [](size_t i, size_t light) { return is_refused(i, light) ? 0.0f : toy_target(i, light); };
  for (size_t i = 0; i < kUnbiased.size(); ++i) {
    const MeanWeights means = mean_weights(8 + i, [&](const auto& candidates, Rng& rng, uint64_t& non_finite) {
      return resample<size_t>(candidates, target, kUnbiased[i], rng, non_finite);
    });
    EXPECT_GT(means.p_value(seen_by(kTargets[0])), kFalseAlarmRate) << i;
  }
}

// Planted bug: the refused sample is taken out where it is found, but its receiver still counts as able to make it.
TEST(Resample, RefusingASampleOneWayIsSeen) {
  for (size_t i = 0; i < kUnbiased.size(); ++i) {
    const MeanWeights means = mean_weights(11 + i, [&](auto candidates, Rng& rng, uint64_t& non_finite) {
      if (is_refused(2, candidates[2].sample)) candidates[2].W = 0.0f;
      return resample<size_t>(candidates, toy_target, kUnbiased[i], rng, non_finite);
    });
    EXPECT_LT(means.p_value(seen_by(kTargets[0])), kFalseAlarmRate) << i;
  }
}

// A merge of reservoirs of one receiver is the reservoir of all their candidates: the same W, the same law of choice.
// Seed 14; false alarm with probability kFalseAlarmRate.
TEST(Resample, MergeIsTheConcatenatedStream) {
  constexpr std::array<size_t, 9> kStream{3, 1, 0, 8, 6, 2, 2, 11, 5};
  constexpr std::array<size_t, 4> kCuts{0, 2, 3, 9};  // unequal numbers of candidates: M = 2, 1, 6
  const auto reservoir = [&](size_t first, size_t last, Rng& rng, uint64_t& non_finite) {
    ReservoirBuilder<size_t> builder(non_finite);
    const auto M = static_cast<double>(last - first);
    for (size_t i = first; i < last; ++i) {
      const float p_hat = kTargets[0][kStream[i]];
      builder.add(kStream[i], p_hat * kLights / M, p_hat, rng.next_float());
    }
    return builder.finish(static_cast<float>(M));
  };
  constexpr int kTrials = 100000;
  Rng rng(14, 0, 0, 0);
  uint64_t non_finite = 0;
  const LightReservoir whole = reservoir(0, kStream.size(), rng, non_finite);
  const double w_sum = double{whole.W} * kTargets[0][whole.sample];
  std::array<double, kLights> chosen{}, expected{};
  for (size_t light : kStream) expected[light] += kTrials * kTargets[0][light] * kLights / (9.0 * w_sum);
  for (int trial = 0; trial < kTrials; ++trial) {
    std::array<LightReservoir, 3> parts;
    for (size_t k = 0; k < 3; ++k) parts[k] = reservoir(kCuts[k], kCuts[k + 1], rng, non_finite);
    const auto same = [](size_t, size_t light) { return kTargets[0][light]; };
    const LightReservoir merged = resample<size_t>(parts, same, kAll[trial % 2 ? 0 : 2], rng, non_finite);
    ASSERT_NEAR(merged.W * kTargets[0][merged.sample], w_sum, 1e-5 * w_sum);
    ASSERT_EQ(merged.c, 9.0f);
    ++chosen[merged.sample];
    for (LightReservoir& part : parts) part.c = 1.0f;  // planted bug: every reservoir counts the same
    const LightReservoir wrong = resample<size_t>(parts, same, MisWeight::CONSTANT, rng, non_finite);
    ASSERT_GT(std::abs(wrong.W * kTargets[0][wrong.sample] - w_sum), 1e-2 * w_sum);
  }
  EXPECT_GT(chi_square_p_value(chosen, expected), kFalseAlarmRate);
}

// A history of 30 frames with a cap, its receiver moving between two places. Seed 15 (and 16 for the planted bug);
// false alarm with probability kFalseAlarmRate.
TEST(Resample, ACappedHistoryStaysUnbiased) {
  constexpr int kFrames = 30;
  constexpr float kCap = 5.0f;
  const auto last_frame = [&](Rng& rng, bool forgets_to_cap_before_merging) {
    uint64_t non_finite = 0;
    LightReservoir history;
    for (size_t frame = 0; frame < kFrames; ++frame) {
      const size_t now = frame % 2, before = 1 - now;
      const std::array candidates{initial_reservoir(kTargets[now], 2, 1.0f, rng, non_finite),
                                  forgets_to_cap_before_merging ? history : cap_confidence(history, kCap)};
      const auto target = [&](size_t i, size_t light) { return kTargets[i == 0 ? now : before][light]; };
      history = resample<size_t>(candidates, target, MisWeight::BALANCE, rng, non_finite);
    }
    return history;
  };
  Rng rng(15, 0, 0, 0);
  MeanWeights means;
  for (int run = 0; run < kRuns / 4; ++run) {
    const LightReservoir reservoir = last_frame(rng, false);
    means.add(reservoir);
    ASSERT_EQ(reservoir.c, kCap + 1.0f);
  }
  EXPECT_GT(means.p_value(seen_by(kTargets[1])), kFalseAlarmRate);
  EXPECT_EQ(last_frame(rng, true).c, float{kFrames});
}

TEST(Resample, TheReceiverAloneKeepsItsReservoir) {
  Rng rng(17, 0, 0, 0);
  uint64_t non_finite = 0;
  const std::array<LightReservoir, 1> own{LightReservoir{3, 0.75f, 4.0f}};
  for (MisWeight weights : kAll) {
    const LightReservoir merged = resample<size_t>(own, toy_target, weights, rng, non_finite);
    EXPECT_EQ(merged.sample, 3u);
    EXPECT_FLOAT_EQ(merged.W, 0.75f);
    EXPECT_EQ(merged.c, 4.0f);
  }
}

TEST(Resample, NullCandidatesAddTheirConfidence) {
  Rng rng(18, 0, 0, 0);
  uint64_t non_finite = 0;
  const std::array<LightReservoir, 3> null{LightReservoir{.c = 1.0f}, {.c = 2.0f}, {.c = 4.5f}};
  for (MisWeight weights : kAll) {
    const auto never = [](size_t, size_t) -> float { throw std::logic_error("asked for the target of a null sample"); };
    const LightReservoir merged = resample<size_t>(null, never, weights, rng, non_finite);
    EXPECT_EQ(merged.W, 0.0f);
    EXPECT_EQ(merged.c, 7.5f);
  }
  EXPECT_EQ(non_finite, 0u);
}

TEST(Resample, ZeroConfidenceIsNotAsked) {
  Rng rng(19, 0, 0, 0);
  uint64_t non_finite = 0;
  const std::array<LightReservoir, 3> candidates{LightReservoir{3, 0.5f, 2.0f}, {5, 0.5f, 0.0f}, {6, 0.5f, 0.0f}};
  const auto only_receiver = [](size_t i, size_t light) {
    EXPECT_EQ(i, 0u);
    return toy_target(i, light);
  };
  for (MisWeight weights : kAll) {
    const LightReservoir merged = resample<size_t>(candidates, only_receiver, weights, rng, non_finite);
    EXPECT_EQ(merged.sample, 3u);
    EXPECT_FLOAT_EQ(merged.W, 0.5f);
  }
  const std::array<LightReservoir, 2> nobody{LightReservoir{3, 0.5f, 0.0f}, {5, 0.5f, 0.0f}};
  for (MisWeight weights : kAll) EXPECT_EQ(resample<size_t>(nobody, toy_target, weights, rng, non_finite).W, 0.0f);
}

// A receiver that made nothing itself and says so: right for the lights its neighbours see, and nothing else.
// Seed 20; false alarm with probability kFalseAlarmRate.
TEST(Resample, PairwiseWithoutAReceiverOfItsOwnUsesTheNeighbours) {
  const MeanWeights means = mean_weights(20, [](auto candidates, Rng& rng, uint64_t& non_finite) {
    candidates[0] = {};
    candidates[2].c = 0.0f;
    return resample<size_t>(candidates, toy_target, MisWeight::PAIRWISE, rng, non_finite);
  });
  std::array<double, kLights> expected = seen_by(kTargets[0]);
  std::fill_n(expected.begin(), 4, 0.0);
  EXPECT_GT(means.p_value(expected), kFalseAlarmRate);
}

TEST(Resample, AsksForNoMoreTargetsThanItSays) {
  const auto calls = [](MisWeight weights, bool receiver_is_null, int& of_receiver) {
    Rng rng(21, 0, 0, 0);
    uint64_t non_finite = 0;
    int count = 0;
    of_receiver = 0;
    const std::array<LightReservoir, 4> candidates{
        LightReservoir{4, receiver_is_null ? 0.0f : 1.0f, 1.0f}, {5, 1.0f, 1.0f}, {6, 0.0f, 1.0f}, {7, 1.0f, 2.0f}};
    const auto target = [&](size_t i, size_t) {
      ++count;
      of_receiver += i == 0;
      return 1.0f;
    };
    resample<size_t>(candidates, target, weights, rng, non_finite);
    return count;
  };
  constexpr int k = 3;
  int of_receiver = 0;
  for (const bool receiver_is_null : {false, true}) {
    const int n = receiver_is_null ? 2 : 3;
    EXPECT_EQ(calls(MisWeight::CONSTANT, receiver_is_null, of_receiver), n);
    EXPECT_EQ(of_receiver, n);
    EXPECT_EQ(calls(MisWeight::CONTRIBUTION, receiver_is_null, of_receiver), n + k);
    EXPECT_EQ(calls(MisWeight::BALANCE, receiver_is_null, of_receiver), n * (k + 1));
    EXPECT_EQ(calls(MisWeight::PAIRWISE, receiver_is_null, of_receiver), receiver_is_null ? 2 * n : 2 * n - 1 + k);
    EXPECT_EQ(of_receiver, n);
  }
}

TEST(Resample, CountsWhatIsNoNumberAndKeepsItsConfidence) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (MisWeight weights : kAll) {
    for (const float bad : {kNan, kInfinity, -1.0f}) {
      Rng rng(22, 0, 0, 0);
      uint64_t non_finite = 0;
      const std::array<LightReservoir, 2> stored{LightReservoir{3, 0.5f, 1.0f}, {4, bad, 2.0f}};
      const LightReservoir merged = resample<size_t>(stored, toy_target, weights, rng, non_finite);
      EXPECT_EQ(non_finite, 1u);
      EXPECT_EQ(merged.sample, 3u);
      EXPECT_EQ(merged.c, 3.0f);

      const std::array<LightReservoir, 2> sound{LightReservoir{3, 0.5f, 1.0f}, {4, 0.5f, 2.0f}};
      const auto broken = [&](size_t i, size_t light) { return light == 4 ? bad : toy_target(i, light); };
      EXPECT_EQ(resample<size_t>(sound, broken, weights, rng, non_finite).sample, 3u);
      EXPECT_EQ(non_finite, 2u);
    }
  }
}

}  // namespace
}  // namespace cistern::test
