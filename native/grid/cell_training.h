#pragma once

#include <mutex>

#include "grid/cell_statistics.h"

namespace cistern {

/// Gathers records of many frames and makes tables of their sums; `to_statistics` makes sums of one record. The same
/// records give the same table to the last bit, in whatever order they come.
template <class Record, class Table, CellStatistics Statistics, size_t kMostPairs>
class CellTraining {
 public:
  /// From any thread.
  void add(std::span<const Record> records) {
    const std::lock_guard lock(mutex_);
    pending_.insert(pending_.end(), records.begin(), records.end());
  }
  /// A table of everything added so far.
  Table learn() {
    statistics_.reserve(statistics_.size() + pending_.size());
    for (const Record& record : pending_) statistics_.push_back(to_statistics(record));
    pending_ = {};
    sum_equal(statistics_);
    return Table(statistics_);
  }
  /// Forgets everything.
  void clear() {
    const std::lock_guard lock(mutex_);
    pending_ = {};
    statistics_ = {};
  }

  /// What was learned from so far.
  std::span<const Statistics> statistics() const { return statistics_; }
  /// Whether there are as many pairs of a cell and a part as may be kept: adding more is then in vain.
  bool is_full() const { return statistics_.size() >= kMostPairs; }
  size_t memory_bytes() const {
    return statistics_.capacity() * sizeof(Statistics) + pending_.capacity() * sizeof(Record);
  }

 private:
  std::mutex mutex_;  // guards pending_
  std::vector<Record> pending_;
  std::vector<Statistics> statistics_;
};

}  // namespace cistern
