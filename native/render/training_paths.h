#pragma once

#include <algorithm>
#include <bit>

#include "base/rng.h"

namespace cistern {

/// Paths that leave records between two updates of what is learned, about: more teach ever less, and what learning
/// costs must not grow.
inline constexpr double kTrainingPaths = 1 << 19;

/// Whether the path of a pixel (of `pixels` in the region) leaves records in a frame. Updates come at powers of two,
/// and so the next one after as many frames as there were before the last one, at `updated_at`. These are of the
/// render: numbers of its frames may go on from those of earlier renders, for other random numbers.
inline bool is_training_path(uint64_t seed, uint32_t pixel, uint32_t frame, uint32_t stream, double pixels,
                             uint32_t updated_at) {
  const double share = kTrainingPaths / (pixels * std::max(updated_at, 1u));
  return share >= 1.0 || Rng(seed, pixel, frame, stream).next_double() < share;
}

/// Frames from one update to the next, from `frame` on.
inline uint32_t frames_to_next_update(uint32_t frame) { return frame == 0 ? 1 : 2 * std::bit_floor(frame) - frame; }

}  // namespace cistern
