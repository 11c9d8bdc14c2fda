#pragma once

#include <array>

#include "base/rng.h"
#include "resampling/mis_weight.h"
#include "restir/path_target.h"

namespace cistern {

/// How path reservoirs are merged.
struct PathMergeRules {
  Bias bias = Bias::UNBIASED;
  PathTarget target = PathTarget::REFLECTED;
  Reflection reflection = Reflection::EVALUATED;
};

/// Path reservoirs to merge, each with the point it was made for; the receiver is the first. A sample point is only
/// found where it is seen, so unless weights are 1/M each target asks for a ray to the sample.
class PathCandidates {
 public:
  static constexpr size_t kMost = 32;

  bool is_full() const { return count_ == kMost; }
  size_t count() const { return count_; }
  void add(const VisiblePoint& point, const PathReservoir& reservoir, float confidence_cap) {
    points_[count_] = &point;
    reservoirs_[count_++] = {&reservoir.sample, reservoir.W, std::min(reservoir.c, confidence_cap)};
  }
  PathReference merge(const PathContext& context, const PathMergeRules& rules, Rng& rng, uint64_t& non_finite) const;

 private:
  std::array<PathReference, kMost> reservoirs_;
  std::array<const VisiblePoint*, kMost> points_;
  size_t count_ = 0;
};

/// A reservoir of its own from a merged one.
PathReservoir copy_of(const PathReference& reference);

}  // namespace cistern
