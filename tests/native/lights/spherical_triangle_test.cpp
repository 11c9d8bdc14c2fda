#include "lights/spherical_triangle.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/warp.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kSamples = 40000;
constexpr int kBins = 8;  // per axis

EmissiveTriangle triangle(Vec3 p0, Vec3 p1, Vec3 p2) {
  EmissiveTriangle t;
  t.p0 = p0, t.edge_1 = p1 - p0, t.edge_2 = p2 - p0;
  return t;
}

EmissiveTriangle random_triangle(Rng& rng) {
  const auto corner = [&] { return Vec3{rng.next_float() - 0.5f, rng.next_float() - 0.5f, rng.next_float() + 0.2f}; };
  for (;;) {
    const EmissiveTriangle t = triangle(corner(), corner(), corner());
    if (SphericalTriangle::of(t, {})) return t;
  }
}

/// Where a direction meets the triangle, as numbers that are uniform over the square where directions by `place` are.
Vec2 square_of(Vec2 barycentric) {
  const float x = barycentric.x + barycentric.y;
  return {x * x, x > 0.0f ? barycentric.y / x : 0.0f};
}

/// Whether directions have the density: counts in bins of the triangle, against that density by quadrature over the
/// area, in double precision.
double p_value(const EmissiveTriangle& t, bool by_area) {
  std::vector<double> observed(kBins * kBins), expected(kBins * kBins);
  const SphericalTriangle seen = *SphericalTriangle::of(t, {});
  Rng rng(7, 0, 0, 0);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2 u = rng.next_vec2();
    const Vec2 s = square_of(by_area ? square_to_triangle(u) : barycentric_along(t, {}, seen.direction(u)));
    const int x = std::min(static_cast<int>(s.x * kBins), kBins - 1);
    const int y = std::min(static_cast<int>(s.y * kBins), kBins - 1);
    ++observed[static_cast<size_t>(y * kBins + x)];
  }
  constexpr int kFine = 16;
  const double area = t.area();
  for (int y = 0; y < kBins * kFine; ++y) {
    for (int x = 0; x < kBins * kFine; ++x) {
      const double sum = std::sqrt((x + 0.5) / (kBins * kFine)), b2 = sum * (y + 0.5) / (kBins * kFine);
      const Vec3 p = t.point({static_cast<float>(sum - b2), static_cast<float>(b2)});
      const double d2 = length_squared(p), projected = std::abs(dot(normalize(t.scaled_normal()), p));
      expected[static_cast<size_t>(y / kFine * kBins + x / kFine)] +=
          kSamples * double{seen.pdf()} * area / sqr(kBins * kFine) * projected / (d2 * std::sqrt(d2));
    }
  }
  return chi_square_p_value(observed, expected);
}

TEST(SphericalTriangle, AnOctantIsAnEighthOfAllDirections) {
  const auto seen = SphericalTriangle::of(triangle({1, 0, 0}, {0, 1, 0}, {0, 0, 1}), {});
  EXPECT_NEAR(1.0f / seen->pdf(), kPi / 2.0f, 1e-6f);
  const auto below = SphericalTriangle::of(triangle({-50, -50, 0}, {50, -50, 0}, {0, 50, 0}), {0, 0, 1e-3f});
  EXPECT_NEAR(1.0f / below->pdf(), 2.0f * kPi, 1e-3f) << "nearly a half space";
}

TEST(SphericalTriangle, SamplesUniformlyBySolidAngle) {
  const double rate = shared_rate(20);
  Rng rng(8, 0, 0, 0);
  for (int i = 0; i < 19; ++i) EXPECT_GT(p_value(random_triangle(rng), false), rate) << i;
  EXPECT_LT(p_value(triangle({-0.2f, 0, 0.3f}, {3, 0, 0.3f}, {0, 2, 0.3f}), true), rate) << "planted: by area";
}

constexpr Vec3 kNormal{0, 0, 1};  // of a receiver at the origin

/// Irradiance there by unit radiance, as the mean over strata: the whole square is used.
double sampled_irradiance(const EmissiveTriangle& t) {
  constexpr int kSide = 512;  // off by 1e-5, with 128 by 1e-4
  const SphericalTriangle seen = *SphericalTriangle::of(t, {});
  double sum = 0.0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      sum += dot(seen.direction(Vec2{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f} * (1.0f / kSide)),
                 kNormal);
  return sum / sqr(kSide) / seen.pdf();
}

/// The same by Lambert's formula: half the sum over edges of the angle between their ends times the z of their plane's
/// normal.
double irradiance(const EmissiveTriangle& t) {
  double sum = 0.0;
  const Vec3 corners[] = {t.p0, t.p0 + t.edge_1, t.p0 + t.edge_2};
  for (int i = 0; i < 3; ++i) {
    const Vec3 a = corners[i], b = corners[(i + 1) % 3], across = cross(a, b);
    sum += 0.5 * std::atan2(double{length(across)}, double{dot(a, b)}) * double{normalize(across).z};
  }
  return std::abs(sum);
}

TEST(SphericalTriangle, KeepsStrata) {
  const EmissiveTriangle t = triangle({-0.5f, -0.4f, 0.4f}, {1, 0, 0.5f}, {0, 1.5f, 0.6f});
  EXPECT_NEAR(sampled_irradiance(t), irradiance(t), 5e-5);
}

/// There two corners are seen in nearly opposite directions. (With 1 + a b as it stands a third of the light is lost.)
TEST(SphericalTriangle, IsExactNextToAnEdge) {
  for (const float distance : {1e-2f, 1e-3f, 1e-4f, 1e-5f}) {
    const EmissiveTriangle t = triangle({-0.3f, distance, distance}, {0.7f, distance, distance}, {0.1f, 1, distance});
    EXPECT_NEAR(sampled_irradiance(t) / irradiance(t), 1.0, 3e-3) << distance;
  }
}

TEST(SphericalTriangle, LeavesToSamplingByAreaWhatIsAsGoodThere) {
  const EmissiveTriangle t = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  EXPECT_TRUE(SphericalTriangle::of(t, {0, 0, 1}));
  EXPECT_FALSE(SphericalTriangle::of(t, {0, 0, 9})) << "far away";
  EXPECT_FALSE(SphericalTriangle::of(t, {2, 0, 0})) << "edge-on";
  EXPECT_FALSE(SphericalTriangle::of(t, {1, 0, 0})) << "at a corner";
  EXPECT_FALSE(SphericalTriangle::of(triangle({0, 0, 1}, {1, 0, 1}, {2, 0, 1}), {})) << "without area";
}

}  // namespace
}  // namespace cistern::test
