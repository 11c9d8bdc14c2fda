#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "grid/cell_key.h"

namespace cistern {

/// The entries of one cell: `HashGrid::entries()` from begin to end.
struct CellSegment {
  CellKey key;
  uint32_t begin, end;
};

/// Which entries lie in which cell. Built once a frame from the keys of all entries by sorting, so no cell is ever too
/// full and nothing depends on the number of threads. (The papers count with atomics and drop what exceeds a bucket:
/// [Boissé 2021] Alg. 2 and 5.) Buffers stay for the next build: nothing is allocated unless there are more entries or
/// cells than ever before.
class HashGrid {
 public:
  /// Keys of entries 0, 1, ...; `kNoCell` for entries that are in no cell. At most 2^31 keys, else `Error`.
  void build(std::span<const CellKey> keys);

  /// Entries of a cell in ascending order; empty for a cell without entries. Valid until the next build.
  std::span<const uint32_t> find(CellKey key) const;
  /// The cells that have entries, by ascending key.
  std::span<const CellSegment> segments() const { return segments_; }
  /// All entries that are in a cell: by cell as in `segments`, ascending within a cell.
  std::span<const uint32_t> entries() const { return sorted_.entries; }
  std::span<const uint32_t> entries(const CellSegment& segment) const {
    return entries().subspan(segment.begin, segment.end - segment.begin);
  }
  size_t memory_bytes() const;

 private:
  struct Items {
    std::vector<CellKey> keys;  // without the bits that all keys share
    std::vector<uint32_t> entries;
  };

  void gather_entries(std::span<const CellKey> keys);
  void sort_by_digit(int shift);
  void find_segments(std::span<const CellKey> keys);
  void build_table();

  Items sorted_, scratch_;
  std::vector<uint32_t> counts_;       // of blocks and digits; scratch
  std::vector<CellSegment> segments_;  // by ascending key
  std::vector<uint32_t> table_;        // open addressing: 1 + index of a segment, 0 = free; at most half full
  int digit_bits_total_ = 0;
};

}  // namespace cistern
