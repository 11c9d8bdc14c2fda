#pragma once

#include <optional>
#include <span>
#include <vector>

#include "grid/nested_cell_index.h"

namespace cistern {

/// What a light cluster sent to the points of a cell, summed over light samples.
struct ClusterStatistics {
  NestedCellKey cell = kNoNestedCell;
  uint32_t cluster = 0;
  double visible = 0.0;          // sum of LightRecord::visible
  double visible_squares = 0.0;  // sum of its squares
  double unshadowed = 0.0;       // sum of LightRecord::unshadowed
  double squares = 0.0, squares_without = 0.0;
  bool has_part_of(const ClusterStatistics& other) const { return cluster == other.cluster; }
  ClusterStatistics& operator+=(const ClusterStatistics& other);
  friend auto operator<=>(const ClusterStatistics&,
                          const ClusterStatistics&) = default;  // NOLINT(modernize-use-nullptr)
};

/// For each cell of the world that has seen enough light, a probability of each light cluster. Immutable.
class LearnedLightTable {
 public:
  /// What is known of a cell: the clusters that matter there, with a probability of each.
  struct Row {
    uint32_t begin = 0, count = 0;       // of entries
    float entropy = 0.0f;                // of the shares of all clusters in the visible light, nats
    float effective_sample_size = 0.0f;  // of what it was learned from
    float other_visibility = 1.0f;       // of the light of clusters without an entry, see Entry::visibility
    int candidates = 1;                  // light samples that a point here had best weigh against each other
  };
  struct Entry {
    uint32_t cluster = 0;
    float pmf = 0.0f;
    float visibility = 1.0f;  // part of what the cluster would send unshadowed that arrives, at least kLeastVisibility
    float threshold = 1.0f;   // of the alias table: share of the column that keeps its own entry
    uint32_t alias = 0;       // entry of the row
  };

  LearnedLightTable() = default;
  /// `finest`: by cell, then cluster, each pair once; the cells are points' own. A cell gets a row from an effective
  /// sample size (sum of weights)^2 / (sum of squares) of `kLeastSampleSize` on [Kish 1965], four times over coarser
  /// cells of twice the edge.
  explicit LearnedLightTable(std::vector<ClusterStatistics> finest);

  static constexpr double kLeastSampleSize = 64.0;
  /// Clusters get an entry from this share of a cell's light on; what a cell has seen says little about fainter ones.
  static constexpr double kLeastShare = 1.0 / 128.0;
  static constexpr double kLeastVisibility = 0.05;

  /// The row of the finest cell around a point that has one, or null. `key` is the point's own cell.
  const Row* find(NestedCellKey key) const;
  /// An entry of a row by `u` in [0, 1), with its probability.
  const Entry& choose(const Row& row, double u) const;
  /// A row's entry for a cluster, or null.
  const Entry* find(const Row& row, uint32_t cluster) const;

  bool is_empty() const { return rows_.empty(); }
  size_t row_count() const { return rows_.size(); }
  size_t memory_bytes() const;

 private:
  std::optional<uint32_t> add_row(std::span<const ClusterStatistics> of_cell);

  std::vector<Row> rows_;
  std::vector<Entry> entries_;  // of a row side by side, by cluster
  NestedCellIndex index_;
};

}  // namespace cistern
