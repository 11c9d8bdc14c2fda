#include "transport/path_tracer.h"

#include <gtest/gtest.h>

#include "accel/offset_origin.h"
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

// --- shadows --------------------------------------------------------------------------------------------------------

/// Direct light on a floor under `layers` sheets, as a fraction of that without them.
Rgb light_through(const std::vector<Vec3>& layers, int max_transparent_bounces = 8) {
  const auto lit = [&](const std::vector<Vec3>& sheets) {
    PathScene scene;
    scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
    scene.point_lamp({0, 0, 5}, 10.0f);
    float z = 2.0f;  // above the eye
    for (const Vec3 tint : sheets) scene.floor(z += 0.25f, 4.0f, scene.transparent(tint));
    PathLimits limits;
    limits.max_transparent_bounces = max_transparent_bounces;
    return Tracer(scene, limits).trace(kEye, kDown).last.direct;
  };
  return lit(layers) / lit({});
}

TEST(PathTracer, TheFirstSurfaceIsOneThatHidesMostOfWhatIsBehind) {
  const auto depth_below = [](float transparency) {
    PathScene scene;
    scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
    scene.floor(0.5f, 10.0f, scene.transparent({1, 1, 1}, transparency, 0.6f));
    Camera camera;
    camera.camera_to_world.translation = kEye;
    scene.builder.set_camera(camera, "camera");
    const Tracer tracer(scene);
    float deepest = 0.0f;
    for (uint64_t seed = 0; seed < 32; ++seed) {
      const PathRecord record = tracer.trace(kEye, kDown, 1, seed).last;
      if (record.hit) deepest = std::max(deepest, record.depth);
    }
    return deepest;
  };
  EXPECT_NEAR(depth_below(0.4f), 0.5f, 1e-5f);
  EXPECT_NEAR(depth_below(0.6f), 1.0f, 1e-5f);
}

TEST(PathTracer, ShadowsAreTintedByEveryLayer) {
  const Rgb one = light_through({{0.5f, 0.25f, 1.0f}});
  EXPECT_NEAR(one.r, 0.5f, 1e-5f);
  EXPECT_NEAR(one.g, 0.25f, 1e-5f);
  EXPECT_NEAR(one.b, 1.0f, 1e-5f);
  const Rgb two = light_through({{0.5f, 0.25f, 1.0f}, {0.5f, 0.5f, 0.125f}});
  EXPECT_NEAR(two.r, 0.25f, 1e-5f);
  EXPECT_NEAR(two.g, 0.125f, 1e-5f);
  EXPECT_NEAR(two.b, 0.125f, 1e-5f);
  EXPECT_TRUE(is_black(light_through({{0.5f, 0.5f, 0.5f}, {0, 0, 0}})));
}

TEST(PathTracer, ShadowRaysPassAsManyLayersAsAllowed) {
  const std::vector<Vec3> three(3, Vec3{1, 1, 1});
  EXPECT_NEAR(light_through(three, 3).g, 1.0f, 1e-5f);
  EXPECT_TRUE(is_black(light_through(three, 2)));
}

TEST(PathTracer, OpaqueThingsCastShadowsUnlessToldNotTo) {
  const auto lit = [](uint8_t visibility, bool casts_shadow) {
    PathScene scene;
    scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
    scene.floor(2.0f, 4.0f, scene.diffuse(0.6f), visibility);
    Light lamp;
    lamp.name = "lamp";
    lamp.shape = PointLight{{0, 0, 5}, 0.0f, Rgb(10.0f), false};
    lamp.casts_shadow = casts_shadow;
    scene.builder.add_light(lamp);
    return Tracer(scene).trace(kEye, kDown).direct.mean();
  };
  EXPECT_EQ(lit(kVisibleToAll, true), 0.0);
  EXPECT_GT(lit(kVisibleToAll, false), 0.0);
  EXPECT_GT(lit(kVisibleToAll & ~kVisibleToShadow, true), 0.0);
}

/// Of many samples of an emissive quad that a floor almost touches, those that do not get through. Most arrive at
/// grazing angles, where an emitter could be taken to stand in its own light; far from the origin rounding is coarse.
struct GrazingLosses {
  int now = 0, unjoined = 0;
};

GrazingLosses grazing_losses(Vec3 at) {
  PathScene scene;
  scene.quad(at, {8000, 0, 0}, {0, 8000, 0}, scene.diffuse(0.5f));
  scene.quad(at + Vec3{0, 0, 0.5f}, {0, 100, 0}, {100, 0, 0}, scene.emission({1, 1, 1}));
  const Tracer tracer(scene);
  const Vec3 up{0, 0, 1};
  Rng rng(3, 0, 0, 0);
  GrazingLosses lost;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 position = at + Vec3{rng.next_float(), rng.next_float(), 0.0f};
    const auto choice = tracer.context().lights.choose(position, up, rng.next_float(), rng.next_vec2());
    const auto light = tracer.context().lights.evaluate(choice->sample, position, {});
    if (!light) continue;
    SurfacePoint receiver;
    receiver.position = position;
    receiver.ng = receiver.ns = up;
    lost.now += is_black(transmittance(tracer.context(), receiver, *light, {}));
    // Planted bug: the receiver's end is moved off its surface, and the ray not aimed anew.
    lost.unjoined += tracer.context().accel.occluded(
        {offset_origin(position, up, light->wi), light->wi, 0.0f, 0.9999f * light->distance});
  }
  return lost;
}

TEST(PathTracer, GrazingEmittersDoNotOccludeThemselves) {
  for (const Vec3 at : {Vec3{}, Vec3{50, 70, 0}, Vec3{1000, -3000, 20}}) EXPECT_EQ(grazing_losses(at).now, 0);
  EXPECT_GT(grazing_losses({1000, -3000, 20}).unjoined, 0);
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

// --- alpha and visibility -------------------------------------------------------------------------------------------

TEST(PathTracer, HoldoutsCutHolesIntoAlpha) {
  PathScene scene;
  Instance floor = scene.floor(0.0f, 10.0f, scene.emission({1, 1, 1}));
  floor.is_holdout = true;
  scene.replace_last(floor);
  const PathMeans means = Tracer(scene).trace(kEye, kDown);
  EXPECT_EQ(means.alpha.mean(), 0.0);
  EXPECT_EQ(means.emission.mean(), 0.0);

  PathScene half;
  half.floor(0.0f, 10.0f, half.holdout(0.25f));
  EXPECT_FLOAT_EQ(Tracer(half).trace(kEye, kDown).last.alpha, 0.75f);
}

TEST(PathTracer, HoldoutsAreSeenInMirrors) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.glossy(0.0f));
  Instance panel = scene.quad({0, 0, 2}, {0, 10, 0}, {10, 0, 0}, scene.emission({3, 3, 3}));
  panel.is_holdout = true;
  scene.replace_last(panel);
  const PathMeans means = Tracer(scene).trace(kEye, kTilted);
  EXPECT_NEAR(means.emission.mean(), 3.0, 1e-4);
  EXPECT_EQ(means.alpha.mean(), 1.0);
}

TEST(PathTracer, SunsAreSeenBeyondWhereTheCameraClips) {
  PathScene scene;
  Light sun;
  sun.name = "sun";
  sun.shape = SunLight{{0, 0, 1}, 0.5f, Rgb(1.0f)};
  scene.builder.add_light(sun);
  scene.point_lamp({0, 0, 4}, 1.0f, 0.5f);
  const Tracer tracer(scene);
  const auto seen = [&](float t_max) {
    PathSampler sampler(1, 0, 0, SampleSequence::RANDOM);
    PathScratch scratch;
    const Ray ray{{}, {0, 0, 1}, 0.0f, t_max};
    return trace_path(tracer.context(), ray, sampler, scratch).emission.g;
  };
  const float of_sun = 1.0f / (kPi * sqr(std::sin(0.25f))), of_lamp = 1.0f / (kPi * sqr(0.5f));
  EXPECT_NEAR(seen(3.0f), of_sun, 1e-4f * of_sun) << "the lamp is clipped";
  EXPECT_NEAR(seen(100.0f), of_sun + of_lamp, 1e-4f * of_sun);
}

TEST(PathTracer, OnlyClearGlassShowsTheTransparentFilm) {
  const auto behind = [](float roughness) {
    PathScene scene;
    ProgramBuilder p;
    const Operand normal = p.add(Op::NORMAL, {});
    p.add(Op::CLOSURE_REFRACTION, {p.constant(1), p.constant(1), p.constant(roughness), p.constant(1.2f), normal});
    scene.floor(0.0f, 10.0f, scene.builder.add_material(p.program));
    scene.environment({2, 2, 2});
    PathLimits limits;
    limits.film_transparent = limits.film_transparent_glass = true;
    return Tracer(scene, limits).trace(kEye, kDown, 4000);
  };
  EXPECT_LT(behind(0.0f).alpha.mean(), 1e-6);
  EXPECT_LT(behind(0.05f).alpha.mean(), 0.01);
  for (const float roughness : {0.15f, 0.5f}) {
    const PathMeans means = behind(roughness);
    EXPECT_EQ(means.alpha.mean(), 1.0) << roughness;
    EXPECT_NEAR(means.direct.mean() + means.environment.mean(), 2.0, 0.03) << roughness;
  }
}

TEST(PathTracer, FilmCanBeTransparentWhereNothingIs) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.glossy(0.0f));
  scene.floor(0.5f, 0.5f, scene.transparent({1, 1, 1}, 0.75f, 0.5f));
  scene.environment({2, 2, 2});
  PathLimits limits;
  limits.film_transparent = true;
  const Tracer tracer(scene, limits);
  const PathMeans sky = tracer.trace(kEye, {0, 0, 1});
  EXPECT_EQ(sky.alpha.mean(), 0.0);
  EXPECT_EQ(sky.environment.mean(), 0.0);
  const PathMeans mirror = tracer.trace(kEye, kTilted);
  EXPECT_EQ(mirror.alpha.mean(), 1.0);
  EXPECT_NEAR(mirror.environment.mean(), 2.0, 1e-4) << "the mirror still shows it";
  const PathMeans below = tracer.trace({0, 0, -2}, {0, 0, -1});
  EXPECT_EQ(below.alpha.mean(), 0.0);
}

TEST(PathTracer, AlphaOfThinPaintIsItsCover) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.transparent({1, 1, 1}, 0.75f, 0.5f));
  scene.environment({2, 2, 2});
  PathLimits limits;
  limits.film_transparent = true;
  const PathMeans means = Tracer(scene, limits).trace(kEye, kDown, 4000);
  EXPECT_GT(mean_p_value(means.alpha, 0.25), shared_rate(2));
  EXPECT_GT(mean_p_value(means.direct, 0.25 * 0.5 * 2.0), shared_rate(2)) << "premultiplied";
}

TEST(PathTracer, ObjectsCanBeHiddenFromAKindOfRay) {
  const auto trace = [](uint8_t visibility, Vec3 direction) {
    PathScene scene;
    scene.floor(0.0f, 10.0f, scene.glossy(0.0f));
    scene.quad({0, 0, 2}, {0, 10, 0}, {10, 0, 0}, scene.emission({1, 1, 1}), visibility);
    return Tracer(scene).trace(kEye, direction).emission.mean();
  };
  const Vec3 up{0, 0, 1};
  EXPECT_EQ(trace(kVisibleToCamera, up), 1.0);
  EXPECT_EQ(trace(kVisibleToCamera, kTilted), 0.0);
  EXPECT_NEAR(trace(kVisibleToGlossy, kTilted), 1.0, 1e-5);
  EXPECT_EQ(trace(kVisibleToGlossy, up), 0.0);
}

TEST(PathTracer, NothingIsBlackWithoutDepth) {
  const PathMeans means = Tracer(PathScene()).trace(kEye, kDown);
  EXPECT_FALSE(means.last.hit);
  EXPECT_GE(means.last.depth, 1e10f);
  EXPECT_EQ(means.direct.mean() + means.indirect.mean() + means.emission.mean() + means.environment.mean(), 0.0);
}

}  // namespace
}  // namespace cistern::test
