#include <gtest/gtest.h>

#include "shading/nodes_color.h"
#include "shading/nodes_gabor.h"
#include "shading/nodes_math.h"
#include "shading/nodes_noise.h"
#include "shading/nodes_pattern.h"
#include "shading/nodes_radial_tiling.h"
#include "shading/nodes_voronoi.h"

// Expected values were rendered with Cycles 5.0.1 (CPU) at the point below: an orthographic 1 x 1 pixel picture of a
// plane that emits the node's output. Textures must keep their look, so these are equal up to rounding.

namespace cistern {
namespace {

constexpr Vec3 kPoint{1.37f, 2.71f, -0.63f};
constexpr float kW = 0.83f;
constexpr float kTolerance = 2e-5f;

void expect_near(Vec3 found, Vec3 expected, float tolerance = kTolerance) {
  EXPECT_NEAR(found.x, expected.x, tolerance);
  EXPECT_NEAR(found.y, expected.y, tolerance);
  EXPECT_NEAR(found.z, expected.z, tolerance);
}

TEST(NodesProcedural, NoiseEqualsCycles) {
  struct Case {
    int dimensions;
    NoiseType type;
    bool normalize;
    Vec3 color;
  };
  const Case cases[] = {{1, NoiseType::FBM, true, {0.5012106f, 0.3797075f, 0.548853f}},
                        {2, NoiseType::FBM, true, {0.4048611f, 0.3374886f, 0.3850164f}},
                        {3, NoiseType::FBM, true, {0.4778073f, 0.6600263f, 0.4205486f}},
                        {4, NoiseType::FBM, true, {0.4068512f, 0.4677781f, 0.5962785f}},
                        {3, NoiseType::MULTIFRACTAL, false, {0.8890793f, 1.743934f, 0.6788192f}},
                        {3, NoiseType::HYBRID_MULTIFRACTAL, false, {0.01650484f, 0.5733723f, -0.298301f}},
                        {3, NoiseType::RIDGED_MULTIFRACTAL, false, {0.0003990346f, 0.2612693f, 0.0892518f}},
                        {3, NoiseType::HETERO_TERRAIN, false, {0.01705636f, 0.5831779f, -0.2885746f}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(testing::Message() << c.dimensions << "D, type " << static_cast<int>(c.type));
    const NoiseSettings settings{2.5f, 0.6f, 2.1f, 0.0f, 1.0f, 0.7f, c.type, c.normalize};
    const Vec3 color = noise_color_node(kPoint * 3.0f, kW * 3.0f, c.dimensions, settings);
    expect_near(color, c.color, 1e-4f);  // the seeds lie 100 to 200 away, where floats are coarse
    EXPECT_EQ(noise_node(kPoint * 3.0f, kW * 3.0f, c.dimensions, settings), color.x);
  }
}

TEST(NodesProcedural, NoiseWithOffsetAndGainEqualsCycles) {
  struct Case {
    NoiseType type;
    Vec3 color;
  };
  const Case cases[] = {{NoiseType::HYBRID_MULTIFRACTAL, {1.3695424f, 2.246763f, 1.1301996f}},
                        {NoiseType::RIDGED_MULTIFRACTAL, {0.8263401f, 0.132105f, 0.4354484f}},
                        {NoiseType::HETERO_TERRAIN, {1.5427854f, 3.0102072f, 1.0104373f}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(static_cast<int>(c.type));
    const NoiseSettings settings{2.5f, 0.6f, 2.1f, 0.8f, 1.7f, 0.7f, c.type, false};
    expect_near(noise_color_node(kPoint * 3.0f, kW * 3.0f, 3, settings), c.color, 1e-4f);
  }
}

TEST(NodesProcedural, NoiseIsSafeFarAwayAndBoundedNearby) {
  for (const float x : {NAN, INFINITY, 1e20f, 3e6f, -1e5f})
    EXPECT_TRUE(std::isfinite(noise_node({x, x, x}, x, 4, NoiseSettings{})));
  for (int i = 0; i < 1000; ++i) {
    const float t = 0.173f * static_cast<float>(i);
    EXPECT_LE(std::abs(signed_noise({t, 1.3f * t, -0.7f * t})), 1.0f);
  }
  EXPECT_EQ(signed_noise({3.0f, -2.0f, 7.0f}), 0.0f);  // gradient noise vanishes on the lattice
}

TEST(NodesProcedural, VoronoiEqualsCycles) {
  struct Case {
    int dimensions;
    VoronoiFeature feature;
    VoronoiMetric metric;
    float distance;
    Vec3 color, position;
  };
  const Case cases[] = {{1,
                         VoronoiFeature::F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.3063982f,
                         {0.8848869f, 0.5736939f, 0.9908811f},
                         {0.9321327f, 0.9321327f, 0.9321327f}},
                        {1,
                         VoronoiFeature::F2,
                         VoronoiMetric::MINKOWSKI,
                         1.224359f,
                         {0.7937327f, 0.6276821f, 0.9340841f},
                         {1.23812f, 1.23812f, 1.23812f}},
                        {1,
                         VoronoiFeature::SMOOTH_F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.3063982f,
                         {0.8848869f, 0.5736939f, 0.9908811f},
                         {0.9321327f, 0.9321327f, 0.9321327f}},
                        {2,
                         VoronoiFeature::F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.1929738f,
                         {0.09950353f, 0.3216468f, 0.05981838f},
                         {1.434233f, 2.706568f, 0.0f}},
                        {2,
                         VoronoiFeature::F2,
                         VoronoiMetric::MINKOWSKI,
                         0.3419247f,
                         {0.9891062f, 0.6284372f, 0.5267133f},
                         {1.380116f, 2.597121f, 0.0f}},
                        {2,
                         VoronoiFeature::SMOOTH_F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.1164214f,
                         {0.2650566f, 0.311222f, 0.2808254f},
                         {1.366269f, 2.662509f, 0.0f}},
                        {3,
                         VoronoiFeature::F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.5352975f,
                         {0.997664f, 0.6640031f, 0.2903774f},
                         {1.299299f, 2.865868f, -0.5795535f}},
                        {3,
                         VoronoiFeature::F2,
                         VoronoiMetric::MINKOWSKI,
                         0.62534f,
                         {0.2105947f, 0.40583f, 0.7226635f},
                         {1.396512f, 2.788416f, -0.4498677f}},
                        {3,
                         VoronoiFeature::SMOOTH_F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.4475673f,
                         {0.6252139f, 0.5260769f, 0.407793f},
                         {1.326538f, 2.798129f, -0.5645849f}},
                        {4,
                         VoronoiFeature::F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.9254211f,
                         {0.08054928f, 0.3354852f, 0.07400948f},
                         {1.357498f, 2.433979f, -0.6444638f}},
                        {4,
                         VoronoiFeature::F2,
                         VoronoiMetric::MINKOWSKI,
                         1.011195f,
                         {0.5120868f, 0.1890892f, 0.2592044f},
                         {1.486959f, 2.723393f, -0.5889053f}},
                        {4,
                         VoronoiFeature::SMOOTH_F1,
                         VoronoiMetric::EUCLIDEAN,
                         0.7675946f,
                         {0.2016298f, 0.3640864f, 0.260886f},
                         {1.368575f, 2.650184f, -0.7087154f}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(testing::Message() << c.dimensions << "D, feature " << static_cast<int>(c.feature));
    const VoronoiSettings settings{c.feature, c.metric, 0.0f, 0.5f, 2.0f, 0.8f, 1.7f, 0.9f};
    const VoronoiResult r = voronoi_node(kPoint * 3.0f, kW * 3.0f, c.dimensions, settings);
    EXPECT_NEAR(r.distance, c.distance, kTolerance);
    expect_near(r.color, c.color);
    expect_near(c.dimensions == 1 ? Vec3{r.w, r.w, r.w} / 3.0f : r.position / 3.0f, c.position);
  }
}

TEST(NodesProcedural, VoronoiEdgesAndSpheresEqualCycles) {
  const float expected[4][2] = {
      {0.5250387f, 0.4589806f}, {0.07578292f, 0.1831429f}, {0.06230584f, 0.2694473f}, {0.03378239f, 0.3692986f}};
  for (int d = 1; d <= 4; ++d) {
    SCOPED_TRACE(d);
    VoronoiSettings s;
    s.randomness = 0.9f;
    s.feature = VoronoiFeature::DISTANCE_TO_EDGE;
    EXPECT_NEAR(voronoi_node(kPoint * 3.0f, kW * 3.0f, d, s).distance, expected[d - 1][0], kTolerance);
    s.feature = VoronoiFeature::N_SPHERE_RADIUS;
    EXPECT_NEAR(voronoi_node(kPoint * 3.0f, kW * 3.0f, d, s).distance, expected[d - 1][1], kTolerance);
  }
}

TEST(NodesProcedural, VoronoiOfSeveralOctavesEqualsCycles) {
  struct Case {
    int dimensions;
    VoronoiFeature feature;
    bool normalize;
    float distance;
    Vec3 color, position;
  };
  const Case cases[] = {
      {3,
       VoronoiFeature::F1,
       false,
       0.948136f,
       {1.7328262f, 0.8342314f, 0.4785028f},
       {1.3719636f, 2.7579658f, -0.6031655f}},
      {2, VoronoiFeature::F2, true, 0.1490279f, {0.6210828f, 0.7605056f, 0.5469862f}, {1.4012653f, 2.6794093f, 0.0f}},
      {4,
       VoronoiFeature::SMOOTH_F1,
       true,
       0.339056f,
       {0.3959266f, 0.3604943f, 0.2946356f},
       {1.3617735f, 2.6889284f, -0.6574357f}},
      {3, VoronoiFeature::DISTANCE_TO_EDGE, false, 0.0390143f, {}, {}},
      {2, VoronoiFeature::DISTANCE_TO_EDGE, true, 0.1315654f, {}, {}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(testing::Message() << c.dimensions << "D, feature " << static_cast<int>(c.feature));
    VoronoiSettings s{c.feature, VoronoiMetric::EUCLIDEAN, 2.4f, 0.6f, 2.1f, 0.8f, 0.5f, 0.9f, c.normalize};
    const VoronoiResult r = voronoi_node(kPoint * 3.0f, kW * 3.0f, c.dimensions, s);
    EXPECT_NEAR(r.distance, c.distance, kTolerance);
    expect_near(r.color, c.color);
    expect_near(r.position / 3.0f, c.position);
    s.roughness = 0.0f;  // one octave
    const float distance = voronoi_node(kPoint * 3.0f, kW * 3.0f, c.dimensions, s).distance;
    s.detail = 0.0f;
    EXPECT_EQ(voronoi_node(kPoint * 3.0f, kW * 3.0f, c.dimensions, s).distance, distance);
  }
}

TEST(NodesProcedural, VoronoiWithoutRandomnessIsTheGrid) {
  VoronoiSettings s;
  s.randomness = 0.0f;
  for (const VoronoiMetric metric : {VoronoiMetric::MANHATTAN, VoronoiMetric::CHEBYCHEV, VoronoiMetric::EUCLIDEAN}) {
    s.metric = metric;
    const VoronoiResult r = voronoi_node({3.25f, -1.125f, 0.0f}, 0.0f, 2, s);
    expect_near(r.position, {3.0f, -1.0f, 0.0f});
    const float expected = metric == VoronoiMetric::MANHATTAN
                               ? 0.375f
                               : (metric == VoronoiMetric::CHEBYCHEV ? 0.25f : std::hypot(0.25f, 0.125f));
    EXPECT_FLOAT_EQ(r.distance, expected);
  }
}

TEST(NodesProcedural, WaveEqualsCycles) {
  const float bands[] = {0.4635176f, 0.2383766f, 0.4767532f};
  for (int profile = 0; profile < 3; ++profile)
    EXPECT_NEAR(wave_node(kPoint * 1.3f, {0, 3, profile, 2.0f, 2.0f, 1.5f, 0.6f, 0.4f}), bands[profile], 1e-4f);
  EXPECT_NEAR(wave_node(kPoint * 1.3f, {1, 1, 1, 0.0f, 2.0f, 1.0f, 0.5f, 0.0f}), 0.2397799f, 1e-4f);
}

TEST(NodesProcedural, MagicEqualsCycles) {
  expect_near(magic_node(kPoint, 1.3f, 1.2f, 10, false), {0.7646406f, 0.31415f, 0.6474048f}, 1e-4f);
  expect_near(magic_node(kPoint, 1.3f, 1.2f, 3, false), {0.09735525f, 0.0977335f, 0.9448161f}, 1e-4f);
  // Cycles 5.2 and before, of p = (7, 0, 0)
  expect_near(magic_node({7.0f, 0.0f, 0.0f}, 2.5f, 1.0f, 2, true), {0.007f, 0.191f, 0.947f}, 1e-3f);
  expect_near(magic_node({7.0f, 0.0f, 0.0f}, 2.5f, 1.0f, 2, false), {0.257f, 0.191f, 0.053f}, 1e-3f);
}

TEST(NodesProcedural, BrickEqualsCycles) {
  BrickSettings s;
  s.mortar_size = 0.2f, s.mortar_smooth = 0.9f, s.bias = 0.1f, s.brick_width = 0.6f, s.row_height = 0.3f;
  s.offset = 0.3f, s.offset_frequency = 3, s.squash = 0.7f, s.squash_frequency = 2;
  const BrickResult r = brick_node(kPoint * 2.6f, s);
  // colours of the render: red to green bricks, blue mortar
  const Vec3 color{(1.0f - r.tint) * (1.0f - r.mortar), r.tint * (1.0f - r.mortar), r.mortar};
  expect_near(color, {0.004546994f, 0.02345372f, 0.9719993f}, 1e-4f);
}

TEST(NodesProcedural, GaborEqualsCycles) {
  struct Case {
    int dimensions;
    float anisotropy, value, phase, intensity;
  };
  const Case cases[] = {{2, 0.3f, 0.5425452f, 0.6049742f, 0.1388597f},
                        {2, 1.0f, 0.4729161f, 0.0297893f, 0.2910992f},
                        {3, 0.3f, 0.5076317f, 0.7677461f, 0.0153587f},
                        {3, 1.0f, 0.5346921f, 0.5448462f, 0.2495268f}};
  for (const Case& c : cases) {
    SCOPED_TRACE(testing::Message() << c.dimensions << "D, anisotropy " << c.anisotropy);
    const GaborResult r = gabor_node(kPoint * 3.0f, c.dimensions, {1.7f, c.anisotropy, 0.6f, {0.5f, -1.0f, 0.4f}});
    EXPECT_NEAR(r.value, c.value, kTolerance);
    EXPECT_NEAR(r.phase, c.phase, kTolerance);
    EXPECT_NEAR(r.intensity, c.intensity, kTolerance);
  }
}

TEST(NodesProcedural, GaborWithoutAnAxisIsFinite) {
  const GaborResult r = gabor_node(kPoint * 3.0f, 3, {1.7f, 0.5f, 0.6f, {}});
  EXPECT_TRUE(std::isfinite(r.value) && std::isfinite(r.phase) && std::isfinite(r.intensity));
}

TEST(NodesProcedural, RadialTilingEqualsBlender) {
  struct Case {
    float sides, roundness;
    bool normalize;
    float x, y, along, across, segment, width, rotation;
  };
  const Case cases[] = {
      {2.0f, 0.0f, true, -1.625653f, 0.3980979f, 1.312826f, 0.3980979f, 0.0f, 0.0f, 1.570796f},
      {3.0f, 0.2f, false, -0.6095833f, -1.668936f, -1.362383f, 0.1405491f, 2.0f, 1.487176f, 5.235988f},
      {5.0f, 0.5f, true, 1.88676f, 1.098657f, 0.4043522f, 2.172195f, 0.0f, 0.6431413f, 0.6283185f},
      {5.0f, 0.5f, true, 0.7651816f, 1.33214f, 0.87637f, 1.411522f, 0.0f, 0.6431413f, 0.6283185f},
      {7.0f, 1.0f, true, -1.590235f, 0.09569358f, 0.4330396f, 1.593111f, 3.0f, 0.448799f, 3.141593f},
      {5.4f, 0.0f, true, 0.3921139f, -0.004627618f, 0.9737774f, 0.3285227f, 5.0f, 0.2370045f, 6.050475f},
      {3.5f, 0.5f, false, 0.3921139f, -0.004627618f, 0.1796726f, -0.7355714f, 3.0f, 0.4042105f, 5.834386f},
      {3.5f, 0.5f, false, 1.72097f, -1.068794f, -0.1496493f, 0.3939197f, 3.0f, 0.4042105f, 5.834386f},
      {3.5f, 0.5f, true, 1.206178f, -0.3960201f, 0.6573229f, 0.8709477f, 3.0f, 0.4042105f, 5.834386f},
      {3.5f, 0.5f, true, 0.8469481f, -1.196229f, 0.9856429f, 1.013358f, 2.0f, 0.9645561f, 4.487989f},
      {2.3f, 0.9f, true, 1.886394f, -0.8581391f, 0.4626544f, 0.4596346f, 2.0f, 0.1389579f, 5.873413f},
      {2.3f, 0.9f, true, -0.1958445f, 1.829177f, 0.6571198f, 1.751073f, 0.0f, 1.39862f, 1.36591f},
      {12.75f, 0.2f, true, 1.149472f, -0.5613059f, 0.8326368f, 1.262503f, 11.0f, 0.2490506f, 5.667187f},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(testing::Message() << c.sides << " sides at " << c.x << " " << c.y);
    const RadialTilingResult r = radial_tiling_node(c.x, c.y, {c.sides, c.roundness, c.normalize});
    EXPECT_NEAR(r.along, c.along, 2e-5f);
    EXPECT_NEAR(r.across, c.across, 2e-5f);
    EXPECT_NEAR(r.width, c.width, 2e-5f);
    EXPECT_NEAR(r.rotation, c.rotation, 2e-5f);
    EXPECT_EQ(r.segment, c.segment);
  }
}

TEST(NodesProcedural, RadialTilingIsFinite) {
  for (const float sides : {-1.0f, 0.0f, 2.0f, 2.0001f, 2.9999f, 1e9f, INFINITY, NAN})
    for (const float roundness : {-1.0f, 0.0f, 0.5f, 1.0f, NAN})
      for (const Vec3 p : {Vec3{}, Vec3{1.0f, 0.0f, 0.0f}, Vec3{1.0f, -1e-12f, 0.0f}, Vec3{-3.0f, 2.0f, 0.0f}})
        for (const bool normalize : {false, true}) {
          const RadialTilingResult r = radial_tiling_node(p.x, p.y, {sides, roundness, normalize});
          for (const float x : {r.along, r.across, r.width, r.rotation, r.segment})
            EXPECT_TRUE(std::isfinite(x)) << sides << " " << roundness << " " << p.x << " " << p.y;
        }
}

TEST(NodesProcedural, SpectralLinesEqualCycles) {
  const auto seen = [](float nanometres) { return max(wavelength_node(nanometres), Vec3{}); };
  expect_near(seen(450.5f), {0.05626636f, 0.0f, 0.74632907f}, 2e-4f);
  expect_near(seen(560.0f), {0.15679157f, 0.5121166f, 0.0f}, 2e-4f);
  expect_near(seen(620.0f), {0.86636585f, 0.0f, 0.0f}, 2e-4f);
  for (const float dark : {370.0f, 780.0f, NAN}) expect_near(wavelength_node(dark), {});
}

TEST(NodesProcedural, GradientsOfKnownPoints) {
  EXPECT_FLOAT_EQ(gradient_node({0.3f, 0.1f, 0.0f}, 0), 0.3f);
  EXPECT_FLOAT_EQ(gradient_node({1.3f, 0.1f, 0.0f}, 0), 1.0f);
  EXPECT_FLOAT_EQ(gradient_node({0.5f, 0.1f, 0.0f}, 1), 0.25f);
  EXPECT_FLOAT_EQ(gradient_node({0.25f, 0.1f, 0.0f}, 2), 0.15625f);
  EXPECT_FLOAT_EQ(gradient_node({0.3f, 0.1f, 0.0f}, 3), 0.2f);
  EXPECT_NEAR(gradient_node(kPoint, 4), 0.675505f, kTolerance);
  EXPECT_NEAR(gradient_node({0.0f, 0.6f, 0.0f}, 5), 0.16f, kTolerance);
  EXPECT_NEAR(gradient_node({0.0f, 0.6f, 0.0f}, 6), 0.4f, kTolerance);
  EXPECT_EQ(gradient_node({1.0f, 0.0f, 0.0f}, 6), 0.0f);
}

TEST(NodesProcedural, WhiteNoiseEqualsCycles) {
  const Vec3 expected[] = {{0.5915365f, 0.7817909f, 0.6253738f},
                           {0.1004151f, 0.5866304f, 0.1679547f},
                           {0.9244469f, 0.7994217f, 0.101146f},
                           {0.1925232f, 0.08727878f, 0.4940732f}};
  for (int d = 1; d <= 4; ++d) {
    SCOPED_TRACE(d);
    expect_near(white_noise_color_node(kPoint, kW, d), expected[d - 1], 1e-6f);
    EXPECT_EQ(white_noise_node(kPoint, kW, d), white_noise_color_node(kPoint, kW, d).x);
  }
}

TEST(NodesProcedural, CheckerAlternates) {
  EXPECT_FALSE(checker_node({0.5f, 0.5f, 0.5f}) == checker_node({1.5f, 0.5f, 0.5f}));
  EXPECT_FALSE(checker_node({0.5f, 0.5f, 0.5f}) == checker_node({0.5f, 0.5f, -0.5f}));
  EXPECT_TRUE(checker_node({0.5f, 0.5f, 0.5f}) == checker_node({-0.5f, 1.5f, 0.5f}));
  EXPECT_FALSE(checker_node({0.5f, 0.5f, 0.5f}));  // colour 2 at the origin's cell, as in Blender
}

TEST(NodesProcedural, BlackbodyIsCloseToCycles) {
  // Cycles uses a fit of the same integral; both are good to about 1 %.
  struct Case {
    float kelvin;
    Vec3 color;
  };
  const Case cases[] = {{1500.0f, {3.264307f, 0.4340463f, 0.0f}},
                        {3000.0f, {1.770841f, 0.8442849f, 0.2722228f}},
                        {6500.0f, {1.042552f, 0.9840525f, 1.035272f}},
                        {11000.0f, {0.8463143f, 0.9948789f, 1.503789f}}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.kelvin);
    expect_near(blackbody_node(c.kelvin), c.color, 0.015f * max_component(to_rgb(c.color)));
    EXPECT_NEAR(luminance(to_rgb(blackbody_node(c.kelvin))), 1.0f, 0.02f);
  }
  EXPECT_EQ(blackbody_node(100.0f), blackbody_node(800.0f));
  EXPECT_EQ(blackbody_node(NAN), blackbody_node(800.0f));
}

}  // namespace
}  // namespace cistern
