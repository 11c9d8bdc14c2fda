#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace cistern {

/// Draws an index in constant time with probability proportional to a weight. Built in one deterministic pass.
/// [Walker 1977; Vose 1991, A Linear Algorithm for Generating Random Numbers with a Given Distribution]
class AliasTable {
 public:
  AliasTable() = default;
  /// Weights are finite and not negative. With a sum of zero (or no weights) the table is empty.
  explicit AliasTable(std::span<const float> weights);

  bool is_empty() const { return entries_.empty(); }
  size_t size() const { return entries_.size(); }

  /// Index drawn by `u` in [0, 1). The table must not be empty. The column takes log2(size) bits of `u`, what is left
  /// decides between the two indices in it: a float would leave too few where there are 10^5 of them or more.
  uint32_t sample(double u) const {
    const double scaled = u * static_cast<double>(entries_.size());
    const auto column = std::min(static_cast<uint32_t>(scaled), static_cast<uint32_t>(entries_.size() - 1));
    const Entry& entry = entries_[column];
    return static_cast<float>(scaled - column) < entry.threshold ? column : entry.alias;
  }
  /// Probability of an index: its weight over the sum of weights.
  float pmf(uint32_t index) const { return entries_[index].pmf; }
  /// How a column is shared: `threshold` of it is its own index's, the rest the alias's.
  struct Column {
    float threshold;
    uint32_t alias;
  };
  Column column(uint32_t index) const { return {entries_[index].threshold, entries_[index].alias}; }
  size_t memory_bytes() const { return entries_.capacity() * sizeof(Entry); }

 private:
  struct Entry {
    float threshold;  // share of the column that keeps its own index
    uint32_t alias;
    float pmf;
  };
  std::vector<Entry> entries_;
};

}  // namespace cistern
