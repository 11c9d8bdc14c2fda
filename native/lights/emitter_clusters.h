#pragma once

#include <span>
#include <vector>

#include "lights/light_set.h"

namespace cistern {

/// Emitters in groups that are chosen as one: each emitter alone as long as there are few, then those of an object, or
/// pieces of large objects, or neighbouring small ones. Inside a cluster emitters are chosen by power.
class EmitterClusters {
 public:
  static constexpr size_t kMostClusters = 2048;

  /// Emitters of a light set in its order, with the power (any unit) of each.
  EmitterClusters(std::span<const EmitterPlace> places, std::span<const float> powers,
                  size_t most_clusters = kMostClusters);

  size_t count() const { return first_.size() - 1; }
  size_t emitter_count() const { return cluster_of_.size(); }
  uint32_t cluster_of(uint32_t emitter) const { return cluster_of_[emitter]; }
  bool has_one_emitter(uint32_t cluster) const { return first_[cluster + 1] - first_[cluster] == 1; }
  /// An emitter of a cluster by `u` in [0, 1); never one without power unless none has any.
  uint32_t choose(uint32_t cluster, double u) const;
  /// Probability of an emitter within its cluster.
  float pmf(uint32_t emitter) const { return pmf_[emitter]; }
  size_t memory_bytes() const;

 private:
  void fill_probabilities(std::span<const float> powers);

  std::vector<uint32_t> cluster_of_;  // by emitter
  std::vector<float> pmf_;            // by emitter
  std::vector<uint32_t> first_;       // of each cluster, into `members_`; and the end
  std::vector<uint32_t> members_;     // emitters by cluster
  std::vector<double> cdf_;           // by member: probability of it and those before it in the cluster
};

}  // namespace cistern
