#include "grid/hash_grid.h"

#include <immintrin.h>

#include <atomic>
#include <bit>
#include <numeric>
#include <string>
#include <utility>

#include "base/check.h"
#include "base/hash.h"
#include "base/parallel.h"

namespace cistern {
namespace {

// Of entries, by their number alone, so that results do not depend on threads: small enough to keep many threads busy
// with a band of a picture, few enough that adding up what they counted, which one thread does, takes no time to speak
// of.
constexpr size_t kSmallestBlock = 8192, kMostBlocks = 64;
constexpr int kDigitBits = 10;  // counters of a block fit the first cache
constexpr size_t kDigits = size_t{1} << kDigitBits;
constexpr size_t kMaxEntries = size_t{1} << 31;
constexpr size_t kTableBlock = 4096;  // segments

size_t block_size(size_t entries) { return std::max(kSmallestBlock, block_count(entries, kMostBlocks)); }

/// Turns counts per block into the positions at which blocks begin, in the order of blocks; returns the total.
uint32_t exclusive_scan(std::span<uint32_t> counts) {
  uint32_t sum = 0;
  for (uint32_t& c : counts) sum += std::exchange(c, sum);
  return sum;
}

}  // namespace

void HashGrid::build(std::span<const CellKey> keys) {
  if (keys.size() > kMaxEntries)
    throw Error("Resolution", std::to_string(keys.size()) + " entries of the grid: at most 2^31");
  gather_entries(keys);
  for (int shift = 0; shift < digit_bits_total_; shift += kDigitBits) sort_by_digit(shift);
  find_segments(keys);
  build_table();
}

/// Lists the entries that have a cell, with keys reduced to the bits in which any two of them differ.
void HashGrid::gather_entries(std::span<const CellKey> keys) {
  const size_t blocks = block_count(keys.size(), block_size(keys.size()));
  std::vector<CellKey> all_set(blocks, ~CellKey{0}), any_set(blocks, 0);
  counts_.assign(blocks, 0);
  parallel_blocks(keys.size(), block_size(keys.size()), [&](size_t block, size_t begin, size_t end) {
    CellKey all = ~CellKey{0}, any = 0;
    uint32_t count = 0;
    for (size_t i = begin; i < end; ++i) {
      if (keys[i] == kNoCell) continue;
      all &= keys[i];
      any |= keys[i];
      ++count;
    }
    all_set[block] = all;
    any_set[block] = any;
    counts_[block] = count;
  });
  const CellKey all = std::reduce(all_set.begin(), all_set.end(), ~CellKey{0}, std::bit_and<>());
  const CellKey any = std::reduce(any_set.begin(), any_set.end(), CellKey{0}, std::bit_or<>());
  const CellKey varying = any & ~all;
  digit_bits_total_ = std::popcount(varying);
  const uint32_t total = exclusive_scan(counts_);
  for (Items* items : {&sorted_, &scratch_}) {
    items->keys.resize(total);
    items->entries.resize(total);
  }
  parallel_blocks(keys.size(), block_size(keys.size()), [&](size_t block, size_t begin, size_t end) {
    uint32_t to = counts_[block];
    for (size_t i = begin; i < end; ++i) {
      if (keys[i] == kNoCell) continue;
      sorted_.keys[to] = _pext_u64(keys[i], varying);  // keeps the order of keys
      sorted_.entries[to++] = static_cast<uint32_t>(i);
    }
  });
}

/// One stable pass of a radix sort, least significant digit first: counts and moves in fixed blocks.
void HashGrid::sort_by_digit(int shift) {
  const size_t size = sorted_.keys.size(), blocks = block_count(size, block_size(size));
  counts_.assign(blocks * kDigits, 0);
  const auto digit_of = [shift](CellKey key) { return (key >> shift) & (kDigits - 1); };
  parallel_blocks(size, block_size(size), [&](size_t block, size_t begin, size_t end) {
    uint32_t* counts = counts_.data() + block * kDigits;
    for (size_t i = begin; i < end; ++i) ++counts[digit_of(sorted_.keys[i])];
  });
  uint32_t sum = 0;
  for (size_t digit = 0; digit < kDigits; ++digit)
    for (size_t block = 0; block < blocks; ++block) sum += std::exchange(counts_[block * kDigits + digit], sum);
  parallel_blocks(size, block_size(size), [&](size_t block, size_t begin, size_t end) {
    uint32_t* positions = counts_.data() + block * kDigits;
    for (size_t i = begin; i < end; ++i) {
      const uint32_t to = positions[digit_of(sorted_.keys[i])]++;
      scratch_.keys[to] = sorted_.keys[i];
      scratch_.entries[to] = sorted_.entries[i];
    }
  });
  std::swap(sorted_, scratch_);
}

void HashGrid::find_segments(std::span<const CellKey> keys) {
  const size_t size = sorted_.keys.size(), blocks = block_count(size, block_size(size));
  const auto is_first = [this](size_t i) { return i == 0 || sorted_.keys[i] != sorted_.keys[i - 1]; };
  counts_.assign(blocks, 0);
  parallel_blocks(size, block_size(size), [&](size_t block, size_t begin, size_t end) {
    uint32_t count = 0;
    for (size_t i = begin; i < end; ++i) count += is_first(i);
    counts_[block] = count;
  });
  segments_.resize(exclusive_scan(counts_));
  parallel_blocks(size, block_size(size), [&](size_t block, size_t begin, size_t end) {
    uint32_t segment = counts_[block];
    for (size_t i = begin; i < end; ++i) {
      if (!is_first(i)) continue;
      segments_[segment].key = keys[sorted_.entries[i]];
      segments_[segment].begin = static_cast<uint32_t>(i);
      if (segment > 0) segments_[segment - 1].end = static_cast<uint32_t>(i);
      ++segment;
    }
  });
  if (!segments_.empty()) segments_.back().end = static_cast<uint32_t>(size);
}

/// Threads race for slots, so where a segment stands may vary; what `find` returns does not.
void HashGrid::build_table() {
  table_.assign(std::bit_ceil(2 * std::max<size_t>(segments_.size(), 1)), 0);
  const size_t mask = table_.size() - 1;
  parallel_blocks(segments_.size(), kTableBlock, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      size_t slot = mix_bits(segments_[i].key) & mask;
      uint32_t free = 0;
      while (!std::atomic_ref(table_[slot])
                  .compare_exchange_strong(free, static_cast<uint32_t>(i + 1), std::memory_order_relaxed)) {
        slot = (slot + 1) & mask;
        free = 0;
      }
    }
  });
}

std::span<const uint32_t> HashGrid::find(CellKey key) const {
  if (table_.empty()) return {};
  const size_t mask = table_.size() - 1;
  for (size_t slot = mix_bits(key) & mask; table_[slot] != 0; slot = (slot + 1) & mask) {
    const CellSegment& segment = segments_[table_[slot] - 1];
    if (segment.key == key) return entries(segment);
  }
  return {};
}

size_t HashGrid::memory_bytes() const {
  return (sorted_.keys.capacity() + scratch_.keys.capacity()) * sizeof(CellKey) +
         (sorted_.entries.capacity() + scratch_.entries.capacity() + counts_.capacity() + table_.capacity()) *
             sizeof(uint32_t) +
         segments_.capacity() * sizeof(CellSegment);
}

}  // namespace cistern
