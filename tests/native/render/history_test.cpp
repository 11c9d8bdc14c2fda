#include <gtest/gtest.h>

#include "base/rng.h"
#include "render/render_scenes.h"
#include "render/reuse_frame.h"

namespace cistern::test {
namespace {

// Frames after an edit, with what they are told of it: the planted bugs are lies.

const std::atomic<bool> kNotCancelled{false};
const StopCondition kNeverStop{kNotCancelled, std::chrono::steady_clock::time_point::max()};

std::shared_ptr<const RenderWorld> world_of(const Settings& settings, const std::shared_ptr<const Scene>& scene) {
  return std::make_shared<const RenderWorld>(settings, scene, Accel::build(scene),
                                             std::make_shared<const LightSet>(scene, settings.light_sampling), nullptr);
}

Film film_of(const Settings& s) { return Film(s.region.width, s.region.height, s.passes); }

struct Edit {
  std::shared_ptr<const Scene> before, after;
  SceneChange truth() const { return compare_scenes(*before, *after); }
};

/// What a comparison would say that overlooks all else.
SceneChange nothing_but_the_camera(const Edit& edit) {
  SceneChange change;
  change.camera = true;
  change.earlier_camera = edit.before->camera;
  return change;
}

/// The first frame after the edit, Combined (4 numbers a pixel), with the history of `frames_before` frames.
std::vector<float> frame_after(Settings settings, const Edit& edit, const SceneChange& change, int frames_before = 4) {
  check_settings(settings);
  Film before = film_of(settings), after = film_of(settings);
  ReuseFrame earlier(world_of(settings, edit.before), nullptr, {});
  for (int i = 0; i < frames_before; ++i) EXPECT_TRUE(earlier.render(before, kNeverStop));
  ReuseFrame frame(world_of(settings, edit.after), nullptr, {});
  frame.take_over(std::move(earlier), change);
  EXPECT_TRUE(frame.render(after, kNeverStop));
  EXPECT_EQ(frame.non_finite_weights(), 0u);
  return after.resolve(Pass::COMBINED);
}

float largest(const std::vector<float>& picture) {
  float most = 0.0f;
  for (size_t i = 0; i < picture.size(); ++i)
    if (i % 4 != 3) most = std::max(most, picture[i]);
  return most;
}

/// Of the colours.
double mean(const std::vector<float>& picture) {
  double sum = 0.0;
  for (size_t i = 0; i < picture.size(); ++i) sum += i % 4 != 3 ? picture[i] : 0.0f;
  return sum / (0.75 * static_cast<double>(picture.size()));
}

void expect_groups_add_up(const Film& film, int groups) {
  const std::vector<float> combined = film.resolve(Pass::COMBINED);
  std::vector<float> sum(combined.size() / 4 * 3);
  for (int group = 0; group < groups; ++group) {
    const std::vector<float> light = film.resolve_light_group(group);
    EXPECT_GT(*std::ranges::max_element(light), 0.0f);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += light[i];
  }
  for (size_t i = 0; i < sum.size(); ++i) {
    const float all = combined[i / 3 * 4 + i % 3];
    ASSERT_NEAR(sum[i], all, 1e-5f * all + 1e-6f);
  }
}

Camera looking_down(Vec3 eye) {
  Camera camera;
  camera.camera_to_world.translation = eye;  // along -z
  camera.left = camera.bottom = -0.5f, camera.right = camera.top = 0.5f;
  return camera;
}

/// A lamp above a floor and beside a wall is taken away: nothing is lit any more.
Edit lamp_goes() {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.8f));
  scene.quad({0, 1, 1}, {2, 0, 0}, {0, 0, 2}, scene.diffuse(0.8f));
  scene.point_lamp({0.3f, 0.2f, 0.8f}, 3.0f);
  scene.builder.set_camera(looking_down({0, 0, 3}), "camera");
  Edit edit{scene.builder.snapshot(), nullptr};
  scene.builder.remove_light(0);
  edit.after = scene.builder.snapshot();
  return edit;
}

Settings reuse_settings(int width = 24, int height = 24) {
  Settings settings = small_settings(width, height, 1);
  settings.keep_history = true;
  settings.direct_reuse.spatial_reuse = false;
  settings.limits.max_bounces = 2;
  return settings;
}

TEST(History, NoGhostStaysOfALampThatIsGone) {
  const Edit edit = lamp_goes();
  for (const IndirectAnswer answer : {IndirectAnswer::SCREEN_REUSE, IndirectAnswer::WORLD_REUSE}) {
    for (const Bias bias : {Bias::UNBIASED, Bias::FAST}) {
      Settings settings = reuse_settings();
      settings.direct = DirectAnswer::RESTIR;
      settings.secondary = SecondaryAnswer::CELL_RESERVOIRS;
      settings.indirect = answer;
      settings.direct_reuse.bias = bias;
      EXPECT_EQ(largest(frame_after(settings, edit, edit.truth())), 0.0f);
    }
    Settings settings = reuse_settings();
    settings.indirect = answer;
    EXPECT_GT(largest(frame_after(settings, edit, nothing_but_the_camera(edit))), 0.1f)
        << "planted bug: nobody tells the paths";
  }
}

/// A spot light that lit the left of a floor lights the right.
Edit spot_turns() {
  PathScene scene;
  scene.floor(0.0f, 8.0f, scene.diffuse(0.8f));
  scene.builder.set_camera(looking_down({0, 0, 3}), "camera");
  const auto spot_at = [](float x) {
    Light light;
    light.name = "spot";
    SpotLight spot;
    spot.emitter = {{x, 0, 2}, 0.0f, Rgb(4.0f), false};
    spot.world_to_local.translation = {-x, 0, -2};
    spot.cos_half_angle = std::cos(0.25f);
    light.shape = spot;
    return light;
  };
  scene.builder.add_light(spot_at(-0.7f));
  Edit edit{scene.builder.snapshot(), nullptr};
  scene.builder.add_light(spot_at(0.7f), 0);
  edit.after = scene.builder.snapshot();
  return edit;
}

TEST(History, WhatALampCouldNotReachThenIsNotHeldAgainstItNow) {
  const Edit edit = spot_turns();
  Settings settings = reuse_settings();
  settings.direct = DirectAnswer::RESTIR;
  const double cold = mean(frame_after(settings, {edit.after, edit.after}, SceneChange{}, 0));
  EXPECT_GT(cold, 0.002);
  EXPECT_NEAR(mean(frame_after(settings, edit, edit.truth())), cold, 0.05 * cold)
      << "one lamp: the filter is all noise";
  settings.direct_reuse.bias = Bias::FAST;
  EXPECT_NEAR(mean(frame_after(settings, edit, edit.truth())), cold, 0.05 * cold);
  settings.direct_reuse.bias = Bias::UNBIASED;
  EXPECT_LT(mean(frame_after(settings, edit, nothing_but_the_camera(edit))), 0.5 * cold)
      << "planted bug: targets of the past with the lamp of today: nulls count for it";
}

/// A floor with many small lamps close to it; the camera is pushed aside.
Edit camera_moves() {
  PathScene scene;
  scene.floor(0.0f, 8.0f, scene.diffuse(0.8f));
  Rng rng(5, 0, 0, 0);
  for (int i = 0; i < 80; ++i)
    scene.point_lamp({4.0f * rng.next_float() - 2.0f, 4.0f * rng.next_float() - 2.0f, 0.2f}, rng.next_float());
  scene.builder.set_camera(looking_down({0, 0, 3}), "camera");
  Edit edit{scene.builder.snapshot(), nullptr};
  scene.builder.set_camera(looking_down({0.9f, 0.6f, 3.2f}), "camera");
  edit.after = scene.builder.snapshot();
  return edit;
}

double squared_error(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += (double{a[i]} - b[i]) * (double{a[i]} - b[i]);
  return sum / static_cast<double>(a.size());
}

TEST(History, PointsAreFoundWhereTheCameraSawThem) {
  const Edit edit = camera_moves();
  Settings settings = reuse_settings();
  settings.direct = DirectAnswer::RESTIR;
  settings.direct_reuse.light_candidates = 1;
  settings.light_sampling = LightSampling::POWER;

  Settings exact = settings;
  exact.samples = 1024, exact.direct = DirectAnswer::NEE;
  check_settings(exact);
  Film reference = film_of(exact);
  ASSERT_TRUE(render_frames(world_of(exact, edit.after)->context, 0, 1024, reference, kNeverStop));
  const std::vector<float> truth = reference.resolve(Pass::COMBINED);

  SceneChange lie = edit.truth();
  lie.earlier_camera = edit.after->camera;  // planted bug: the present camera in place of the previous one
  Moments gain_over_lie, gain_over_nothing;
  for (settings.seed = 1; settings.seed <= 24; ++settings.seed) {
    const double error = squared_error(frame_after(settings, edit, edit.truth(), 8), truth);
    gain_over_lie.add(squared_error(frame_after(settings, edit, lie, 8), truth) - error);
    gain_over_nothing.add(squared_error(frame_after(settings, edit, edit.truth(), 0), truth) - error);
  }
  EXPECT_GT(gain_over_nothing.mean(), 0.0);
  EXPECT_LT(mean_p_value(gain_over_nothing, 0.0), kFalseAlarmRate);
  EXPECT_GT(gain_over_lie.mean(), 0.0);
  EXPECT_LT(mean_p_value(gain_over_lie, 0.0), kFalseAlarmRate);
}

TEST(History, AStoppedFrameLosesNothing) {
  const Edit edit = camera_moves();
  Settings settings = reuse_settings();
  settings.direct = DirectAnswer::RESTIR;
  settings.indirect = IndirectAnswer::SCREEN_REUSE;
  settings.secondary = SecondaryAnswer::CELL_RESERVOIRS;
  check_settings(settings);
  const std::vector<float> expected = frame_after(settings, edit, edit.truth());

  Film film = film_of(settings), after = film_of(settings);
  ReuseFrame first(world_of(settings, edit.before), nullptr, {});
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(first.render(film, kNeverStop));
  ReuseFrame stopped(world_of(settings, edit.before), nullptr, {});
  stopped.take_over(std::move(first), compare_scenes(*edit.before, *edit.before));
  const std::atomic<bool> cancelled{true};
  EXPECT_FALSE(stopped.render(film, {cancelled, std::chrono::steady_clock::time_point::max()}));
  EXPECT_EQ(stopped.history_world()->scene, edit.before);
  ReuseFrame last(world_of(settings, edit.after), nullptr, {});
  last.take_over(std::move(stopped), edit.truth());
  ASSERT_TRUE(last.render(after, kNeverStop));
  EXPECT_EQ(after.resolve(Pass::COMBINED), expected);
  EXPECT_EQ(last.history_world()->scene, edit.after);
}

TEST(SharesHistory, AsksForEqualSettingsButForTheSizeOfThePicture) {
  Settings a = reuse_settings(), b = reuse_settings(100, 50);
  b.samples = 99, b.threads = 3, b.time_limit = 1.0, b.noise_threshold = 0.1, b.display_exposure = 2.0,
  b.film_exposure = 3.0f, b.adaptive_sampling = true, b.passes = {Pass::DEPTH}, b.region = {1, 2, 3, 4};
  EXPECT_TRUE(shares_history(a, b));
  b.limits.max_bounces = 5;
  EXPECT_FALSE(shares_history(a, b));
  b = a, b.direct_reuse.confidence_cap = 3.0f;
  EXPECT_FALSE(shares_history(a, b));
  b = a, b.seed = 7;
  EXPECT_FALSE(shares_history(a, b));
}

/// Also of paths that an earlier render left, and of those borrowed from a finer picture.
TEST(History, LightGroupsOfWhatWasFoundBeforeAddUp) {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.8f));
  scene.quad({0, 1, 1}, {2, 0, 0}, {0, 0, 2}, scene.diffuse(0.8f));
  for (int i = 0; i < 3; ++i) {
    Light lamp = scene.area_lamp({0.6f * static_cast<float>(i) - 0.6f, 0.1f, 0.8f}, 0.3f, -1.0f, 3.0f);
    lamp.light_group = static_cast<LightGroup>(i);
    scene.builder.add_light(lamp);
  }
  scene.builder.set_camera(looking_down({0, 0, 3}), "camera");
  const std::shared_ptr<const Scene> snapshot = scene.builder.snapshot();
  for (const IndirectAnswer answer :
       {IndirectAnswer::SCREEN_REUSE, IndirectAnswer::WORLD_REUSE, IndirectAnswer::CELL_SHARED}) {
    for (const bool borrows : {false, true}) {
      if (borrows && answer != IndirectAnswer::CELL_SHARED) continue;
      Settings finer = reuse_settings(), settings = reuse_settings(borrows ? 12 : 24, borrows ? 12 : 24);
      finer.indirect = settings.indirect = answer;
      finer.light_groups = settings.light_groups = 3;
      settings.is_draft = borrows;
      check_settings(finer);
      check_settings(settings);
      const auto new_film = [](const Settings& s) { return Film(s.region.width, s.region.height, {}, 3); };
      SCOPED_TRACE(testing::Message() << "answer " << static_cast<int>(answer) << " borrows " << borrows);
      Film before = new_film(finer), film = new_film(settings), again = new_film(finer);
      auto earlier = std::make_unique<ReuseFrame>(world_of(finer, snapshot), nullptr, std::function<void(float)>());
      for (int i = 0; i < 3; ++i) EXPECT_TRUE(earlier->render(before, kNeverStop));
      ReuseFrame frame(world_of(settings, snapshot), nullptr, {});
      if (borrows)
        frame.borrow(std::move(earlier), compare_scenes(*snapshot, *snapshot));
      else
        frame.take_over(std::move(*earlier), compare_scenes(*snapshot, *snapshot));
      expect_groups_add_up(before, 3);
      for (int i = 0; i < 2; ++i) EXPECT_TRUE(frame.render(film, kNeverStop));
      expect_groups_add_up(film, 3);
      if (!borrows) continue;
      EXPECT_TRUE(frame.give_back()->render(again, kNeverStop));
      expect_groups_add_up(again, 3);
    }
  }
}

}  // namespace
}  // namespace cistern::test
