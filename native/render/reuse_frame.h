#pragma once

#include "render/direct_stage.h"
#include "render/path_stage.h"
#include "render/secondary_stage.h"

namespace cistern {

/// Frames in which visible points share what they find: each is made in stages over the whole picture. Memory is
/// allocated with the first frame and reused.
class ReuseFrame {
 public:
  /// `cache_cells`: for RESTIR_CACHE, else null. `report_caching`: told in [0, 1] how much of the light in them is
  /// ready, from any thread.
  ReuseFrame(const FrameContext& context, std::shared_ptr<const LightCacheCells> cache_cells,
             std::function<void(float)> report_caching);

  /// Whether any answer of these settings is not the path tracer's.
  static bool is_needed(const Settings& settings);

  /// Adds one frame to the film; frames come in order. Does nothing to the film unless the last stage is reached, and
  /// pixels that stage does not reach when stopped early miss this frame. True if the frame was finished.
  bool render(uint32_t frame, Film& film, const StopCondition& stop);

  size_t memory_bytes() const;
  /// Weights that were not finite, so far; they counted as zero.
  uint64_t non_finite_weights() const {
    return non_finite_weights_ + (direct_ ? direct_->cache_non_finite_weights() : 0);
  }
  /// Of all frames so far.
  const StageTimes& stage_times() const { return stage_times_; }

 private:
  bool trace_paths(const FrameRun& run);
  bool reuse_secondary_light(const FrameRun& run);
  bool shade(const FrameRun& run, Film& film);
  void shade_paths(const VisiblePoint& visible, uint32_t pixel, PathRecord& record) const;
  void keep_history();

  FrameContext context_;
  std::optional<DirectStage> direct_;  // each for its answer, unless that is the path tracer's
  std::optional<SecondaryStage> secondary_;
  std::unique_ptr<PathStage> paths_;
  std::atomic<uint64_t> non_finite_weights_{0};
  StageTimes stage_times_;
  // By pixel.
  std::vector<PathRecord> records_;
  std::vector<VisiblePoint> visible_points_, previous_visible_points_;
};

}  // namespace cistern
