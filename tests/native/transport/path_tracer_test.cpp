#include "transport/path_tracer.h"

#include <gtest/gtest.h>

#include "shading/material.h"
#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr Vec3 kEye{0.0f, 0.0f, 1.0f}, kDown{0.0f, 0.0f, -1.0f};
constexpr Vec3 kTilted{1.0f, 0.0f, -1.0f};  // towards (1, 0, 0) on the floor

// --- what the parts of the picture are called -----------------------------------------------------------------------

TEST(PathTracer, LampOnDiffuseIsDirectAndExact) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
  scene.point_lamp({0.0f, 2.0f, 2.0f}, 10.0f);
  Camera camera;
  camera.camera_to_world.translation = kEye;
  scene.builder.set_camera(camera, "camera");
  const PathMeans means = Tracer(scene).trace(kEye, kDown, 8);
  EXPECT_NEAR(means.direct.mean(), 0.6 / M_PI * 10.0 / 8.0 * std::sqrt(0.5), 1e-5);
  EXPECT_LT(means.direct.variance(), 1e-10);
  EXPECT_EQ(means.indirect.mean(), 0.0);
  EXPECT_EQ(means.emission.mean(), 0.0);
  EXPECT_EQ(means.environment.mean(), 0.0);
  EXPECT_EQ(means.alpha.mean(), 1.0);
  EXPECT_TRUE(means.last.hit);
  EXPECT_NEAR(means.last.depth, 1.0f, 1e-6f);
  EXPECT_NEAR(means.last.normal.z, 1.0f, 1e-6f);
  EXPECT_NEAR(means.last.albedo.g, 0.6f, 1e-5f);
}

TEST(PathTracer, SeenLightIsEmissionAlsoInAMirror) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.glossy(0.0f));
  scene.quad({0, 0, 2}, {0, 10, 0}, {10, 0, 0}, scene.emission({1.0f, 3.0f, 5.0f}));
  const Tracer tracer(scene);
  for (const Vec3 direction : {kTilted, Vec3{0, 0, 1}}) {
    const PathMeans means = tracer.trace(kEye, direction, 16);
    EXPECT_NEAR(means.emission.mean(), 3.0, 1e-4);
    EXPECT_EQ(means.direct.mean() + means.indirect.mean() + means.environment.mean(), 0.0);
  }
}

TEST(PathTracer, SkyIsEnvironmentAlsoInAMirror) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.glossy(0.0f));
  scene.environment({2.0f, 4.0f, 6.0f});
  const Tracer tracer(scene);
  for (const Vec3 direction : {kTilted, Vec3{0, 0, 1}}) {
    const PathMeans means = tracer.trace(kEye, direction, 16);
    EXPECT_NEAR(means.environment.mean(), 4.0, 1e-4);
    EXPECT_EQ(means.direct.mean() + means.indirect.mean() + means.emission.mean(), 0.0);
  }
}

TEST(PathTracer, LitFloorInAMirrorIsDirect) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.glossy(0.0f));
  scene.quad({3, 0, 2}, {0, 10, 0}, {10, 0, 0}, scene.diffuse(0.5f));  // a ceiling, facing down
  Light lamp = scene.area_lamp({3, 0, 1}, 0.5f, 1.0f, 7.0f);           // shines up at it
  scene.builder.add_light(lamp);
  const PathMeans means = Tracer(scene).trace(kEye, kTilted, 64);
  EXPECT_GT(means.direct.mean(), 0.1);
  EXPECT_EQ(means.emission.mean(), 0.0);
  // The ceiling sees itself in the mirror: two scatterings on something rough.
  EXPECT_GT(means.indirect.mean(), 0.0);
  EXPECT_LT(means.indirect.mean(), means.direct.mean());
}

TEST(PathTracer, SkyOnDiffuseIsDirect) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
  scene.environment({1.0f, 1.0f, 1.0f});
  const PathMeans means = Tracer(scene).trace(kEye, kDown, 10000);
  EXPECT_GT(mean_p_value(means.direct, 0.6), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(means.direct, 0.6 * 1.05), kFalseAlarmRate) << "planted: five percent";
  EXPECT_EQ(means.indirect.mean() + means.emission.mean() + means.environment.mean(), 0.0);
}

/// A floor that no lamp shines on directly, under a ceiling that one does.
PathScene lit_by_its_ceiling() {
  PathScene scene;
  const int paint = scene.diffuse(0.5f);
  scene.floor(0.0f, 20.0f, paint);
  scene.quad({0, 0, 3}, {0, 20, 0}, {20, 0, 0}, paint);
  scene.builder.add_light(scene.area_lamp({0, 0, 2}, 1.0f, 1.0f, 10.0f));
  return scene;
}

TEST(PathTracer, LightFromAnotherDiffuseSurfaceIsIndirect) {
  const PathMeans means = Tracer(lit_by_its_ceiling()).trace(kEye, kDown, 500);
  EXPECT_GT(means.indirect.mean(), 0.05);
  EXPECT_EQ(means.direct.mean() + means.emission.mean() + means.environment.mean(), 0.0);
}

// --- estimators -----------------------------------------------------------------------------------------------------

/// Radiance that a rough plate at the origin sends to kGlossyEye from a light above, estimated in three ways.
constexpr Vec3 kGlossyEye{-1.0f, 0.0f, 1.0f};
constexpr Vec3 kGlossyView{1.0f, 0.0f, -1.0f};
constexpr float kLampSize = 1.0f, kLampRadiance = 4.0f;
constexpr Vec3 kLampCenter{1.2f, 0.0f, 1.0f};

enum class Cover { NONE, CLEAR, OPAQUE };

/// With a cover between plate and lamp the latter casts no shadow.
Moments glossy_plate(float roughness, bool use_mis, Cover cover = Cover::NONE) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.glossy(roughness));
  Light lamp = scene.area_lamp(kLampCenter, kLampSize, -1.0f, kLampRadiance);
  lamp.use_mis = use_mis;
  lamp.casts_shadow = cover == Cover::NONE;
  if (cover != Cover::NONE) {
    const int material = cover == Cover::CLEAR ? scene.transparent({1, 1, 1}) : scene.diffuse(0.0f);
    scene.quad({1.2f, 0.0f, 0.5f}, {2, 0, 0}, {0, 2, 0}, material);
  }
  scene.builder.add_light(lamp);
  const PathMeans means = Tracer(scene).trace(kGlossyEye, kGlossyView, 60000);
  // Rough or smooth: only one part of this picture has light.
  return roughness < kReconnectRoughness ? means.emission : means.direct;
}

/// By BSDF sampling alone, written out here: an answer that shares nothing with next-event estimation.
Moments glossy_plate_by_bsdf(float roughness) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.glossy(roughness));
  const Tracer tracer(scene);
  const PathContext& context = tracer.context();
  const Ray ray{kGlossyEye, normalize(kGlossyView)};
  const SurfacePoint point = make_surface_point(context.scene, ray, *context.accel.intersect(ray, kVisibleToCamera));
  const Bsdf bsdf = evaluate_material(context.scene, point, {});
  Moments moments;
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 60000; ++i) {
    const float u = rng.next_float();
    const std::optional<BsdfSample> sample = sample_bsdf(bsdf, u, rng.next_vec2());
    const float t = sample && sample->wi.z > 0.0f ? (kLampCenter.z - point.position.z) / sample->wi.z : INFINITY;
    const Vec3 at = sample ? point.position + sample->wi * t - kLampCenter : Vec3{INFINITY, 0, 0};
    const bool hits = std::abs(at.x) < 0.5f * kLampSize && std::abs(at.y) < 0.5f * kLampSize;
    moments.add(hits ? sample->total_weight().g * kLampRadiance : 0.0f);
  }
  return moments;
}

TEST(PathTracer, LightAndBsdfSamplingAndBothAgree) {
  const double rate = shared_rate(4);
  for (const float roughness : {0.15f, 0.4f}) {
    const Moments both = glossy_plate(roughness, true), light = glossy_plate(roughness, false);
    const Moments bsdf = glossy_plate_by_bsdf(roughness);
    EXPECT_GT(same_mean_p_value(both, light), rate) << roughness;
    EXPECT_GT(same_mean_p_value(both, bsdf), rate) << roughness;
    EXPECT_LT(both.variance(), light.variance()) << roughness;
    // Planted bug: a tenth of the light counted by both techniques.
    Moments counted_twice;
    for (int i = 0; i < 2; ++i) counted_twice.add(both.mean() + 0.1 * light.mean() + (i ? 1e-6 : -1e-6));
    EXPECT_LT(same_mean_p_value(counted_twice, bsdf), rate) << roughness;
  }
}

TEST(PathTracer, LampsWithoutShadowsShineThroughSurfacesHoweverTheyAreFound) {
  const double rate = shared_rate(4);
  for (const float roughness : {0.15f, 0.4f}) {
    const Moments light = glossy_plate(roughness, false, Cover::OPAQUE), bsdf = glossy_plate_by_bsdf(roughness);
    for (const Cover cover : {Cover::CLEAR, Cover::OPAQUE}) {
      const Moments both = glossy_plate(roughness, true, cover);
      EXPECT_GT(same_mean_p_value(both, bsdf), rate) << roughness;
      EXPECT_LT(both.variance(), 0.7 * light.variance()) << roughness;  // left to light samples alone it was the same
    }
  }
  // No light sample competes with a mirror, which sees what is there.
  EXPECT_GT(glossy_plate(0.0f, true, Cover::CLEAR).mean(), 0.0);
  EXPECT_EQ(glossy_plate(0.0f, true, Cover::OPAQUE).mean(), 0.0);
}

TEST(PathTracer, ImportanceSamplingOfTheSkyChangesNoMean) {
  const auto floor_under_sky = [](bool importance_sampling) {
    PathScene scene;
    scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
    ProgramBuilder p;  // brighter towards +x
    const Operand x = p.add(Op::SEPARATE_X, {p.add(Op::GENERATED, {}, {0})});
    const Operand strength = p.add(Op::MATH, {x, p.constant(0.0f), p.constant(0.0f)}, {12, 0});
    p.add(Op::CLOSURE_EMISSION, {p.constant(1), p.constant(1), strength});
    Environment sky;
    sky.material = scene.builder.add_material(p.program);
    sky.importance_width = 64;
    sky.use_importance_sampling = importance_sampling;
    scene.builder.set_environment(sky);
    return Tracer(scene).trace(kEye, kDown, 20000).direct;
  };
  const Moments with = floor_under_sky(true), without = floor_under_sky(false);
  const double expected = 0.6 * 2.0 / 3.0 / M_PI;  // integral of cos(theta) max(x, 0) over the hemisphere is 2/3
  EXPECT_GT(mean_p_value(with, expected), shared_rate(2));
  EXPECT_GT(mean_p_value(without, expected), shared_rate(2));
  EXPECT_LT(mean_p_value(with, 0.95 * expected), shared_rate(2)) << "planted: five percent";
}

/// Emission of 1, and `more` times output `output` of the Light Path node.
int emission_by_path(PathScene& scene, int output, float more) {
  ProgramBuilder p;
  const Operand is_so = p.add(Op::LIGHT_PATH, {}, {output});
  const Operand strength = p.add(Op::MATH, {is_so, p.constant(more), p.constant(1.0f)}, {4, 0});
  p.add(Op::CLOSURE_EMISSION, {p.constant(1), p.constant(1), strength});
  return scene.builder.add_material(p.program);
}

/// Light that depends on the ray which finds it is the same for both techniques: what reaches the floor has left the
/// camera, was scattered once, and is diffuse.
TEST(PathTracer, LightsSeeTheSameRayFromBothTechniques) {
  constexpr int kIsCamera = 0, kIsDiffuse = 2, kDepth = 8, kDiffuseDepth = 9;
  const double rate = shared_rate(8);
  for (const auto& [output, of_panel] :
       {std::pair{kIsCamera, 1.0}, {kIsDiffuse, 4.0}, {kDepth, 4.0}, {kDiffuseDepth, 4.0}}) {
    PathScene sky;
    sky.floor(0.0f, 10.0f, sky.diffuse(0.6f));
    Environment environment;
    environment.material = emission_by_path(sky, output, 3.0f);
    sky.builder.set_environment(environment);
    const double of_sky = output == kDepth ? 7.0 : of_panel;  // a bounce further, as in Cycles
    EXPECT_GT(mean_p_value(Tracer(sky).trace(kEye, kDown, 10000).direct, 0.6 * of_sky), rate) << output;

    PathScene panel;  // so large that the floor sees nothing else
    panel.floor(0.0f, 10.0f, panel.diffuse(0.6f));
    panel.quad({0, 0, 2}, {0, 4000, 0}, {4000, 0, 0}, emission_by_path(panel, output, 3.0f));
    EXPECT_GT(mean_p_value(Tracer(panel).trace(kEye, kDown, 10000).direct, 0.6 * of_panel), rate) << output;
  }
}

TEST(PathTracer, SheetsSeeTheSameDepthFromBothTechniques) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
  ProgramBuilder p;
  const Operand depth = p.add(Op::LIGHT_PATH, {}, {8});
  p.add(Op::CLOSURE_TRANSPARENT, {p.add(Op::MATH, {depth, p.constant(0.5f), p.constant(0.0f)}, {2, 0}), p.constant(1)});
  scene.floor(2.0f, 4000.0f, scene.builder.add_material(p.program));
  scene.environment({1, 1, 1});
  EXPECT_GT(mean_p_value(Tracer(scene).trace(kEye, kDown, 10000).direct, 0.6 * 0.5), kFalseAlarmRate);
}

/// A closed white-painted room whose walls glow: every ray sees 1 / (1 - albedo).
TEST(PathTracer, RussianRouletteChangesNoMean) {
  PathScene scene;
  ProgramBuilder p;
  const Operand normal = p.add(Op::NORMAL, {});
  p.add(Op::CLOSURE_DIFFUSE, {p.constant(1), p.constant(0.5f), p.constant(0), normal});
  p.add(Op::CLOSURE_EMISSION, {p.constant(1), p.constant(1), p.constant(1)});
  const int walls = scene.builder.add_material(p.program);
  for (const float side : {-1.0f, 1.0f}) {
    scene.quad({side, 0, 0}, {0, 2, 0}, {0, 0, 2}, walls);
    scene.quad({0, side, 0}, {2, 0, 0}, {0, 0, 2}, walls);
    scene.quad({0, 0, side}, {2, 0, 0}, {0, 2, 0}, walls);
  }
  PathLimits limits;
  limits.max_bounces = limits.max_diffuse_bounces = 1000;
  for (const int min_bounces : {0, 6}) {
    limits.min_bounces = min_bounces;
    const PathMeans means = Tracer(scene, limits).trace({0.1f, 0.2f, 0.3f}, {1, 0.3f, 0.2f}, 20000);
    EXPECT_NEAR(means.emission.mean(), 1.0, 1e-5);
    EXPECT_GT(mean_p_value(means.direct, 0.5), shared_rate(4)) << min_bounces;
    EXPECT_GT(mean_p_value(means.indirect, 0.5), shared_rate(4)) << min_bounces;
    EXPECT_LT(mean_p_value(means.indirect, 0.4), shared_rate(4)) << "planted: a fifth of the bounces lost";
  }
}

TEST(PathTracer, RussianRouletteOfWallsWithoutLightChangesNoMean) {
  const auto indirect = [](int min_bounces, int max_bounces) {
    PathScene scene;
    const int wall = scene.diffuse(0.5f);
    for (const float side : {-1.0f, 1.0f}) {
      scene.quad({side, 0, 0}, {0, 2, 0}, {0, 0, 2}, wall);
      scene.quad({0, side, 0}, {2, 0, 0}, {0, 0, 2}, wall);
      scene.quad({0, 0, side}, {2, 0, 0}, {0, 2, 0}, side > 0.0f ? scene.emission({1, 1, 1}) : wall);
    }
    PathLimits limits;
    limits.min_bounces = min_bounces;
    limits.max_bounces = limits.max_diffuse_bounces = max_bounces;
    return Tracer(scene, limits).trace({0.1f, 0.2f, 0.3f}, {1, 0.3f, 0.2f}, 40000).indirect;
  };
  const Moments all = indirect(30, 30);
  EXPECT_GT(same_mean_p_value(indirect(0, 30), all), shared_rate(4));
  EXPECT_LT(same_mean_p_value(indirect(0, 2), all), shared_rate(4)) << "planted: later bounces lost";
}

TEST(PathTracer, RussianRouletteSparesWhatEmitsAndNoMore) {
  // By two mirrors that keep half of the light, to the end of a floor that shines or not; then to the sky, if it is a
  // mirror, too.
  const auto seen_there = [](float radiance, float reflectance) {
    PathScene scene;
    ProgramBuilder p;
    const Operand normal = p.add(Op::NORMAL, {}), zero = p.constant(0), one = p.constant(1);
    p.add(Op::CLOSURE_EMISSION, {one, one, p.constant(radiance)});
    p.add(Op::CLOSURE_GLOSSY, {p.constant(reflectance), one, zero, zero, zero, normal, normal}, {0});
    const int mirror = scene.mixed(0.5f, 0.0f, 1.0f);
    scene.quad({-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, mirror);
    scene.quad({0, 0, 1}, {1, 0, 0}, {0, 1, 0}, mirror);
    scene.quad({1, 0, 0}, {1, 0, 0}, {0, 1, 0}, scene.builder.add_material(p.program));
    scene.environment({1, 1, 1});
    PathLimits limits;
    limits.min_bounces = 1;
    return Tracer(scene, limits).trace({-1.5f, 0, 0.5f}, {1, 0, -1}, 100);
  };
  const Moments emission = seen_there(4.0f, 0.0f).emission;
  EXPECT_NEAR(emission.mean(), 1.0, 1e-5);
  EXPECT_NEAR(emission.variance(), 0.0, 1e-9);
  for (const float radiance : {0.0f, 4.0f}) EXPECT_GT(seen_there(radiance, 0.5f).environment.variance(), 1e-4);
}

// --- limits ---------------------------------------------------------------------------------------------------------

TEST(PathTracer, NoBouncesMeansDirectLightOnly) {
  PathScene scene = lit_by_its_ceiling();
  scene.point_lamp({0, 0, 1.5f}, 1.0f);
  PathLimits limits;
  const double direct = Tracer(scene, limits).trace(kEye, kDown, 4000).direct.mean();
  limits.max_bounces = 0;
  const PathMeans none = Tracer(scene, limits).trace(kEye, kDown, 4000);
  EXPECT_NEAR(none.direct.mean(), direct, 0.01 * direct);
  EXPECT_EQ(none.indirect.mean(), 0.0);
  limits.max_bounces = 12, limits.max_diffuse_bounces = 0;
  EXPECT_EQ(Tracer(scene, limits).trace(kEye, kDown, 500).indirect.mean(), 0.0);
  limits.max_diffuse_bounces = 1;
  EXPECT_GT(Tracer(scene, limits).trace(kEye, kDown, 500).indirect.mean(), 0.0);
}

TEST(PathTracer, LimitsOfAKindLeaveTheOthersAlone) {
  PathScene scene;  // a mirror floor that shows a lit ceiling
  scene.floor(0.0f, 10.0f, scene.glossy(0.0f));
  scene.quad({3, 0, 2}, {0, 10, 0}, {10, 0, 0}, scene.diffuse(0.5f));
  scene.builder.add_light(scene.area_lamp({3, 0, 1}, 0.5f, 1.0f, 7.0f));
  PathLimits limits;
  limits.max_glossy_bounces = 0;
  EXPECT_EQ(Tracer(scene, limits).trace(kEye, kTilted, 100).direct.mean(), 0.0);
  limits = {};
  limits.max_diffuse_bounces = limits.max_transmission_bounces = 0;
  EXPECT_GT(Tracer(scene, limits).trace(kEye, kTilted, 100).direct.mean(), 0.0);
}

TEST(PathTracer, CameraRaysPassAsManyLayersAsAllowed) {
  const auto seen = [](int layers, int limit) {
    PathScene scene;
    scene.floor(0.0f, 10.0f, scene.emission({1, 1, 1}));
    for (int i = 0; i < layers; ++i)
      scene.floor(0.2f + 0.1f * static_cast<float>(i), 4.0f, scene.transparent({1, 0.5f, 1}));
    PathLimits limits;
    limits.max_transparent_bounces = limit;
    return Tracer(scene, limits).trace(kEye, kDown, 400, 3).emission.mean();
  };
  EXPECT_NEAR(seen(3, 3), 0.125, 0.02);
  EXPECT_EQ(seen(3, 2), 0.0);
}

TEST(PathTracer, ClampsBoundTheMeanOfAContribution) {
  PathScene scene = lit_by_its_ceiling();
  scene.point_lamp({0, 0, 1.5f}, 100.0f);
  PathLimits limits;
  limits.clamp_direct = 0.5f, limits.clamp_indirect = 0.01f;
  const PathMeans means = Tracer(scene, limits).trace(kEye, kDown, 200);
  EXPECT_GT(means.direct.mean(), 0.1);
  EXPECT_LE(means.direct.mean(), 1.0);  // the lamp and one scattered ray at most
  EXPECT_LE(means.indirect.mean(), 0.01 * 24);
}

TEST(PathTracer, ClampsBoundWhatIsLessThanNothingToo) {
  EXPECT_EQ(clamp_contribution({-3, -6, -9}, 2.0f), Rgb(-1, -2, -3));
  EXPECT_EQ(clamp_contribution({3, 6, 9}, 2.0f), Rgb(1, 2, 3));
  EXPECT_EQ(clamp_contribution({-1, 0, 1}, 2.0f), Rgb(-1, 0, 1));
  EXPECT_EQ(clamp_contribution({-3, -6, -9}, 0.0f), Rgb(-3, -6, -9));
}

}  // namespace
}  // namespace cistern::test
