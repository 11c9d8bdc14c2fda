#pragma once

#include <mutex>

#include "transport/guide_table.h"

namespace cistern {

/// Gathers records of many frames and makes tables of them. The same records give the same table to the last bit, in
/// whatever order they come.
class GuideTraining {
 public:
  /// From any thread.
  void add(std::span<const GuideRecord> records);
  /// A table of everything added so far.
  GuideTable learn();
  /// Forgets everything.
  void clear();

  /// Whether there are as many pairs of a cell and a bin as may be kept: adding more is then in vain.
  bool is_full() const { return statistics_.size() >= kMostPairs; }
  static constexpr size_t kMostPairs = size_t{1} << 22;
  size_t memory_bytes() const {
    return statistics_.capacity() * sizeof(GuideStatistics) + pending_.capacity() * sizeof(GuideRecord);
  }

 private:
  std::mutex mutex_;  // guards pending_
  std::vector<GuideRecord> pending_;
  std::vector<GuideStatistics> statistics_;
};

}  // namespace cistern
