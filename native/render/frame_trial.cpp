#include "render/frame_trial.h"

namespace cistern {
namespace {

/// By so much noise is yet to fall, at least: what learns gets better. (Guides, in boxes: in trials after 460,000 paths
/// 0.51 and 0.78 of the noise of others in both doors of the scoreboard; over all of 7.4 million, learning included,
/// 0.32 and 0.45.)
constexpr double kLater = 0.8;
/// Standard errors by which the way that is tried must be the worse one: rare light is what few frames do not show, and
/// then neither is surely better.
constexpr double kSure = 1.0;

}  // namespace

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
  const bool seems_worse = kLater * cost_ * variances[TRIED] > variances[OTHER];
  has_won_ = !(seems_worse && noise_.significance(TRIED, cost_, OTHER, 1.0) > kSure);
  luminance_ = {};
}

}  // namespace cistern
