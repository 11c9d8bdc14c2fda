#include "transport/guide_table.h"

#include <tbb/parallel_sort.h>

namespace cistern {
namespace {

/// Calls body(statistics of a cell) for each cell of `sorted`.
template <class Body>
void for_each_cell(std::span<const GuideStatistics> sorted, const Body& body) {
  for (size_t begin = 0; begin < sorted.size();) {
    size_t end = begin + 1;
    while (end < sorted.size() && sorted[end].cell == sorted[begin].cell) ++end;
    body(sorted.subspan(begin, end - begin));
    begin = end;
  }
}

}  // namespace

void sum_equal_bins(std::vector<GuideStatistics>& statistics) {
  // By all members: equal elements are then equal to the last bit, and every sum has one order.
  tbb::parallel_sort(statistics.begin(), statistics.end());
  size_t kept = 0;
  for (size_t i = 1; i < statistics.size(); ++i) {
    GuideStatistics& last = statistics[kept];
    const GuideStatistics& next = statistics[i];
    if (last.cell == next.cell && last.bin == next.bin) {
      last.light += next.light;
      last.squares += next.squares;
    } else {
      statistics[++kept] = next;
    }
  }
  if (!statistics.empty()) statistics.resize(kept + 1);
}

GuideTable::GuideTable(std::vector<GuideStatistics> finest) {
  std::vector<NestedCellKey> cells;
  for_each_cell(finest, [&](std::span<const GuideStatistics> of_cell) { cells.push_back(of_cell[0].cell); });
  IndexEntries index;
  add_rows(finest, index);
  for (int step = 0; step < NestedCellIndex::kDoublings; ++step) {
    for (GuideStatistics& s : finest) s.cell = coarser_cell(s.cell);
    sum_equal_bins(finest);
    add_rows(finest, index);
  }
  index_.build(std::move(index), cells);
}

void GuideTable::add_rows(std::span<const GuideStatistics> statistics, IndexEntries& index) {
  for_each_cell(statistics, [&](std::span<const GuideStatistics> of_cell) {
    std::array<double, DirectionHistogram::kBins> light{};
    double sum = 0.0, squares = 0.0;
    for (const GuideStatistics& s : of_cell) {
      light[s.bin] = s.light;
      sum += s.light;
      squares += s.squares;
    }
    if (!(sum * sum >= kLeastSampleSize * squares) || !(sum > 0.0)) return;
    index.push_back({of_cell[0].cell, static_cast<uint32_t>(rows_.size())});
    rows_.emplace_back(light);
  });
}

const DirectionHistogram* GuideTable::find(NestedCellKey key) const {
  const auto row = index_.find(key);
  return row ? &rows_[*row] : nullptr;
}

}  // namespace cistern
