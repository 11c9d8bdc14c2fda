#pragma once

#include "render/frame_run.h"
#include "render/render_history.h"
#include "restir/cached_light_reservoirs.h"

namespace cistern {

/// Direct light at visible points by reservoirs, over the frames of a render.
class DirectStage {
 public:
  DirectStage(const FrameContext& context, std::shared_ptr<const LightCacheCells> cache_cells,
              std::function<void(float)> report_caching);

  /// Goes on with the history of another render, and with its memory. `source` stays until keep_history.
  void take_over(DirectStage&& earlier, const HistorySource& source);
  /// Exchanges the reservoirs of the last frame, and nothing else.
  void swap_history(DirectStage& other) { std::swap(history_.reservoirs, other.history_.reservoirs); }
  /// Where these reservoirs come from; stays until keep_history.
  void set_source(const HistorySource& source);
  /// A pixel's own light candidates, as soon as its visible point is known.
  void start_pixel(const VisiblePoint& visible, uint32_t pixel, uint32_t frame, uint64_t& non_finite);
  /// All reuse; by pixel, `previous` as `visible` of the frame before or empty. False if stopped.
  bool reuse(const FrameRun& run, std::span<const VisiblePoint> visible, std::span<const VisiblePoint> previous);
  /// Radiance at the camera.
  Rgb shade(const VisiblePoint& visible, uint32_t pixel) const { return direct_.shade(visible, reservoirs_[pixel]); }
  /// Shares that kinds of scattering have in it; asked for where it is not black.
  KindColors shares(const VisiblePoint& visible, uint32_t pixel) const {
    return direct_.shares(visible, reservoirs_[pixel]);
  }
  const LightReservoir& reservoir(uint32_t pixel) const { return reservoirs_[pixel]; }
  /// Of other points, merged into that one.
  uint32_t reuse_count(uint32_t pixel) const { return reuse_counts_[pixel]; }
  void keep_history();
  /// The cells that reservoirs came from, or null.
  const CachedLightReservoirs* cache() const { return cached_ ? &*cached_ : nullptr; }
  uint64_t cache_non_finite_weights() const { return cached_ ? cached_->cache().non_finite_weights() : 0; }
  size_t memory_bytes() const;

 private:
  bool merge_cache(const FrameRun& run, std::span<const VisiblePoint> visible);
  bool reuse_in_time(const FrameRun& run, std::span<const VisiblePoint> visible);
  bool reuse_in_space(const FrameRun& run, std::span<const VisiblePoint> visible);

  const FrameContext& context_;
  std::function<void(float)> report_caching_;
  ReservoirDirectLight direct_;
  std::optional<CachedLightReservoirs> cached_;
  LazyVector<LightReservoir> reservoirs_, scratch_;  // by pixel
  LazyVector<uint32_t> reuse_counts_;                // by pixel
  bool is_first_frame_ = true;
  LightHistory history_;
};

}  // namespace cistern
