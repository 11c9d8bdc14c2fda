#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "film/picture_noise.h"
#include "render/banded_frame.h"
#include "render/render_cache.h"
#include "render/reuse_frame.h"
#include "scene/shutter.h"

namespace cistern {

enum class Status : uint8_t { RUNNING, DONE, CANCELLED, FAILED };

struct Progress {
  Status status = Status::DONE;
  int frames_done = 0, frames = 0;
  double seconds = 0.0;             // since start
  double remaining_seconds = -1.0;  // negative: not known yet
  double noise = -1.0;        // PictureNoise::of_most() when last looked at; negative: not yet, or without a threshold
  int expected_frames = 0;    // `frames`, or fewer that will do for the threshold
  double mean_samples = 0.0;  // of the pixels: `frames_done`, or fewer with adaptive sampling
  double pixels_left = 1.0;   // share of those that are still sampled
  int openings = 0;           // that the sky is looked for through, see opening_search.h
  std::string stage;          // "Building", "Caching light" or "Rendering"
  float stage_done = 0.0f;    // of "Caching light", in [0, 1]
  std::string error;          // why it FAILED
  size_t memory_bytes = 0;    // scene, accel, lights, film: of the core alone
  uint64_t non_finite_samples = 0;
  uint64_t non_finite_weights = 0;                            // of reservoirs; they counted as zero
  std::vector<std::pair<std::string, double>> stage_seconds;  // of answers that reuse, see StageTimes
  int version = 0;                                            // changes whenever `read` returns new pixels
};

/// One render of one scene on a native thread of its own, TBB inside. All members may be called from any thread and the
/// object may be destroyed on any; destroying a running session cancels it first.
class Session {
 public:
  /// Throws Error for a setting out of range.
  explicit Session(Settings settings);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Starts rendering and returns at once. A session renders once; a second start throws Error, and so does a noise
  /// threshold where frames do not tell their noise (Settings::tells_noise). `cache`, if any, is
  /// looked into and filled for later sessions. Scenes with participating media, which no technique of reuse knows, are
  /// rendered by path tracing whatever the settings say; see by_path_tracing.
  void start(std::shared_ptr<const Scene> scene, std::shared_ptr<RenderCache> cache = {});
  /// Whether frames of these settings keep nothing, so that each can be of another moment.
  static bool can_blur_motion(const Settings& settings);
  /// With motion blur: each frame is of a moment while the shutter is open, all of its paths of the same one. So what
  /// paths share in a frame is exact. Throws Error where that cannot be.
  void start(std::shared_ptr<const Shutter> shutter, std::shared_ptr<RenderCache> cache = {});
  /// Returns after `seconds` or as soon as the render has ended.
  Progress wait(double seconds);
  /// Stops within 100 ms; what was rendered can be read.
  void cancel();
  /// Renders no more than so many frames until told again, so that several sessions can keep step; pixels are published
  /// there alone. Before start, too.
  void hold_after(int frames);
  /// Pixels of the region (see Film::resolve): all of them once the render has ended. While it runs, those of the last
  /// published state, zeros before the first one; asking makes the next frames publish again.
  std::vector<float> read(Pass pass);
  std::vector<float> read(const SurfaceLayer& layer);
  std::vector<float> read_light_group(int group);
  const Settings& settings() const { return settings_; }

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  std::shared_ptr<const LightSet> find_lights(const std::shared_ptr<const Accel>& accel);
  bool keeps_history() const;
  void leave_history(std::unique_ptr<ReuseFrame> frame);
  Settings decided_settings(const Settings& asked, const std::shared_ptr<const Accel>& accel,
                            const std::shared_ptr<const LightSet>& lights,
                            const std::shared_ptr<const CausticGuide>& caustics) const;
  Clock::time_point deadline_from(Clock::time_point start, double share) const;
  std::unique_ptr<ReuseFrame> make_reuse_frame(const std::shared_ptr<const RenderWorld>& world,
                                               std::shared_ptr<const LightCacheCells> cache_cells);
  void report_caching(float done);
  bool adapts() const;
  bool is_clean(uint32_t frames, const FrameContext& context);
  PictureNoise look_at_noise(uint32_t frames);
  void tell_noise_left();
  bool try_sharing(uint32_t frames, const RenderWorld& world, std::optional<BandedFrame>& banded);
  void render(std::shared_ptr<const RenderWorld> world, ReuseFrame* reuse);
  uint32_t await_release(uint32_t frames_done);
  std::shared_ptr<const RenderWorld> at_moment(uint32_t frame, const RenderWorld& earlier) const;
  std::vector<float> read_published(const std::vector<float>& pixels, int channels);
  void publish();
  void end(Status status, const std::string& error);
  Progress progress_locked() const;

  Settings settings_;
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const Shutter> shutter_;  // null unless something moves
  std::shared_ptr<RenderCache> cache_;
  std::vector<AreaLight> openings_;  // that the sky is looked for through
  std::unique_ptr<Film> film_;
  std::shared_ptr<SurfaceFilm> surfaces_;  // null unless asked for
  std::thread thread_;
  std::atomic<bool> cancelled_{false};

  mutable std::mutex mutex_;  // guards everything below
  bool was_started_ = false;
  std::condition_variable ended_, released_;
  static constexpr uint32_t kFree = std::numeric_limits<uint32_t>::max();
  uint32_t held_after_ = kFree;  // frames
  Progress progress_;
  std::vector<std::vector<float>> published_;           // by Pass
  std::vector<std::vector<float>> published_surfaces_;  // by layer of the settings
  std::vector<std::vector<float>> published_groups_;    // by light group
  bool wants_pixels_ = true;
  Clock::time_point started_, rendering_since_, last_frame_;
};

}  // namespace cistern
