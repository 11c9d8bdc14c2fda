#include "lights/environment_sampling.h"

#include <gtest/gtest.h>

#include "lights/light_scenes.h"
#include "shading/material.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

/// Radiance `glow` max(z, 0)^8 + `base`, towards +Z.
Scene scene_with_glow(float glow = 20.0f, float base = 0.1f) {
  ProgramWriter w;
  const Operand z = w.add(Op::SEPARATE_Z, {w.add(Op::GENERATED, {}, {0})});
  const Operand up = w.add(Op::MATH, {z, w.constant(0.0f), w.constant(0.0f)}, {12, 0});
  const Operand power = w.add(Op::MATH, {up, w.constant(8.0f), w.constant(0.0f)}, {5, 0});
  const Operand strength = w.add(Op::MATH, {power, w.constant(glow), w.constant(base)}, {4, 0});
  Scene scene;
  scene.materials = {w.emit({1, 1, 1}, strength)};
  scene.environment.material = 0;
  return scene;
}

/// A black equirectangular image with a single pixel of value 1e5.
Scene scene_with_bright_pixel(int width, int x, int y) {
  const auto pixels = std::make_shared<std::vector<float>>(static_cast<size_t>(width * width / 2), 0.0f);
  (*pixels)[static_cast<size_t>(y * width + x)] = 1e5f;
  const auto image = std::make_shared<Image>();
  image->name = "pixel";
  image->width = width, image->height = width / 2, image->channels = 1;
  image->format = PixelFormat::FLOAT;
  image->pixels = std::shared_ptr<const void>(pixels, pixels->data());
  ProgramWriter w;
  w.use_image(0);
  const Operand color = w.add(Op::ENVIRONMENT_IMAGE, {w.add(Op::GENERATED, {}, {0})}, {0, 0, 0});
  Scene scene;
  scene.images = {image};
  scene.materials = {w.emit(color, w.constant(1.0f), 1)};
  scene.environment.material = 0;
  return scene;
}

/// Samples in equal-area bins of the sphere against the density integrated over each.
double p_value(const EnvironmentSampler& sampler, bool plant_missing_share = false) {
  constexpr int kColumns = 24, kRows = 24, kCells = 24, kDraws = 100000;
  std::vector<double> observed(kColumns * kRows), expected(kColumns * kRows);
  Rng rng(11, 0, 0, 0);
  for (int i = 0; i < kDraws; ++i) {
    const Vec3 d = sampler.sample(rng.next_vec2()).direction;
    const int x = std::min(static_cast<int>((std::atan2(d.y, d.x) / (2.0f * kPi) + 0.5f) * kColumns), kColumns - 1);
    const int y = std::min(static_cast<int>((0.5f - 0.5f * d.z) * kRows), kRows - 1);
    ++observed[static_cast<size_t>(y * kColumns + x)];
  }
  const double cell = 4.0 * std::numbers::pi / (kColumns * kRows * kCells * kCells);
  for (int y = 0; y < kRows * kCells; ++y) {
    for (int x = 0; x < kColumns * kCells; ++x) {
      const float z = 1.0f - 2.0f * (static_cast<float>(y) + 0.5f) / (kRows * kCells);
      const float phi = 2.0f * kPi * ((static_cast<float>(x) + 0.5f) / (kColumns * kCells) - 0.5f);
      const float s = std::sqrt(1.0f - z * z);
      const double pdf = sampler.pdf({s * std::cos(phi), s * std::sin(phi), z});
      const double planted = plant_missing_share ? 0.02 / (4.0 * std::numbers::pi) : 0.0;
      expected[static_cast<size_t>(y / kCells * kColumns + x / kCells)] +=
          kDraws * cell * (pdf - planted) / (plant_missing_share ? 0.98 : 1.0);
    }
  }
  return chi_square_p_value(observed, expected);
}

TEST(EnvironmentSampling, MatchesItsDensity) {
  Scene scene = scene_with_glow();
  scene.environment.importance_width = 192;  // texels that do not straddle the test's bins
  for (const EnvironmentDensity density : {EnvironmentDensity::COMPLETE, EnvironmentDensity::COMPENSATED}) {
    const auto sampler = EnvironmentSampler::build(scene, density);
    ASSERT_TRUE(sampler);
    EXPECT_GT(p_value(*sampler), kFalseAlarmRate);
    EXPECT_LT(p_value(*sampler, true), kFalseAlarmRate) << "planted: density without the uniform share";
  }
}

TEST(EnvironmentSampling, SampleReportsItsDensity) {
  const auto sampler = EnvironmentSampler::build(scene_with_glow(), EnvironmentDensity::COMPLETE);
  Rng rng(12, 0, 0, 0);
  int apart = 0;
  for (int i = 0; i < 20000; ++i) {
    const EnvironmentSampler::Sample s = sampler->sample(rng.next_vec2());
    if (std::abs(s.pdf - sampler->pdf(s.direction)) > 1e-3f * s.pdf) ++apart;  // on a texel's edge, by rounding
  }
  EXPECT_LT(apart, 20);
}

TEST(EnvironmentSampling, EstimatesIrradianceWithLittleNoise) {
  const Scene scene = scene_with_glow();
  const auto sampler = EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE);
  Moments flux;
  Rng rng(13, 0, 0, 0);
  for (int i = 0; i < 20000; ++i) {
    const EnvironmentSampler::Sample s = sampler->sample(rng.next_vec2());
    flux.add(evaluate_environment(scene, s.direction, {}).r / s.pdf);
  }
  const double expected = 2.0 * std::numbers::pi * (20.0 / 9.0 + 0.2);
  EXPECT_GT(mean_p_value(flux, expected), kFalseAlarmRate);
  EXPECT_LT(std::sqrt(flux.variance()) / flux.mean(), 0.1);
  EXPECT_NEAR(sampler->mean_radiance() * 4.0 * std::numbers::pi, expected, 1e-3 * expected);
}

TEST(EnvironmentSampling, FindsASingleBrightPixel) {
  for (const int importance_width : {0, 64, 100}) {
    for (const int x : {3, 254, 255}) {
      Scene scene = scene_with_bright_pixel(256, x, 70);
      scene.environment.importance_width = importance_width;
      const auto sampler = EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE);
      ASSERT_TRUE(sampler);
      Rng rng(14, 0, 0, 0);
      int hits = 0;
      Moments ratio;
      for (int i = 0; i < 4000; ++i) {
        const EnvironmentSampler::Sample s = sampler->sample(rng.next_vec2());
        const float radiance = evaluate_environment(scene, s.direction, {}).r;
        if (radiance > 0.0f) ++hits;
        ratio.add(radiance / s.pdf);
      }
      EXPECT_GT(hits, importance_width == 0 ? 1500 : 200);
      EXPECT_LT(std::sqrt(ratio.variance()) / ratio.mean(), importance_width == 0 ? 1.5 : 4.0);
    }
  }
}

TEST(EnvironmentSampling, EvenEnvironmentsAreUniformOrLeftToTheBsdf) {
  Scene constant;
  constant.materials = {constant_emission({1, 2, 3})};
  constant.environment.material = 0;
  Scene plain = scene_with_glow();
  plain.environment.use_importance_sampling = false;
  for (const Scene* scene : {&constant, &plain}) {
    EXPECT_FALSE(EnvironmentSampler::build(*scene, EnvironmentDensity::COMPENSATED));
    const auto sampler = EnvironmentSampler::build(*scene, EnvironmentDensity::COMPLETE);
    ASSERT_TRUE(sampler);
    EXPECT_FLOAT_EQ(sampler->pdf({0, 0, 1}), 1.0f / (4.0f * kPi));
    EXPECT_FLOAT_EQ(sampler->pdf({0, 0, -1}), 1.0f / (4.0f * kPi));
  }
  EXPECT_FALSE(EnvironmentSampler::build(scene_with_glow(0.01f, 1.0f), EnvironmentDensity::COMPENSATED));
  EXPECT_TRUE(EnvironmentSampler::build(scene_with_glow(0.4f, 1.0f), EnvironmentDensity::COMPENSATED));
}

constexpr float kSunRadiance = 40000.0f, kSunAngle = 0.005f;
const Vec3 kSunDirection = normalize(Vec3{0.3f, -0.7f, 0.5f});

struct SunInSky {
  Vec3 direction = kSunDirection;
  float half_angle = kSunAngle;
  float radiance() const { return kSunRadiance * sqr(kSunAngle / half_angle); }  // the same light of all
};

/// Sky of radiance 1 and a disc, both seen through a turn by `angle` about z and a scaling of z.
Scene scene_with_sun(float angle = 0.0f, float z_scale = 1.0f, Vec3 sky = {1, 1, 1}, const SunInSky& sun = {}) {
  ProgramWriter w;
  const Operand zero = w.constant(0.0f), view = w.add(Op::GENERATED, {}, {0});
  const Operand turned = w.add(Op::MAPPING, {view, zero, w.constant({0, 0, angle}), w.constant({1, 1, z_scale})}, {0});
  const Operand radiance = w.constant(sun.radiance());
  const Operand angles = w.constant({sun.half_angle, 0.0f, 1.5f});
  const Operand seen =
      w.add(Op::SUN_DISC,
            {turned, w.constant(sky), w.constant(sun.direction), angles, radiance, radiance, w.constant(-1.6f)}, {0});
  Scene scene;
  scene.materials = {w.emit(seen, w.constant(1.0f))};
  scene.environment.material = 0;
  return scene;
}

/// What the disc adds to the flux through a sphere: its limb is darker than the middle.
double sun_flux() { return std::numbers::pi * sqr(static_cast<double>(kSunAngle)) * kSunRadiance * (1.0 - 0.6 / 3.0); }

Moments sampled_flux(const Scene& scene, const EnvironmentSampler& sampler, int draws) {
  Moments flux;
  Rng rng(15, 0, 0, 0);
  for (int i = 0; i < draws; ++i) {
    const EnvironmentSampler::Sample s = sampler.sample(rng.next_vec2());
    flux.add(evaluate_environment(scene, s.direction, {}).r / s.pdf);
  }
  return flux;
}

TEST(EnvironmentSampling, FindsTheSunBehindNodesThatTurnIt) {
  for (const float angle : {0.0f, 2.1f}) {
    const Scene scene = scene_with_sun(angle);
    const SkySuns suns = find_sky_suns(scene);
    ASSERT_TRUE(suns.are_all_found);
    ASSERT_EQ(suns.cones.size(), 1u);
    EXPECT_GT(evaluate_environment(scene, suns.cones[0].axis, {}).r, 0.999f * kSunRadiance);
    const auto sampler = EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE);
    ASSERT_TRUE(sampler);
    const Moments flux = sampled_flux(scene, *sampler, 20000);
    EXPECT_GT(mean_p_value(flux, 4.0 * std::numbers::pi + sun_flux()), kFalseAlarmRate);
    EXPECT_LT(mean_p_value(flux, 4.0 * std::numbers::pi), kFalseAlarmRate) << "planted: no disc";
    EXPECT_LT(std::sqrt(flux.variance()) / flux.mean(), 0.7);
    EXPECT_NEAR(sampler->mean_radiance(), 1.0 + sun_flux() / (4.0 * std::numbers::pi), 0.01);
  }
}

/// Of samples that rounding takes out of their cone too: with the density of the sky alone they would be fireflies.
TEST(EnvironmentSampling, SunSamplesReportTheirDensity) {
  Rng rng(16, 0, 0, 0);
  int outside = 0;
  for (const float half_angle : {kSunAngle, 2.5e-4f, 2.5e-5f}) {
    int in_sun = 0;
    for (int k = 0; k < 8; ++k) {
      const SunInSky sun{square_to_sphere(rng.next_vec2()), half_angle};
      Scene scene = scene_with_sun(0.0f, 1.0f, {1, 1, 1}, sun);
      scene.environment.importance_width = 64;
      const auto sampler = EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE);
      ASSERT_TRUE(sampler);
      const float of_sun = sampler->pdf(sun.direction);
      for (int i = 0; i < 10000; ++i) {
        const EnvironmentSampler::Sample s = sampler->sample(rng.next_vec2());
        EXPECT_GE(s.pdf, 0.999f * sampler->pdf(s.direction));
        if (length(s.direction - sun.direction) > 1.1f * half_angle) continue;
        ++in_sun;
        outside += sampler->pdf(s.direction) < 0.5f * of_sun;
        ASSERT_GT(s.pdf, 0.9f * of_sun) << half_angle;
      }
    }
    EXPECT_GT(in_sun, 12000);
    EXPECT_LT(in_sun, 64000);
  }
  EXPECT_GT(outside, 0) << "no sample whose density its direction alone would get wrong";
}

TEST(EnvironmentSampling, SunSamplesReportTheirDensityBesidePortals) {
  Rng rng(19, 0, 0, 0);
  int outside = 0, in_sun = 0;
  for (int k = 0; k < 8; ++k) {
    const SunInSky sun{square_to_sphere(rng.next_vec2()), 2.5e-5f};
    auto scene = std::make_shared<Scene>(scene_with_sun(0.0f, 1.0f, {1, 1, 1}, sun));
    scene->environment.importance_width = 64;
    AreaLight portal{{0, 0, 1}, {2, 0, 0}, {0, 2, 0}, {0, 0, -1}};
    portal.is_portal = true;
    scene->lights = {make_light(portal)};
    const LightSet lights(scene, LightSampling::TREE, EnvironmentDensity::COMPENSATED);
    const float of_sun = lights.environment_pdf(sun.direction, {});
    for (int i = 0; i < 10000; ++i) {
      const auto light = lights.evaluate({*lights.environment_emitter(), rng.next_vec2()}, {}, {});
      if (!light || length(light->wi - sun.direction) > 1.1f * sun.half_angle) continue;
      ++in_sun;
      outside += lights.environment_pdf(light->wi, {}) < 0.5f * of_sun;
      ASSERT_GT(light->pdf, 0.9f * of_sun);
    }
  }
  EXPECT_GT(in_sun, 4000);
  EXPECT_GT(outside, 0) << "no sample whose density its direction alone would get wrong";
}

TEST(EnvironmentSampling, AloneTheSunIsNearlyAllThatIsSampled) {
  const Scene scene = scene_with_sun(0.0f, 1.0f, {0, 0, 0});
  const auto sampler = EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE);
  ASSERT_TRUE(sampler);
  EXPECT_GT(mean_p_value(sampled_flux(scene, *sampler, 20000), sun_flux()), kFalseAlarmRate);
}

TEST(EnvironmentSampling, SunThatNodesBendIsFoundByTheMap) {
  const Scene scene = scene_with_sun(0.0f, 1.7f);
  EXPECT_FALSE(find_sky_suns(scene).are_all_found);
  const auto sampler = EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE);
  ASSERT_TRUE(sampler);
  Rng rng(17, 0, 0, 0);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const EnvironmentSampler::Sample s = sampler->sample(rng.next_vec2());
    if (evaluate_environment(scene, s.direction, {}).r > 0.3f * kSunRadiance) ++hits;
  }
  EXPECT_GT(hits, 200);
}

/// In numbers: the mean of 20 max(z, 0)^8 + 0.1 is 0.1 + 20 / 18, which the glow exceeds where z^8 > 1 / 18.
TEST(EnvironmentSampling, CompensatedSamplesAreForWhatExceedsTheMean) {
  const auto sampler = EnvironmentSampler::build(scene_with_glow(), EnvironmentDensity::COMPENSATED);
  ASSERT_TRUE(sampler);
  const double edge = std::pow(1.0 / 18.0, 1.0 / 8.0);
  const double above = 0.5 * 20.0 * ((1.0 - std::pow(edge, 9.0)) / 9.0 - (1.0 - edge) / 18.0);
  EXPECT_NEAR(sampler->mean_radiance(), above, 2e-3 * above);
  const auto density_at = [&](float z) { return sampler->pdf({std::sqrt(1.0f - z * z), 0.0f, z}); };
  const double uniform = 0.2 / (4.0 * std::numbers::pi);
  EXPECT_NEAR(density_at(static_cast<float>(edge) - 0.02f), uniform, 1e-6);
  EXPECT_NEAR(density_at(-0.5f), uniform, 1e-6);
  const double excess = 20.0 * std::pow(0.9, 8.0) - 20.0 / 18.0;
  EXPECT_NEAR(density_at(0.9f), uniform + 0.8 * excess / (4.0 * std::numbers::pi * above), 0.02 * density_at(0.9f));
}

TEST(EnvironmentSampling, SunsInAnEvenSkyAreFoundWithAnyDensity) {
  const Scene scene = scene_with_sun();
  const auto sampler = EnvironmentSampler::build(scene, EnvironmentDensity::COMPENSATED);
  ASSERT_TRUE(sampler);
  EXPECT_GT(mean_p_value(sampled_flux(scene, *sampler, 20000), 4.0 * std::numbers::pi + sun_flux()), kFalseAlarmRate);
  EXPECT_NEAR(sampler->mean_radiance(), sun_flux() / (4.0 * std::numbers::pi), 0.01);
}

TEST(EnvironmentSampling, BlackEnvironmentsAreNotSampled) {
  Scene scene;
  EXPECT_FALSE(EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE));
  scene.materials = {constant_emission({0, 0, 0})};
  scene.environment.material = 0;
  EXPECT_FALSE(EnvironmentSampler::build(scene, EnvironmentDensity::COMPLETE));
}

}  // namespace
}  // namespace cistern::test
