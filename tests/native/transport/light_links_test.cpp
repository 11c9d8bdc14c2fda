#include <gtest/gtest.h>

#include "transport/path_scenes.h"

// Light and shadow linking of paths: pictures are those of scenes without what a link takes away.

namespace cistern::test {
namespace {

constexpr Vec3 kEye{0.1f, 0.0f, 1.0f}, kDown{-0.1f, 0.0f, -1.0f};
constexpr uint64_t only(int set) { return uint64_t{1} << set; }

enum class Emitter { POINT, BALL, AREA, SUN, MESH };
constexpr Emitter kEmitters[] = {Emitter::POINT, Emitter::BALL, Emitter::AREA, Emitter::SUN, Emitter::MESH};

/// 2 m above the floor.
void add_emitter(PathScene& scene, Emitter kind, const LightLinks& links) {
  if (kind == Emitter::MESH) {
    Instance panel = scene.floor(2.0f, 1.0f, scene.emission({3, 3, 3}));
    panel.links = links;
    return scene.replace_last(panel);
  }
  Light light = scene.area_lamp({0, 0, 2}, 1.0f, -1.0f, 3.0f);
  if (kind == Emitter::POINT) light.shape = PointLight{{0, 0, 2}, 0.0f, Rgb(3.0f), false};
  if (kind == Emitter::BALL) light.shape = PointLight{{0, 0, 2}, 0.4f, Rgb(3.0f), false};
  if (kind == Emitter::SUN) light.shape = SunLight{{0, 0, 1}, 0.5f, Rgb(3.0f)};
  light.links = links;
  scene.builder.add_light(light);
}

void add_linked(PathScene& scene, Instance instance, uint8_t light_set, uint8_t shadow_set) {
  instance.light_set = light_set;
  instance.shadow_set = shadow_set;
  scene.replace_last(instance);
}

struct Floor {
  float roughness = 1.0f;  // diffuse; or glossy, or 0 a mirror
  uint8_t light_set = 0;
};

/// All that a path brings, over many paths along a ray.
Moments total(const PathScene& scene, Vec3 origin, Vec3 direction) {
  constexpr uint32_t kPaths = 4000;
  const Tracer tracer(scene);
  PathScratch scratch;
  Moments sum;
  for (uint32_t i = 0; i < kPaths; ++i) {
    PathSampler sampler(1, 0, i, SampleSequence::RANDOM);
    const PathRecord record = trace_path(tracer.context(), {origin, normalize(direction)}, sampler, scratch);
    sum.add((record.direct + record.indirect + record.emission + record.environment).g);
  }
  return sum;
}

/// A floor below an emitter, with a black board half-way between that is of shadow set 1.
Moments seen(Emitter kind, const LightLinks& links, const Floor& floor, bool has_board) {
  PathScene scene;
  const int surface = floor.roughness == 1.0f ? scene.diffuse(0.6f) : scene.glossy(floor.roughness);
  add_linked(scene, scene.floor(0.0f, 10.0f, surface), floor.light_set, 0);
  if (has_board) add_linked(scene, scene.floor(1.5f, 6.0f, scene.diffuse(0.0f)), 0, 1);
  add_emitter(scene, kind, links);
  return total(scene, kEye, kDown);
}

constexpr float kRoughnesses[] = {1.0f, 0.4f, 0.0f};
constexpr int kCases = 5 * 3;
bool is_nothing_to_see(Emitter kind, float roughness) { return kind == Emitter::POINT && roughness == 0.0f; }

/// False-alarm rate kFalseAlarmRate for all of them together.
TEST(LightLinks, LightPassesWhatDoesNotBlockIt) {
  for (const Emitter kind : kEmitters) {
    for (const float roughness : kRoughnesses) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(kind) << " on roughness " << roughness);
      const Floor floor{roughness};
      const Moments free = seen(kind, {}, floor, false);
      const Moments passed = seen(kind, {kAllSets, ~only(1)}, floor, true);
      EXPECT_GT(same_mean_p_value(passed, free), shared_rate(kCases)) << passed.mean() << " for " << free.mean();
      const Moments blocked = seen(kind, {kAllSets, only(1)}, floor, true);
      EXPECT_EQ(blocked.mean(), 0.0);
      if (is_nothing_to_see(kind, roughness)) continue;
      EXPECT_LT(same_mean_p_value(seen(kind, {}, floor, true), free), shared_rate(kCases)) << "planted: no links";
    }
  }
}

TEST(LightLinks, ReceiversAreLitByThoseThatAreForThem) {
  for (const Emitter kind : kEmitters) {
    for (const float roughness : kRoughnesses) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(kind) << " on roughness " << roughness);
      const Floor floor{roughness, 2};
      const Moments plain = seen(kind, {}, floor, false);
      EXPECT_EQ(seen(kind, {only(2), kAllSets}, floor, false).mean(), plain.mean()) << "the same paths";
      EXPECT_EQ(seen(kind, {~only(2), kAllSets}, floor, false).mean(), 0.0);
      EXPECT_EQ(plain.mean() > 0.0, !is_nothing_to_see(kind, roughness));
    }
  }
}

TEST(LightLinks, CamerasSeeEveryEmitter) {
  for (const Emitter kind : {Emitter::BALL, Emitter::AREA, Emitter::SUN, Emitter::MESH}) {
    const auto looking_up = [&](const LightLinks& links, bool through_glass) {
      PathScene scene;
      if (through_glass) scene.floor(1.5f, 6.0f, scene.transparent({1, 1, 1}));
      add_emitter(scene, kind, links);
      return total(scene, {0, 0, 1}, {0, 0, 1}).mean();
    };
    EXPECT_GT(looking_up({}, false), 0.0);
    for (const bool through_glass : {false, true})
      EXPECT_EQ(looking_up({0, 0}, through_glass), looking_up({}, through_glass));
  }
}

/// Light that a wall sends on is no matter of links.
TEST(LightLinks, BouncedLightReachesWhatItsEmitterDoesNot) {
  const auto floor_under_ceiling = [](uint64_t lit) {
    PathScene scene;
    add_linked(scene, scene.floor(0.0f, 10.0f, scene.diffuse(0.6f)), 2, 0);
    scene.floor(3.0f, 10.0f, scene.diffuse(0.8f));
    Light lamp = scene.point_lamp({0, 0, 2}, 0.0f);
    lamp.shape = PointLight{{0, 0, 2}, 0.1f, Rgb(10.0f), false};
    lamp.links.lit = lit;
    scene.builder.add_light(lamp);
    return Tracer(scene).trace(kEye, kDown, 2000);
  };
  const PathMeans linked = floor_under_ceiling(~only(2)), plain = floor_under_ceiling(kAllSets);
  EXPECT_EQ(linked.direct.mean(), 0.0);
  EXPECT_GT(plain.direct.mean(), 0.0);
  EXPECT_GT(linked.indirect.mean(), 0.0);
  EXPECT_LT(linked.indirect.mean(), plain.indirect.mean()) << "without the floor's own";
}

}  // namespace
}  // namespace cistern::test
