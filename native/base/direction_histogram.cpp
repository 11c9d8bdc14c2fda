#include "base/direction_histogram.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/sphere_map.h"

namespace cistern {
namespace {

constexpr int kSide = DirectionHistogram::kSide;

int coordinate(float u) { return std::clamp(static_cast<int>(u * kSide), 0, kSide - 1); }

/// The last of `kSide` steps that begins at `t` or before; begins do not fall, and the first is not above `t`. Where
/// `t` is below the end of all, that step is not empty.
int last_before(float t, const uint16_t* begins) {
  static_assert(kSide == 16);
  const __m256i steps = _mm256_load_si256(reinterpret_cast<const __m256i*>(begins));
  const __m256i most = _mm256_set1_epi16(static_cast<int16_t>(static_cast<uint16_t>(std::min(t, 65535.0f))));
  const __m256i is_before = _mm256_cmpeq_epi16(_mm256_min_epu16(steps, most), steps);
  return std::popcount(static_cast<uint32_t>(_mm256_movemask_epi8(is_before))) / 2 - 1;
}

/// Where `t` lies between two numbers, in [0, 1): so far below 1 that added to a step it does not round to the next.
float fraction(float t, float low, float high) {
  constexpr float kMost = 1.0f - 0x1p-20f;
  return std::clamp((t - low) / (high - low), 0.0f, kMost);
}

}  // namespace

DirectionHistogram::DirectionHistogram(std::span<const double, kBins> weights) {
  double sum = 0.0, before = 0.0;
  for (const double w : weights) sum += w;
  for (size_t i = 0; i < weights.size(); ++i) {
    begin_[i] = static_cast<uint16_t>(std::min(std::floor(before / sum * kUnits), kUnits - 1.0));
    before += weights[i];
  }
  for (size_t row = 0; row < row_begin_.size(); ++row) row_begin_[row] = begin_[row * kSide];
}

uint32_t DirectionHistogram::bin(const Vec3& w) {
  const Vec2 p = equal_area_point(w);
  return static_cast<uint32_t>(coordinate(p.y) * kSide + coordinate(p.x));
}

Vec3 DirectionHistogram::sample(Vec2 u) const {
  const float t_row = u.y * kUnits;
  const int row = last_before(t_row, row_begin_.data());
  const auto first = static_cast<uint32_t>(row * kSide);
  const auto low = static_cast<float>(begin_[first]), high = static_cast<float>(end(first + kSide - 1));
  const float t = std::min(low + u.x * (high - low), high * kOneMinusEpsilon);
  const int column = last_before(t, &begin_[first]);
  const uint32_t bin = first + static_cast<uint32_t>(column);
  const float across = fraction(t, begin_[bin], static_cast<float>(end(bin)));
  const float along = fraction(t_row, low, high);
  return equal_area_direction(
      {(static_cast<float>(column) + across) / kSide, (static_cast<float>(row) + along) / kSide});
}

}  // namespace cistern
