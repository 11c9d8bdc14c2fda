#include "grid/cell_groups.h"

#include <immintrin.h>
#include <tbb/parallel_for.h>

#include "base/hash.h"
#include "base/parallel.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 8192;
constexpr uint64_t kCoordinateMask = (uint64_t{1} << kCellCoordinateBits) - 1;
constexpr uint64_t kEveryThirdBit = 0x1249249249249249ull & ((uint64_t{1} << kMortonBits) - 1);

/// Keys fold negative coordinates between positive ones; here they come in order.
uint64_t ascending(uint64_t folded) {
  const auto cell = static_cast<int64_t>(folded >> 1) ^ -static_cast<int64_t>(folded & 1);
  return static_cast<uint64_t>(cell + (int64_t{1} << (kCellCoordinateBits - 1))) & kCoordinateMask;
}

}  // namespace

uint64_t morton_key(CellKey key, uint32_t entry_class) {
  if (key == kNoCell) return kNoCell;
  uint64_t curve = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const uint64_t coordinate = ascending((key >> (kNormalBinBits + axis * kCellCoordinateBits)) & kCoordinateMask);
    curve |= _pdep_u64(coordinate, kEveryThirdBit << axis);
  }
  const auto bin = static_cast<uint64_t>(key_normal_bin(key)), level = static_cast<uint64_t>(key_level(key));
  const uint64_t kind = mix_bits((uint64_t{entry_class} << 16) | (level << kNormalBinBits) | bin);
  constexpr uint64_t kTopBit = uint64_t{1} << 63;  // stays clear: no cell may look like kNoCell
  return ((kind << kMortonBits) | curve) & ~kTopBit;
}

void CellGroups::build(std::span<const CellKey> keys, std::span<const uint32_t> classes, const GroupRules& rules,
                       uint64_t seed) {
  curve_.resize(keys.size());
  parallel_blocks(keys.size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) curve_[i] = morton_key(keys[i], classes[i]);
  });
  grid_.build(curve_);
  cuts_.clear();
  ends_.clear();
  const std::span<const CellSegment> cells = grid_.segments();
  const int fine_bits = 3 * rules.fine_levels;
  for (size_t begin = 0; begin < cells.size();) {
    size_t end = begin + 1;
    while (end < cells.size() && cells[end].key >> fine_bits == cells[begin].key >> fine_bits) ++end;
    cut(cells.subspan(begin, end - begin), rules);
    begin = end;
  }
  members_.assign(grid_.entries().begin(), grid_.entries().end());
  if (rules.interleaved) tbb::parallel_for(size_t{0}, cuts_.size(), [&](size_t i) { interleave(cuts_[i], seed); });
}

void CellGroups::cut(std::span<const CellSegment> cells, const GroupRules& rules) {
  const uint32_t first = cells.front().begin, count = cells.back().end - first;
  const Cut cell{first, count, static_cast<uint32_t>(block_count(count, static_cast<size_t>(rules.size)))};
  for (uint32_t g = 1; g <= cell.groups; ++g) ends_.push_back(cell.begin(g));
  cuts_.push_back(cell);
}

void CellGroups::interleave(const Cut& cell, uint64_t seed) {
  const std::span<const uint32_t> entries = grid_.entries().subspan(cell.first, cell.count);
  for (uint32_t row = 0; row * cell.groups < cell.count; ++row) {
    const uint32_t begin = row * cell.groups, entries_left = cell.count - begin;
    // The first groups have what the last row has.
    const bool is_full = entries_left >= cell.groups;
    const uint64_t turn = is_full ? hash_combine(seed, cell.first + begin) % cell.groups : 0;
    for (uint32_t k = 0; k < std::min(cell.groups, entries_left); ++k) {
      const auto group = static_cast<uint32_t>((k + turn) % cell.groups);
      members_[cell.begin(group) + row] = entries[begin + k];
    }
  }
}

size_t CellGroups::memory_bytes() const {
  return grid_.memory_bytes() + curve_.capacity() * sizeof(CellKey) + cuts_.capacity() * sizeof(Cut) +
         (ends_.capacity() + members_.capacity()) * sizeof(uint32_t);
}

}  // namespace cistern
