#include "render/frame_trial.h"

#include <algorithm>
#include <cmath>

namespace cistern {
namespace {

/// Boxes with the largest variances that do not count: fireflies decide nothing in so few frames.
constexpr double kLeftOut = 0.02;

}  // namespace

FrameTrial::FrameTrial(const Region& region, uint32_t first, double cost, int box_size)
    : first_(first),
      cost_(cost),
      box_size_(box_size),
      width_(region.width),
      columns_((region.width + box_size - 1) / box_size) {
  const int rows = (region.height + box_size - 1) / box_size;
  luminance_.resize(static_cast<size_t>(region.width) * static_cast<size_t>(region.height));
  sums_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows));
  tried_.resize(sums_.size());
  other_.resize(sums_.size());
}

void FrameTrial::add(int x, int y, float luminance) {
  const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  luminance_[pixel] = std::isfinite(luminance) ? luminance : 0.0f;
}

/// In the order of pixels, whoever added them.
void FrameTrial::sum_boxes() {
  std::ranges::fill(sums_, 0.0);
  for (size_t i = 0; i < luminance_.size(); ++i) {
    const size_t x = i % static_cast<size_t>(width_), y = i / static_cast<size_t>(width_);
    const auto side = static_cast<size_t>(box_size_);
    sums_[y / side * static_cast<size_t>(columns_) + x / side] += luminance_[i];
  }
}

void FrameTrial::finish_frame(uint32_t frame) {
  if (!is_running(frame)) return;
  sum_boxes();
  std::vector<Moments>& boxes = tries(frame) ? tried_ : other_;
  for (size_t i = 0; i < sums_.size(); ++i) {
    boxes[i].sum += sums_[i];
    boxes[i].sum_of_squares += sums_[i] * sums_[i];
  }
  if (frame + 1 < end()) return;
  has_won_ = decide();
  luminance_ = {};
  sums_ = {};
  tried_ = other_ = {};
}

/// By sums over boxes of the relative variance of a frame; the regulariser is that of relative errors elsewhere.
bool FrameTrial::decide() const {
  constexpr double kCount = kFrames / 2;
  double mean = 0.0;
  for (size_t i = 0; i < tried_.size(); ++i) mean += (tried_[i].sum + other_[i].sum) / kFrames;
  mean /= static_cast<double>(tried_.size());
  struct Variances {
    double tried, other;
  };
  std::vector<Variances> boxes;
  for (size_t i = 0; i < tried_.size(); ++i) {
    const double of_box = (tried_[i].sum + other_[i].sum) / kFrames;
    const double scale = of_box * of_box + 0.01 * mean * mean;
    const auto relative = [scale](const Moments& m) {
      const double own = m.sum / kCount;
      const double spread = (m.sum_of_squares / kCount - own * own) * kCount / (kCount - 1.0);
      return scale > 0.0 ? std::max(spread, 0.0) / scale : 0.0;
    };
    boxes.push_back({relative(tried_[i]), relative(other_[i])});
  }
  std::ranges::sort(boxes, {}, [](const Variances& v) { return v.tried + v.other; });
  boxes.resize(boxes.size() - static_cast<size_t>(kLeftOut * static_cast<double>(boxes.size())));
  double tried = 0.0, other = 0.0;
  for (const Variances& v : boxes) {
    tried += v.tried;
    other += v.other;
  }
  return tried * cost_ < other;
}

}  // namespace cistern
