#pragma once

#include <optional>

#include "render/frame_trial.h"

namespace cistern {

/// Whether sharing is worth its time in this scene: the first frames try. Where visible points share, the noise of
/// boxes of 4 x 4 pixels decides, between what single pixels show and what a glance does; where next vertices alone
/// share, the picture goes to a denoiser, and its scale decides.
class SharingTrial {
 public:
  explicit SharingTrial(const Settings& settings);

  /// What a frame does. Asked of frames in order.
  bool shares(uint32_t frame) const {
    if (!trial_) return true;
    return is_running(frame) ? trial_->tries(frame) : trial_->has_won();
  }
  bool is_running(uint32_t frame) const { return trial_ && trial_->is_running(frame); }
  /// Whether a frame acts on what the trial found.
  bool is_decided(uint32_t frame) const { return trial_ && frame >= trial_->end(); }
  /// A pixel's luminance in the frame under way, while the trial runs; from any thread.
  void add(int x, int y, float luminance) { trial_->add(x, y, luminance); }
  void finish_frame(uint32_t frame) {
    if (trial_) trial_->finish_frame(frame);
  }

 private:
  std::optional<FrameTrial> trial_;
};

}  // namespace cistern
