#include "render/reuse_frame.h"

namespace cistern {
namespace {

void show_reservoir(Film& film, uint32_t pixel, const LightReservoir& reservoir) {
  film.show(Pass::RESERVOIR_CONFIDENCE, pixel, Rgb(reservoir.c));
  film.show(Pass::RESERVOIR_WEIGHT, pixel, Rgb(reservoir.W));
}

}  // namespace

ReuseFrame::ReuseFrame(std::shared_ptr<const RenderWorld> world, std::shared_ptr<const LightCacheCells> cache_cells,
                       std::function<void(float)> report_caching)
    : world_(std::move(world)), context_(world_->context), paths_(PathStage::make(context_)) {
  const Settings& s = context_.settings;
  if (uses_reservoirs(s.direct)) direct_.emplace(context_, std::move(cache_cells), std::move(report_caching));
  if (uses_reservoirs(s.secondary)) secondary_.emplace(context_);
  const size_t pixels = static_cast<size_t>(s.region.width) * static_cast<size_t>(s.region.height);
  records_.resize(pixels);
  kinds_.resize(context_.paths, pixels);
  groups_.resize(context_.paths, pixels);
  visible_points_.resize(pixels);
}

void ReuseFrame::take_over(ReuseFrame&& earlier, SceneChange change) {
  source_ = std::make_unique<HistorySource>(earlier.history_world(), *world_, std::move(change));
  next_frame_ = earlier.next_frame_;
  const size_t pixels = visible_points_.size();
  std::swap(records_, earlier.records_);
  std::swap(visible_points_, earlier.visible_points_);
  std::swap(previous_visible_points_, earlier.previous_visible_points_);
  records_.resize(pixels);
  visible_points_.resize(pixels);
  if (direct_) direct_->take_over(std::move(*earlier.direct_), *source_);
  if (secondary_) secondary_->take_over(std::move(*earlier.secondary_), *source_);
  if (paths_) paths_->take_over(std::move(*earlier.paths_), *source_);
}

void ReuseFrame::borrow(std::unique_ptr<ReuseFrame> lender, SceneChange change) {
  source_ = std::make_unique<HistorySource>(lender->history_world(), *world_, std::move(change));
  next_frame_ = lender->next_frame_;
  lender_ = std::move(lender);
  is_borrowing_ = true;
  swap_history(*lender_);
  if (direct_) direct_->set_source(*source_);
  if (paths_) paths_->set_source(*source_);
}

std::unique_ptr<ReuseFrame> ReuseFrame::give_back() {
  if (is_borrowing_) swap_history(*lender_);
  is_borrowing_ = false;
  return std::move(lender_);
}

void ReuseFrame::swap_history(ReuseFrame& other) {
  std::swap(previous_visible_points_, other.previous_visible_points_);
  if (direct_) direct_->swap_history(*other.direct_);
  if (paths_) paths_->swap_history(*other.paths_);
}

bool ReuseFrame::is_needed(const Settings& s) {
  return uses_reservoirs(s.direct) || uses_reservoirs(s.secondary) || s.indirect != IndirectAnswer::PATH;
}

bool ReuseFrame::render(Film& film, const StopCondition& stop) {
  const FrameRun run{context_, next_frame_, stop, non_finite_weights_, stage_times_};
  stage_times_.start();
  if (!trace_paths(run)) return false;
  stage_times_.lap("Paths");
  if (direct_ && !direct_->reuse(run, visible_points_, previous_visible_points_)) return false;
  if (secondary_ && !reuse_secondary_light(run)) return false;
  if (secondary_) stage_times_.lap("Later points: shading");
  if (paths_ && !paths_->reuse(run, visible_points_, previous_visible_points_)) return false;
  if (!shade(run, film)) return false;
  keep_history();
  stage_times_.lap("Shading");
  return true;
}

/// Each path is traced at once, with the light it finds by itself; at its visible point reservoirs start.
bool ReuseFrame::trace_paths(const FrameRun& run) {
  struct Scratch {
    PathScratch path;
    PathCapture capture;
    SecondaryStage::Batch batch;
    uint64_t non_finite = 0;
  };
  const Settings& s = context_.settings;
  if (secondary_) secondary_->begin_frame();
  const auto trace = [&](int x, int y, Scratch& scratch) {
    const auto pixel = static_cast<uint32_t>(y * s.region.width + x);
    PathCapture& capture = scratch.capture;
    ask_for_light(capture, s);
    if (paths_) paths_->ask(capture, full_frame_pixel(s, x, y), run.frame);
    records_[pixel] = trace_pixel(context_, x, y, run.frame, scratch.path, &capture);
    keep_seen(context_, x, y, scratch.path);
    kinds_.start_pixel(pixel, scratch.path, capture);
    groups_.set(pixel, scratch.path.light_by_group);
    visible_points_[pixel] = capture.visible;
    if (direct_) direct_->start_pixel(capture.visible, pixel, run.frame, scratch.non_finite);
    if (secondary_) scratch.batch.add(pixel, capture);
    if (paths_) paths_->start_pixel(capture, pixel);
  };
  return for_each_pixel<Scratch>(s.region.width, s.region.height, run.stop, trace, [&](Scratch& scratch) {
    non_finite_weights_.fetch_add(scratch.non_finite, std::memory_order_relaxed);
    if (secondary_) secondary_->add_batch(std::move(scratch.batch));
    collect_records(context_, scratch.path);
  });
}

/// The light of later vertices goes into the path records, and into the path samples before those are reused.
bool ReuseFrame::reuse_secondary_light(const FrameRun& run) {
  if (!secondary_->reuse(run)) return false;
  return run.for_pixels([&](uint32_t pixel, uint64_t&) {
    std::array<PathSample*, kMaxPathLinks> samples{};
    if (paths_) samples = paths_->samples(pixel);
    const auto count = static_cast<size_t>(paths_ ? paths_->link_count() : 0);
    SecondaryStage::PixelGroups groups{groups_.of(pixel), {}};
    if (paths_) groups.continuations = paths_->continuation_groups(pixel);
    secondary_->shade(pixel, records_[pixel], std::span(samples.data(), count), kinds_.of(pixel), groups);
  });
}

bool ReuseFrame::shade(const FrameRun& run, Film& film) {
  const PathLimits& limits = context_.paths.limits;
  return run.for_pixels([&](uint32_t pixel, uint64_t&) {
    PathRecord& record = records_[pixel];
    const VisiblePoint& visible = visible_points_[pixel];
    PixelLight* by_kind = kinds_.of(pixel);
    const std::span<Rgb> by_group = groups_.of(pixel);
    if (visible.exists && direct_) add_direct_light(visible, pixel, record, by_kind, by_group);
    if (visible.exists && paths_) paths_->add_to(visible, pixel, limits.clamp_indirect, record, by_kind, by_group);
    const auto width = static_cast<uint32_t>(film.width());
    add_to_film(context_, static_cast<int>(pixel % width), static_cast<int>(pixel / width), run.frame, record, film,
                by_kind ? &by_kind->light : nullptr, by_group);
    if (direct_) show_reservoir(film, pixel, direct_->reservoir(pixel));
    film.show(Pass::REUSE_COUNT, pixel, Rgb(reuse_count(pixel)));
  });
}

void ReuseFrame::add_direct_light(const VisiblePoint& visible, uint32_t pixel, PathRecord& record, PixelLight* by_kind,
                                  std::span<Rgb> by_group) const {
  const float limit = context_.paths.limits.clamp_after(visible.state.depth + 1);
  const Rgb light = clamp_contribution(direct_->shade(visible, pixel), limit);
  record.add_left(light, {}, visible.is_caught);
  if (visible.is_caught) return;
  if (!by_group.empty() && !is_black(light))
    add_to_group(by_group, light_group_of(context_.paths, direct_->reservoir(pixel).sample.emitter), light);
  if (!by_kind || is_black(light)) return;
  if (is_first_vertex(visible)) {
    by_kind->light.add_direct(direct_->shares(visible, pixel) * light);
  } else {
    by_kind->light.add_indirect(by_kind->seen_shares * light);
  }
}

float ReuseFrame::reuse_count(uint32_t pixel) const {
  uint32_t count = direct_ ? direct_->reuse_count(pixel) : 0;
  if (secondary_) count += secondary_->reuse_count(pixel);
  if (paths_) count += paths_->reuse_count(pixel);
  return static_cast<float>(count);
}

void ReuseFrame::keep_history() {
  ++next_frame_;
  has_finished_frame_ = true;
  if (is_borrowing_) swap_history(*lender_);
  is_borrowing_ = false;
  source_.reset();
  if (direct_) direct_->keep_history();
  if (secondary_) secondary_->keep_history();
  if (paths_) paths_->keep_history();
  if (!context_.settings.uses_earlier_frames()) return;
  previous_visible_points_.resize(visible_points_.size());
  std::swap(previous_visible_points_, visible_points_);
}

size_t ReuseFrame::memory_bytes() const {
  const size_t points = visible_points_.capacity() + previous_visible_points_.capacity();
  return records_.capacity() * sizeof(PathRecord) + points * sizeof(VisiblePoint) +
         (direct_ ? direct_->memory_bytes() : 0) + (secondary_ ? secondary_->memory_bytes() : 0) +
         (paths_ ? paths_->memory_bytes() : 0) + kinds_.memory_bytes() + groups_.memory_bytes();
}

}  // namespace cistern
