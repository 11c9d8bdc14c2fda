#include "render/sharing_trial.h"

#include <gtest/gtest.h>

#include "render/render_cache.h"
#include "render/render_scenes.h"

namespace cistern::test {
namespace {

Settings on_trial(int samples = 128) {
  Settings s = small_settings(96, 96, samples);
  s.region = {0, 0, 96, 96};
  s.indirect = IndirectAnswer::CELL_SHARED;
  s.path_sharing.temporal_reuse = false;
  s.path_sharing.on_trial = true;
  return s;
}

Settings for_a_denoiser(Settings s) {
  s.path_sharing.for_denoiser = true;
  return s;
}

void look_along_y(PathScene& scene) {
  Camera camera;
  camera.camera_to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {0, -3, 1.5f}};
  camera.left = camera.bottom = -0.6f, camera.right = camera.top = 0.6f;
  scene.builder.set_camera(camera, "camera");
}

/// A floor and a lamp: no light bounces.
std::shared_ptr<const Scene> open_floor() {
  PathScene scene;
  scene.floor(0.0f, 20.0f, scene.diffuse(0.6f));
  scene.point_lamp({1, 1, 2}, 5.0f, 0.5f);
  look_along_y(scene);
  return scene.builder.snapshot();
}

/// Without its wall towards the camera.
void add_room(PathScene& scene) {
  const int paint = scene.diffuse(0.7f);
  scene.floor(0.0f, 6.0f, paint);
  scene.quad({0, 3, 1.5f}, {6, 0, 0}, {0, 0, 3}, paint);
  scene.quad({-3, 0, 1.5f}, {0, 6, 0}, {0, 0, 3}, paint);
  scene.quad({3, 0, 1.5f}, {0, 0, 3}, {0, 6, 0}, paint);
  scene.quad({0, 0, 3}, {0, 6, 0}, {6, 0, 0}, paint);
}

std::shared_ptr<const Scene> lit_from_the_middle() {
  PathScene scene;
  add_room(scene);
  scene.point_lamp({0, 0, 1.5f}, 5.0f, 0.2f);
  look_along_y(scene);
  return scene.builder.snapshot();
}

/// A room whose lamp shines into a niche: what light there is elsewhere few paths find.
std::shared_ptr<const Scene> lit_by_a_niche() {
  PathScene scene;
  add_room(scene);
  scene.quad({2.6f, 0, 2.2f}, {0, 0.5f, 0}, {0.5f, 0, 0}, scene.diffuse(0.7f));
  scene.point_lamp({2.8f, 0, 2.4f}, 5.0f);
  look_along_y(scene);
  return scene.builder.snapshot();
}

/// A floor and a wall on it under `count` equal lamps without size, all in one place or far from each other: then half
/// of them are behind the wall, which the choice of lights does not know.
std::shared_ptr<const Scene> floor_under_lamps(int count, bool are_together) {
  PathScene scene;
  scene.floor(0.0f, 20.0f, scene.diffuse(0.6f));
  scene.quad({0.1f, 1, 1}, {0, 10, 0}, {0, 0, 2}, scene.diffuse(0.0f));
  for (int i = 0; i < count; ++i) {
    const float angle = 2.0f * kPi * static_cast<float>(i) / static_cast<float>(count);
    const float distance = are_together ? 0.0f : 2.0f;
    scene.point_lamp({distance * std::cos(angle), 1.0f + distance * std::sin(angle), 0.8f}, 5.0f, 0.0f);
  }
  look_along_y(scene);
  return scene.builder.snapshot();
}

Settings decided(const std::shared_ptr<const Scene>& scene, const Settings& settings) {
  RenderCache cache;
  const std::atomic<bool> cancelled{false};
  SharingTrial trial(settings, scene, cache.accel(scene, false),
                     cache.lights(scene, LightSampling::TREE, EnvironmentDensity::COMPENSATED), nullptr);
  return trial.decide({cancelled, std::chrono::steady_clock::time_point::max()});
}

TEST(SharingTrial, SharesWhereLightIsRare) {
  EXPECT_EQ(decided(lit_by_a_niche(), on_trial()), on_trial());
  Settings widely = on_trial();
  widely.path_sharing.visible.pixels *= 4.0f;
  EXPECT_EQ(decided(lit_by_a_niche(), for_a_denoiser(on_trial())), widely) << "a denoiser does not want small groups";
}

/// A lamp in the middle lights all of a room, so that noise is even.
TEST(SharingTrial, ForADenoiserVisiblePointsDoNotShareWhereLightIsNotRare) {
  const std::shared_ptr<const Scene> room = lit_from_the_middle();
  EXPECT_EQ(decided(room, on_trial()), on_trial());
  Settings next_alone = for_a_denoiser(on_trial());
  next_alone.path_sharing.visible.groups.size = 1;
  EXPECT_EQ(decided(room, for_a_denoiser(on_trial())), next_alone);
}

TEST(SharingTrial, DoesNotShareWhereThereIsNothingToShare) {
  for (const Settings& asked : {on_trial(), for_a_denoiser(on_trial())}) {
    Settings plain = asked;
    plain.indirect = IndirectAnswer::PATH;
    EXPECT_EQ(decided(open_floor(), asked), plain);
  }
}

TEST(SharingTrial, AsksSeveralLightsWhereTheyDiffer) {
  Settings asked = on_trial();
  asked.light_samples = 2;
  Settings plain = asked;
  plain.indirect = IndirectAnswer::PATH;
  EXPECT_EQ(decided(floor_under_lamps(8, false), asked), plain);
  plain.light_samples = 1;
  EXPECT_EQ(decided(floor_under_lamps(8, true), asked), plain);
}

TEST(SharingTrial, StoppedItDecidesNothing) {
  const std::shared_ptr<const Scene> scene = small_room();
  RenderCache cache;
  const std::atomic<bool> cancelled{true};
  SharingTrial trial(on_trial(), scene, cache.accel(scene, false),
                     cache.lights(scene, LightSampling::TREE, EnvironmentDensity::COMPENSATED), nullptr);
  EXPECT_EQ(trial.decide({cancelled, std::chrono::steady_clock::time_point::max()}), on_trial());
}

TEST(SharingTrial, IsLeftOutWhereNobodyAsksForItAndOfSmallPictures) {
  EXPECT_TRUE(SharingTrial::is_for(on_trial()));
  EXPECT_TRUE(SharingTrial::is_for(for_a_denoiser(on_trial())));
  EXPECT_TRUE(SharingTrial::is_for(on_trial(40))) << "an eighth of the time";
  EXPECT_FALSE(SharingTrial::is_for(on_trial(32))) << "a sixth of the time";
  Settings s = on_trial();
  s.path_sharing.on_trial = false;
  EXPECT_FALSE(SharingTrial::is_for(s));
  s = on_trial();
  s.path_sharing.visible.groups.size = s.path_sharing.deep.groups.size = 1;
  EXPECT_FALSE(SharingTrial::is_for(s)) << "nothing to decide";
  s = on_trial();
  s.path_sharing.temporal_reuse = true;
  EXPECT_FALSE(SharingTrial::is_for(s));
  s = on_trial();
  s.indirect = IndirectAnswer::PATH;
  EXPECT_FALSE(SharingTrial::is_for(s));
}

TEST(SharingTrial, WorksInPicturesOfAnyShape) {
  for (const auto [width, height] : {std::pair{8192, 3}, std::pair{5, 5000}, std::pair{33, 97}}) {
    Settings s = on_trial(256);
    s.width = width, s.height = height;
    s.region = {0, 0, width, height};
    ASSERT_TRUE(SharingTrial::is_for(s)) << width;
    decided(small_room(), s);
  }
}

TEST(PixelBlocks, PlacesAreWithinTheirBlocks) {
  const PixelBlocks blocks{4, 2, 2, {{10, 20}, {30, 20}, {10, 40}, {30, 40}}};
  EXPECT_EQ(blocks.width(), 8);
  EXPECT_EQ(blocks.height(), 4);
  EXPECT_EQ(blocks.size(), 32u);
  EXPECT_EQ(blocks.place(3, 1).x, 13);
  EXPECT_EQ(blocks.place(4, 1).x, 30);
  EXPECT_EQ(blocks.place(4, 2).y, 40);
  EXPECT_EQ(PixelBlocks::band(7, 5, 9).place(6, 3).y, 8);
}

}  // namespace
}  // namespace cistern::test
