#include "render/frame_trial.h"

namespace cistern {

FrameTrial::FrameTrial(const Region& region, uint32_t first, double cost)
    : first_(first),
      cost_(cost),
      width_(region.width),
      luminance_(static_cast<size_t>(region.width) * static_cast<size_t>(region.height)),
      noise_(region.width, region.height, kBoxOfDenoisers, COUNT) {}

void FrameTrial::add(int x, int y, float luminance) {
  luminance_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)] = luminance;
}

void FrameTrial::finish_frame(uint32_t frame) {
  if (!is_running(frame)) return;
  noise_.add_frame(tries(frame) ? TRIED : OTHER, luminance_);
  if (frame + 1 < end()) return;
  const std::vector<double> variances = noise_.variances();
  has_won_ = variances[TRIED] * cost_ < variances[OTHER];
  luminance_ = {};
}

}  // namespace cistern
