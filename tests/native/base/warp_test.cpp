#include "base/warp.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kBins = 12;
constexpr int kSamples = 60000;

/// p-value of `map` being uniform over [0, 1)^2: the inverse of a warp's distribution functions, applied to its
/// samples, is.
double uniform_p_value(const std::function<Vec2(Vec2)>& map) {
  std::vector<double> observed(kBins * kBins, 0.0), expected(kBins * kBins, double{kSamples} / (kBins * kBins));
  Rng rng(11, 0, 0, 0);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 p = map(rng.next_vec2());
    const int x = std::clamp(static_cast<int>(p.x * kBins), 0, kBins - 1);
    const int y = std::clamp(static_cast<int>(p.y * kBins), 0, kBins - 1);
    observed[static_cast<size_t>(y * kBins + x)] += 1.0;
  }
  return chi_square_p_value(observed, expected);
}

float turn(float x, float y) { return std::atan2(y, x) / (2.0f * kPi) + 0.5f; }

TEST(Warp, DiskIsUniform) {
  const auto cdf = [](Vec2 u) {
    const Vec2 p = square_to_disk(u);
    return Vec2{sqr(p.x) + sqr(p.y), turn(p.x, p.y)};
  };
  EXPECT_GT(uniform_p_value(cdf), kFalseAlarmRate);
}

TEST(Warp, PlantedBugOfRadiusWithoutRootIsSeen) {
  const auto cdf = [](Vec2 u) { return Vec2{sqr(u.x), u.y}; };  // radius = u instead of sqrt(u)
  EXPECT_LT(uniform_p_value(cdf), kFalseAlarmRate);
}

TEST(Warp, CosineHemisphereHasItsDensity) {
  const auto cdf = [](Vec2 u) {
    const Vec3 d = square_to_cosine_hemisphere(u);
    EXPECT_GE(d.z, 0.0f);
    EXPECT_NEAR(length(d), 1.0f, 1e-5f);
    return Vec2{1.0f - d.z * d.z, turn(d.x, d.y)};
  };
  EXPECT_GT(uniform_p_value(cdf), kFalseAlarmRate);
}

TEST(Warp, SphereIsUniform) {
  const auto cdf = [](Vec2 u) {
    const Vec3 d = square_to_sphere(u);
    EXPECT_NEAR(length(d), 1.0f, 1e-5f);
    return Vec2{0.5f * (1.0f - d.z), turn(d.x, d.y)};
  };
  EXPECT_GT(uniform_p_value(cdf), kFalseAlarmRate);
}

TEST(Warp, ConesAreUniform) {
  for (const float one_minus_cos : {2.0f, 0.5f, 1e-3f, 1e-6f}) {
    const auto cdf = [&](Vec2 u) {
      const Vec3 d = square_to_cone(u, one_minus_cos);
      // 1 - cos from the sine, which small cones keep accurate.
      const float sine_squared = d.x * d.x + d.y * d.y;
      const float height = d.z > 0.5f ? sine_squared / (1.0f + d.z) : 1.0f - d.z;
      return Vec2{height / one_minus_cos, turn(d.x, d.y)};
    };
    EXPECT_GT(uniform_p_value(cdf), shared_rate(4)) << one_minus_cos;
  }
}

TEST(Warp, TriangleIsUniform) {
  const auto cdf = [](Vec2 u) {
    const Vec2 b = square_to_triangle(u);
    const float b0 = 1.0f - b.x - b.y;
    EXPECT_GE(std::min({b.x, b.y, b0}), -1e-6f);
    return Vec2{sqr(1.0f - b0), b.x / std::max(1.0f - b0, 1e-9f)};  // P(sum of weights < s) = s^2
  };
  EXPECT_GT(uniform_p_value(cdf), kFalseAlarmRate);
}

TEST(Warp, PowerHeuristicSumsToOne) {
  for (const float a : {0.0f, 1e-10f, 0.3f, 5.0f, 1e15f}) {
    for (const float b : {1e-10f, 0.7f, 3.0f, 1e15f}) {
      EXPECT_NEAR(power_heuristic(a, b) + power_heuristic(b, a), 1.0f, 1e-6f);
    }
  }
  EXPECT_EQ(power_heuristic(INFINITY, 1.0f), 1.0f);
  EXPECT_EQ(power_heuristic(1.0f, INFINITY), 0.0f);
}

}  // namespace
}  // namespace cistern::test
