#include "film/pixel_filter.h"

#include <vector>

namespace cistern {
namespace {

/// Unnormalised filter value at x in [-1/2, 1/2] of its width.
double filter_value(FilterKind kind, double x) {
  const double pi = std::numbers::pi;
  switch (kind) {
    case FilterKind::BOX:
      return 1.0;
    case FilterKind::GAUSSIAN: {
      const double scaled = 6.0 * x;  // the width spans [-3, 3] of exp(-2 s^2)
      return std::exp(-2.0 * scaled * scaled);
    }
    case FilterKind::BLACKMAN_HARRIS: {
      const double v = 2.0 * pi * (x + 0.5);  // [Harris 1978], minimum four-term window
      return 0.35875 - 0.48829 * std::cos(v) + 0.14128 * std::cos(2.0 * v) - 0.01168 * std::cos(3.0 * v);
    }
  }
  return 1.0;
}

}  // namespace

PixelFilter::PixelFilter(FilterKind kind, float width) {
  constexpr int kSteps = 8192;
  std::vector<double> beyond(kSteps + 1, 0.0);  // integral from the edge inwards, over steps of equal length
  for (int i = 0; i < kSteps; ++i) beyond[i + 1] = beyond[i] + filter_value(kind, 0.5 - (i + 0.5) / (2 * kSteps));
  for (int entry = 0, step = 0; entry <= kTableSize; ++entry) {
    const double s = static_cast<double>(entry) / kTableSize, target = beyond[kSteps] * s * s;
    while (step < kSteps - 1 && beyond[step + 1] < target) ++step;
    const double inside = (target - beyond[step]) / (beyond[step + 1] - beyond[step]);
    distance_[entry] = static_cast<float>((0.5 - (step + inside) / (2 * kSteps)) * width);
  }
}

float PixelFilter::sample_axis(float u) const {
  const bool is_left = u < 0.5f;
  const float scaled = std::sqrt(2.0f * (is_left ? u : 1.0f - u)) * kTableSize;
  const int entry = std::min(static_cast<int>(scaled), kTableSize - 1);
  const float distance = lerp(distance_[entry], distance_[entry + 1], scaled - static_cast<float>(entry));
  return is_left ? -distance : distance;
}

}  // namespace cistern
