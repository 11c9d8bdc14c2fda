#pragma once

#include <tbb/parallel_sort.h>

#include <concepts>
#include <optional>
#include <span>
#include <vector>

#include "grid/nested_cell_index.h"

namespace cistern {

/// Sums over what was recorded of a part (a light, a bin of directions) of a cell of NestedCells.
template <class S>
concept CellStatistics = std::totally_ordered<S> && requires(S sums, const S& other) {
  { sums.cell } -> std::same_as<NestedCellKey&>;
  { other.has_part_of(other) } -> std::same_as<bool>;  // whether both are of one part, should they be of one cell
  sums += other;                                       // all but cell and part
};

/// Sorts by cell, then part, and joins what has both in common; bit-identical for any order of the input and any number
/// of threads. The order of S has to look at cell, part and then all sums.
template <CellStatistics S>
void sum_equal(std::vector<S>& statistics) {
  // By all members: equal elements are then equal to the last bit, and every sum has one order.
  tbb::parallel_sort(statistics.begin(), statistics.end());
  size_t kept = 0;
  for (size_t i = 1; i < statistics.size(); ++i) {
    S& last = statistics[kept];
    const S& next = statistics[i];
    if (last.cell == next.cell && last.has_part_of(next)) {
      last += next;
    } else {
      statistics[++kept] = next;
    }
  }
  if (!statistics.empty()) statistics.resize(kept + 1);
}

/// Calls body(statistics of a cell) for each cell of `sorted`.
template <CellStatistics S, class Body>
void for_each_cell(std::span<const S> sorted, const Body& body) {
  for (size_t begin = 0; begin < sorted.size();) {
    size_t end = begin + 1;
    while (end < sorted.size() && sorted[end].cell == sorted[begin].cell) ++end;
    body(sorted.subspan(begin, end - begin));
    begin = end;
  }
}

/// Asks add_row(statistics of a cell) for the number of a cell's row, or nothing if it gets none: for the cells of
/// `finest`, which are points' own and have each part once, then for ever coarser ones.
template <CellStatistics S, class AddRow>
NestedCellIndex make_rows(std::vector<S> finest, const AddRow& add_row) {
  std::vector<NestedCellKey> own_cells;
  std::vector<NestedCellIndex::Entry> rows;
  for (int doublings = 0; doublings <= NestedCellIndex::kDoublings; ++doublings) {
    if (doublings > 0) {
      for (S& sums : finest) sums.cell = coarser_cell(sums.cell);
      sum_equal(finest);
    }
    for_each_cell(std::span<const S>(finest), [&](std::span<const S> of_cell) {
      if (doublings == 0) own_cells.push_back(of_cell[0].cell);
      if (const std::optional<uint32_t> row = add_row(of_cell)) rows.push_back({of_cell[0].cell, *row});
    });
  }
  NestedCellIndex index;
  index.build(std::move(rows), own_cells);
  return index;
}

}  // namespace cistern
