#include "transport/guide_table.h"

#include "grid/cell_statistics.h"

namespace cistern {

GuideTable::GuideTable(std::vector<GuideStatistics> finest)
    : index_(make_rows(std::move(finest), [this](auto of_cell) { return add_row(of_cell); })) {}

std::optional<uint32_t> GuideTable::add_row(std::span<const GuideStatistics> of_cell) {
  std::array<double, DirectionHistogram::kBins> light{};
  double sum = 0.0, squares = 0.0;
  for (const GuideStatistics& s : of_cell) {
    light[s.bin] = s.light;
    sum += s.light;
    squares += s.squares;
  }
  if (!(sum * sum >= kLeastSampleSize * squares) || !(sum > 0.0)) return std::nullopt;
  rows_.emplace_back(light);
  return static_cast<uint32_t>(rows_.size() - 1);
}

const DirectionHistogram* GuideTable::find(NestedCellKey key) const {
  const auto row = index_.find(key);
  return row ? &rows_[*row] : nullptr;
}

}  // namespace cistern
