#include "render/sharing_trial.h"

#include <algorithm>

namespace cistern {
namespace {

/// Frames that share at next vertices take 1.7 to 2.2 times as long as those that do not (door ajar, Cornell box).
constexpr double kCost = 2.0;
/// Boxes with the largest variance that do not count: fireflies decide nothing in so few frames.
constexpr double kLeftOut = 0.02;

}  // namespace

SharingTrial::SharingTrial(const Settings& s)
    : is_tried_(s.path_sharing.visible.groups.size == 1 && s.path_sharing.deep.groups.size > 1 &&
                s.samples > static_cast<int>(kFrames)),
      columns_((s.region.width + kBoxSize - 1) / kBoxSize) {
  if (!is_tried_) return;
  const int rows = (s.region.height + kBoxSize - 1) / kBoxSize;
  sums_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows));
  shared_.resize(sums_.size());
  not_shared_.resize(sums_.size());
}

void SharingTrial::finish_frame(uint32_t frame) {
  if (!is_running(frame)) return;
  std::vector<Moments>& boxes = shares(frame) ? shared_ : not_shared_;
  for (size_t i = 0; i < sums_.size(); ++i) {
    boxes[i].sum += sums_[i];
    boxes[i].sum_of_squares += sums_[i] * sums_[i];
  }
  std::ranges::fill(sums_, 0.0);
  if (frame + 1 < kFrames) return;
  shares_ = variance(shared_) * kCost < variance(not_shared_);
  sums_ = {};
  shared_ = not_shared_ = {};
}

/// Mean over boxes of the relative variance of a frame; the regulariser is that of relative errors elsewhere.
double SharingTrial::variance(const std::vector<Moments>& boxes) const {
  constexpr double kCount = kFrames / 2;
  double mean = 0.0;
  for (size_t i = 0; i < boxes.size(); ++i) mean += (shared_[i].sum + not_shared_[i].sum) / kFrames;
  mean /= static_cast<double>(boxes.size());
  std::vector<double> relative;
  for (size_t i = 0; i < boxes.size(); ++i) {
    const double of_box = (shared_[i].sum + not_shared_[i].sum) / kFrames;
    const double own = boxes[i].sum / kCount;
    const double spread = (boxes[i].sum_of_squares / kCount - own * own) * kCount / (kCount - 1.0);
    const double scale = of_box * of_box + 0.01 * mean * mean;
    relative.push_back(scale > 0.0 ? std::max(spread, 0.0) / scale : 0.0);
  }
  std::ranges::sort(relative);
  relative.resize(relative.size() - static_cast<size_t>(kLeftOut * static_cast<double>(relative.size())));
  double sum = 0.0;
  for (const double v : relative) sum += v;
  return sum;
}

}  // namespace cistern
