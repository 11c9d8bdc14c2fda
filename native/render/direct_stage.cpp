#include "render/direct_stage.h"

namespace cistern {

DirectStage::DirectStage(const FrameContext& context, std::shared_ptr<const LightCacheCells> cache_cells,
                         std::function<void(float)> report_caching)
    : context_(context),
      report_caching_(std::move(report_caching)),
      direct_(context.paths, context.settings.direct_reuse, image_region(context.settings), context.settings.seed) {
  const Settings& s = context.settings;
  if (cache_cells)
    cached_.emplace(context.paths, s.direct_reuse, s.light_cache, image_region(s), s.seed, std::move(cache_cells));
  const size_t pixels = static_cast<size_t>(s.region.width) * static_cast<size_t>(s.region.height);
  reservoirs_.resize(pixels);
  reuse_counts_.resize(pixels);
  if (s.direct_reuse.spatial_reuse) scratch_.resize(pixels);
}

void DirectStage::take_over(DirectStage&& earlier, const HistorySource& source) {
  const size_t pixels = reservoirs_.size(), scratch_pixels = scratch_.size();
  // A frame that was cancelled had other lights than its history, which is what is compared with.
  const bool has_lights_of_history = !earlier.history_.world;
  std::swap(reservoirs_, earlier.reservoirs_);
  std::swap(scratch_, earlier.scratch_);
  std::swap(history_, earlier.history_);
  reservoirs_.resize(pixels);
  scratch_.resize(scratch_pixels);
  set_source(source);
  if (cached_ && has_lights_of_history && !source.earlier()) cached_->take_over(std::move(*earlier.cached_));
}

void DirectStage::set_source(const HistorySource& source) {
  history_.view = source.view();
  history_.world = source.earlier();
}

void DirectStage::start_pixel(const VisiblePoint& visible, uint32_t pixel, uint32_t frame, uint64_t& non_finite) {
  reservoirs_[pixel] = {};
  reuse_counts_[pixel] = 0;
  if (visible.exists && !cached_) reservoirs_[pixel] = direct_.initial_candidates(visible, pixel, frame, non_finite);
}

bool DirectStage::reuse(const FrameRun& run, std::span<const VisiblePoint> visible,
                        std::span<const VisiblePoint> previous) {
  history_.visible_points = previous;
  return merge_cache(run, visible) && reuse_in_time(run, visible) && reuse_in_space(run, visible);
}

bool DirectStage::merge_cache(const FrameRun& run, std::span<const VisiblePoint> visible) {
  if (!cached_) return true;
  // Most of it is made in the first frame; later ones only renew a part.
  const WorkMonitor monitor{[&] { return run.stop.cancelled || run.stop.deadline_passed(); },
                            is_first_frame_ ? report_caching_ : nullptr};
  if (!cached_->prepare(visible, run.frame, monitor)) return false;
  run.stage_times.lap("Direct light: cache");
  const bool done = run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
    if (visible[pixel].exists)
      reservoirs_[pixel] =
          cached_->initial_candidates(visible[pixel], pixel, run.frame, non_finite, reuse_counts_[pixel]);
  });
  run.stage_times.lap("Direct light: candidates");
  return done;
}

bool DirectStage::reuse_in_time(const FrameRun& run, std::span<const VisiblePoint> visible) {
  if (!context_.settings.direct_reuse.temporal_reuse || history_.reservoirs.empty()) return true;
  const bool done = run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
    if (visible[pixel].exists)
      reservoirs_[pixel] = direct_.reuse_in_time(visible[pixel], reservoirs_[pixel], history_, pixel, run.frame,
                                                 non_finite, reuse_counts_[pixel]);
  });
  run.stage_times.lap("Direct light: temporal reuse");
  return done;
}

bool DirectStage::reuse_in_space(const FrameRun& run, std::span<const VisiblePoint> visible) {
  const DirectReuse& reuse = context_.settings.direct_reuse;
  for (int round = 0; reuse.spatial_reuse && round < reuse.spatial_rounds; ++round) {
    const bool done = run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
      scratch_[pixel] = visible[pixel].exists ? direct_.reuse_in_space(visible, reservoirs_, pixel, run.frame, round,
                                                                       non_finite, reuse_counts_[pixel])
                                              : LightReservoir{};
    });
    if (!done) return false;
    std::swap(reservoirs_, scratch_);
    run.stage_times.lap("Direct light: spatial reuse");
  }
  return true;
}

void DirectStage::keep_history() {
  is_first_frame_ = false;
  if (!context_.settings.direct_reuse.temporal_reuse) return;
  history_.view = {context_.paths.scene.camera, image_region(context_.settings)};
  history_.world = nullptr;
  history_.reservoirs.resize(reservoirs_.size());
  std::swap(history_.reservoirs, reservoirs_);
}

size_t DirectStage::memory_bytes() const {
  const size_t reservoirs = reservoirs_.capacity() + scratch_.capacity() + history_.reservoirs.capacity();
  return reservoirs * sizeof(LightReservoir) + reuse_counts_.capacity() * sizeof(uint32_t) +
         (cached_ ? cached_->memory_bytes() : 0);
}

}  // namespace cistern
