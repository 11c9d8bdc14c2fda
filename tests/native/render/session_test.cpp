#include "render/session.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <numeric>
#include <set>

#include "base/check.h"
#include "render/render_scenes.h"
#include "scene/scene_memory.h"

namespace cistern::test {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

/// Waits, for at most ten seconds, until the first frame can be read.
void wait_for_pixels(Session& session) {
  for (int i = 0; i < 1000 && session.wait(0.01).version == 0; ++i) {
  }
}

TEST(Session, RendersToTheEnd) {
  Session session(small_settings());
  session.start(small_room());
  const Progress progress = session.wait(30.0);
  EXPECT_EQ(progress.status, Status::DONE);
  EXPECT_EQ(progress.frames_done, 3);
  EXPECT_EQ(progress.error, "");
  EXPECT_EQ(progress.non_finite_samples, 0u);
  EXPECT_GT(progress.memory_bytes, memory_bytes(*small_room()));
  EXPECT_EQ(session.read(Pass::COMBINED).size(), 40u * 24u * 4u);
  EXPECT_THROW(session.start(small_room()), Error);
}

TEST(Session, PixelsAreZeroBeforeTheFirstFrame) {
  Session session(small_settings(4, 4, 1));
  EXPECT_EQ(session.read(Pass::COMBINED), std::vector<float>(64, 0.0f));
  EXPECT_EQ(session.wait(0.0).version, 0);
}

// 0.1 s is the goal; the bound leaves room for a busy machine. Waiting for the frame would take seconds.
TEST(Session, CancelsSoonAndKeepsWhatWasRendered) {
  Settings settings = small_settings(4096, 2048, 1 << 20);
  settings.threads = 1;
  Session session(settings);
  session.start(small_room());
  for (int i = 0; i < 1000 && session.wait(0.01).stage != "Rendering"; ++i) {
  }
  session.wait(0.2);
  const Clock::time_point start = Clock::now();
  session.cancel();
  EXPECT_LT(seconds_since(start), 0.5);
  EXPECT_EQ(session.wait(0.0).status, Status::CANCELLED);
  const std::vector<float> pixels = session.read(Pass::COMBINED);
  EXPECT_TRUE(std::any_of(pixels.begin(), pixels.end(), [](float v) { return v > 0.0f; })) << "what was done is kept";
}

/// Waits, for at most ten seconds, until so many frames are done.
Progress wait_for_frames(Session& session, int frames) {
  for (int i = 0; i < 1000 && session.wait(0.01).frames_done < frames; ++i) {
  }
  return session.wait(0.05);
}

TEST(Session, IsHeldAndGoesOnAsIfNothingHadBeen) {
  Settings settings = small_settings();
  settings.samples = 9;
  Session free(settings), held(settings);
  free.start(small_room());
  held.hold_after(1);
  held.start(small_room());
  int version = 0;
  for (const int frames : {1, 3, 8}) {
    held.hold_after(frames);
    const Progress progress = wait_for_frames(held, frames);
    EXPECT_EQ(progress.frames_done, frames);
    EXPECT_EQ(progress.status, Status::RUNNING);
    EXPECT_EQ(progress.version, ++version) << "published there alone";
    held.read(Pass::COMBINED);
  }
  held.hold_after(100);
  EXPECT_EQ(held.wait(30.0).status, Status::DONE);
  free.wait(30.0);
  EXPECT_EQ(held.read(Pass::COMBINED), free.read(Pass::COMBINED));
}

TEST(Session, WhatIsHeldMayBeCancelledAndDestroyed) {
  Session cancelled(small_settings());
  cancelled.hold_after(0);
  cancelled.start(small_room());
  cancelled.cancel();
  EXPECT_EQ(cancelled.wait(0.0).status, Status::CANCELLED);
  Session destroyed(small_settings());
  destroyed.hold_after(1);
  destroyed.start(small_room());
  wait_for_frames(destroyed, 1);
}

TEST(Session, MayBeCancelledBeforeItBegan) {
  Session session(small_settings());
  session.start(small_room());
  session.cancel();
  EXPECT_NE(session.wait(10.0).status, Status::RUNNING);
  Session never_started(small_settings());
  never_started.cancel();
}

TEST(Session, KeepsItsTimeLimit) {
  Settings settings = small_settings(40, 24, 1 << 20);
  settings.time_limit = 0.2;
  Session session(settings);
  session.start(small_room());
  const Progress progress = session.wait(20.0);
  EXPECT_EQ(progress.status, Status::DONE);
  EXPECT_GT(progress.seconds, 0.19);
  EXPECT_LT(progress.seconds, 1.0);
  const std::vector<float> pixels = session.read(Pass::COMBINED);
  for (size_t pixel = 3; pixel < 40 * 24 * 4; pixel += 4) ASSERT_NEAR(pixels[pixel], 1.0f, 1e-5f) << "sampled";
}

TEST(Session, EndsWhenLittleNoiseIsLeft) {
  Settings settings = small_settings(40, 24, 1 << 20);
  settings.noise_threshold = 0.03;
  std::vector<float> first;
  for (const int threads : {1, 2}) {
    settings.threads = threads;
    Session session(settings);
    session.start(small_room());
    const Progress progress = session.wait(60.0);
    ASSERT_EQ(progress.status, Status::DONE);
    EXPECT_LE(progress.noise, 0.03);
    EXPECT_GT(progress.noise, 0.01);
    EXPECT_GT(progress.frames_done, 16);
    EXPECT_LT(progress.frames_done, 4096);
    const std::vector<float> pixels = session.read(Pass::COMBINED);
    if (first.empty()) first = pixels;
    EXPECT_EQ(pixels, first) << "whenever it was looked at";
  }
  settings.samples = 17;
  Session short_session(settings);
  short_session.start(small_room());
  const Progress cut = short_session.wait(60.0);
  EXPECT_EQ(cut.frames_done, 17) << "too few to get there";
  EXPECT_GT(cut.noise, 0.03) << "and yet known";
}

/// A render of the small room to its end.
std::unique_ptr<Session> rendered(const Settings& settings) {
  auto session = std::make_unique<Session>(settings);
  session->start(small_room());
  EXPECT_EQ(session->wait(60.0).status, Status::DONE);
  return session;
}

Settings adaptive_settings() {
  Settings settings = small_settings(80, 48, 4096);
  settings.noise_threshold = 0.02;
  settings.adaptive_sampling = true;
  settings.sequence = SampleSequence::RANDOM;  // points of others depend on the number of samples
  return settings;
}

/// By path tracing a pixel is what it is after as many samples in any picture.
TEST(Session, AdaptiveSamplingEndsEachPixelByItself) {
  Settings settings = adaptive_settings();
  const auto session = rendered(settings);
  const Progress progress = session->wait(0.0);
  EXPECT_EQ(progress.pixels_left, 0.0);
  EXPECT_LT(progress.mean_samples, 0.8 * progress.frames_done);
  const std::vector<float> pixels = session->read(Pass::COMBINED);
  constexpr size_t kWidth = 80, kHeight = 48, kBlock = 8;
  std::vector<int> samples_of(pixels.size() / 4 / (kBlock * kBlock), 0);  // by block
  settings.noise_threshold = 0.0;
  for (const int samples : {16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 1536, 2048}) {
    settings.samples = samples;
    if (samples > progress.frames_done) break;
    const std::vector<float> plain = rendered(settings)->read(Pass::COMBINED);
    for (size_t block = 0; block < samples_of.size(); ++block) {
      bool is_same = samples_of[block] == 0;
      for (size_t row = 0; row < kBlock; ++row) {
        const size_t first = (block / (kWidth / kBlock) * kBlock + row) * kWidth + block % (kWidth / kBlock) * kBlock;
        is_same = is_same && std::equal(&pixels[4 * first], &pixels[4 * first] + 4 * kBlock, &plain[4 * first]);
      }
      if (is_same) samples_of[block] = samples;
    }
  }
  EXPECT_EQ(samples_of.size(), kWidth * kHeight / (kBlock * kBlock));
  EXPECT_EQ(std::ranges::count(samples_of, 0), 0);
  const std::set<int> found(samples_of.begin(), samples_of.end());
  EXPECT_GE(found.size(), 4u);
  EXPECT_EQ(*found.rbegin(), progress.frames_done);
  // Of blocks without noise, which may look alike after fewer, more are not told.
  const double mean =
      std::accumulate(samples_of.begin(), samples_of.end(), 0.0) / static_cast<double>(samples_of.size());
  EXPECT_LE(mean, progress.mean_samples);
  EXPECT_GE(mean, 0.6 * progress.mean_samples);
}

TEST(Session, AdaptiveSamplingLeavesNoBlockNoisyWhateverPathsShare) {
  for (const IndirectAnswer indirect : {IndirectAnswer::PATH, IndirectAnswer::CELL_SHARED}) {
    Settings settings = adaptive_settings();
    settings.indirect = indirect;
    settings.path_sharing.temporal_reuse = false;
    settings.passes = {Pass::SAMPLE_COUNT};
    std::vector<float> first;
    for (const int threads : {1, 2}) {
      settings.threads = threads;
      const auto session = rendered(settings);
      const Progress progress = session->wait(0.0);
      EXPECT_EQ(progress.pixels_left, 0.0);
      EXPECT_LT(progress.mean_samples, 0.9 * progress.frames_done);
      const std::vector<float> counts = session->read(Pass::SAMPLE_COUNT);
      const double count = std::accumulate(counts.begin(), counts.end(), 0.0);
      EXPECT_NEAR(count / static_cast<double>(counts.size()), progress.mean_samples, 1e-6);
      const std::vector<float> pixels = session->read(Pass::COMBINED);
      if (first.empty()) first = pixels;
      EXPECT_EQ(pixels, first);
    }
    settings.adaptive_sampling = false;
    EXPECT_EQ(rendered(settings)->wait(0.0).pixels_left, 1.0);
  }
}

TEST(Session, AdaptiveSamplingWaitsForATrialOfGuides) {
  Settings settings = adaptive_settings();
  settings.guiding = Guiding::AUTO;
  settings.noise_threshold = 0.4;
  const Progress early = rendered(settings)->wait(0.0);
  EXPECT_EQ(early.frames_done, 16) << "all blocks are quiet";
  settings.noise_threshold = 0.03;
  settings.passes = {Pass::SAMPLE_COUNT};
  const auto session = rendered(settings);
  EXPECT_EQ(session->wait(0.0).pixels_left, 0.0);
  // 400,000 paths of 3,840 pixels are 105: the trial is over after 128 + 8 frames.
  EXPECT_EQ(std::ranges::min(session->read(Pass::SAMPLE_COUNT)), 192.0f);
}

TEST(Session, NothingEndsBeforeRareLightHasHadItsChance) {
  Settings settings = adaptive_settings();
  settings.display_exposure = 1e-9;  // nothing shows
  for (const bool adaptive : {true, false}) {
    settings.adaptive_sampling = adaptive;
    for (const auto& [threshold, frames] : {std::pair{0.1, 16}, {0.02, 24}, {0.01, 48}, {0.005, 96}}) {
      settings.noise_threshold = threshold;
      EXPECT_EQ(rendered(settings)->wait(0.0).frames_done, frames) << threshold;
    }
  }
}

TEST(Session, PicturesWithReservoirsEndAsAWhole) {
  Settings settings = adaptive_settings();
  settings.direct = DirectAnswer::RIS;
  settings.passes = {Pass::SAMPLE_COUNT};
  const auto session = rendered(settings);
  const Progress progress = session->wait(0.0);
  EXPECT_LE(progress.noise, settings.noise_threshold);
  EXPECT_EQ(progress.pixels_left, 1.0);
  EXPECT_EQ(progress.mean_samples, progress.frames_done);
  EXPECT_EQ(std::ranges::min(session->read(Pass::SAMPLE_COUNT)), static_cast<float>(progress.frames_done));
}

TEST(Session, TellsTheNoiseThatATimeLimitLeaves) {
  Settings settings = small_settings(40, 24, 1 << 20);
  settings.noise_threshold = 1e-6;
  settings.sequence = SampleSequence::RANDOM;  // points of others depend on the number of samples
  settings.time_limit = 0.3;
  Session limited(settings);
  limited.start(small_room());
  const Progress left = limited.wait(60.0);
  ASSERT_EQ(left.status, Status::DONE);
  settings.samples = left.frames_done;
  settings.time_limit = 0.0;
  Session whole(settings);
  whole.start(small_room());
  const Progress same = whole.wait(60.0);
  ASSERT_GT(same.noise, 0.0);
  // A look before would see up to sqrt(1.5) times as much. Samples of the batch that the limit cut off make it less: of
  // a frame as a rule, of many where the machine is busy.
  EXPECT_LT(left.noise, 1.02 * same.noise);
  EXPECT_GT(left.noise, 0.0);
}

TEST(Session, RefusesANoiseThresholdWhereSamplesDoNotTellTheirNoise) {
  Settings settings = small_settings();
  settings.noise_threshold = 0.01;
  settings.direct = DirectAnswer::RESTIR;
  Session session(settings);
  EXPECT_THROW(session.start(small_room()), Error);
  settings.direct_reuse.temporal_reuse = false;
  EXPECT_TRUE(settings.tells_noise());
  settings.direct = DirectAnswer::RESTIR_CACHE;
  EXPECT_FALSE(settings.tells_noise()) << "frames draw from one cache";
}

TEST(Session, PublishesWhileRendering) {
  Session session(small_settings(40, 24, 1 << 20));
  session.start(small_room());
  wait_for_pixels(session);
  const int version = session.wait(0.0).version;
  const std::vector<float> first = session.read(Pass::COMBINED);  // asks for more
  for (int i = 0; i < 500 && session.wait(0.01).version == version; ++i) {
  }
  EXPECT_GT(session.wait(0.0).version, version);
  EXPECT_NE(session.read(Pass::COMBINED), first);
  EXPECT_GE(session.wait(0.0).remaining_seconds, 0.0);
}

TEST(Session, MayBeDestroyedWhileRunning) {
  const std::shared_ptr<const Scene> scene = small_room();
  const Clock::time_point start = Clock::now();
  for (int i = 0; i < 5; ++i) {
    Session session(small_settings(1024, 1024, 1 << 20));
    session.start(scene);
    session.wait(0.01 * i);
  }
  EXPECT_LT(seconds_since(start), 5.0);
  EXPECT_EQ(scene.use_count(), 1) << "nothing keeps the scene";
}

TEST(Session, LetsGoOfTheSceneAtItsEnd) {
  const std::shared_ptr<const Scene> scene = small_room();
  Session session(small_settings());
  session.start(scene);
  session.wait(30.0);
  EXPECT_LE(scene.use_count(), 2);  // Embree scenes of the finished thread may still be closing
}

/// While alive, the process may take only this many bytes more of address space.
class MemoryLimit {
 public:
  explicit MemoryLimit(rlim_t bytes) {
    getrlimit(RLIMIT_AS, &saved_);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    rlimit limit = saved_;
    limit.rlim_cur = std::min(bytes, limit.rlim_max);
    setrlimit(RLIMIT_AS, &limit);
  }
  ~MemoryLimit() { setrlimit(RLIMIT_AS, &saved_); }

 private:
  rlimit saved_{};
};

TEST(Session, AnErrorInItsThreadEndsAsFailed) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the address sanitizer reserves all address space for itself";
#else
  Session session(small_settings(40000, 40000, 1));  // 38 GB of film
  const MemoryLimit limit(rlim_t{16} << 30);
  session.start(small_room());
  const Progress progress = session.wait(30.0);
  EXPECT_EQ(progress.status, Status::FAILED);
  EXPECT_EQ(progress.error, "out of memory");
#endif
}

}  // namespace
}  // namespace cistern::test
