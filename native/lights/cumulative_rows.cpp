#include "lights/cumulative_rows.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <numeric>

namespace cistern {
namespace {

constexpr int kLanes = 8;

/// How many of `count` sums, which do not fall, are at most `u`. Reads up to the next multiple of eight.
int count_at_most(const float* sums, int count, float u) {
  int found = 0;
  for (int i = 0; i < count; i += kLanes) {
    const __m256 is_below = _mm256_cmp_ps(_mm256_loadu_ps(sums + i), _mm256_set1_ps(u), _CMP_LE_OQ);
    const unsigned lanes = static_cast<unsigned>(_mm256_movemask_ps(is_below));
    found += std::popcount(lanes & ((1u << std::min(count - i, kLanes)) - 1u));
  }
  return found;
}

}  // namespace

CumulativeRows::CumulativeRows(int intervals, int rows)
    : intervals_(intervals),
      coarse_count_((intervals + kStride - 1) / kStride),
      sums_(static_cast<size_t>(intervals + 1) * static_cast<size_t>(rows) + kLanes),
      coarse_(static_cast<size_t>(coarse_count_) * static_cast<size_t>(rows) + kLanes) {}

double CumulativeRows::set_row(int row, const float* values) {
  const double sum = std::accumulate(values, values + intervals_, 0.0);
  float* sums = &sums_[start(row)];
  double running = 0.0;
  sums[0] = 0.0f;
  for (int i = 0; i < intervals_; ++i) {
    running += values[i];
    sums[i + 1] = static_cast<float>(sum > 0.0 ? running / sum : static_cast<double>(i + 1) / intervals_);
  }
  sums[intervals_] = 1.0f;
  float* coarse = &coarse_[coarse_start(row)];
  for (size_t i = 0; i < static_cast<size_t>(coarse_count_); ++i) coarse[i] = sums[i * kStride];
  return sum;
}

int CumulativeRows::find(int row, float u) const {
  const float* coarse = &coarse_[coarse_start(row)];
  const int first = std::max(count_at_most(coarse, coarse_count_, u) - 1, 0) * kStride;
  const int others = std::min(kStride, intervals_ - first) - 1;
  return first + count_at_most(&sums_[start(row) + static_cast<size_t>(first) + 1], others, u);
}

}  // namespace cistern
