#pragma once

#include <algorithm>
#include <span>

#include "grid/hash_grid.h"

namespace cistern {

/// How entries are cut into groups. Cells of `2^fine_levels` times the edge bound the groups; within them entries are
/// taken in the order of the small cells along a Morton curve.
struct GroupRules {
  int size = 16;        // members of a group, at most
  int fine_levels = 3;  // the keys are of cells this many halvings below those that bound the groups
  /// Members of a group follow each other along the curve and lie near each other, or the groups of a cell lie among
  /// each other [Keller and Heidrich 2001]: of as many entries in a row as there are groups each has one, in a turn by
  /// chance. What members have in common neighbours then have not.
  bool interleaved = false;
  friend bool operator==(const GroupRules&, const GroupRules&) = default;
};

/// Entries in groups of nearly equal size. Built once a frame; buffers stay for the next build.
class CellGroups {
 public:
  /// `keys`: of the entries' small cells; `kNoCell` for entries in no group. `classes`: beside them; entries of
  /// different classes share no group, but for rare collisions of 12 bits. At most 2^31 keys, else `Error`. `seed`: of
  /// what is left to chance.
  void build(std::span<const CellKey> keys, std::span<const uint32_t> classes, const GroupRules& rules, uint64_t seed);

  size_t count() const { return ends_.size(); }
  std::span<const uint32_t> members(size_t group) const {
    const uint32_t begin = group == 0 ? 0 : ends_[group - 1];
    return std::span(members_).subspan(begin, ends_[group] - begin);
  }
  size_t memory_bytes() const;

 private:
  /// The groups of a large cell, of [first, first + count) of the grid's entries: as few as possible, and their sizes
  /// differ by one at most.
  struct Cut {
    uint32_t first, count, groups;
    uint32_t begin(uint32_t group) const { return first + group * (count / groups) + std::min(group, count % groups); }
  };

  void cut(std::span<const CellSegment> cells, const GroupRules& rules);
  void interleave(const Cut& cell, uint64_t seed);

  HashGrid grid_;  // its cells in the order of the curve
  std::vector<CellKey> curve_;
  std::vector<Cut> cuts_;
  std::vector<uint32_t> ends_, members_;  // by group; of one after the other
};

/// The position of a cell along a Morton curve through all cells with the same level, normal bin and class, which share
/// the bits above `kMortonBits`: a 12-bit hash.
uint64_t morton_key(CellKey key, uint32_t entry_class);
inline constexpr int kMortonBits = 3 * kCellCoordinateBits;

}  // namespace cistern
