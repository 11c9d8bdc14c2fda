#include "lights/learned_light_table.h"

#include <algorithm>

#include "base/alias_table.h"
#include "grid/cell_statistics.h"

namespace cistern {
namespace {

/// Part of the probabilities that ignores shadows: light that a cell's samples have not seen yet may still reach some
/// of its points.
constexpr double kUnshadowedShare = 0.3;

double lerp(double a, double b, double t) { return a + (b - a) * t; }

float visibility(const ClusterStatistics& s) {
  const double visible = s.unshadowed > 0.0 ? s.visible / s.unshadowed : 1.0;
  return static_cast<float>(std::clamp(visible, LearnedLightTable::kLeastVisibility, 1.0));
}

/// More where more clusters share in the light: with few, what is left of the noise is visibility, which weighing
/// candidates does not see.
int candidates(double entropy) {
  constexpr double kFew = 2.0, kMany = 5.0;
  const double clusters = std::exp(entropy);
  return clusters < kFew ? 1 : (clusters < kMany ? 2 : 4);
}

}  // namespace

ClusterStatistics& ClusterStatistics::operator+=(const ClusterStatistics& other) {
  visible += other.visible;
  visible_squares += other.visible_squares;
  unshadowed += other.unshadowed;
  squares += other.squares;
  squares_without += other.squares_without;
  return *this;
}

LearnedLightTable::LearnedLightTable(std::vector<ClusterStatistics> finest)
    : index_(make_rows(std::move(finest), [this](auto of_cell) { return add_row(of_cell); })) {}

std::optional<uint32_t> LearnedLightTable::add_row(std::span<const ClusterStatistics> of_cell) {
  ClusterStatistics total;
  for (const ClusterStatistics& s : of_cell) total += s;
  const double sample_size = total.visible > 0.0 ? total.visible * total.visible / total.visible_squares : 0.0;
  if (!(sample_size >= kLeastSampleSize)) return std::nullopt;
  Row row{.begin = static_cast<uint32_t>(entries_.size()), .effective_sample_size = static_cast<float>(sample_size)};
  std::vector<float> shares;
  double entropy = 0.0;
  ClusterStatistics others;
  for (const ClusterStatistics& s : of_cell) {
    const double visible = s.visible / total.visible;
    if (visible > 0.0) entropy -= visible * std::log(visible);
    const double share = lerp(visible, s.unshadowed / total.unshadowed, kUnshadowedShare);
    if (share < kLeastShare) {
      others += s;
      continue;
    }
    shares.push_back(static_cast<float>(share));
    entries_.push_back({.cluster = s.cluster, .visibility = visibility(s)});
  }
  if (shares.empty()) return std::nullopt;
  row.count = static_cast<uint32_t>(shares.size());
  row.entropy = static_cast<float>(entropy);
  row.other_visibility = visibility(others);
  row.candidates = candidates(entropy);
  const AliasTable alias(shares);
  for (uint32_t i = 0; i < row.count; ++i) {
    const AliasTable::Column column = alias.column(i);
    Entry& entry = entries_[row.begin + i];
    entry.pmf = alias.pmf(i);
    entry.threshold = column.threshold;
    entry.alias = column.alias;
  }
  rows_.push_back(row);
  return static_cast<uint32_t>(rows_.size() - 1);
}

const LearnedLightTable::Row* LearnedLightTable::find(NestedCellKey key) const {
  const auto row = index_.find(key);
  return row ? &rows_[*row] : nullptr;
}

const LearnedLightTable::Entry& LearnedLightTable::choose(const Row& row, double u) const {
  const double scaled = u * row.count;
  const auto column = std::min(static_cast<uint32_t>(scaled), row.count - 1);
  const Entry* entries = entries_.data() + row.begin;
  const Entry& entry = entries[column];
  return static_cast<float>(scaled - column) < entry.threshold ? entry : entries[entry.alias];
}

const LearnedLightTable::Entry* LearnedLightTable::find(const Row& row, uint32_t cluster) const {
  const auto entries = std::span(entries_).subspan(row.begin, row.count);
  const auto found = std::ranges::lower_bound(entries, cluster, {}, &Entry::cluster);
  return found != entries.end() && found->cluster == cluster ? &*found : nullptr;
}

size_t LearnedLightTable::memory_bytes() const {
  return rows_.capacity() * sizeof(Row) + entries_.capacity() * sizeof(Entry) + index_.memory_bytes();
}

}  // namespace cistern
