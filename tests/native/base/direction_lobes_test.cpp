#include "base/direction_lobes.h"

#include <gtest/gtest.h>

#include "base/direction_guide.h"
#include "base/rng.h"
#include "base/sphere_map.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

const Vec3 kPlace{0.3f, -2, 1};
const Vec3 kAxis = normalize({1, -2, 0.5f}), kOther = normalize({-1, 0.2f, 0.3f});

/// One wide, one narrow.
DirectionLobes two_lobes() {
  DirectionLobes lobes;
  lobes.add({.axis = kAxis, .square_radius = 0.5f, .share = 2.0f});
  lobes.add({.axis = kOther, .square_radius = 1e-4f, .share = 6.0f});
  return lobes;
}

/// Whether as many directions as its share within r = `radii` times the radius about the narrow lobe's axis say so.
double share_within_p_value(const DirectionLobes& lobes, float radii, double share) {
  constexpr int kCount = 100000;
  std::array<double, 2> observed{}, expected{share * kCount, (1.0 - share) * kCount};
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < kCount; ++i) {
    const Vec3 off = lobes.sample(rng.next_vec2(), kPlace) - kOther;
    ++observed[dot(off, off) < sqr(radii) * 1e-4f ? 0 : 1];
  }
  return chi_square_p_value(observed, expected);
}

/// False-alarm rate of the tests in this file: kFalseAlarmRate for each comparison, six of them.
TEST(DirectionLobes, SampleAsSharesAndRadiiSay) {
  const DirectionLobes lobes = two_lobes();
  const double of_narrow = 0.75;  // the wide one adds less than 1e-4
  EXPECT_GT(share_within_p_value(lobes, 1.0f, of_narrow * 0.5), kFalseAlarmRate);
  EXPECT_GT(share_within_p_value(lobes, 3.0f, of_narrow * 0.9), kFalseAlarmRate);
  EXPECT_LT(share_within_p_value(lobes, 1.0f, of_narrow * 0.52), kFalseAlarmRate);  // planted bug
}

/// By directions drawn from one, the density of another that is its own integrates to 1, and so it does by even ones.
TEST(DirectionLobes, DensityIsThatOfTheSamples) {
  DirectionLobes wide;
  wide.add({.axis = kAxis, .square_radius = 0.5f, .share = 1.0f});
  wide.add({.axis = kOther, .square_radius = 0.02f, .share = 3.0f});
  Moments even, own, planted;
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 400000; ++i) {
    const Vec3 w = equal_area_direction(rng.next_vec2());
    even.add(wide.pdf(w, kPlace) * 4.0 * M_PI);
    const Vec3 drawn = wide.sample(rng.next_vec2(), kPlace);
    const double uniform = dot(drawn, kOther) > 0.5f ? 1.0 / M_PI : 0.0;  // of that cap
    own.add(uniform / wide.pdf(drawn, kPlace));
    planted.add(uniform / (wide.pdf(drawn, kPlace) * 1.04));  // planted bug
    ASSERT_NEAR(length(drawn), 1.0f, 1e-5f);
  }
  EXPECT_GT(mean_p_value(even, 1.0), kFalseAlarmRate);
  EXPECT_GT(mean_p_value(own, 1.0), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(planted, 1.0), kFalseAlarmRate);
}

TEST(DirectionLobes, SharesAddUp) {
  const DirectionLobes lobes = two_lobes();
  ASSERT_EQ(lobes.lobes().size(), 2u);
  EXPECT_FLOAT_EQ(lobes.lobes()[0].share, 0.25f);
  EXPECT_FLOAT_EQ(lobes.lobes()[1].share, 0.75f);
}

TEST(DirectionLobes, NarrowOnesStayExact) {
  constexpr int kCount = 10000;
  DirectionLobes lobes;
  lobes.add({.axis = kAxis, .square_radius = 1e-8f, .share = 1.0f});
  int within = 0;
  Rng rng(3, 0, 0, 0);
  for (int i = 0; i < kCount; ++i) {
    const Vec3 w = lobes.sample(rng.next_vec2(), kPlace);
    ASSERT_TRUE(std::isfinite(lobes.pdf(w, kPlace)));
    ASSERT_GT(lobes.pdf(w, kPlace), 0.0f);
    within += length(w - kAxis) < 3e-4f ? 1 : 0;
  }
  EXPECT_NEAR(within, 0.9 * kCount, 0.02 * kCount);  // six standard deviations
  for (const float u : {0.0f, 0.9999999f}) EXPECT_NEAR(length(lobes.sample({u, u}, kPlace)), 1.0f, 1e-5f);
}

TEST(DirectionLobes, PointToTheSamePlaceFromAnywhere) {
  const Vec3 lamp = kPlace + 2.0f * kAxis, elsewhere{1, 2, -0.5f};
  DirectionLobes lobes;
  lobes.add({.axis = kAxis, .square_radius = 1e-6f, .share = 1.0f, .from = kPlace, .nearness = 0.5f});
  EXPECT_GT(dot(lobes.lobes()[0].axis_at(elsewhere), normalize(lamp - elsewhere)), 0.999999f);
  EXPECT_GT(lobes.pdf(normalize(lamp - elsewhere), elsewhere), 1e5f);
  EXPECT_GT(dot(lobes.sample({0.5f, 0.5f}, elsewhere), normalize(lamp - elsewhere)), 0.9999f);
  EXPECT_LT(lobes.pdf(kAxis, elsewhere), 1.0f);
}

TEST(DirectionGuide, IsTheMixtureOfItsParts) {
  std::array<double, DirectionHistogram::kBins> weights;
  weights.fill(1.0);
  const DirectionHistogram histogram(weights);
  const DirectionLobes lobes = two_lobes();
  const DirectionGuide both{&histogram, &lobes, kPlace};
  const float of_caustics = (1.0f - DirectionGuide::kHistogramShare) * lobes.worth();
  EXPECT_FLOAT_EQ(both.share(), DirectionGuide::kHistogramShare + of_caustics);
  for (const Vec3& w : {kAxis, kOther, Vec3{0, 0, 1}}) {
    const float parts = DirectionGuide::kHistogramShare * histogram.pdf(w) + of_caustics * lobes.pdf(w, kPlace);
    EXPECT_FLOAT_EQ(both.share() * both.pdf(w), parts);
    EXPECT_FLOAT_EQ((DirectionGuide{&histogram, nullptr, {}}.pdf(w)), histogram.pdf(w));
  }
  EXPECT_FALSE(DirectionGuide{});
}

}  // namespace
}  // namespace cistern::test
