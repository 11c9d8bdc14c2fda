#pragma once

#include <atomic>
#include <chrono>

#include "render/settings.h"

namespace cistern {

/// Everything that stays the same over the frames of a render.
struct FrameContext {
  const Settings& settings;
  const PathContext& paths;
  const PixelFilter& filter;
};

/// When to leave a batch of frames early.
struct StopCondition {
  const std::atomic<bool>& cancelled;
  std::chrono::steady_clock::time_point deadline;

  bool deadline_passed() const { return std::chrono::steady_clock::now() >= deadline; }
};

/// Adds frames [first_frame, first_frame + count) to the film, in parallel over tiles on the calling thread's TBB
/// arena. The picture does not depend on the number of threads. Returns early, within milliseconds, once cancelled or
/// past the deadline; pixels then have different sample counts, which the film knows. True if all frames were finished.
bool render_frames(const FrameContext& context, uint32_t first_frame, uint32_t count, Film& film,
                   const StopCondition& stop);

}  // namespace cistern
