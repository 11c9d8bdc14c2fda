#include "scene/splat_cloud.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/check.h"
#include "base/rng.h"
#include "base/srgb.h"
#include "base/warp.h"
#include "scene/scene_builder.h"

namespace cistern {
namespace {

constexpr uint8_t kZero = 128;  // in 8 bits, nearly

struct Splats {
  std::vector<Vec3> positions, scales;
  std::vector<std::array<float, 4>> rotations, radiance;

  void add(Vec3 position, Vec3 scale, std::array<float, 4> rotation, float opacity) {
    positions.push_back(position);
    scales.push_back(scale);
    rotations.push_back(rotation);
    radiance.push_back({0.0f, 0.0f, 0.0f, opacity});
  }
  SplatInput input() const {
    SplatInput input;
    input.name = "garden";
    input.positions = positions;
    input.scales = scales;
    input.rotations = rotations;
    input.radiance = radiance;
    return input;
  }
  const Mesh& build(SceneBuilder& builder) const {
    return *builder.scene().meshes[static_cast<size_t>(builder.add_splats(input()))];
  }
};

SplatColors cloud_with(std::array<std::array<uint8_t, 3>, SplatColors::kHarmonics> harmonics) {
  SplatColors cloud;
  cloud.base = {Vec3{}};
  cloud.harmonics = {harmonics};
  return cloud;
}

/// What sRGB - 0.5 the first channel has.
float seen(const SplatColors& cloud, Vec3 direction) {
  const float linear = cloud.radiance(0, direction).r;
  return 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f - 0.5f;
}

TEST(SplatCloud, HarmonicsAreOrthonormal) {
  // By 200,000 directions the standard error of a product is at most 0.003: one in 2e10 is off by 0.02.
  Rng rng(7, 0, 0, 0);
  std::array<std::array<double, SplatColors::kHarmonics>, SplatColors::kHarmonics> products{};
  std::vector<SplatColors> clouds;
  for (size_t i = 0; i < SplatColors::kHarmonics; ++i) {
    std::array<std::array<uint8_t, 3>, SplatColors::kHarmonics> one;
    one.fill({kZero, kZero, kZero});
    one[i][0] = 160;  // 65 / 255
    clouds.push_back(cloud_with(one));
  }
  std::array<std::array<uint8_t, 3>, SplatColors::kHarmonics> none;
  none.fill({kZero, kZero, kZero});
  const SplatColors nothing = cloud_with(none);
  constexpr int kDirections = 200000;
  constexpr double kScale = 255.0 / 64.0;  // 160 - 128 steps of 2 / 255
  for (int n = 0; n < kDirections; ++n) {
    const Vec3 direction = square_to_sphere(rng.next_vec2());
    std::array<double, SplatColors::kHarmonics> values;
    const float offset = seen(nothing, direction);
    for (size_t i = 0; i < values.size(); ++i) values[i] = kScale * (seen(clouds[i], direction) - offset);
    for (size_t i = 0; i < values.size(); ++i)
      for (size_t j = 0; j < values.size(); ++j) products[i][j] += values[i] * values[j] * 4.0 * M_PI / kDirections;
  }
  for (size_t i = 0; i < products.size(); ++i)
    for (size_t j = 0; j < products.size(); ++j) EXPECT_NEAR(products[i][j], i == j ? 1.0 : 0.0, 0.02) << i << ' ' << j;
}

TEST(SplatCloud, FirstBandHasTheSignsThatSplatsAreTrainedWith) {
  for (const auto& [index, direction] :
       {std::pair{size_t{0}, Vec3{0.0f, -1.0f, 0.0f}}, std::pair{size_t{1}, Vec3{0.0f, 0.0f, 1.0f}},
        std::pair{size_t{2}, Vec3{-1.0f, 0.0f, 0.0f}}}) {
    std::array<std::array<uint8_t, 3>, SplatColors::kHarmonics> one;
    one.fill({kZero, kZero, kZero});
    one[index][0] = 255;
    const SplatColors cloud = cloud_with(one);
    EXPECT_NEAR(seen(cloud, direction) - seen(cloud, -direction), 2.0f * 0.4886f * 254.0f / 255.0f, 0.03f) << index;
  }
}

TEST(SplatCloud, ColoursGoToTheWorkingSpace) {
  SplatColors cloud;
  cloud.base = {{1.0f, 0.0f, -1.0f}};
  const Rgb rec709 = cloud.radiance(0, {0.0f, 0.0f, 1.0f});
  EXPECT_NEAR(rec709.r, srgb_to_linear_exact(0.5f + 0.2820948f), 1e-6f);
  EXPECT_NEAR(rec709.b, srgb_to_linear_exact(0.5f - 0.2820948f), 1e-6f);
  cloud.has_colour_matrix = true;
  cloud.to_working_space = {0.0f, 1.0f, 0.0f, 2.0f, 0.0f, 0.0f, 0.0f, 0.0f, -1.0f};
  EXPECT_EQ(cloud.radiance(0, {0.0f, 0.0f, 1.0f}), (Rgb{rec709.g, 2.0f * rec709.r, 0.0f}));
}

TEST(SplatCloud, WhatHasNoShapeIsLeftOutAndCounted) {
  constexpr std::array<float, 4> kAsItIs{1.0f, 0.0f, 0.0f, 0.0f};
  constexpr Vec3 kUnit{1.0f, 1.0f, 1.0f};
  Splats splats;
  splats.add({}, kUnit, kAsItIs, 1.0f);
  splats.add({NAN, 0.0f, 0.0f}, kUnit, kAsItIs, 1.0f);
  splats.add({}, {0.0f, 1.0f, 1.0f}, kAsItIs, 1.0f);
  splats.add({}, {INFINITY, 1.0f, 1.0f}, kAsItIs, 1.0f);
  splats.add({}, kUnit, {0.0f, 0.0f, 0.0f, 0.0f}, 1.0f);
  splats.add({}, kUnit, {NAN, 0.0f, 0.0f, 0.0f}, 1.0f);
  splats.add({}, kUnit, kAsItIs, NAN);
  SceneBuilder builder;
  const Mesh& mesh = splats.build(builder);
  EXPECT_EQ(mesh.triangle_count(), 1u);
  EXPECT_EQ(mesh.dropped_triangles, 6u);
}

TEST(SplatCloud, WhatCannotBeSeenIsLeftOutInSilence) {
  Splats splats;
  for (const float opacity : {0.0f, -1.0f, 0.01f, 0.02f})
    splats.add({}, {1.0f, 1.0f, 1.0f}, {1.0f, 0.0f, 0.0f, 0.0f}, opacity);
  SceneBuilder builder;
  const Mesh& mesh = splats.build(builder);
  EXPECT_EQ(mesh.triangle_count(), 1u);
  EXPECT_EQ(mesh.dropped_triangles, 0u);
  EXPECT_NEAR(mesh.radii[3], std::sqrt(2.0f * std::log(2.0f)), 1e-5f);
}

TEST(SplatCloud, TurnsByQuaternionsOfAnyLength) {
  Splats splats;
  const float half = 0.25f * static_cast<float>(M_PI);  // a quarter turn about z takes x to y
  splats.add({}, {2.0f, -0.5f, 1.0f}, {3.0f * std::cos(half), 0.0f, 0.0f, 3.0f * std::sin(half)}, 1.0f);
  SceneBuilder builder;
  const Gaussian& gaussian = splats.build(builder).splats->gaussians[0];
  const Vec3 along_y = gaussian.in_deviations({0.0f, 2.0f, 0.0f});
  EXPECT_NEAR(std::abs(along_y.x), 1.0f, 1e-6f);
  EXPECT_NEAR(along_y.y, 0.0f, 1e-6f);
  EXPECT_EQ(gaussian.flattest, 1);
  EXPECT_NEAR(std::abs(normalize(gaussian.normal()).x), 1.0f, 1e-6f);
}

TEST(SplatCloud, EqualCloudsKeepTheirMesh) {
  Splats splats;
  splats.add({}, {1.0f, 1.0f, 1.0f}, {1.0f, 0.0f, 0.0f, 0.0f}, 0.5f);
  SceneBuilder builder;
  const Mesh* const first = &splats.build(builder);
  builder.add_splats(splats.input(), 0);
  EXPECT_EQ(builder.scene().meshes[0].get(), first);
  splats.radiance[0][0] = 1.0f;
  builder.add_splats(splats.input(), 0);
  EXPECT_NE(builder.scene().meshes[0].get(), first);
}

TEST(SplatCloud, NamesWhatDoesNotFit) {
  Splats splats;
  splats.add({}, {1.0f, 1.0f, 1.0f}, {1.0f, 0.0f, 0.0f, 0.0f}, 0.5f);
  splats.scales.push_back({});
  SceneBuilder builder;
  try {
    builder.add_splats(splats.input());
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "garden: scales have 2 elements: must have 1");
  }
}

}  // namespace
}  // namespace cistern
