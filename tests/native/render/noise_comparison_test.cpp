#include "render/noise_comparison.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace cistern {
namespace {

constexpr int kWidth = 204, kHeight = 133;  // boxes at the far edges are cut
enum Way : size_t { PLAIN, OTHER };

/// Variance of the second way over that of the first, from four frames of each; pixels of the second have `noise` times
/// the noise of the first.
double ratio(float noise, int box_size, float fireflies = 0.0f) {
  NoiseComparison comparison(kWidth, kHeight, box_size, 2);
  std::vector<float> pixels(size_t{kWidth} * kHeight);
  for (uint32_t frame = 0; frame < 8; ++frame) {
    const Way way = frame % 2 == 0 ? PLAIN : OTHER;
    Rng rng(5, 0, frame, 0);
    for (float& pixel : pixels) {
      pixel = 1.0f + (way == PLAIN ? 1.0f : noise) * (rng.next_float() - 0.5f);
      if (way == OTHER && rng.next_float() < fireflies) pixel += 1e4f;
    }
    comparison.add_frame(way, pixels);
  }
  const std::vector<double> variances = comparison.variances();
  return variances[OTHER] / variances[PLAIN];
}

/// 442 boxes of 8 x 8 with three degrees of freedom each for either way: 5.5 % of noise; 4 of it, 6e-5.
TEST(NoiseComparison, FindsTheRatioOfVariances) {
  EXPECT_NEAR(ratio(1.0f, 8), 1.0, 0.22);
  EXPECT_NEAR(ratio(0.5f, 8), 0.25, 0.06);
  EXPECT_NEAR(ratio(2.0f, 4), 4.0, 0.5);
}

TEST(NoiseComparison, FirefliesDecideNothing) {
  EXPECT_NEAR(ratio(1.0f, 8, 2e-5f), 1.0, 0.25);
  EXPECT_GT(ratio(1.0f, 8, 1e-2f), 1e3) << "light in every box is no firefly";
}

/// Of one path in `rarity` that finds what light there is, against pixels that have some of it each, with `noise`, and
/// cost twice as much.
double significance_against_rare_light(float noise, float rarity, uint64_t seed) {
  NoiseComparison comparison(128, 128, 4, 2);
  std::vector<float> pixels(size_t{128} * 128);
  for (uint32_t frame = 0; frame < 8; ++frame) {
    const Way way = frame % 2 == 0 ? PLAIN : OTHER;
    Rng rng(seed, 0, frame, 0);
    for (float& pixel : pixels) {
      if (way == PLAIN) {
        pixel = rng.next_float() * rarity < 1.0f ? rarity : 0.0f;
      } else {
        pixel = 1.0f + noise * (rng.next_float() - 0.5f);
      }
    }
    comparison.add_frame(way, pixels);
  }
  return comparison.significance(PLAIN, 1.0, OTHER, 2.0);
}

/// 64 tiles whose differences are alike: a hundred seeds stay within 4.5 of what is expected, but for 1e-3.
TEST(NoiseComparison, SignificanceTellsWhatIsSure) {
  const auto significance = [](double cost, double cost_of_other) {
    NoiseComparison comparison(128, 128, 8, 2);
    std::vector<float> pixels(size_t{128} * 128);
    for (uint32_t frame = 0; frame < 8; ++frame) {
      Rng rng(7, 0, frame, 0);
      for (float& pixel : pixels) pixel = rng.next_float();
      comparison.add_frame(frame % 2 == 0 ? PLAIN : OTHER, pixels);
    }
    return comparison.significance(PLAIN, cost, OTHER, cost_of_other);
  };
  EXPECT_LT(std::abs(significance(1.0, 1.0)), 4.5) << "alike";
  EXPECT_LT(significance(1.0, 3.0), -4.5);
  EXPECT_GT(significance(3.0, 1.0), 4.5);
}

TEST(NoiseComparison, RareLightIsNotSurelyLessNoisy) {
  for (uint64_t seed = 0; seed < 32; ++seed) EXPECT_GT(significance_against_rare_light(3.0f, 1e3f, seed), -0.5) << seed;
}

TEST(NoiseComparison, WhatIsNotFiniteDoesNotCount) {
  NoiseComparison comparison(4, 4, 4, 1);
  std::vector<float> pixels(16, 1.0f);
  comparison.add_frame(0, pixels);
  pixels[3] = NAN;
  comparison.add_frame(0, pixels);
  EXPECT_TRUE(std::isfinite(comparison.variances()[0]));
}

}  // namespace
}  // namespace cistern
