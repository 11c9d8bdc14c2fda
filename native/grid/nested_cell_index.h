#pragma once

#include <optional>
#include <span>
#include <vector>

#include "grid/nested_cells.h"

namespace cistern {

/// Rows of a table, each kept for a cell of NestedCells, found by a point's own cell: the row of the finest cell around
/// it that has one. Filled once, then read by all threads.
class NestedCellIndex {
 public:
  /// Coarser cells that are looked at: up to 2^kDoublings times the edge of a point's own.
  static constexpr int kDoublings = 4;

  /// `rows`: each cell once. `own_cells`: of points that will be asked for often; for speed alone.
  struct Entry {
    NestedCellKey cell = kNoNestedCell;
    uint32_t row = 0;
  };
  void build(std::vector<Entry> rows, std::span<const NestedCellKey> own_cells);

  /// Fetches what `find` will look at first, so that it does not wait for memory.
  void prefetch(NestedCellKey key) const;
  /// `key` is the point's own cell.
  std::optional<uint32_t> find(NestedCellKey key) const;

  size_t memory_bytes() const { return (entries_.capacity() + slots_.capacity()) * sizeof(Entry); }

 private:
  void fill_slots();
  size_t first_slot(NestedCellKey key) const;
  const Entry* find_exactly(NestedCellKey key) const;

  std::vector<Entry> entries_;  // own cells that have no row name the finest around them
  std::vector<Entry> slots_;    // the same as a hash table: open addressing, at most half full
};

}  // namespace cistern
