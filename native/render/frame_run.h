#pragma once

#include "render/frame.h"
#include "render/stage_times.h"

namespace cistern {

/// One frame on its way through the stages of reuse.
struct FrameRun {
  const FrameContext& context;
  uint32_t frame;
  const StopCondition& stop;
  std::atomic<uint64_t>& non_finite_weights;
  StageTimes& stage_times;

  /// Calls body(pixel, non_finite) for all pixels of the region in parallel; false if stopped early.
  template <class Body>
  bool for_pixels(const Body& body) const {
    const Region& region = context.settings.region;
    return for_each_pixel<uint64_t>(
        region.width, region.height, stop,
        [&](int x, int y, uint64_t& non_finite) { body(static_cast<uint32_t>(y * region.width + x), non_finite); },
        [&](uint64_t non_finite) { non_finite_weights.fetch_add(non_finite, std::memory_order_relaxed); });
  }
};

/// Light at the vertices of a path that is left to reservoirs.
inline void ask_for_light(PathCapture& capture, const Settings& s) {
  capture.direct_candidates = uses_reservoirs(s.direct) ? static_cast<float>(s.direct_reuse.light_candidates) : 0.0f;
  capture.secondary_candidates =
      uses_reservoirs(s.secondary) ? static_cast<float>(s.secondary_reuse.light_candidates) : 0.0f;
}

/// The pixels of the region as restir/ wants them.
inline ImageRegion image_region(const Settings& s) {
  return {s.region.x, s.region.y, s.region.width, s.region.height, s.width, s.height};
}

}  // namespace cistern
