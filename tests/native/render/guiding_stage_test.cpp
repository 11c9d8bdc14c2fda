#include "render/guiding_stage.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace cistern::test {
namespace {

const NestedCells kCells({}, Bounds3{{-4, -4, 0}, {4, 4, 4}}, {0, 0, 2}, 1e-3f, 0.0f);
constexpr int kWidth = 1024, kHeight = 512;
constexpr uint32_t kTrial = 4;  // its first frame, of pictures of that size

Settings settings(Guiding guiding) {
  Settings s;
  s.region = {0, 0, kWidth, kHeight};
  s.samples = 100;
  s.guiding = guiding;
  return s;
}

/// Enough light from above for a table.
std::vector<GuideRecord> light() {
  const NestedCellKey cell = kCells.key({1, 1, 0}, {0, 0, 1});
  return std::vector<GuideRecord>(200, {cell, DirectionHistogram::bin({0, 0, 1}), 1.0f});
}

TEST(GuidingStage, GuidesFromTheFirstTableOn) {
  GuidingStage stage(settings(Guiding::ON), kCells);
  EXPECT_FALSE(stage.use()->is_on);
  EXPECT_TRUE(stage.trains(7, 0));
  stage.add(light());
  stage.finish_frames(1);
  EXPECT_TRUE(stage.use()->is_on);
}

/// How many of 10000 pixels leave records.
int training_pixels(const GuidingStage& stage, uint32_t frame) {
  int count = 0;
  for (uint32_t pixel = 0; pixel < 10000; ++pixel) count += stage.trains(pixel, frame);
  return count;
}

/// As many paths teach from one update to the next however many frames earlier renders took. (By the numbers of frames
/// it was a 512th of them.)
TEST(GuidingStage, LearnsAsMuchWhereNumbersOfFramesGoOnFromEarlierRenders) {
  for (const uint32_t before : {0u, 520u}) {
    GuidingStage stage(settings(Guiding::ON), kCells);
    EXPECT_EQ(training_pixels(stage, before), 10000);
    stage.add(light());
    stage.finish_frames(1);
    EXPECT_EQ(training_pixels(stage, before + 1), 10000);
    stage.finish_frames(2);
    EXPECT_NEAR(training_pixels(stage, before + 3), 5000, 250);  // 5 standard deviations
    stage.finish_frames(4);
    EXPECT_NEAR(training_pixels(stage, before + 4), 2500, 217);
  }
}

/// Random numbers of frames depend on which table they are guided by.
TEST(GuidingStage, TellsSinceWhenFramesAreGuidedAsTheyAre) {
  GuidingStage stage(settings(Guiding::ON), kCells);
  EXPECT_EQ(stage.guided_since(), 0u);
  stage.finish_frames(1);  // nothing learned yet
  EXPECT_EQ(stage.guided_since(), 0u);
  stage.add(light());
  for (const auto& [next, since] : {std::pair{2u, 2u}, {3u, 2u}, {4u, 4u}, {5u, 4u}}) {
    stage.finish_frames(next);
    EXPECT_EQ(stage.guided_since(), since);
    EXPECT_FALSE(stage.is_decided(next));
  }
}

/// Pieces of sequences are as long as that: what is not used of them is missing where pixels are stratified together.
TEST(GuidingStage, TellsHowManyFramesAreAlike) {
  GuidingStage always(settings(Guiding::ON), kCells), on_trial(settings(Guiding::AUTO), kCells);
  EXPECT_EQ(always.frames_of_kind(0, 100), 100u);  // as long as nothing is learned
  EXPECT_EQ(on_trial.frames_of_kind(0, 100), kTrial + FrameTrial::kFrames / 2);
  EXPECT_EQ(on_trial.frames_of_kind(1, 3), 2u);
  for (GuidingStage* stage : {&always, &on_trial}) stage->add(light());
  for (uint32_t next = 1; next <= 32; ++next) {
    for (GuidingStage* stage : {&always, &on_trial}) stage->finish_frames(next);
    if (next < 4) continue;
    const uint32_t to_update = 2 * std::bit_floor(next) - next, trial_end = kTrial + FrameTrial::kFrames;
    EXPECT_EQ(always.frames_of_kind(next, 100), to_update);
    EXPECT_EQ(always.frames_of_kind(next, next + 1), 1u);
    if (next >= trial_end) {
      EXPECT_EQ(on_trial.frames_of_kind(next, 100), on_trial.use()->is_on ? to_update : 100 - next);
    } else {
      const uint32_t end = on_trial.use()->is_on ? std::min(trial_end, next + to_update) : trial_end;
      EXPECT_EQ(on_trial.frames_of_kind(next, 100), (end - next + 1) / 2) << next;
    }
  }
}

/// Frames of AUTO, of which guided ones have `noise` times the noise of the others; returns whether the last is guided.
bool is_guided_at_last(float noise) {
  GuidingStage stage(settings(Guiding::AUTO), kCells);
  stage.add(light());
  for (uint32_t frame = 0; frame < 40; ++frame) {
    EXPECT_EQ(stage.guided_since() > 0, stage.use()->is_on);
    EXPECT_EQ(stage.is_decided(frame), frame >= kTrial + FrameTrial::kFrames);
    Rng rng(5, 0, frame, 0);
    const float spread = stage.use()->is_on ? noise : 1.0f;
    const bool is_trial = frame >= kTrial && frame < kTrial + FrameTrial::kFrames;
    if (frame < kTrial + FrameTrial::kFrames) {
      EXPECT_EQ(stage.use()->is_on, is_trial && frame % 2 == 0);
    }
    EXPECT_EQ(stage.observes(frame), is_trial);
    for (int y = 0; stage.observes(frame) && y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) stage.observe(x, y, 1.0f + spread * (rng.next_float() - 0.5f));
    stage.finish_frames(frame + 1);
  }
  bool trains = false;
  for (uint32_t pixel = 0; pixel < 1000; ++pixel) trains |= stage.trains(pixel, 40);
  EXPECT_EQ(trains, stage.use()->is_on);
  return stage.use()->is_on;
}

TEST(GuidingStage, AutoGuidesWhereNoiseFallsByMoreThanTheCost) {
  EXPECT_TRUE(is_guided_at_last(0.7f));
  EXPECT_FALSE(is_guided_at_last(0.95f));
}

TEST(GuidingStage, BatchesEndWhereFramesDiffer) {
  GuidingStage stage(settings(Guiding::AUTO), kCells);
  EXPECT_EQ(stage.frames_to_update(0), 1u);
  EXPECT_EQ(stage.frames_to_update(2), 2u);
  EXPECT_EQ(stage.frames_to_update(9), 1u);
  EXPECT_EQ(stage.frames_to_update(12), 4u);
  EXPECT_EQ(stage.frames_to_update(33), 31u);
}

}  // namespace
}  // namespace cistern::test
