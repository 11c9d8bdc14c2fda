#include "transport/free_flight.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kSamples = 200000, kBins = 40;

/// Absorbs in one channel alone, and in all.
Medium coloured() {
  Medium medium;
  add_scattering(medium, {0.5f, 2.0f, 0.0f}, PhaseFunction::henyey_greenstein(0.2f));
  add_absorption(medium, {0.5f, 0.1f, 1.0f});
  return medium;
}

/// Means by channel of what is scattered before the end, and of what reaches it.
struct Outcome {
  std::array<Moments, 3> scattered, passed;
};
Outcome fly(const Medium& medium, Rgb throughput, float length, float planted_weight = 1.0f) {
  const FreeFlight flight(medium, throughput, length);
  Rng rng(1, 2, 3, 4);
  Outcome outcome;
  for (int i = 0; i < kSamples; ++i) {
    const float u = rng.next_float();
    const FreeFlight::Sample sample = flight.sample(u, rng.next_float());
    const Vec3 w = to_vec(sample.weight * planted_weight);
    const std::array<float, 3> weight{w.x, w.y, w.z};
    for (size_t k = 0; k < 3; ++k) {
      outcome.scattered[k].add(sample.distance ? weight[k] : 0.0f);
      outcome.passed[k].add(sample.distance ? 0.0f : weight[k]);
    }
  }
  return outcome;
}

TEST(FreeFlight, MeansAreThoseOfBeerAndLambert) {
  const std::array<double, 3> scattering{0.5, 2.0, 0.0}, extinction{1.0, 2.1, 1.0};
  for (const float length : {0.3f, 2.0f, INFINITY}) {
    const Outcome outcome = fly(coloured(), {1.0f, 0.2f, 3.0f}, length);
    for (size_t k = 0; k < 3; ++k) {
      const double passed = std::exp(-extinction[k] * length);
      const double scattered = scattering[k] / extinction[k] * (1.0 - passed);
      if (std::isfinite(length)) EXPECT_GT(mean_p_value(outcome.passed[k], passed), shared_rate(18)) << k;
      if (scattered > 0.0) EXPECT_GT(mean_p_value(outcome.scattered[k], scattered), shared_rate(18)) << k;
      if (scattered == 0.0) EXPECT_EQ(outcome.scattered[k].mean(), 0.0);
    }
  }
}

/// What a channel neither scatters nor absorbs arrives, however far, and what it hardly loses without much noise.
TEST(FreeFlight, ChannelsThatScatterNothingPass) {
  Medium blue;
  add_scattering(blue, {0.0f, 0.0f, 1.0f}, {});
  for (const float length : {10.0f, INFINITY}) {
    const Outcome outcome = fly(blue, Rgb(1.0f), length);
    for (size_t k = 0; k < 2; ++k) {
      EXPECT_GT(mean_p_value(outcome.passed[k], 1.0), shared_rate(4)) << length;
      EXPECT_LT(outcome.passed[k].variance(), 1.0) << "two of three samples at least: " << length;
    }
  }
}

TEST(FreeFlight, WrongWeightsAreSeen) {
  const Outcome outcome = fly(coloured(), {1.0f, 0.2f, 3.0f}, 2.0f, 1.02f);
  EXPECT_LT(mean_p_value(outcome.scattered[0], 0.5 * (1.0 - std::exp(-2.0))), kFalseAlarmRate);
}

TEST(FreeFlight, WhatOnlyAbsorbsIsNotSampled) {
  Medium medium;
  add_absorption(medium, Rgb(1.0f));
  EXPECT_FALSE(FreeFlight(medium, Rgb(1.0f), 1.0f).can_scatter());
  EXPECT_FALSE(FreeFlight(coloured(), {0.0f, 0.0f, 1.0f}, 1.0f).can_scatter()) << "nothing scatters blue";
}

/// Of distances by `sample`, against their density.
template <class Sample, class Pdf>
double p_value_of_distances(float length, const Sample& sample, const Pdf& pdf) {
  Rng rng(9, 8, 7, 6);
  std::vector<double> observed(kBins), expected(kBins);
  for (int i = 0; i < kSamples; ++i) {
    const float distance = sample(rng);
    observed[static_cast<size_t>(std::clamp(static_cast<int>(distance / length * kBins), 0, kBins - 1))] += 1.0;
  }
  constexpr int kSteps = 500;
  for (size_t bin = 0; bin < kBins; ++bin) {
    for (int k = 0; k < kSteps; ++k)
      expected[bin] += pdf(length * (static_cast<float>(bin) + (static_cast<float>(k) + 0.5f) / kSteps) / kBins);
    expected[bin] *= kSamples * length / (double{kBins} * kSteps);
  }
  return chi_square_p_value(observed, expected);
}

double p_value_inside(const Medium& medium, float length, float longer = 1.0f) {
  const FreeFlight flight(medium, Rgb(1.0f), length), other(medium, Rgb(1.0f), length * longer);
  const auto sample = [&](Rng& rng) {
    const float u = rng.next_float();
    return flight.sample_inside(u, rng.next_float());
  };
  return p_value_of_distances(length, sample, [&](float t) { return other.pdf_inside(t); });
}

TEST(FreeFlight, DistancesInsideFollowTheirDensity) {
  Medium thin;
  add_scattering(thin, Rgb(1e-9f), {});
  EXPECT_GT(p_value_inside(coloured(), 2.0f), shared_rate(2));
  EXPECT_GT(p_value_inside(thin, 2.0f), shared_rate(2));
  EXPECT_LT(p_value_inside(coloured(), 2.0f, 1.2f), kFalseAlarmRate) << "planted: of another length";
}

double p_value_near(Vec3 point, Vec3 other) {
  const Vec3 origin{1.0f, 2.0f, 3.0f}, direction{0.0f, 1.0f, 0.0f};
  constexpr float kLength = 4.0f;
  const EquiAngular near(origin, direction, 0.0f, kLength, point), density(origin, direction, 0.0f, kLength, other);
  return p_value_of_distances(
      kLength, [&](Rng& rng) { return near.sample(rng.next_float()); }, [&](float t) { return density.pdf(t); });
}

TEST(EquiAngular, DistancesFollowTheirDensity) {
  for (const Vec3 point : {Vec3{1.5f, 3.0f, 3.0f}, Vec3{1.0f, 9.0f, 4.0f}, Vec3{0.0f, -2.0f, 3.0f}})
    EXPECT_GT(p_value_near(point, point), shared_rate(3));
  EXPECT_LT(p_value_near({1.5f, 3.0f, 3.0f}, {1.52f, 3.0f, 3.0f}), kFalseAlarmRate) << "planted: another point";
}

TEST(EquiAngular, EndlessRaysAndPointsOnThem) {
  const EquiAngular endless({}, {0.0f, 0.0f, 1.0f}, 0.0f, INFINITY, {0.0f, 1.0f, 2.0f});
  Moments share;  // of what lies before the point: as the angles are
  Rng rng(1, 1, 1, 1);
  for (int i = 0; i < kSamples; ++i) share.add(endless.sample(rng.next_float()) < 2.0f ? 1.0 : 0.0);
  const double before = std::atan(2.0);
  EXPECT_GT(mean_p_value(share, before / (before + 0.5 * M_PI)), kFalseAlarmRate);
  const EquiAngular through({}, {0.0f, 0.0f, 1.0f}, 0.0f, 3.0f, {0.0f, 0.0f, 2.0f});
  EXPECT_EQ(through.pdf(1.0f), 0.0f) << "there this technique has no samples";
  EXPECT_TRUE(std::isfinite(through.sample(0.4f)));
}

}  // namespace
}  // namespace cistern::test
