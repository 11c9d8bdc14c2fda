#include "render/frame.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "render/render_scenes.h"
#include "transport/camera_ray.h"

namespace cistern::test {
namespace {

const std::vector<Pass> kPasses{Pass::DIRECT,      Pass::INDIRECT, Pass::EMISSION,
                                Pass::ENVIRONMENT, Pass::DEPTH,    Pass::DENOISING_ALBEDO};

struct Picture {
  Film film;
  bool is_finished;
};

Picture render(Settings settings, int threads, uint32_t first_frame = 0, uint32_t frames = 3,
               std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max(),
               bool is_cancelled = false) {
  settings.passes = kPasses;
  check_settings(settings);
  const std::shared_ptr<const Scene> scene = small_room();
  const std::shared_ptr<const Accel> accel = Accel::build(scene);
  const LightSet lights(scene, settings.light_sampling);
  const PathContext paths{*scene, *accel, lights, settings.limits,
                          pixel_footprint(scene->camera, settings.width, settings.height)};
  const PixelFilter filter(settings.pixel_filter, settings.filter_width);
  FrameSequences sequences(settings);
  const std::atomic<bool> cancelled{is_cancelled};
  Picture picture{Film(settings.region.width, settings.region.height, kPasses), false};
  // More threads than processors, where there are few.
  const tbb::global_control workers(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads) + 1);
  tbb::task_arena arena(threads);
  arena.execute([&] {
    picture.is_finished =
        render_frames({settings, paths, filter, sequences}, first_frame, frames, picture.film, {cancelled, deadline});
  });
  return picture;
}

TEST(RenderFrames, PicturesAreTheSameBitsForAnyNumberOfThreads) {
  for (const SampleSequence sequence : {SampleSequence::SOBOL, SampleSequence::RANDOM}) {
    Settings settings = small_settings();
    settings.sequence = sequence;
    const Picture one = render(settings, 1);
    EXPECT_TRUE(one.is_finished);
    for (const int threads : {2, 7}) {
      const Picture several = render(settings, threads);
      for (const Pass pass : kPasses) EXPECT_EQ(one.film.resolve(pass), several.film.resolve(pass));
    }
    settings.seed = 1;  // were the pictures blind to their random numbers, equality would prove nothing
    EXPECT_NE(one.film.resolve(Pass::COMBINED), render(settings, 1).film.resolve(Pass::COMBINED));
  }
}

TEST(RenderFrames, ARegionIsACutOutOfTheFullFrame) {
  Settings settings = small_settings();
  const std::vector<float> full = render(settings, 2).film.resolve(Pass::COMBINED);
  for (const Region region : {Region{5, 9, 11, 7}, Region{39, 23, 1, 1}}) {
    settings.region = region;
    const std::vector<float> part = render(settings, 2).film.resolve(Pass::COMBINED);
    ASSERT_EQ(part.size(), static_cast<size_t>(region.width * region.height * 4));
    const auto channels = static_cast<size_t>(4 * region.width);
    for (int y = 0; y < region.height; ++y) {
      const float* row = &full[static_cast<size_t>(((region.y + y) * settings.width + region.x) * 4)];
      EXPECT_TRUE(std::equal(row, row + channels, &part[static_cast<size_t>(y) * channels])) << y;
    }
  }
}

TEST(RenderFrames, PassesAddUpToCombined) {
  const Film film = render(small_settings(), 2).film;
  const std::vector<float> combined = film.resolve(Pass::COMBINED);
  std::vector<float> parts[4];
  for (size_t i = 0; i < 4; ++i) parts[i] = film.resolve(kPasses[i]);
  double brightness = 0.0;
  for (size_t pixel = 0; pixel < combined.size() / 4; ++pixel) {
    for (size_t c = 0; c < 3; ++c) {
      const size_t k = 3 * pixel + c;
      const float sum = parts[0][k] + parts[1][k] + parts[2][k] + parts[3][k];
      EXPECT_NEAR(combined[4 * pixel + c], sum, 1e-5f * (1.0f + sum));
      brightness += sum;
    }
  }
  EXPECT_GT(brightness, 1.0);
}

TEST(RenderFrames, BatchesOfFramesAreTheSameFrames) {
  const std::vector<float> together = render(small_settings(), 2, 0, 2).film.resolve(Pass::COMBINED);
  const std::vector<float> first = render(small_settings(), 2, 0, 1).film.resolve(Pass::COMBINED);
  const std::vector<float> second = render(small_settings(), 2, 1, 1).film.resolve(Pass::COMBINED);
  EXPECT_NE(first, second);
  for (size_t i = 0; i < together.size(); ++i) EXPECT_FLOAT_EQ(together[i], 0.5f * (first[i] + second[i]));
}

TEST(RenderFrames, StopsWhenCancelledOrLate) {
  EXPECT_FALSE(render(small_settings(), 2, 0, 3, std::chrono::steady_clock::time_point::max(), true).is_finished);
  EXPECT_FALSE(render(small_settings(), 2, 0, 3, std::chrono::steady_clock::now()).is_finished);
}

}  // namespace
}  // namespace cistern::test
