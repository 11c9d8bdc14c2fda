#pragma once

#include "render/noise_comparison.h"
#include "render/settings.h"

namespace cistern {

/// Pixels of the boxes whose noise is compared: the scale at which a denoiser leaves noise.
inline constexpr int kBoxOfDenoisers = 8;

/// Whether a way to make frames that costs more is worth it in this scene. Some frames are made so in turn with frames
/// that are not; the variance of either kind decides for the rest: they are made so too unless that is surely not worth
/// it. A frame's kind depends on earlier frames alone, whose random numbers it does not share (FrameSequences): so
/// whatever was decided, its expectation is the picture. All frames count alike, and no clock is asked: with a given
/// number of samples pictures stay unbiased, and the same for each seed.
class FrameTrial {
 public:
  static constexpr uint32_t kFrames = 8;

  /// Over frames [first, first + kFrames). `cost`: CPU time of the frames tried, over that of the others.
  FrameTrial(const Region& region, uint32_t first, double cost);

  bool is_running(uint32_t frame) const { return frame >= first_ && frame < first_ + kFrames; }
  uint32_t first() const { return first_; }
  uint32_t end() const { return first_ + kFrames; }
  /// Of the frames of the trial: whether this one is made the way that is tried.
  bool tries(uint32_t frame) const { return (frame - first_) % 2 == 0; }
  /// A pixel's luminance in the frame under way; of each pixel once, from any thread.
  void add(int x, int y, float luminance);
  void finish_frame(uint32_t frame);
  /// After the trial.
  bool has_won() const { return has_won_; }

 private:
  enum Way : size_t { OTHER, TRIED, COUNT };

  uint32_t first_;
  double cost_;
  int width_;
  bool has_won_ = true;
  std::vector<float> luminance_;  // by pixel, of the frame under way
  NoiseComparison noise_;
};

}  // namespace cistern
