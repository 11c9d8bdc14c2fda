#pragma once

#include "base/direction_guide.h"
#include "base/lanes.h"

namespace cistern {

/// Guides of several places at once, each of its own, and of some none.
class DirectionGuideLanes {
 public:
  /// Refers to the guide's histogram.
  void set(size_t lane, const DirectionGuide& guide);

  /// Density of directions of which DirectionGuide::share follow the guide of their place, and the rest have the
  /// density `unguided`; per solid angle, 0 where that is 0. As DirectionGuide::pdf has it, but for rounding.
  Lanes pdf(const Lanes& unguided, const Vec3Lanes& w) const;

 private:
  struct Lobes {
    Vec3Lanes axis;
    Lanes over_square_radius = 0.0f;
    Lanes at_axis = 0.0f;  // density there, times the share of the lobe in all directions; 0: no lobe
  };

  std::array<Lobes, DirectionLobes::kMost> lobes_;
  size_t lobe_count_ = 0;  // of the place with most
  std::array<const DirectionHistogram*, kLanes> histograms_{};
  bool has_histograms_ = false;
  Lanes unguided_share_ = 1.0f;
};

}  // namespace cistern
