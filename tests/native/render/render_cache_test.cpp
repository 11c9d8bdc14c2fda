#include "render/render_cache.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr uint32_t kPoints = 100;

TEST(RenderCache, KeepsCellsWhileSurfacesStay) {
  PathScene scene;
  const Instance floor = scene.floor(0.0f, 1.0f, scene.diffuse(0.5f));
  RenderCache cache;
  EXPECT_EQ(cache.memory_bytes(), 0u);
  const auto first = cache.light_cache_cells(*scene.builder.snapshot(), kPoints, 1, {});
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(cache.memory_bytes(), first->memory_bytes());

  scene.point_lamp({0, 0, 1}, 1.0f);
  EXPECT_EQ(cache.light_cache_cells(*scene.builder.snapshot(), kPoints, 1, {}), first);

  Instance moved = floor;
  moved.object_to_world.translation.x = 0.5f;
  scene.replace_last(moved);
  const auto second = cache.light_cache_cells(*scene.builder.snapshot(), kPoints, 1, {});
  EXPECT_NE(second, first);
  EXPECT_EQ(cache.light_cache_cells(*scene.builder.snapshot(), kPoints, 1, {}), second);
}

/// The map of the sky is shared, so there is nothing to tell it by but that all is as if it had been made anew.
TEST(RenderCache, LightsThatMoveUnderASkyAreThoseOfTheirScene) {
  PathScene scene;
  scene.glowing_environment(0.5f, 3.0f);
  const Instance panel = scene.floor(2.0f, 0.5f, scene.emission({4, 4, 4}));
  RenderCache cache;
  const auto compare = [&] {
    const std::shared_ptr<const Scene> now = scene.builder.snapshot();
    const auto cached = cache.lights(now, LightSampling::TREE, EnvironmentDensity::COMPLETE, {});
    const LightSet fresh(now, LightSampling::TREE);
    Rng rng(4, 0, 0, 0);
    for (int i = 0; i < 200; ++i) {
      const float u = rng.next_float();
      const Vec2 u_emitter = rng.next_vec2();
      const auto a = cached->choose({}, {0, 0, 1}, u, u_emitter), b = fresh.choose({}, {0, 0, 1}, u, u_emitter);
      ASSERT_TRUE(a && b);
      EXPECT_EQ(a->pmf, b->pmf);
      const auto lit = cached->evaluate(a->sample, {}, {}), expected = fresh.evaluate(b->sample, {}, {});
      ASSERT_EQ(lit.has_value(), expected.has_value());
      if (lit) EXPECT_EQ(lit->wi, expected->wi);
      if (lit) EXPECT_EQ(lit->pdf, expected->pdf);
    }
  };
  compare();
  Instance moved = panel;
  moved.object_to_world.translation.x = 3.0f;
  scene.replace_last(moved);
  compare();
  scene.glowing_environment(3.0f, 0.5f);
  compare();
}

TEST(RenderCache, LosesNothingToAStoppedRender) {
  PathScene scene;
  const Instance floor = scene.floor(0.0f, 1.0f, scene.diffuse(0.5f));
  RenderCache cache;
  const auto kept = cache.light_cache_cells(*scene.builder.snapshot(), kPoints, 1, {});
  Instance moved = floor;
  moved.object_to_world.translation.x = 0.5f;
  scene.replace_last(moved);
  EXPECT_EQ(cache.light_cache_cells(*scene.builder.snapshot(), kPoints, 1, {[] { return true; }}), nullptr);
  scene.replace_last(floor);
  EXPECT_EQ(cache.light_cache_cells(*scene.builder.snapshot(), kPoints, 1, {}), kept);
}

TEST(RenderCache, KeepsItsAccelWhereAnotherIsStopped) {
  PathScene scene;
  const Instance floor = scene.floor(0.0f, 1.0f, scene.diffuse(0.5f));
  RenderCache cache;
  ASSERT_NE(cache.accel(scene.builder.snapshot(), true), nullptr);
  const size_t bytes = cache.memory_bytes();
  Instance moved = floor;
  moved.object_to_world.translation.x = 0.5f;
  scene.replace_last(moved);
  EXPECT_EQ(cache.accel(scene.builder.snapshot(), true, [] { return true; }), nullptr);
  EXPECT_EQ(cache.memory_bytes(), bytes);
}

}  // namespace
}  // namespace cistern::test
