#pragma once

#include "render/direct_stage.h"
#include "render/path_stage.h"
#include "render/render_history.h"
#include "render/secondary_stage.h"

namespace cistern {

/// Frames in which visible points share what they find: each is made in stages over the whole picture. Memory is
/// touched first by the first frame, and used again from then on, also by a render that takes over.
class ReuseFrame {
 public:
  /// `cache_cells`: for RESTIR_CACHE, else null. `report_caching`: told in [0, 1] how much of the light in them is
  /// ready, from any thread.
  ReuseFrame(std::shared_ptr<const RenderWorld> world, std::shared_ptr<const LightCacheCells> cache_cells,
             std::function<void(float)> report_caching);

  /// Goes on with the history of another render, to be called before the first frame; `change` is that of the scene
  /// since the one history is from (history_world). Both renders must share_history. Frame numbers go on as well: the
  /// random numbers of a frame that others remember must not come again.
  void take_over(ReuseFrame&& earlier, SceneChange change);
  /// Looks at the history of a finer picture in the first frame (see can_borrow_history), and leaves it as it is.
  void borrow(std::unique_ptr<ReuseFrame> lender, SceneChange change);
  /// The frame that was borrowed from, whole again; null if none was. To be called after the last frame.
  std::unique_ptr<ReuseFrame> give_back();

  /// Whether any answer of these settings takes more than paths by themselves.
  static bool is_needed(const Settings& settings);

  /// Adds the next frame to the film. Does nothing to the film unless the last stage is reached, and
  /// pixels that stage does not reach when stopped early miss this frame. True if the frame was finished.
  bool render(Film& film, const StopCondition& stop);

  const std::shared_ptr<const RenderWorld>& world() const { return world_; }
  /// Where the history comes from: `world`, once a frame was finished.
  const std::shared_ptr<const RenderWorld>& history_world() const { return source_ ? source_->world() : world_; }

  /// The number of the next frame.
  uint32_t next_frame() const { return next_frame_; }
  /// Of its own, not of one taken over.
  bool has_finished_frame() const { return has_finished_frame_; }

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
  void add_direct_light(const VisiblePoint& visible, uint32_t pixel, PathRecord& record, PixelLight* by_kind,
                        std::span<Rgb> by_group) const;
  /// Samples of other points that a pixel was handed in this frame, for all of its light.
  float reuse_count(uint32_t pixel) const;
  void keep_history();
  void swap_history(ReuseFrame& other);

  std::shared_ptr<const RenderWorld> world_;
  const FrameContext& context_;
  std::unique_ptr<const HistorySource> source_;  // until a frame was finished, if history was taken over
  std::unique_ptr<ReuseFrame> lender_;
  bool is_borrowing_ = false;  // the lender has our empty history, and we have its own
  bool has_finished_frame_ = false;
  uint32_t next_frame_ = 0;
  std::optional<DirectStage> direct_;  // each for its answer, unless that is the path tracer's
  std::optional<SecondaryStage> secondary_;
  std::unique_ptr<PathStage> paths_;
  std::atomic<uint64_t> non_finite_weights_{0};
  StageTimes stage_times_;
  // By pixel.
  LazyVector<PathRecord> records_;
  PixelKinds kinds_;
  GroupTable groups_;
  LazyVector<VisiblePoint> visible_points_, previous_visible_points_;
};

}  // namespace cistern
