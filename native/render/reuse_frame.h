#pragma once

#include "render/frame.h"
#include "restir/reservoir_direct_light.h"

namespace cistern {

/// Frames in which visible points share what they find: each is made in stages over the whole picture. Memory is
/// allocated with the first frame and reused.
class ReuseFrame {
 public:
  explicit ReuseFrame(const FrameContext& context);

  /// Adds one frame to the film; frames come in order. Does nothing to the film unless the last stage is reached, and
  /// pixels that stage does not reach when stopped early miss this frame. True if the frame was finished.
  bool render(uint32_t frame, Film& film, const StopCondition& stop);

  size_t memory_bytes() const;
  /// Weights that were not finite, so far; they counted as zero.
  uint64_t non_finite_weights() const { return non_finite_weights_; }

 private:
  struct Scratch;
  bool find_visible_points(uint32_t frame, const StopCondition& stop);
  bool reuse_in_time(uint32_t frame, const StopCondition& stop);
  bool reuse_in_space(uint32_t frame, const StopCondition& stop);
  bool shade(Film& film, const StopCondition& stop);
  void keep_history();
  template <class Body>
  bool for_pixels(const StopCondition& stop, const Body& body);

  FrameContext context_;
  ReservoirDirectLight direct_;
  int width_, height_;
  std::atomic<uint64_t> non_finite_weights_{0};
  // By pixel, of the frame in the making.
  std::vector<PathRecord> records_;
  std::vector<VisiblePoint> visible_points_;
  std::vector<LightReservoir> reservoirs_, reused_;
  LightHistory history_;
};

}  // namespace cistern
