#pragma once

#include <cstdint>
#include <vector>

#include "render/settings.h"

namespace cistern {

/// Whether sharing at next vertices alone, for pictures that go to a denoiser, is worth its time in this scene. The
/// first frames share in turn with frames that do not; the variance of either kind over boxes of pixels, the scale at
/// which a denoiser leaves noise, decides for the rest. A frame's kind depends on earlier frames alone, all are
/// unbiased and count alike, and no clock is asked: pictures stay unbiased and the same for each seed.
class SharingTrial {
 public:
  explicit SharingTrial(const Settings& settings);

  /// What a frame does. Asked of frames in order.
  bool shares(uint32_t frame) const { return frame < kFrames && is_tried_ ? frame % 2 == 0 : shares_; }
  bool is_running(uint32_t frame) const { return is_tried_ && frame < kFrames; }
  /// A pixel's luminance in the frame under way, while the trial runs. From one thread, in a fixed order.
  void add(int x, int y, float luminance) { sums_[box(x, y)] += luminance; }
  void finish_frame(uint32_t frame);

 private:
  static constexpr uint32_t kFrames = 16;
  static constexpr int kBoxSize = 8;  // pixels
  struct Moments {
    double sum = 0.0, sum_of_squares = 0.0;
  };

  size_t box(int x, int y) const {
    return static_cast<size_t>(y / kBoxSize) * static_cast<size_t>(columns_) + static_cast<size_t>(x / kBoxSize);
  }
  double variance(const std::vector<Moments>& boxes) const;

  bool is_tried_;
  bool shares_ = true;
  int columns_;
  std::vector<double> sums_;                  // by box, of the frame under way
  std::vector<Moments> shared_, not_shared_;  // by box, over frames
};

}  // namespace cistern
