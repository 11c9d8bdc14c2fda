#include "render/path_stage.h"

#include <algorithm>

#include "render/cell_layout.h"
#include "render/cell_shared_stage.h"

namespace cistern {
namespace {

/// Names of stages, see StageTimes.
constexpr const char *kTemporalReuse = "Paths: temporal reuse", *kSpatialReuse = "Paths: spatial reuse";

size_t pixel_count(const FrameContext& context) {
  const Region& region = context.settings.region;
  return static_cast<size_t>(region.width) * static_cast<size_t>(region.height);
}

/// Whether what paths find depends on how often they have bounced: some lamp stops shining before they end, or some
/// material asks.
bool bounces_are_counted(const PathContext& context) {
  const auto is_counting_lamp = [&](const Light& light) {
    return !light.removed && light.max_bounces <= std::min(context.limits.max_bounces, Light().max_bounces - 1);
  };
  return std::ranges::any_of(context.scene.lights, is_counting_lamp) ||
         std::ranges::any_of(context.scene.materials,
                             [](const auto& material) { return material && material->counts_bounces; });
}

class ScreenPathStage final : public PathStage {
 public:
  explicit ScreenPathStage(const FrameContext& context)
      : context_(context),
        paths_(context.paths, context.settings.screen_paths, image_region(context.settings), context.settings.seed) {
    resize(current_);
    reuse_counts_.resize(pixel_count(context));
    groups_.resize(context.paths, pixel_count(context));
  }

  int link_count() const override { return 1; }
  void ask(PathCapture& capture, uint32_t full_frame_pixel, uint32_t frame) const override {
    PathStage::ask(capture, full_frame_pixel, frame);
    const ScreenPathReuse& reuse = context_.settings.screen_paths;
    // What counts as a kind of scattering is the choice of BSDF sampling.
    capture.rough_sampling = context_.paths.tells_kinds ? RoughSampling::BSDF : reuse.source;
    capture.going_on_probability = reuse.multi_bounce_share;
    capture.goes_on = paths_.goes_on(full_frame_pixel, frame);
  }
  void start_pixel(const PathCapture& capture, uint32_t pixel) override {
    current_.temporal[pixel] = ScreenSpacePaths::initial_sample(capture.links[0]);
    groups_.start(pixel, current_.temporal[pixel].sample, capture.continuation_by_group[0]);
    reuse_counts_[pixel] = 0;
  }
  std::array<PathSample*, kMaxPathLinks> samples(uint32_t pixel) override {
    return {&current_.temporal[pixel].sample, nullptr};
  }
  std::array<std::span<Rgb>, kMaxPathLinks> continuation_groups(uint32_t pixel) override {
    return {groups_.found(pixel), {}};
  }

  bool reuse(const FrameRun& run, std::span<const VisiblePoint> visible,
             std::span<const VisiblePoint> previous) override {
    if (run.frame >= cameras_.size()) cameras_.resize(run.frame + 1);
    cameras_[run.frame] = context_.paths.scene.camera;  // again for a frame that was cancelled
    if (must_validate_ || is_validation_frame(run.frame)) {
      if (!drop_invalid(run, must_validate_ ? Nulls::DROP : Nulls::KEEP)) return false;
      must_validate_ = false;
      run.stage_times.lap("Paths: validation");
    }
    current_.visible_points = visible;
    previous_.visible_points = previous_.temporal.empty() ? std::span<const VisiblePoint>() : previous;
    bool done = run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
      if (!visible[pixel].exists) return;
      if (validates()) current_.temporal[pixel].sample.origin = {full_frame_pixel_of(pixel), run.frame};
      const PathReservoir found = paths_.keep_one_direction(visible[pixel], current_.temporal[pixel], pixel, run.frame);
      current_.temporal[pixel] =
          paths_.reuse_in_time(visible[pixel], found, previous_, pixel, run.frame, non_finite, reuse_counts_[pixel]);
    });
    run.stage_times.lap(kTemporalReuse);
    done = done && run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
      current_.spatial[pixel] = visible[pixel].exists ? paths_.reuse_in_space(current_, previous_, pixel, run.frame,
                                                                              non_finite, reuse_counts_[pixel])
                                                      : PathReservoir{};
    });
    run.stage_times.lap(kSpatialReuse);
    return done;
  }

  Rgb shade(const VisiblePoint& visible, uint32_t pixel) const override {
    return paths_.shade(visible, current_.spatial[pixel]);
  }
  KindColors shade_by_kind(const VisiblePoint& visible, uint32_t pixel, Rgb shaded) const override {
    return is_black(shaded) ? KindColors() : paths_.shares(visible, current_.spatial[pixel]) * shaded;
  }
  void shade_groups(const VisiblePoint& visible, uint32_t pixel, float factor, std::span<Rgb> sums) const override {
    const PathReservoir& shown = current_.spatial[pixel];
    if (shown.W > 0.0f) paths_.add_groups(visible, shown, groups_.of(shown.sample), factor, sums);
  }
  uint32_t reuse_count(uint32_t pixel) const override { return reuse_counts_[pixel]; }

  void keep_history() override {
    if (!context_.settings.screen_paths.temporal_reuse) return;
    groups_.keep({current_.temporal, current_.spatial});
    current_.view = {context_.paths.scene.camera, image_region(context_.settings)};
    std::swap(current_, previous_);
    resize(current_);
  }

  void take_over(PathStage&& earlier, const HistorySource& source) override {
    auto& stage = static_cast<ScreenPathStage&>(earlier);
    std::swap(current_, stage.current_);
    std::swap(previous_, stage.previous_);
    resize(current_);
    previous_.view = source.view();
    cameras_ = std::move(stage.cameras_);
    groups_ = std::move(stage.groups_);
    groups_.resize(context_.paths, pixel_count(context_));
    if (!source.earlier() && !stage.must_validate_) return;
    must_validate_ = validates() && previous_.temporal.size() == pixel_count(context_);
    if (must_validate_) return;
    previous_.temporal.clear();
    previous_.spatial.clear();
  }

  size_t memory_bytes() const override {
    const auto count = [](const PathFrame& f) { return f.temporal.capacity() + f.spatial.capacity(); };
    return (count(current_) + count(previous_)) * sizeof(PathReservoir) + cameras_.capacity() * sizeof(Camera) +
           reuse_counts_.capacity() * sizeof(uint32_t) + groups_.memory_bytes();
  }

 private:
  void resize(PathFrame& frame) const {
    frame.temporal.resize(pixel_count(context_));
    frame.spatial.resize(pixel_count(context_));
  }

  struct Replay {
    PathScratch scratch;
    PathCapture capture;
  };

  /// Light that reservoirs brought to a sample point is no part of its path, and what is learned of lights changes; of
  /// light groups, nothing is found again.
  bool validates() const {
    const Settings& s = context_.settings;
    return context_.paths.light_groups == 0 && s.screen_paths.validation_frames > 0 &&
           s.secondary == SecondaryAnswer::NEE && !context_.paths.learned && !context_.paths.guiding;
  }
  bool is_validation_frame(uint32_t frame) const {
    return validates() && (frame + 1) % static_cast<uint32_t>(context_.settings.screen_paths.validation_frames) == 0;
  }
  uint32_t full_frame_pixel_of(uint32_t pixel) const {
    const Settings& s = context_.settings;
    const auto width = static_cast<uint32_t>(s.region.width);
    return full_frame_pixel(s, static_cast<int>(pixel % width), static_cast<int>(pixel / width));
  }

  /// Reservoirs that found nothing hold no path to trace again.
  enum class Nulls { KEEP, DROP };
  bool drop_invalid(const FrameRun& run, Nulls nulls) {
    if (previous_.temporal.size() != pixel_count(context_)) return true;  // none, or of a picture of another size
    const auto is_invalid = [&](const PathReservoir& reservoir, Replay& replay) {
      if (!(reservoir.W > 0.0f)) return nulls == Nulls::DROP;
      return !still_holds(reservoir.sample, trace_again(reservoir.sample.origin, replay));
    };
    const Region& region = context_.settings.region;
    const auto validate_pixel = [&](int x, int y, Replay& replay) {
      const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(region.width) + static_cast<size_t>(x);
      for (PathReservoir* reservoir : {&previous_.temporal[pixel], &previous_.spatial[pixel]})
        if (is_invalid(*reservoir, replay)) *reservoir = {};
    };
    return for_each_pixel<Replay>(region.width, region.height, run.stop, validate_pixel, [](const Replay&) {});
  }

  const PathLink& trace_again(PathOrigin origin, Replay& replay) const {
    const Settings& s = context_.settings;
    const auto width = static_cast<uint32_t>(s.width);
    const int x = static_cast<int>(origin.pixel % width) - s.region.x;
    const int y = static_cast<int>(origin.pixel / width) - s.region.y;
    PathSampler sampler(s.seed, origin.pixel, origin.frame, s.sequence);
    const Ray ray = sample_camera_ray(context_, cameras_[origin.frame], x, y, sampler, replay.scratch);
    ask_for_light(replay.capture, s);
    ask(replay.capture, origin.pixel, origin.frame);
    trace_path(context_.paths, ray, sampler, replay.scratch, &replay.capture);
    return replay.capture.links[0];
  }

  const FrameContext& context_;
  ScreenSpacePaths paths_;
  PathFrame current_, previous_;
  ContinuationGroups groups_;
  LazyVector<uint32_t> reuse_counts_;  // by pixel
  std::vector<Camera> cameras_;        // by frame
  bool must_validate_ = false;         // light has changed since the history was found
};

class WorldPathStage final : public PathStage {
 public:
  explicit WorldPathStage(const FrameContext& context)
      : context_(context),
        paths_(context.paths, context.settings.world_paths, image_region(context.settings), context.settings.seed),
        link_count_(context.settings.world_paths.deep_points && !bounces_are_counted(context.paths) ? 2 : 1) {
    resize(current_);
    spatial_.resize(pixel_count(context));
    reuse_counts_.resize(pixel_count(context));
    keys_.resize(current_.reservoirs.size());
    groups_.resize(context.paths, current_.reservoirs.size());
  }

  /// Second links lie a bounce deeper than those of visible points: what counts bounces would give them other light.
  int link_count() const override { return link_count_; }
  void start_pixel(const PathCapture& capture, uint32_t pixel) override {
    reuse_counts_[pixel] = 0;
    const size_t entry = 2 * size_t{pixel};
    const bool has_deep_vertex = link_count_ > 1 && capture.links[0].W > 0.0f;
    current_.deep_points[pixel] = has_deep_vertex ? capture.links[1].from : VisiblePoint{};
    current_.reservoirs[entry] = WorldSpacePaths::initial_sample(capture.links[0]);
    current_.reservoirs[entry + 1] = WorldSpacePaths::initial_sample(capture.links[1]);
    for (size_t link = 0; link < kMaxPathLinks; ++link)
      groups_.start(entry + link, current_.reservoirs[entry + link].sample, capture.continuation_by_group[link]);
  }
  std::array<PathSample*, kMaxPathLinks> samples(uint32_t pixel) override {
    const size_t entry = 2 * size_t{pixel};
    return {&current_.reservoirs[entry].sample, &current_.reservoirs[entry + 1].sample};
  }
  std::array<std::span<Rgb>, kMaxPathLinks> continuation_groups(uint32_t pixel) override {
    const size_t entry = 2 * size_t{pixel};
    return {groups_.found(entry), groups_.found(entry + 1)};
  }

  bool reuse(const FrameRun& run, std::span<const VisiblePoint> visible,
             std::span<const VisiblePoint> previous) override {
    current_.visible_points = visible;
    previous_.visible_points = previous_.reservoirs.empty() ? std::span<const VisiblePoint>() : previous;
    current_.layout = cell_layout(context_, run.frame);
    const bool done = run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
      const size_t entry = 2 * size_t{pixel};
      for (const size_t i : {entry, entry + 1}) {
        const VisiblePoint& point = current_.point(i);
        keys_[i] = paths_.key(current_.layout, point, pixel, run.frame, i != entry);
        current_.reservoirs[i] = paths_.keep_one_direction(point, current_.reservoirs[i], pixel, run.frame, i != entry);
      }
      if (visible[pixel].exists)
        current_.reservoirs[entry] = paths_.reuse_in_time(visible[pixel], current_.reservoirs[entry], previous_, pixel,
                                                          run.frame, non_finite, reuse_counts_[pixel]);
    });
    run.stage_times.lap(kTemporalReuse);
    if (!done) return false;
    current_.cells.build(keys_);
    run.stage_times.lap("Paths: grid");
    const bool spatial_done = run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
      spatial_[pixel] = visible[pixel].exists
                            ? paths_.reuse_in_cells(visible[pixel], current_.reservoirs[2 * size_t{pixel}], previous_,
                                                    pixel, run.frame, non_finite, reuse_counts_[pixel])
                            : PathReference{};
    });
    run.stage_times.lap(kSpatialReuse);
    return spatial_done;
  }

  Rgb shade(const VisiblePoint& visible, uint32_t pixel) const override {
    return paths_.shade(visible, spatial_[pixel]);
  }
  KindColors shade_by_kind(const VisiblePoint& visible, uint32_t pixel, Rgb shaded) const override {
    return is_black(shaded) ? KindColors() : paths_.shares(visible, spatial_[pixel]) * shaded;
  }
  void shade_groups(const VisiblePoint& visible, uint32_t pixel, float factor, std::span<Rgb> sums) const override {
    const PathReference& shown = spatial_[pixel];
    if (shown.W > 0.0f) paths_.add_groups(visible, shown, groups_.of(*shown.sample), factor, sums);
  }
  uint32_t reuse_count(uint32_t pixel) const override { return reuse_counts_[pixel]; }

  void keep_history() override {
    groups_.keep({current_.reservoirs});
    current_.view = {context_.paths.scene.camera, image_region(context_.settings)};
    std::swap(current_, previous_);
    resize(current_);
  }

  void take_over(PathStage&& earlier, const HistorySource& source) override {
    auto& stage = static_cast<WorldPathStage&>(earlier);
    groups_ = std::move(stage.groups_);
    groups_.resize(context_.paths, 2 * pixel_count(context_));
    std::swap(current_, stage.current_);
    std::swap(previous_, stage.previous_);
    std::swap(spatial_, stage.spatial_);
    std::swap(keys_, stage.keys_);
    resize(current_);
    spatial_.resize(pixel_count(context_));
    keys_.resize(current_.reservoirs.size());
    previous_.view = source.view();
    if (source.earlier()) previous_.reservoirs.clear();
  }

  size_t memory_bytes() const override {
    const auto bytes = [](const PathCells& c) {
      return c.deep_points.capacity() * sizeof(VisiblePoint) + c.reservoirs.capacity() * sizeof(PathReservoir) +
             c.cells.memory_bytes();
    };
    return bytes(current_) + bytes(previous_) + spatial_.capacity() * sizeof(PathReference) +
           keys_.capacity() * sizeof(CellKey) + reuse_counts_.capacity() * sizeof(uint32_t) + groups_.memory_bytes();
  }

 private:
  void resize(PathCells& cells) const {
    cells.deep_points.resize(pixel_count(context_));
    cells.reservoirs.resize(2 * pixel_count(context_));
  }

  const FrameContext& context_;
  WorldSpacePaths paths_;
  int link_count_;
  PathCells current_, previous_;
  ContinuationGroups groups_;
  LazyVector<PathReference> spatial_;  // by pixel, into the reservoirs of both frames
  LazyVector<uint32_t> reuse_counts_;  // by pixel
  LazyVector<CellKey> keys_;           // by entry
};

}  // namespace

void PathStage::add_to(const VisiblePoint& visible, uint32_t pixel, float clamp_indirect, PathRecord& record,
                       PixelLight* by_kind, std::span<Rgb> by_group) const {
  const Rgb shaded = shade(visible, pixel), reflected = clamp_contribution(shaded, clamp_indirect);
  record.add_left({}, reflected, visible.is_caught);
  if (!by_group.empty() && !visible.is_caught)
    shade_groups(visible, pixel, clamp_factor(shaded, clamp_indirect), by_group);
  if (by_kind && !visible.is_caught)
    by_kind->light.add_indirect(is_first_vertex(visible)
                                    ? shade_by_kind(visible, pixel, shaded) * Rgb(clamp_factor(shaded, clamp_indirect))
                                    : by_kind->seen_shares * reflected);
  if (const std::optional<Rgb> alone = shade_alone(visible, pixel))
    record.shared = reflected - clamp_contribution(*alone, clamp_indirect);
}

void PathStage::ask(PathCapture& capture, uint32_t, uint32_t) const {
  capture.link_count = link_count();
  capture.leaves_deep_link = leaves_deep_link();
}

std::unique_ptr<PathStage> PathStage::make(const FrameContext& context) {
  switch (context.settings.indirect) {
    case IndirectAnswer::PATH:
      return nullptr;
    case IndirectAnswer::SCREEN_REUSE:
      return std::make_unique<ScreenPathStage>(context);
    case IndirectAnswer::WORLD_REUSE:
      return std::make_unique<WorldPathStage>(context);
    case IndirectAnswer::CELL_SHARED: {
      auto stage = std::make_unique<CellSharedStage>(context);
      stage->set_region(context.settings.region);
      return stage;
    }
  }
  return nullptr;
}

}  // namespace cistern
