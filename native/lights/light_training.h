#pragma once

#include <mutex>

#include "lights/learned_light_table.h"
#include "lights/light_record.h"

namespace cistern {

/// Gathers records of many frames and makes tables of them. The same records give the same table to the last bit, in
/// whatever order they come.
class LightTraining {
 public:
  /// From any thread.
  void add(std::span<const LightRecord> records);
  /// A table of everything added so far.
  LearnedLightTable learn();

  /// By how much the mean square of light samples is smaller than by the light set's choice, over the records learned
  /// from so far; 1 without any.
  double gain() const;

  /// Whether there are as many pairs of a cell and a cluster as may be kept: adding more is then in vain.
  bool is_full() const { return statistics_.size() >= kMostPairs; }
  static constexpr size_t kMostPairs = size_t{1} << 20;
  size_t memory_bytes() const {
    return statistics_.capacity() * sizeof(ClusterStatistics) + pending_.capacity() * sizeof(LightRecord);
  }

 private:
  std::mutex mutex_;  // guards pending_
  std::vector<LightRecord> pending_;
  std::vector<ClusterStatistics> statistics_;
};

}  // namespace cistern
