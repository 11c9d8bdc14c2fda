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
