#include "render/banded_frame.h"

#include <gtest/gtest.h>

#include "render/render_cache.h"
#include "render/render_scenes.h"
#include "render/render_world.h"

namespace cistern::test {
namespace {

constexpr int kWidth = 44, kHeight = 24;  // the last runs of rows are short
constexpr uint32_t kPixels = kWidth * kHeight;

Settings shared_settings() {
  Settings settings = small_settings(kWidth, kHeight);
  settings.indirect = IndirectAnswer::CELL_SHARED;
  settings.path_sharing.temporal_reuse = false;
  check_settings(settings);
  return settings;
}

class BandedFrameTest : public testing::Test {
 protected:
  const std::shared_ptr<const Scene> scene_ = small_room();
  RenderCache cache_;
  const RenderWorld world_{shared_settings(), scene_, cache_.accel(scene_, false),
                           cache_.lights(scene_, LightSampling::TREE, EnvironmentDensity::COMPENSATED), nullptr};
  const std::atomic<bool> cancelled_{false};
  const StopCondition stop_{cancelled_, std::chrono::steady_clock::time_point::max()};
  BandedFrame frame_{world_.context, world_.settings};
  Film film_{kWidth, kHeight, {Pass::SAMPLE_COUNT}};
};

/// Ends of rows and beginnings of the next, and one pixel.
bool is_left(uint32_t pixel) {
  const uint32_t x = pixel % kWidth, y = pixel / kWidth;
  return ((x < 4 || x >= 40) && y < 8) || (x == 21 && y == 11);
}

TEST_F(BandedFrameTest, FinishedPixelsTakeNoPart) {
  ASSERT_TRUE(frame_.render(0, film_, stop_));
  EXPECT_EQ(film_.resolve(Pass::SAMPLE_COUNT), std::vector<float>(kPixels, 1.0f));
  const std::vector<float> before = film_.resolve(Pass::COMBINED);
  for (uint32_t pixel = 0; pixel < kPixels; ++pixel)
    if (!is_left(pixel)) film_.finish(pixel);
  SharedPixels whole(world_.context);
  ASSERT_TRUE(whole.render(PixelBlocks::band(kWidth, 0, kHeight), 1, stop_, &film_));
  BandedFrame later(world_.context, world_.settings);
  ASSERT_TRUE(later.render(1, film_, stop_));
  EXPECT_LT(later.memory_bytes(), frame_.memory_bytes() / 3) << "the others are not even looked at";
  const std::vector<float> picture = film_.resolve(Pass::COMBINED), counts = film_.resolve(Pass::SAMPLE_COUNT);
  for (uint32_t pixel = 0; pixel < kPixels; ++pixel) {
    ASSERT_EQ(counts[pixel], is_left(pixel) ? 2.0f : 1.0f) << pixel;
    const float red = before[4 * size_t{pixel}];
    const float expected = is_left(pixel) ? 0.5f * (red + whole.record(pixel).combined().r) : red;
    ASSERT_EQ(picture[4 * size_t{pixel}], expected) << pixel;
  }
}

TEST_F(BandedFrameTest, NothingIsMadeOfAFinishedPicture) {
  for (uint32_t pixel = 0; pixel < kPixels; ++pixel) film_.finish(pixel);
  EXPECT_TRUE(frame_.render(0, film_, stop_));
  EXPECT_EQ(film_.resolve(Pass::SAMPLE_COUNT), std::vector<float>(kPixels, 0.0f));
  EXPECT_EQ(frame_.memory_bytes(), 0u);
}

}  // namespace
}  // namespace cistern::test
