#include "render/reuse_frame.h"

namespace cistern {

struct ReuseFrame::Scratch {
  PathScratch path;
  PathCapture capture;
  uint64_t non_finite_weights = 0;
};

namespace {

ReservoirDirectLight make_direct(const FrameContext& context) {
  const Settings& s = context.settings;
  const ReservoirDirectLight::Image image{s.region.x, s.region.y, s.region.width, s.region.height, s.width, s.height};
  return {context.paths, s.direct_reuse, image, s.seed};
}

}  // namespace

ReuseFrame::ReuseFrame(const FrameContext& context)
    : context_(context),
      direct_(make_direct(context)),
      width_(context.settings.region.width),
      height_(context.settings.region.height) {
  const size_t pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  records_.resize(pixels);
  visible_points_.resize(pixels);
  reservoirs_.resize(pixels);
  if (context.settings.direct_reuse.spatial_reuse) reused_.resize(pixels);
  if (context.settings.direct_reuse.temporal_reuse && context.settings.samples > 1) {
    history_.visible_points.reserve(pixels);
    history_.reservoirs.reserve(pixels);
  }
}

template <class Body>
bool ReuseFrame::for_pixels(const StopCondition& stop, const Body& body) {
  return for_each_pixel<Scratch>(
      width_, height_, stop,
      [&](int x, int y, Scratch& scratch) { body(x, y, static_cast<uint32_t>(y * width_ + x), scratch); },
      [&](const Scratch& scratch) {
        non_finite_weights_.fetch_add(scratch.non_finite_weights, std::memory_order_relaxed);
      });
}

bool ReuseFrame::render(uint32_t frame, Film& film, const StopCondition& stop) {
  if (!find_visible_points(frame, stop)) return false;
  if (!reuse_in_time(frame, stop)) return false;
  if (!reuse_in_space(frame, stop)) return false;
  if (!shade(film, stop)) return false;
  keep_history();
  return true;
}

/// The whole path is traced at once, with the light it finds by itself; at its visible point reservoirs start.
bool ReuseFrame::find_visible_points(uint32_t frame, const StopCondition& stop) {
  const Settings& s = context_.settings;
  return for_pixels(stop, [&](int x, int y, uint32_t pixel, Scratch& scratch) {
    PathSampler sampler(s.seed, full_frame_pixel(s, x, y), frame, s.sequence);
    const Ray ray = sample_camera_ray(context_, x, y, sampler);
    scratch.capture.direct_candidates = static_cast<float>(s.direct_reuse.light_candidates);
    records_[pixel] = trace_path(context_.paths, ray, sampler, scratch.path, &scratch.capture);
    const VisiblePoint& visible = visible_points_[pixel] = scratch.capture.visible;
    reservoirs_[pixel] = visible.exists ? direct_.initial_candidates(visible, pixel, frame, scratch.non_finite_weights)
                                        : LightReservoir{};
  });
}

bool ReuseFrame::reuse_in_time(uint32_t frame, const StopCondition& stop) {
  if (history_.visible_points.empty()) return true;
  return for_pixels(stop, [&](int, int, uint32_t pixel, Scratch& scratch) {
    if (!visible_points_[pixel].exists) return;
    reservoirs_[pixel] = direct_.reuse_in_time(visible_points_[pixel], reservoirs_[pixel], history_, pixel, frame,
                                               scratch.non_finite_weights);
  });
}

bool ReuseFrame::reuse_in_space(uint32_t frame, const StopCondition& stop) {
  const DirectReuse& reuse = context_.settings.direct_reuse;
  for (int round = 0; reuse.spatial_reuse && round < reuse.spatial_rounds; ++round) {
    const bool done = for_pixels(stop, [&](int, int, uint32_t pixel, Scratch& scratch) {
      reused_[pixel] = visible_points_[pixel].exists ? direct_.reuse_in_space(visible_points_, reservoirs_, pixel,
                                                                              frame, round, scratch.non_finite_weights)
                                                     : LightReservoir{};
    });
    if (!done) return false;
    std::swap(reservoirs_, reused_);
  }
  return true;
}

bool ReuseFrame::shade(Film& film, const StopCondition& stop) {
  const float limit = context_.paths.limits.clamp_direct;
  return for_pixels(stop, [&](int, int, uint32_t pixel, Scratch&) {
    PathRecord& record = records_[pixel];
    if (visible_points_[pixel].exists)
      record.direct += clamp_contribution(direct_.shade(visible_points_[pixel], reservoirs_[pixel]), limit);
    film.add(pixel, record);
    film.show(Pass::RESERVOIR_CONFIDENCE, pixel, Rgb(reservoirs_[pixel].c));
    film.show(Pass::RESERVOIR_WEIGHT, pixel, Rgb(reservoirs_[pixel].W));
  });
}

void ReuseFrame::keep_history() {
  if (!context_.settings.direct_reuse.temporal_reuse) return;
  history_.camera = context_.paths.scene.camera;
  history_.visible_points.resize(visible_points_.size());
  history_.reservoirs.resize(reservoirs_.size());
  std::swap(history_.visible_points, visible_points_);
  std::swap(history_.reservoirs, reservoirs_);
}

size_t ReuseFrame::memory_bytes() const {
  const size_t points = visible_points_.capacity() + history_.visible_points.capacity();
  const size_t reservoirs = reservoirs_.capacity() + reused_.capacity() + history_.reservoirs.capacity();
  return records_.capacity() * sizeof(PathRecord) + points * sizeof(VisiblePoint) + reservoirs * sizeof(LightReservoir);
}

}  // namespace cistern
