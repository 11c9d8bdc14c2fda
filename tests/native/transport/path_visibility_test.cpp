#include <gtest/gtest.h>

#include "accel/offset_origin.h"
#include "transport/path_scenes.h"
#include "transport/path_tracer.h"

namespace cistern::test {
namespace {

constexpr Vec3 kEye{0.0f, 0.0f, 1.0f}, kDown{0.0f, 0.0f, -1.0f};
constexpr Vec3 kTilted{1.0f, 0.0f, -1.0f};  // towards (1, 0, 0) on the floor

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
    const Ray view{position + 0.25f * up, -up};
    const std::optional<Hit> hit = tracer.context().accel.intersect(view, kVisibleToCamera);
    SurfacePoint receiver = make_surface_point(*tracer.scene(), view, *hit);
    receiver.position = position;  // not rounded once more
    lost.now += is_black(transmittance(tracer.context(), receiver, *light, {}));
    // Planted bug: the receiver's end is moved off its surface, and the ray not aimed anew.
    lost.unjoined += tracer.context().accel.occluded(
        {offset_origin(position, receiver.clearance, up, light->wi), light->wi, 0.0f, 0.9999f * light->distance});
  }
  return lost;
}

TEST(PathTracer, GrazingEmittersDoNotOccludeThemselves) {
  for (const Vec3 at : {Vec3{}, Vec3{50, 70, 0}, Vec3{1000, -3000, 20}}) EXPECT_EQ(grazing_losses(at).now, 0);
  EXPECT_GT(grazing_losses({1000, -3000, 20}).unjoined, 0);
}

/// Of light samples of a small tilted emitter that receivers see from afar at a grazing angle, those that end in it;
/// and the same where rays stop as far off it as its own coordinates ask for, and the length of the ray does not count.
struct FarLosses {
  int now = 0, planted = 0;
};

FarLosses far_losses(float distance) {
  const Vec3 n = normalize(Vec3{0.5f, -0.3f, 0.7f}), u = normalize(cross(n, {0, 0, 1})), v = cross(n, u);
  PathScene scene;
  scene.quad({0, 0, 1.5f}, u, v, scene.emission({1, 1, 1}));
  const Tracer tracer(scene);
  Rng rng(4, 0, 0, 0);
  FarLosses lost;
  for (int i = 0; i < 4000; ++i) {
    const float phi = 2.0f * kPi * rng.next_float(), cosine = 0.004f + 0.04f * rng.next_float();
    SurfacePoint receiver;
    receiver.position = distance * normalize(cosine * n + std::cos(phi) * u + std::sin(phi) * v);
    receiver.ng = receiver.ns = -normalize(receiver.position);
    receiver.clearance = 1e-4f;
    const auto choice =
        tracer.context().lights.choose(receiver.position, receiver.ng, rng.next_float(), rng.next_vec2());
    const auto light = tracer.context().lights.evaluate(choice->sample, receiver.position, {});
    if (!light) continue;
    lost.now += is_black(transmittance(tracer.context(), receiver, *light, {}));
    const Vec3 end =
        offset_origin(receiver.position + light->distance * light->wi, light->clearance, light->normal, -light->wi);
    const Vec3 way = end - receiver.position;
    lost.planted +=
        tracer.context().accel.occluded({receiver.position, normalize(way), 0.0f, (1.0f - 1e-6f) * length(way)});
  }
  return lost;
}

TEST(PathTracer, EmittersFarAwayDoNotOccludeThemselves) {
  for (const float distance : {3.0f, 30.0f, 300.0f, 3000.0f}) EXPECT_EQ(far_losses(distance).now, 0) << distance;
  EXPECT_GT(far_losses(300.0f).planted, 100);
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

TEST(PathTracer, WhatIsTransparentOfHoldoutsShowsWhatLiesBehind) {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.emission({1, 1, 1}));
  Instance panel = scene.quad({0, 0, 0.5f}, {10, 0, 0}, {0, 10, 0}, scene.transparent({1.0f, 0.5f, 0.0f}, 0.5f, 0.5f));
  panel.is_holdout = true;
  scene.replace_last(panel);
  const PathRecord record = Tracer(scene).trace(kEye, kDown).last;
  EXPECT_FLOAT_EQ(record.alpha, 0.25f);
  EXPECT_FLOAT_EQ(record.emission.r, 0.5f);
  EXPECT_FLOAT_EQ(record.emission.g, 0.25f);
  EXPECT_EQ(record.emission.b, 0.0f);
  EXPECT_TRUE(is_black(record.direct)) << "the panel itself";
}

TEST(PathTracer, WhatIsSeenOnShadowCatchersIsToldFromTheRest) {
  PathScene scene;
  Instance floor = scene.floor(0.0f, 10.0f, scene.emission({1, 1, 1}));
  floor.is_shadow_catcher = true;
  scene.replace_last(floor);
  const PathRecord plain = Tracer(scene).trace(kEye, kDown).last;
  EXPECT_EQ(plain.caught, 1.0f);
  EXPECT_TRUE(is_black(plain.light_before_catcher));

  scene.quad({0, 0, 0.5f}, {10, 0, 0}, {0, 10, 0}, scene.transparent({1.0f, 0.5f, 0.0f}));
  const PathRecord tinted = Tracer(scene).trace(kEye, kDown).last;
  EXPECT_FLOAT_EQ(tinted.caught, 0.5f);

  scene.quad({0, 0, 0.7f}, {10, 0, 0}, {0, 10, 0}, scene.emission({3, 3, 3}));
  EXPECT_EQ(Tracer(scene).trace(kEye, kDown).last.caught, 0.0f);
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
