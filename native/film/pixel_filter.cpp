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
  std::vector<double> cdf(kSteps + 1, 0.0);
  for (int i = 0; i < kSteps; ++i) cdf[i + 1] = cdf[i] + filter_value(kind, (i + 0.5) / kSteps - 0.5);
  for (int entry = 0, step = 0; entry <= kTableSize; ++entry) {
    const double target = cdf[kSteps] * entry / kTableSize;
    while (step < kSteps - 1 && cdf[step + 1] < target) ++step;
    const double inside = (target - cdf[step]) / (cdf[step + 1] - cdf[step]);
    inverse_cdf_[entry] = static_cast<float>(((step + inside) / kSteps - 0.5) * width);
  }
}

float PixelFilter::sample_axis(float u) const {
  const float scaled = u * kTableSize;
  const int entry = std::min(static_cast<int>(scaled), kTableSize - 1);
  return lerp(inverse_cdf_[entry], inverse_cdf_[entry + 1], scaled - static_cast<float>(entry));
}

}  // namespace cistern
