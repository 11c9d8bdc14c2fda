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
  friend bool operator==(const PathMergeRules&, const PathMergeRules&) = default;
};

/// What a path from `finder` found, with one of the two directions of light at its sample point, picked in proportion
/// to its target, and W made up for the other. For samples that are to be merged: MIS weights are shares of targets and
/// must not depend on who found a sample. How much comes from either direction does, by the densities it was drawn
/// with; of one direction that is a factor which all targets have in common. Samples taken as found keep both.
PathReservoir keep_one_direction(const VisiblePoint& finder, const PathReservoir& found, const PathMergeRules& rules,
                                 Rng& rng);

/// Path reservoirs to merge, each with the point it was made for; the receiver is the first. A sample point is only
/// found where it is seen, and as it is only past as many transparent surfaces: so unless weights are 1/M each target
/// asks for a ray to the sample.
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
