#include "render/noise_comparison.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/parallel.h"

namespace cistern {
namespace {

/// Boxes with the largest variances that do not count: fireflies decide nothing in so few frames.
constexpr double kLeftOut = 0.02;

}  // namespace

NoiseComparison::NoiseComparison(int width, int height, int box_size, size_t ways)
    : width_(static_cast<size_t>(width)),
      side_(static_cast<size_t>(box_size)),
      columns_(block_count(width_, side_)),
      sums_(columns_ * block_count(static_cast<size_t>(height), side_)),
      ways_(ways) {
  for (Way& way : ways_) way.boxes.resize(sums_.size());
}

void NoiseComparison::sum_boxes(std::span<const float> luminance) {
  std::ranges::fill(sums_, 0.0);
  for (size_t i = 0; i < luminance.size(); ++i) {
    const size_t x = i % width_, y = i / width_;
    if (std::isfinite(luminance[i])) sums_[y / side_ * columns_ + x / side_] += luminance[i];
  }
}

void NoiseComparison::add_frame(size_t way, std::span<const float> luminance) {
  sum_boxes(luminance);
  Way& w = ways_[way];
  ++w.frames;
  for (size_t i = 0; i < sums_.size(); ++i) {
    w.boxes[i].sum += sums_[i];
    w.boxes[i].sum_of_squares += sums_[i] * sums_[i];
  }
}

std::vector<double> NoiseComparison::variances() const {
  std::vector<double> means(sums_.size());  // by box, of all ways
  for (size_t i = 0; i < means.size(); ++i)
    for (const Way& way : ways_) means[i] += way.boxes[i].sum / way.frames / static_cast<double>(ways_.size());
  const double mean = std::reduce(means.begin(), means.end()) / static_cast<double>(means.size());
  const auto variance = [&](const Way& way, size_t box) {
    const Moments& m = way.boxes[box];
    const double own = m.sum / way.frames, scale = means[box] * means[box] + 0.01 * mean * mean;
    const double spread = (m.sum_of_squares / way.frames - own * own) * way.frames / (way.frames - 1.0);
    return scale > 0.0 ? std::max(spread, 0.0) / scale : 0.0;
  };
  struct Box {
    size_t index;
    double noise;
  };
  std::vector<Box> boxes;
  for (size_t i = 0; i < means.size(); ++i) {
    boxes.push_back({i, 0.0});
    for (const Way& way : ways_) boxes.back().noise += variance(way, i);
  }
  std::ranges::sort(boxes, {}, &Box::noise);
  boxes.resize(boxes.size() - static_cast<size_t>(std::ceil(kLeftOut * static_cast<double>(boxes.size()))));
  std::vector<double> sums;
  for (const Way& way : ways_) {
    double& sum = sums.emplace_back(0.0);
    for (const Box& box : boxes) sum += variance(way, box.index);
  }
  return sums;
}

}  // namespace cistern
