#include "render/sharing_trial.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace cistern {
namespace {

constexpr int kWidth = 204, kHeight = 133;  // boxes at the far edges are cut

Settings for_a_denoiser(int samples) {
  Settings s;
  s.region = {0, 0, kWidth, kHeight};
  s.samples = samples;
  s.path_sharing.visible.groups.size = 1;
  s.path_sharing.on_trial = true;
  return s;
}

/// What is decided when pixels of frames that share have `shared` times the noise of the others.
bool decision(float shared, float fireflies = 0.0f, const Settings& settings = for_a_denoiser(100)) {
  SharingTrial trial(settings);
  for (uint32_t frame = 0; trial.is_running(frame); ++frame) {
    Rng rng(5, 0, frame, 0);
    const float noise = trial.shares(frame) ? shared : 1.0f;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        trial.add(x, y, 1.0f + noise * (rng.next_float() - 0.5f) + (rng.next_float() < fireflies ? 1e4f : 0.0f));
    trial.finish_frame(frame);
  }
  return trial.shares(16);
}

TEST(SharingTrial, FramesTakeTurns) {
  SharingTrial trial(for_a_denoiser(100));
  EXPECT_TRUE(trial.shares(0));
  EXPECT_FALSE(trial.shares(1));
  EXPECT_TRUE(trial.shares(6));
  EXPECT_FALSE(trial.shares(7));
}

TEST(SharingTrial, SharesWhereNoiseFallsByMoreThanTheCost) {
  EXPECT_TRUE(decision(0.8f));    // two thirds of the variance for a quarter more time
  EXPECT_FALSE(decision(0.95f));  // hardly less
  EXPECT_FALSE(decision(1.0f));
  EXPECT_TRUE(decision(0.5f, 1e-5f)) << "a firefly must not decide";
}

TEST(SharingTrial, VisiblePointsThatShareMustBringMore) {
  Settings plain = for_a_denoiser(100);
  plain.path_sharing.visible.groups.size = 16;
  EXPECT_TRUE(decision(0.5f, 0.0f, plain));
  EXPECT_FALSE(decision(0.8f, 0.0f, plain));
}

TEST(SharingTrial, IsLeftOutWhereNobodyAsksForItAndOfShortPictures) {
  Settings plain = for_a_denoiser(100);
  plain.path_sharing.on_trial = false;
  for (const SharingTrial& trial : {SharingTrial(plain), SharingTrial(for_a_denoiser(16))}) {
    EXPECT_FALSE(trial.is_running(0));
    EXPECT_TRUE(trial.shares(1));
  }
}

}  // namespace
}  // namespace cistern
