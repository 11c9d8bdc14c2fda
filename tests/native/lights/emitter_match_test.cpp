#include "lights/emitter_match.h"

#include <gtest/gtest.h>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

struct Lit {
  std::shared_ptr<const Scene> scene;
  LightSet lights;
  explicit Lit(std::shared_ptr<const Scene> of) : scene(std::move(of)), lights(scene, LightSampling::POWER) {}
};

EmitterMatch match(const Lit& earlier, const Lit& later) {
  return {earlier.lights, later.lights, compare_scenes(*earlier.scene, *later.scene)};
}

/// Later emitter of each earlier one, -1 for none.
std::vector<int> later_of(const Lit& earlier, const Lit& later) {
  const EmitterMatch emitters = match(earlier, later);
  std::vector<int> result;
  for (uint32_t e = 0; e < earlier.lights.emitter_count(); ++e) {
    const auto there = emitters.to_later({e, {0.25f, 0.75f}});
    result.push_back(there ? static_cast<int>(there->emitter) : -1);
    if (!there) continue;
    EXPECT_EQ(there->uv.x, 0.25f);
    EXPECT_EQ(there->uv.y, 0.75f);
    const auto back = emitters.to_earlier(*there);
    EXPECT_TRUE(back && back->emitter == e);
  }
  return result;
}

struct Stage {
  PathScene scene;
  Light first = scene.point_lamp({0, 0, 1}, 1.0f), second = scene.point_lamp({1, 0, 1}, 2.0f);
  Instance tile = scene.quad({0, 0, 2}, {1, 0, 0}, {0, 1, 0}, scene.emission({1, 1, 1}));
  Stage() { scene.environment({1, 2, 3}); }
  Lit lit() const { return Lit(scene.builder.snapshot()); }
};

TEST(EmitterMatch, EverythingIsItselfInAnEqualScene) {
  const Stage stage;
  EXPECT_EQ(later_of(stage.lit(), stage.lit()), (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(EmitterMatch, LampsThatMovedOrGotBrighterStayThemselves) {
  Stage stage;
  const Lit before = stage.lit();
  Light changed = stage.first;
  changed.shape = PointLight{{3, 3, 3}, 0.5f, Rgb(7.0f), true};
  stage.scene.builder.add_light(changed, 0);
  EXPECT_EQ(later_of(before, stage.lit()), (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(EmitterMatch, WhatWasRemovedOrIsDarkIsNone) {
  Stage stage;
  const Lit before = stage.lit();
  stage.scene.builder.remove_light(0);
  EXPECT_EQ(later_of(before, stage.lit()), (std::vector<int>{-1, 0, 1, 2, 3}));
  EXPECT_EQ(later_of(stage.lit(), before), (std::vector<int>{1, 2, 3, 4}));
  Light dark = stage.second;
  dark.shape = PointLight{};
  stage.scene.builder.add_light(dark, 1);
  EXPECT_EQ(later_of(before, stage.lit()), (std::vector<int>{-1, -1, 0, 1, 2}));
}

TEST(EmitterMatch, TrianglesGoWithTheirInstance) {
  Stage stage;
  const Lit before = stage.lit();
  Instance moved = stage.tile;
  moved.object_to_world.translation.x = 5.0f;
  stage.scene.replace_last(moved);
  EXPECT_EQ(later_of(before, stage.lit()), (std::vector<int>{0, 1, 2, 3, 4}));
  moved.key = 3;
  stage.scene.replace_last(moved);
  EXPECT_EQ(later_of(before, stage.lit()), (std::vector<int>{0, 1, -1, -1, 4})) << "what has a key was not there";
}

TEST(EmitterMatch, WhatAnotherOneStoodForIsNew) {
  Stage stage;
  const auto copy = stage.scene.builder.add_instance(stage.tile);
  const Lit together = stage.lit();
  Instance moved = stage.tile;
  moved.object_to_world.translation.x = 5.0f;
  stage.scene.builder.add_instance(moved, copy);
  const Lit apart = stage.lit();
  EXPECT_EQ(later_of(together, apart), (std::vector<int>{0, 1, 2, 3, -1, -1, 6}));
  EXPECT_EQ(later_of(apart, together), (std::vector<int>{0, 1, 2, 3, 4, 5, 6}));
}

TEST(EmitterMatch, AnEnvironmentThatChangedIsAnother) {
  Stage stage;
  const Lit before = stage.lit();
  stage.scene.environment({1, 2, 4});
  EXPECT_EQ(later_of(before, stage.lit()), (std::vector<int>{0, 1, 2, 3, -1}));
}

TEST(HasSameEmitters, UnlessSomethingThatEmitsHasChanged) {
  Stage stage;
  const Instance floor = stage.scene.floor(0.0f, 1.0f, stage.scene.diffuse(0.5f));
  const auto before = stage.scene.builder.snapshot();
  const auto is_same = [&] {
    const auto now = stage.scene.builder.snapshot();
    return has_same_emitters(*before, *now, compare_scenes(*before, *now));
  };
  EXPECT_TRUE(is_same());
  Instance moved = floor;
  moved.object_to_world.translation.x = 5.0f;
  stage.scene.replace_last(moved);
  EXPECT_TRUE(is_same()) << "the floor is dark";
  moved.material_set = stage.tile.material_set;
  stage.scene.replace_last(moved);
  EXPECT_FALSE(is_same()) << "now it glows";
  stage.scene.replace_last(floor);
  Instance tile = stage.tile;
  tile.object_to_world.translation.x = 5.0f;
  stage.scene.builder.add_instance(tile, 0);
  EXPECT_FALSE(is_same());
  stage.scene.builder.add_instance(stage.tile, 0);
  EXPECT_TRUE(is_same());
  stage.scene.builder.add_instance(floor);
  EXPECT_FALSE(is_same()) << "another instance";
}

}  // namespace
}  // namespace cistern::test
