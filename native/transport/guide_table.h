#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/direction_histogram.h"
#include "grid/nested_cell_index.h"

namespace cistern {

/// What a direction brought to a point: one term of an estimate of the light that its rough lobes reflect from there.
struct GuideRecord {
  NestedCellKey cell = kNoNestedCell;  // the point's own
  uint32_t bin = 0;                    // of DirectionHistogram
  /// Luminance reflected, over albedo and the density of the direction; above 0. Less what light samples account for:
  /// the weight of multiple importance sampling is in it, since that much is left to find.
  float light = 0.0f;
};

/// Sums over the records of a cell and bin.
struct GuideStatistics {
  NestedCellKey cell = kNoNestedCell;
  uint32_t bin = 0;
  double light = 0.0, squares = 0.0;
  bool has_part_of(const GuideStatistics& other) const { return bin == other.bin; }
  GuideStatistics& operator+=(const GuideStatistics& other) {
    light += other.light;
    squares += other.squares;
    return *this;
  }
  friend auto operator<=>(const GuideStatistics&, const GuideStatistics&) = default;  // NOLINT(modernize-use-nullptr)
};

/// For each cell of the world that has seen enough light, a density of directions in proportion to what they brought.
/// Immutable.
class GuideTable {
 public:
  GuideTable() = default;
  /// `finest`: by cell, then bin, each pair once; the cells are points' own. A cell gets a row from an effective sample
  /// size of `kLeastSampleSize` on [Kish 1965]: fewer samples that seem even would guide away from what they missed.
  explicit GuideTable(std::vector<GuideStatistics> finest);

  static constexpr double kLeastSampleSize = 128.0;

  /// To be called some time before `find`, for speed alone.
  void prefetch(NestedCellKey key) const { index_.prefetch(key); }
  /// Of the finest cell around a point that has a row, or null. `key` is the point's own cell.
  const DirectionHistogram* find(NestedCellKey key) const;

  bool is_empty() const { return rows_.empty(); }
  size_t row_count() const { return rows_.size(); }
  size_t memory_bytes() const { return rows_.capacity() * sizeof(DirectionHistogram) + index_.memory_bytes(); }

 private:
  std::optional<uint32_t> add_row(std::span<const GuideStatistics> of_cell);

  std::vector<DirectionHistogram> rows_;
  NestedCellIndex index_;
};

}  // namespace cistern
