#include "render/learned_light_stage.h"

#include <gtest/gtest.h>

namespace cistern::test {
namespace {

const NestedCells kCells({}, Bounds3{{-4, -4, 0}, {4, 4, 4}}, {0, 0, 2}, 1e-3f, 0.0f);

Settings settings() {
  Settings s;
  s.region = {0, 0, 1024, 512};
  s.direct = DirectAnswer::LEARNED;
  return s;
}

LightSet two_lamps() {
  auto scene = std::make_shared<Scene>();
  for (const float x : {-1.0f, 1.0f}) {
    Light lamp;
    lamp.shape = PointLight{{x, 0, 1}, 0.5f, Rgb(1.0f), false};
    scene->lights.push_back(lamp);
  }
  return LightSet(scene, LightSampling::POWER);
}

/// How many of 10000 pixels leave records.
int training_pixels(const LearnedLightStage& stage, uint32_t frame) {
  int count = 0;
  for (uint32_t pixel = 0; pixel < 10000; ++pixel) count += stage.trains(pixel, frame);
  return count;
}

/// As many paths teach from one update to the next however many frames earlier renders took. (By the numbers of frames
/// it was a 512th of them.)
TEST(LearnedLightStage, LearnsAsMuchWhereNumbersOfFramesGoOnFromEarlierRenders) {
  const LightSet lights = two_lamps();
  for (const uint32_t before : {0u, 520u}) {
    LearnedLightStage stage(settings(), lights, kCells);
    EXPECT_EQ(training_pixels(stage, before), 10000);
    stage.finish_frames(1);
    EXPECT_EQ(training_pixels(stage, before + 1), 10000);
    stage.finish_frames(2);
    EXPECT_NEAR(training_pixels(stage, before + 3), 5000, 250);  // 5 standard deviations
    stage.finish_frames(4);
    EXPECT_NEAR(training_pixels(stage, before + 4), 2500, 217);
  }
}

}  // namespace
}  // namespace cistern::test
