#include "grid/nested_cell_index.h"

#include <bit>

#include "base/hash.h"

namespace cistern {

void NestedCellIndex::build(std::vector<Entry> rows, std::span<const NestedCellKey> own_cells) {
  entries_ = std::move(rows);
  slots_.clear();
  if (entries_.empty()) return;
  fill_slots();
  for (const NestedCellKey cell : own_cells) {
    if (find_exactly(cell)) continue;
    if (const auto row = find(cell)) entries_.push_back({cell, *row});
  }
  fill_slots();
}

void NestedCellIndex::fill_slots() {
  slots_.assign(std::bit_ceil(2 * entries_.size()), {});
  const size_t mask = slots_.size() - 1;
  for (const Entry& entry : entries_) {
    size_t i = first_slot(entry.cell);
    while (slots_[i].cell != kNoNestedCell) i = (i + 1) & mask;
    slots_[i] = entry;
  }
}

size_t NestedCellIndex::first_slot(NestedCellKey key) const { return mix_bits(key) & (slots_.size() - 1); }

const NestedCellIndex::Entry* NestedCellIndex::find_exactly(NestedCellKey key) const {
  const size_t mask = slots_.size() - 1;
  for (size_t i = first_slot(key); slots_[i].cell != kNoNestedCell; i = (i + 1) & mask)
    if (slots_[i].cell == key) return &slots_[i];
  return nullptr;
}

void NestedCellIndex::prefetch(NestedCellKey key) const {
  if (!slots_.empty()) __builtin_prefetch(&slots_[first_slot(key)]);
}

std::optional<uint32_t> NestedCellIndex::find(NestedCellKey key) const {
  if (slots_.empty() || key == kNoNestedCell) return std::nullopt;
  for (int step = 0; step <= kDoublings; ++step, key = coarser_cell(key))
    if (const Entry* entry = find_exactly(key)) return entry->row;
  return std::nullopt;
}

}  // namespace cistern
