#include "base/direction_histogram.h"

#include <gtest/gtest.h>

#include "base/frame.h"
#include "base/rng.h"
#include "base/sphere_map.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

using Weights = std::array<double, DirectionHistogram::kBins>;

/// Uneven, a third of the parts empty, one much larger than the others.
Weights uneven() {
  Weights weights{};
  Rng rng(1, 0, 0, 0);
  for (double& w : weights) w = rng.next_float() < 0.33f ? 0.0 : rng.next_float();
  weights[77] = 40.0;
  return weights;
}

TEST(SphereMap, GoesThereAndBack) {
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 10000; ++i) {
    const Vec2 p = rng.next_vec2();
    const Vec3 w = equal_area_direction(p);
    const Vec2 back = equal_area_point(w);
    ASSERT_NEAR(length(w), 1.0f, 1e-5f);
    ASSERT_NEAR(back.x, p.x, 2e-5f);
    ASSERT_NEAR(back.y, p.y, 2e-5f);
  }
  for (const Vec3 w : {Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
    const Vec3 back = equal_area_direction(equal_area_point(w));
    EXPECT_NEAR(dot(back, w), 1.0f, 1e-6f);
  }
}

/// Caps about any axis take their share of the square. False-alarm rate: kFalseAlarmRate, shared out.
TEST(SphereMap, KeepsArea) {
  constexpr int kCount = 100000;
  for (const Vec3 axis : {Vec3{0, 0, 1}, Vec3{1, 0, 0}, normalize({1, -2, -0.5f}), normalize({-1, 1, -3})}) {
    std::array<double, 8> observed{}, expected;
    expected.fill(kCount / 8.0);
    Rng rng(3, 0, 0, 0);
    for (int i = 0; i < kCount; ++i) {
      const float height = dot(axis, equal_area_direction(rng.next_vec2()));  // uniform in [-1, 1]
      ++observed[std::min<size_t>(static_cast<size_t>((height + 1.0f) * 4.0f), 7)];
    }
    EXPECT_GT(chi_square_p_value(observed, expected), shared_rate(4));
  }
}

double sample_p_value(const DirectionHistogram& histogram, const Weights& weights) {
  constexpr int kCount = 200000;
  double sum = 0.0;
  for (const double w : weights) sum += w;
  std::vector<double> observed(weights.size()), expected;
  for (const double w : weights) expected.push_back(w / sum * kCount);
  Rng rng(4, 0, 0, 0);
  for (int i = 0; i < kCount; ++i) ++observed[DirectionHistogram::bin(histogram.sample(rng.next_vec2()))];
  return chi_square_p_value(observed, expected);
}

TEST(DirectionHistogram, SamplesAsItsWeightsSay) {
  Weights weights = uneven();
  const DirectionHistogram histogram(weights);
  Weights kept{};  // what a part has in 65,536ths
  double sum = 0.0;
  for (const double w : weights) sum += w;
  for (uint32_t i = 0; i < weights.size(); ++i) {
    kept[i] = histogram.pmf(i);
    EXPECT_NEAR(kept[i], weights[i] / sum, 1.0 / 65536.0);
  }
  EXPECT_GT(sample_p_value(histogram, kept), kFalseAlarmRate);
  std::swap(kept[20], kept[77]);  // planted bug
  EXPECT_LT(sample_p_value(histogram, kept), kFalseAlarmRate);
}

TEST(DirectionHistogram, DensityIsPerSolidAngle) {
  const DirectionHistogram histogram(uneven());
  Moments uniform, planted;
  Rng rng(5, 0, 0, 0);
  for (int i = 0; i < 400000; ++i) {
    const float pdf = histogram.pdf(equal_area_direction(rng.next_vec2()));
    uniform.add(pdf * 4.0 * M_PI);
    planted.add(pdf * 2.0 * M_PI);  // planted bug: the area of a hemisphere
  }
  EXPECT_GT(mean_p_value(uniform, 1.0), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(planted, 1.0), kFalseAlarmRate);
}

TEST(DirectionHistogram, OnePartIsEnough) {
  Weights weights{};
  weights[200] = 1e-30;
  const DirectionHistogram histogram(weights);
  for (const float u : {0.0f, 0.5f, 0.9999f}) EXPECT_EQ(DirectionHistogram::bin(histogram.sample({u, u})), 200u);
}

}  // namespace
}  // namespace cistern::test
