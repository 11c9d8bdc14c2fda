#include "film/pixel_filter.h"

#include <gtest/gtest.h>

#include <functional>

#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kBins = 64;
constexpr int kSamples = 100000;
constexpr int kComparisons = 8;  // chi-square tests in this file: they share kFalseAlarmRate

/// Probability of each of kBins equal parts of [-width / 2, width / 2] under an unnormalised density (midpoint rule).
std::vector<double> bin_probabilities(const std::function<double(double)>& density, double width) {
  constexpr int kSteps = 256;
  std::vector<double> bins(kBins);
  double total = 0.0;
  for (int i = 0; i < kBins * kSteps; ++i) {
    const double value = density(((i + 0.5) / (kBins * kSteps) - 0.5) * width);
    bins[static_cast<size_t>(i / kSteps)] += value;
    total += value;
  }
  for (double& bin : bins) bin /= total;
  return bins;
}

/// Smaller of the p-values of both axes against `density`, and of their independence.
double p_value(const PixelFilter& filter, const std::function<double(double)>& density, double width) {
  constexpr int kCoarse = 4;
  const std::vector<double> probabilities = bin_probabilities(density, width);
  std::vector<double> expected, joint_expected(kCoarse * kCoarse), joint(kCoarse * kCoarse);
  for (const double p : probabilities) expected.push_back(p * kSamples);
  const auto coarse = [](size_t bin) { return bin * kCoarse / kBins; };
  for (size_t i = 0; i < kBins; ++i)
    for (size_t j = 0; j < kBins; ++j)
      joint_expected[coarse(i) * kCoarse + coarse(j)] += probabilities[i] * probabilities[j] * kSamples;
  std::vector<double> x(kBins), y(kBins);
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 offset = filter.sample(rng.next_vec2());
    const auto bin = [&](float v) {
      return static_cast<size_t>(std::clamp(static_cast<int>((v / width + 0.5) * kBins), 0, kBins - 1));
    };
    ++x[bin(offset.x)], ++y[bin(offset.y)], ++joint[coarse(bin(offset.x)) * kCoarse + coarse(bin(offset.y))];
  }
  return std::min(
      {chi_square_p_value(x, expected), chi_square_p_value(y, expected), chi_square_p_value(joint, joint_expected)});
}

double box(double) { return 1.0; }

// Blender's Gaussian of full width w is exp(-2 (6 x / w)^2): one at the centre and e^-18 at the ends.
std::function<double(double)> gaussian(double width) {
  return [width](double x) { return std::exp(-72.0 * x * x / (width * width)); };
}

// [Harris 1978, table 1], minimum four-term Blackman-Harris window, centred.
std::function<double(double)> blackman_harris(double width) {
  return [width](double x) {
    const double v = 2.0 * std::numbers::pi * x / width;
    return 0.35875 + 0.48829 * std::cos(v) + 0.14128 * std::cos(2.0 * v) + 0.01168 * std::cos(3.0 * v);
  };
}

TEST(PixelFilter, SamplesFollowEachFilter) {
  const double rate = shared_rate(3 * kComparisons);
  for (const float width : {1.0f, 1.5f}) {
    EXPECT_GT(p_value(PixelFilter(FilterKind::BOX, width), box, width), rate) << width;
    EXPECT_GT(p_value(PixelFilter(FilterKind::GAUSSIAN, width), gaussian(width), width), rate) << width;
    EXPECT_GT(p_value(PixelFilter(FilterKind::BLACKMAN_HARRIS, width), blackman_harris(width), width), rate) << width;
  }
  // Planted bugs: a window two percent too wide, and a hat in place of the bell.
  EXPECT_LT(p_value(PixelFilter(FilterKind::BLACKMAN_HARRIS, 1.53f), blackman_harris(1.5), 1.5), rate);
  EXPECT_LT(p_value(PixelFilter(FilterKind::BOX, 1.5f), gaussian(1.5), 1.5), rate);
}

TEST(PixelFilter, ABoxOfWidthOneIsThePixel) {
  const PixelFilter filter(FilterKind::BOX, 1.0f);
  for (int i = 0; i <= 1000; ++i) {
    const float u = std::min(static_cast<float>(i) / 1000.0f, kOneMinusEpsilon);
    const Vec2 offset = filter.sample({u, 0.5f});
    EXPECT_NEAR(offset.x, u - 0.5f, 1e-6f);
    EXPECT_NEAR(offset.y, 0.0f, 1e-6f);
    EXPECT_GE(offset.x, -0.5f);
    EXPECT_LE(offset.x, 0.5f);
  }
}

TEST(PixelFilter, StaysWithinItsWidthAndIsSymmetric) {
  for (const FilterKind kind : {FilterKind::BOX, FilterKind::GAUSSIAN, FilterKind::BLACKMAN_HARRIS}) {
    const PixelFilter filter(kind, 3.0f);
    for (int i = 0; i <= 200; ++i) {
      const float u = std::min(static_cast<float>(i) / 200.0f, kOneMinusEpsilon);
      const Vec2 offset = filter.sample({u, 1.0f - u});
      EXPECT_LE(std::abs(offset.x), 1.5f);
      EXPECT_NEAR(offset.x, -offset.y, 1e-3f);
    }
  }
}

}  // namespace
}  // namespace cistern::test
