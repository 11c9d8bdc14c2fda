#include "shading/phase.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kSamples = 100000, kCosines = 20, kAzimuths = 8;

/// Of directions by `sample`, against the integral of the density over the bins.
double p_value_of_samples(const Medium& medium, const Medium& density) {
  const Vec3 direction = normalize(Vec3{0.3f, -0.5f, 0.7f});
  const Frame frame(direction);
  Rng rng(1, 2, 3, 4);
  std::vector<double> observed(kCosines * kAzimuths), expected(kCosines * kAzimuths);
  for (int i = 0; i < kSamples; ++i) {
    const float u = rng.next_float();
    const PhaseSample sample = sample_phase(medium, direction, u, rng.next_vec2());
    const Vec3 local = frame.to_local(sample.direction);
    const float turns = std::atan2(local.y, local.x) / (2.0f * kPi) + 0.5f;
    const int row = std::clamp(static_cast<int>((local.z + 1.0f) * 0.5f * kCosines), 0, kCosines - 1);
    const int column = std::clamp(static_cast<int>(turns * kAzimuths), 0, kAzimuths - 1);
    observed[static_cast<size_t>(row * kAzimuths + column)] += 1.0;
  }
  constexpr int kSteps = 200;
  for (int row = 0; row < kCosines; ++row) {
    double sum = 0.0;
    for (int k = 0; k < kSteps; ++k) {
      const double cosine = -1.0 + 2.0 * (row + (k + 0.5) / kSteps) / kCosines;
      sum += evaluate_phase(density, static_cast<float>(cosine));
    }
    const double share = sum / kSteps * 2.0 / kCosines * 2.0 * M_PI / kAzimuths;
    for (int column = 0; column < kAzimuths; ++column)
      expected[static_cast<size_t>(row * kAzimuths + column)] = share * kSamples;
  }
  return chi_square_p_value(observed, expected);
}

Medium with_lobes(std::initializer_list<std::pair<float, float>> lobes) {
  Medium medium;
  for (const auto& [scattering, g] : lobes)
    add_scattering(medium, Rgb(scattering), PhaseFunction::henyey_greenstein(g));
  return medium;
}

TEST(Phase, SamplesFollowTheDensity) {
  for (const float g : {0.0f, 0.0005f, 0.3f, 0.8f, -0.6f})
    EXPECT_GT(p_value_of_samples(with_lobes({{1.0f, g}}), with_lobes({{1.0f, g}})), shared_rate(5)) << g;
}

TEST(Phase, SamplesOfSeveralLobesFollowTheirMean) {
  const Medium medium = with_lobes({{1.0f, 0.5f}, {3.0f, -0.4f}, {0.5f, 0.9f}});
  EXPECT_GT(p_value_of_samples(medium, medium), kFalseAlarmRate);
}

TEST(Phase, WrongDensitiesAreSeen) {
  EXPECT_LT(p_value_of_samples(with_lobes({{1.0f, 0.3f}}), with_lobes({{1.0f, -0.3f}})), kFalseAlarmRate);
  EXPECT_LT(p_value_of_samples(with_lobes({{1.0f, 0.3f}}), with_lobes({{1.0f, 0.32f}})), kFalseAlarmRate);
}

TEST(Phase, AnisotropyIsTheMeanCosine) {
  for (const float g : {0.0f, 0.7f, -0.9f, kLargestAnisotropy}) {
    Rng rng(5, 6, 7, 8);
    Moments cosine;
    const Vec3 direction{0.0f, 0.0f, 1.0f};
    for (int i = 0; i < kSamples; ++i)
      cosine.add(dot(direction, sample_henyey_greenstein(direction, g, rng.next_vec2())));
    EXPECT_GT(mean_p_value(cosine, g), shared_rate(4)) << g;
    EXPECT_LT(mean_p_value(cosine, g < 0.0f ? g + 0.01f : g - 0.01f), kFalseAlarmRate) << "planted";
  }
}

/// With as many lobes of 1/m as it holds, but for `free` ones, of anisotropies 0, 0.1, 0.2 ...
Medium full_medium(int free = 0) {
  Medium medium;
  for (int i = 0; i < Medium::kMaxLobes - free; ++i)
    add_scattering(medium, Rgb(1.0f), PhaseFunction::henyey_greenstein(0.1f * static_cast<float>(i)));
  return medium;
}
constexpr float kLastOfFull = 0.1f * (Medium::kMaxLobes - 1);

TEST(Medium, MoreAnisotropiesThanItHoldsBecomeTheirMean) {
  Medium medium = full_medium();
  add_scattering(medium, Rgb(1.0f), PhaseFunction::henyey_greenstein(0.0f));
  add_scattering(medium, Rgb(3.0f), PhaseFunction::henyey_greenstein(0.9f));
  EXPECT_EQ(medium.lobe_count, Medium::kMaxLobes);
  EXPECT_EQ(medium.lobes[0].scattering, Rgb(2.0f));
  EXPECT_NEAR(medium.lobes.back().phase.g(), (kLastOfFull + 3.0f * 0.9f) / 4.0f, 1e-6f);
  EXPECT_EQ(medium.scattering, Rgb(4.0f + Medium::kMaxLobes));
}

TEST(Medium, OfMorePhaseFunctionsThanItHoldsTheStrongestStays) {
  const PhaseFunction weak = PhaseFunction::draine(0.5f, 1.0f), strong = PhaseFunction::fournier_forand(1.3f, 0.1f);
  for (const bool weak_first : {false, true}) {
    Medium medium = full_medium(1);
    add_scattering(medium, Rgb(weak_first ? 1.0f : 3.0f), weak_first ? weak : strong);
    add_scattering(medium, Rgb(weak_first ? 3.0f : 1.0f), weak_first ? strong : weak);
    EXPECT_EQ(medium.lobe_count, Medium::kMaxLobes);
    EXPECT_EQ(medium.lobes.back().phase, strong);
    EXPECT_EQ(medium.lobes.back().scattering, Rgb(4.0f));
  }
}

TEST(Medium, BadCoefficientsAreClamped) {
  Medium medium;
  add_scattering(medium, {-1.0f, NAN, INFINITY}, PhaseFunction::henyey_greenstein(7.0f));
  add_absorption(medium, {NAN, -3.0f, 1e30f});
  EXPECT_EQ(medium.scattering, Rgb(0.0f, 0.0f, kDensest));
  EXPECT_EQ(medium.extinction.r, 0.0f);
  EXPECT_EQ(medium.lobes[0].phase.g(), kLargestAnisotropy);
  EXPECT_TRUE(is_finite(medium_transmittance(medium, INFINITY)));
  medium.emission = Rgb(1.0f);
  EXPECT_EQ(medium_radiance(medium, INFINITY).r, 0.0f) << "endless and without absorption";
  EXPECT_EQ(medium_radiance(medium, 2.0f).r, 2.0f);
}

}  // namespace
}  // namespace cistern::test
