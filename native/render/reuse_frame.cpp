#include "render/reuse_frame.h"

namespace cistern {

ReuseFrame::ReuseFrame(const FrameContext& context, std::shared_ptr<const LightCacheCells> cache_cells)
    : context_(context), direct_(context_, std::move(cache_cells)) {
  const Region& region = context.settings.region;
  const size_t pixels = static_cast<size_t>(region.width) * static_cast<size_t>(region.height);
  records_.resize(pixels);
  visible_points_.resize(pixels);
  if (context.settings.direct_reuse.temporal_reuse && context.settings.samples > 1)
    previous_visible_points_.reserve(pixels);
}

bool ReuseFrame::render(uint32_t frame, Film& film, const StopCondition& stop) {
  const FrameRun run{context_, frame, stop, non_finite_weights_};
  if (!trace_paths(run)) return false;
  if (!direct_.reuse(run, visible_points_, previous_visible_points_)) return false;
  if (!shade(run, film)) return false;
  keep_history();
  return true;
}

/// Each path is traced at once, with the light it finds by itself; at its visible point reservoirs start.
bool ReuseFrame::trace_paths(const FrameRun& run) {
  struct Scratch {
    PathScratch path;
    PathCapture capture;
    uint64_t non_finite = 0;
  };
  const Settings& s = context_.settings;
  const auto trace = [&](int x, int y, Scratch& scratch) {
    const auto pixel = static_cast<uint32_t>(y * s.region.width + x);
    PathSampler sampler(s.seed, full_frame_pixel(s, x, y), run.frame, s.sequence);
    const Ray ray = sample_camera_ray(context_, x, y, sampler);
    scratch.capture.direct_candidates = static_cast<float>(s.direct_reuse.light_candidates);
    records_[pixel] = trace_path(context_.paths, ray, sampler, scratch.path, &scratch.capture);
    visible_points_[pixel] = scratch.capture.visible;
    direct_.start_pixel(scratch.capture.visible, pixel, run.frame, scratch.non_finite);
  };
  return for_each_pixel<Scratch>(s.region.width, s.region.height, run.stop, trace, [&](const Scratch& scratch) {
    non_finite_weights_.fetch_add(scratch.non_finite, std::memory_order_relaxed);
  });
}

bool ReuseFrame::shade(const FrameRun& run, Film& film) {
  const float limit = context_.paths.limits.clamp_direct;
  return run.for_pixels([&](uint32_t pixel, uint64_t&) {
    PathRecord& record = records_[pixel];
    const VisiblePoint& visible = visible_points_[pixel];
    if (visible.exists) record.direct += clamp_contribution(direct_.shade(visible, pixel), limit);
    film.add(pixel, record);
    film.show(Pass::RESERVOIR_CONFIDENCE, pixel, Rgb(direct_.reservoir(pixel).c));
    film.show(Pass::RESERVOIR_WEIGHT, pixel, Rgb(direct_.reservoir(pixel).W));
  });
}

void ReuseFrame::keep_history() {
  direct_.keep_history();
  if (!context_.settings.direct_reuse.temporal_reuse) return;
  previous_visible_points_.resize(visible_points_.size());
  std::swap(previous_visible_points_, visible_points_);
}

size_t ReuseFrame::memory_bytes() const {
  const size_t points = visible_points_.capacity() + previous_visible_points_.capacity();
  return records_.capacity() * sizeof(PathRecord) + points * sizeof(VisiblePoint) + direct_.memory_bytes();
}

}  // namespace cistern
