#include <gtest/gtest.h>

#include "transport/path_scenes.h"

// How many light samples a path takes, and what they leave to its BSDF samples, is of no consequence for its mean.

namespace cistern::test {
namespace {

constexpr Vec3 kEye{0.0f, 0.0f, 1.0f}, kTilted{1.0f, 0.0f, -1.0f};  // towards (1, 0, 0) on the floor

/// Lamps near a glossy floor, of which BSDF samples find much: three panels, brighter ones less near.
PathScene under_panels(float radiance) {
  PathScene scene;
  scene.floor(0.0f, 6.0f, scene.mixed(0.8f, 0.3f, 0.5f));
  scene.quad({1.5f, 0.5f, 0.5f}, {0, 0.5f, 0}, {0.5f, 0, 0}, scene.emission(Vec3{1, 1, 1} * radiance));
  scene.quad({1.5f, -0.8f, 1.0f}, {0, 0.5f, 0}, {0.5f, 0, 0}, scene.emission(Vec3{2, 2, 2} * radiance));
  scene.quad({2.5f, 0.0f, 1.5f}, {0, 1.5f, 0}, {1.5f, 0, 0}, scene.emission(Vec3{1, 1, 1} * radiance));
  return scene;
}

/// Two tests of means at kFalseAlarmRate.
TEST(LightSamples, MoreLightSamplesGiveTheSamePictureWithLessNoise) {
  constexpr int kPaths = 200000;
  const auto trace = [&](int light_samples, float radiance) {
    Tracer tracer(under_panels(radiance));
    tracer.take_light_samples(light_samples);
    return tracer.trace(kEye, kTilted, kPaths);
  };
  const PathMeans one = trace(1, 1.0f), four = trace(4, 1.0f), planted = trace(4, 0.98f);
  for (const auto part : {&PathMeans::direct, &PathMeans::indirect})
    EXPECT_GT(same_mean_p_value(one.*part, four.*part), kFalseAlarmRate);
  EXPECT_LT(same_mean_p_value(one.direct, planted.direct), kFalseAlarmRate) << "planted: 2 % lost";
  EXPECT_LT(four.direct.variance(), 0.5 * one.direct.variance());
}

TEST(LightSamples, LightSamplesAreClampedTogether) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.5f));
  for (const float x : {-0.5f, 0.5f}) scene.point_lamp({x, 0, 1}, 100.0f);
  PathLimits limits;
  limits.clamp_direct = 0.5f;
  for (const int count : {1, 2, 5}) {
    Tracer tracer(scene, limits);
    tracer.take_light_samples(count);
    EXPECT_NEAR(tracer.trace({0, 0, 2}, {0, 0, -1}, 20).direct.mean(), 0.5, 1e-6) << count;
  }
}

/// With a wall that throws light back and hides a part of the sky, or without.
PathScene under_the_sky(float base, float glow, bool has_wall) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.mixed(0.8f, 0.4f, 0.3f));
  if (has_wall) scene.quad({1.25f, 0, 0.5f}, {0, 1, 0}, {0.25f, 0, 1}, scene.diffuse(0.9f));
  scene.glowing_environment(base, glow);
  return scene;
}

/// Eight tests of means at kFalseAlarmRate.
TEST(LightSamples, CompensatedEnvironmentSamplesGiveTheSamePicture) {
  constexpr int kPaths = 100000;
  for (const bool has_wall : {false, true}) {
    for (const float glow : {0.0f, 3.0f}) {
      const auto trace = [&](float scale, EnvironmentDensity density) {
        return Tracer(under_the_sky(scale, scale * glow, has_wall), {}, density).trace(kEye, kTilted, kPaths);
      };
      const PathMeans complete = trace(1.0f, EnvironmentDensity::COMPLETE);
      const PathMeans compensated = trace(1.0f, EnvironmentDensity::COMPENSATED);
      const PathMeans planted = trace(0.95f, EnvironmentDensity::COMPENSATED);
      EXPECT_GT(same_mean_p_value(complete.direct, compensated.direct), kFalseAlarmRate);
      EXPECT_LT(same_mean_p_value(complete.direct, planted.direct), kFalseAlarmRate) << "planted: 5 % lost";
      // Where nothing hides the sky, and the density of the BSDF is in proportion to it.
      if (!has_wall) EXPECT_LT(compensated.direct.variance(), 0.7 * complete.direct.variance()) << glow;
      if (!has_wall) continue;
      EXPECT_GT(same_mean_p_value(complete.indirect, compensated.indirect), kFalseAlarmRate);
      EXPECT_LT(same_mean_p_value(complete.indirect, planted.indirect), kFalseAlarmRate) << "planted: 5 % lost";
    }
  }
}

}  // namespace
}  // namespace cistern::test
