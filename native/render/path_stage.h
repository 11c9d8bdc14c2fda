#pragma once

#include "render/frame_run.h"
#include "render/pixel_kinds.h"
#include "render/render_history.h"
#include "restir/continuation_groups.h"
#include "restir/screen_space_paths.h"
#include "restir/world_space_paths.h"

namespace cistern {

/// Indirect light at visible points by path reservoirs, over the frames of a render.
class PathStage {
 public:
  virtual ~PathStage() = default;
  /// How many links of each path it wants captured.
  virtual int link_count() const = 0;
  /// See PathCapture.
  virtual bool leaves_deep_link() const { return false; }
  /// Sets what it wants of the path of a pixel (in the full frame), besides what `ask_for_light` does.
  virtual void ask(PathCapture& capture, uint32_t full_frame_pixel, uint32_t frame) const;
  virtual void start_pixel(const PathCapture& capture, uint32_t pixel) = 0;
  /// Path samples of a pixel, by link, while light can still be added to them.
  virtual std::array<PathSample*, kMaxPathLinks> samples(uint32_t pixel) = 0;
  /// Beside them, what their continuations are by light group; empty where paths split none.
  virtual std::array<std::span<Rgb>, kMaxPathLinks> continuation_groups(uint32_t pixel) = 0;
  /// All reuse; by pixel, `previous` as `visible` of the frame before or empty. False if stopped.
  virtual bool reuse(const FrameRun& run, std::span<const VisiblePoint> visible,
                     std::span<const VisiblePoint> previous) = 0;
  /// Radiance at the camera.
  virtual Rgb shade(const VisiblePoint& visible, uint32_t pixel) const = 0;
  /// The same, `shaded`, by kinds of scattering at a visible point that is the first vertex.
  virtual KindColors shade_by_kind(const VisiblePoint& visible, uint32_t pixel, Rgb shaded) const = 0;
  /// Adds `factor` times `shade` to light groups.
  virtual void shade_groups(const VisiblePoint& visible, uint32_t pixel, float factor, std::span<Rgb> sums) const = 0;
  /// The same without what other pixels found, where that is known too.
  virtual std::optional<Rgb> shade_alone(const VisiblePoint&, uint32_t) const { return std::nullopt; }
  /// Samples of other paths that the pixel was handed in the last frame.
  virtual uint32_t reuse_count(uint32_t pixel) const = 0;
  virtual void keep_history() = 0;
  /// Goes on with the history of a stage of the same kind, if light is as it was: the radiance that paths found is part
  /// of them. Else with its memory alone, or with what validation leaves of it.
  virtual void take_over(PathStage&& earlier, const HistorySource& source) = 0;
  /// Exchanges the reservoirs of the last frame, where drafts can_borrow_history.
  virtual void swap_history(PathStage&) {}
  /// Where these reservoirs come from; stays until keep_history.
  virtual void set_source(const HistorySource&) {}
  virtual size_t memory_bytes() const = 0;

  /// Adds `shade` to a record, where it is not null to light by kinds, and where it is not empty to light by groups.
  void add_to(const VisiblePoint& visible, uint32_t pixel, float clamp_indirect, PathRecord& record,
              PixelLight* by_kind, std::span<Rgb> by_group) const;

  /// Null for PATH.
  static std::unique_ptr<PathStage> make(const FrameContext& context);
};

}  // namespace cistern
