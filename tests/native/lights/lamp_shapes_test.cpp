#include "lights/lamp_shapes.h"

#include <gtest/gtest.h>

#include "base/frame.h"
#include "lights/light_scenes.h"
#include "lights/light_tree.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kSamples = 100000;
constexpr int kBins = 8;  // per axis

Light point(float radius, bool soft) { return make_light(PointLight{{0.2f, -0.1f, 3.0f}, radius, Rgb(2.0f), soft}); }

Light spot(float radius, bool soft, float half_angle, float blend) {
  SpotLight light{{{0.0f, 0.0f, 3.0f}, radius, Rgb(2.0f), soft}, {}, std::cos(half_angle), blend};
  light.world_to_local.translation = {0.0f, 0.0f, -3.0f};
  return make_light(light);
}

Light area(Vec3 u, Vec3 v, bool is_ellipse, float spread) {
  return make_light(AreaLight{{0.3f, 0.2f, 2.0f}, u, v, {0.0f, 0.0f, -1.0f}, is_ellipse, Rgb(1.5f), spread});
}

Light sun(float angle) { return make_light(SunLight{normalize(Vec3{0.3f, 0.2f, 1.0f}), angle, Rgb(3.0f)}); }

/// Irradiance at the origin on a plane facing +z, by the midpoint rule over the lamp's (u, v).
double irradiance(const Lamp& lamp, int resolution = 256) {
  double sum = 0.0;
  for (int y = 0; y < resolution; ++y) {
    for (int x = 0; x < resolution; ++x) {
      const Vec2 uv =
          Vec2{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f} * (1.0f / static_cast<float>(resolution));
      const auto sample = sample_lamp(lamp, uv, {});
      if (sample) sum += sample->radiance.r * std::max(sample->wi.z, 0.0f) / sample->pdf;
    }
  }
  return sum / (resolution * resolution);
}

/// At the origin on a plane facing +z, of radiance 1 from y = -1/2 to 1/2 and one metre up from z = `apart` in a plane
/// at x = `height` that faces it; across y in closed form, and by the midpoint rule along the logarithm of z.
double irradiance_from_the_side(double height, double apart) {
  constexpr int kSteps = 20000;
  const double step = std::log((apart + 1.0) / apart) / kSteps;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double z = apart * std::exp((i + 0.5) * step), d2 = z * z + height * height, d = std::sqrt(d2);
    // The integral of 1 / (d2 + y2)^2 over y.
    const double across = 0.5 / (d2 * (d2 + 0.25)) + std::atan(0.5 / d) / (d2 * d);
    sum += height * z * across * z * step;
  }
  return sum;
}

// --- Irradiance against closed forms ------------------------------------------------------------------------------

TEST(LampIrradiance, OfSoftSpotsIsEstimatedUpCloseToo) {
  for (const float height : {0.01f, 0.1f, 0.3f, 1.0f, 3.0f}) {
    SpotLight light{{{0.0f, 0.0f, height}, 0.2f, Rgb(2.0f), true}, {}, std::cos(0.5f), 0.01f};
    light.world_to_local.translation = {0.0f, 0.0f, -height};
    const Lamp lamp = make_lamp(make_light(light));
    const LightTree tree(std::vector{lamp_bounds(lamp)});
    const double ratio = tree.irradiance_estimate({}, {0.0f, 0.0f, 1.0f}) / irradiance(lamp);
    EXPECT_GT(ratio, 0.8) << height;
    EXPECT_LT(ratio, 1.5) << height;
  }
}

TEST(LampIrradiance, PointLightsFollowTheirFalloff) {
  const double d2 = 0.04 + 0.01 + 9.0, cosine = 3.0 / std::sqrt(d2);
  EXPECT_NEAR(irradiance(make_lamp(point(0.0f, true))), 2.0 / d2 * cosine, 1e-5);
  // A sphere off the horizon irradiates like a point; a disk facing the receiver by c / (4 pi (d^2 + r^2)).
  EXPECT_NEAR(irradiance(make_lamp(point(0.8f, false))), 2.0 / d2 * cosine, 1e-5);
  EXPECT_NEAR(irradiance(make_lamp(point(0.8f, true))), 2.0 / (d2 + 0.64) * cosine, 1e-5);
  EXPECT_GT(std::abs(irradiance(make_lamp(point(0.8f, true))) - 2.0 / d2 * cosine), 1e-3);  // planted: hard for soft
}

TEST(LampIrradiance, InsideOfASphereIsUniform) {
  const Light light = make_light(PointLight{{0.1f, 0.2f, 0.3f}, 2.0f, Rgb(kPi * 4.0f), false});  // radiance 1
  EXPECT_NEAR(irradiance(make_lamp(light)), kPi, 1e-3);
}

TEST(LampIrradiance, SpotFollowsSmoothstep) {
  for (const float half_angle : {0.2f, 0.7f, 1.4f}) {
    for (const float tilt : {0.0f, 0.1f, 0.15f, 0.5f, 0.68f}) {
      for (const float blend : {0.0f, 0.3f, 1.0f}) {
        Light light = spot(0.0f, true, half_angle, blend);
        const float s = std::sin(tilt), c = std::cos(tilt);
        std::get<SpotLight>(light.shape).world_to_local = {{c, 0, s}, {0, 1, 0}, {-s, 0, c}, {}};
        const float x = (c - std::cos(half_angle)) / ((1.0f - std::cos(half_angle)) * blend);
        const float t = clamp01(blend == 0.0f ? (tilt < half_angle ? 1.0f : 0.0f) : x);
        EXPECT_NEAR(irradiance(make_lamp(light), 1), 2.0 / 9.0 * t * t * (3.0f - 2.0f * t), 1e-5);
      }
    }
  }
}

TEST(LampIrradiance, ScaledSpotHasAnEllipticalCone) {
  Light light = spot(0.0f, true, 0.5f, 0.0f);
  std::get<SpotLight>(light.shape).world_to_local.row_x = {0.5f, 0.0f, 0.0f};  // twice as wide along x
  const Lamp lamp = make_lamp(light);
  const float reach = 3.0f * std::tan(0.5f);
  EXPECT_TRUE(sample_lamp(lamp, {}, {1.9f * reach, 0.0f, 0.0f}));
  EXPECT_FALSE(sample_lamp(lamp, {}, {2.1f * reach, 0.0f, 0.0f}));
  EXPECT_TRUE(sample_lamp(lamp, {}, {0.0f, 0.9f * reach, 0.0f}));
  EXPECT_FALSE(sample_lamp(lamp, {}, {0.0f, 1.1f * reach, 0.0f}));
}

TEST(LampIrradiance, SunDoesNotDependOnItsAngle) {
  const double cosine = 1.0 / std::sqrt(1.13);
  for (const float angle : {0.0f, 0.001f, 0.1f, 1.0f}) {
    EXPECT_NEAR(irradiance(make_lamp(sun(angle))), 3.0 * cosine, 1e-3) << angle;
  }
}

/// Of a Lambertian rectangle [0, a] x [0, b] at distance c straight above the receiver's corner, parallel to it.
/// [Siegel and Howell, configuration factor B-4]
double corner_factor(double a, double b, double c) {
  const double x = a / c, y = b / c, rx = std::sqrt(1.0 + x * x), ry = std::sqrt(1.0 + y * y);
  return (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry)) / (2.0 * std::numbers::pi);
}

TEST(LampIrradiance, RectangleMatchesConfigurationFactor) {
  for (const float size : {0.001f, 0.05f, 1.0f, 40.0f}) {
    const Lamp lamp = make_lamp(area({size, 0.0f, 0.0f}, {0.0f, 0.5f * size, 0.0f}, false, kPi));
    const double x0 = 0.3 - 0.5 * size, x1 = 0.3 + 0.5 * size, y0 = 0.2 - 0.25 * size, y1 = 0.2 + 0.25 * size;
    const double factor = corner_factor(x1, y1, 2.0) - corner_factor(x0, y1, 2.0) - corner_factor(x1, y0, 2.0) +
                          corner_factor(x0, y0, 2.0);
    EXPECT_NEAR(irradiance(lamp) / (1.5 * std::numbers::pi * factor), 1.0, 1e-3) << size;
  }
}

TEST(LampIrradiance, RectanglesMatchQuadratureFromCloseToTheirPlane) {
  // In single precision, up to a quarter of the light of a square metre was gained or lost there.
  for (const float height : {1e-1f, 1e-2f, 1e-3f, 1e-4f}) {
    for (const float apart : {0.01f, 0.1f, 0.5f}) {
      const Light light =
          make_light(AreaLight{{height, 0, apart + 0.5f}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, false, Rgb(1.0f), kPi});
      const double expected = irradiance_from_the_side(height, apart);
      EXPECT_NEAR(irradiance(make_lamp(light)) / expected, 1.0, 2e-3) << height << " m, " << apart << " m apart";
    }
  }
}

TEST(LampIrradiance, AreaLightsFaceTheirEdgesWhateverNormalTheyCameWith) {
  const Light upright = area({1.0f, 0.0f, 0.0f}, {0.0f, 0.5f, 0.0f}, false, kPi);
  Light sheared = upright;
  std::get<AreaLight>(sheared.shape).normal = normalize(Vec3{0.5f, 0.3f, -1.0f});
  EXPECT_EQ(irradiance(make_lamp(sheared)), irradiance(make_lamp(upright)));
  std::get<AreaLight>(sheared.shape).normal = normalize(Vec3{0.5f, 0.3f, 1.0f});  // the other side
  EXPECT_EQ(irradiance(make_lamp(sheared)), 0.0);
}

TEST(LampIrradiance, DiskAndEllipseMatchQuadrature) {
  Light light = area({2.0f, 0.0f, 0.0f}, {0.0f, 2.0f, 0.0f}, true, kPi);
  std::get<AreaLight>(light.shape).center = {0.0f, 0.0f, 2.0f};
  EXPECT_NEAR(irradiance(make_lamp(light)), 1.5 * std::numbers::pi * 1.0 / (1.0 + 4.0), 1e-3);
}

TEST(LampIrradiance, SpreadConcentratesLightOnTheAxis) {
  // Measured in Cycles, for a tiny lamp seen on its axis: how much brighter than without spread.
  const std::pair<float, double> measured[] = {{120.0f, 2.53}, {60.0f, 10.7}, {20.0f, 98.0}};
  for (const auto& [degrees, ratio] : measured) {
    Light light = area({1e-3f, 0.0f, 0.0f}, {0.0f, 1e-3f, 0.0f}, false, degrees * kPi / 180.0f);
    std::get<AreaLight>(light.shape).center = {0.0f, 0.0f, 2.0f};
    EXPECT_NEAR(irradiance(make_lamp(light), 16) / (1.5e-6 / 4.0), ratio, 0.005 * ratio) << degrees;
  }
}

TEST(LampIrradiance, LargeLampWithAnySpreadLightsLikeAnInfinitePlane) {
  // Spread keeps the flux: under a lamp that fills the reach of the spread, irradiance is pi * radiance.
  for (const float spread : {0.0f, 0.01f, 0.2f, 1.0f, 2.0f}) {
    for (const bool is_ellipse : {false, true}) {
      const Lamp lamp = make_lamp(area({30.0f, 0.0f, 0.0f}, {0.0f, 30.0f, 0.0f}, is_ellipse, spread));
      EXPECT_NEAR(irradiance(lamp), 1.5 * std::numbers::pi, 0.02) << spread << " " << is_ellipse;
    }
  }
}

TEST(LampIrradiance, NothingBehindAnAreaLight) {
  const Lamp lamp = make_lamp(area({1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, false, kPi));
  EXPECT_FALSE(sample_lamp(lamp, {0.5f, 0.5f}, {0.0f, 0.0f, 3.0f}));
  EXPECT_FALSE(intersect_lamp(lamp, Ray{{0.3f, 0.2f, 3.0f}, {0.0f, 0.0f, -1.0f}}));
}

// --- Samples against densities -------------------------------------------------------------------------------------

struct Histogram {
  std::vector<double> observed = std::vector<double>(kBins * kBins + 1), expected = observed;  // the last: no sample
  double p_value() {
    expected.back() = kSamples - std::accumulate(expected.begin(), expected.end() - 1, 0.0);
    expected.back() = std::max(expected.back(), 0.0);
    if (expected.back() < 1e-3 * kSamples && observed.back() == 0.0) expected.back() = 0.0;
    return chi_square_p_value(observed, expected);
  }
};

int bin_of(float x) { return std::clamp(static_cast<int>(x * kBins), 0, kBins - 1); }

/// Round lamps and suns: bins of the cone of half angle `angle` around `axis`, equal in solid angle.
double cone_p_value(const Lamp& lamp, Vec3 axis, double angle, double planted_factor = 1.0) {
  Histogram h;
  const Frame frame(axis);
  Rng rng(3, 0, 0, 0);
  const double bin_solid_angle = 2.0 * std::numbers::pi * (1.0 - std::cos(angle)) / (kBins * kBins);
  for (int i = 0; i < kSamples; ++i) {
    const auto sample = sample_lamp(lamp, rng.next_vec2(), {});
    if (!sample) {
      ++h.observed.back();
      continue;
    }
    const Vec3 d = frame.to_local(sample->wi);
    const float sin2 = sqr(d.x) + sqr(d.y);  // 1 - cos without cancellation
    const double height = (d.z > 0.0f ? sin2 / (1.0f + d.z) : 1.0f - d.z) / (1.0 - std::cos(angle));
    const float turns = std::atan2(d.y, d.x) / (2.0f * kPi) + 0.5f;
    ++h.observed[static_cast<size_t>(bin_of(static_cast<float>(height)) * kBins + bin_of(turns))];
  }
  const auto hit = intersect_lamp(lamp, Ray{{}, axis});
  for (int i = 0; i < kBins * kBins; ++i)
    h.expected[static_cast<size_t>(i)] = hit->pdf * planted_factor * bin_solid_angle * kSamples;
  return h.p_value();
}

TEST(LampSampling, RoundLampsMatchTheirDensity) {
  const double rate = shared_rate(4);
  const double d = std::sqrt(9.05);
  const Vec3 axis = normalize(Vec3{0.2f, -0.1f, 3.0f});
  EXPECT_GT(cone_p_value(make_lamp(point(0.8f, false)), axis, std::asin(0.8 / d)), rate);
  EXPECT_GT(cone_p_value(make_lamp(point(0.8f, true)), axis, std::atan(0.8 / d)), rate);
  EXPECT_GT(cone_p_value(make_lamp(point(5.0f, false)), axis, std::numbers::pi), rate);  // from inside
  EXPECT_GT(cone_p_value(make_lamp(sun(0.5f)), normalize(Vec3{0.3f, 0.2f, 1.0f}), 0.25), rate);
  EXPECT_LT(cone_p_value(make_lamp(point(0.8f, true)), axis, std::atan(0.8 / d), 0.95), rate);  // planted
}

/// Area lamps: bins of the rectangle of its edges; the density per area follows from that of `intersect_lamp`.
double area_p_value(const Light& light, bool plant_missing_cosine = false) {
  constexpr int kCells = 40;  // of the quadrature, per bin and axis
  const AreaLight& a = std::get<AreaLight>(light.shape);
  const Lamp lamp = make_lamp(light);
  Histogram h;
  Rng rng(4, 0, 0, 0);
  for (int i = 0; i < kSamples; ++i) {
    const auto sample = sample_lamp(lamp, rng.next_vec2(), {});
    if (!sample) {
      ++h.observed.back();
      continue;
    }
    const Vec3 p = sample->wi * sample->distance - a.center;
    const Vec3 normal = cross(a.edge_u, a.edge_v);
    const float s = dot(cross(p, a.edge_v), normal) / length_squared(normal);
    const float t = dot(cross(a.edge_u, p), normal) / length_squared(normal);
    ++h.observed[static_cast<size_t>(bin_of(t + 0.5f) * kBins + bin_of(s + 0.5f))];
  }
  const float cell_area = length(cross(a.edge_u, a.edge_v)) / sqr(kBins * kCells);
  for (int y = 0; y < kBins * kCells; ++y) {
    for (int x = 0; x < kBins * kCells; ++x) {
      const float s = (static_cast<float>(x) + 0.5f) / (kBins * kCells) - 0.5f;
      const float t = (static_cast<float>(y) + 0.5f) / (kBins * kCells) - 0.5f;
      const Vec3 p = a.center + a.edge_u * s + a.edge_v * t;
      const auto hit = intersect_lamp(lamp, Ray{{}, normalize(p)});
      if (!hit) continue;
      const float cosine = plant_missing_cosine ? 1.0f : -dot(normalize(p), a.normal);
      h.expected[static_cast<size_t>(y / kCells * kBins + x / kCells)] +=
          kSamples * static_cast<double>(hit->pdf * cosine * cell_area / length_squared(p));
    }
  }
  return h.p_value();
}

TEST(LampSampling, AreaLampsMatchTheirDensity) {
  const double rate = shared_rate(7);
  const Vec3 u{3.0f, 0.0f, 0.0f}, v{0.0f, 2.0f, 0.0f};
  EXPECT_GT(area_p_value(area(u, v, false, kPi)), rate) << "rectangle by solid angle";
  EXPECT_GT(area_p_value(area(u * 0.01f, v * 0.01f, false, kPi)), rate) << "tiny rectangle by area";
  EXPECT_GT(area_p_value(area(u, v + 0.5f * u, false, kPi)), rate) << "parallelogram";
  EXPECT_GT(area_p_value(area(u, v, true, kPi)), rate) << "ellipse";
  EXPECT_GT(area_p_value(area(u, v, false, 0.9f)), rate) << "rectangle with spread";
  EXPECT_GT(area_p_value(area(u, v, true, 0.9f)), rate) << "ellipse with spread";
  EXPECT_GT(area_p_value(area(u, v, true, 2.8f)), rate) << "ellipse with wide spread";
  EXPECT_LT(area_p_value(area(u, v, false, kPi), true), rate) << "planted: density without the cosine";
}

/// Every sample is found again by a ray in its direction, at the same distance with the same radiance and density.
TEST(LampSampling, RaysFindWhatSamplingFinds) {
  const Light lights[] = {point(0.8f, false),
                          point(0.8f, true),
                          point(5.0f, false),
                          spot(0.7f, true, 0.4f, 0.5f),
                          spot(0.7f, false, 0.4f, 0.5f),
                          sun(0.5f),
                          area({1, 0, 0}, {0, 2, 0}, false, kPi),
                          area({1, 0, 0}, {0, 2, 0}, true, 1.0f)};
  Rng rng(5, 0, 0, 0);
  for (const Light& light : lights) {
    const Lamp lamp = make_lamp(light);
    int lost = 0, found = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 receiver{rng.next_float() - 0.5f, rng.next_float() - 0.5f, rng.next_float()};
      const auto sample = sample_lamp(lamp, rng.next_vec2(), receiver);
      if (!sample) continue;
      const auto hit = intersect_lamp(lamp, Ray{receiver, sample->wi});
      if (!hit) {
        ++lost;  // the very edge, by rounding
        continue;
      }
      ++found;
      EXPECT_NEAR(hit->pdf / sample->pdf, 1.0f, 2e-3f);
      EXPECT_NEAR(hit->radiance.r, sample->radiance.r, 5e-3f * (1.0f + sample->radiance.r));
      if (std::isfinite(sample->distance)) {
        EXPECT_NEAR(hit->distance, sample->distance, 2e-3f);
      }
    }
    EXPECT_LT(lost, 20);
    EXPECT_GT(found, 500);
  }
}

TEST(LampSampling, RaysEndBeforeLampsBehindTheirEnd) {
  const Lamp lamp = make_lamp(point(0.5f, false));
  const Vec3 direction = normalize(Vec3{0.2f, -0.1f, 3.0f});
  EXPECT_TRUE(intersect_lamp(lamp, Ray{{}, direction}));
  EXPECT_FALSE(intersect_lamp(lamp, Ray{{}, direction, 0.0f, 2.0f}));
  EXPECT_FALSE(intersect_lamp(make_lamp(point(0.0f, false)), Ray{{}, direction}));
  EXPECT_FALSE(intersect_lamp(make_lamp(sun(0.5f)), Ray{{}, normalize(Vec3{0.3f, 0.2f, 1.0f}), 0.0f, 100.0f}));
}

}  // namespace
}  // namespace cistern::test
