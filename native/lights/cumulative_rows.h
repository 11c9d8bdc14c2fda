#pragma once

#include <cstddef>
#include <vector>

namespace cistern {

/// Cumulative probabilities of intervals in many rows, of which one interval is looked for in a few steps: rows are too
/// many to stay in a cache, so what counts is how often a search waits for memory. Every 64th sum is kept again, and
/// either kind is compared many at a time: two waits, where halving takes one for each step. 4.06 bytes per interval.
class CumulativeRows {
 public:
  CumulativeRows() = default;
  CumulativeRows(int intervals, int rows);

  /// Probabilities in proportion to `values`, not negative; even where all are 0. Returns their sum. From any thread,
  /// each row from one.
  double set_row(int row, const float* values);

  /// The interval, not empty, in which `u` of [0, 1) lies.
  int find(int row, float u) const;
  /// Sum of the probabilities before an interval, or with `interval` = their number of all: 0 to 1.
  float before(int row, int interval) const { return sums_[start(row) + static_cast<size_t>(interval)]; }
  float probability(int row, int interval) const { return before(row, interval + 1) - before(row, interval); }

  size_t memory_bytes() const { return (sums_.capacity() + coarse_.capacity()) * sizeof(float); }

 private:
  static constexpr int kStride = 64;

  size_t start(int row) const { return static_cast<size_t>(row) * static_cast<size_t>(intervals_ + 1); }
  size_t coarse_start(int row) const { return static_cast<size_t>(row) * static_cast<size_t>(coarse_count_); }

  int intervals_ = 0, coarse_count_ = 0;
  std::vector<float> sums_;    // intervals + 1 for each row
  std::vector<float> coarse_;  // of each row those with an index of 0, 64, 128, ...
};

}  // namespace cistern
