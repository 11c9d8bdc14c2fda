#include "scene/shadow_catchers.h"

#include <gtest/gtest.h>

#include "lights/emissive_triangles.h"
#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

/// A floor that catches shadows, or not; a lamp that shines down; a panel between the two, which shines as well.
struct CatcherScene : PathScene {
  explicit CatcherScene(bool catches) {
    Instance plane = floor(0.0f, 10.0f, diffuse(0.8f));
    plane.is_shadow_catcher = catches;
    replace_last(plane);
    quad({0, 0, 1}, {1, 0, 0}, {0, 1, 0}, emission({3, 3, 3}));
    point_lamp({0, 0, 4}, 1.0f, 0.5f);
  }
};

TEST(ShadowCatchers, AreFound) {
  EXPECT_TRUE(has_shadow_catchers(*CatcherScene(true).builder.snapshot()));
  EXPECT_FALSE(has_shadow_catchers(*CatcherScene(false).builder.snapshot()));
}

TEST(ShadowCatchers, AloneHaveAllLightButThatOfSurfaces) {
  const CatcherScene scene(true);
  const auto whole = scene.builder.snapshot();
  const Scene alone = shadow_catchers_alone(*whole);
  EXPECT_EQ(alone.instances[0], whole->instances[0]);
  EXPECT_TRUE(alone.instances[1].is_holdout);
  EXPECT_EQ(alone.instances[1].visibility, kVisibleToCamera);
  EXPECT_EQ(alone.lights.size(), 1u);
  EXPECT_GT(EmissiveTriangles(*whole).size(), 0u);
  EXPECT_EQ(EmissiveTriangles(alone).size(), 0u);
}

TEST(ShadowCatchers, ABackdropHasNoLampsAndNoSurfacesButHoldouts) {
  CatcherScene scene(true);
  Instance hole = scene.quad({0, 0, 2}, {1, 0, 0}, {0, 1, 0}, scene.diffuse(0.5f));
  hole.is_holdout = true;
  scene.replace_last(hole);
  const Scene empty = backdrop(*scene.builder.snapshot());
  for (const Instance& instance : empty.instances) EXPECT_EQ(instance.mesh >= 0, instance.is_holdout);
  for (const Light& light : empty.lights) EXPECT_TRUE(light.removed);
}

}  // namespace
}  // namespace cistern::test
