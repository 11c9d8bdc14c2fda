#include "base/direction_histogram.h"

#include <algorithm>
#include <cmath>

#include "base/sphere_map.h"

namespace cistern {
namespace {

constexpr int kSide = DirectionHistogram::kSide;

int coordinate(float u) { return std::clamp(static_cast<int>(u * kSide), 0, kSide - 1); }

/// The last of `kSide` steps that begins at `t` or before; begins do not fall. Where `t` is below the end of all, that
/// step is not empty.
template <class Begin>
int last_before(float t, const Begin& begin) {
  int step = 0;
  for (int half = kSide / 2; half > 0; half /= 2)
    if (static_cast<float>(begin(step + half)) <= t) step += half;
  return step;
}

/// Where `t` lies between two numbers, in [0, 1).
float fraction(float t, float low, float high) { return std::clamp((t - low) / (high - low), 0.0f, kOneMinusEpsilon); }

}  // namespace

DirectionHistogram::DirectionHistogram(std::span<const double, kBins> weights) {
  double sum = 0.0, before = 0.0;
  for (const double w : weights) sum += w;
  for (size_t i = 0; i < weights.size(); ++i) {
    begin_[i] = static_cast<uint16_t>(std::min(std::floor(before / sum * kUnits), kUnits - 1.0));
    before += weights[i];
  }
}

uint32_t DirectionHistogram::bin(const Vec3& w) {
  const Vec2 p = equal_area_point(w);
  return static_cast<uint32_t>(coordinate(p.y) * kSide + coordinate(p.x));
}

Vec3 DirectionHistogram::sample(Vec2 u) const {
  const float t_row = u.y * kUnits;
  const int row = last_before(t_row, [this](int r) { return begin_[static_cast<size_t>(r * kSide)]; });
  const auto first = static_cast<uint32_t>(row * kSide);
  const auto low = static_cast<float>(begin_[first]), high = static_cast<float>(end(first + kSide - 1));
  const float t = low + u.x * (high - low);
  const int column = last_before(t, [&](int c) { return begin_[first + static_cast<uint32_t>(c)]; });
  const uint32_t bin = first + static_cast<uint32_t>(column);
  const float across = fraction(t, begin_[bin], static_cast<float>(end(bin)));
  const float along = fraction(t_row, low, high);
  return equal_area_direction(
      {(static_cast<float>(column) + across) / kSide, (static_cast<float>(row) + along) / kSide});
}

}  // namespace cistern
